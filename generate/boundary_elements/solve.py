"""One surface pressed flat: contact by Tamaas, with a hardness or with flow by the library's own boundary elements.

Tamaas has pressures capped at a hardness too (KatoSaturated), but its iteration always runs
to its limit.
"""

import importlib.metadata
import io
import os
import pathlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import erfinv

from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.common.arguments import FloatArray, needed
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.files import write_file
from mbma_tables.surfaces import bearing_curve
from mbma_tables.surfaces.bearing_curve import band_sums, bearing, radial_bands
from mbma_tables.theories.simulated import boundary_elements
from mbma_tables.theories.simulated.boundary_elements import CORRECTION, TOLERANCE
from mbma_tables.theories.simulated.boundary_elements import LOADS as LOADS
from mbma_tables.theories.simulated.map_gaps import OPEN_SHARES
from mbma_tables.theories.simulated.reynolds import flow_conductance

# beyond LOADS, where heavy tails of the gradient keep gaps open
HIGHER_LOADS = (1.5, 2.1, 3.0)
FULL = 0.96
QUANTITIES = (
    "area",
    "area_raw",
    "mean_separation",
    "energy",
    "pressure_weighted_height",
    "residual",
    "seconds",
)

HARDNESSES = (0.025, 0.05, 0.1, 0.2, 0.4, 0.8, np.inf)  # eta = p_m/(E* g)
AREAS = (
    0.003,
    0.006,
    0.012,
    0.025,
    0.05,
    0.1,
    0.18,
    0.3,
    0.45,
    0.6,
    0.75,
    0.9,
)  # that loads aim at
CAPPED = (
    *(
        "area",
        "area_raw",
        "area_yielded",
        "area_yielded_raw",
        "mean_separation",
        "plane_separation",
        "energy",
    ),
    *("frozen_stiffness", "residual", "iterations", "seconds"),
)
# of flow, F/(A0 E* g): 0.5% to 42% contact, where the last cells are blocked; and of the
# largest grids
FLOW_LOADS = (
    0.0025,
    0.005,
    0.01,
    0.02,
    0.035,
    0.055,
    0.08,
    0.105,
    0.13,
    0.155,
    0.18,
    0.2,
    0.22,
)
FEW_LOADS = (0.005, 0.02, 0.055, 0.08, 0.105, 0.13, 0.155)
FLOW_AREAS = (
    0.01,
    0.03,
    0.06,
    0.1,
    0.15,
    0.2,
    0.25,
    0.3,
    0.35,
    0.4,
    0.45,
    0.5,
    0.55,
)  # that loads of surfaces that yield aim at
RANGES = np.geomspace(0.001, 10.0, 25)  # of attractions, over h_rms
GAP_TOLERANCE = 1e-5
LARGE = 1024
OF_FLOW = ("area", "area_raw", "mean_separation", "residual", "seconds")
# of large grids: 0.1% to 89% contact, those first that tell most
WIDE_LOADS = (0.1, 0.4, 0.02, 0.0015, 0.2, 0.75, 0.045, 0.0045, 0.01, 0.0005)
# contact fractions that loads of large grids with a hardness aim at, below the bulk's yield
WIDE_AREAS = (0.2, 0.04, 0.01, 0.1, 0.3)
WIDE_TOLERANCE = 1e-5
WIDE = (
    *("area", "area_raw", "mean_separation", "energy", "pressure_weighted_height"),
    *("residual", "iterations", "seconds"),
)
LENGTHS = (
    "mean_separation",
    "plane_separation",
    "energy",
    "pressure_weighted_height",
)  # in h_rms

MAX_ITERATIONS = 50_000  # surfaces stretched 1:16 take 4,000
Solve = Callable[[Any], dict[str, Any]]  # of a recipe, what is kept of its simulation


class Contact:
    """A map against a rigid plane: Polonsky and Keer's conjugate gradients as Tamaas has them, E* = 1.

    Each load starts from the pressures of the one before; `gap` has the last one's gaps,
    zero in contact. The map is not periodic if "dcfft", a convolution, is its `operator`.
    """

    gap: FloatArray

    def __init__(
        self,
        surface: FloatArray,
        sizes: tuple[float, float],
        tolerance: float = TOLERANCE,
        operator: str = "",
    ) -> None:
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        tamaas = needed("tamaas")
        tamaas.set_log_level(tamaas.LogLevel.error)
        self.surface = np.ascontiguousarray(surface, dtype=float)
        self.model = tamaas.ModelFactory.createModel(
            tamaas.model_type.basic_2d, list(map(float, sizes)), list(surface.shape)
        )
        self.model.E, self.model.nu = 1.0, 0.0
        self._solver = tamaas.PolonskyKeerRey(self.model, self.surface, tolerance)
        self._solver.max_iter, self._operator = MAX_ITERATIONS, operator
        if operator:
            tamaas.ModelFactory.registerNonPeriodic(self.model, operator)
            self._solver.setIntegralOperator(operator)
        self._tolerance = tolerance

    @property
    def traction(self) -> FloatArray:
        return np.asarray(self.model.traction)

    def press(self, force: float) -> dict[str, float]:
        """Contact under a mean pressure F/(A0 E*); areas as shares of A0, lengths as those of the map."""
        started = time.process_time()
        try:
            residual = self._solver.solve(force)
        except (ArithmeticError, RuntimeError) as fault:
            # of a single element in contact, for instance
            raise ConvergenceError(
                f"boundary elements at F/(A0 E*) = {force:g} fail: {fault}"
            ) from None
        if not residual <= self._tolerance:
            raise ConvergenceError(
                f"boundary elements at F/(A0 E*) = {force:g} end with a residual of {residual:.1e}"
            )
        seconds = time.process_time() - started
        pressure = self.traction
        moved = np.asarray(self.model.displacement)
        if self._operator:
            self.model.operators[self._operator](pressure, moved)
        touching = pressure > 0
        edges = sum(
            int(np.count_nonzero(touching != np.roll(touching, 1, axis)))
            for axis in (0, 1)
        )
        raw = float(touching.mean())
        # the engine moves the whole surface by the gap; elastic energy has the displacement
        # about its mean
        gap = moved - self.surface
        self.gap = np.where(touching, 0.0, np.maximum(gap - gap[touching].mean(), 0.0))
        return {
            "area": raw - CORRECTION * edges / touching.size,
            "area_raw": raw,
            "approach": float(gap[touching].mean()),
            "mean_separation": float(gap.mean() - gap[touching].mean()),
            "energy": float(np.mean(pressure * (moved - moved.mean())) / 2),
            "pressure_weighted_height": float(np.mean(pressure * self.surface) / force),
            "residual": float(residual),
            "seconds": seconds,
        }


def engine() -> str:
    return f"Tamaas {importlib.metadata.version('tamaas')}"


def kept(
    results: list[dict[str, float]], names: tuple[str, ...], h_rms: float
) -> dict[str, FloatArray]:
    """Quantities of loads by name, lengths in h_rms."""
    return {
        name: np.array([r[name] for r in results]) / (h_rms if name in LENGTHS else 1)
        for name in names
    }


def prepared(
    unscaled: FloatArray, sizes: tuple[float, float], q0: float
) -> tuple[FloatArray, Any, dict[str, Any]]:
    """A map at rms gradient 1, so that mean pressure is F/(A0 E* g), its spectrum, and what laws may know, in h_rms."""
    surface = unscaled / bearing(unscaled, sizes).gradient
    known, (power, q, band) = bearing(surface, sizes), radial_bands(surface, sizes)
    powers = (band_sums(power * np.where(q > 0, q, 1) ** n, band) for n in (0, -2, 2, 4))
    variance, inverse, gradient, curvature = powers
    per_variance = 1 / np.where(variance > 0, variance, np.nan)
    h_rms = known.h_rms
    plain = ("top_gradient", "tension_force", "tension", "anisotropy", "slope_kurtosis")
    curves: dict[str, Any] = {name: getattr(known, name) for name in plain}
    curves |= {
        name: getattr(known, name) / h_rms
        for name in ("h_max", "quantiles", "mean_height")
    }
    return (
        surface,
        band,
        curves
        | {
            "q0_h_rms": q0 * h_rms,
            "band_q": np.sqrt(gradient * per_variance) / q0,
            "band_variance": variance / h_rms**2,
            "band_inverse_q2": inverse * per_variance * q0**2,
            "band_gradient": gradient,
            # in units of 1/h_rms^2: m0 m4/m2^2 is 4 times its sum at g = 1
            "band_curvature": 0.375 * curvature * h_rms**2,
            "numpy": np.__version__,
        },
    )


def simulate(recipe: Recipe) -> dict[str, Any]:
    return pressed(heights(recipe), recipe.sizes, recipe.q0)


def pressed(
    unscaled: FloatArray, sizes: tuple[float, float], q0: float
) -> dict[str, Any]:
    """All that is kept of one periodic map: lengths in h_rms, force in A0 E* g, energy in A0 E* g h_rms."""
    surface, band, curves = prepared(unscaled, sizes, q0)
    h_rms = float(surface.std())
    wavenumber = np.hypot(*bearing_curve.wavevectors(surface.shape, sizes))
    wavenumber[0, 0] = np.inf
    weights = bearing_curve.half_plane_weights(surface.shape)
    contact = Contact(surface, sizes)
    rows = list[dict[str, float]]()
    shares = list[FloatArray]()
    for force in (*LOADS, *HIGHER_LOADS):
        if force > LOADS[-1] and rows[-1]["area"] > FULL:
            break
        rows.append(contact.press(force))
        # elastic energy by bands, sum |p_q|^2/|q|: longer waves than the surface has, its
        # bands, shorter ones
        modes = (
            np.abs(np.fft.rfft2(contact.traction) / surface.size) ** 2
            * weights
            / wavenumber
        )
        shares.append(
            np.bincount(band.ravel(), modes.ravel(), bearing_curve.BANDS + 2) / h_rms
        )
    forces = np.array((*LOADS, *HIGHER_LOADS)[: len(rows)])
    found = {"force": forces, "band_energy": np.array(shares), "engine": engine()}
    return curves | kept(rows, QUANTITIES, h_rms) | found


def load_at(area: float, eta: float) -> float:
    """F/(A0 E* g) at about that A/A0, below eta."""
    elastic = float(erfinv(area)) * np.sqrt(0.3 + 0.2 * area)
    return float(((eta * area) ** -2.0 + elastic**-2.0) ** -0.5)


def simulate_capped(recipe: Recipe) -> dict[str, Any]:
    """All that is kept of one surface: lengths in h_rms, force in A0 E* g, rows for `HARDNESSES`, columns for loads."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    forces = np.array([[load_at(area, eta) for area in AREAS] for eta in HARDNESSES])
    found = []
    for eta, loads in zip(HARDNESSES, forces, strict=True):
        contact = boundary_elements.BoundaryElementContact(
            surface, recipe.sizes, hardness=eta
        )
        results = [
            contact.press(force)
            | {"frozen_stiffness": contact.frozen_stiffness() * h_rms}
            for force in loads
        ]
        found.append(kept(results, CAPPED, h_rms))
    rows = {name: np.array([row[name] for row in found]) for name in CAPPED}
    return known | rows | {"force": forces, "engine": "conjugate gradients here"}


def solve_flow(recipe: Recipe) -> dict[str, Any]:
    """Contact and flow coefficient, by Reynolds' equation, of one surface up to its blocking: lengths in h_rms."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    contact: Any = Contact(surface, recipe.sizes)
    loads: tuple[float, ...] = FEW_LOADS if recipe.points >= LARGE else FLOW_LOADS
    if recipe.kind == "yielded":
        contact = boundary_elements.BoundaryElementContact(
            surface, recipe.sizes, hardness=recipe.shape
        )
        loads = tuple(load_at(area, recipe.shape) for area in FLOW_AREAS)
    rows = list[dict[str, float]]()
    flows = list[FloatArray]()
    for force in loads:
        rows.append(contact.press(force))
        flows.append(flow_conductance(contact.gap / h_rms, recipe.sizes))
        if not flows[-1].any():
            break
    found = {
        "engine": engine(),
        "force": np.array(loads[: len(flows)]),
        "flow": np.array(flows),
    }
    return known | kept(rows, OF_FLOW, h_rms) | found


def solve_gaps(recipe: Recipe) -> dict[str, Any]:
    """Contact and distribution of gaps of one surface: lengths in h_rms, force in A0 E* g."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    contact = boundary_elements.BoundaryElementContact(
        surface, recipe.sizes, GAP_TOLERANCE
    )
    forces = [load_at(area, np.inf) for area in AREAS]
    rows = list[dict[str, float]]()
    quantiles = list[FloatArray]()
    moments = list[FloatArray]()
    for force in forces:
        rows.append(contact.press(force))
        open_gap = contact.gap[contact.traction <= 0] / h_rms
        quantiles.append(np.quantile(open_gap, OPEN_SHARES))
        decay = [np.exp(-open_gap / length).sum() / surface.size for length in RANGES]
        moments.append(np.array(decay))
    found = {
        "engine": "conjugate gradients here",
        "force": np.array(forces),
        "gap_quantile": np.array(quantiles),
        "gap_moment": np.array(moments),
    }
    return known | kept(rows, OF_FLOW, h_rms) | found


def wide_loads(recipe: Recipe) -> tuple[float, ...]:
    """F/(A0 E* g) of a large surface, those first that tell most."""
    if recipe.kind == "yielded":
        return tuple(load_at(area, recipe.shape) for area in WIDE_AREAS)
    return WIDE_LOADS


def simulate_wide(recipe: Recipe, folder: pathlib.Path) -> dict[str, Any]:
    """Contact of one large surface by the library's boundary elements, each load into the file at once.

    Loads that the file has are not solved again. Lengths in h_rms, force in A0 E* g.
    """
    path = folder / f"{recipe.name}.npz"
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    found = known | {name: np.array([]) for name in ("force", *WIDE)}
    loads = wide_loads(recipe)
    found |= {"engine": "conjugate gradients here", "planned": len(loads)}
    if path.exists():
        with np.load(path, allow_pickle=False) as content:
            found = dict(content)
    hardness = recipe.shape if recipe.kind == "yielded" else np.inf
    contact = boundary_elements.BoundaryElementContact(
        surface, recipe.sizes, WIDE_TOLERANCE, hardness=hardness
    )
    for force in loads:
        if force in found["force"]:
            continue
        row = kept([contact.press(force)], WIDE, h_rms) | {"force": np.array([force])}
        found |= {name: np.append(found[name], own) for name, own in row.items()}
        rising = np.argsort(found["force"])
        found |= {name: found[name][rising] for name in row}
        write_npz(path, found)
    return found


def is_solved(path: pathlib.Path, recipe: Recipe) -> bool:
    """Whether a surface's file has all its loads, which may be more than when it was begun."""
    if not path.exists():
        return False
    with np.load(path, allow_pickle=False) as content:
        return "planned" not in content or set(wide_loads(recipe)) <= set(
            content["force"].tolist()
        )


SOLVERS: dict[str, Solve] = {
    "elastic": simulate,
    "hardness": simulate_capped,
    "leakage": solve_flow,
    "gaps": solve_gaps,
}
# solvers that keep every load at once are told where
KEEPING: dict[str, Callable[..., dict[str, Any]]] = {"bandwidth": simulate_wide}


def npz(found: dict[str, Any]) -> bytes:
    """Arrays by name as a file."""
    content = io.BytesIO()
    np.savez_compressed(content, **found)
    return content.getvalue()


def write_npz(path: pathlib.Path, found: dict[str, Any]) -> None:
    """Write arrays by name into a file, which stands only when it is whole."""
    write_file(path, npz(found))


def simulated(recipe: Recipe, solve: Solve) -> tuple[str, bytes | str]:
    """The name of a surface and its file, or what failed."""
    try:
        found = solve(recipe)
    except (ArithmeticError, RuntimeError) as fault:
        return recipe.name, str(fault)
    return recipe.name, npz(found)
