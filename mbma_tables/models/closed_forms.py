"""The island model in closed form: Phi_F and Phi_A from a form of tables/formula.json."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.errors import InputError
from mbma_tables.formulas.file import ISLAND_FORMS, ISLAND_OUTPUTS, get_form
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models.protocol import BOTH, EXACT_RTOL, OUTSIDE, IslandAnswer


class FormulaModel:
    """Phi_F and Phi_A by a closed form; exact as mu goes to 0 but for its rigid sphere's own approximation.

    Parameters
    ----------
    form : {"standard", "pocket", "long"}
        Which of the forms.
    """

    name = "formula"

    def __init__(self, form: str = "standard") -> None:
        if form not in ISLAND_FORMS:
            raise InputError(f"form must be one of {ISLAND_FORMS}, got {form!r}")
        self.form = get_form(form)

    def answer(self, X: ArrayLike, mu: ArrayLike, *, outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A with the largest error that the form's certificate states.

        Parameters
        ----------
        X, mu : array_like
            They broadcast.
        outside : {"raise", "exact", "nan"}
            Where X or mu is outside the form's range: an error, the exact solver, or NaN.
        which : int
            FORCE, AREA or BOTH; what is not asked for is NaN.

        Raises
        ------
        InputError, OutOfRangeError
        """
        if outside not in OUTSIDE:
            raise InputError(f"outside must be one of {OUTSIDE}, got {outside!r}")
        given = {"X": finite_array("X", X), "mu": finite_array("mu", mu)}
        require("mu", given["mu"], given["mu"] >= 0, "at least 0")
        shape = broadcast_shape(**given)
        inside = np.ones(shape, dtype=bool)
        for name, array in given.items():
            low, high = self.form.range[name]
            covered = (array >= low) & (array <= high)
            if outside == "raise":
                require(name, array, covered, f"in [{low:g}, {high:g}], where the {self.form.name} form holds")
            inside &= covered
        flat = {name: np.broadcast_to(array, shape)[inside] for name, array in given.items()}
        wanted = ISLAND_OUTPUTS if which == BOTH else (ISLAND_OUTPUTS[which],)
        out = np.full((3, *shape), np.nan)
        for name, values in self.form.evaluate(flat, wanted).items():
            out[ISLAND_OUTPUTS.index(name), inside] = values
        out[2, inside] = max(self.form.largest_error(name) for name in wanted)
        if outside == "exact" and not inside.all():
            lost = {name: np.broadcast_to(array, shape)[~inside] for name, array in given.items()}
            solved = greenwood_tripp.solve(lost["X"], lost["mu"], rtol=EXACT_RTOL)
            out[:, ~inside] = solved.phi_F, solved.phi_A, solved.error
        return IslandAnswer(*(row[()] for row in out))

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A of islands, or the one asked for."""
        return self.answer(islands["X"], islands["mu"], outside=outside, which=which)
