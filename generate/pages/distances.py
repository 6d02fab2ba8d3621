"""Deviations of theories from simulated contacts: every theory on every data set.

Deviations are ln(theory/simulation) of three quantities: area at equal force, force at equal mean separation, stiffness
at equal force. They are model errors: the theories are solved to 1e-6 or better, except for the map's law.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from generate.boundary_elements.design import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, TRAINING
from generate.boundary_elements.evidence import MAX_AREA, MIN_WAVES, Case
from generate.calibrated import QUANTITIES, errors
from generate.calibrated_table import DEPTHS
from generate.pages.page import DATA, evidence, read_csv
from mbma_tables import Surface, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.laws.calibrated import CONSTANTS, YANG_PERSSON, Law, Spectrum
from mbma_tables.laws.map_curves import MAP_CONSTANTS
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.maps import matched
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.variants import REPORTED, Variant

LOW, HIGH = 0.01, 0.97  # A/A0 of the simulations between which distances are summed up
COVER = dataclasses.replace(REPORTED, name="reported, areas as a cover", addition="cover")
MEASURED = {"al3d-1": "measured: optical map", "di-1": "measured: AFM map"}
ROLLOFF = (0.041954782, 0.037331897)  # h_max of the maps


class Curve:
    """A theory's force and area on the surface of a simulation, forces over A0 E* g, lengths over h_rms.

    Raises
    ------
    MbmaError
        Where the theory does not take the surface.
    """

    def __init__(self, answer: Callable[[AnySurface, FloatArray], Any], surface: AnySurface) -> None:
        self._answer, self._surface = answer, surface
        self._g, self._h_rms = float(surface.rms_gradient), float(surface.h_rms)
        u = DEPTHS * surface.h_max
        with np.errstate(all="ignore"):
            force, area = answer(surface, u)
        # of a theory whose force falls again, the branch of first contact
        end = np.flatnonzero(np.append(np.diff(force) <= 0, True))[0] + 1
        kept = slice(int(np.argmax(force[:end] > 0)), end)
        self._log_force, self._log_area = np.log(force[kept] / self._g), np.log(area[kept])
        self._u = u[kept] / self._h_rms

    def _at(self, values: FloatArray, force: FloatArray) -> FloatArray:
        return np.asarray(PchipInterpolator(self._log_force, values, extrapolate=False)(np.log(force)))

    def area(self, force: FloatArray) -> FloatArray:
        """A/A0 at a force, NaN where the theory does not reach it."""
        return np.exp(self._at(self._log_area, force))

    def separation(self, force: FloatArray) -> FloatArray:
        """Mean separation at a force, likewise."""
        return self._at(self._u, force)

    def force(self, u: FloatArray) -> FloatArray:
        """Force at mean separations."""
        return np.asarray(
            self._answer(self._surface, np.minimum(u * self._h_rms, float(self._surface.h_max)))[0] / self._g
        )


def surface_of(one: Case) -> AnySurface:
    """What theories are given: five numbers, or the surface's own spectrum by bands."""
    if one.kind == "self_affine":
        return Surface(float(one.node[1]), 1.0, float(one.node[2]), 1.0, one.h_max)
    x, variance = one.own_spectrum.x, one.own_spectrum.variance
    middle = np.sqrt(x[1:] * x[:-1])
    edges = np.concatenate([[x[0] ** 2 / middle[0]], middle, [x[-1] ** 2 / middle[-1]]])
    level = variance / (np.pi * np.diff(edges**2))
    q, C = np.repeat(edges, 2)[1:-1], np.repeat(level, 2)
    # of the mean square wavenumber that it has
    return MeasuredSurface(q, matched(q, C, 1.0, one.own_spectrum.gradient**2), one.h_max)


def _mbma(variant: str | Variant, island_model: str = "universal") -> Callable[[Case], Any]:
    theory = theories.Mbma(
        island_model, variant, 1e-6, outside="nan" if island_model in ("universal", "island4d") else "raise"
    )

    def answer(surface: AnySurface, u: FloatArray) -> Any:
        found = theory.totals(surface, 2 * u - np.asarray(surface.h_max))
        return found.pressure, found.area

    return lambda one: Curve(answer, surface_of(one))


def _theory(theory: theories.Theory) -> Callable[[Case], Any]:
    return lambda one: Curve(lambda surface, u: theory.answer(surface, u)[:2], surface_of(one))


def _map(one: Case) -> Any:
    if not one.curves:
        raise MbmaError("no map")
    return one.map_law(CONSTANTS, MAP_CONSTANTS)


THEORIES: dict[str, Callable[[Case], Any]] = {
    "MBMA reported": _mbma("reported"),
    "MBMA printed": _mbma("printed"),
    "MBMA fitted": _mbma("fitted"),
    "MBMA cover": _mbma(COVER),
    "calibrated": lambda one: one.law(CONSTANTS),
    "calibrated, map": _map,
    "Persson": lambda one: Law(one.spectrum, None, YANG_PERSSON),
    "Persson simplified": _theory(theories.Persson("simplified")),
    "G-W": _theory(theories.GreenwoodWilliamson()),
}
HUES = dict(zip(THEORIES, ("C0", "C1", "C9", "C4", "k", "0.5", "C3", "C6", "C2"), strict=True))
ISLAND_MODELS = {"formula": _mbma("reported", "formula"), "rigid": _mbma("reported", "rigid")}
FITTED_TO = {"training": ("calibrated", "calibrated, map"), "earlier": ("MBMA fitted",)}


@dataclasses.dataclass(frozen=True)
class DataSet:
    """Simulated surfaces of one kind, and the theories that were fitted to them."""

    title: str
    seen: Sequence[Case]
    fitted: tuple[str, ...] = ()


def distances(seen: Sequence[Case], theory: Callable[[Case], Any]) -> dict[str, FloatArray]:
    """ln(theory/simulation) at every load of every surface, NaN where the theory does not reach it."""
    parts: dict[str, list[FloatArray]] = {name: [] for name in QUANTITIES}
    for one in seen:
        with np.errstate(all="ignore"):
            try:
                curve = theory(one)
                reached = np.isfinite(curve.separation(one.force))
            except (MbmaError, ValueError):
                curve, reached = None, np.zeros(one.force.shape, bool)
            for name, values in parts.items():
                known = np.isfinite(one.u) if name == "force" and curve else reached & np.isfinite(one.u)
                found = np.full(one.force.shape, np.nan)
                if curve and known.sum() > (2 if name == "stiffness" else 0):
                    part = dataclasses.replace(one, force=one.force[known], area=one.area[known], u=one.u[known])
                    found[known] = errors(part, curve, name)
                values.append(found)
    return {name: np.concatenate(values) for name, values in parts.items()}


def held_out() -> list[Case]:
    """Self-affine surfaces of two or more longest waves a side that no fit saw."""
    return [one for one in evidence() if one.kind == "self_affine" and one.gaussian and one.split != TRAINING]


def _simulated(kind: str, spectrum: Spectrum, h_max: float, rows: Any, hurst: float = 0.8, zeta_1: float = 0) -> Case:
    """A surface of a file of numbers; rows of F/(A0 E* g), A/A0 and u/h_rms."""
    node = (kind, hurst, zeta_1, 0, 0.0)
    force, area, u = (np.asarray(row, dtype=float) for row in rows)
    return Case(kind, "", node, MIN_WAVES, 0, spectrum, spectrum, h_max, {}, force, area, u)


def _self_affine(hurst: float, zeta_1: float, h_max: float, rows: Any) -> Case:
    return _simulated("self_affine", Spectrum.self_affine(hurst, zeta_1), h_max, rows, hurst, zeta_1)


def earlier() -> list[Case]:
    """The 105 surfaces of docs/data/boundary_elements.csv, to which the variant `fitted` was fitted."""
    table, keys = read_csv("boundary_elements.csv"), ("hurst", "L_over_lambda0", "zeta_1", "seed", "n")
    found = []
    for node in dict.fromkeys(zip(*(table[key] for key in keys), strict=True)):
        own = table[np.logical_and.reduce([table[key] == value for key, value in zip(keys, node, strict=True)])]
        rows = [own[name] for name in ("force", "area", "u_over_h_rms")]
        found.append(_self_affine(float(node[0]), float(node[2]), float(own["h_max_over_h_rms"][0]), rows))
    return found


def older(name: str) -> Case:
    """One of the sets that nothing was ever fitted to: "bem", "gfmd" or "challenge"."""
    file, zeta_1, gradient, h_max = {
        "bem": ("bem_hurst0.8_zeta64.csv", 64.0, 1.0, 3.3973),
        "gfmd": ("gfmd_hurst0.8_zeta100.csv", 100.0, 0.2766, 3.4),
        "challenge": ("challenge.csv", 200.0, 1.0, 3.45),
    }[name]
    table = read_csv(file)
    rows = [table["force"] / gradient, table["area"], table["mean_separation_over_h_rms"]]
    if name != "challenge":
        return _self_affine(0.8, zeta_1, h_max, rows)
    # a plateau from a fifth of the roll-off wavenumber
    edges = np.geomspace(0.2, zeta_1, 4001)
    middle = np.sqrt(edges[1:] * edges[:-1])
    shares = np.minimum(middle**2, middle**-1.6) * np.diff(np.log(edges))
    return _simulated("plateau", Spectrum.from_shares(middle, shares), h_max, rows)


def rolloff(number: int) -> Case:
    """A surface with a plateau by its map's own spectrum."""
    force, area, _, u = np.loadtxt(DATA / f"rolloff_{number}.csv", delimiter=",").T[:4]
    table = read_csv("rolloff_spectra.csv")
    own = table[table["map"] == number]
    spectrum, h_rms = Spectrum.from_shares(own["q"], own["variance"]), np.sqrt(own["variance"].sum())
    # wavenumbers over h_rms: their unit cancels
    rows = [force / (spectrum.gradient * h_rms), area, u / h_rms]
    return _simulated("plateau", spectrum, ROLLOFF[number] / h_rms, rows)


def measured(name: str) -> Case:
    """A measured map as `python -m generate measured_maps` kept it."""
    with np.load(DATA / f"measured_{name}.npz", allow_pickle=False) as content:
        one = dict(content)
    share, seen = one["band_variance"], (one["area"] > 0) & (one["area"] < MAX_AREA)
    curves: dict[str, Any] = {
        key: one[key].astype(float) for key in ("mean_height", "top_gradient", "tension_force", "tension")
    }
    curves["anisotropy"] = float(one["anisotropy"])
    spectrum = Spectrum.from_shares(one["band_q"][share > 0], share[share > 0])
    rows = [one[key][seen] for key in ("force", "area", "mean_separation")]
    return dataclasses.replace(_simulated("measured", spectrum, float(one["h_max"]), rows), curves=curves)


def data_sets() -> dict[str, DataSet]:
    """All data sets, by name."""

    def chosen(kinds: Sequence[str], splits: Sequence[str], low: int = MIN_WAVES, high: int = 99) -> list[Case]:
        return [one for one in evidence() if one.kind in kinds and one.split in splits and low <= one.waves <= high]

    tested, plain = (HELD_OUT_SURFACE, HELD_OUT_SPECTRUM), ("self_affine",)
    transformed = ("peaks", "valleys", "worn", "patchy")
    return {
        "spectra": DataSet("new spectra", chosen(plain, (HELD_OUT_SPECTRUM,))),
        "surfaces": DataSet("new surfaces of fitted spectra", chosen(plain, (HELD_OUT_SURFACE,))),
        "training": DataSet("the training set", chosen(plain, (TRAINING,)), FITTED_TO["training"]),
        "one": DataSet("one longest wave a side", chosen(plain, (TRAINING, *tested), 1, 1)),
        "plateau": DataSet("with plateau or instrument's filter", chosen(("plateau", "filtered"), tested)),
        "stretched": DataSet("stretched", chosen(("stretched",), tested)),
        "transformed": DataSet("heights transformed", chosen(transformed, tested)),
        "earlier": DataSet("105 earlier surfaces", earlier(), FITTED_TO["earlier"]),
        "bem": DataSet("an older set, mean of 4", [older("bem")]),
        "gfmd": DataSet("molecular dynamics", [older("gfmd")]),
        "challenge": DataSet("contact challenge", [older("challenge")]),
        "rolloff": DataSet("two with plateau, by spectrum", [rolloff(0), rolloff(1)]),
        **{name: DataSet(title, [measured(name)]) for name, title in MEASURED.items()},
    }


def summed_up(seen: Sequence[Case], found: FloatArray, low: float = LOW, high: float = HIGH) -> tuple[float, ...]:
    """Root mean square of distances at contacts from `low` to `high`, 90% quantile of their size, share reached."""
    area = np.concatenate([one.area for one in seen])
    values = found[(area >= low) & (area <= high)]
    known = values[np.isfinite(values)]
    if not known.size:
        return np.nan, np.nan, 0.0
    return float(np.sqrt(np.mean(known**2))), float(np.quantile(np.abs(known), 0.9)), known.size / values.size
