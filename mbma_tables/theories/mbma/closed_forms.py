"""Closed forms of `closed_forms.toml` (docs/model.md): the island model "formula", and total force and area."""

from __future__ import annotations

import dataclasses
import functools
import pathlib
import re
import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.surface import Surface
from mbma_tables.tables.universal import Ranged
from mbma_tables.theories.mbma.closed_form_certificates import CERTIFICATES, RANGES

ISLAND_FORMS = ("pocket", "standard", "long")
TOTALS = "totals"
RESULTS = ("phi_F", "phi_A")
NAMES = {
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "where": np.where,
    "pow": lambda a, b: a**b,
}
Steps = Mapping[str, str]


@dataclasses.dataclass(frozen=True)
class ClosedForm:
    """One closed form of one result: each step uses the arguments and earlier steps, the last is the value."""

    form: str
    result: str
    arguments: tuple[str, ...]
    title: str
    steps: Steps

    def __call__(self, *given: Any) -> Any:
        """Of arrays, which broadcast."""
        return evaluate(self.steps, dict(zip(self.arguments, given, strict=True)))[
            self.result
        ]


def read_functions(text: str) -> dict[str, dict[str, ClosedForm]]:
    """The functions of a file's text by form and result."""

    def steps(lines: str) -> dict[str, str]:
        """Of lines, of which indented ones continue the one before."""
        return dict(
            line.split(" = ", 1) for line in re.sub(r"\n +", " ", lines).splitlines()
        )

    found: dict[str, dict[str, ClosedForm]] = {}
    for form, own in tomllib.loads(text).items():
        arguments = tuple(own.pop("arguments"))
        shared = steps(own.pop("shared"))
        found[form] = {
            result: ClosedForm(
                form, result, arguments, one["title"], shared | steps(one["steps"])
            )
            for result, one in own.items()
        }
    return found


_compiled = functools.cache(lambda text: compile(text, "closed_forms.toml", "eval"))


def evaluate(steps: Steps, given: Mapping[str, FloatArray]) -> dict[str, Any]:
    """Values of all steps, by numpy functions.

    Examples
    --------
    >>> evaluate({"w": "1.0 / (X + 3.0)"}, {"X": np.array([1.0, 2.0])})["w"]
    array([0.25, 0.2 ])
    """
    names: dict[str, Any] = NAMES | dict(given)
    with np.errstate(all="ignore"):
        for name, text in steps.items():
            names[name] = eval(_compiled(text), names)
    return names


FUNCTIONS = read_functions(
    pathlib.Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)


class FormulaModel(Ranged):
    """Phi_F and Phi_A by a closed form; exact as mu goes to 0 but for the approximation of the rigid sphere.

    Parameters
    ----------
    form : {"standard", "pocket", "long"}
        Which of the forms.

    Raises
    ------
    InputError
        For an unknown form.

    Examples
    --------
    >>> answer = FormulaModel().answer([1.0, 5.0], 2.0)
    >>> answer.phi_F.round(2)
    array([1.39, 9.48])
    >>> float(answer.error.max()) < 0.01
    True
    """

    name = "formula"

    def __init__(self, form: str = "standard") -> None:
        if form not in ISLAND_FORMS:
            raise InputError(f"form must be one of {ISLAND_FORMS}, got {form!r}")
        self.form, self.ranges, self.holds = (
            form,
            RANGES[form],
            f", where the {form} form holds",
        )

    def _rows(self, X: FloatArray, mu: FloatArray) -> FloatArray:
        out = np.full((3, X.size), np.nan)
        (low, high), (least, most) = self.ranges["X"], self.ranges["mu"]
        inside = (low <= X) & (high >= X) & (mu >= least) & (mu <= most)
        for row, name in enumerate(RESULTS):
            out[row, inside] = FUNCTIONS[self.form][name](X[inside], mu[inside])
        out[2, inside] = max(CERTIFICATES[self.form][name].largest for name in RESULTS)
        return out


def closed_totals(
    surface: Surface, separation: ArrayLike, E_star: ArrayLike = 1.0
) -> tuple[FloatArray, FloatArray, float]:
    """Total force and area by the closed totals, variant "reported".

    Parameters
    ----------
    surface, separation, E_star
        As for `mbma_tables.contact`, plain numbers.

    Returns
    -------
    pressure, area : array_like
        Force over nominal area [unit of `E_star`] and A/A0, in the broadcast shape.
    error : float
        The largest relative error of either, as certified.

    Raises
    ------
    InputError, OutOfRangeError
        For surfaces and separations outside the range of the form, and for less contact
        than it describes.

    Examples
    --------
    >>> pressure, area, error = closed_totals(Surface(0.8, 1.0, 200.0, 1.0, 3.0), [-2.0, 0.0])
    >>> area.round(2)
    array([0.21, 0.02])
    >>> error < 0.1
    True
    """
    gap = finite_array("separation", separation)
    modulus = positive_array("E_star", E_star)
    shape = broadcast_shape(separation=gap, surface=surface.h_rms, E_star=modulus)
    fields = (
        gap / surface.h_rms,
        surface.h_max / surface.h_rms,
        surface.zeta_1,
        surface.hurst,
    )
    given = [np.broadcast_to(np.asarray(field), shape) for field in fields]
    for (name, (low, high)), field in zip(RANGES[TOTALS].items(), given, strict=False):
        require(
            name,
            field,
            (field >= low) & (field <= high),
            f"in [{low:g}, {high:g}], where the closed totals hold",
        )
    gap = np.broadcast_to(gap, shape)
    h_max = np.broadcast_to(np.asarray(surface.h_max), shape)
    require("separation", gap, gap >= -h_max, "at least -h_max, where the model ends")
    require(
        "separation", gap, gap < h_max, "below h_max: there is no contact from there on"
    )
    pressure, area = (FUNCTIONS[TOTALS][name](*given) for name in ("pressure", "area"))
    low, _ = RANGES[TOTALS]["area"]
    require(
        "area",
        np.asarray(area),
        area >= low,
        f"at least {low:g}, where the closed totals hold",
    )
    scale = modulus * surface.q0 * surface.h_rms
    error = max(found.largest for found in CERTIFICATES[TOTALS].values())
    return pressure * scale, area, error
