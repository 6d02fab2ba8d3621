"""Several scans of one surface as one: mean spectrum, heights and curves, and how much the scans differ."""

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
    """The surface from several measured maps of it, each a `Surface.from_map` of similar size and treatment.

    Spectra, quantiles of heights and the curves of highest parts are averaged; h_max is
    that for the area of one scan.

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
    if len(scans) < 2 or not all(
        isinstance(scan, MeasuredSurface) and scan.map is not None for scan in scans
    ):
        raise InputError("average takes two or more surfaces of Surface.from_map")
    first = scans[0]
    if len({scan.unit is None for scan in scans}) > 1:
        raise InputError(
            "some scans have a unit and some do not: make them with unit=..."
        )
    known = [
        scan if scan.unit == first.unit else scan.to(str(first.unit)) for scan in scans
    ]
    q = np.unique(np.concatenate([scan.q for scan in known]))
    spectra = np.array([scan.power_spectrum(q) for scan in known])
    covered = np.array([(q >= scan.q0) & (q <= scan.q1) for scan in known]).sum(axis=0)
    bearings = [scan.bearing for scan in known]
    bearing = Bearing(
        **{
            field.name: _mean(bearings, field.name)
            for field in dataclasses.fields(Bearing)
        }
    )
    spread = "; ".join(
        f"{name} {np.mean(values):.4g} ({min(values):.4g} to {max(values):.4g})"
        for name in ("h_rms", "h_max", "rms_gradient")
        for values in [[float(getattr(scan, name)) for scan in known]]
    )
    told = f"average of {len(known)} scans: {spread}"
    return MeasuredSurface(
        q,
        spectra.sum(axis=0) / np.maximum(covered, 1),
        heights=_heights([scan.heights for scan in known]),
        bearing=bearing,
        bands=_bands([scan.bands for scan in known]),
        anisotropy=bearing.anisotropy,
        unit=first.unit,
        scans=tuple(known),
        provenance=(
            {
                "step": "average",
                "of": [list(scan.provenance) for scan in known],
                "told": told,
            },
        ),
    ).resolved()


def _mean(parts: Sequence[Any], name: str) -> Any:
    values = np.array([getattr(part, name) for part in parts], float)
    found = (
        np.sqrt(np.mean(values**2, axis=0)) if name in SQUARES else values.mean(axis=0)
    )
    return found if found.ndim else float(found)


def _heights(parts: Sequence[Heights]) -> Heights:
    """The distribution of all scans; moments about their means add."""
    h_rms = _mean(parts, "h_rms")
    skewness, kurtosis = (
        float(
            np.mean([getattr(part, name) * part.h_rms**power for part in parts])
            / h_rms**power
        )
        for name, power in (("skewness", 3), ("kurtosis", 4))
    )
    return Heights(
        _mean(parts, "quantiles"),
        h_rms,
        _mean(parts, "h_max"),
        skewness,
        kurtosis,
        _mean(parts, "top"),
    )


def _bands(parts: Sequence[Any]) -> RadialSpectrum:
    """The bands of all scans, each with its share of the variance."""
    q, variance = (
        np.concatenate([getattr(p, name)[p.variance > 0] for p in parts])
        for name in ("q", "variance")
    )
    order = np.argsort(q)
    return RadialSpectrum(q[order], variance[order] / len(parts))
