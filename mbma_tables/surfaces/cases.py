"""The paper's cases by name (Section 4), with the numbers that it reports for them."""

from collections.abc import Mapping
from math import pi
from typing import Any, NamedTuple

from mbma_tables.common.errors import InputError


class Case(NamedTuple):
    """A named surface of the paper."""

    title: str
    length_unit: str | None  # None if lengths are over h_rms
    numbers: Mapping[str, Any]  # arguments of `Surface`, or of `Surface.from_moments` if the paper gives moments


def _band(hurst: float, q0: float, zeta_1: float, h_rms: float, top: float) -> dict[str, float]:
    return {"hurst": hurst, "q0": q0, "q1": q0 * zeta_1, "h_rms": h_rms, "h_max": top * h_rms}


def _moments(hurst: float, m0: float, m2: float, m4: float, h_max: float) -> dict[str, float]:
    return {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4, "h_max": h_max}


CASES = {
    "yang-persson": Case(
        "Yang-Persson molecular dynamics (Fig. 11)", "nm", _band(0.8, 6 * pi / 1040 * 10, 216, 1.0, 3.0)
    ),
    "papangelo": Case("Papangelo Green's function simulation (Fig. 12)", "um", _band(0.8, 2 * pi / 100, 64, 5.0, 3.0)),
    "concrete": Case("concrete road of Lorenz (Figs. 13a, 14a)", "mm", _moments(0.7, 0.071, 0.27, 62.0, 1.1)),
    "asphalt": Case("asphalt road of Lorenz (Figs. 13b, 14b)", "mm", _moments(0.85, 0.091, 2.67, 21000.0, 1.37)),
    "challenge": Case("contact-mechanics challenge (Fig. 15)", "um", _band(0.8, 2 * pi / 20, 200, 0.762, 3.7)),
} | {
    f"resolution-{z}": Case(
        f"resolution study over h_rms, zeta_1 = {z} (Figs. 16, 17)", None, _band(0.7, 0.1, z, 1.0, 3.0)
    )
    for z in (125, 250, 500, 1000)
}


def get_case(name: str) -> Case:
    """The case of that name."""
    if not isinstance(name, str) or name not in CASES:
        raise InputError(f"no surface is named {name!r}; there are {', '.join(CASES)}")
    return CASES[name]
