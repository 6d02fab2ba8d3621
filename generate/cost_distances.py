"""Rows of tables/distance.csv: deviation of theories from boundary elements, and processor time."""

import functools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator

from generate.boundary_elements.surfaces import Recipe, heights
from generate.calibrated_file import rms
from generate.distances import (
    COVER,
    ISLAND_MODELS,
    RANGES,
    THEORIES,
    distances,
    held_out,
    summed_up,
)
from generate.files import ROOT, read_csv, to_csv
from generate.timing import measure
from mbma_tables import Surface, contact, contact_law
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories import Mbma, Persson, Theory
from mbma_tables.theories.calibrated.formulas import Spectrum, SpectrumLaw, area


class Distance(NamedTuple):
    """A method for a theory: its cost, and the theory's deviation from boundary elements.

    Deviations are those on held-out surfaces: root mean squares of ln(theory/simulation), of area
    at equal force and of force at equal mean separation, light at 1-10% contact and deep at 10-97%.
    """

    theory: str
    way: str
    cost: float  # cost of a point, over that of the fixed work
    once: float  # cost of preparing a surface
    area_light: float
    area_deep: float
    force_light: float
    force_deep: float
    reached_light: float  # share of simulated loads that the theory reaches
    reached_deep: float


SIMULATED = "boundary elements"
# of each timed surface, in one call
POINTS = 1000
SLOW_POINTS = 50
SLOW = ("inverse of (19)", "exact")
# surfaces of the grids
TIMED = (
    Surface(0.3, 1.0, 12.0, 1.0, 3.4),
    Surface(0.5, 1.0, 21.0, 1.0, 3.6),
    Surface(0.9, 1.0, 12.0, 1.0, 3.0),
)
MAP = Recipe("self_affine", 0.8, 16.0, 4, 1, 256)
LAW_RTOL = 1e-6
# theory, way, and the theory as `contact` and `contact_law` take it
WAYS: tuple[tuple[str, str, str | Theory], ...] = (
    ("calibrated", "table", "calibrated"),
    ("calibrated", "law", "calibrated"),
    ("Persson", "inverse of (19)", "persson"),
    ("Persson", "law", "persson"),
    ("Persson simplified", "inverse of (20)", Persson("simplified")),
    ("G-W", "quadrature", "greenwood_williamson"),
    ("G-W", "law", "greenwood_williamson"),
    ("MBMA reported", "universal", Mbma("universal", rtol=LAW_RTOL)),
    ("MBMA reported", "exact", Mbma("exact", rtol=LAW_RTOL)),
    ("MBMA reported", "island4d", Mbma("island4d", rtol=LAW_RTOL)),
    *(("MBMA reported", name, Mbma(name, rtol=1e-4)) for name in ISLAND_MODELS),
    ("MBMA reported", "law", "mbma"),
    *(
        (f"MBMA {name}", "universal", Mbma(variant=name, rtol=LAW_RTOL))
        for name in ("printed", "fitted")
    ),
    ("MBMA cover", "universal", Mbma(variant=COVER, rtol=LAW_RTOL)),
)
HEAD = """\
# Distance of theories from boundary elements on held-out surfaces, and processor time, by python -m generate cost;
# docs/lookup.md says how. Distances are root mean squares of ln(theory/simulation), light at 1-10% contact and deep
# at 10-97%; reached is the share of simulated loads there that the theory reaches. cost is of one point, once of what
# is made beforehand for a surface, both over the fixed piece of work of cost.csv.
"""


def timed(answer: Callable[[Surface, FloatArray], Any], count: int = POINTS) -> float:
    """Cost of a point, of mean separations of each surface in one call a surface."""
    share_of_h_max = np.linspace(0.02, 0.98, count)
    pairs = [(surface, share_of_h_max * float(surface.h_max)) for surface in TIMED]

    def run() -> list[Any]:
        return [answer(surface, u) for surface, u in pairs]

    cost, _ = measure(run)
    return cost / (len(pairs) * count)


def quadrature(surface: Surface, u: FloatArray) -> Any:
    """Force and area by the calibrated law's own integrals."""
    spectrum = Spectrum.self_affine(float(surface.hurst), float(surface.zeta_1))
    law = SpectrumLaw(spectrum, float(surface.h_max))
    force = law.force(u)
    return force, law.area(force)


def by_map() -> tuple[float, float]:
    """Costs of a point of the law of a map of 256 x 256 points, and of making it."""
    z = heights(MAP)

    def made() -> Any:
        surface = Surface.from_map(z, 1 / len(z), periodic=True, model="measured")
        # the curve itself is made when first used
        contact(surface, mean_separation=float(surface.h_rms), theory="calibrated")
        return surface

    surface = made()
    u = np.linspace(0.02, 0.98, POINTS) * float(surface.h_max)
    ask = functools.partial(contact, surface, mean_separation=u, theory="calibrated")
    cost, _ = measure(ask)
    cost_of_making, _ = measure(made)
    return cost / POINTS, cost_of_making


def by_law(theory: str | Theory) -> tuple[float, float]:
    """Costs of a point of a law, and of making it."""

    def make() -> dict[Surface, Any]:
        return {
            surface: contact_law(surface, theory=theory, rtol=LAW_RTOL)
            for surface in TIMED
        }

    laws = make()

    def answer(surface: Surface, u: FloatArray) -> tuple[Any, Any]:
        return laws[surface].pressure(u), laws[surface].area(u)

    cost = timed(answer)
    cost_of_making, _ = measure(make)
    return cost, cost_of_making / len(laws)


def by_contact(theory: str | Theory, surface: Surface, u: FloatArray) -> Any:
    return contact(surface, mean_separation=u, theory=theory)


def closed_form_area(surface: Surface, force: FloatArray) -> Any:
    return area(force, surface.alpha)


def ways() -> Iterator[tuple[str, str, str, float, float]]:
    """Theory, way to it, name of its deviations, cost of a point and once a surface."""
    area_alone = timed(closed_form_area)
    yield "calibrated", "closed form, area of a force", "area alone", area_alone, 0.0
    yield "calibrated", "quadrature", "calibrated", timed(quadrature), 0.0
    yield "calibrated, map", "map of 256 x 256", "calibrated, map", *by_map()
    for theory, way, asked in WAYS:
        # models of islands deviate by themselves
        name = way if way in ISLAND_MODELS else theory
        if way == "law":
            yield theory, way, name, *by_law(asked)
        else:
            count = SLOW_POINTS if way in SLOW else POINTS
            cost = timed(functools.partial(by_contact, asked), count)
            yield theory, way, name, cost, 0.0


def deviations() -> dict[str, list[float]]:
    """Columns of `Distance` by theory, on all held-out surfaces."""
    surfaces = held_out()
    columns = dict[str, list[float]]()
    for name, theory in (THEORIES | ISLAND_MODELS).items():
        misses = distances(surfaces, theory)
        of_area = [summed_up(surfaces, misses["area"], *ends) for ends in RANGES]
        of_force = [summed_up(surfaces, misses["force"], *ends) for ends in RANGES]
        sizes = [size for size, _ in of_area + of_force]
        shares_reached = [reached for _, reached in of_area]
        columns[name] = sizes + shares_reached
    columns["area alone"] = [*columns["calibrated"][:2], np.nan, np.nan, 1, 1]
    return columns


def study() -> bytes:
    """Every theory with its deviations, and boundary elements on coarser grids, as a file."""
    columns = deviations()
    rows = []
    for theory, way, name, cost, once in ways():
        rows.append(Distance(theory, way, cost, once, *columns[name]))
    rows += grid_rows()
    return to_csv(HEAD, pd.DataFrame(rows), "%.4g")


def again(island_model: str) -> bytes:
    """The shipped distances, with the cost of an island model measured anew."""
    asked = {
        way: theory
        for name, way, theory in WAYS
        if way == island_model and name == "MBMA reported"
    }
    rows = read_csv(ROOT / "tables" / "distance.csv")
    for way, theory in asked.items():
        is_its = (rows["theory"] == "MBMA reported") & (rows["way"] == way)
        rows.loc[is_its, "cost"] = timed(functools.partial(by_contact, theory))
    return to_csv(HEAD, rows, "%.4g")


def _converged(surface: pd.DataFrame) -> tuple[FloatArray, FloatArray]:
    """A/A0 and mean separation that the finest two grids converge to, as errors are halved."""
    *_, (_, coarse), (_, fine) = surface.groupby("points")
    coarse = coarse[coarse["start"] == coarse["start"].iloc[0]]
    fine = fine[fine["start"] == fine["start"].iloc[0]]
    area = 2 * fine["area"].to_numpy() - coarse["area"].to_numpy()
    u = 2 * fine["mean_separation"].to_numpy() - coarse["mean_separation"].to_numpy()
    return area, u


def _missed(surface: pd.DataFrame) -> pd.DataFrame:
    """One surface's loads, with their contact and deviations from what its grids converge to."""
    touching, u = _converged(surface)
    parts = []
    for _, part in surface.groupby(["points", "start"]):
        log_force = np.log(part["force"].to_numpy())
        gap = part["mean_separation"].to_numpy()
        is_open = gap > 0
        # gaps fall with the load, and interpolation wants them rising
        log_force_at = PchipInterpolator(
            np.log(gap[is_open])[::-1], log_force[is_open][::-1]
        )
        of_area = np.log(part["area"] / touching)
        of_force = log_force_at(np.log(u)) - log_force
        parts.append(part.assign(touching=touching, area=of_area, force=of_force))
    return pd.concat(parts)


def grid_rows() -> Iterator[Distance]:
    """Boundary elements on their own grids, deviations of those solved cold."""
    loads = read_csv("boundary_element_grids.csv")
    data = pd.concat([_missed(surface) for _, surface in loads.groupby("seed")])
    for (grid, start), solved in data.groupby(["points", "start"]):
        # continued loads differ by the solver's tolerance only
        cold = data[(data["points"] == grid) & (data["start"] == "cold")]
        in_ranges = [cold[cold["touching"].between(*ends)] for ends in RANGES]
        of_area = [rms(part["area"].to_numpy()) for part in in_ranges]
        of_force = [rms(part["force"].to_numpy()) for part in in_ranges]
        cost = float(solved["cost"].mean())
        way = f"{grid} x {grid}, {start}"
        # they reach every load
        yield Distance(SIMULATED, way, cost, 0, *[*of_area, *of_force, 1.0, 1.0])
