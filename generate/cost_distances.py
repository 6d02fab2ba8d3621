"""Rows of tables/distance.csv: deviation of theories from boundary elements, and processor time."""

import functools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator

from generate.boundary_elements.surfaces import Recipe, heights
from generate.calibrated_file import rms
from generate.distances import COVER, ISLAND_MODELS, RANGES, THEORIES, distances, held_out, summed_up
from generate.files import read_csv, to_csv
from generate.timing import measure
from mbma_tables import Surface, contact, contact_law
from mbma_tables.common.arguments import FloatArray
from mbma_tables.scenes.plan import Distance
from mbma_tables.theories import Persson
from mbma_tables.theories.calibrated.formulas import Law, Spectrum, area

SIMULATED = "boundary elements"
POINTS, SLOW_POINTS = 1000, 50  # of each timed surface, in one call
SLOW = ("inverse of (19)", "exact")
TIMED = tuple(  # those of the grids
    Surface(hurst, 1.0, zeta_1, 1.0, top)
    for hurst, zeta_1, top in ((0.3, 12.0, 3.4), (0.5, 21.0, 3.6), (0.9, 12.0, 3.0))
)
MAP = Recipe("self_affine", 0.8, 16.0, 4, 1, 256)
LAW_RTOL = 1e-6
MBMA: dict[str, Any] = {"rtol": LAW_RTOL}
# theory, way, and options of `contact`, or of `contact_law` where the way is a law
WAYS: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("calibrated", "table", {"theory": "calibrated"}),
    ("calibrated", "law", {"theory": "calibrated"}),
    ("Persson", "inverse of (19)", {"theory": "persson"}),
    ("Persson", "law", {"theory": "persson"}),
    ("Persson simplified", "inverse of (20)", {"theory": Persson("simplified")}),
    ("G-W", "quadrature", {"theory": "greenwood_williamson"}),
    ("G-W", "law", {"theory": "greenwood_williamson"}),
    *(("MBMA reported", name, MBMA | {"island_model": name}) for name in ("universal", "exact", "island4d")),
    *(("MBMA reported", name, {"rtol": 1e-4, "island_model": name}) for name in ISLAND_MODELS),
    ("MBMA reported", "law", {"theory": "mbma"}),
    *((f"MBMA {name}", "universal", MBMA | {"variant": name}) for name in ("printed", "fitted")),
    ("MBMA cover", "universal", MBMA | {"variant": COVER}),
)
HEAD = """\
# Distance of theories from boundary elements on held-out surfaces, and processor time, by python -m generate cost;
# docs/cost.md says how. Distances are root mean squares of ln(theory/simulation), light at 1-10% contact and deep
# at 10-97%; reached is the share of simulated loads there that the theory reaches. cost is of one point, once of what
# is made beforehand for a surface, both over the fixed piece of work of cost.csv.
"""


def timed(answer: Callable[[Surface, FloatArray], Any], count: int = POINTS) -> float:
    """Cost of a point, of mean separations of each surface in one call a surface."""
    pairs = [(surface, np.linspace(0.02, 0.98, count) * float(surface.h_max)) for surface in TIMED]
    return measure(lambda: [answer(surface, u) for surface, u in pairs])[0] / (len(pairs) * count)


def quadrature(surface: Surface, u: FloatArray) -> Any:
    """Force and area by the calibrated law's own integrals."""
    law = Law(Spectrum.self_affine(float(surface.hurst), float(surface.zeta_1)), float(surface.h_max))
    force = law.force(u)
    return force, law.area(force)


def by_map() -> tuple[float, float]:
    """Costs of a point of the law of a map of 256 x 256 points, and of making it."""
    z = heights(MAP)

    def made() -> Any:
        found = Surface.from_map(z, 1 / len(z), periodic=True, model="measured")
        # the curve itself is made when first used
        contact(found, mean_separation=float(found.h_rms), theory="calibrated")
        return found

    surface = made()
    u = np.linspace(0.02, 0.98, POINTS) * float(surface.h_max)
    answer = measure(lambda: contact(surface, mean_separation=u, theory="calibrated"))[0] / POINTS
    return answer, measure(made)[0]


def by_law(options: dict[str, Any]) -> tuple[float, float]:
    """Costs of a point of a law, and of making it."""

    def make() -> dict[Surface, Any]:
        return {surface: contact_law(surface, rtol=LAW_RTOL, **options) for surface in TIMED}

    laws = make()
    return timed(lambda surface, u: (laws[surface].pressure(u), laws[surface].area(u))), measure(make)[0] / len(laws)


def ways() -> Iterator[tuple[str, str, str, float, float]]:
    """Theory, way to it, name of its deviations, cost of a point and once a surface."""
    area_alone = timed(lambda surface, force: area(force, surface.alpha))
    yield "calibrated", "closed form, area of a force", "area alone", area_alone, 0.0
    yield "calibrated", "quadrature", "calibrated", timed(quadrature), 0.0
    yield "calibrated, map", "map of 256 x 256", "calibrated, map", *by_map()
    for theory, way, options in WAYS:
        name, ask = way if way in ISLAND_MODELS else theory, functools.partial(contact, **options)
        if way == "law":
            yield theory, way, name, *by_law(options)
        else:
            count = SLOW_POINTS if way in SLOW else POINTS
            yield theory, way, name, timed(lambda surface, u, ask=ask: ask(surface, mean_separation=u), count), 0.0  # type: ignore[misc]


def study() -> bytes:
    """Every theory with its deviations on all held-out surfaces, and boundary elements on coarser grids, as a file."""
    seen, known = held_out(), dict[str, list[float]]()
    for name, theory in (THEORIES | ISLAND_MODELS).items():
        found = distances(seen, theory)
        parts = [summed_up(seen, found[quantity], *ends) for quantity in ("area", "force") for ends in RANGES]
        known[name] = [rms for rms, _ in parts] + [reached for _, reached in parts[:2]]
    known["area alone"] = [*known["calibrated"][:2], np.nan, np.nan, 1, 1]
    rows = [Distance(label, way, cost, once, *known[name]) for label, way, name, cost, once in ways()]
    return to_csv(HEAD, pd.DataFrame([*rows, *grid_rows()]), "%.4g")


def _missed(own: pd.DataFrame) -> pd.DataFrame:
    """One surface's loads, with their contact and deviations from what its finest two grids converge to."""
    *_, (_, coarse), (_, fine) = own.groupby("points")
    coarse, fine = (part[part["start"] == part["start"].iloc[0]] for part in (coarse, fine))
    touching, u = (2 * fine[name].to_numpy() - coarse[name].to_numpy() for name in ("area", "mean_separation"))
    parts = []
    for _, part in own.groupby(["points", "start"]):
        log_force, gap = np.log(part["force"].to_numpy()), part["mean_separation"].to_numpy()
        open_ = gap > 0
        curve = PchipInterpolator(np.log(gap[open_])[::-1], log_force[open_][::-1])
        errors = {"area": np.log(part["area"] / touching), "force": curve(np.log(u)) - log_force}
        parts.append(part.assign(touching=touching, **errors))
    return pd.concat(parts)


def grid_rows() -> Iterator[Distance]:
    """Boundary elements on their own grids, deviations of those solved cold."""
    data = read_csv("boundary_element_grids.csv")
    data = pd.concat([_missed(own) for _, own in data.groupby("seed")])
    for (grid, start), own in data.groupby(["points", "start"]):
        # continued loads differ by the solver's tolerance only
        cold = data[(data["points"] == grid) & (data["start"] == "cold")]
        inside = [cold[cold["touching"].between(*ends)] for ends in RANGES]
        parts = [rms(part[name].to_numpy()) for name in ("area", "force") for part in inside]
        yield Distance(SIMULATED, f"{grid} x {grid}, {start}", float(own["cost"].mean()), 0, *[*parts, 1.0, 1.0])
