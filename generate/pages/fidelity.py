"""docs/fidelity.md: what the paper quotes, and simulations, beside what the library computes."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from generate.calibrated import QUANTITIES
from generate.pages import distances
from generate.pages.fidelity_figures import PERSSON, RESOLUTIONS, THEORIES, VARIANTS, drawn, force_at
from generate.pages.page import Measured, percent, table
from mbma_tables import Surface, contact

STEEL = 200e3  # MPa, the E* at which the paper's 3.5e-4 E* is its 70 MPa
HEIGHTS = (3.0, 3.4, 4.0)  # h_max/h_rms
Values = dict[str, Any]
Quoted = tuple[str, str, float | str, Iterable[str], Values]  # case, what, the paper's, theories it is about, values


def show(value: Any, quoted: float | None = None) -> str:
    """Three digits, and in brackets the ratio to what is quoted; a dash where there is no number."""
    if not np.isfinite(value):
        return "—"
    return f"{value:.3g}" + (f" ({value / quoted:.2g})" if quoted else "")


@functools.cache
def forces(name: str, ratio: float, unit: float = 1.0) -> Values:
    """F/(A0 E*) of every theory at u = ratio * h_rms of a named surface, in a unit."""
    return {t: float(force_at(Surface.named(name), t, ratio)[0]) / unit for t in THEORIES}


def kappa(surface: Surface, area: float) -> Values:
    """A/F sqrt(2 m2) E*, Eq. (51), at A/A0 = `area`, of every theory; (18) is Persson's in full and simplified."""
    asked = THEORIES | dict.fromkeys(PERSSON, THEORIES["Persson full"])
    found = {name: contact(surface, area=area, theory=theory).force for name, theory in asked.items()}
    return {name: float(area / force * surface.rms_gradient) for name, force in found.items()}


def quoted_numbers() -> Iterable[Quoted]:
    """Numbers that the paper quotes, beside every theory's."""
    case = "yang-persson"
    for ratio, name, quoted, subject in (
        (2.5, "MBMA", 2.2e-4, VARIANTS),
        (2.0, "MBMA", 2.9e-3, VARIANTS),
        (3.0, "Persson", 3.5e-4, PERSSON),
        (2.5, "Persson", 1e-3, PERSSON),
    ):
        yield case, f"F/(A0 E*), u = {ratio:g} h_rms: {name}", quoted, subject, forces(case, ratio)
    yield case, "F/A0 in MPa, steel, u = 3 h_rms: Persson", 70.0, PERSSON, forces(case, 3.0, 1 / STEEL)
    meets = forces(case, 0.0, forces(case, 0.0)["Persson simplified"])
    yield case, "F over Persson simplified, u = 0: MBMA meets it", 1.0, VARIANTS, meets
    yield case, "the same: G-W", "orders of magnitude", (), meets

    case, bem = "papangelo", distances.older("bem")
    for u, force in zip(bem.u, bem.force, strict=True):
        if 0.01 < u < 0.05:
            what = f"F over boundary elements, u = {u:.4g} h_rms: MBMA"
            yield case, what, "within 2x", (), forces(case, u, force * float(Surface.named(case).rms_gradient))

    for name, top, slope in (("concrete", 4.1, 1.98), ("asphalt", 4.5, 1.75)):
        road = Surface.named(name)
        yield name, "u/h_rms at first contact", top, VARIANTS, dict.fromkeys(VARIANTS, road.h_max / road.h_rms)
        yield name, "kappa, here at A/A0 = 1%: MBMA", slope, VARIANTS, kappa(road, 0.01)
        light, what = kappa(road, 1e-4), "kappa at light load, here at A/A0 = 0.01%"
        yield name, what + ": G-W", math.sqrt(2 * math.pi), ["G-W"], light
        yield name, what + ": Persson", math.sqrt(8 / math.pi), PERSSON, light

    case, what = "challenge", "F over Persson full, u = 0.01 h_rms: MBMA"
    yield case, what, "within 4x", (), forces(case, 0.01, forces(case, 0.01)["Persson full"])
    for ratio, expected in ((2.5, "sensitive: MBMA, G-W"), (0.2, "1, except for G-W")):
        below, above = (forces(f"resolution-{z}", ratio) for z in (RESOLUTIONS[0], RESOLUTIONS[-1]))
        what = f"F at zeta_1 = {RESOLUTIONS[-1]} over {RESOLUTIONS[0]}, u = {ratio:g} h_rms"
        yield "resolution", what, expected, (), {t: above[t] / below[t] for t in THEORIES}


def quoted_table() -> str:
    """What the paper quotes beside what every theory gives."""
    rows = []
    for case, what, quoted, subject, values in quoted_numbers():
        unit = {t: quoted for t in subject if isinstance(quoted, float)}
        cells = [show(values.get(t, np.nan), unit.get(t)) for t in THEORIES]
        rows.append([case, what, quoted if isinstance(quoted, str) else show(quoted), *cells])
    return table(f"case | quantity | paper | {' | '.join(THEORIES)}", rows)


def summary_table(sets: Iterable[distances.DataSet]) -> str:
    """Root mean square deviations of every theory from data sets: area, force and stiffness."""
    rows = []
    for one in sets:
        cells = []
        for name, theory in distances.THEORIES.items():
            found = distances.distances(one.seen, theory)
            sums = [distances.summed_up(one.seen, values) for values in found.values()]
            text = " / ".join(percent(rms) for rms, _ in sums)
            # stiffness may be missing at a last load by itself
            short = " †" if 0 < sums[0][1] < 0.995 else ""
            cells.append("—" if text == "— / — / —" else f"{text}{'*' if name in one.fitted else ''}{short}")
        rows.append([f"{one.title} ({len(one.seen)})", *cells])
    return table(f"simulated surfaces (number) | {' | '.join(distances.THEORIES)}", rows)


def challenge_table() -> str:
    """Theory over simulation at each load of the contact challenge."""
    one = distances.older("challenge")
    found = {name: distances.distances([one], theory) for name, theory in distances.THEORIES.items()}
    known = [name for name, values in found.items() if np.isfinite(values["area"]).any()]
    rows = [
        [area, quantity, *(np.exp(found[name][quantity][k]) for name in known)]
        for k, area in enumerate(one.area)
        for quantity in QUANTITIES
    ]
    return table(f"A/A0 | theory over simulation | {' | '.join(known)}", rows, "{:.2g} | {} | {:.3g}")


def heights_table() -> str:
    """The deviation of force at equal separation for other values of h_max."""
    names, rows = ("MBMA reported", "MBMA fitted", "calibrated"), []
    for key, title in (("bem", "older set"), ("gfmd", "molecular dynamics")):
        for h_max in HEIGHTS:
            one = dataclasses.replace(distances.older(key), h_max=h_max)
            found = [distances.distances([one], distances.THEORIES[name])["force"] for name in names]
            rows.append([title, h_max, *(percent(distances.summed_up([one], part)[0]) for part in found)])
    return table(f"data | h_max/h_rms | {' | '.join(names)}", rows, "{} | {:g}")


def measure() -> Measured:
    """The measured blocks of the page, and its figures."""
    parts = {
        "summary": summary_table(distances.data_sets().values()),
        "challenge": challenge_table(),
        "heights": heights_table(),
        "quoted": quoted_table(),
    }
    return parts, {f"docs/figures/{name}.svg": figure for name, figure in drawn()}
