"""Persson's theory (Eqs. 18-21); (19) is u_P of `calibrated.formulas` with the weight W = gamma P + (1 - gamma) P^3."""

import dataclasses
import math
from typing import Any, Literal

import numpy as np

from mbma_tables.common.arguments import FloatArray, finite_array, grouped, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories.base import Theory, TheoryAnswer
from mbma_tables.theories.calibrated.formulas import (
    LAW_ERROR,
    YANG_PERSSON,
    SpectrumLaw,
    area,
    self_affine_law,
    spectrum_of,
)
from mbma_tables.theories.calibrated.spectra import Spectra, laws_of

Method = Literal["full", "simplified"]

LAMBDA = 4.047  # Eq. (21b)
NEGLIGIBLE = 1e-25  # share of a pressure, down to which energies are integrated
LEAST = 1e-300  # least force over A0 E* g, a normal number
INVERSE_RTOL = 1e-10  # error of a load found from its separation


@shared(32)
def _own_law(surface: MeasuredSurface) -> SpectrumLaw:
    """Persson's theory for a surface's own spectrum, with Yang and Persson's weight."""
    return SpectrumLaw(spectrum_of(surface), None, YANG_PERSSON)


def _by_bands(surface: BandedSurface, quantity: str, given: FloatArray) -> FloatArray:
    """Rows of a quantity of `SpectrumLaw` of a batch of spectra."""
    number = np.arange(math.prod(surface.shape)).reshape(surface.shape)
    columns = (
        np.ascontiguousarray(np.broadcast_to(number, given.shape)).ravel(),
        np.ascontiguousarray(given, float).ravel(),
    )
    endless = np.full(number.size, np.inf)
    spectra = Spectra(laws_of(surface), np.ones(number.size), endless, YANG_PERSSON)
    found = (
        spectra.contacts(columns)
        if quantity == "contact"
        else spectra.separations(columns)
    )
    return found.reshape(-1, *given.shape)


class _Light:
    """The light-load form (20) of a law: u0/h_rms and ln of lambda over the rms gradient, Eq. (21)."""

    def __init__(self, law: SpectrumLaw) -> None:
        s = law.spectrum
        log_g = np.log(s.below) / 2
        shares = s.x * s.variance / (4 * s.gradient) * np.exp(-log_g)
        total = float(shares.sum())
        self.log_lambda = math.log(LAMBDA / math.sqrt(2)) + float(shares @ log_g) / total
        self.u0 = YANG_PERSSON.weight * math.sqrt(8 / math.pi) * total

    def contact(self, u: FloatArray) -> tuple[FloatArray, ...]:
        pressure = np.exp(self.log_lambda - u / self.u0)
        return pressure, pressure, pressure / self.u0

    def separation_persson(self, load: FloatArray) -> tuple[FloatArray]:
        """Negative beyond lambda E*."""
        return (self.u0 * (self.log_lambda - np.log(load)),)

    def energy(self, load: FloatArray) -> FloatArray:
        return self.u0 * load


@dataclasses.dataclass(frozen=True, repr=False)
class Persson(Theory):
    """Persson's theory: area by Eq. (18), average separation by Eqs. (19)-(21).

    Parameters
    ----------
    method : {"full", "simplified"}
        The double integral (19), to 1e-11, or its light-load form (20), which ends at u =
        0, where the force is lambda.

    Raises
    ------
    InputError
        For another method.

    Examples
    --------
    >>> from mbma_tables import Surface, contact, theories
    >>> found = contact(Surface.named("concrete"), pressure=[0.001, 0.01], theory="persson")
    >>> found.mean_separation.round(4), found.area.round(5)
    (array([0.6721, 0.3801]), array([0.00217, 0.02171]))
    >>> light = theories.Persson("simplified")
    >>> print(f"{contact(Surface.named('concrete'), 10.0, mean_separation=0.6, theory=light).pressure:.4f}")
    0.0184
    """

    method: Method = "full"

    name = "persson"
    ends_at_h_max = False

    def __post_init__(self) -> None:
        if self.method not in ("full", "simplified"):
            raise InputError(
                f"method must be 'full' or 'simplified', got {self.method!r}"
            )

    def _by_law(
        self, surface: AnySurface, quantity: str, given: FloatArray
    ) -> FloatArray:
        """Rows of what a method of each distinct law answers to its entries, in their places."""
        if isinstance(surface, MeasuredSurface | BandedSurface):
            if self.method == "simplified":
                raise InputError(
                    "the simplified form (20) needs self-affine surfaces: method='full', or surface.fit()"
                )
            if isinstance(surface, BandedSurface):
                return _by_bands(surface, quantity, given)
            return np.asarray(getattr(_own_law(surface), quantity)(given))
        assert isinstance(surface, Surface)
        pairs = np.stack([np.ravel(surface.hurst), np.ravel(surface.zeta_1)])
        known, number = np.unique(pairs, axis=1, return_inverse=True)
        laws: list[Any] = [
            self_affine_law(*pair, None, YANG_PERSSON) for pair in known.T.tolist()
        ]
        laws = [_Light(law) for law in laws] if self.method == "simplified" else laws
        if len(laws) == 1:
            return np.asarray(getattr(laws[0], quantity)(given))
        groups = grouped(
            np.broadcast_to(number.reshape(surface.shape), given.shape).ravel()
        )
        parts = [
            np.asarray(getattr(laws[k], quantity)(given.ravel()[mine]))
            for k, mine in groups
        ]
        out = np.empty((*parts[0].shape[:-1], given.size))
        out[..., np.concatenate([mine for _, mine in groups])] = np.concatenate(
            parts, axis=-1
        )
        return out.reshape(*out.shape[:-1], *given.shape)

    def scatter_name(self, surface: AnySurface) -> str:
        """One name per form: they differ by more than their scatter against boundary elements."""
        return self.name if self.method == "full" else f"{self.name}_{self.method}"

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; an error where the force over- or underflows."""
        u = finite_array("mean_separation", mean_separation)
        u = np.broadcast_to(u, np.broadcast_shapes(u.shape, surface.shape))
        allowed = u >= 0 if self.method == "simplified" else u > 0
        require(
            "mean_separation",
            u,
            allowed,
            "zero or positive, and positive for the full form",
        )
        h_rms = np.asarray(surface.h_rms)
        gradient = np.asarray(surface.rms_gradient)
        pressure, _, stiffness = self._by_law(surface, "contact", u / h_rms)
        normal = np.isfinite(stiffness) & (pressure >= LEAST)
        require(
            "mean_separation", u, normal, "where force and stiffness are normal numbers"
        )
        pressure = pressure * gradient
        error = np.full(
            pressure.shape,
            LAW_ERROR
            if isinstance(surface, MeasuredSurface | BandedSurface)
            else INVERSE_RTOL,
        )
        return TheoryAnswer(
            pressure, self.area_at(surface, pressure), stiffness * gradient / h_rms, error
        )

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] covered by the theory, whose heights are unbounded."""
        low = np.zeros(surface.shape)
        return low, np.full_like(low, np.inf)

    def mean_separation_at(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* (19, 20) or an area (18); zero where it underflows."""
        if quantity == "area":
            require(
                "area",
                wanted,
                wanted < 1,
                "below 1, which Persson's theory reaches at infinite load",
            )
            from scipy.special import erfinv

            wanted = erfinv(wanted) * np.sqrt(surface.m2)
        pressure = finite_array("pressure", wanted)
        require(
            "pressure", pressure, pressure > 0, "positive: u is infinite at zero load"
        )
        pressure = np.broadcast_to(
            pressure, np.broadcast_shapes(pressure.shape, surface.shape)
        )
        u = (
            self._by_law(
                surface, "separation_persson", pressure / np.asarray(surface.rms_gradient)
            )[0]
            * surface.h_rms
        )
        require(
            "pressure",
            pressure,
            u >= 0,
            "at most lambda E*, where the simplified form (20) reaches u = 0",
        )
        return np.asarray(u)

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        """A/A0 = erf(p0/(2 sqrt(G))) at a force over A0 E*, G = E*^2 m2/4 at the largest magnification (18)."""
        return area(pressure / np.asarray(surface.rms_gradient), 1.0, YANG_PERSSON)

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        if isinstance(surface, BandedSurface):
            u = np.asarray(mean_separation, dtype=float)
            pressure = self.answer(surface, u).pressure
            # heights are unbounded: what lies beyond is less than rounding
            light = np.maximum(NEGLIGIBLE * pressure, 2 * LEAST)
            end = self.mean_separation_at(surface, "pressure", light)
            return self.work_between(surface, u, end)
        gradient = np.asarray(surface.rms_gradient)
        load = self.answer(surface, mean_separation).pressure / gradient
        return np.asarray(
            self._by_law(surface, "energy", load) * gradient * surface.h_rms
        )
