"""What is between two bodies besides their roughness: friction, the direction of shear, a gas."""

from __future__ import annotations

import dataclasses

from numpy.typing import ArrayLike


@dataclasses.dataclass(frozen=True)
class Gas:
    """A gas between two bodies.

    Parameters
    ----------
    name : {"air", "helium", "nitrogen", "argon", "vacuum"}
    temperature : float
        [K], from 200 to 600.
    pressure : float or str
        [Pa], or with its unit.
    accommodation : float, optional
        Thermal accommodation coefficient of the faces; default: that of machined metals.

    Examples
    --------
    >>> from mbma_tables import Gas
    >>> Gas("helium", pressure="10 mbar").temperature
    300.0
    """

    name: str = "air"
    temperature: ArrayLike = 300.0  # [K]
    pressure: ArrayLike | str = "1 atm"
    accommodation: ArrayLike | None = (
        None  # thermal, of the faces; None is that of machined metals
    )


@dataclasses.dataclass(frozen=True)
class Interface:
    """What is between two bodies besides their roughness."""

    friction: float | None = None  # coefficient of friction
    direction: str | None = None  # of the shear, "along" or "across" the lay
    gas: Gas | None = None


NOTHING_BETWEEN = Interface()
