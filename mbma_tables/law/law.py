"""A contact law of any theory: pressure, area, slopes and energy against the gap, and inverses, by `core/law.c`."""

from __future__ import annotations

import ctypes
import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    finite_array,
    is_labelled,
    require,
)
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.shared import frozen
from mbma_tables.common.units import UNKNOWN, Units, unit_of
from mbma_tables.contacts.source import MEANINGS, LawPoint, LawValues
from mbma_tables.core import core
from mbma_tables.law import block as at
from mbma_tables.law.block import AREA, FORCE, QUANTITIES, inverse_block
from mbma_tables.law.derived import Derived
from mbma_tables.materials import Pair
from mbma_tables.surfaces.any_surface import AnySurface, apply

if TYPE_CHECKING:
    from scipy import LowLevelCallable

    class Law:
        """Type of the law in `core/binding.c`, which evaluates floats and small arrays without Python."""

        pressure: Callable[..., Numbers]
        area: Callable[..., Numbers]
        stiffness: Callable[..., Numbers]
        area_slope: Callable[..., Numbers]
        energy: Callable[..., Numbers]
        _addresses: Callable[[], tuple[tuple[int, ...], int]]

else:
    Law = core.Law

BLOCK = 1 << 16  # gaps between two checks for interrupts
SHOWN_POINTS = 200  # separations of a law as a Dataset, and of its picture
SPACED = (
    1e-3,
    0.2,
)  # shares of the compression: geometric spacing between them, then even
ROUNDING = 4 * float(np.finfo(float).eps)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ContactLaw(Law, Derived, Displayed):
    """Pressure and area of one surface against its gap; made by `contact_law`, picklable, tens of kB with its surface.

    Every method takes the mean separation u, or ``separation=``, MBMA's d: numbers in the
    law's unit of length, or texts with their own, "0.8 um".

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> law = contact_law(Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0), "mbma", E_star=100e3)  # um, MPa
    >>> round(float(law.pressure(separation=1.0)), 4), round(float(law.separation(pressure=7.9825)), 4)
    (7.9825, 1.0)
    >>> round(float(law.stiffness(2.0)), 3)  # -dp/du [MPa/um]
    31.809
    >>> round(float(law.at_pressure(7.9825).area), 5), round(law.softening, 3)
    (0.00287, 1.06)
    """

    # : highest point [length]; if contact ends there, results are zero at this gap and
    # above
    h_max: float
    E_star: float  #: effective modulus, in whose unit force is
    lowest: float  #: least gap d that the law covers
    highest: float  #: largest one; infinite where contact ends at h_max
    # : bound on the relative error of force and area, of the polynomials and what they were
    # made from together; with a : hardness it does not hold within 1e-6 h_max of last
    # contact, where islands turn elastic one by one
    error: float
    turning_point: (
        float | None
    )  #: gap below which force decreases under compression, if it does; inverses end there
    area_turning_point: float | None  #: the same of the area
    theory: str
    variant: str  #: empty where the theory is not MBMA, as is `island_model`
    island_model: str
    block: FloatArray  #: the polynomials, in the layout that `mbma_tables/core/mbma.h` describes
    # : bounds on the relative error of a record's values, and of its slopes over F/x,
    # (records, 2)
    errors: FloatArray
    # : of lengths and stresses, as far as the surface and the modulus knew theirs
    units: Units = UNKNOWN
    surface: AnySurface | None = None  #: the surface of the law
    hardness: float = math.inf  #: infinite where nothing yields
    elastic: Callable[[], ContactLaw] | None = (
        None  #: with a hardness, makes the law of the elastic contact
    )
    materials: Pair | None = None  #: where they are named
    gaps: Any = (
        None  #: of a simulated map, the theory that knows the flow through its gaps
    )

    @property
    def records(self) -> FloatArray:
        """Centre, rate, polynomials of force and area, and energy of each piece, shape (records, RECORD)."""
        return self.block[self.block.view(np.int64)[at.RECORDS] :].reshape(-1, at.RECORD)

    def separations(
        self, mean_separation: Any = None, separation: Any = None
    ) -> FloatArray:
        """Separations d, checked, from either mean separations or separations."""
        return self._in_range(*self._known(mean_separation, separation))[1]

    def _known(self, mean_separation: Any, separation: Any) -> tuple[str, Any]:
        """The one that is given, and its name."""
        if (mean_separation is None) == (separation is None):
            raise InputError("give the mean separation, or separation=, one of them")
        return (
            ("mean_separation", mean_separation)
            if separation is None
            else ("separation", separation)
        )

    def _in_range(self, name: str, given: Any) -> tuple[FloatArray, FloatArray]:
        """Gaps as they were given, and as separations d, within the law."""
        gaps = finite_array(name, self.units.number(name, given))
        mean = name == "mean_separation"
        d, least, most = (
            2 * gaps - self.h_max if mean else gaps,
            self.lowest,
            self.highest,
        )
        # ends that are no round numbers are met but for rounding
        slack = 0.0 if least == -self.h_max else ROUNDING * self.h_max
        shown_least, shown_most = (
            (end + self.h_max) / 2 if mean else end for end in (least, most)
        )
        limit = "" if slack or mean else "-h_max = "
        require(
            name,
            gaps,
            d >= least - slack,
            f"at least {limit}{shown_least:.17g}, where the theory ends",
        )
        if most < math.inf:
            require(
                name,
                gaps,
                d <= most * (1 + ROUNDING),
                f"at most {shown_most:.17g}, where the law ends",
            )
        return gaps, d

    def _ask(
        self,
        given: Any,
        count: int,
        check: Callable[[Any], FloatArray],
        fill: Callable[..., bool],
    ) -> Any:
        """Result of `fill`, in blocks, if it reports that all is in range; else `check` raises."""
        if is_labelled(given):
            return apply(
                lambda block: self._ask(block, count, check, fill), (given,), count
            )
        # entries of plain arrays are checked during evaluation
        plain = type(given) is np.ndarray and given.dtype == np.float64 and given.size > 0
        known = given if plain else check(given)
        flat = np.ascontiguousarray(known).reshape(-1)
        out = np.empty((count, flat.size))
        if not all(
            in_blocks(lambda block: fill(flat[block], *out[:, block]), flat.size, BLOCK)
        ):
            check(given)
        return tuple(values.reshape(known.shape)[()] for values in out)

    def _values(
        self, wanted: tuple[str, ...], mean_separation: Any, separation: Any
    ) -> Any:
        """The quantities wanted, in the order of `QUANTITIES`, in one pass."""
        name, given = self._known(mean_separation, separation)

        def fill(gaps: FloatArray, *out: FloatArray) -> bool:
            found = dict(zip(wanted, out, strict=True))
            d = gaps if name == "separation" else 2 * gaps - self.h_max
            return not core.law_fill(d, self.block, *map(found.get, QUANTITIES))

        return self._ask(
            given, len(wanted), lambda given: self._in_range(name, given)[0], fill
        )

    def _ask_one(self, what: int, mean_separation: Any, separation: Any) -> Any:
        """Arguments that a method of `Law` does not evaluate itself."""
        return self._values((QUANTITIES[what],), mean_separation, separation)[0]

    def pressure_and_stiffness(
        self,
        mean_separation: ArrayLike | None = None,
        *,
        separation: ArrayLike | None = None,
    ) -> tuple[Numbers, Numbers]:
        """F/A0 and -dp/du in one pass, for iterations."""
        pressure, stiffness = self._values(
            ("pressure", "stiffness"), mean_separation, separation
        )
        return pressure, stiffness

    def values(
        self,
        mean_separation: ArrayLike | None = None,
        *,
        separation: ArrayLike | None = None,
    ) -> LawValues:
        """Pressure, area, stiffness -dp/du and energy in one pass."""
        return LawValues(
            *self._values(
                ("pressure", "area", "stiffness", "energy"), mean_separation, separation
            )
        )

    def separation(
        self, *, pressure: ArrayLike | None = None, area: ArrayLike | None = None
    ) -> Numbers:
        """Separation d at a pressure or area, on the branch of first contact; h_max at zero, if contact ends there.

        Raises
        ------
        OutOfRangeError
            If the branch does not reach the value; the message has the branch's end.
        """
        if (pressure is None) == (area is None):
            raise InputError("give pressure or area, one of them")
        name, given = (
            ("area", area)
            if pressure is None
            else ("pressure", self.units.number("pressure", pressure))
        )
        return self._inverse(name, given)[0]  # type: ignore[no-any-return]

    def at_pressure(self, pressure: ArrayLike) -> LawPoint:
        """Separations, area and stiffness -dF/du where F/A0 is `pressure`, on the branch of first contact."""
        pressure = self.units.number("pressure", pressure)
        d, area, stiffness = self._inverse("pressure", pressure, 3)
        mean = d + self.h_max
        mean *= 0.5
        given = pressure if is_labelled(pressure) else np.asarray(pressure, float)[()]
        point = LawPoint(d, mean, area, stiffness, given)
        point.units = self.units
        return point

    def _inverse(self, name: str, given: Any, count: int = 1) -> Any:
        """Gaps of pressures or areas, and with a `count` of 3 area and -dF/du there."""
        which, inverse = (
            (FORCE if name == "pressure" else AREA),
            self._inverse_block(name),
        )
        least, most, end = inverse[at.Y_LEAST], inverse[at.Y_HIGH], inverse[at.END]

        def check(given: Any) -> FloatArray:
            wanted = finite_array(name, given)
            if ((wanted >= max(least, 0.0)) & (wanted <= most)).all():
                return wanted
            known = self.units.length, self.units.stress if name == "pressure" else None
            length, unit = ("" if own in (None, "1") else f" {own}" for own in known)
            low, high = f"at least {least:.6g}{unit}", f"at most {most:.6g}{unit}"
            require(name, wanted, wanted >= 0, "at least 0")
            require(
                name,
                wanted,
                wanted >= least,
                f"{low}, where the law of {self.theory!r} ends",
                unit,
            )
            require(
                name,
                wanted,
                wanted <= most,
                f"{high}, at d = {end:.6g}{length} where the branch ends",
                unit,
            )
            return wanted

        def fill(wanted: FloatArray, gap: FloatArray, *also: FloatArray) -> bool:
            return not core.law_invert(
                wanted, self.block, inverse, which, gap, *(also or (None, None))
            )

        return self._ask(given, count, check, fill)

    def _inverse_block(self, name: str) -> FloatArray:
        """Polynomials of x over force or area, made when first needed."""
        made: dict[str, FloatArray] = self.__dict__.setdefault("_inverses", {})
        if name not in made:
            which, turn = (
                (FORCE, self.turning_point)
                if name == "pressure"
                else (AREA, self.area_turning_point)
            )
            end = self.lowest if turn is None else turn
            made[name] = frozen(inverse_block(which, self.block, end))
        return made[name]

    def slope_error(
        self,
        mean_separation: ArrayLike | None = None,
        *,
        separation: ArrayLike | None = None,
    ) -> Any:
        """Bound on the error of `stiffness` over 2F/l, and of `area_slope` over A/l, against those of the theory.

        l = h_max - d where contact ends there, else h_max + d. It includes the error of the
        polynomials, and for MBMA that of the islands as it propagates to slopes; not the
        error of another theory itself.
        """
        d, head, words = (
            self.separations(mean_separation, separation),
            self.block,
            self.block.view(np.int64),
        )
        x = (self.h_max + np.where(d < 0, head[at.MINUS], head[at.PLUS]) * d) * head[
            at.SCALE
        ]
        # the records that hold the gaps, by shift and base of each octave of x
        rows, bits = (
            words[at.HEAD : words[at.RECORDS]].reshape(-1, 2),
            np.clip(x, head[at.LOW], head[at.HIGH]),
        )
        bits = bits.view(np.int64)
        row = rows[
            (bits >> 52) - words[at.EXPONENT] + np.where(d < 0, words[at.MINUS_ROWS], 0)
        ]
        kinks = sum(d * head[k] > head[k + 1] for k in (at.KINK_SIGN, at.KINK_SIGN_2))
        number = np.clip(
            (bits >> row[..., 0]) + row[..., 1] + kinks, 0, len(self.records) - 1
        )
        bound = self.errors[np.where(x < head[at.LOW], 0, number), 1]
        if words[at.ENDS]:
            left = self.h_max - d
            with np.errstate(divide="ignore", invalid="ignore"):
                bound = np.where(left > 0, bound * left * head[at.SCALE] / x, 0.0)
        return bound[()]

    def _facts(self) -> dict[str, str]:
        unit, modulus = self.units.length or "1", unit_of("pressure", self.units)
        known = {
            "theory": self.theory,
            "variant": self.variant,
            "island_model": self.island_model,
        }
        ends = np.array(
            [
                max(self.lowest, -self.h_max),
                self.h_max if math.isinf(self.highest) else self.highest,
            ]
        )
        known["resolution"] = "" if self.surface is None else self.surface.resolution
        facts = {name: text for name, text in known.items() if text}
        facts |= {
            "d": shown(ends, unit),
            "E_star": shown(self.E_star, modulus),
            "error": shown(self.error),
        }
        return facts | {"size": f"{self.block.nbytes + self.errors.nbytes} bytes"}

    def _variables(self) -> dict[str, Variable]:
        ends = min(self.highest, self.h_max), max(self.lowest, -self.h_max)
        light, deep = (
            np.geomspace(*SPACED, SHOWN_POINTS // 2)[:-1],
            np.linspace(SPACED[1], 1.0, SHOWN_POINTS // 2),
        )
        d = np.maximum(
            ends[0] + (ends[1] - ends[0]) * np.concatenate([light, deep]), ends[1]
        )
        values = {"separation": d, "mean_separation": (d + self.h_max) / 2} | self.values(
            separation=d
        )._asdict()
        return {
            name: Variable(value, unit_of(name, self.units), MEANINGS[name])
            for name, value in values.items()
        }

    def compiled(self, quantity: str = "pressure") -> LowLevelCallable:
        """A quantity as a C function of the separation, ``double (double, void *)``, which scipy calls without Python.

        Parameters
        ----------
        quantity : {"pressure", "area", "stiffness", "area_slope", "energy"}

        Returns
        -------
        scipy.LowLevelCallable
            NaN outside the range. For other C callers, `function` is a ctypes function and
            `user_data` its last argument, which keeps the law alive.

        Examples
        --------
        >>> from scipy.integrate import quad
        >>> from mbma_tables import Surface, contact_law
        >>> law = contact_law(Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0))
        >>> pressure = law.compiled()
        >>> work, _ = quad(pressure, 1.0, 3.0, epsabs=0.0)
        >>> bool(abs(work / 2 / law.energy(separation=1.0) - 1) < 1e-7)  # u moves half as far as d
        True
        >>> pressure.function(1.0, pressure.user_data) == law.pressure(separation=1.0)
        True
        """
        from scipy import LowLevelCallable

        if quantity not in QUANTITIES:
            raise InputError(f"quantity must be one of {QUANTITIES}, got {quantity!r}")
        addresses, data = self._addresses()
        function = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_void_p)
        given = ctypes.c_void_p(data)
        given.law = self  # type: ignore[attr-defined]
        return LowLevelCallable(function(addresses[QUANTITIES.index(quantity)]), given)

    def __getstate__(self) -> dict[str, Any]:
        return {
            field.name: getattr(self, field.name) for field in dataclasses.fields(self)
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        # pickle restores arrays as writable
        frozen((state["block"], state["errors"]))
        self.__dict__.update(state)
