"""Base class of surfaces: moments, summits, the sum of two, functions of DataArrays."""

from __future__ import annotations

import abc
import dataclasses
import functools
import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import broadcast_shape, entries_at, is_labelled
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import draw_line
from mbma_tables.common.units import Units, factor, unit_of
from mbma_tables.surfaces import spectrum


def frozen(values: Any) -> Any:
    """The same numbers; a plain array is made read-only."""
    if isinstance(values, np.ndarray):
        values.setflags(write=False)
    return values


MEANINGS = {
    "hurst": "Hurst exponent",
    "q0": "smallest wavenumber",
    "q1": "largest wavenumber",
    "zeta_1": "largest magnification q1/q0",
    "h_rms": "root-mean-square height",
    "h_max": "highest point above the mid-plane",
    "m2": "variance of a profile's slope",
    "m4": "variance of a profile's second derivative",
    "alpha": "Nayak's bandwidth parameter",
    "rms_gradient": "root-mean-square gradient",
}


def _doubts(provenance: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """Texts "not_valid" of a surface's records, and of those that it was made from."""
    for record in provenance:
        if "not_valid" in record:
            yield record["not_valid"]
        for part in record.get("of", ()):
            yield from _doubts(part)


class AnySurface(Displayed, abc.ABC):
    """A rough surface, or a batch of them: the interface that theories and their users need."""

    parameters: ClassVar[
        tuple[str, ...]
    ] = ()  # names of the numbers that define it; empty if a spectrum does

    banded: ClassVar[Any]  # `BandedSurface`
    spectral: ClassVar[Any]  # `MeasuredSurface`

    # fields in one class, properties in the other; `MEANINGS` describes them
    q0: Any
    q1: Any
    h_rms: Any
    h_max: Any
    m2: Any
    m4: Any
    unit: str | None  # of length; None if not known
    provenance: tuple[Mapping[str, Any], ...]  # origin, a plain record for each step
    #: several scans of it, or surfaces that differ from it by a sampling error
    scans: tuple[Any, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch; () for one surface."""
        return ()

    @property
    def labelled(self) -> bool:
        """Whether any parameter is an xarray DataArray."""
        return False

    def departures(self, by_map: bool = False) -> tuple[str, ...]:
        """Reasons why it is unlike both the isotropic Gaussian surface and those simulated."""
        return self.doubts

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons why its measurement may not represent the surface; each with a remedy."""
        return tuple(dict.fromkeys(_doubts(self.provenance)))

    def numbers(self) -> dict[str, Any]:
        """The numbers that define it, by name: `parameters`, or those of a batch of spectra."""
        return {name: getattr(self, name) for name in self.parameters}

    def with_numbers(self, *numbers: Any) -> Self:
        """The same kind of surface with other `numbers`, in their order."""
        return self

    @abc.abstractmethod
    def bands_if_few(self) -> tuple[spectrum.Band, ...]:
        """The power laws that its spectrum is the sum of; none for one of many samples."""

    def taken_from(
        self, batch: AnySurface, shape: tuple[int, ...], place: NDArray[np.intp]
    ) -> Self:
        """The same surface, with a note of the batch, broadcast to `shape`, whose entries it has.

        What a theory prepared for the batch then serves for its entries.
        """
        number = np.arange(math.prod(batch.shape)).reshape(batch.shape)
        rows = entries_at(number, shape, place)
        whole, of_whole = batch.origin
        vars(self)["origin"] = whole, rows if of_whole is None else of_whole[rows]
        return self

    @functools.cached_property
    def origin(self) -> tuple[AnySurface, NDArray[np.intp] | None]:
        """The batch that it was taken from, and which surfaces of it these are; itself."""
        return self, None

    @abc.abstractmethod
    def power_spectrum(self, q: ArrayLike) -> Any:
        """C(q) [length^4] as h_rms^2 = 2 pi integral C q dq (Eqs. 4-6), zero outside [q0, q1]."""

    @abc.abstractmethod
    def sampled(self) -> Any:
        """The same surface given by samples of its spectrum; not available for a batch."""

    @abc.abstractmethod
    def scaled(self, factor: float, unit: str | None) -> Self:
        """The same surface in another length unit; `factor` is the old unit in the new one."""

    def to(self, unit: str) -> Self:
        """The same surface in another unit of length.

        Raises
        ------
        InputError
            Where its own unit is not known, and for an unknown one.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> Surface(hurst=0.8, q0=0.5, q1=100.0, h_rms=0.2, h_max=0.6, unit="mm").to("um")
        Surface(hurst=0.8, q0=0.0005, q1=0.1, h_rms=200.0, h_max=600.0, unit='um')
        """
        if self.unit is None:
            raise InputError(
                f"the surface's unit is not known: make it with unit=..., then ask for {unit!r}"
            )
        return self.scaled(factor(self.unit, unit), unit)

    @property
    def resolution(self) -> str:
        """Shortest wavelength of a measured surface, and what shorter ones change.

        With the cut-off that a simulation chose.

        Empty for a surface that was not measured.
        """
        descriptions = [
            entry["told"]
            for entry in self.provenance
            if entry["step"] in ("resolution", "extrapolated") or entry.get("chosen")
        ]
        return "; ".join(descriptions)

    @functools.cached_property
    def zeta_1(self) -> Any:
        """Largest magnification q1/q0 (Eq. 13)."""
        return self.q1 / self.q0

    @property
    def m0(self) -> Any:
        """Variance of height [length^2], Eq. (8)."""
        return self.h_rms**2

    @functools.cached_property
    def alpha(self) -> Any:
        """Nayak's bandwidth parameter, Eq. (3)."""
        return frozen(self.m0 * self.m4 / self.m2**2)

    @functools.cached_property
    def rms_gradient(self) -> Any:
        """Root-mean-square gradient of the surface, sqrt(2 m2)."""
        return frozen(np.sqrt(2 * self.m2))

    @property
    def summit_density(self) -> Any:
        """Nayak's density of summits [1/length^2], Eq. (2)."""
        return self.m4 / (spectrum.NAYAK * self.m2)

    @property
    def summit_radius(self) -> Any:
        """Mean radius of summits [length], Eq. (2)."""
        return spectrum.RADIUS / np.sqrt(self.m4)

    @property
    def summit_sigma(self) -> Any:
        """Standard deviation of summit heights [length], Eq. (2)."""
        return np.sqrt((1 - spectrum.BROADENING / self.alpha) * self.m0)

    def _facts(self) -> dict[str, str]:
        titles = {"hurst": "Hurst exponent", "rms_gradient": "rms gradient"}
        names = ("hurst", "q0", "q1", "zeta_1", "h_rms", "h_max", "rms_gradient")
        numbers = {
            name: value for name in names if (value := getattr(self, name)) is not None
        }
        return {
            titles.get(name, name): shown(value, unit_of(name, Units(self.unit)))
            for name, value in numbers.items()
        }

    def _variables(self) -> dict[str, Variable]:
        units = Units(self.unit)
        numbers = {name: getattr(self, name) for name in MEANINGS}
        return {
            n: Variable(v, unit_of(n, units), MEANINGS[n])
            for n, v in numbers.items()
            if v is not None
        }

    def _figure(self) -> Any:
        if self.labelled or self.shape != ():
            raise InputError("a batch has no single spectrum to draw: take one surface")
        q = np.geomspace(self.q0, self.q1, 200)[1:-1]
        length = self.unit or "length"
        return draw_line(
            q,
            self.power_spectrum(q),
            f"wavenumber q [1/{length}]",
            f"spectrum C(q) [{length}^4]",
        )

    def in_unit_of(self, other: AnySurface) -> Self:
        """The same surface in the unit of another; an error if only one of them has a unit."""
        if (self.unit is None) != (other.unit is None):
            raise InputError(
                f"one surface is in {other.unit or self.unit!r}, the unit of the other "
                "is not known: make it with unit=..."
            )
        return self if self.unit == other.unit else self.to(str(other.unit))

    def power_law_with(self, other: AnySurface) -> Any:
        """The sum with a surface in the same unit where it is one power law; None where it is not."""
        return None

    @property
    def is_sum_of_laws(self) -> bool:
        """Whether the spectrum is a sum of a few power laws, and was not measured."""
        return bool(self.bands_if_few()) and not self.resolution

    def _sum_with(self, other: AnySurface) -> Any:
        """The sum with a surface in the same unit: of power laws exact, of measured spectra in samples."""
        pair = self, other
        is_batch = any(each.labelled or each.shape != () for each in pair)
        bands = sum(len(each.bands_if_few()) for each in pair)
        if is_batch or (
            all(each.is_sum_of_laws for each in pair) and bands <= spectrum.MOST_BANDS
        ):
            return self._bands_with(other)
        return self.sampled().added(other.sampled())

    def _bands_with(self, other: AnySurface) -> Any:
        """The sum with a surface in the same unit of power laws, each."""
        bands = [*self.bands_if_few(), *other.bands_if_few()]
        for one in (self, other):
            if not one.is_sum_of_laws:
                raise InputError(
                    "a measured surface and a batch are not added, as a spectrum of many samples is "
                    "known of one surface at a time: combine each entry of the batch with it"
                )
        record = {
            "step": "combined",
            "of": [list(self.provenance), list(other.provenance)],
        }
        tops = self.h_max, other.h_max
        if any(map(is_labelled, tops)):
            top = apply(lambda *both: (np.hypot(*both),), tops, outputs=1)[0]
        else:
            broadcast_shape(one=self.h_max, other=other.h_max)
            top = np.hypot(*tops)
        return self.banded(bands, top, unit=self.unit, provenance=(record,))

    def combined(
        self, other: AnySurface, nominal_area: ArrayLike | str | None = None
    ) -> Any:
        """The equivalent rough surface of two in contact: spectra add, heights convolve.

        Parameters
        ----------
        other : AnySurface
            The other surface; both are independent of each other.
        nominal_area : array_like or str, optional
            A0 [length^2], which determines the highest point, as for `Surface`.

        Returns
        -------
        Surface, MeasuredSurface or BandedSurface
            In the unit of the first. Of two self-affine surfaces with the same q0, q1 and
            Hurst exponent a `Surface`; of others a `BandedSurface` of the broadcast
            shape, or a `MeasuredSurface` where one was measured. Its h_max is exceeded by
            as small a share of heights as those of both: for Gaussian surfaces the root of
            the sum of squares.

        Raises
        ------
        InputError
            If only one has a unit, and for a batch with a measured surface, which is known
            of one surface at a time.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> one = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=3.0, h_max=9.0)
        >>> other = Surface(hurst=0.7, q0=0.05, q1=5.0, h_rms=4.0, h_max=12.0)
        >>> both = one.combined(other)
        >>> f"h_rms = {both.h_rms:.2f}, h_max = {both.h_max:.1f}, q from {both.q0:g} to {both.q1:g}"
        'h_rms = 5.00, h_max = 15.0, q from 0.01 to 5'

        Many joints at once:

        >>> ground = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=[0.3, 0.4, 0.5], h_max=2.0)
        >>> milled = Surface(hurst=0.7, q0=0.05, q1=[3.0, 4.0, 5.0], h_rms=1.2, h_max=5.0)
        >>> ground.combined(milled).h_rms.round(3)
        array([1.237, 1.265, 1.3  ])
        """
        other = other.in_unit_of(self)
        both = self.power_law_with(other)
        if both is None:
            both = self._sum_with(other)
        return (
            both
            if nominal_area is None
            else dataclasses.replace(both, h_max=None, nominal_area=nominal_area)
        )


def apply(function: Any, arguments: tuple[Any, ...], outputs: int) -> Any:
    """The results of `function` for broadcast arguments, block by block for dask arrays."""
    # xarray is imported already if its objects are passed
    import xarray as xr

    whole = all(np.size(argument) for argument in arguments)

    def block(*fields: Any) -> Any:
        if whole and not all(np.size(field) for field in fields):
            # a chunk of a dask array may be empty, an array may not
            answers = (np.empty(np.broadcast_shapes(*map(np.shape, fields))),) * outputs
        else:
            answers = function(*fields)
        return answers[0] if outputs == 1 else answers

    answers = xr.apply_ufunc(
        block,
        *arguments,
        input_core_dims=[[]] * len(arguments),
        output_core_dims=[[]] * outputs,
        dask="parallelized",
        output_dtypes=[float] * outputs,
        join="exact",
        keep_attrs=False,
    )
    return (answers,) if outputs == 1 else answers


def refuse_plain(arguments: Mapping[str, Any]) -> None:
    """Reject arrays without names beside DataArrays."""
    for name, argument in arguments.items():
        if not is_labelled(argument) and np.ndim(argument):
            raise InputError(
                f"beside DataArrays, {name} must be one or a scalar, got shape {np.shape(argument)}"
            )


def agree(**arguments: Any) -> None:
    """Reject plain arrays that do not broadcast, or that are combined with DataArrays."""
    if any(map(is_labelled, arguments.values())):
        refuse_plain(arguments)
    else:
        broadcast_shape(**arguments)


def apply_to_surface(
    answer: Any, surface: AnySurface, arrays: Mapping[str, Any], outputs: int
) -> Any:
    """``answer(surface, *arrays)``, a tuple of `outputs` arrays, of DataArrays.

    A plain array among DataArrays is an error.
    """
    numbers_of_surface = surface.numbers()
    count = len(numbers_of_surface)
    arguments = numbers_of_surface | dict(arrays)
    refuse_plain(arguments)

    def block(*numbers: Any) -> Any:
        return answer(surface.with_numbers(*numbers[:count]), *numbers[count:])

    return apply(block, tuple(arguments.values()), outputs)
