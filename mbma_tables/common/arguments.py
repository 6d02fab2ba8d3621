"""Checks of arguments: one message per error, with the offending entries."""

from __future__ import annotations

import copy
import dataclasses
import difflib
import functools
import importlib
import inspect
import itertools
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, ParamSpec, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.errors import InputError, MbmaError, OutOfRangeError
from mbma_tables.common.interrupts import in_blocks

SHOWN = 3  # offending entries quoted in a message
BLOCK = 1 << 16  # entries between two checks for Ctrl-C
BLOCK_NUMBERS = 1 << 20  # intermediate numbers between two of them, 8 MB

if TYPE_CHECKING:
    import xarray as xr

P = ParamSpec("P")
R = TypeVar("R")
SYMBOLS = {
    "H": "hurst",
    "d": "separation",
    "u": "mean_separation",
    "p": "pressure",
    "E": "E_star",
    "A": "area",
}
FloatArray = NDArray[np.float64]
# types of results: a number, an array, or these by name
Numbers: TypeAlias = "np.float64 | FloatArray | xr.DataArray"


def describe_entries(values: FloatArray, mask: NDArray[np.bool_]) -> str:
    """The first few entries under `mask`, with their index where the array is not a scalar."""
    if values.ndim == 0:
        return _shortest(values[()])
    places = np.argwhere(mask)
    quoted = []
    for place in places[:SHOWN]:
        index = tuple(place.tolist())
        quoted.append(f"{_shortest(values[index])} at {index}")
    more = len(places) - SHOWN
    return ", ".join(quoted) + (f" and {more} more" if more > 0 else "")


def _shortest(number: Any) -> str:
    return repr(float(number)).removesuffix(".0")


def nearest(name: str, candidates: Iterable[str]) -> str:
    """Text that suggests the nearest known name for an unknown one."""
    names = list(candidates)
    alike = [other for other in names if other.lower() == name.lower()]
    near = alike or difflib.get_close_matches(name, names, 1)
    return f"did you mean {near[0]!r}?" if near else f"known are {', '.join(names)}"


def require_name(kind: str, name: Any, candidates: Iterable[str]) -> None:
    """Reject a name that is not known, with the nearest one."""
    names = list(candidates)
    if name not in names:
        raise InputError(f"no {kind} is named {name!r}; {nearest(str(name), names)}")


def require_fields(kind: type, given: Mapping[str, Any]) -> None:
    """Reject a mapping with names that are no arguments of a dataclass, with the nearest one."""
    names = [field.name for field in dataclasses.fields(kind) if field.init]
    for name in given:
        if name not in names:
            raise InputError(
                f"{kind.__name__} has no argument {name!r}: {nearest(str(name), names)}"
            )


# where constants of bodies and options of a theory are given
MOVED = {
    **dict.fromkeys(
        ("E1", "nu1", "E2", "nu2"),
        "bodies=materials.effective_modulus(E1, nu1, E2, nu2)",
    ),
    **{
        name: f"it is of the bodies, bodies=Bodies(..., {name}=...)"
        for name in ("E_star", "hardness", "conductivity", "nu")
    },
    "materials": "they are the bodies, bodies=('steel 1020', 'silver')",
    **{
        name: f"it is of one theory, theory=theories.Mbma({name}=...)"
        for name in ("island_model", "variant", "rtol", "outside")
    },
    **dict.fromkeys(
        ("temperature", "gas_pressure"), "it is of the gas, gas=Gas('air', ...)"
    ),
}

# what drawings and instruments have, and functions that take a roughness do not
PEAK_TO_VALLEY = (
    "a peak-to-valley height is no rms height, and its ratio to Rq depends on the measured "
    "length; give Rq or Ra"
)
OF_DRAWINGS = {
    **dict.fromkeys(("Rz", "Rt", "Rp", "Rv", "Rmax", "Sz"), PEAK_TO_VALLEY),
    **dict.fromkeys(
        ("lambda_c", "cutoff", "cut_off"),
        "the cut-off lambda_c is the longest wavelength that Ra contains, longest=",
    ),
    "lambda_s": "the filter lambda_s is the shortest wavelength, shortest=",
}
OF_ROUGHNESS = dict.fromkeys(
    ("Rq", "Ra", "Sq", "Sa", "Rdq", "Sdq", "Rsm", "longest", "shortest", *OF_DRAWINGS),
    "Surface.from_roughness takes roughness parameters (docs/surfaces.md)",
)
# hints for names that are no arguments, of functions that have one of the first ones
ELSEWHERE = (
    ({"bodies", "theory"}, MOVED),
    ({"Rq"}, OF_DRAWINGS),
    ({"h_rms"}, OF_ROUGHNESS),
)


def _called(function: Callable[..., Any], arguments: tuple[Any, ...]) -> str:
    """Name of a function as it was called: of a class method, with the class of the call."""
    name = function.__qualname__.removesuffix(".__init__")
    if arguments and isinstance(arguments[0], type):
        return f"{arguments[0].__name__}.{function.__name__}"
    return name


def hinted(function: Callable[P, R]) -> Callable[P, R]:
    """Decorator: an unknown argument's error names the nearest, or a symbol's meaning."""
    parameters = inspect.signature(function).parameters
    names = [name for name in parameters if name not in ("self", "cls")]

    @functools.wraps(function)
    def checked(*arguments: P.args, **named: P.kwargs) -> R:
        for name in named:
            if name in parameters:
                continue
            meant = SYMBOLS.get(name)
            hint = f"did you mean {meant!r}?" if meant in names else nearest(name, names)
            for of_functions, hints in ELSEWHERE:
                if name in hints and of_functions & {*names}:
                    hint = hints[name]
            called = _called(function, arguments)
            raise TypeError(f"{called} has no argument {name!r}: {hint}")
        return function(*arguments, **named)

    return checked


def require_flag(name: str, value: Any) -> None:
    """Reject values other than True and False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} must be True or False, got {value!r}")


# of pyproject.toml, by the package that a user may lack
EXTRAS = {
    "SurfaceTopography": "maps",
    "matplotlib": "plot",
    "pyarrow": "parquet",
    "openpyxl": "xlsx",
}


def needed(module: str) -> Any:
    """A module of another package; if it is missing, the error has the command that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        package = module.partition(".")[0]
        extra = EXTRAS.get(package)
        or_extra = f", or the extra '{extra}' of mbma_tables" if extra else ""
        raise MbmaError(
            f"this needs {package}: pip install {package}{or_extra}"
        ) from None


def is_labelled(value: Any) -> bool:
    """Whether `value` is an xarray DataArray, without importing xarray."""
    xarray = sys.modules.get("xarray")
    return xarray is not None and isinstance(value, xarray.DataArray)


def detached(value: Any) -> Any:
    """A copy of an array of any kind or a list, which its owner may go on changing; other values as they are."""
    if isinstance(value, list) or hasattr(value, "__array__"):
        return copy.deepcopy(value)
    return value


def any_labelled(surface: Any, *values: Any) -> bool:
    """Whether a surface or any value is of DataArrays."""
    xarray: Any = sys.modules.get("xarray")
    return xarray is not None and (
        surface.labelled
        or any(map(isinstance, values, itertools.repeat(xarray.DataArray)))
    )


def finite_array(name: str, value: ArrayLike) -> FloatArray:
    """`value` as a float64 array; empty, masked, complex, text, NaN and infinite are errors.

    A masked array without masked entries is accepted.
    """
    if isinstance(value, float) and math.isfinite(value):
        # numpy is slow for single numbers
        return np.asarray(value, dtype=np.float64)
    # xarray's other containers, and HDF5's: an array with names that would be lost here
    if hasattr(value, "dims") and not is_labelled(value):
        raise InputError(
            f"{name} must be numbers, an array or a DataArray: pass the array inside "
            f"that {type(value).__name__}"
        )
    # pint's and astropy's, whose units numpy would drop
    if hasattr(value, "magnitude") or hasattr(value, "to_value"):
        raise InputError(
            f"{name} is a {type(value).__name__} with a unit of its own: convert it and "
            "pass its numbers, or a text such as '10 MPa'"
        )
    if np.ma.is_masked(value):
        masked = np.ma.getmaskarray(np.ma.asanyarray(value))
        raise InputError(
            f"{name} has {masked.sum()} masked entries among {masked.size}: leave them "
            "out with .compressed(), or put numbers in their place with .filled(number)"
        )
    try:
        numbers = np.asarray(value)
        if numbers.dtype.kind not in "fiu":
            raise TypeError(f"entries of type {numbers.dtype}")
        array: FloatArray = np.asarray(numbers, dtype=np.float64)
    except (TypeError, ValueError) as fault:
        raise InputError(f"{name} must be real numbers: {fault}") from None
    if array.size == 0:
        raise InputError(f"{name} is empty: at least one number is needed")
    bad = ~np.isfinite(array)
    if bad.any():
        raise OutOfRangeError(
            f"{name} must be finite, got {describe_entries(array, bad)}", bad
        )
    return array


def spread(array: Any, shape: tuple[int, ...]) -> Any:
    """An array broadcast to a shape; itself if it has that shape, since numpy's check is slow."""
    return array if np.shape(array) == shape else np.broadcast_to(array, shape)


def entries_at(array: ArrayLike, shape: tuple[int, ...], place: ArrayLike) -> Any:
    """Entries of an array, broadcast to a shape, at flat indices, which may be whole floats."""
    return np.broadcast_to(array, shape).ravel()[np.asarray(place).astype(np.intp)]


def rows(*arguments: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
    """The arguments, broadcast and flat, and their shape."""
    shape = np.broadcast(*arguments).shape
    table = np.empty((len(arguments), *shape))
    for k, value in enumerate(arguments):
        table[k] = value
    return table.reshape(len(arguments), -1), shape


def filled(
    fill: Callable[..., Any], columns: Any, outputs: int, *more: Any
) -> FloatArray:
    """Rows that ``fill(*columns, *more, *rows)`` makes of flat columns of one length."""
    size = columns[0].size
    out = np.empty((outputs, size))
    if size <= BLOCK:
        fill(*columns, *more, *out)
    else:
        in_blocks(
            lambda some: fill(*(each[some] for each in columns), *more, *out[:, some]),
            size,
            BLOCK,
        )
    return out


def answered(
    fill: Callable[..., Any],
    arguments: tuple[ArrayLike, ...],
    outputs: int = 1,
    *more: Any,
) -> list[FloatArray]:
    """Rows computed by a loop of the core from the arguments, in their broadcast shape."""
    columns, shape = rows(*arguments)
    return list(filled(fill, columns, outputs, *more).reshape(outputs, *shape))


def entry_by_entry(
    function: Callable[..., Any], width: int, *arguments: ArrayLike
) -> FloatArray:
    """Results of a function of flat arrays, computed block by block for the broadcast arguments.

    Memory stays flat, and Ctrl-C takes effect between two blocks. The function needs about
    `width` numbers for each entry; entries are the last axis of its results, which must not
    depend on one another.
    """
    columns = np.broadcast_arrays(
        *(np.asarray(value, dtype=float) for value in arguments)
    )
    flat = [column.ravel() for column in columns]

    def of_block(block: slice) -> FloatArray:
        return np.asarray(function(*(column[block] for column in flat)))

    # an empty array has the shape of its results, too
    parts = in_blocks(of_block, max(flat[0].size, 1), max(BLOCK_NUMBERS // width, 1))
    whole = np.concatenate(parts, axis=-1)
    return np.asarray(whole.reshape((*whole.shape[:-1], *columns[0].shape)))


def grouped(owner: NDArray[np.intp]) -> list[tuple[int, NDArray[np.intp]]]:
    """The distinct numbers among owners, each with its indices."""
    order = np.argsort(owner, kind="stable")
    owners, first = np.unique(owner[order], return_index=True)
    return list(zip(owners.tolist(), np.split(order, first[1:]), strict=False))


def require(
    name: str, value: FloatArray, good: Any, allowed: str, unit: str = ""
) -> None:
    """Raise an error where `good` is false; `allowed` describes valid entries, in `unit`."""
    if isinstance(good, np.bool_) and good:
        return
    bad = ~np.asarray(good, dtype=bool)
    if bad.any():
        raise OutOfRangeError(
            f"{name} must be {allowed}, got {describe_entries(value, bad)}{unit}", bad
        )


def positive_array(name: str, value: ArrayLike) -> FloatArray:
    """`value` as an array of positive numbers."""
    array = finite_array(name, value)
    require(name, array, array > 0, "positive")
    return array


def checked_hardness(hardness: ArrayLike) -> FloatArray:
    """Hardnesses as positive numbers; infinity means that nothing yields."""
    if isinstance(hardness, float) and hardness > 0:
        return np.asarray(hardness, dtype=np.float64)
    try:
        values = np.asarray(hardness)
    except ValueError as fault:  # rows of different lengths
        raise InputError(f"hardness must be real numbers: {fault}") from None
    infinite = np.isposinf(values) if values.dtype.kind in "fiu" else False
    finite = finite_array(
        "hardness", np.where(infinite, 1.0, values) if np.any(infinite) else hardness
    )
    require("hardness", finite, finite > 0, "positive, or infinite where nothing yields")
    return np.where(infinite, np.inf, finite)


def one_number(name: str, value: Any) -> Any:
    """`value` as one number, not an array of them."""
    number = finite_array(name, value)
    if number.ndim:
        raise InputError(f"{name} must be one number, got shape {number.shape}")
    return np.float64(number)


def number_in(name: str, value: Any, low: float, high: float) -> float:
    """`value` as a float within [low, high]."""
    number = finite_array(name, value)
    if number.ndim or not low <= number <= high:
        got = " ".join(repr(value).split())  # of an array, on one line
        raise InputError(f"{name} must be a number in [{low:g}, {high:g}], got {got}")
    return float(number)


def whole_number_in(name: str, value: Any, low: int, high: int) -> int:
    """`value` as an int within [low, high]."""
    if (
        isinstance(value, bool)
        or not isinstance(value, int | np.integer)
        or not low <= value <= high
    ):
        raise InputError(
            f"{name} must be a whole number in [{low}, {high}], got {value!r}"
        )
    return int(value)


def broadcast_shape(**arguments: Any) -> tuple[int, ...]:
    """The common shape of named arrays, or one message that lists theirs."""
    try:
        return np.broadcast(*arguments.values()).shape
    except ValueError:
        listed = ", ".join(
            f"{name} {np.shape(value)}" for name, value in arguments.items()
        )
        raise InputError(f"arguments do not broadcast: {listed}") from None
