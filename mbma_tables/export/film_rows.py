"""Rows of a lubricated film: flow factors, asperity pressure and contact area against the mean gap."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from mbma_tables.answers.film import FlowFactors, flow_factors
from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.chords import rounded
from mbma_tables.export.exported_law import ExportedLaw
from mbma_tables.export.law_table import LawTable
from mbma_tables.laws.calibrated import TESTED_AREA

RANGE = (0.2 * (1 + 1e-9), 10.0)  # u/h_rms
NEAREST = 1e-9  # smallest overclosure evaluated, over h_max
NAMES = ("phi_x", "phi_y", "shear_x", "shear_y", "pressure")


def film_rows(exported: ExportedLaw, rows: int, least: float | None, end: float, peklenik: float | None) -> LawTable:
    """Flow factors and asperity pressure at mean gaps whose ratios are equal."""
    h_rms, h_max, length, stress = float(exported.surface.h_rms), exported.law.h_max, exported.length, exported.stress
    u = rounded(np.geomspace(max(RANGE[0] * h_rms, h_max - end), RANGE[1] * h_rms, rows))
    at = functools.partial(
        flow_factors, exported.surface, peklenik=peklenik, theory=exported.theory, E_star=exported.modulus,
        hardness=exported.hardness,
    )  # fmt: skip
    found = at(u)
    tested = found.pressure[found.area >= TESTED_AREA[0]]
    floor = least if least is not None else float(tested.min()) if tested.size else np.inf
    units = dict.fromkeys((*NAMES, "area", "scatter"), "1")
    units["pressure"] = stress
    columns = {name: (getattr(found, name), unit) for name, unit in units.items()}
    columns["stiffness"] = (np.asarray(exported.answer(u).unloading_stiffness), f"{stress}/{length}")
    error = _film_error(at, found, floor)
    comments = exported.header(
        f"{', '.join(f'{name} [{unit}]' for name, (_, unit) in columns.items())} against mean_separation [{length}]",
        f"mean separation u from {u[0]:.10g} to {u[-1]:.10g} {length}",
        f"{rows} rows; largest error of linear interpolation {error:.1e}, relative, of flow factors and of pressures "
        f"above {floor:.4g} {stress}, where flow factors are valid",
        *_of_film(found, length),
        end=h_max - min(u[0], h_max * (1 - NEAREST)),
    )
    facts = exported.facts | {"peklenik": (found.peklenik, "1")}
    y, unit = columns.pop("phi_x")
    names, theory = ("mean_separation", "phi_x"), exported.law.theory
    return LawTable(u, y, *names, length, unit, error, comments, theory, floor, None, columns, facts)


def _film_error(at: Callable[[FloatArray], FlowFactors], found: FlowFactors, floor: float) -> float:
    """Largest relative error of linear interpolation, in the middle of the intervals."""
    u, error = found.mean_separation, 0.0
    middle = at((u[1:] + u[:-1]) / 2)
    for name in NAMES:
        value, between = getattr(found, name), getattr(middle, name)
        kept = middle.valid & (between > (floor if name == "pressure" else 0))
        error = max(error, *np.abs((value[1:] + value[:-1])[kept] / (2 * between[kept]) - 1), 0.0)
    return float(error)


def _of_film(found: FlowFactors, length: str) -> list[str]:
    """Notes for the reader of flow factors."""
    lines = [
        "flow along x is -phi_x u^3/(12 viscosity) dp/dx + (U1 + U2)/2 u + (U1 - U2)/2 h_rms shear_x",
        "stiffness is that of a small change of the gap, with the contact area as it is",
        f"peklenik = {found.peklenik:.6g}: length of the roughness along x over that along y",
        f"scatter: one standard deviation of ln phi; of ln shear_x, ln shear_y: {found.shear_scatter[0]:.2g}",
    ]
    for reason, bad in found.reasons.items():
        gaps = found.mean_separation[bad]
        lines.append(f"flow factors not valid from u = {gaps.min():.4g} to {gaps.max():.4g} {length}: {reason}")
    return lines
