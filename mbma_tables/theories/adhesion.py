"""Any theory with an attraction between the bodies: the elastic contact at a larger pressure.

Where the attraction is soft, by Tabor's number at the scale of summits, the contact has the
area, the gaps and so the stiffness of the elastic one at the pressure ::

    p_e = p + (w/rho) (L + theta s(0) A/A0),   L = mean of s(g/rho) where the contact is open

with the work of adhesion w, the range rho and the traction w/rho s(g/rho) at a gap g. That in
the contact is balanced there, and deforms nothing but for a share theta near edges. The mean over gaps is
that of the elastic theory (`gap_law`, or a simulated map).
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.bodies.adhesion import AdhesionInUnits
from mbma_tables.common.arguments import FloatArray, describe_entries, entries_at
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import gap_law
from mbma_tables.theories.attraction import RTOL, AttractionCurve, kept_curve, knots_of
from mbma_tables.theories.base import PACKAGE, Theory, TheoryAnswer, select
from mbma_tables.theories.inversion import Indices

# share of the traction in contact that deforms, fitted to simulations by `python -m generate
# adhesion`
THETA = 0.25
# Tabor's number and range over h_rms up to which, and from which on, simulations agree
MOST_TABOR = 0.4
# and traction at gap zero over E* times the rms gradient, likewise
MOST_STRENGTH = 0.05
LEAST_RANGE = gap_law.RANGES[0]
# standard deviation of ln A and of the gap over h_rms that the attraction adds, there
AREA_ERROR = 0.02
GAP_ERROR = 0.1  # of ln u over Tabor's number, likewise
# and what surfaces known by numbers alone add, of ln A over 1 - A/A0 and of ln u over its root: least hundredths
# by which two standard deviations cover 92% of the contacts of held-out surfaces, whose cells are two to four waves
# wide, `python -m generate adhesion --scatter`
CELL_AREA = 0.08
CELL_GAP = 0.17
MODEL_ERROR = 0.25  # of ln of the attraction: what it deforms beside contacts
MAP_ERROR = (
    0.03  # of the gaps of a simulated map, on 8 points to the shortest wave and more
)
STEP = 1e-3  # relative, of mean gaps for slopes
LOOKS = 48  # mean gaps at which a contact is looked for
SMALLEST_GAP = 1e-10  # of them, over h_rms
FARTHEST = 12.0  # and the largest, likewise, where contact has no end
REACHES = 25.0  # ranges beyond it, where an exponential traction is rounding
PARTING_NODES = 64
# of a search, in ln u: steps at most; step from which digits double, if it is this share of that before
# it; step that is rounding
MOST_STEPS = 60
SHORT_STEP, SHRUNK, SHORTEST_STEP = 1e-6, 1e-2, 1e-13
LAPLACIAN = 8 / 3  # mean square of the Laplacian over m4, of isotropic surfaces
LEAST_SHARE = 1e-3  # of the attraction at zero load, the least net pressure of laws
NECKING = (
    "its contact edges neck, and area and force depend on the path; no theory answers this "
    "yet, a smoother face, a smaller work or a longer range is covered"
)


def with_adhesion(
    theory: Theory, adhesion: AdhesionInUnits, E_star: ArrayLike = 1.0
) -> Theory:
    """The theory of bodies that attract each other.

    Parameters
    ----------
    theory : Theory
        The elastic one.
    adhesion : AdhesionInUnits
        In the unit of `E_star` and of the surface's lengths; its work is positive.
    E_star : array_like
        Effective modulus.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Adhesion, Surface
    >>> from mbma_tables.bodies.adhesion import AdhesionInUnits
    >>> from mbma_tables.common.units import Units
    >>> from mbma_tables.theories import resolve
    >>> from mbma_tables.theories.adhesion import with_adhesion
    >>> surface = Surface(hurst=0.8, q0=0.1, q1=1.6, h_rms=1.0, h_max=3.5)
    >>> attraction = AdhesionInUnits.of(Adhesion(1e-3, 0.3), Units(stress="1"))
    >>> sticky = with_adhesion(resolve("calibrated"), attraction)
    >>> f"pull-off at {float(sticky.pull_off(surface)[0]):.2g} E*"
    'pull-off at 1.6e-06 E*'
    """
    return Adhesive(theory, adhesion, E_star)


def _beside_lowest(
    u: FloatArray, net: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The gap of the lowest net pressure along the first axis between its neighbours."""
    lowest = np.clip(net.argmin(axis=0), 1, len(net) - 2)
    before, at, after = (
        np.take_along_axis(u, (lowest + step)[None], 0)[0] for step in (-1, 0, 1)
    )
    return before, at, after


def _beside(looks: FloatArray, ndim: int) -> FloatArray:
    """Looks on a first axis, with more axes before those of the bodies for loads of `ndim`."""
    return looks.reshape(len(looks), *(1,) * (ndim - looks.ndim + 1), *looks.shape[1:])


def _first_below(net: FloatArray, goal: FloatArray) -> NDArray[np.intp]:
    """The first look with a net pressure below the goal; their number where there is none."""
    lowest = np.fmin.accumulate(net)
    if net.ndim == 1:
        return np.asarray(np.searchsorted(-lowest, -goal, side="right"))
    return np.asarray((_beside(lowest, goal.ndim) >= goal).sum(axis=0))


def _at_places(looks: FloatArray, place: NDArray[np.intp]) -> FloatArray:
    """Looks at places on a first axis, of loads on the others."""
    if looks.ndim == 1:
        return np.asarray(looks[place])
    return np.take_along_axis(_beside(looks, place.ndim - 1), place, 0)


def _inverse(log_u: FloatArray, pressure: FloatArray, goal: FloatArray) -> FloatArray:
    """ln u at net pressures by the polynomial through looks on a first axis, by Neville's scheme; NaN where two are the same."""
    missed = pressure - goal
    with np.errstate(divide="ignore", invalid="ignore"):
        for order in range(1, len(missed)):
            one, other = missed[:-order], missed[order:]
            log_u = (one * log_u[1:] - other * log_u[:-1]) / (one - other)
    return np.asarray(log_u[0])


class Adhesive(Theory):
    """A theory with an attraction; u is the mean gap, pressures are net ones."""

    elastic: Any = None

    def __init__(
        self, theory: Theory, adhesion: AdhesionInUnits, E_star: ArrayLike = 1.0
    ) -> None:
        self.elastic = theory
        self.adhesion = adhesion
        self.modulus = np.asarray(E_star, dtype=float)
        self.name = theory.name
        self.ends_at_h_max = False
        self.looks = theory.looks

    def at(self, shape: tuple[int, ...], place: Indices) -> Theory:
        if self._shape == ():
            return self
        modulus, work, reach = (
            entries_at(number, shape, place)
            for number in (self.modulus, self.adhesion.work, self.adhesion.range)
        )
        adhesion = dataclasses.replace(self.adhesion, work=work, range=reach)
        return Adhesive(self.elastic, adhesion, modulus)

    @functools.cached_property
    def _shape(self) -> tuple[int, ...]:
        """That of the numbers of the bodies."""
        adhesion = self.adhesion
        return np.broadcast_shapes(
            self.modulus.shape, np.shape(adhesion.work), np.shape(adhesion.range)
        )

    @functools.cached_property
    def _traction(self) -> FloatArray:
        """w/rho over E*."""
        return np.asarray(self.adhesion.work / self.adhesion.range / self.modulus)

    def pull(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> FloatArray:
        """Effective less net pressure over E* at mean gaps and areas of the elastic contact."""
        return np.asarray(
            self._traction * self._traction_mean(surface, mean_separation, area)
        )

    def _traction_mean(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> FloatArray:
        """The same over w/rho."""
        share, gap = self.elastic.open_gaps(surface, mean_separation, area)
        shape = self.adhesion.shape
        # gaps are on an axis of their own
        reach = np.asarray(self.adhesion.range)[..., None]
        decay = (share * shape(gap / reach)).sum(axis=-1)
        in_contact = THETA * float(shape(np.zeros(1))[0]) * area
        return np.asarray(decay + in_contact)

    def _curve(self, surface: AnySurface) -> AttractionCurve | None:
        """Of one surface and range, the attraction over w/rho as a function of the mean gap; else None."""
        if surface.shape or np.ndim(self.adhesion.range):
            return None
        # maps have straight lines between loads; theories of users may know surfaces, or change
        own = type(self.elastic).__module__.startswith(PACKAGE)
        if self.elastic.gaps() is not None or not own:
            return None

        def make() -> AttractionCurve:
            low, high = (float(end) for end in self.range_of_gaps(surface))
            ends = float(surface.h_rms), float(surface.h_max)
            return AttractionCurve(knots_of(low, high, *ends))

        key = (self.elastic, float(self.adhesion.range), self.adhesion.shape, THETA)
        return kept_curve(surface, key, make)

    def _mean(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """The same at mean gaps alone."""
        area = self.elastic.answer(surface, mean_separation).area
        return self._traction_mean(surface, mean_separation, area)

    def _attraction(
        self, surface: AnySurface, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Effective less net pressure over E*, and its derivative by u, at mean gaps of the full shape."""
        curve = self._curve(surface)
        if curve is None:
            mean, slope = self._stepped(surface, u)
            return self._traction * mean, self._traction * slope
        mean, slope = curve.values(u, lambda gap: self._mean(surface, gap))
        rough = np.isnan(mean)
        if rough.any():
            mean[rough], slope[rough] = self._stepped(surface, u[rough])
        return self._traction * mean, self._traction * slope

    def _stepped(
        self, surface: AnySurface, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Attraction over w/rho and its derivative, by differences."""
        mean = self._mean(surface, np.stack([u, u * (1 - STEP), u * (1 + STEP)]))
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = (mean[2] - mean[1]) / (2 * STEP * u)
        # without a gap there is nothing to differ
        return mean[0], np.where(u > 0, slope, 0.0)

    def net(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Net pressure over E* at mean gaps."""
        if self._curve(surface) is not None:
            return self.answer(surface, mean_separation).pressure
        answer = self.elastic.answer(surface, mean_separation)
        return np.asarray(
            answer.pressure - self.pull(surface, mean_separation, answer.area)
        )

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Net pressure, area and -dp/du at mean separations u [length]."""
        u = np.asarray(mean_separation, dtype=float)
        if surface.shape or self._shape:
            shape = np.broadcast_shapes(u.shape, self._shape, surface.shape)
            u = np.broadcast_to(u, shape)
        pressure, area, stiffness, error = self.elastic.answer(surface, u)
        pull, slope = self._attraction(surface, u)
        net = pressure - pull
        with np.errstate(divide="ignore", invalid="ignore"):
            # errors of the elastic force pass on to the net one, which may vanish
            passed_on = (error * (pressure + pull) + RTOL * pull) / np.abs(net)
        return TheoryAnswer(net, area, stiffness + slope, passed_on)

    def range_of_gaps(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """Mean gaps between which contacts at pressures are looked for."""
        h_rms = np.asarray(surface.h_rms, dtype=float)
        low, high = self.elastic.interval(surface)
        farthest = np.minimum(high, FARTHEST * h_rms) + REACHES * self.adhesion.range
        if self.elastic.ends_at_h_max:
            return np.maximum(low, SMALLEST_GAP * h_rms), farthest
        return np.maximum(low, SMALLEST_GAP * h_rms), np.minimum(farthest, high)

    def _looked_at(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """ln u on a first axis, rising, of surfaces and bodies, and net pressures there."""
        shape = np.broadcast_shapes(surface.shape, self._shape)
        curve = self._curve(surface)
        if curve is not None:
            force, attraction = curve.at_knots(lambda gap: self._at_knots(surface, gap))
            column = (-1, *(1,) * len(shape))
            net = force.reshape(column) - self._traction * attraction.reshape(column)
            return curve.log_knots.reshape(column), net
        low, high = self.range_of_gaps(surface)
        share = np.linspace(0.0, 1.0, LOOKS).reshape(-1, *(1,) * len(shape))
        u = np.broadcast_to(low * (high / low) ** share, (LOOKS, *shape))
        return np.log(u), self.net(surface, u)

    def _at_knots(
        self, surface: AnySurface, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Elastic pressure over E* and attraction over w/rho at mean gaps."""
        answer = self.elastic.answer(surface, u)
        return answer.pressure, self._traction_mean(surface, u, answer.area)

    def pull_off(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """Tension over E* at which the bodies part, at least 0, and the mean gap there [length].

        It is the largest tension of the contact as its gap grows.
        """
        # scipy's optimizers take as long to import as a first contact takes without them
        from scipy.optimize.elementwise import find_minimum

        log_u, net = self._looked_at(surface)
        u = np.broadcast_to(np.exp(log_u), net.shape)
        # twice, as the first look reaches over many decades
        low, _, high = _beside_lowest(u, net)
        share = np.linspace(0.0, 1.0, LOOKS).reshape(-1, *(1,) * low.ndim)
        u = low * (high / low) ** share
        net = self.net(surface, u)
        bracket = tuple(np.log(gap) for gap in _beside_lowest(u, net))
        net_at, place = self._of_entries(surface, low.shape)
        found = find_minimum(net_at, bracket, args=(place,))
        # without a bracket the net pressure is lowest at the end of the gaps looked at
        ends = np.where(net[0] < net[-1], u[0], u[-1])
        parting = np.where(found.success, np.exp(found.x), ends)
        return np.maximum(-self.net(surface, parting), 0.0), parting

    def _of_entries(
        self, surface: AnySurface, shape: tuple[int, ...]
    ) -> tuple[Callable[[FloatArray, FloatArray], FloatArray], FloatArray]:
        """Net pressures at ln u and flat indices of a shape, for scipy's methods, and all indices."""

        def net_at(log_u: FloatArray, place: FloatArray) -> FloatArray:
            chosen = place.astype(np.intp)
            part: Any = self.at(shape, chosen)
            return np.asarray(part.net(select(surface, shape, chosen), np.exp(log_u)))

        return net_at, np.arange(float(np.prod(shape))).reshape(shape)

    def free_gap(self, surface: AnySurface) -> FloatArray:
        """Mean gap at zero load [length]."""
        return self.inverted(surface, "pressure", np.asarray(0.0))[0]

    def parting_work(self, surface: AnySurface) -> FloatArray:
        """Integral of the tension over E* [length] from the gap at zero load to bodies apart."""
        free = self.free_gap(surface)
        node, weight = np.polynomial.legendre.leggauss(PARTING_NODES)
        share = ((node + 1) / 2).reshape(-1, *(1,) * free.ndim)
        weights = (weight / 2).reshape(share.shape)
        width = self.range_of_gaps(surface)[1] - free
        # denser towards small gaps, where the tension is
        u = free + width * share**3
        tension = -self.net(surface, u)
        return np.asarray((tension * weights * 3 * share**2 * width).sum(axis=0))

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Mean separation [length] at a net pressure over E* or an area.

        At a pressure it is that of the closest contact, which is stable.
        """
        if quantity == "area":
            found: tuple[FloatArray, NDArray[np.bool_]] = self.elastic.inverted(
                surface, quantity, wanted
            )
            return found
        looks, net = self._looked_at(surface)
        goal = np.broadcast_to(
            wanted, np.broadcast_shapes(np.shape(wanted), net.shape[1:])
        )
        first = _first_below(net, goal)
        if not first.all():
            self._refuse_closed(goal, first == 0)
        steps = np.arange(-2, 2).reshape(-1, *(1,) * goal.ndim)
        place = np.clip(first + steps, 0, len(net) - 1)
        log_u, pressure = (_at_places(each, place) for each in (looks, net))
        low, high = log_u[1], log_u[2]
        reached = first < len(net)
        if not reached.all():
            # between the looks beside pull-off
            parting = np.log(self._parting(surface, goal, reached))
            before = (_beside(looks, goal.ndim) < parting).sum(axis=0) - 1
            nearest = _at_places(looks, np.maximum(before, 0)[None])[0]
            low, high = np.where(reached, low, nearest), np.where(reached, high, parting)
        start = _inverse(log_u, pressure, goal)
        return self._between(surface, goal, low, high, start), np.zeros(goal.shape, bool)

    def _parting(
        self, surface: AnySurface, goal: FloatArray, reached: NDArray[np.bool_]
    ) -> FloatArray:
        """Mean gap of pull-off, beyond which goals lie that no look reached; an error where none does."""
        most, parting = self.pull_off(surface)
        beyond = np.asarray(~reached & (goal < -most))
        if beyond.any():
            tension = np.broadcast_to(-most * self.modulus, goal.shape)
            raise OutOfRangeError(
                "pressure must be at least that at which the bodies part, "
                f"{describe_entries(tension, beyond)}",
                beyond,
            )
        return parting

    def _refuse_closed(self, goal: FloatArray, closed: NDArray[np.bool_]) -> None:
        """An error for contacts whose gaps the attraction or the pressure closes altogether."""
        raise OutOfRangeError(
            f"pressure over E* {describe_entries(goal, closed)} closes all gaps of this "
            f"surface by theory {self.name!r}, with this attraction: a mean gap of at least "
            f"{SMALLEST_GAP:g} h_rms is looked for",
            closed,
        )

    def _between(
        self,
        surface: AnySurface,
        goal: FloatArray,
        low: FloatArray,
        high: FloatArray,
        start: FloatArray,
    ) -> FloatArray:
        """Mean gap at a net pressure, between logarithms of gaps, by Newton's method."""
        middle = (low + high) / 2
        x = np.where((start > low) & (start < high), start, middle)
        step = high - low
        for _ in range(MOST_STEPS):
            u = np.exp(x)
            answer = self.answer(surface, u)
            missed = answer.pressure - goal
            low, high = np.where(missed >= 0, x, low), np.where(missed >= 0, high, x)
            with np.errstate(divide="ignore", invalid="ignore"):
                nearer = x + missed / (answer.stiffness * u)
            inside = (nearer >= low) & (nearer <= high)
            nearer = np.where(inside, nearer, (low + high) / 2)
            before, step = step, np.abs(nearer - x)
            x = nearer
            # digits double with each step, but beside pull-off
            doubles = inside & (step < SHORT_STEP) & (step < SHRUNK * before)
            if (doubles | (step < SHORTEST_STEP)).all():
                break
        return np.exp(x)

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations between which the net pressure is positive, and falls."""
        low, _ = self.elastic.interval(surface, quantity)
        if quantity != "pressure":
            found: tuple[FloatArray, FloatArray] = self.elastic.interval(
                surface, quantity
            )
            return found
        free, _ = self.inverted(surface, "pressure", np.zeros(surface.shape))
        # laws are of the logarithm of the net pressure
        area = self.elastic.answer(surface, free).area
        least = LEAST_SHARE * self.pull(surface, free, area)
        highest, _ = self.inverted(surface, "pressure", least)
        return low, highest

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """That of the elastic theory."""
        domain: tuple[FloatArray, FloatArray] = self.elastic.domain(surface)
        return domain

    def open_gaps(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Those of the elastic contact."""
        gaps: tuple[FloatArray, FloatArray] = self.elastic.open_gaps(
            surface, mean_separation, area
        )
        return gaps

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], of the deformation alone."""
        return np.asarray(self.elastic.energy(surface, mean_separation))

    def heights(self, surface: AnySurface) -> Any:
        return self.elastic.heights(surface)

    def gaps(self) -> Any:
        return self.elastic.gaps()

    def bends(self, surface: AnySurface) -> FloatArray:
        return np.asarray(self.elastic.bends(surface))

    def provenance(self) -> tuple[str, ...]:
        lines: tuple[str, ...] = self.elastic.provenance()
        return lines

    def reasons_of_flow(self) -> tuple[str, ...]:
        reasons: tuple[str, ...] = self.elastic.reasons_of_flow()
        return reasons

    def evidence(self, surface: AnySurface) -> str:
        """That of the elastic contact, and the page on contacts with adhesion."""
        return f"{self.elastic.evidence(surface)}; with adhesion docs/adhesion.md"

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation against simulations: of the elastic theory, of the gaps, of the attraction.

        "pressure" is that of the effective pressure at equal u over the net pressure, which
        may vanish. The stiffness was not compared: NaN; that of unloading is elastic.
        """
        if quantity == "unloading_stiffness":
            return np.asarray(self.elastic.scatter(surface, "stiffness", area))
        elastic = np.asarray(self.elastic.scatter(surface, quantity, area))
        if quantity not in ("pressure", "area"):
            return np.full(elastic.shape, np.nan)
        u = np.asarray(self.elastic.inverted(surface, "area", area)[0])
        steps = np.stack([u, u * (1 - STEP), u * (1 + STEP)])
        answer = self.elastic.answer(surface, steps)
        pull = self.pull(surface, u, area)
        with np.errstate(divide="ignore", invalid="ignore"):
            net = answer.pressure[0] - pull
            of_pull = np.hypot(self._scatter_of_gaps(surface, area), MODEL_ERROR)
            of_gaps = pull * of_pull / answer.pressure[0]
            of_cell = self._scatter_of_cells(quantity, area)
            if quantity == "pressure":
                of_gap = np.hypot(GAP_ERROR * self.tabor(surface), of_cell)
                of_gap = of_gap * u * answer.stiffness[0]
                passed_on = np.hypot(elastic, of_gaps) * answer.pressure[0]
                return np.asarray(np.hypot(passed_on, of_gap) / np.abs(net))
            rises = np.log(answer.area[1] / answer.area[2]) / np.log(
                answer.pressure[1] / answer.pressure[2]
            )
        of_area = elastic**2 + (rises * of_gaps) ** 2 + AREA_ERROR**2 + of_cell**2
        return np.asarray(np.sqrt(of_area))

    def _scatter_of_cells(self, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation of ln A, or for "pressure" of ln u, of surfaces that are not maps."""
        if self.elastic.gaps() is not None:
            return np.zeros(np.shape(area))
        if quantity == "area":
            return np.asarray(CELL_AREA * (1 - area))
        return np.asarray(CELL_GAP * np.sqrt(area))

    def _scatter_of_gaps(self, surface: AnySurface, area: FloatArray) -> FloatArray:
        """Standard deviation of ln of the attraction of open gaps, of known mean gap and area."""
        over = self.adhesion.width / np.asarray(surface.h_rms)
        if self.elastic.gaps() is None:
            return gap_law.scatter_of_decay(area, over)
        return np.full(np.shape(area), MAP_ERROR)

    def tabor(self, surface: AnySurface) -> FloatArray:
        """Tabor's number of a summit, (2 w^2/(c E*^2 rho^3))^(1/3), c the rms Laplacian of heights."""
        curvature = np.sqrt(LAPLACIAN * np.asarray(surface.m4))
        own = self.adhesion
        return np.asarray(
            np.cbrt(2 * (own.work / self.modulus) ** 2 / (curvature * own.width**3))
        )

    def reasons(
        self,
        surface: AnySurface,
        answer: TheoryAnswer,
        mean_separation: FloatArray,
    ) -> Mapping[str, Any]:
        shape = np.shape(answer.area)
        elastic = self.elastic.answer(surface, np.asarray(mean_separation, dtype=float))
        own = self.elastic.reasons(surface, elastic, mean_separation)
        stiff = np.broadcast_to(self.tabor(surface) > MOST_TABOR, shape)
        over = self.adhesion.width / np.asarray(surface.h_rms)
        short = np.broadcast_to(over < LEAST_RANGE, shape)
        pull = self.adhesion.strength / self.modulus / np.asarray(surface.rms_gradient)
        strong = np.broadcast_to(pull > MOST_STRENGTH, shape)
        other = np.full(shape, not self.adhesion.is_exponential)
        reasons = {
            f"adhesion: Tabor's number of a summit is above {MOST_TABOR:g}, where {NECKING}": stiff,
            f"adhesion: the range is below {LEAST_RANGE:g} h_rms, the shortest of gaps that were simulated": short,
            f"adhesion: the traction is above {MOST_STRENGTH:g} E* times the rms gradient, where {NECKING}": strong,
            "adhesion: only an exponential traction was simulated": other,
            "adhesion: the net pressure is a tension, of which few contacts were simulated": (
                answer.pressure < 0
            ),
            "adhesion: the contact is beyond pull-off, where it is stable at a given gap alone": (
                answer.stiffness < 0
            ),
        }
        by_law = (
            {}
            if self.elastic.gaps() is not None
            else gap_law.untested(surface.alpha, answer.area)
        )
        return {**own, **by_law, **reasons}
