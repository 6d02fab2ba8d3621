"""Attraction between two bodies: its work, range, and traction over the gap."""

from __future__ import annotations

import dataclasses
import functools
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import (
    FloatArray,
    detached,
    finite_array,
    is_labelled,
    number_in,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, factor

# tractions over work/range, of gaps over the range, of integral 1
TRACTIONS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "exponential": lambda x: np.exp(-x),
    "van der Waals": lambda x: 2 * (1 + x) ** -3.0,
}
EXPONENTIAL = "exponential"
SMALLEST, LARGEST = 1e-300, 1e300
# J/m^2 is N/m: work is a stress times a length
_WORK = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([umk]?)(?:J/m\^?2|J/m²|N/m)\s*"
)
_HAMAKER = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(z|a|f|p|n|u|m|)J\s*"
)
_PREFIXES = {
    **{"": 1.0, "k": 1e3, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15},
    **{"a": 1e-18, "z": 1e-21},
}
QUADRATURE_NODES = 200  # of the integral of a traction over all gaps


@dataclasses.dataclass(frozen=True)
class Adhesion:
    """Attraction between two bodies at a distance.

    Parameters
    ----------
    work : float, str or array_like
        Work of adhesion per area, the energy to part two flat faces: "50 mJ/m^2", or a
        number in the unit of `E_star` times that of the surface's lengths. At least 0; at 0
        there is no attraction. An array broadcasts with the contact.
    range : float, str or array_like
        Length over which the traction falls, "0.3 nm", or a number in the surface's unit.
    traction : {"exponential", "van der Waals"} or callable, optional
        Of the gap over the range: ``exp(-x)``, by default, or ``2 (1 + x)**-3``, that of
        half-spaces with van der Waals' forces; or a function of an array of x from 0 on,
        finite, not negative and falling. Its integral is made 1, so that `work` is the work.

    Raises
    ------
    InputError, OutOfRangeError
        For numbers that are not finite or out of range, and units of something else.

    Notes
    -----
    Contacts with an attraction are answered by `mbma_tables.theories.adhesion`; docs/adhesion.md has the
    equations, and up to where they were compared with simulations.

    Examples
    --------
    >>> from mbma_tables import Adhesion, Bodies, Surface, contact
    >>> polymer = Bodies("1 GPa", adhesion=Adhesion(work="10 mJ/m^2", range="10 nm"))
    >>> face = Surface(hurst=0.8, q0=0.1, q1=1.6, h_rms=0.1, h_max=0.35, unit="um")
    >>> pressed = contact(face, polymer, pressure="1 MPa", theory="calibrated")
    >>> without = contact(face, "1 GPa", pressure="1 MPa", theory="calibrated")
    >>> f"{pressed.area:.1%} in contact, {without.area:.1%} without attraction"
    '8.0% in contact, 7.4% without attraction'
    """

    work: Any
    range: Any
    _: dataclasses.KW_ONLY
    traction: Any = EXPONENTIAL

    def __post_init__(self) -> None:
        for name in ("work", "range"):
            object.__setattr__(self, name, detached(getattr(self, name)))
        self.work_in(Units(length="um", stress="MPa"))
        self.range_in(Units(length="um", stress="MPa"))
        if isinstance(self.traction, str):
            if self.traction not in TRACTIONS:
                raise InputError(
                    f"traction must be one of {tuple(TRACTIONS)} or a function of the gap "
                    f"over the range, got {self.traction!r}"
                )
        elif not callable(self.traction):
            raise InputError(
                f"traction must be a name or a function, got {self.traction!r}"
            )
        else:
            _ = self.shape

    @classmethod
    def of_hamaker(cls, hamaker: float | str, cutoff: float | str) -> Adhesion:
        """Van der Waals' attraction by a Hamaker constant and the distance of closest approach.

        The work is ``hamaker/(12 pi cutoff**2)``, the range the cutoff.

        Parameters
        ----------
        hamaker : float or str
            [J], such as "1e-19 J" or "100 zJ".
        cutoff : str
            Distance of bodies in contact with its unit, such as "0.165 nm".

        Examples
        --------
        >>> from mbma_tables import Adhesion
        >>> Adhesion.of_hamaker("1e-19 J", "0.165 nm").work
        '0.09743 J/m^2'
        """
        energy = _hamaker(hamaker)
        metres = number_in(
            "cutoff", Units(length="m").number("separation", cutoff), SMALLEST, LARGEST
        )
        work = energy / (12 * np.pi * metres**2)
        return cls(f"{work:.4g} J/m^2", cutoff, traction="van der Waals")

    @property
    def shape(self) -> Callable[[FloatArray], FloatArray]:
        """Traction over work/range as a function of the gap over the range, of integral 1."""
        if isinstance(self.traction, str):
            return TRACTIONS[self.traction]
        return _normalized(self.traction)

    def named(self, units: Units) -> Adhesion:
        """The same attraction with its units, of plain numbers in these; itself where they are not known."""
        if units.length is None or units.stress in (None, "1"):
            return self
        metre = factor("m", units.length)
        joule = factor("Pa", str(units.stress), "stress") * metre
        work, length = float(self.work_in(units)), float(self.range_in(units))
        return dataclasses.replace(
            self, work=f"{work / joule!r} J/m^2", range=f"{length / metre!r} m"
        )

    def work_in(self, units: Units) -> Any:
        """The work in the unit of stresses times that of lengths, an array if it is one."""
        work = _work(self.work, units)
        return work if is_labelled(work) else _checked_work(work)[()]

    def range_in(self, units: Units) -> Any:
        """The range in the unit of lengths, an array if it is one."""
        length = units.number("range", self.range)
        return length if is_labelled(length) else positive_array("range", length)[()]


def _checked_work(work: Any) -> FloatArray:
    array = finite_array("work", work)
    require("work", array, array >= 0, "at least 0")
    return array


def _work(given: Any, units: Units) -> Any:
    """A work in the unit of stresses times that of lengths: numbers as they are, lists by entry."""
    if isinstance(given, list | tuple):
        return [_work(each, units) for each in given]
    return _work_of_text(given, units) if isinstance(given, str) else given


@functools.lru_cache(maxsize=64)
def _work_of_text(given: str, units: Units) -> float:
    """A work in the unit of stresses times that of lengths."""
    match = _WORK.fullmatch(given.replace("\N{MICRO SIGN}", "u"))
    if match is None:
        raise InputError(
            f"work must be an energy per area such as '50 mJ/m^2', got {given!r}"
        )
    joules = float(match[1]) * _PREFIXES[match[2]]
    if units.length is None or units.stress in (None, "1"):
        raise InputError(
            f"work = {given!r} beside numbers without units: give the surface its "
            "unit and E* with its own, such as '100 GPa'"
        )
    return joules * factor("Pa", str(units.stress), "stress") * factor("m", units.length)


def _hamaker(given: Any) -> float:
    """A Hamaker constant [J]."""
    if isinstance(given, str):
        match = _HAMAKER.fullmatch(given)
        if match is None:
            raise InputError(
                f"hamaker must be an energy such as '1e-19 J', got {given!r}"
            )
        given = float(match[1]) * _PREFIXES[match[2]]
    return number_in("hamaker", given, SMALLEST, LARGEST)


def _normalized(
    traction: Callable[[FloatArray], FloatArray],
) -> Callable[..., FloatArray]:
    """A function of the gap over the range, divided by its integral."""
    # x from 0 to infinity as s/(1 - s)
    node, weight = np.polynomial.legendre.leggauss(QUADRATURE_NODES)
    s = (node + 1) / 2
    x = s / (1 - s)
    with np.errstate(all="ignore"):
        values = np.asarray(traction(np.array([0.0, *x])), dtype=float)
    is_fit = (
        values.shape == (x.size + 1,)
        and np.isfinite(values).all()
        and (values >= 0).all()
        and (np.diff(values) <= 0).all()
    )
    if not is_fit:
        raise InputError(
            "a traction must be a function of an array of gaps over the range, with finite "
            "values that fall to zero and are not negative"
        )
    integral = float((values[1:] * weight / 2 / (1 - s) ** 2).sum())
    farthest = float((values[1:] * x)[-1])
    if not (0 < integral < np.inf) or farthest > 1e-2 * integral:
        raise InputError("the integral of a traction over all gaps must be finite")

    def normalized(gap: FloatArray) -> FloatArray:
        return np.asarray(traction(gap), dtype=float) / integral

    return normalized


@dataclasses.dataclass(frozen=True, eq=False)
class AdhesionInUnits:
    """An attraction as numbers, in the units of a contact."""

    work: Any  # [stress length], array_like
    range: Any  # [length], array_like
    shape: Callable[[FloatArray], FloatArray]  # traction over work/range by gap/range
    is_exponential: bool

    @classmethod
    def of(cls, given: Any, units: Units) -> AdhesionInUnits | None:
        """The attraction of bodies; None where there is none, or its work is 0."""
        if given is None:
            return None
        work = given.work_in(units)
        length = given.range_in(units)
        if not is_labelled(work) and not np.any(work):
            return None
        return cls(work, length, given.shape, given.traction == EXPONENTIAL)

    def checked(self) -> AdhesionInUnits:
        """The same, of arrays whose numbers were checked."""
        return dataclasses.replace(
            self,
            work=_checked_work(self.work),
            range=positive_array("range", self.range),
        )

    @property
    def strength(self) -> FloatArray:
        """Traction at gap zero [stress]."""
        return np.asarray(self.work / self.range * float(self.shape(np.zeros(1))[0]))

    @property
    def width(self) -> FloatArray:
        """Work over strength [length], the range of an exponential traction."""
        return np.asarray(self.range / float(self.shape(np.zeros(1))[0]))


def adhesion_of(given: Any) -> Any:
    """An `Adhesion` as it is, or of the mapping of its arguments as files have it."""
    if given is None or isinstance(given, Adhesion):
        return given
    try:
        return Adhesion(**given)
    except TypeError:
        raise InputError(
            "adhesion must be Adhesion(work=..., range=...), or a mapping of these, "
            f"got {given!r}"
        ) from None
