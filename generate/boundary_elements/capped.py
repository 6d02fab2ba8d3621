"""Boundary elements with pressures capped at the hardness: 0 <= p <= p_m, mean p given, half-spaces elastic, E* = 1.

Tamaas has the problem too (KatoSaturated), but its iteration always runs to its limit. Here conjugate gradients run on
the points that are free to move, and every step is projected exactly (in the Euclidean norm) onto the set of pressures
that are allowed; scaling the load instead can cycle. Loading only, frictionless, hardness constant.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib.metadata
import itertools
import time
from typing import Any

import numpy as np
import scipy.fft
from scipy.sparse.linalg import LinearOperator, cg
from scipy.special import erfinv

from generate.boundary_elements.solve import Contact, prepared
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.bearing_curve import wavevectors
from mbma_tables.laws.boundary_elements import CORRECTION
from mbma_tables.laws.reynolds import flow_conductance

TOLERANCE = 1e-6  # mean complementarity error over mean pressure times h_rms
MAX_ITERATIONS = 3000
STIFFNESS_RTOL = 1e-4
# of the boundary of the area in cell edges: elastic points beside yielded ones, and the yielded area's own boundary
MIXED, YIELDED = 0.8, 0.65

HARDNESSES = (0.025, 0.05, 0.1, 0.2, 0.4, 0.8, np.inf)  # eta = p_m/(E* g)
AREAS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.18, 0.3, 0.45, 0.6, 0.75, 0.9)  # that loads aim at
QUANTITIES = (
    *("area", "area_raw", "area_yielded", "area_yielded_raw", "mean_separation", "plane_separation", "energy"),
    *("frozen_stiffness", "residual", "iterations", "seconds"),
)

# of flow, F/(A0 E* g): 0.5% to 42% contact, where the last cells are blocked; and of the largest grids
FLOW_LOADS = (0.0025, 0.005, 0.01, 0.02, 0.035, 0.055, 0.08, 0.105, 0.13, 0.155, 0.18, 0.2, 0.22)
FEW_LOADS = (0.005, 0.02, 0.055, 0.08, 0.105, 0.13, 0.155)
FLOW_AREAS = (0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)  # that loads of surfaces that yield aim at
LARGE = 1024
OF_FLOW = ("area", "area_raw", "mean_separation", "residual", "seconds")


def project(p: FloatArray, mean: float, cap: float) -> FloatArray:
    """The nearest pressures in [0, cap] of that mean: all shifted alike, then clipped; the shift by Newton's method."""
    low, high = float(p.min()) - cap if np.isfinite(cap) else float(p.min()) - mean - 1, float(p.max())
    shift, total = 0.0, mean * p.size
    for _ in range(200):
        moved = p - shift
        clipped = np.clip(moved, 0, cap)
        miss = float(clipped.sum()) - total
        if abs(miss) <= 1e-13 * total:
            break
        if miss > 0:
            low = max(low, shift)
        else:
            high = min(high, shift)
        free = int(np.count_nonzero((moved > 0) & (moved < cap)))
        following = shift + miss / free if free else 0.5 * (low + high)
        shift = following if low < following < high else 0.5 * (low + high)
    return clipped


@dataclasses.dataclass
class CappedContact:
    """A periodic map against a rigid plane; each load starts from the pressures of the one before."""

    surface: FloatArray
    sizes: tuple[float, float]
    cap: float
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        self.surface = self.surface - self.surface.mean()
        self.h_rms = float(self.surface.std())
        q = np.hypot(*wavevectors(self.surface.shape, self.sizes))
        self._compliance = np.divide(2.0, q, out=np.zeros_like(q), where=q > 0)
        self._stiffness = q / 2
        self.pressure: FloatArray | None = None

    def _filtered(self, field: FloatArray, filter_: FloatArray) -> FloatArray:
        modes = scipy.fft.rfft2(field) * filter_
        return np.asarray(scipy.fft.irfft2(modes, s=field.shape, overwrite_x=True))

    def deflect(self, pressure: FloatArray) -> FloatArray:
        """Displacement of mean zero."""
        return self._filtered(pressure, self._compliance)

    def press(self, force: float) -> dict[str, float]:
        """Contact under a mean pressure F/(A0 E*)."""
        started = time.process_time()
        shape, cap = self.surface.shape, self.cap
        p = np.full(shape, force) if self.pressure is None else project(self.pressure, force, cap)
        gap = self.deflect(p) - self.surface
        direction, size, free_before = np.zeros(shape), 1.0, None
        for iteration in range(MAX_ITERATIONS):
            inside = (p > 0) & (p < cap)
            if inside.any():
                level = float(gap[inside].mean())
            else:
                # any level between open and yielded points
                level = 0.5 * (float(gap[p <= 0].min(initial=np.inf)) + float(gap[p >= cap].max(initial=-np.inf)))
            rest = gap - level
            # what is left to gain by each point, over the load
            wrong = np.where(rest > 0, rest * p, -rest * np.minimum(cap - p, force))
            residual = float(wrong.mean()) / (force * self.h_rms)
            if residual <= self.tolerance:
                break
            free = inside | ((p <= 0) & (rest < 0)) | ((p >= cap) & (rest > 0))
            slope = np.where(free, rest - rest[free].mean(), 0.0)
            new_size = float(np.sum(slope * slope))
            kept = free_before is not None and np.array_equal(free, free_before)
            direction = slope + (new_size / size if iteration and size > 0 else 0.0) * np.where(free, direction, 0.0)
            if free_before is not None and not kept:
                direction = np.where(free, direction - direction[free].mean(), 0.0)
            size, free_before = new_size, free
            moved = self.deflect(direction)
            step = float(np.sum(slope * direction)) / float(np.sum(direction * moved))
            if not step > 0:
                direction, step = slope, new_size / float(np.sum(slope * self.deflect(slope)))
            # held points are pushed against their bounds, so that the projection's shift does not free them
            p = project(p - step * np.where(free, direction, rest), force, cap)
            gap = self.deflect(p) - self.surface
        else:
            raise RuntimeError(f"capped boundary elements at F/(A0 E*) = {force:g}, p_m = {cap:g}: {residual:.1e} left")
        self.pressure, self._rest = p, rest
        return self._found(force, residual, iteration) | {"seconds": time.process_time() - started}

    def _found(self, force: float, residual: float, iterations: int) -> dict[str, float]:
        assert self.pressure is not None
        p, rest = self.pressure, self._rest
        touching, yielded = p > 0, p >= self.cap * (1 - 1e-9)
        elastic = touching & ~yielded
        turns = list(itertools.product((1, -1), (0, 1)))
        beside = np.any([np.roll(yielded, *turn) for turn in turns], axis=0)
        gaps = [~np.roll(touching, *turn) for turn in turns]
        open_edges, mixed_edges = (np.count_nonzero(points & gaps) for points in (elastic, elastic & beside))
        own_edges = np.count_nonzero([yielded & ~np.roll(yielded, *turn) for turn in turns])
        raw, raw_yielded, full = float(touching.mean()), float(yielded.mean()), force / self.cap
        area = raw - CORRECTION * (open_edges + MIXED * mixed_edges) / p.size
        return {
            "area": max(area, full),
            "area_yielded": min(raw_yielded + YIELDED * CORRECTION * own_edges / p.size, full),
            "area_raw": raw,
            "area_yielded_raw": raw_yielded,
            "mean_separation": float(np.maximum(rest, 0).mean()),
            "plane_separation": float(rest.mean()),
            "energy": float(np.mean(p * self.deflect(p)) / 2),
            "residual": residual,
            "iterations": float(iterations),
        }

    @property
    def gap(self) -> FloatArray:
        """Of the bodies, yielded points flattened."""
        return np.maximum(self._rest, 0)

    def frozen_stiffness(self) -> float:
        """-dF/du of the contact area as it is, sticking neither to yielding nor to opening [E*/length].

        Pressures on the area alone, of mean 1, that move it as a whole: preconditioned conjugate gradients.
        """
        assert self.pressure is not None
        touching = self.pressure > 0
        count = int(touching.sum())

        def inside(field: FloatArray, filter_: FloatArray) -> FloatArray:
            """Filtered, on the area, of mean zero."""
            found = self._filtered(field.reshape(touching.shape), filter_)
            return np.where(touching, found - found[touching].mean(), 0.0).ravel()

        flat = np.where(touching, touching.size / count, 0.0)
        moves, stiffens = (
            LinearOperator((flat.size, flat.size), functools.partial(inside, filter_=own), dtype=float)
            for own in (self._compliance, self._stiffness)
        )
        found, failed = cg(moves, -moves @ flat.ravel(), rtol=STIFFNESS_RTOL, maxiter=MAX_ITERATIONS, M=stiffens)
        if failed:
            raise RuntimeError("the stiffness of a frozen contact was not found")
        return 1 / float(self.deflect(flat + found.reshape(flat.shape))[touching].mean())


def load_at(area: float, eta: float) -> float:
    """F/(A0 E* g) at about that A/A0, below eta."""
    elastic = float(erfinv(area)) * np.sqrt(0.3 + 0.2 * area)
    return float(((eta * area) ** -2.0 + elastic**-2.0) ** -0.5)


def simulate_capped(recipe: Recipe) -> dict[str, Any]:
    """All that is kept of one surface: lengths in h_rms, force in A0 E* g, rows for `HARDNESSES`, columns for loads."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    units = {"mean_separation": h_rms, "plane_separation": h_rms, "energy": h_rms, "frozen_stiffness": 1 / h_rms}
    found = np.empty((len(QUANTITIES), len(HARDNESSES), len(AREAS)))
    forces = np.array([[load_at(area, eta) for area in AREAS] for eta in HARDNESSES])
    for row, eta in enumerate(HARDNESSES):
        contact = CappedContact(surface, recipe.sizes, eta)
        for column, force in enumerate(forces[row]):
            result = contact.press(force)
            result["frozen_stiffness"] = contact.frozen_stiffness()
            found[:, row, column] = [result[name] / units.get(name, 1.0) for name in QUANTITIES]
    return {**dict(zip(QUANTITIES, found, strict=True)), **known, "force": forces, "engine": "conjugate gradients here"}


def solve_flow(recipe: Recipe) -> dict[str, Any]:
    """Contact and flow coefficient, by Reynolds' equation, of one surface up to its blocking: lengths in h_rms."""
    surface, spectrum, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    contact: Contact | CappedContact = Contact(surface, recipe.sizes)
    loads: tuple[float, ...] = FEW_LOADS if recipe.points >= LARGE else FLOW_LOADS
    if recipe.kind == "yielded":
        contact = CappedContact(surface, recipe.sizes, recipe.shape)
        loads = tuple(load_at(area, recipe.shape) for area in FLOW_AREAS)
    rows, flows = [], []
    for force in loads:
        result = contact.press(force)
        flows.append(flow_conductance(contact.gap / h_rms, recipe.sizes))
        rows.append([result[name] for name in OF_FLOW])
        if not flows[-1].any():
            break
    length = np.array([1, 1, h_rms, h_rms, 1])
    held = spectrum.variance > 0
    return {
        **dict(zip(OF_FLOW, (np.array(rows) / length).T, strict=True)),
        "force": np.array(loads[: len(flows)]),
        "flow": np.array(flows),
        **known,
        "band_q": np.where(held, spectrum.q / recipe.q0, np.nan),
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}",
    }
