"""The paper's cases by name (Section 4), with the numbers that it reports for them."""

from __future__ import annotations

import dataclasses
import math

from mbma_tables.errors import InputError
from mbma_tables.surfaces.surface import Surface


@dataclasses.dataclass(frozen=True)
class Case:
    """A named surface, its length unit and where the paper uses it."""

    name: str
    title: str
    length_unit: str
    surface: Surface


def _moments(hurst: float, m0: float, m2: float, m4: float, h_max: float) -> Surface:
    return Surface.from_moments(hurst=hurst, m0=m0, m2=m2, m4=m4, h_max=h_max)


def _band(hurst: float, q0: float, zeta_1: float, h_rms: float, h_max: float) -> Surface:
    return Surface(hurst, q0, q0 * zeta_1, h_rms, h_max * h_rms)


def _build() -> dict[str, Case]:
    cases = [
        Case(
            "yang-persson",
            "Yang-Persson molecular dynamics (Fig. 11)",
            "nm",
            _band(0.8, 6 * math.pi / 1040 * 10, 216, 1.0, 3.0),
        ),
        Case(
            "papangelo",
            "Papangelo Green's function simulation (Fig. 12)",
            "um",
            _band(0.8, 2 * math.pi / 100, 64, 5.0, 3.0),
        ),
        Case(
            "concrete",
            "concrete road of Lorenz (Figs. 13a, 14a)",
            "mm",
            _moments(0.7, 0.071, 0.27, 62.0, 1.1),
        ),
        Case(
            "asphalt",
            "asphalt road of Lorenz (Figs. 13b, 14b)",
            "mm",
            _moments(0.85, 0.091, 2.67, 21000.0, 1.37),
        ),
        Case(
            "challenge",
            "contact-mechanics challenge (Fig. 15)",
            "um",
            _band(0.8, 2 * math.pi / 20, 200, 0.762, 3.7),
        ),
    ]
    cases += [
        Case(
            f"resolution-{zeta_1}",
            f"resolution study, zeta_1 = {zeta_1} (Figs. 16, 17)",
            "h_rms",
            _band(0.7, 0.1, zeta_1, 1.0, 3.0),
        )
        for zeta_1 in (125, 250, 500, 1000)
    ]
    return {case.name: case for case in cases}


CASES = _build()


def get_case(name: str) -> Case:
    """The case of that name."""
    if name not in CASES:
        raise InputError(f"no surface is named {name!r}; there are {', '.join(CASES)}")
    return CASES[name]
