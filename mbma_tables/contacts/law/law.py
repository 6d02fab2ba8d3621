"""A contact law of any theory: pressure, area, slopes and energy against the gap, and inverses, by `core/law.c`."""

from __future__ import annotations

import collections
import ctypes
import dataclasses
import functools
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    is_labelled,
    require,
)
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.shared import frozen
from mbma_tables.common.units import Units
from mbma_tables.contacts.law import block as at
from mbma_tables.contacts.law.block import AREA, FORCE, QUANTITIES, inverse_block
from mbma_tables.contacts.law.continued import ContinuedLaw
from mbma_tables.contacts.quantities.properties import LawQuantities
from mbma_tables.contacts.quantities.registry import unit_of
from mbma_tables.contacts.quantities.stiffnesses import ENERGY_OF_YIELDED
from mbma_tables.contacts.question import Question, both_separations
from mbma_tables.contacts.result import Setup
from mbma_tables.core import core
from mbma_tables.surfaces.any_surface import AnySurface, apply

if TYPE_CHECKING:
    from scipy import LowLevelCallable

    from mbma_tables.contacts.law.contact_of_law import LawContact
    from mbma_tables.contacts.law.leakage import LeakageLaw
    from mbma_tables.contacts.quantities.tangential import Tangential

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
# overclosures of the default ends of a continued law, over that of the law's last
LIGHT = 1e-2
HEAVY = 0.99
SCAN = 49  # gaps at which a law's stiffness is looked at for its maximum
DIGITS = 10.0  # times a law's error: smaller decreases of stiffness are errors of the polynomials


def _refuse_energy_of_yielded(*gaps: Any, **named: Any) -> Numbers:
    """In place of the method `energy` of laws with a hardness or adhesion."""
    raise InputError(
        f"energy needs an elastic contact without adhesion: {ENERGY_OF_YIELDED}"
    )


#: results of a law at separations: F/A0, A/A0, -dF/du and the energy, of their shape
LawValues = collections.namedtuple(
    "LawValues", ("pressure", "area", "stiffness", "energy")
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ContactLaw(Law, LawQuantities, Displayed):
    """Pressure and area of one surface against its gap; made by `contact_law`, picklable, tens of kB with its surface.

    Every method takes the mean separation u by position, or ``separation=``, MBMA's d,
    ``pressure=`` or ``area=``: numbers in the law's units, texts with their own, "0.8 um",
    lists and arrays of them, or DataArrays.

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> law = contact_law(Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0), 100e3, theory="mbma")  # um, MPa
    >>> round(float(law.pressure(separation=1.0)), 4), round(float(law.separation(pressure=7.9825)), 4)
    (7.9825, 1.0)
    >>> round(float(law.stiffness(2.0)), 3)  # -dp/du [MPa/um]
    31.809
    >>> round(float(law.at_pressure(7.9825).area), 5), round(law.softening, 3)
    (0.00287, 1.06)
    """

    setup: Setup  #: the surface, the bodies and the theory of the law
    #: highest point [length]; if contact ends there, results are zero at this gap and
    #: above
    h_max: float
    lowest: float  #: least gap d that the law covers
    highest: float  #: largest one; infinite where contact ends at h_max
    #: bound on the relative error of force and area, of the polynomials and what they were
    #: made from together; with a hardness it does not hold within 1e-6 h_max of last
    #: contact, where islands turn elastic one by one
    error: float
    turning_point: (
        float | None
    )  #: gap below which force decreases under compression, if it does; inverses end there
    area_turning_point: float | None  #: the same of the area
    block: FloatArray  #: the polynomials, in the layout that `mbma_tables/core/mbma.h` describes
    #: bounds on the relative error of a record's values, and of its slopes over F/x,
    #: (records, 2)
    errors: FloatArray
    elastic: Callable[[], ContactLaw] | None = (
        None  #: with a hardness, makes the law of the elastic contact
    )
    gaps: Any = (
        None  #: of a simulated map, the theory that knows the flow through its gaps
    )

    def __post_init__(self) -> None:
        if self.elastic is not None:
            # it precedes the method of the core, which a check would make four times slower
            vars(self)["energy"] = _refuse_energy_of_yielded

    @property
    def surface(self) -> AnySurface:
        """The surface of the law."""
        return self.setup.surface

    @property
    def units(self) -> Units:
        """Units of lengths and stresses, as far as the surface and the modulus have them."""
        return self.setup.bodies.units

    @property
    def E_star(self) -> float:
        """Effective modulus, in whose unit force is."""
        return float(self.setup.bodies.E_star)

    @property
    def hardness(self) -> float:
        """Hardness of the softer body; infinite where nothing yields."""
        return float(self.setup.bodies.hardness)

    @property
    def theory(self) -> str:
        """Name of the theory."""
        return self.setup.theory.name

    @property
    def variant(self) -> str:
        """Name of MBMA's variant; empty for other theories."""
        return self.setup.theory.variant_name

    @property
    def island_model(self) -> str:
        """Name of MBMA's island model; empty for other theories."""
        return self.setup.theory.island_model_name

    @property
    def records(self) -> FloatArray:
        """Centre, rate, polynomials of force and area, and energy of each piece, shape (records, RECORD)."""
        return self.block[self.block.view(np.int64)[at.RECORDS] :].reshape(-1, at.RECORD)

    def _asked(
        self,
        mean_separation: Any = None,
        separation: Any = None,
        pressure: Any = None,
        area: Any = None,
    ) -> Question:
        """The one that is given, in the units of the law."""
        candidates = {
            "separation": separation,
            "mean_separation": mean_separation,
            "pressure": pressure,
            "area": area,
        }
        return Question.of(self.units, candidates)

    def both_separations(self, name: str, gap: Any) -> tuple[Any, Any]:
        """Separations d and mean separations u, of which `gap` is the one named."""
        return both_separations(name, gap, self.h_max, math.isinf(self.highest))

    def separations_of(self, question: Question) -> Any:
        """Separations d within the law, at gaps, pressures or areas."""
        if not question.is_gap:
            return self._inverse(question)[0]
        if is_labelled(question.value):
            return apply(
                lambda block: (self.separations_of(question.of_block(block)),),
                (question.value,),
                1,
            )[0]
        return self._in_range(question)

    def _in_range(self, question: Question) -> FloatArray:
        """Gaps as separations d; an error for those beyond the law."""
        name = question.name
        gaps = question.value
        d: FloatArray = self.both_separations(name, gaps)[0]
        mean = name == "mean_separation"
        theory = self.setup.theory
        # where islands of MBMA are not covered, NaN may be asked for
        least = -self.h_max if theory.outside == "nan" else self.lowest
        # ends that are no round numbers are met but for rounding
        slack = 0.0 if least == -self.h_max else ROUNDING * self.h_max
        shown_least, shown_most = (
            (end + self.h_max) / 2 if mean else end for end in (least, self.highest)
        )
        limit = "" if slack or mean else "-h_max = "
        require(
            name,
            gaps,
            d >= least - slack,
            f"at least {limit}{shown_least:.17g}, where the theory ends",
        )
        if self.highest < math.inf:
            require(
                name,
                gaps,
                d <= self.highest * (1 + ROUNDING),
                f"at most {shown_most:.17g}, where the law ends",
            )
        return d

    def values_of(self, wanted: tuple[str, ...], question: Question) -> Any:
        """The quantities wanted, in the order of `QUANTITIES`, in one pass."""
        if is_labelled(question.value):
            return apply(
                lambda block: self.values_of(wanted, question.of_block(block)),
                (question.value,),
                len(wanted),
            )
        if question.name == "mean_separation":
            # bodies so far apart that this is infinite are answered below
            with np.errstate(over="ignore"):
                d = 2 * question.value - self.h_max
        else:
            d = self.separations_of(question) if not question.is_gap else question.value
        values, inside = self._filled(wanted, d)
        if question.is_gap and not inside:
            values, _ = self._filled(wanted, self._in_range(question))
        return values

    def _filled(
        self, wanted: tuple[str, ...], d: FloatArray
    ) -> tuple[tuple[Numbers, ...], bool]:
        """The quantities wanted at separations d, and whether all of these are within the law."""
        flat = np.ascontiguousarray(d).reshape(-1)
        out = np.empty((len(wanted), flat.size))
        rows = dict(zip(wanted, out, strict=True))
        by_quantity = [rows.get(name) for name in QUANTITIES]

        def fill(block: slice) -> bool:
            parts = (None if row is None else row[block] for row in by_quantity)
            return not core.law_fill(flat[block], self.block, *parts)

        inside = all(in_blocks(fill, flat.size, BLOCK))
        return tuple(values.reshape(np.shape(d))[()] for values in out), inside

    def _ask_one(
        self, what: int, mean_separation: Any, separation: Any, pressure: Any, area: Any
    ) -> Any:
        """Arguments that a method of `Law` does not evaluate itself."""
        question = self._asked(mean_separation, separation, pressure, area)
        return self.values_of((QUANTITIES[what],), question)[0]

    def pressure_and_stiffness(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> tuple[Numbers, Numbers]:
        """F/A0 and -dp/du in one pass, for iterations."""
        question = self._asked(mean_separation, separation, pressure, area)
        pressures, stiffness = self.values_of(("pressure", "stiffness"), question)
        return pressures, stiffness

    def values(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> LawValues:
        """Pressure, area, stiffness -dp/du and the integral of the pressure over u, in one pass.

        That integral is the elastic energy where nothing yields.
        """
        question = self._asked(mean_separation, separation, pressure, area)
        return LawValues(
            *self.values_of(("pressure", "area", "stiffness", "energy"), question)
        )

    def separation(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """Separation d at a mean separation, or at a pressure or area on the branch of first contact.

        It is h_max where these are zero, if contact ends there.

        Raises
        ------
        OutOfRangeError
            If the branch does not reach the value; the message has the branch's end.
        """
        question = self._asked(mean_separation, separation, pressure, area)
        d: Numbers = self.separations_of(question)
        return d

    def at_pressure(self, pressure: ArrayLike | str) -> LawContact:
        """The contact where F/A0 is `pressure`, on the branch of first contact; as `at`.

        With a hardness each of several pressures is reached by first loading from no contact,
        also where they fall: a law knows of a larger pressure before only where it was made
        with `largest_pressure`.
        """
        return self.at(pressure=pressure)

    def values_at_pressures(self, question: Question) -> dict[str, Numbers]:
        """Separations, area and stiffness -dF/du where pressures are given, in one pass."""
        d, area, stiffness = self._inverse(question, 3)
        mean = d + self.h_max
        mean *= 0.5
        return {
            "separation": d,
            "mean_separation": mean,
            "area": area,
            "stiffness": stiffness,
            "pressure": question.value[()],
        }

    def _inverse(self, question: Question, count: int = 1) -> Any:
        """Gaps of pressures or areas, and with a `count` of 3 area and -dF/du there."""
        wanted = question.value
        if is_labelled(wanted):
            return apply(
                lambda block: self._inverse(question.of_block(block), count),
                (wanted,),
                count,
            )
        which = FORCE if question.name == "pressure" else AREA
        inverse = self._inverse_block(question.name)
        flat = np.ascontiguousarray(wanted).reshape(-1)
        out = np.empty((count, flat.size))

        def fill(block: slice) -> bool:
            gap, *also = out[:, block]
            return not core.law_invert(
                flat[block], self.block, inverse, which, gap, *(also or (None, None))
            )

        if not all(in_blocks(fill, flat.size, BLOCK)):
            self._require_on_branch(question, inverse)
        return tuple(values.reshape(wanted.shape)[()] for values in out)

    def _require_on_branch(self, question: Question, inverse: FloatArray) -> None:
        """Reject pressures or areas that the branch of first contact does not reach."""
        name = question.name
        wanted = question.value
        least = inverse[at.Y_LEAST]
        most = inverse[at.Y_HIGH]
        end = inverse[at.END]
        units = self.units.length, self.units.stress if name == "pressure" else None
        length, unit = ("" if one in (None, "1") else f" {one}" for one in units)
        low = f"at least {least:.6g}{unit}"
        high = f"at most {most:.6g}{unit}"
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
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Any:
        """Bound on the error of `stiffness` over 2F/l, and of `area_slope` over A/l, against those of the theory.

        l = h_max - d where contact ends there, else h_max + d. It includes the error of the
        polynomials, and for MBMA that of the islands as it propagates to slopes; not the
        error of another theory itself.
        """
        question = self._asked(mean_separation, separation, pressure, area)
        d = np.asarray(self.separations_of(question))
        head = self.block
        words = self.block.view(np.int64)
        x = (self.h_max + np.where(d < 0, head[at.MINUS], head[at.PLUS]) * d) * head[
            at.SCALE
        ]
        # the records that hold the gaps, by shift and base of each octave of x
        rows = words[at.HEAD : words[at.RECORDS]].reshape(-1, 2)
        bits = np.clip(x, head[at.LOW], head[at.HIGH])
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
        unit = self.units.length or "1"
        modulus = unit_of("pressure", self.units)
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

    def _contact_shown(self) -> LawContact:
        """The contact over the range of the law, of datasets and pictures."""
        ends = min(self.highest, self.h_max), max(self.lowest, -self.h_max)
        light = np.geomspace(*SPACED, SHOWN_POINTS // 2)[:-1]
        deep = np.linspace(SPACED[1], 1.0, SHOWN_POINTS // 2)
        d = np.maximum(
            ends[0] + (ends[1] - ends[0]) * np.concatenate([light, deep]), ends[1]
        )
        return self.at(separation=d)

    def _variables(self) -> dict[str, Variable]:
        return self._contact_shown().variables()

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
        if quantity == "energy":
            # an error where it is not known
            self.energy(self.h_max)
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
        self.__post_init__()

    def unloading_stiffness(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
        """-dp/du of a small unloading at constant contact area [stress/length]; `stiffness` where nothing yields.

        With a hardness it is made from the law of the elastic contact, which is fitted when
        this is first called.
        """
        question = self._asked(mean_separation, separation, pressure, area)
        law, factor = self.unloading()
        # the law of the elastic contact has other pressures at this gap
        gaps = question
        if not question.is_gap:
            gaps = Question("separation", self.separations_of(question))
        u = self.both_separations(gaps.name, gaps.value)[1]
        before = np.asarray(u) >= self.largest_before
        if np.all(before):
            return self.values_of(("stiffness",), gaps)[0]  # type: ignore[no-any-return]
        first = u if is_labelled(u) else np.where(before, self.largest_before, u)
        mean = Question("mean_separation", first)
        stiffness: Numbers = factor * law.values_of(("stiffness",), mean)[0]
        if np.any(before):
            own = self.values_of(("stiffness",), gaps)[0]
            stiffness = np.where(before, own, stiffness)[()]
        return stiffness

    @functools.cached_property
    def largest_before(self) -> float:
        """Mean separation under the largest pressure so far, from which on the law is that of unloading; infinite without one."""
        if self.setup.bodies.largest is None:
            return math.inf
        theory: Any = self.setup.theory_of(self.setup.bodies)
        peak = getattr(theory, "peak", None)
        return math.inf if peak is None else float(peak(self.surface).mean_separation)

    def unloading(self) -> tuple[ContactLaw, float]:
        """The law of the elastic contact, and `unloading_stiffness` over its stiffness."""
        if self.elastic is None:
            return self, 1.0
        return self._elastic_law_and_factor

    @functools.cached_property
    def _elastic_law_and_factor(self) -> tuple[ContactLaw, float]:
        from mbma_tables.theories.yielding.formulas import frozen_factor

        assert self.elastic is not None
        gradient = float(self.surface.rms_gradient)
        return self.elastic(), float(
            frozen_factor(self.hardness / (self.E_star * gradient))
        )

    def at(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> LawContact:
        """The contact at gaps, pressures or areas, with every quantity, as of `contact`."""
        from mbma_tables.contacts.law.contact_of_law import LawContact

        question = self._asked(mean_separation, separation, pressure, area)
        return LawContact.of(self, question)

    def tangential(
        self,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
        friction: float | None = None,
        direction: str | None = None,
    ) -> Tangential:
        """Tangential stiffness and slip at a gap, a pressure or an area, as `Contact.tangential`."""
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        return contact.tangential(friction, direction)

    def continued(self, pressures: tuple[Any, Any] | None = None) -> ContinuedLaw:
        """The law continued by its tangents beyond two pressures, for the trial steps of Newton's method.

        With the tangents, Newton's method returns from trial steps without contact, where
        the law has neither pressure nor stiffness, and from steps beyond full compression,
        where it raises an error. Check `inside` at the solution; if the bodies are apart
        there, continue the iteration with the law itself.

        Parameters
        ----------
        pressures : pair of float or str, optional
            Pressures between which the law itself is used; default: those at 1% and 99% of
            its compression, or where its stiffness begins to decrease.

        Examples
        --------
        >>> from mbma_tables import Surface, contact_law
        >>> law = contact_law(Surface.named("concrete"), "13.3 MPa", theory="calibrated")
        >>> trial, u = law.continued(), law.h_max
        >>> for _ in range(12):  # the load is 0.1 MPa
        ...     pressure, stiffness = trial.pressure_and_stiffness(u)
        ...     u += (pressure - 0.1) / stiffness
        >>> bool(trial.inside(u)), round(float(law.pressure(u)), 12)
        (True, 0.1)
        """
        if pressures is None:
            end = self.lowest if self.turning_point is None else self.turning_point
            light, heavy = (
                self.h_max - share * (self.h_max - end) / 2 for share in (LIGHT, HEAVY)
            )
            if (
                self.softening is not None
            ):  # beyond it tangents fall, to zero where pressure turns down
                heavy = max(heavy, self.softening)
        elif isinstance(pressures, tuple | list | np.ndarray) and len(pressures) == 2:
            light, heavy = (
                float(self.at_pressure(pressure).mean_separation)
                for pressure in pressures
            )
        else:
            raise InputError(f"pressures must be two rising numbers, got {pressures!r}")
        if not heavy < light or not float(self.stiffness(light)) > 0:
            raise InputError(
                f"pressures must be two rising numbers above zero, got {pressures!r}"
            )
        return ContinuedLaw(self, light, heavy)

    @functools.cached_property
    def softening(self) -> float | None:
        """Mean separation u [length] below which the stiffness decreases with compression; None if it never does."""
        from scipy.optimize import minimize_scalar

        lowest = max(self.lowest, -self.h_max)
        step = (self.h_max - lowest) / 2 / SCAN
        u = self.h_max - step * np.arange(1, SCAN + 1)
        u[-1] = max(u[-1], (self.h_max + lowest) / 2)
        values = np.asarray(self.stiffness(u))
        falls = values[1:] < values[:-1] * (1 - DIGITS * self.error)
        if not falls.any():
            return None
        peak = int(falls.argmax())
        low = u[peak + 1]
        high = min(u[peak] + step, self.h_max)
        near = {
            "bounds": (low, high),
            "method": "bounded",
            "options": {"xatol": 1e-7 * high},
        }
        return float(minimize_scalar(lambda x: -self.stiffness(x), **near).x)

    @functools.cached_property
    def leakage(self) -> LeakageLaw:
        """Flow coefficient at a mean separation, ``separation=`` or ``pressure=``, a `LeakageLaw`, made when read.

        Examples
        --------
        >>> from mbma_tables import Surface, contact_law
        >>> seal = Surface(hurst=0.8, q0=0.01, q1=1.0, h_rms=1.0, h_max=3.5, unit="um")
        >>> law = contact_law(seal, "10 MPa", theory="calibrated")
        >>> f"{law.leakage(pressure='0.05 MPa'):.1g} um^3"
        '0.001 um^3'
        """
        from mbma_tables.contacts.law.leakage import leakage_law

        if self.surface is None:
            raise InputError("leakage needs the surface, which this law does not contain")
        return leakage_law(self, self.surface)

    def _figure(self) -> Any:
        return self._contact_shown()._figure()
