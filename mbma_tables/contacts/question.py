"""The question of a contact: the one quantity at which it is asked for, checked once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import finite_array, is_labelled, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units

GAPS = ("separation", "mean_separation")
PRESCRIBED = (*GAPS, "pressure", "area")  # one of which a contact is asked at


@dataclasses.dataclass(frozen=True, eq=False)
class Question:
    """The quantity at which a contact is asked for, in the units of the contact.

    Its value is an array of finite numbers, or a DataArray, whose numbers are checked block
    by block.
    """

    name: str
    value: Any

    @classmethod
    def of(cls, units: Units, candidates: Mapping[str, Any]) -> Question:
        """The one candidate that is not None: numbers, texts with units, or lists of them."""
        name = name_of_the_given(candidates)
        numbers = units.number(name, candidates[name])
        # copies, since results hold them and their owner may go on changing what was given
        if is_labelled(numbers):
            return cls(name, numbers.copy())
        return cls(name, np.array(finite_array(name, numbers)))

    def of_block(self, numbers: Any) -> Question:
        """The same question at other numbers, as those of a block of a DataArray."""
        return Question(self.name, finite_array(self.name, numbers))

    def require_in_range(self, h_max: Any, is_pulled: bool) -> None:
        """Reject gaps beyond full compression, and pressures and areas below 0, but pulls of bodies that attract."""
        if self.name == "separation":
            allowed = "at least -h_max, where the model ends at full compression"
            require(self.name, self.value, self.value >= -h_max, allowed)
        elif self.name != "pressure" or not is_pulled:
            require(self.name, self.value, self.value >= 0, "at least 0")

    @property
    def is_gap(self) -> bool:
        """Whether a gap is given, and not a pressure or an area, at which it is to be found."""
        return self.name in GAPS


def name_of_the_given(candidates: Mapping[str, Any]) -> str:
    """The name of the one candidate that is not None."""
    names = []
    for name, value in candidates.items():
        if value is not None:
            names.append(name)
    if len(names) != 1:
        raise InputError(
            f"give exactly one of {', '.join(candidates)}; got {' and '.join(names) or 'none'}"
        )
    return names[0]


def both_separations(
    name: str, gap: Any, h_max: Any, ends_at_h_max: bool
) -> tuple[Any, Any]:
    """Separations d and mean separations u = (h_max + d)/2 (50), of which `gap` is the one named.

    Where contact ends at h_max, bodies farther apart do not touch: both are then the distance
    of the mean planes.
    """
    # twice the largest numbers is infinite, and limited to the gap itself
    with np.errstate(over="ignore"):
        if name == "separation":
            mean = (h_max + gap) / 2
            return gap, np.maximum(mean, gap) if ends_at_h_max else mean
        separation = 2 * gap - h_max
    return np.minimum(separation, gap) if ends_at_h_max else separation, gap
