"""docs/fidelity.md: what the paper quotes, and simulations, beside what the library computes."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from generate.calibrated import QUANTITIES
from generate.pages import distances
from generate.pages.comparisons import AREA_THEORIES, PERSSON, THEORIES, VARIANTS, force_at, kappa
from generate.pages.fidelity_figures import RESOLUTIONS, drawn
from generate.pages.page import Measured, percent, svg, table
from mbma_tables import Surface

STEEL = 200e3  # MPa, the E* at which the paper's 3.5e-4 E* is its 70 MPa
HEIGHTS = (3.0, 3.4, 4.0)  # h_max/h_rms
Values = dict[str, Any]
Quoted = tuple[str, str, float | str, Iterable[str], Values]  # case, what, the paper's, theories it is about, values


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


def quoted_numbers() -> Iterable[Quoted]:
    """Numbers that the paper quotes, beside every theory's."""
    case, md = "yang-persson", Surface.named("yang-persson")
    at = {ratio: forces(md, ratio) for ratio in (0.0, 2.0, 2.5, 3.0)}
    for ratio, name, quoted, subject in (
        (2.5, "MBMA", 2.2e-4, VARIANTS),
        (2.0, "MBMA", 2.9e-3, VARIANTS),
        (3.0, "Persson", 3.5e-4, PERSSON),
        (2.5, "Persson", 1e-3, PERSSON),
    ):
        yield case, f"F/(A0 E*), u = {ratio:g} h_rms: {name}", quoted, subject, at[ratio]
    yield case, "F/A0 in MPa, steel, u = 3 h_rms: Persson", 70.0, PERSSON, over(at[3.0], 1 / STEEL)
    meets = over(at[0.0], at[0.0]["Persson simplified"])
    yield case, "F over Persson simplified, u = 0: MBMA meets it", 1.0, VARIANTS, meets
    yield case, "the same: G-W", "orders of magnitude", (), meets

    other, bem = Surface.named("papangelo"), distances.older("bem")
    for u, force in zip(bem.u, bem.force, strict=True):
        if 0.01 < u < 0.05:
            what = f"F over boundary elements, u = {u:.4g} h_rms: MBMA"
            yield "papangelo", what, "within 2x", (), over(forces(other, u), force * other.rms_gradient)

    for name, top, slope in (("concrete", 4.1, 1.98), ("asphalt", 4.5, 1.75)):
        road = Surface.named(name)
        yield name, "u/h_rms at first contact", top, VARIANTS, dict.fromkeys(VARIANTS, road.h_max / road.h_rms)
        heavy, light = ({t: kappa(road, t, area) for t in AREA_THEORIES} for area in (0.01, 1e-4))
        light |= dict.fromkeys(PERSSON, light["Persson"])
        yield name, "kappa, here at A/A0 = 1%: MBMA", slope, VARIANTS, heavy | dict.fromkeys(PERSSON, heavy["Persson"])
        what = "kappa at light load, here at A/A0 = 0.01%"
        yield name, what + ": G-W", math.sqrt(2 * math.pi), ["G-W"], light
        yield name, what + ": Persson", math.sqrt(8 / math.pi), PERSSON, light

    full = forces(Surface.named("challenge"), 0.01)
    what = "F over Persson full, u = 0.01 h_rms: MBMA"
    yield "challenge", what, "within 4x", (), over(full, full["Persson full"])
    coarse, fine = (Surface.named(f"resolution-{z}") for z in (RESOLUTIONS[0], RESOLUTIONS[-1]))
    for ratio, expected in ((2.5, "sensitive: MBMA, G-W"), (0.2, "1, except for G-W")):
        below, above = forces(coarse, ratio), forces(fine, ratio)
        what = f"F at zeta_1 = {RESOLUTIONS[-1]} over {RESOLUTIONS[0]}, u = {ratio:g} h_rms"
        yield "resolution", what, expected, (), {t: above[t] / below[t] for t in THEORIES}


def quoted_table() -> str:
    """What the paper quotes beside what every theory gives."""
    rows = []
    for case, what, quoted, subject, values in quoted_numbers():
        unit = {t: quoted for t in subject if isinstance(quoted, float)}
        cells = [show(values.get(t, np.nan), unit.get(t)) for t in THEORIES]
        rows.append([case, what, quoted if isinstance(quoted, str) else show(quoted), *cells])
    return table(["case", "quantity", "paper", *THEORIES], rows)


def summary_table(sets: Iterable[distances.DataSet]) -> str:
    """Root mean square deviations of every theory from data sets: area, force and stiffness."""
    rows = []
    for one in sets:
        cells = []
        for name, theory in distances.THEORIES.items():
            found = distances.distances(one.seen, theory)
            sums = [distances.summed_up(one.seen, values) for values in found.values()]
            text = " / ".join(percent(rms) for rms, _, _ in sums)
            # stiffness may be missing at a last load by itself
            short = " †" if 0 < sums[0][2] < 0.995 else ""
            cells.append("—" if text == "— / — / —" else f"{text}{'*' if name in one.fitted else ''}{short}")
        rows.append([f"{one.title} ({len(one.seen)})", *cells])
    return table(["simulated surfaces (number)", *distances.THEORIES], rows)


def challenge_table() -> str:
    """Theory over simulation at each load of the contact challenge."""
    one = distances.older("challenge")
    found = {name: distances.distances([one], theory) for name, theory in distances.THEORIES.items()}
    known = [name for name, values in found.items() if np.isfinite(values["area"]).any()]
    rows = [
        [f"{area:.2g}", quantity, *(show(np.exp(found[name][quantity][k])) for name in known)]
        for k, area in enumerate(one.area)
        for quantity in QUANTITIES
    ]
    return table(["A/A0", "theory over simulation", *known], rows)


def heights_table() -> str:
    """The deviation of force at equal separation for other values of h_max."""
    names, rows = ("MBMA reported", "MBMA fitted", "calibrated"), []
    for key, title in (("bem", "older set"), ("gfmd", "molecular dynamics")):
        for h_max in HEIGHTS:
            one = dataclasses.replace(distances.older(key), h_max=h_max)
            found = [distances.distances([one], distances.THEORIES[name])["force"] for name in names]
            rows.append([title, f"{h_max:g}", *(percent(distances.summed_up([one], part)[0]) for part in found)])
    return table(["data", "h_max/h_rms", *names], rows)


def measure() -> Measured:
    """The measured blocks of the page, and its figures."""
    parts = {
        "summary": summary_table(distances.data_sets().values()),
        "challenge": challenge_table(),
        "heights": heights_table(),
        "quoted": quoted_table(),
    }
    return parts, {f"docs/figures/{name}.svg": svg(figure) for name, figure in drawn()}
