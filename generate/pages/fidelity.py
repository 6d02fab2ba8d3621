"""The measured parts of docs/fidelity.md: what the paper quotes, and brute force, beside what the library computes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from generate.pages.comparisons import (
    AREA_THEORIES,
    PERSSON,
    READINGS,
    REFERENCES,
    THEORIES,
    Reference,
    area_ratios,
    force_at,
    force_ratios,
    kappa,
)
from generate.pages.fidelity_figures import RESOLUTIONS, ROADS, drawn
from generate.pages.page import png, table
from mbma_tables import Surface
from mbma_tables.arguments import FloatArray

STEEL = 200e3  # MPa, the E* at which the paper's 3.5e-4 E* is its 70 MPa
AREAS = np.array([1e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.2])  # A/A0 of the tables of kappa
Values = dict[str, Any]


def show(value: Any, quoted: float | None = None) -> str:
    """Three digits, and in brackets the ratio to what is quoted; a dash where there is no number."""
    if not np.isfinite(value):
        return "—"
    return f"{value:.3g}" + (f" ({value / quoted:.2g})" if quoted else "")


def forces(surface: Surface, ratio: float) -> Values:
    """F/(A0 E*) of every theory at u = ratio * h_rms."""
    return {t: float(force_at(surface, t, ratio)) for t in THEORIES}


def over(values: Values, unit: float) -> Values:
    """Values of all theories in a unit."""
    return {t: v / unit for t, v in values.items()}


def kappas(road: Surface, area: float) -> Values:
    """Kappa of every theory at a contact area."""
    values = {t: kappa(road, t, area)[0] for t in AREA_THEORIES}
    return values | dict.fromkeys(PERSSON, values["Persson"])


Quoted = tuple[str, str, float | str, Iterable[str], Values]  # case, what, the paper's, theories it is about, values


def quoted_forces() -> Iterable[Quoted]:
    """Forces that the paper quotes."""
    case, md = "yang-persson", Surface.named("yang-persson")
    at = {ratio: forces(md, ratio) for ratio in (0.0, 2.0, 2.5, 3.0)}
    yield case, "F/(A0 E*), u = 2.5 h_rms: MBMA", 2.2e-4, READINGS, at[2.5]
    yield case, "F/(A0 E*), u = 2 h_rms: MBMA", 2.9e-3, READINGS, at[2.0]
    yield case, "F/(A0 E*), u = 3 h_rms: Persson", 3.5e-4, PERSSON, at[3.0]
    yield case, "F/(A0 E*), u = 2.5 h_rms: Persson", 1e-3, PERSSON, at[2.5]
    yield case, "F/A0 in MPa, steel, u = 3 h_rms: Persson", 70.0, PERSSON, over(at[3.0], 1 / STEEL)
    meets = over(at[0.0], at[0.0]["Persson simplified"])
    yield case, "F over Persson simplified, u = 0: MBMA meets it", 1.0, READINGS, meets
    yield case, "the same: G-W", "orders of magnitude", (), meets

    other, bem = Surface.named("papangelo"), REFERENCES["bem"]
    u, load = (bem.column(name) for name in ("mean_separation_over_h_rms", "force"))
    for k in np.flatnonzero((u < 0.05) & (u > 0.01)):
        brute = load[k] * other.rms_gradient / bem.gradient
        what = f"F over boundary elements, u = {u[k]:.4g} h_rms: MBMA"
        yield "papangelo", what, "within 2x", (), over(forces(other, u[k]), brute)


def quoted_slopes() -> Iterable[Quoted]:
    """First contact and kappa of the roads, the challenge at full contact, and the study of resolution."""
    for name, top, slope in (("concrete", 4.1, 1.98), ("asphalt", 4.5, 1.75)):
        road = Surface.named(name)
        first = dict.fromkeys(READINGS, road.h_max / road.h_rms)
        yield name, "u/h_rms at first contact", top, READINGS, first
        yield name, "kappa, here at A/A0 = 1%: MBMA", slope, READINGS, kappas(road, 0.01)
        light, what = kappas(road, 1e-4), "kappa at light load, here at A/A0 = 0.01%"
        yield name, what + ": G-W", math.sqrt(2 * math.pi), ["G-W"], light
        yield name, what + ": Persson", math.sqrt(8 / math.pi), PERSSON, light

    full = forces(Surface.named("challenge"), 0.01)
    what = "F over Persson full, u = 0.01 h_rms: MBMA"
    yield "challenge", what, "within 4x", (), over(full, full["Persson full"])
    coarse, fine = (Surface.named(f"resolution-{z}") for z in (RESOLUTIONS[0], RESOLUTIONS[-1]))
    for ratio, expected in ((2.5, "sensitive: MBMA, G-W"), (0.2, "1, but for G-W")):
        below, above = forces(coarse, ratio), forces(fine, ratio)
        what = f"F at zeta_1 = {RESOLUTIONS[-1]} over {RESOLUTIONS[0]}, u = {ratio:g} h_rms"
        yield "resolution", what, expected, (), {t: above[t] / below[t] for t in THEORIES}


def quoted_table() -> str:
    """What the paper quotes beside what every theory gives."""
    rows = []
    for case, what, quoted, subject, values in (*quoted_forces(), *quoted_slopes()):
        unit = {t: quoted for t in subject if isinstance(quoted, float)}
        cells = [show(values.get(t, np.nan), unit.get(t)) for t in THEORIES]
        rows.append([case, what, quoted if isinstance(quoted, str) else show(quoted), *cells])
    return table(["case", "what", "paper", *THEORIES], rows)


def kappa_table(name: str) -> str:
    """Kappa over a range of loads."""
    columns = [kappa(Surface.named(name), t, AREAS) for t in AREA_THEORIES]
    rows = [[f"{area:g}", *(show(column[k]) for column in columns)] for k, area in enumerate(AREAS)]
    return table(["A/A0", *AREA_THEORIES], rows)


def reference_tables(reference: Reference) -> str:
    """The tables of one data set."""
    surface = reference.surface()
    force, area, u = (reference.column(n) for n in ("force", "area", "mean_separation_over_h_rms"))
    areas, loads = area_ratios(reference, surface), force_ratios(reference, surface)
    low, high = reference.band
    inside = (area >= low) & (area <= high)

    def rows(first: Sequence[FloatArray], ratios: dict[str, FloatArray]) -> list[list[str]]:
        columns = [*first, *ratios.values()]
        return [[show(column[k]) for column in columns] for k in range(force.size)]

    def span(values: FloatArray) -> str:
        chosen = values[inside]
        reached = chosen[np.isfinite(chosen)]
        if reached.size == 0:
            return "—"
        missing = f" (not reached: {chosen.size - reached.size} of {chosen.size})" if reached.size < chosen.size else ""
        return f"{reached.min():.2f} to {reached.max():.2f}{missing}"

    def spread(h_max: float) -> list[str]:
        other = reference.surface(h_max)
        by_area, by_force = area_ratios(reference, other), force_ratios(reference, other)
        return [f"{h_max:g}", *(span(d[t]) for d in (by_area, by_force) for t in READINGS)]

    return "\n\n".join(
        [
            "Area at equal force, model over data:",
            table(["F/(A0 E*)", "A/A0 data", *AREA_THEORIES], rows([force, area], areas)),
            f"Its range from {low:.1%} to {high:.0%} contact:",
            table(AREA_THEORIES, [[span(values) for values in areas.values()]]),
            "Force at equal separation, model over data:",
            table(["u/h_rms", "F/(A0 E*) data", *THEORIES], rows([u, force], loads)),
            "The effect of h_max on both, over the same range of contact (area ratios, then force ratios):",
            table(
                ["h_max/h_rms", *(f"{kind}, {t}" for kind in ("area", "force") for t in READINGS)],
                [spread(h_max) for h_max in (3.0, reference.h_max, 4.0)],
            ),
        ]
    )


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its figures."""
    parts = {"quoted": quoted_table()} | {name: kappa_table(name) for name in ROADS}
    parts |= {name: reference_tables(reference) for name, reference in REFERENCES.items()}
    return parts, {f"docs/figures/{name}.png": png(figure) for name, figure in drawn()}
