"""Several scans of one surface as one: mean spectrum, heights, curves, and differences."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.bearing_curve import Bearing, RadialSpectrum
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.surface import MeasuredSurface

SQUARES = ("h_rms", "gradient")  # fields averaged as squares


def average(scans: Sequence[MeasuredSurface]) -> MeasuredSurface:
    """The surface from several measured maps of it.

    Each is a `Surface.from_map` of similar size and treatment. Spectra, quantiles of heights
    and the curves of highest parts are averaged; h_max is that for the area of one scan.

    Parameters
    ----------
    scans : sequence of MeasuredSurface
        At least two, in the same or in convertible units.

    Returns
    -------
    MeasuredSurface
        Without a map; its `provenance` says how much h_rms, gradient and highest point
        differ from scan to scan, and what the laws of its `scans` differ by adds to the
        scatter of its contacts.

    Raises
    ------
    InputError
        For fewer than two scans, and surfaces that are not of maps.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface, contact
    >>> from mbma_tables.surfaces.averages import average
    >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
    >>> def scan(seed):
    ...     noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((64, 64)))
    ...     heights = 0.1 * np.fft.irfft2(np.where((q > 0.05) & (q < 0.25), noise, 0))
    ...     return Surface.from_map(heights, 1.0, periodic=True)
    >>> both = average([scan(1), scan(2)])
    >>> f"{contact(both, pressure=0.01).area:.2f}"
    '0.39'
    """
    are_maps = all(
        isinstance(scan, MeasuredSurface) and scan.map is not None for scan in scans
    )
    if len(scans) < 2 or not are_maps:
        raise InputError("average takes two or more surfaces of Surface.from_map")
    unit = scans[0].unit
    if len({scan.unit is None for scan in scans}) > 1:
        raise InputError(
            "some scans have a unit and some do not: make them with unit=..."
        )
    same_unit = [scan if scan.unit == unit else scan.to(str(unit)) for scan in scans]
    q = np.unique(np.concatenate([scan.q for scan in same_unit]))
    spectra = np.array([scan.power_spectrum(q) for scan in same_unit])
    covered = np.array([(q >= scan.q0) & (q <= scan.q1) for scan in same_unit])
    C = spectra.sum(axis=0) / np.maximum(covered.sum(axis=0), 1)
    bearing = _mean_bearing([scan.bearing for scan in same_unit])
    record = {
        "step": "average",
        "of": [list(scan.provenance) for scan in same_unit],
        "told": f"average of {len(same_unit)} scans: {_spread(same_unit)}",
    }
    surface = MeasuredSurface(
        q,
        C,
        heights=_heights([scan.heights for scan in same_unit]),
        bearing=bearing,
        bands=_bands([scan.bands for scan in same_unit]),
        anisotropy=bearing.anisotropy,
        unit=unit,
        scans=tuple(same_unit),
        provenance=(record,),
    )
    return surface.resolved()


def _spread(scans: Sequence[MeasuredSurface]) -> str:
    """Means and ranges of heights and gradients of scans."""
    parts = []
    for name in ("h_rms", "h_max", "rms_gradient"):
        values = [float(getattr(scan, name)) for scan in scans]
        mean = np.mean(values)
        parts.append(f"{name} {mean:.4g} ({min(values):.4g} to {max(values):.4g})")
    return "; ".join(parts)


def _mean(parts: Sequence[Bearing | Heights], name: str) -> Any:
    """Mean of a field, a number or an array."""
    values = np.array([getattr(part, name) for part in parts], float)
    is_squared = name in SQUARES
    mean = np.sqrt(np.mean(values**2, axis=0)) if is_squared else values.mean(axis=0)
    return mean if mean.ndim else float(mean)


def _mean_bearing(parts: Sequence[Any]) -> Bearing:
    """Means of all curves and numbers."""
    names = [field.name for field in dataclasses.fields(Bearing)]
    return Bearing(**{name: _mean(parts, name) for name in names})


def _heights(parts: Sequence[Heights]) -> Heights:
    """The distribution of all scans; moments about their means add."""
    h_rms = _mean(parts, "h_rms")
    thirds = [part.skewness * part.h_rms**3 for part in parts]
    fourths = [part.kurtosis * part.h_rms**4 for part in parts]
    return Heights(
        quantiles=_mean(parts, "quantiles"),
        h_rms=h_rms,
        h_max=_mean(parts, "h_max"),
        skewness=float(np.mean(thirds) / h_rms**3),
        kurtosis=float(np.mean(fourths) / h_rms**4),
        top=_mean(parts, "top"),
    )


def _bands(parts: Sequence[Any]) -> RadialSpectrum:
    """The bands of all scans, each with its share of the variance."""
    q = np.concatenate([part.q[part.variance > 0] for part in parts])
    variance = np.concatenate([part.variance[part.variance > 0] for part in parts])
    rising = np.argsort(q)
    return RadialSpectrum(q[rising], variance[rising] / len(parts))
