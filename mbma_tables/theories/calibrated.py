"""The law calibrated on boundary elements as a theory: self-affine surfaces by its table, others by the law itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, finite_array, require
from mbma_tables.calibrated import Law, Spectrum, light_factor
from mbma_tables.calibrated import area as law_area
from mbma_tables.calibrated_map import MapLaw
from mbma_tables.errors import InputError
from mbma_tables.hardness import BearingCurve
from mbma_tables.surfaces.maps import prepared
from mbma_tables.surfaces.psd import CONVENTIONS, check_height
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories import calibrated_table
from mbma_tables.theories.calibrated_curves import (
    Curve,
    Places,
    area_concerns,
    bands,
    by_law,
    force_at_area,
    standing_for,
)
from mbma_tables.theories.protocol import Theory, TheoryAnswer, select

TESTED_HURST, TESTED_ZETA_1 = 0.2, 128.0
TESTED_HEIGHTS = (2.5, 5.5)  # h_max/h_rms
LAW_ERROR = 1e-7  # of the law's own quadrature
MAP_ERROR = 2e-2  # of a map's curve between its nodes
MATCHED = 1e-6  # relative, of the surface that a bound theory is asked about
ENERGY_PANELS, MIN_ENERGY_GAP = 200, 1e-9  # of energies; u/h_max from where on


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
        table, places = calibrated_table.shipped(), Places(surface, mean_separation)
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
                out[:, mine] = by_law(places.law(row), u[mine])
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
        table, places = calibrated_table.shipped(), Places(surface, wanted)
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

    def area_at(self, surface: Surface, force: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*, in closed form."""
        return law_area(force / np.asarray(surface.rms_gradient), surface.alpha, calibrated_table.shipped().constants)

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
            **area_concerns(answer.area),
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
        variance, x = bands(wave, power)
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
        treated = prepared(heights, dx, dy, periodic, {"detrend": detrend})
        values, (step_x, step_y) = treated.heights, treated.steps
        if not treated.periodic:
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
        self.surface = standing_for(m0, m2, spectrum.alpha, h_max)
        self._curve = Curve(law, h_max / h_rms) if isinstance(law, MapLaw) else None
        self._heights = BearingCurve(law.mean_height, h_max / h_rms) if isinstance(law, MapLaw) else None

    def answer(self, surface: Surface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length] of this surface, and no other."""
        self._refuse_others(surface)
        u = np.broadcast_to(mean_separation, np.broadcast_shapes(np.shape(mean_separation), surface.shape))
        require("mean_separation", u, u >= 0, "at least 0")
        flat = u.ravel() / self._h_rms
        if self._curve is None:
            assert isinstance(self.law, Law)
            parts, error = by_law(self.law, flat), LAW_ERROR
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
        return area_concerns(answer.area)

    @property
    def scatter_name(self) -> str:
        """With a map at hand scatter is much smaller."""
        return self.name if self._curve is None else f"{self.name}_map"

    def area_at(self, surface: Surface, force: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*."""
        self._refuse_others(surface)
        given = np.asarray(force, float) / self._gradient
        return self.law.area(given) if self._curve is None else self._curve.area(given)

    def bearing_share(self, surface: Surface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Share of heights above the level whose mean gap is u, and its derivative: the map's own heights."""
        if self._heights is None:
            return super().bearing_share(surface, mean_separation)
        share, slope = self._heights(np.asarray(mean_separation) / self._h_rms)
        return share, slope / self._h_rms

    def _refuse_others(self, surface: Surface) -> None:
        own = (self._h_rms, self._h_max)
        for name, value in zip(("h_rms", "h_max"), own, strict=True):
            given = np.asarray(getattr(surface, name))
            require(name, given, np.abs(given - value) <= MATCHED * value, f"{value:.9g}: use this theory's .surface")
