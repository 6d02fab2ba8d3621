"""The distribution of gaps of an elastic contact: means, shares and density; docs/adhesion.md has the law."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array, is_labelled, require
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.quantities.declaration import on_request, quantity
from mbma_tables.contacts.quantities.separations import LENGTH
from mbma_tables.contacts.quantities.state import Need, State
from mbma_tables.theories import gap_law

ELASTIC = Need(
    "an elastic contact",
    lambda contact: not contact.yields,
    "gaps of contacts that yield were not simulated for their distribution; "
    "that of the same bodies with hardness=inf is known",
)
HALF = 0.5


def _require_elastic(contact: State) -> None:
    if not ELASTIC.is_given(contact):
        raise InputError(
            f"the distribution of gaps needs {ELASTIC.name}: {ELASTIC.remedy}"
        )


def mean_over_gaps(contact: State, function: Callable[[FloatArray], FloatArray]) -> Any:
    """Sum of a function of the gap over the open part of a contact, over the nominal area."""
    _require_elastic(contact)

    def mean(
        theory: Any, surface: Any, u: Any, E_star: Any, area: Any
    ) -> tuple[FloatArray]:
        share, gap = theory.open_gaps(surface, u, area)
        values = np.asarray(function(gap.copy()), dtype=float)
        if values.shape not in ((), gap.shape):
            raise InputError(
                f"the function of the gap must keep the shape of its argument, {gap.shape}, "
                f"got {values.shape}"
            )
        if not np.isfinite(values).all():
            raise InputError(
                "the function of the gap must be finite at every positive gap"
            )
        return ((share * values).sum(axis=-1),)

    return contact.evaluate(mean, 1, {"area": contact.area})[0]


def share_of_gaps(contact: State, gap: ArrayLike | str) -> Any:
    """Share of the nominal area with gaps of at most `gap`, contact included."""

    def below(gaps: FloatArray, area: FloatArray, wanted: FloatArray) -> FloatArray:
        return gap_law.share_below(gaps, area, wanted)

    return _at_gap(contact, gap, below, least_is_zero=True)


def density_of_gaps(contact: State, gap: ArrayLike | str) -> Any:
    """Density of the open gaps, the share of the nominal area per length of gap."""
    return _at_gap(contact, gap, gap_law.density, least_is_zero=False)


def _at_gap(
    contact: State,
    gap: ArrayLike | str,
    ask: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    least_is_zero: bool,
) -> Any:
    _require_elastic(contact)
    given = contact.unit_system.number("gap", gap)

    def found(
        theory: Any, surface: Any, u: Any, E_star: Any, area: Any, wanted: Any
    ) -> tuple[FloatArray]:
        least = wanted >= 0 if least_is_zero else wanted > 0
        require("gap", wanted, least, "at least 0" if least_is_zero else "positive")
        gaps = theory.open_gaps(surface, u, area)[1]
        return (ask(gaps, area, wanted),)

    if not is_labelled(given):
        given = finite_array("gap", given)
    more = {"area": contact.area, "gap": given}
    return contact.evaluate(found, 1, more)[0]


@quantity(
    LENGTH,
    "gap that half of the open area exceeds",
    needs=(ELASTIC,),
    is_column=False,
    is_listed=on_request,
)
def median_gap(contact: State) -> Any:
    """Median of the open gaps [length], by the law of docs/adhesion.md, of a simulated map by the map itself."""

    def median(
        theory: Any, surface: Any, u: Any, E_star: Any, area: Any
    ) -> tuple[FloatArray]:
        gaps = theory.open_gaps(surface, u, area)[1]
        shares, _ = gap_law.rule()
        place = int(np.searchsorted(shares, HALF))
        low, high = shares[place - 1], shares[place]
        left = (HALF - low) / (high - low)
        return (gaps[..., place - 1] ** (1 - left) * gaps[..., place] ** left,)

    return contact.evaluate(median, 1, {"area": contact.area})[0]
