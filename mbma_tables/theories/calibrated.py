"""The law calibrated on boundary elements as a theory: self-affine surfaces by its table, others by the law itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import erf, erfinv

from mbma_tables.arguments import FloatArray, finite_array, require
from mbma_tables.calibrated import CONSTANTS, Law, Spectrum, light_factor
from mbma_tables.calibrated_map import LOG_FORCE, MapLaw
from mbma_tables.errors import InputError
from mbma_tables.surfaces.maps import detrended_map
from mbma_tables.surfaces.psd import CONVENTIONS, check_height
from mbma_tables.surfaces.spectrum import MAX_ZETA_1, band_moment
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories import calibrated_table
from mbma_tables.theories.protocol import Theory, TheoryAnswer, select

TESTED_HURST, TESTED_ZETA_1 = 0.2, 128.0
TESTED_AREA = (1e-3, 0.97)
TESTED_HEIGHTS = (2.5, 5.5)  # h_max/h_rms
LAW_ERROR = 1e-7  # of the law's own quadrature
MAP_ERROR = 2e-2  # of a map's curve between its nodes
MAX_RATIO, GRADING, GRADED = 1.05, 0.8, 120  # between wavenumbers of a spectrum's bands; towards its longest wave
MATCHED = 1e-6  # relative, of the surface that a bound theory is asked about
ENERGY_PANELS, MIN_ENERGY_GAP = 200, 1e-9  # of energies; u/h_max from where on
NODE_STEP = 6  # of a map's curve: its own nodes are rougher than what they stand for
FULL_NODES = 3  # of a map's curve, from which full contact is continued
HURST = 0.8  # of the surface that stands for a spectrum or a map


class _Calibrated(Theory):
    """What all forms of the law share."""

    name = "calibrated"

    def energy(self, surface: Surface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], by panels in ln u: the tail factor has a corner."""
        shape = np.broadcast_shapes(np.shape(mean_separation), surface.shape)
        h_max = np.broadcast_to(np.asarray(surface.h_max, float), shape)[..., None]
        start = np.log(np.clip(np.broadcast_to(mean_separation, shape)[..., None] / h_max, MIN_ENERGY_GAP, 1.0))
        node, weight = np.polynomial.legendre.leggauss(4)
        share = ((np.arange(ENERGY_PANELS)[:, None] + (1 + node) / 2) / ENERGY_PANELS).ravel()
        u = h_max * np.exp(start * share)
        batch = select(surface, shape, np.arange(int(np.prod(shape))).reshape(*shape, 1))
        work = (self.answer(batch, u).force * u) @ np.tile(weight / 2, ENERGY_PANELS) / ENERGY_PANELS
        return np.asarray(-work * start[..., 0])


class Calibrated(_Calibrated):
    """Persson's energy integral with cover and weight calibrated on boundary elements, of self-affine surfaces.

    Surfaces outside its table (H below 0.1, zeta_1 above 1e5) are answered by the law's quadrature, milliseconds each.
    """

    def answer(self, surface: Surface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; without bound at u = 0."""
        table, places = calibrated_table.shipped(), _Places(surface, mean_separation)
        u = places.flat / places.h_rms
        require("mean_separation", places.flat.reshape(places.shape), u.reshape(places.shape) >= 0, "at least 0")
        out = np.empty((3, u.size))
        covered = places.covered(table)[places.owner]
        if covered.all():
            calibrated_table.fill(table.coefficients, table.numbers, places.rows, places.owner, u, out)
        else:
            some, number = np.flatnonzero(covered), places.owner
            inside = np.empty((3, some.size))
            calibrated_table.fill(table.coefficients, table.numbers, places.rows, number[some], u[some], inside)
            out[:, some] = inside
            for row, mine in places.outside(~covered):
                out[:, mine] = _by_law(places.law(row), u[mine])
        force, area, stiffness = out
        error = np.full(places.shape, table.error)
        return TheoryAnswer(
            (force * places.gradient).reshape(places.shape),
            area.reshape(places.shape),
            (stiffness * places.gradient / places.h_rms).reshape(places.shape),
            error,
        )

    def mean_separation_at(self, surface: Surface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* or an area below 1; h_max at zero."""
        table, places = calibrated_table.shipped(), _Places(surface, wanted)
        if quantity == "area":
            force = force_at_area(places.flat.reshape(places.shape), places.rows[places.owner, 2].reshape(places.shape))
        else:
            force = (places.flat / places.gradient).reshape(places.shape)
        loads = force.ravel()
        u = np.empty(loads.size)
        covered = places.covered(table)[places.owner] & (loads > 0)
        some = np.flatnonzero(covered)
        inside = np.empty(some.size)
        calibrated_table.fill_separation(
            table.coefficients, table.numbers, places.rows, places.owner[some], loads[some], inside
        )
        u[some] = inside
        for row, mine in places.outside(~covered):
            u[mine] = np.where(loads[mine] > 0, places.law(row).separation(np.maximum(loads[mine], 1e-300)), np.inf)
        require(quantity, np.broadcast_to(wanted, places.shape), ~np.isnan(u).reshape(places.shape), "less: u is 0")
        return np.asarray(np.minimum((u * places.h_rms).reshape(places.shape), surface.h_max))

    def concerns(self, surface: Surface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reasons for which answers lie outside what boundary elements have tested."""
        heights = np.asarray(surface.h_max / surface.h_rms)
        reasons = {
            f"the Hurst exponent is below {TESTED_HURST:g}": np.asarray(surface.hurst) < TESTED_HURST * (1 - 1e-9),
            f"zeta_1 is above {TESTED_ZETA_1:g}": np.asarray(surface.zeta_1) > TESTED_ZETA_1 * (1 + 1e-9),
            f"h_max/h_rms is outside {TESTED_HEIGHTS}": (heights < TESTED_HEIGHTS[0]) | (heights > TESTED_HEIGHTS[1]),
        }
        return {
            **{text: np.broadcast_to(mask, answer.area.shape) for text, mask in reasons.items()},
            **_area_concerns(answer.area),
        }

    @staticmethod
    def from_spectrum(q: ArrayLike, C: ArrayLike, *, h_max: float, convention: str = "paper") -> BoundLaw:
        """The law of any isotropic spectrum; no Hurst exponent is needed.

        Parameters
        ----------
        q : array_like, shape (n,)
            Wavenumber, 1/length, positive, in any order.
        C : array_like, shape (n,)
            Spectrum [length^4], not negative; a power law is taken between neighbours.
        h_max : float
            Height of the highest point above the mid-plane [length].
        convention : {"paper", "isotropic"}, optional
            h_rms^2 = 2 pi integral C q dq (Eqs. 4-6) or = integral C q dq / (2 pi).

        Returns
        -------
        BoundLaw
            A theory of that surface alone; its `surface` goes to `contact`.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import contact
        >>> from mbma_tables.theories import Calibrated
        >>> q = np.geomspace(0.2, 50, 200)  # a plateau up to 1, then H = 0.8
        >>> law = Calibrated.from_spectrum(q, 0.01 * np.minimum(1, q**-3.6), h_max=1.1)
        >>> found = contact(law.surface, pressure=0.03, theory=law)
        >>> f"{found.area:.3f} at u = {found.mean_separation:.2f}"
        '0.078 at u = 0.22'
        """
        if convention not in CONVENTIONS[:2]:
            raise InputError(f"convention must be one of {CONVENTIONS[:2]}, got {convention!r}")
        wave, power = finite_array("q", q), finite_array("C", C)
        if wave.ndim != 1 or wave.shape != power.shape or wave.size < 2:
            raise InputError(f"q and C must be two columns of one length, got shapes {wave.shape} and {power.shape}")
        require("q", wave, wave > 0, "positive")
        require("C", power, power >= 0, "not negative")
        order = np.argsort(wave)
        wave, power = wave[order], power[order]
        variance, x = _bands(wave, power)
        if not variance.sum() > 0:
            raise InputError("the spectrum holds no height: no two neighbours in q have positive C")
        spectrum = Spectrum.from_shares(x, variance)
        h_rms = float(np.sqrt(variance.sum() * (2 * np.pi if convention == "paper" else 0.5 / np.pi)))
        top = check_height(h_max)
        return BoundLaw(Law(spectrum, top / h_rms), spectrum, h_rms, top, spectrum.gradient * h_rms)

    @staticmethod
    def from_map(
        heights: Any,
        dx: float | None = None,
        dy: float | None = None,
        *,
        periodic: bool | None = None,
        detrend: str | None = None,
    ) -> BoundLaw:
        """The law of a height map: its tops decide the area, its bearing curve the separation.

        Parameters
        ----------
        heights, dx, dy, periodic, detrend
            As for `mbma_tables.Surface.from_map`. A map that is not periodic is continued by its mirror images, which
            shows no anisotropy along its diagonals.

        Returns
        -------
        BoundLaw
            A theory of that map alone; its `surface` goes to `contact`.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import contact
        >>> from mbma_tables.theories import Calibrated
        >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
        >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
        >>> heights = np.fft.irfft2(np.where((q > 0.05) & (q < 0.25), noise, 0))
        >>> law = Calibrated.from_map(heights, dx=1.0, periodic=True)
        >>> bool(contact(law.surface, pressure=0.01, theory=law).valid)
        True
        """
        values, step_x, step_y, whole = detrended_map(heights, dx, dy, periodic, detrend)
        if not whole:
            values = np.concatenate([values, values[::-1]])
            values = np.concatenate([values, values[:, ::-1]], axis=1)
        values = values - values.mean()
        sizes = values.shape[0] * step_x, values.shape[1] * step_y
        # heights of order one, so that their squares neither underflow nor overflow
        scale = float(np.abs(values).max())
        law = MapLaw.from_heights(values / scale, (sizes[0] / scale, sizes[1] / scale))
        h_rms = float(values.std())
        return BoundLaw(law, law.spectrum, h_rms, float(values.max()), law.spectrum.gradient * h_rms / scale)


class BoundLaw(_Calibrated):
    """The calibrated law of one spectrum or map.

    Attributes
    ----------
    surface : Surface
        What stands for it where a `Surface` is asked for: its h_rms, h_max and rms gradient, and where there is such a
        band its alpha, at a Hurst exponent of 0.8 that the answers do not depend on.
    law : Law or MapLaw
    """

    def __init__(self, law: Law | MapLaw, spectrum: Spectrum, h_rms: float, h_max: float, gradient: float) -> None:
        self.law, self._h_rms, self._gradient, self._h_max = law, h_rms, gradient, h_max
        m0, m2 = h_rms**2, gradient**2 / 2
        self.surface = _standing_for(m0, m2, spectrum.alpha, h_max)
        self._curve = _Curve(law, h_max / h_rms) if isinstance(law, MapLaw) else None

    def answer(self, surface: Surface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length] of this surface, and no other."""
        self._refuse_others(surface)
        u = np.broadcast_to(mean_separation, np.broadcast_shapes(np.shape(mean_separation), surface.shape))
        require("mean_separation", u, u >= 0, "at least 0")
        flat = u.ravel() / self._h_rms
        if self._curve is None:
            assert isinstance(self.law, Law)
            parts, error = _by_law(self.law, flat), LAW_ERROR
        else:
            parts, error = self._curve.answer(flat), MAP_ERROR
        force, area, stiffness = (np.reshape(part, u.shape) for part in parts)
        return TheoryAnswer(
            force * self._gradient, area, stiffness * self._gradient / self._h_rms, np.full(u.shape, error)
        )

    def mean_separation_at(self, surface: Surface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* or an area below 1; h_max at zero."""
        self._refuse_others(surface)
        given = np.broadcast_to(np.asarray(wanted, float), np.broadcast_shapes(np.shape(wanted), surface.shape))
        if self._curve is not None:
            return np.asarray(self._curve.separation(quantity, given, self._gradient) * self._h_rms)
        assert isinstance(self.law, Law)
        if quantity == "area":
            force = force_at_area(given, light_factor(self.law.spectrum.alpha))
        else:
            force = given / self._gradient
        u = self.law.separation(np.maximum(force, 1e-300)) * self._h_rms
        return np.where(force > 0, np.minimum(u, self._h_max), self._h_max)

    def concerns(self, surface: Surface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reasons for which answers lie outside what boundary elements have tested."""
        return _area_concerns(answer.area)

    def scatter(self, surface: Surface, area: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As for any theory; with a map at hand it is much smaller."""
        table = calibrated_table.shipped()
        name = self.name if self._curve is None else f"{self.name}_map"
        return table.standard_deviation(name, "force", area), table.standard_deviation(name, "area", area)

    def _refuse_others(self, surface: Surface) -> None:
        own = (self._h_rms, self._h_max)
        for name, value in zip(("h_rms", "h_max"), own, strict=True):
            given = np.asarray(getattr(surface, name))
            require(name, given, np.abs(given - value) <= MATCHED * value, f"{value:.9g}: use this theory's .surface")


class _Places:
    """A batch of surfaces and numbers that broadcast with it, flat."""

    def __init__(self, surface: Surface, value: ArrayLike) -> None:
        self.shape = np.broadcast_shapes(np.shape(value), surface.shape)
        self.flat = np.ascontiguousarray(np.broadcast_to(np.asarray(value, float), self.shape)).ravel()
        hurst = np.asarray(surface.hurst, float).ravel()
        zeta_1, h_rms = np.asarray(surface.zeta_1, float).ravel(), np.asarray(surface.h_rms, float).ravel()
        light = light_factor(np.asarray(surface.alpha).ravel())
        heights = np.asarray(surface.h_max, float).ravel() / h_rms
        self.rows = np.ascontiguousarray(np.stack([hurst, np.log(zeta_1), light, heights], axis=1))
        number = np.arange(hurst.size).reshape(surface.shape)
        self.owner = np.ascontiguousarray(np.broadcast_to(number, self.shape)).ravel()
        self.h_rms = h_rms[self.owner] if hurst.size > 1 else h_rms
        gradient = np.asarray(surface.rms_gradient, float).ravel()
        self.gradient = gradient[self.owner] if hurst.size > 1 else gradient

    def covered(self, table: calibrated_table.Table) -> Any:
        return table.covers(self.rows[:, 0], self.rows[:, 1])

    def outside(self, mask: Any) -> list[tuple[int, Any]]:
        """Surfaces that have entries under a mask, with these."""
        return [(int(row), np.flatnonzero(mask & (self.owner == row))) for row in np.unique(self.owner[mask])]

    def law(self, row: int) -> Law:
        hurst, log_zeta, _, heights = self.rows[row]
        return Law(Spectrum.self_affine(float(hurst), float(np.exp(log_zeta))), float(heights))


class _Curve:
    """A map's curve, smooth and monotone between its nodes, from full contact to the highest point."""

    def __init__(self, law: MapLaw, h_max: float) -> None:
        nodes = LOG_FORCE[::NODE_STEP]
        u = law.separation(np.exp(nodes))
        kept = (u > 1e-9) & (u < h_max * (1 - 1e-9))
        # nodes where the curve runs back are left out
        level = np.minimum.accumulate(np.where(kept, u, np.inf))
        kept &= u < np.append(np.inf, level[:-1]) * (1 - 1e-9)
        self._log_u, self._log_force = np.log(u[kept][::-1]), nodes[kept][::-1]
        self._h_max, self._top = h_max, float(u[kept][0])
        self._log_force_at = PchipInterpolator(self._log_u, self._log_force)
        self._rate = self._log_force_at.derivative()
        # d ln F/d ln u of full contact, over a few nodes
        first = slice(None, FULL_NODES)
        self._heaviest_rate = float(np.polyfit(self._log_u[first], self._log_force[first], 1)[0])
        self._law = law

    def answer(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force, area and stiffness: F^2 linear in ln u below the nodes, a straight line to zero at h_max above."""
        with np.errstate(divide="ignore"):
            log_u = np.log(u)
        inside = np.clip(log_u, self._log_u[0], self._log_u[-1])
        # 1 from the heaviest node up
        square = 1 + 2 * self._heaviest_rate * np.minimum(log_u - self._log_u[0], 0)
        force = np.exp(self._log_force_at(inside)) * np.sqrt(square)
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(log_u > self._log_u[0], self._rate(inside), self._heaviest_rate / square)
            stiffness = np.where(u > 0, -force * rate / u, np.inf)
        lightest = np.exp(self._log_force[-1])
        above = u > self._top
        rest = np.clip((self._h_max - u) / (self._h_max - self._top), 0, 1)
        force = np.where(above, lightest * rest, force)
        stiffness = np.where(above, lightest / (self._h_max - self._top) * (rest > 0), stiffness)
        # in proportion below the law's lightest load
        known = np.clip(force, np.exp(LOG_FORCE[0]), np.exp(LOG_FORCE[-1]))
        area = self._law.area(known) * np.minimum(force / known, 1)
        return (
            force,
            np.where(force > np.exp(LOG_FORCE[-1]), np.maximum(area, erf(np.sqrt(2) * force)), area),
            stiffness,
        )

    def separation(self, quantity: str, wanted: FloatArray, gradient: float) -> FloatArray:
        """Mean separation [h_rms]: the inverse of `answer`."""
        force = wanted / gradient
        if quantity == "area":
            known = self._law.area(np.exp(LOG_FORCE))
            require("area", wanted, wanted <= known[-1], f"at most {known[-1]:.9g}, where the map's curve ends")
            # the law interpolates in its odds
            share = np.maximum(wanted, known[0])
            log_force = np.interp(np.log(share / (1 - share)), np.log(known / (1 - known)), LOG_FORCE)
            force = np.exp(log_force) * np.minimum(wanted / known[0], 1)
        lightest, heaviest = np.exp(self._log_force[[-1, 0]])
        goal = np.log(np.clip(force, lightest, heaviest))
        low, high = np.full(goal.shape, self._log_u[0]), np.full(goal.shape, self._log_u[-1])
        for _ in range(60):
            middle = (low + high) / 2
            more = self._log_force_at(middle) > goal
            low, high = np.where(more, middle, low), np.where(more, high, middle)
        light = self._h_max - (self._h_max - self._top) * force / lightest
        full = (np.maximum(force / heaviest, 1) ** 2 - 1) / (2 * self._heaviest_rate)
        return np.asarray(np.where(force < lightest, light, np.exp((low + high) / 2 + full)))


def force_at_area(area: ArrayLike, light: ArrayLike) -> FloatArray:
    """F/(A0 E* g) at A/A0: the inverse of `calibrated.area`, from 2 y^2 (1 + y/t0) = e^2 (s0 + y/t0), A = erf(e)."""
    share = np.asarray(area, float)
    require("area", share, (share >= 0) & (share < 1), "below 1, which is reached at infinite load")
    e, s0, t0 = erfinv(share), np.asarray(light), CONSTANTS.area_t0
    # at y = e/sqrt(2) the left side is the larger, and the cubic is convex from there to its root
    y = e / np.sqrt(2)
    for _ in range(60):
        slope = 4 * y + 6 * y**2 / t0 - e**2 / t0
        step = np.divide(
            2 * y**2 * (1 + y / t0) - e**2 * (s0 + y / t0), slope, out=np.zeros(np.shape(slope)), where=slope > 0
        )
        y = np.maximum(y - step, 0.3 * y)
    return np.asarray(y)


def _by_law(law: Law, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Force, area and stiffness by the law's quadrature."""
    positive = np.maximum(u, 1e-12)
    force, stiffness = law.force_and_stiffness(positive)
    full = u <= 0
    return np.where(full, np.inf, force), np.where(full, 1.0, law.area(force)), np.where(full, np.inf, stiffness)


def _area_concerns(area: FloatArray) -> dict[str, Any]:
    low, high = TESTED_AREA
    return {
        f"A/A0 is below {low:g}": (area > 0) & (area < low),
        f"A/A0 is above {high:g}": area > high,
    }


def _bands(q: FloatArray, C: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integral of C q dq of narrow bands, and their root mean square wavenumbers, C a power law between samples."""
    held = np.flatnonzero(C > 0)
    if held.size < 2:
        return np.zeros(1), np.ones(1)
    # graded towards the longest wave, where the gradient of longer ones vanishes
    width, span = np.log(MAX_RATIO), float(np.log(q[held[-1]] / q[held[0]]))
    graded = np.append(width * GRADING ** np.arange(GRADED, 0.0, -1), np.arange(width, span, width))
    edges = np.unique(np.concatenate([np.log(q), np.log(q[held[0]]) + graded[graded < span]]))
    middle = (edges[1:] + edges[:-1]) / 2
    number = np.clip(np.searchsorted(np.log(q), middle) - 1, 0, q.size - 2)
    low, high, a = C[number], C[number + 1], q[number]
    real = (low > 0) & (high > 0)
    low, high, a, step, start = low[real], high[real], a[real], np.diff(edges)[real], np.exp(edges[:-1][real])
    power = np.log(high / low) / np.log(q[number + 1][real] / a)
    base = low * (start / a) ** power * start**2
    variance, slopes = base * _growth(power + 2, step), base * start**2 * _growth(power + 4, step)
    return variance, np.sqrt(slopes / variance)


def _growth(power: FloatArray, width: FloatArray) -> FloatArray:
    """Integral of x^power d ln x from 1 over a width in ln x."""
    flat = np.abs(power) < 1e-9
    return np.where(flat, width, np.expm1(power * width) / np.where(flat, 1.0, power))


def _standing_for(m0: float, m2: float, alpha: float, h_max: float) -> Surface:
    """A surface of these moments, its alpha the nearest that a band has."""

    def alpha_of(zeta: float) -> float:
        moments = [float(band_moment(order, HURST, 1.0, zeta)) for order in (0, 2, 4)]
        return moments[0] * moments[2] / moments[1] ** 2

    low, high = 3.0 * (1 + 1e-6), MAX_ZETA_1 * (1 - 1e-6)
    near = float(np.clip(alpha, alpha_of(low), alpha_of(high)))
    return Surface.from_moments(hurst=HURST, m0=m0, m2=m2, m4=near * m2**2 / m0, h_max=h_max)
