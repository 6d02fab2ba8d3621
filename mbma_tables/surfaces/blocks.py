"""Maps of too many points, read part by part as means of blocks, so that the whole is never loaded.

A map in a `.npy` file, or an array from ``numpy.load(..., mmap_mode="r")`` or `numpy.memmap`, is
read from the disk one part at a time. Spikes, lost lines and saturation, which means would hide,
are looked for at every point of each part.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import os
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.common.progress import doing, shown
from mbma_tables.surfaces import artefacts
from mbma_tables.surfaces.artefacts import SMALLEST
from mbma_tables.surfaces.measurements import (
    MAX_HEADER_BYTES,
    defined_or_masked,
    heights_of,
)
from mbma_tables.surfaces.treatment import Treated, Treatment, names_of, without_outliers

MOST_POINTS = 2**22  # of a map, above which it is read by blocks
PART = 1024  # points along a side of what is loaded at once, about
LEAST_DEFINED = 0.5  # share of a block's points without which its mean is undefined


def mapped(path: str | os.PathLike[str]) -> Any:
    """A large map in a `.npy` file as a memory map; None for other files and smaller maps."""
    place = pathlib.Path(path)
    if place.suffix.lower() != ".npy" or not place.is_file():
        return None
    if place.stat().st_size <= MOST_POINTS + MAX_HEADER_BYTES:
        # of one byte a point at least
        return None
    try:
        heights = np.load(place, mmap_mode="r", allow_pickle=False)
    except ValueError:
        # the reader of small ones says what is wrong with it
        return None
    return heights if is_large(heights) else None


def is_large(grid: Any) -> bool:
    """Whether heights are a map of more than `MOST_POINTS` points."""
    shape = np.shape(grid)
    return len(shape) == 2 and math.prod(shape) > MOST_POINTS


def read_by_blocks(
    grid: Any,
    steps: tuple[float, ...],
    periodic: bool,
    treatment: Treatment,
    unit: str | None,
) -> Treated:
    """The means of square blocks of a large map, with what was seen at its single points.

    Parameters
    ----------
    grid : array_like, shape (nx, ny)
        Heights [length], NaN or masked where undefined, of which one part is loaded at a time.
    steps : (float, float)
        Sampling steps [length].
    periodic : bool
        Whether the map continues periodically; blocks then divide its sides evenly.
    treatment : Treatment
        Of which `outliers` are taken out of the single points.
    unit : str or None
        Of length.

    Returns
    -------
    Treated
        Up to `MOST_POINTS` means; undefined where half of the points of a block are.
    """
    shape = np.shape(grid)
    side = _side_of_block(shape, periodic)
    blocks = tuple(count // side for count in shape)
    means = np.ma.masked_array(np.zeros(blocks), True)
    seen: dict[str, list[Mapping[str, Any]]] = {}
    every = list(itertools.product(*(_parts(count, side) for count in blocks)))
    confirmed = names_of(treatment.confirmed)
    with shown("reading the map"):
        for k, part in enumerate(every, 1):
            doing(f"reading the map, part {k} of {len(every)}", (k - 1) / len(every))
            single = tuple(slice(side * axis.start, side * axis.stop) for axis in part)
            own = defined_or_masked(grid[single])
            if np.ma.getmaskarray(own).all():
                continue
            checked = Treated(own, steps, False, unit, confirmed=confirmed)
            checked = _checked(checked, treatment.outliers)
            means[part] = _means(checked.heights, side)
            for step in checked.provenance:
                # outliers that were asked for may be none
                if step["points"]:
                    seen.setdefault(step["step"], []).append(step)
    means = heights_of(means)
    coarse = tuple(side * step for step in steps)
    read = Treated(means, coarse, periodic, unit, confirmed=confirmed)
    left_out = [count % side for count in shape]
    read = read.after(means, "blocks", _description(shape, side, left_out), side=side)
    together = tuple(_of_all_parts(found, len(every)) for found in seen.values())
    return dataclasses.replace(read, provenance=(*read.provenance, *together))


def _side_of_block(shape: tuple[int, ...], periodic: bool) -> int:
    """Points along a side of the smallest blocks of which a map has few enough."""
    least = math.ceil(math.sqrt(math.prod(shape) / MOST_POINTS))
    if not periodic:
        return least
    common = math.gcd(*shape)
    for side in range(least, common + 1):
        if common % side == 0:
            return side
    raise InputError(
        f"a periodic map of {shape[0]} x {shape[1]} points has no blocks of {least} points a "
        "side or more that divide both sides: give a part of it with periodic=False, or one "
        "whose sides have such a divisor"
    )


def _parts(count: int, side: int) -> list[slice]:
    """Blocks along an axis that are loaded at once."""
    number = math.ceil(count * side / PART)
    ends = np.linspace(0, count, number + 1).astype(int).tolist()
    return [slice(first, end) for first, end in itertools.pairwise(ends)]


def _checked(part: Treated, outliers: float | None) -> Treated:
    """A part of a map with what is doubtful about its single points, and without outliers."""
    if min(part.heights.shape) < SMALLEST:
        return part
    for found in artefacts.as_read(part.heights):
        part = part.with_artefact(found)
    return without_outliers(part, outliers)


def _means(heights: Any, side: int) -> Any:
    """Means over the defined points of each block."""
    rows, columns = (count // side for count in heights.shape)
    apart = (rows, side, columns, side)
    known = ~np.ma.getmaskarray(heights).reshape(apart)
    total = np.where(known, np.ma.getdata(heights).reshape(apart), 0.0).sum(axis=(1, 3))
    counts = known.sum(axis=(1, 3))
    means: FloatArray = total / np.maximum(counts, 1)
    return np.ma.masked_array(means, counts < LEAST_DEFINED * side * side)


def _description(shape: tuple[int, ...], side: int, left_out: list[int]) -> str:
    """What was read of a map of this shape, and what was left out at its ends."""
    description = (
        f"{shape[0]} x {shape[1]} points were read as the means of blocks of {side} x {side}: "
        "shorter wavelengths are not in it"
    )
    if any(left_out):
        description += (
            f"; the last {left_out[0]} rows and {left_out[1]} columns fill no block and were "
            "left out"
        )
    return description


def _of_all_parts(found: list[Mapping[str, Any]], number: int) -> dict[str, Any]:
    """One record of what was seen in several parts, in the words of the first of them."""
    points = sum(step["points"] for step in found)
    where = f"{points} points in {len(found)} of {number} parts, in the first of which "
    together = {**found[0], "points": points}
    for text in ("told", "not_valid"):
        if text in together:
            together[text] = where + together[text]
    return together
