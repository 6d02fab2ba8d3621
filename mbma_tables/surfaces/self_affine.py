"""The five numbers of a self-affine surface, or arrays of them, and derived quantities."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import (
    broadcast_shape,
    finite_array,
    hinted,
    is_labelled,
    positive_array,
    require,
    spread,
)
from mbma_tables.common.display import shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, in_one_unit
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.any_surface import AnySurface, apply, frozen, refuse_plain
from mbma_tables.surfaces.heights import of_area
from mbma_tables.surfaces.roughness import record_of_labels, surface_of_roughness

if TYPE_CHECKING:
    from mbma_tables.surfaces.psd import SpectrumFit

LARGEST = 1e50  # limit of lengths and wavenumbers, so that their powers stay finite
SHOWN = 6  # entries of a batch that are printed
PARAMETERS = ("hurst", "q0", "q1", "h_rms", "h_max")
BAND = PARAMETERS[:3]
# relative difference of numbers that are the same but for the rounding of units
SAME = 1e-12


class Case(NamedTuple):
    """A named surface of the paper (Section 4), with the numbers that it reports."""

    title: str
    unit: str | None  # of length; None if lengths are over h_rms
    numbers: Mapping[
        str, Any
    ]  # arguments of `Surface`, or of `Surface.from_moments` if the paper gives moments


def _band(
    hurst: float, q0: float, zeta_1: float, h_rms: float, top: float
) -> dict[str, float]:
    return {
        "hurst": hurst,
        "q0": q0,
        "q1": q0 * zeta_1,
        "h_rms": h_rms,
        "h_max": top * h_rms,
    }


def _moments(
    hurst: float, m0: float, m2: float, m4: float, h_max: float
) -> dict[str, float]:
    return {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4, "h_max": h_max}


CASES = {
    "yang-persson": Case(
        "Yang-Persson molecular dynamics (Fig. 11)",
        "nm",
        _band(0.8, 6 * math.pi / 1040 * 10, 216, 1.0, 3.0),
    ),
    "papangelo": Case(
        "Papangelo Green's function simulation (Fig. 12)",
        "um",
        _band(0.8, 2 * math.pi / 100, 64, 5.0, 3.0),
    ),
    "concrete": Case(
        "concrete road of Lorenz (Figs. 13a, 14a)",
        "mm",
        _moments(0.7, 0.071, 0.27, 62.0, 1.1),
    ),
    "asphalt": Case(
        "asphalt road of Lorenz (Figs. 13b, 14b)",
        "mm",
        _moments(0.85, 0.091, 2.67, 21000.0, 1.37),
    ),
    "challenge": Case(
        "contact-mechanics challenge (Fig. 15)",
        "um",
        _band(0.8, 2 * math.pi / 20, 200, 0.762, 3.7),
    ),
} | {
    f"resolution-{z}": Case(
        f"resolution study over h_rms, zeta_1 = {z} (Figs. 16, 17)",
        None,
        _band(0.7, 0.1, z, 1.0, 3.0),
    )
    for z in (125, 250, 500, 1000)
}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class SelfAffine(AnySurface):
    """The numbers of `Surface`, checked, and the constructors without a measurement."""

    hurst: Any
    q0: Any
    q1: Any
    h_rms: Any
    h_max: Any = None
    parameters = PARAMETERS
    unit: str | None = dataclasses.field(default=None, kw_only=True)
    fit: SpectrumFit | None = dataclasses.field(default=None, repr=False, kw_only=True)
    provenance: tuple[Mapping[str, Any], ...] = dataclasses.field(
        default=(), repr=False, kw_only=True
    )
    nominal_area: dataclasses.InitVar[Any] = dataclasses.field(default=None, kw_only=True)

    def __post_init__(self, nominal_area: Any) -> None:
        units = Units(self.unit)
        vars(self).update(unit=units.length)
        given = self.h_max
        if nominal_area is not None:
            # derived from the other numbers, which are checked for that
            for name in PARAMETERS[:-1]:
                vars(self)[name] = units.number(name, getattr(self, name))
            vars(self).update(h_max=1.0)
        elif given is None:
            raise InputError(
                "h_max is missing: the highest point above the mid-plane, or give the nominal_area"
            )
        if not self.labelled:
            self._check()
        elif nominal_area is None:
            for name in PARAMETERS:
                units.number(name, getattr(self, name))
            # perhaps lazy: checked block by block, where numbers are computed
        if nominal_area is not None:
            self._end_at(*of_area(self, nominal_area, given))

    def _end_at(self, h_max: Any, provenance: tuple[Mapping[str, Any], ...]) -> None:
        """Take a highest point, perhaps of an array of nominal areas."""
        if np.shape(h_max) == self.shape:
            highest = frozen(np.array(h_max))[()]
            vars(self).update(h_max=highest, provenance=provenance)
            return
        batch = dataclasses.replace(self, h_max=h_max, provenance=provenance)
        # what is derived has the shape of the batch
        vars(self).clear()
        vars(self).update(vars(batch))

    def _check(self) -> None:
        """Numbers of one shape, each in its range."""
        parameters = {
            name: finite_array(name, getattr(self, name)) for name in PARAMETERS
        }
        require(
            "hurst",
            parameters["hurst"],
            (parameters["hurst"] >= np.finfo(float).tiny) & (parameters["hurst"] <= 1),
            "in (0, 1]",
        )
        for name in ("q0", "q1", "h_rms", "h_max"):
            require(name, parameters[name], parameters[name] > 0, "positive")
            sized = (parameters[name] >= 1 / LARGEST) & (parameters[name] <= LARGEST)
            require(
                name,
                parameters[name],
                sized,
                f"from {1 / LARGEST:g} to {LARGEST:g}: take another unit of length",
            )
        shape = broadcast_shape(**parameters)
        vars(self).update(
            {
                name: frozen(np.array(spread(array, shape)))[()]
                for name, array in parameters.items()
            }
        )
        zeta_1 = np.asarray(self.zeta_1)
        require(
            "q1/q0",
            zeta_1,
            zeta_1 > spectrum.MIN_ZETA_1,
            "greater than 3: q1 is the largest wavenumber",
        )
        require("q1/q0", zeta_1, zeta_1 <= spectrum.MAX_ZETA_1, "at most 1e8")

    def __repr__(self) -> str:
        numbers = [f"{name}={_shown(getattr(self, name))}" for name in PARAMETERS]
        return f"Surface({', '.join([*numbers, *([f'unit={self.unit!r}'] if self.unit else [])])})"

    def scaled(self, factor: float, unit: str | None) -> Self:
        """The same surface in another length unit; `factor` is the old unit in the new one."""
        numbers = {name: getattr(self, name) / factor for name in ("q0", "q1")}
        numbers |= {name: getattr(self, name) * factor for name in ("h_rms", "h_max")}
        return dataclasses.replace(self, **numbers, unit=unit)

    @classmethod
    @hinted
    def from_moments(
        cls,
        *,
        hurst: ArrayLike,
        m0: ArrayLike,
        m2: ArrayLike,
        m4: ArrayLike,
        h_max: ArrayLike | None = None,
        nominal_area: ArrayLike | str | None = None,
        unit: str | None = None,
    ) -> Self:
        """The surface with these spectral moments (Eqs. 1, 7).

        Parameters
        ----------
        hurst, h_max, nominal_area, unit : as for `Surface`
        m0, m2, m4 : array_like
            Variance of height [length^2], of a profile's slope, of its second derivative
            [1/length^2].

        Returns
        -------
        Surface
            zeta_1 from alpha = m0 m4/m2^2, which increases with it, then q0 from m2/m0.

        Raises
        ------
        InputError, OutOfRangeError
            Where no band with 3 < zeta_1 <= 1e8 has that alpha, and as `Surface` itself.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> road = Surface.from_moments(hurst=0.7, m0=0.071, m2=0.27, m4=62.0, h_max=1.1)
        >>> print(f"zeta_1 = {road.zeta_1:.4f}, q0 = {road.q0:.6f}")
        zeta_1 = 64.8598, q0 = 0.538132
        """
        band = spectrum.band_from_moments(hurst, m0, m2, m4)
        return cls(hurst, *band, h_max, unit=unit, nominal_area=nominal_area)

    @classmethod
    @hinted
    def from_roughness(
        cls,
        *,
        hurst: Any = None,
        h_max: Any = None,
        Sp: Any = None,
        Rq: Any = None,
        Ra: Any = None,
        Sq: Any = None,
        Sa: Any = None,
        Rdq: Any = None,
        Sdq: Any = None,
        Rsm: Any = None,
        longest: Any = None,
        shortest: Any = None,
        rolloff: Any = None,
        nominal_area: Any = None,
        process: str | None = None,
        unit: str | None = None,
    ) -> Any:
        """A surface from the roughness parameters of a drawing or a profilometer.

        Required are one height, one highest point, the Hurst exponent, and two of slope,
        longest and shortest wavelength. `provenance` contains the assumed meaning of each
        number; docs/surfaces.md has typical values.

        Parameters
        ----------
        hurst, unit : as for `Surface`
        h_max, Sp, nominal_area : array_like, one of them
            Highest point above the mid-plane [length], or A0 [length^2], as for `Surface`.
        Rq, Ra, Sq, Sa : array_like, one of them
            Root-mean-square or mean absolute height of a profile or of a map [length].
        Rdq, Sdq, Rsm : array_like, one of them, optional
            Root-mean-square slope of a profile, gradient of a map, or mean spacing of a
            profile's elements [length].
        longest, shortest : array_like, optional
            Wavelengths at which the roughness ends [length].
        rolloff : array_like, optional
            Longest wavelength of the power law [length]; between `longest` and it the
            spectrum is flat, as for most machined faces. Default: `longest`.
        process : str, optional
            What made the face: "gaussian", "turned", "milled", "ground", "honed", "lapped",
            "worn", "sprayed", "pitted", "etched", "eroded", "patchy", "dimpled", "blasted"
            or "polished". It changes no mean result. Without it the face is assumed to be
            Gaussian and isotropic, as the tested ones were; of the others, all but
            "gaussian", no contact is `valid`, and no model uncertainty is stated.

        Returns
        -------
        Surface
            Self-affine; with a `rolloff` a `MeasuredSurface` with this spectrum, for arrays
            a `BandedSurface`.

        Raises
        ------
        InputError, OutOfRangeError
            For too few or too many numbers, for those that no band with 3 < q1/q0 <= 1e8 has,
            and for an unknown process.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> ground = Surface.from_roughness(
        ...     Ra="0.4 um", Rdq=0.1, longest="100 um", hurst=0.8, h_max="1.8 um"
        ... )
        >>> shortest = 6.2832 / ground.q1
        >>> print(f"h_rms = {ground.h_rms:.3f} um, shortest wavelength {shortest:.2f} um")
        h_rms = 0.501 um, shortest wavelength 1.12 um
        >>> ground.provenance[0]["assumed"][2]
        'h_rms = sqrt(pi/2) Ra: heights are Gaussian; the profile is long and unfiltered'
        """
        roughness_parameters = {
            name: value
            for name, value in locals().items()
            if name not in ("cls", "unit", "process")
        }
        if any(map(is_labelled, roughness_parameters.values())):
            return _of_labelled_roughness(cls, unit, roughness_parameters, process)
        numbers = surface_of_roughness(unit, roughness_parameters, process)
        if "bands" in numbers:
            return cls.banded(**numbers)
        return cls.spectral(**numbers) if "C" in numbers else cls(**numbers)

    @classmethod
    def from_drawing(
        cls,
        *,
        process: str | None = None,
        nominal_area: Any = None,
        unit: str | None = None,
        **numbers: Any,
    ) -> Any:
        """The surface of a drawing that gives little more than Ra: what is missing is assumed as a range.

        The longest and the shortest wavelength come from the default filters of ISO 21920-3
        for this Ra, the Hurst exponent from the process; each range has its source among the
        "assumed" lines. The surface itself is that of the middle of all ranges, and is not
        `valid`; `uncertainty` and `Joint` have the spread of the whole ranges.

        Parameters
        ----------
        process : str, optional
            What made the face, as for `from_roughness`; default: not known, with the widest
            spread.
        nominal_area : float or str, optional
            A0 [length^2]; default: from 1 to 100 cm^2.
        unit : str, optional
            Unit of length of plain numbers.
        **numbers
            Those of `from_roughness` that the drawing gives, or the height Rz, from which Ra
            is a range.

        Returns
        -------
        Surface

        Raises
        ------
        InputError, OutOfRangeError
            Without a height or a unit, for arrays, and as `from_roughness`.

        Examples
        --------
        >>> from mbma_tables import Surface, uncertainty
        >>> face = Surface.from_drawing(Ra="1.6 um", process="milled")
        >>> print(face.provenance[-1]["assumed"][1])
        shortest 2.5..20 um log: lambda_s = 2.5 um, the default of ISO 21920-3 for this Ra, or the resolution of a coarser stylus
        >>> found = uncertainty(face, "steel 1020", pressure="5 MPa", draws=200)
        >>> low, _, high = found.quantiles["solid_conductance"][:, 0]
        >>> bool(high > 2 * low), found.valid
        (True, array([False]))
        """
        from mbma_tables.surfaces.drawing import surface_of_drawing

        more = {"process": process, "nominal_area": nominal_area, "unit": unit}
        return surface_of_drawing(cls, numbers | more)

    @classmethod
    def named(cls, name: str) -> Self:
        """One of the paper's cases, in the paper's unit of length where it has one.

        Raises
        ------
        InputError
            For an unknown name; the message lists the known ones.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> challenge = Surface.named("challenge")
        >>> float(challenge.h_rms), challenge.unit
        (0.762, 'um')
        """
        if not isinstance(name, str) or name not in CASES:
            raise InputError(
                f"no surface is named {name!r}; there are {', '.join(CASES)}"
            )
        _, unit, numbers = CASES[name]
        return (cls.from_moments if "m0" in numbers else cls)(**numbers, unit=unit)

    @functools.cached_property
    def labelled(self) -> bool:
        """Whether any parameter is an xarray DataArray."""
        return any(is_labelled(getattr(self, name)) for name in PARAMETERS)

    @functools.cached_property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch; () for one surface."""
        return np.shape(self.hurst)

    @functools.cached_property
    def s(self) -> Any:
        """Unit of height, h_rms/sqrt(1 - zeta_1^(-2H)) [length]."""
        return self.h_rms / np.sqrt(-np.expm1(-2 * self.hurst * np.log(self.zeta_1)))

    @property
    def m2(self) -> Any:
        """Variance of a profile's slope, Eq. (7)."""
        return (self.s * self.q0) ** 2 * spectrum.band_moment(
            2, self.hurst, 1.0, self.zeta_1
        )

    @property
    def m4(self) -> Any:
        """Variance of a profile's second derivative [1/length^2], Eq. (7)."""
        return (self.s * self.q0**2) ** 2 * spectrum.band_moment(
            4, self.hurst, 1.0, self.zeta_1
        )

    def with_numbers(self, *numbers: Any) -> Self:
        """Another surface, in the same unit.

        The records of one surface go with it, of a batch those that doubt it.
        """
        records: tuple[Mapping[str, Any], ...] = self.provenance
        if self.labelled or self.shape != ():
            records = tuple(
                {"step": "doubt", "not_valid": doubt} for doubt in self.doubts
            )
        return type(self)(*numbers, unit=self.unit, provenance=records)

    def power_law_with(self, other: AnySurface) -> Any:
        """The sum with a surface in the same unit where it is one power law, in every entry; else None."""
        if not isinstance(other, SelfAffine) or self.resolution or other.resolution:
            return None
        numbers = [getattr(self, name) for name in PARAMETERS]
        numbers += [getattr(other, name) for name in PARAMETERS]
        if self.labelled or other.labelled:
            names = [
                f"{name} of {which}" for which in ("one", "other") for name in PARAMETERS
            ]
            refuse_plain(dict(zip(names, numbers, strict=True)))
            if not _same_labelled_band(numbers):
                return None
            h_rms, h_max = apply(_added, tuple(numbers), outputs=2)
        else:
            broadcast_shape(one=self.h_rms, other=other.h_rms)
            if not _same_band(*numbers).all():
                return None
            h_rms, h_max = _added(*numbers)
        record = {
            "step": "combined",
            "of": [list(self.provenance), list(other.provenance)],
        }
        band = {name: getattr(self, name) for name in BAND}
        return type(self)(
            **band, h_rms=h_rms, h_max=h_max, unit=self.unit, provenance=(record,)
        )

    def bands_if_few(self) -> tuple[spectrum.Band, ...]:
        """Its power law."""
        C = self.hurst / math.pi * (self.s / self.q0) ** 2
        return (spectrum.Band(self.q0, self.q1, C, -2 - 2 * self.hurst),)

    def power_spectrum(self, q: ArrayLike) -> Any:
        """C(q) of Eq. (6) [length^4], zero outside [q0, q1]; a batch broadcasts against q."""
        wavenumber = positive_array("q", q)
        scale = self.hurst / math.pi * (self.s / self.q0) ** 2
        inside = (wavenumber >= self.q0) & (wavenumber <= self.q1)
        return np.where(
            inside, scale * (wavenumber / self.q0) ** (-2 - 2 * self.hurst), 0.0
        )[()]


def _of_labelled_roughness(
    kind: Any, unit: str | None, given: Mapping[str, Any], process: str | None
) -> Any:
    """The batch of DataArrays of roughness parameters, lazy where they are."""
    stated = {name: value for name, value in given.items() if value is not None}
    stated, unit = in_one_unit(stated, unit)
    refuse_plain(stated)

    def block(*numbers: Any) -> tuple[Any, ...]:
        fields = [field.ravel() for field in np.broadcast_arrays(*numbers)]
        made = kind.from_roughness(
            **dict(zip(stated, fields, strict=True)), process=process, unit=unit
        )
        shape = np.broadcast_shapes(*map(np.shape, numbers))
        return tuple(np.reshape(field, shape) for field in made.numbers().values())

    has_bands = "rolloff" in stated
    outputs = 1 + 2 * len(spectrum.Band._fields) if has_bands else len(PARAMETERS)
    fields = apply(block, tuple(stated.values()), outputs)
    records = (record_of_labels(list(stated), unit, process),)
    if not has_bands:
        return kind(*fields, unit=unit, provenance=records)
    bands = fields[1:5], fields[5:]
    return kind.banded(bands, fields[0], unit=unit, provenance=records)


def _same_band(*numbers: Any) -> NDArray[np.bool_]:
    """Mask of pairs of surfaces, each by its `PARAMETERS`, with the same band and Hurst exponent."""
    count = len(PARAMETERS)
    pairs = zip(numbers[: len(BAND)], numbers[count : count + len(BAND)], strict=True)
    alike = [np.isclose(one, other, rtol=SAME, atol=0.0) for one, other in pairs]
    return np.asarray(np.logical_and.reduce(np.broadcast_arrays(*alike)), dtype=bool)


def _same_labelled_band(numbers: Sequence[Any]) -> bool:
    """Whether the bands of DataArrays are the same; lazy ones count as different unless they are one object."""
    import xarray as xr

    count = len(PARAMETERS)
    for one, other in zip(
        numbers[: len(BAND)], numbers[count : count + len(BAND)], strict=True
    ):
        if one is other:
            continue
        if any(getattr(each, "chunks", None) for each in (one, other)):
            return False
        pair = xr.broadcast(xr.DataArray(one), xr.DataArray(other))
        if not np.isclose(*pair, rtol=SAME, atol=0.0).all():
            return False
    return True


def _added(*numbers: Any) -> tuple[Any, Any]:
    """h_rms and h_max of the sums of two surfaces of one band, each by its `PARAMETERS`.

    Variances add, and of Gaussian heights the squares of the highest points.
    """
    heights, tops = numbers[3::5], numbers[4::5]
    return np.hypot(*heights), np.hypot(*tops)


def _shown(value: Any) -> str:
    """A number as Python prints it, a DataArray by its sizes."""
    if is_labelled(value):
        return f"<DataArray {dict(value.sizes)}>"
    if np.size(value) > SHOWN:
        return f"<{'x'.join(map(str, np.shape(value)))} numbers, {shown(value)}>"
    return repr(np.asarray(value).item()) if np.ndim(value) == 0 else repr(value)
