"""The options that commands share; each group reaches its command as one argument."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click

from mbma_tables.errors import InputError
from mbma_tables.scenes.specimen import (
    MATERIAL,
    NUMBERS,
    Specimen,
    effective_modulus_of,
    from_map,
    from_name,
    from_numbers,
    read_specimen,
)
from mbma_tables.theories.registry import THEORIES

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

DEFAULT_RTOL = 1e-8


@dataclasses.dataclass(frozen=True)
class Model:
    """What `contact` and `island` are asked for besides the surface and the gap."""

    tier: str
    reading: str
    rtol: float
    theory: str = "mbma"


@dataclasses.dataclass(frozen=True)
class Output:
    """Where a report goes, and in which form."""

    as_json: bool
    as_csv: bool
    out: Path | None

    def __post_init__(self) -> None:
        if self.as_json and self.as_csv:
            raise InputError("one of --json and --csv, not both")


def _parse_numbers(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> list[float] | None:
    """All numbers of a repeated option, with commas between them; None where it was not given."""
    numbers = []
    for text in given:
        try:
            numbers += [float(part) for part in text.split(",")] if text.strip() else []
        except ValueError:
            raise click.BadParameter(
                f"{text!r} is not a number, nor numbers with commas between them.", ctx, param
            ) from None
    return numbers if given else None


def numbers_option(*names: str, help: str) -> Decorator:
    """An option that may be repeated, each time with one number or several."""
    return click.option(*names, multiple=True, callback=_parse_numbers, metavar="X[,X...]", help=help)


def _group(
    argument: str, names: tuple[str, ...], build: Callable[[Mapping[str, Any]], Any], *options: Any
) -> Decorator:
    """Options that reach a command as one argument, built from their values by name."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(function)
        def grouped(**given: Any) -> Any:
            values = {name: given.pop(name) for name in names}
            return function(**given, **{argument: build(values)})

        result: Callable[..., Any] = grouped
        for option in reversed(options):
            result = option(result)
        return result

    return decorate


def _specimen(given: Mapping[str, Any]) -> Specimen:
    """The surface that the options describe, with its modulus; a modulus option overrides that of a file."""
    numbers = {key: given[key] for key in NUMBERS if given[key] is not None}
    used = [f"--{key}" for key in ("surface", "file", "map") if given[key] is not None] + ["numbers"] * bool(numbers)
    if len(used) != 1:
        raise InputError(
            "one surface is needed: --surface NAME, --file TOML, --map MAP, --hurst --q0 --q1 (or --zeta-1) "
            f"--h-rms --h-max, or --hurst --m0 --m2 --m4 --h-max; got {' and '.join(used) or 'none'}"
        )
    if given["file"] is not None:
        specimen = read_specimen(given["file"])
    elif given["map"] is not None:
        specimen = from_map(given["map"])
    elif given["surface"] is not None:
        specimen = from_name(given["surface"])
    else:
        specimen = from_numbers(numbers)
    modulus = effective_modulus_of({key: given[key] for key in MATERIAL if given[key] is not None})
    return specimen if modulus is None else dataclasses.replace(specimen, E_star=modulus)


over_h_rms = click.option("--over-h-rms", is_flag=True, help="The lengths given are multiples of h_rms.")

_SPECIMEN_OPTIONS = (
    click.option("--surface", metavar="NAME", help="Surface: a case of the paper; `mbma surfaces` lists them."),
    click.option("--file", type=click.Path(path_type=Path), metavar="TOML", help="Surface: a TOML file."),
    click.option("--map", type=click.Path(path_type=Path), metavar="MAP", help="Surface: fitted to a map of heights."),
    click.option("--hurst", type=float, help="Surface in numbers: Hurst exponent, in (0, 1]."),
    click.option("--q0", type=float, help="Smallest wavenumber [1/length]."),
    click.option("--q1", type=float, help="Largest wavenumber [1/length]; or give --zeta-1."),
    click.option("--zeta-1", "zeta_1", type=float, help="Largest magnification q1/q0, above 3."),
    click.option("--h-rms", "h_rms", type=float, help="Root-mean-square height [length]."),
    click.option("--h-max", "h_max", type=float, help="Highest point above the mid-plane [length]."),
    click.option("--m0", type=float, help="Surface by moments: hurst, h_max, variance of height [length^2],"),
    click.option("--m2", type=float, help="variance of a profile's slope,"),
    click.option("--m4", type=float, help="variance of a profile's second derivative [1/length^2]."),
    click.option("--E-star", "E_star", type=float, help="Effective modulus; without one forces are over E*."),
    click.option("--E1", "E1", type=float, help="Instead of --E-star: Young's modulus,"),
    click.option("--nu1", "nu1", type=float, help="and Poisson's ratio of one body,"),
    click.option("--E2", "E2", type=float, help="Young's modulus of the other,"),
    click.option("--nu2", "nu2", type=float, help="and its Poisson's ratio."),
)
_SPECIMEN_NAMES = ("surface", "file", "map", *NUMBERS, *MATERIAL)

specimen_options = _group("specimen", _SPECIMEN_NAMES, _specimen, *_SPECIMEN_OPTIONS)
# None where none of them is given
optional_specimen_options = _group(
    "specimen",
    _SPECIMEN_NAMES,
    lambda given: None if all(value is None for value in given.values()) else _specimen(given),
    *_SPECIMEN_OPTIONS,
)

reading_option = click.option(
    "--reading",
    default="reported",
    show_default=True,
    metavar="reported|printed",
    help="Reading of the paper's equations.",
)

_MODEL_OPTIONS = (
    reading_option,
    click.option(
        "--tier",
        default="universal",
        show_default=True,
        metavar="exact|universal|island4d|formula|rigid",
        help="Island model.",
    ),
    click.option("--rtol", type=float, default=DEFAULT_RTOL, show_default=True, help="Relative error asked for."),
)
theory_option = click.option(
    "--theory", default="mbma", show_default=True, metavar="|".join(THEORIES), help="Theory; the others have no tier."
)
# of islands, which MBMA alone has
model_options = _group("model", ("tier", "reading", "rtol"), lambda given: Model(**given), *_MODEL_OPTIONS)
theory_options = _group(
    "model", ("theory", "tier", "reading", "rtol"), lambda given: Model(**given), theory_option, *_MODEL_OPTIONS
)

output_options = _group(
    "output",
    ("as_json", "as_csv", "out"),
    lambda given: Output(**given),
    click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table."),
    click.option("--csv", "as_csv", is_flag=True, help="Print CSV with '#' comments instead of a table."),
    click.option("--out", type=click.Path(path_type=Path), metavar="FILE", help="Write to a file instead."),
)

png_option = click.option(
    "--plot", type=click.Path(path_type=Path), metavar="FILE.png", help="Draw force and area to a PNG file."
)


def check_png(plot: Path | None, out: Path | None) -> None:
    """Refuse a picture that is not a PNG file, or that another output would overwrite."""
    if plot is not None and plot.suffix.lower() != ".png":
        raise InputError(f"--plot writes PNG: the file's name must end with .png, got {plot}")
    if plot is not None and plot == out:
        raise InputError(f"--out and --plot name the same file, {out}")
