"""Errors of contacts with a hardness against boundary elements, from the calibrated laws' file."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.theories.calibrated_table import shipped_part

GROUP = "hardness"
QUANTITIES = ("area", "yielded", "force", "stiffness")


@dataclasses.dataclass(frozen=True, eq=False)
class Scatter:
    """Root mean squares of ln(theory/simulation), by theory, of shape (4, hardnesses, bins), rows `QUANTITIES`.

    Attributes
    ----------
    eta : numpy.ndarray
        p_m/(E* g), rising.
    log_area : numpy.ndarray
        ln of contact fractions.
    stated : dict
        By the name under which a theory's scatter is stated.
    """

    eta: FloatArray
    log_area: FloatArray
    stated: dict[str, FloatArray]

    def standard_deviation(self, theory: str, quantity: str, eta: FloatArray, area: FloatArray) -> FloatArray:
        """At hardnesses and contact fractions, held constant beyond those simulated; NaN where not known."""
        shape = np.broadcast_shapes(np.shape(eta), np.shape(area))
        if theory not in self.stated:
            return np.full(shape, np.nan)
        rows = self.stated[theory][QUANTITIES.index(quantity)]
        with np.errstate(divide="ignore"):
            x = np.clip(np.log(np.broadcast_to(area, shape)), self.log_area[0], self.log_area[-1])
        y = np.interp(np.log(np.broadcast_to(eta, shape)), np.log(self.eta), np.arange(self.eta.size))
        below = np.minimum(y.astype(int), self.eta.size - 2)
        values = np.array([np.interp(x, self.log_area, row) for row in rows])
        low, high = (np.take_along_axis(values, k[None], 0)[0] for k in (below, below + 1))
        return np.asarray(low + (high - low) * (y - below))


@functools.cache
def shipped() -> Scatter:
    """The shipped file's, read once."""
    variables, attributes = shipped_part(GROUP)
    names = str(attributes["theories"]).split()
    stated = {name: variables["stated_scatter"][k] for k, name in enumerate(names)}
    return Scatter(variables["eta"], np.log(variables["contact"]), stated)
