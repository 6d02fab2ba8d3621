"""What is between two bodies besides their roughness: friction, the direction of shear, a gas, a seal's fluid."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.common.arguments import detached, is_labelled, require_fields
from mbma_tables.common.units import Units
from mbma_tables.contacts.quantities.gas import checked_gas


@dataclasses.dataclass(frozen=True)
class Gas:
    """A gas between two bodies.

    Parameters
    ----------
    name : {"air", "helium", "nitrogen", "argon", "vacuum"}
    temperature : array_like
        [K], from 200 to 600.
    pressure : array_like or str
        [Pa], or with its unit.
    accommodation : array_like, optional
        Thermal accommodation coefficient of the faces, in (0, 1]; default: that of
        machined metals.

    Raises
    ------
    InputError, OutOfRangeError
        For an unknown name, and for numbers at which the gas is not known.

    Examples
    --------
    >>> from mbma_tables import Gas
    >>> Gas("helium", pressure="10 mbar").temperature
    300.0
    """

    name: str = "air"
    temperature: ArrayLike = 300.0  # [K]
    pressure: ArrayLike | str = "1 atm"
    accommodation: ArrayLike | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            object.__setattr__(self, name, detached(value))
        numbers = self.temperature, self.pascals, self.accommodation
        # DataArrays may be lazy: they are checked where they are computed
        if not any(map(is_labelled, numbers)):
            checked_gas(self.name, *numbers)

    @classmethod
    def of(cls, given: Any) -> Gas:
        """A gas by its name, as it is, or of its arguments by name, as files have them."""
        if isinstance(given, Gas):
            return given
        if isinstance(given, Mapping):
            require_fields(cls, given)
            return cls(**given)
        return cls(given)

    @property
    def pascals(self) -> Any:
        """The pressure as a number [Pa]."""
        return Units(stress="Pa").number("gas_pressure", self.pressure)


@dataclasses.dataclass(frozen=True)
class Interface:
    """What is between two bodies besides their roughness."""

    friction: ArrayLike | None = None  # coefficient of friction
    direction: str | None = None  # of the shear, "along" or "across" the lay
    gas: Gas | None = None
    #: arguments of `Leakage.gas` or `Leakage.liquid` by name, for `leak_rate`
    seal: Mapping[str, Any] | None = None


NOTHING_BETWEEN = Interface()
