"""Second half of docs/cost.md: deviation from boundary elements against time, tables/distance.csv and its figure."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from generate.boundary_elements.grids import GRIDS, STARTS
from generate.boundary_elements.surfaces import Recipe, heights
from generate.pages.distances import COVER, HIGH, ISLAND_MODELS, LOW, THEORIES, distances, held_out, summed_up
from generate.pages.page import read_csv
from generate.timing import measure
from mbma_tables import Surface, contact, contact_law
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.calibrated import Law, Spectrum, area
from mbma_tables.scenes.costs import Distance
from mbma_tables.theories import Persson

DEEP = 0.1  # A/A0: deviations are given from LOW to DEEP and from DEEP to HIGH
RANGES = ((LOW, DEEP), (DEEP, HIGH))
SIMULATED = "boundary elements"
POINTS, SLOW_POINTS = 1000, 50  # of each timed surface, in one call
TIMED = ((0.3, 12.0, 3.4), (0.5, 21.0, 3.6), (0.9, 12.0, 3.0))  # H, zeta_1, h_max/h_rms: those of the grids
MAP = Recipe("self_affine", 0.8, 16.0, 4, 1, 256)
LAW_RTOL = 1e-6
HEAD = """\
# Distance of theories from boundary elements on held-out surfaces, and processor time, by python -m generate pages
# cost; docs/cost.md says how. Distances are root mean squares of ln(theory/simulation), light at 1-10% contact and deep
# at 10-97%; reached is the share of simulated loads there that the theory reaches. cost is of one point, once of what
# is made beforehand for a surface, both over the fixed piece of work of cost.csv.
"""


def _each(answer: Callable[[Surface, FloatArray], Any], count: int = POINTS) -> float:
    """Cost of a point: force and area at mean separations of each timed surface, one call a surface."""
    surfaces = [Surface(hurst, 1.0, zeta_1, 1.0, top) for hurst, zeta_1, top in TIMED]
    asked = [(surface, np.linspace(0.02, 0.98, count) * float(surface.h_max)) for surface in surfaces]
    cost, _ = measure(lambda: [answer(surface, u) for surface, u in asked])
    return cost / (len(asked) * count)


def _asked(**options: Any) -> Callable[[Surface, FloatArray], Any]:
    return lambda surface, u: contact(surface, mean_separation=u, **options)


def _by_law(**options: Any) -> tuple[float, float]:
    """Costs of a point of a law, and of making it."""

    def make() -> dict[float, Any]:
        surfaces = (Surface(hurst, 1.0, zeta_1, 1.0, top) for hurst, zeta_1, top in TIMED)
        return {float(surface.h_max): contact_law(surface, LAW_RTOL, **options) for surface in surfaces}

    laws = make()

    def answer(surface: Surface, u: FloatArray) -> Any:
        law = laws[float(surface.h_max)]
        return law.force(u=u), law.area(u=u)

    made = measure(make)[0] / len(laws)
    return _each(answer), made


def _quadrature(surface: Surface, u: FloatArray) -> Any:
    spectrum = Spectrum.self_affine(float(surface.hurst), float(surface.zeta_1))
    law = Law(spectrum, float(surface.h_max / surface.h_rms))
    force = law.force(u / surface.h_rms)
    return force, law.area(force)


def _by_map() -> tuple[float, float]:
    """Costs of a point of the law of a map of 256 x 256 points, and of making it."""
    z = heights(MAP)

    def made() -> Any:
        found = Surface.from_map(z, 1 / len(z), periodic=True, model="measured")
        # the curve itself is made when first asked
        contact(found, mean_separation=float(found.h_rms), theory="calibrated")
        return found

    surface = made()
    u = np.linspace(0.02, 0.98, POINTS) * float(surface.h_max)
    answer = measure(lambda: contact(surface, mean_separation=u, theory="calibrated"))[0] / POINTS
    return answer, measure(made)[0]


def ways() -> Iterator[tuple[str, str, str, float, float]]:
    """Theory, way to it, name of its deviations, cost of a point and once a surface."""
    closed_form = _each(lambda surface, force: area(force, surface.alpha))
    yield "calibrated", "closed form, area of a force", "area alone", closed_form, 0
    yield "calibrated", "quadrature", "calibrated", _each(_quadrature), 0
    yield "calibrated", "table", "calibrated", _each(_asked(theory="calibrated")), 0
    yield "calibrated", "law", "calibrated", *_by_law(theory="calibrated")
    yield "calibrated, map", "map of 256 x 256", "calibrated, map", *_by_map()
    yield "Persson", "inverse of (19)", "Persson", _each(_asked(theory="persson"), SLOW_POINTS), 0
    yield "Persson", "law", "Persson", *_by_law(theory="persson")
    name = "Persson simplified"
    yield name, "inverse of (20)", name, _each(_asked(theory=Persson("simplified"))), 0
    yield "G-W", "quadrature", "G-W", _each(_asked(theory="greenwood_williamson")), 0
    yield "G-W", "law", "G-W", *_by_law(theory="greenwood_williamson")
    for island_model in ("universal", "exact", "island4d", "formula", "rigid"):
        count = SLOW_POINTS if island_model == "exact" else POINTS
        known = island_model if island_model in ISLAND_MODELS else "MBMA reported"
        options: dict[str, Any] = {
            "island_model": island_model,
            "rtol": 1e-4 if island_model in ("formula", "rigid") else LAW_RTOL,
        }
        yield "MBMA reported", island_model, known, _each(_asked(**options), count), 0
    yield "MBMA reported", "law", "MBMA reported", *_by_law()
    for name, variant in (("printed", "printed"), ("fitted", "fitted"), ("cover", COVER)):
        cost = _each(_asked(variant=variant, rtol=LAW_RTOL))
        yield f"MBMA {name}", "universal", f"MBMA {name}", cost, 0


def study() -> list[Distance]:
    """Every theory with its deviations on all held-out surfaces, and boundary elements on coarser grids."""
    seen, known = held_out(), dict[str, list[float]]()
    for name, theory in (THEORIES | ISLAND_MODELS).items():
        found = distances(seen, theory)
        parts = [summed_up(seen, found[quantity], *ends) for quantity in ("area", "force") for ends in RANGES]
        known[name] = [rms for rms, _ in parts] + [reached for _, reached in parts[:2]]
    known["area alone"] = [*known["calibrated"][:2], np.nan, np.nan, 1, 1]
    return [*(Distance(label, way, cost, once, *known[name]) for label, way, name, cost, once in ways()), *grid_rows()]


def _missed(own: Any) -> Iterator[tuple[int, str, FloatArray]]:
    """Contact and deviation of each load of one surface, by grid and quantity, from what its finest two converge to."""
    on = {grid: own[own["points"] == grid] for grid in GRIDS}
    on = {grid: rows[rows["start"] == rows["start"][0]] for grid, rows in on.items() if rows.size}
    coarse, fine = list(on.values())[-2:]
    touching, u = (2 * fine[name] - coarse[name] for name in ("area", "mean_separation"))
    for grid, part in on.items():
        yield grid, "area", np.stack([touching, np.log(part["area"] / touching)])
        log_force, gap = np.log(part["force"]), part["mean_separation"]
        open_ = gap > 0
        curve = PchipInterpolator(np.log(gap[open_])[::-1], log_force[open_][::-1])
        yield grid, "force", np.stack([touching, curve(np.log(u)) - log_force])


def grid_rows() -> list[Distance]:
    """Boundary elements on their own grids."""
    data = read_csv("boundary_element_grids.csv")
    missed: dict[tuple[int, str], list[FloatArray]] = {}
    for seed in np.unique(data["seed"]):
        for grid, quantity, values in _missed(data[data["seed"] == seed]):
            missed.setdefault((grid, quantity), []).append(values)
    rows = []
    for grid, start in itertools.product(GRIDS, STARTS):
        timed = data["cost"][(data["points"] == grid) & (data["start"] == start)]
        parts = []
        for quantity in ("area", "force"):
            contacts, values = np.concatenate(missed[grid, quantity], axis=1)
            kept = [values[(contacts >= low) & (contacts <= high)] for low, high in RANGES]
            parts += [float(np.sqrt(np.mean(part**2))) for part in kept]
        if timed.size:
            rows.append(Distance(SIMULATED, f"{grid} x {grid}, {start}", float(timed.mean()), 0, *[*parts, 1.0, 1.0]))
    return rows
