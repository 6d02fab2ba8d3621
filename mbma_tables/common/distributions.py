"""Numbers that are not known exactly: ranges, means with a standard deviation, and measured values."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, finite_array
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import DIMENSIONS, Units, read

# standard deviations from the mean at which a normal distribution ends: beyond are 6 draws
# in 100,000, of which some would be negative heights
TAILS = 4.0
MEASURED = "measured"  # key of measured values
LOG = "log"  # after a range, of which every logarithm is equally probable
FORMS = (
    "'0.25..2.5 mm' is a range, '0.25..2.5 mm log' one of equally probable logarithms, '1.6 um +- 0.2 um' a mean and its standard deviation, "
    "{'measured': ['1.5 um', '1.7 um']} are measured values"
)
# between a mean and its standard deviation
_SPREAD = re.compile(r"\+-|\+/-|\N{PLUS-MINUS SIGN}")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@dataclasses.dataclass(frozen=True)
class Distribution:
    """A number that is not known exactly.

    Every number of a range is equally probable, or with "log" every logarithm. Of a mean and a standard deviation the
    distribution is normal, without what is farther than four standard deviations from the
    mean. Each of the measured values is equally probable.

    Examples
    --------
    >>> from mbma_tables.common.distributions import distribution_of
    >>> wave = distribution_of("longest", "0.25..2.5 mm")
    >>> wave.low, wave.median, wave.high, wave.unit
    (0.25, 1.375, 2.5, 'mm')
    >>> Ra = distribution_of("Ra", "1.6 um +- 10%")
    >>> [round(float(number), 3) for number in Ra.quantile([0.05, 0.5, 0.95])]
    [1.337, 1.6, 1.863]
    """

    kind: str  # "range", "log", "normal" or "measured"
    numbers: tuple[
        float, ...
    ]  # both ends, mean and deviation, or the values as they rise
    unit: str  # as it was typed, "" where there is none
    text: str  # what was typed

    @property
    def low(self) -> float:
        """The smallest number."""
        if self.kind == "normal":
            return self.numbers[0] - TAILS * self.numbers[1]
        return self.numbers[0]

    @property
    def high(self) -> float:
        """The largest number."""
        if self.kind == "normal":
            return self.numbers[0] + TAILS * self.numbers[1]
        return self.numbers[-1]

    @property
    def median(self) -> float:
        """The number that half of the draws exceed."""
        if self.kind == "normal":
            return self.numbers[0]
        if self.kind == LOG:
            return math.sqrt(self.numbers[0] * self.numbers[1])
        return float(np.median(self.numbers))

    def quantile(self, level: Any) -> FloatArray:
        """The number that is not exceeded with a probability in [0, 1]."""
        levels = np.asarray(level, dtype=float)
        if self.kind == "range":
            low, high = self.numbers
            return np.asarray(low + (high - low) * levels)
        if self.kind == LOG:
            low, high = self.numbers
            # the ends themselves without rounding
            inside = np.clip(low * (high / low) ** levels, low, high)
            return np.asarray(np.where(levels == 1, high, inside))
        if self.kind == "normal":
            from scipy.special import ndtr, ndtri

            mean, deviation = self.numbers
            beyond = ndtr(-TAILS)
            return np.asarray(
                mean + deviation * ndtri(beyond + (1 - 2 * beyond) * levels)
            )
        last = len(self.numbers) - 1
        places = np.minimum((levels * len(self.numbers)).astype(int), last)
        values: FloatArray = np.asarray(self.numbers)
        return np.asarray(values[places])

    def written(self, numbers: Any) -> Any:
        """Numbers as they would be typed, with their unit; lists of arrays."""
        if not self.unit:
            return np.asarray(numbers)[()]
        if np.ndim(numbers):
            return [self.written(each) for each in numbers]
        return f"{float(numbers)!r} {self.unit}"

    def retyped(self, factor: float, unit: str) -> Any:
        """What would be typed for it times a factor, in another unit."""
        numbers = [f"{number * factor:.15g}" for number in self.numbers]
        if self.kind == MEASURED:
            return {MEASURED: [f"{number} {unit}" for number in numbers]}
        text = f"{(' +- ' if self.kind == 'normal' else '..').join(numbers)} {unit}"
        return f"{text} {LOG}" if self.kind == LOG else text


def distribution_of(name: str, given: Any) -> Distribution | None:
    """The distribution that was typed for a named number; None for anything else.

    Raises
    ------
    InputError
        For a range whose first end is not the smaller one, a deviation that is not positive,
        a unit that only one of both numbers has, and fewer than two measured values.
    """
    if isinstance(given, Mapping) and MEASURED in given:
        return _measured(name, given)
    if not isinstance(given, str):
        return None
    if ".." in given:
        return _range(name, given)
    if _SPREAD.search(given):
        return _normal(name, given)
    return None


def _parts(name: str, text: str, pieces: list[str]) -> list[tuple[float, str]]:
    """The numbers of a text, each with its unit."""
    matches = [_NUMBER.fullmatch(piece) for piece in pieces]
    parts = [(float(m[1]), m[2]) for m in matches if m is not None]
    if len(parts) != len(pieces) or not all(math.isfinite(x) for x, _ in parts):
        raise InputError(f"{name} = {text[:60]!r} is no range of numbers: {FORMS}")
    return parts


def _in_one_unit(
    name: str, text: str, parts: list[tuple[float, str]]
) -> tuple[list[float], str]:
    """Numbers in the unit of the last one, which those before it have if they state none."""
    unit = parts[-1][1]
    numbers = []
    for number, own in parts:
        if own and not unit:
            raise InputError(
                f"{name} = {text[:60]!r}: a unit is missing, of the number after {own!r}"
            )
        if own in ("", unit):
            numbers.append(number)
            continue
        if not any(DIMENSIONS.get(name, ())):
            raise InputError(f"{name} = {text[:60]!r}: write both numbers in one unit")
        length = bool(DIMENSIONS[name][0])
        base = read(name, f"1 {unit}")[1]
        units = Units(length=base) if length else Units(stress=base)
        numbers.append(units.number(name, f"{number!r} {own}"))
    return numbers, unit


def _range(name: str, text: str) -> Distribution:
    is_log = text.rstrip().endswith(f" {LOG}")
    pieces = text.rstrip().removesuffix(LOG).split("..") if is_log else text.split("..")
    (low, high), unit = _in_one_unit(name, text, _parts(name, text, pieces[:2]))
    if len(pieces) > 2:
        raise InputError(f"{name} = {text[:60]!r} is no range of numbers: {FORMS}")
    if low >= high:
        fault = "has no width" if low == high else "is upside down"
        raise InputError(
            f"{name} = {text[:60]!r}: the range {fault}, its smaller end is the first one"
        )
    if is_log and low <= 0:
        raise InputError(f"{name} = {text[:60]!r}: logarithms are of positive numbers")
    return Distribution(LOG if is_log else "range", (low, high), unit, text)


def _normal(name: str, text: str) -> Distribution:
    pieces = _SPREAD.split(text)
    if len(pieces) > 2:
        raise InputError(f"{name} = {text[:60]!r} is no range of numbers: {FORMS}")
    parts = _parts(name, text, pieces)
    if parts[1][1] == "%":
        mean, unit = parts[0]
        deviation = abs(mean) * parts[1][0] / 100
    else:
        (mean, deviation), unit = _in_one_unit(name, text, parts)
    if deviation <= 0:
        raise InputError(
            f"{name} = {text[:60]!r}: the standard deviation must be positive"
        )
    return Distribution("normal", (mean, deviation), unit, text)


def _measured(name: str, given: Mapping[str, Any]) -> Distribution:
    if len(given) > 1:
        raise InputError(
            f"{name}: measured values have no further keys, got {', '.join(given)}"
        )
    values = given[MEASURED]
    if isinstance(values, str) or np.ndim(values) != 1 or len(values) < 2:
        raise InputError(
            f"{name}: measured values are a list of at least two, got {values!r}"
        )
    text = f"measured {', '.join(map(str, values))}"
    if any(isinstance(value, str) for value in values):
        parts = _parts(name, text, [str(value) for value in values])
        if any(bool(own) != bool(parts[0][1]) for _, own in parts):
            raise InputError(f"{name}: write the unit to each of the measured values")
        numbers, unit = _in_one_unit(name, text, parts)
    else:
        numbers, unit = finite_array(name, values).tolist(), ""
    return Distribution(MEASURED, tuple(sorted(numbers)), unit, text)


def distributions_in(
    entries: Any, place: str = "", name: str = ""
) -> Iterator[tuple[str, Distribution]]:
    """The distributions in nested mappings, tuples and lists, each by its place such as "part_a.Ra"."""
    found = distribution_of(name or place, entries)
    if found is not None:
        yield place, found
    elif isinstance(entries, Mapping):
        for key, entry in entries.items():
            yield from distributions_in(entry, f"{place}.{key}".lstrip("."), str(key))
    elif isinstance(entries, tuple | list) and len(entries) <= 2:
        # one of each body; longer ones are batches
        for index, entry in enumerate(entries):
            yield from distributions_in(entry, f"{place}.{index}", name)


def with_numbers(entries: Any, numbers: Mapping[str, Any], place: str = "") -> Any:
    """Nested entries with other values at some places."""
    if place in numbers:
        return numbers[place]

    def at(key: Any) -> str:
        return f"{place}.{key}".lstrip(".")

    if isinstance(entries, Mapping):
        return {
            key: with_numbers(each, numbers, at(key)) for key, each in entries.items()
        }
    if isinstance(entries, tuple | list):
        made = [with_numbers(each, numbers, at(k)) for k, each in enumerate(entries)]
        return type(entries)(made)
    return entries


def of_all(
    distributions: Mapping[str, Distribution], of: Callable[[Distribution], Any]
) -> dict[str, Any]:
    """What is typed in place of distributions: of each a number, or an array of them."""
    return {name: each.written(of(each)) for name, each in distributions.items()}
