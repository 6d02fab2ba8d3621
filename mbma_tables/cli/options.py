"""The options that commands share; each group reaches its command as one argument."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click

from mbma_tables.errors import InputError
from mbma_tables.scenes.specimen import (
    MAP_OPTIONS,
    MATERIAL,
    NUMBERS,
    Specimen,
    effective_modulus_of,
    from_map,
    from_name,
    from_numbers,
    read_specimen,
)
from mbma_tables.surfaces.cases import CASES
from mbma_tables.surfaces.readings import NAMED
from mbma_tables.theories import THEORIES

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

DEFAULT_RTOL = 1e-8
TIERS = ("exact", "universal", "island4d", "formula", "rigid")
PICTURES = (".png", ".svg", ".pdf")


@dataclasses.dataclass(frozen=True)
class Model:
    """What `contact` and `island` are asked for besides the surface and the gap."""

    tier: str
    reading: str
    rtol: float
    theory: str = "mbma"
    hardness: float | str = math.inf


@dataclasses.dataclass(frozen=True)
class Output:
    """Where a report goes, and in which form."""

    as_json: bool
    as_csv: bool
    out: Path | None

    def __post_init__(self) -> None:
        if self.as_json and self.as_csv:
            raise InputError("one of --json and --csv, not both")


def _parse_number(ctx: click.Context, param: click.Parameter, given: str | None) -> float | str | None:
    """A number, or the text of one with its unit, which is read where the name is known."""
    if given is None:
        return None
    try:
        return float(given)
    except ValueError:
        if not given.strip()[:1] or given.strip()[0] not in "+-.0123456789":
            raise click.BadParameter(f"{given!r} is not a number, nor one with its unit.", ctx, param) from None
        return given


def _parse_numbers(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> list[float | str] | None:
    """All numbers of a repeated option, with commas between them; None where it was not given."""
    numbers: list[Any] = []
    for text in given:
        numbers += [_parse_number(ctx, param, part) for part in text.split(",")] if text.strip() else []
    return numbers if given else None


def quantity_option(*names: str, help: str) -> Decorator:
    """An option that takes a number, or one with its unit."""
    return click.option(*names, callback=_parse_number, metavar="X[UNIT]", help=help)


def numbers_option(*names: str, help: str) -> Decorator:
    """An option that may be repeated, each time with one number or several, each perhaps with its unit."""
    return click.option(*names, multiple=True, callback=_parse_numbers, metavar="X[UNIT][,X...]", help=help)


def _group(argument: str, build: Callable[[dict[str, Any]], Any], *options: Any) -> Decorator:
    """Options that reach a command as one argument, built from their values by name."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        before = len(getattr(function, "__click_params__", ()))

        @functools.wraps(function)
        def grouped(**given: Any) -> Any:
            values = {name: given.pop(name) for name in names}
            return function(**given, **{argument: build(values)})

        result: Any = grouped
        for option in reversed(options):
            result = option(result)
        names = [parameter.name for parameter in result.__click_params__[before:]]
        return result  # type: ignore[no-any-return]

    return decorate


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


def _specimen(given: Mapping[str, Any]) -> Specimen:
    """The surface that the options describe, with its modulus; a modulus option overrides that of a file.

    Plain numbers are in --length-unit and --stress-unit where those are given, else in the units known from a file.
    """
    length, stress = given["length_unit"], given["stress_unit"]
    numbers = {key: given[key] for key in NUMBERS if given[key] is not None}
    used = [f"--{key}" for key in ("surface", "file", "map") if given[key] is not None] + ["numbers"] * bool(numbers)
    if len(used) != 1:
        raise InputError(
            "one surface is needed: --surface NAME, --file TOML, --map MAP, --hurst --q0 --q1 (or --zeta-1) "
            f"--h-rms --h-max, or --hurst --m0 --m2 --m4 --h-max; got {' and '.join(used) or 'none'}"
        )
    treatment = _given({name: given[name] for name in (*MAP_OPTIONS, "model")})
    if treatment and given["map"] is None:
        raise InputError(f"--{next(iter(treatment)).replace('_', '-')} is about a measured map: it goes with --map")
    if given["file"] is not None:
        specimen = read_specimen(given["file"])
    elif given["map"] is not None:
        specimen = from_map(given["map"], treatment | {"unit": length})
    elif given["surface"] is not None:
        specimen = from_name(given["surface"])
    else:
        specimen = from_numbers(numbers, length)
    material = {key: given[key] for key in MATERIAL if given[key] is not None}
    if material:
        modulus, unit = effective_modulus_of(material, stress)
        specimen = dataclasses.replace(specimen, E_star=modulus, stress_unit=unit or specimen.stress_unit)
    return specimen.in_units(length, stress)


# in the words of `mbma_tables.surfaces.treatment.Treatment`
_MAP_OPTIONS = (
    quantity_option("--dx", "dx", help="Sampling step [length], of a map whose file has none;"),
    quantity_option("--dy", "dy", help="and along its second axis, if another."),
    click.option("--channel", type=int, help="Number of the map's channel in its file."),
    click.option("--periodic/--not-periodic", "periodic", default=None, help="Whether the map continues periodically."),
    click.option(
        "--detrend", metavar="MODE", help="What to subtract: mean, plane, quadratic, or a mode of SurfaceTopography."
    ),
    click.option("--outliers", type=float, metavar="N", help="Take out points N standard deviations off; try 10."),
    click.option("--fill", metavar="harmonic", help="Fill undefined points, however many."),
    quantity_option("--short-cutoff", "short_cutoff", help="Shortest wavelength to keep [length], the resolution."),
    quantity_option("--long-cutoff", "long_cutoff", help="Longest wavelength to keep [length]."),
    quantity_option("--tip-radius", "tip_radius", help="Of the probe or stylus [length]: keep what it can follow."),
    click.option("--reliable/--all-waves", "reliable", default=None, help="Whether the file's own resolution counts."),
    click.option("--window", metavar="NAME", help="Window of the power spectrum, hann by default."),
    quantity_option("--extrapolate-to", "extrapolate_to", help="Continue the spectrum to this wavelength [length],"),
    click.option("--extrapolate-hurst", "extrapolate_hurst", type=float, help="by this Hurst exponent."),
)


length_unit = functools.partial(
    click.option, "--length-unit", metavar="UNIT", help="Unit of plain lengths and of the answer, such as mm."
)
stress_unit_option = click.option(
    "--stress-unit", metavar="UNIT", help="Unit of plain moduli and of the answer, such as MPa."
)
over_h_rms = click.option("--over-h-rms", is_flag=True, help="The lengths given are multiples of h_rms.")

_SPECIMEN_OPTIONS = (
    click.option(
        "--surface",
        type=click.Choice(list(CASES)),
        metavar="NAME",
        help="Surface: a case of the paper; `mbma surfaces` lists them.",
    ),
    click.option("--file", type=click.Path(path_type=Path), metavar="TOML", help="Surface: a TOML file."),
    click.option("--map", type=click.Path(path_type=Path), metavar="MAP", help="Surface: a measured map or line scan."),
    *_MAP_OPTIONS,
    click.option(
        "--model", type=click.Choice(("measured", "self-affine")), help="Of a map: its own spectrum, or five numbers."
    ),
    click.option("--hurst", type=float, help="Surface in numbers: Hurst exponent, in (0, 1]."),
    quantity_option("--q0", help="Smallest wavenumber [1/length]."),
    quantity_option("--q1", help="Largest wavenumber [1/length]; or give --zeta-1."),
    click.option("--zeta-1", "zeta_1", type=float, help="Largest magnification q1/q0, above 3."),
    quantity_option("--h-rms", "h_rms", help="Root-mean-square height [length]."),
    quantity_option("--h-max", "h_max", help="Highest point above the mid-plane [length]."),
    quantity_option("--m0", help="Surface by moments: hurst, h_max, variance of height [length^2],"),
    click.option("--m2", type=float, help="variance of a profile's slope,"),
    quantity_option("--m4", help="variance of a profile's second derivative [1/length^2]."),
    quantity_option("--Rq", "Rq", help="Surface by a drawing: rms height of a profile [length], with hurst, h_max,"),
    quantity_option("--Ra", "Ra", help="or its mean absolute height,"),
    quantity_option("--Sq", "Sq", help="or rms height of a map,"),
    quantity_option("--Sa", "Sa", help="or mean absolute height of a map;"),
    quantity_option("--Rdq", "Rdq", help="rms slope of a profile,"),
    quantity_option("--Sdq", "Sdq", help="or rms gradient of a map,"),
    quantity_option("--Rsm", "Rsm", help="or mean spacing of a profile's elements [length];"),
    quantity_option("--longest", help="longest wave [length],"),
    quantity_option("--shortest", help="or shortest wave [length],"),
    quantity_option("--Sds", "Sds", help="or summits per area [1/length^2],"),
    quantity_option("--Spd", "Spd", help="the same by its newer name;"),
    quantity_option("--Sp", "Sp", help="highest point of a map [length] in place of --h-max."),
    quantity_option(
        "--E-star", "E_star", help="Effective modulus; export needs one, elsewhere forces are over E* without it."
    ),
    quantity_option("--E1", "E1", help="Instead of --E-star: Young's modulus,"),
    click.option("--nu1", "nu1", type=float, help="and Poisson's ratio of one body,"),
    quantity_option("--E2", "E2", help="Young's modulus of the other,"),
    click.option("--nu2", "nu2", type=float, help="and its Poisson's ratio."),
    length_unit(),
    stress_unit_option,
)
map_options = _group("treatment", _given, *_MAP_OPTIONS, length_unit("unit"))
specimen_options = _group("specimen", _specimen, *_SPECIMEN_OPTIONS)
# None where none of them is given
optional_specimen_options = _group(
    "specimen", lambda given: _specimen(given) if _given(given) else None, *_SPECIMEN_OPTIONS
)


def load_options(option: Callable[..., Decorator]) -> Decorator:
    """What a contact is known by, each an `option` of numbers; those given reach a command as `loads`."""
    return _group(
        "loads",
        _given,
        option("--separation", "-d", help="Gap d from the mid-plane [length]."),
        option("--mean-separation", "-u", help="Instead: mean separation u = (h_max + d)/2 [length]."),
        option("--pressure", "-p", help="Instead: force over nominal area, over E* where none is given."),
        option("--area", "-a", help="Instead: real over nominal contact area."),
    )


reading_option = click.option(
    "--reading",
    default="reported",
    show_default=True,
    type=click.Choice(list(NAMED)),
    help="Reading of the paper's equations, of mbma.",
)

_MODEL_OPTIONS = (
    reading_option,
    click.option(
        "--tier",
        default="universal",
        show_default=True,
        type=click.Choice(TIERS),
        help="Island model.",
    ),
    click.option(
        "--rtol", type=float, default=DEFAULT_RTOL, show_default=True, help="Numerical relative error asked for."
    ),
)
theory_option = click.option(
    "--theory",
    default="mbma",
    show_default=True,
    type=click.Choice(list(THEORIES)),
    help="Theory; the others have no tier, reading or rtol.",
)
# of islands, which MBMA alone has
model_options = _group("model", lambda given: Model(**given), *_MODEL_OPTIONS)
hardness_option = quantity_option("--hardness", help="Largest pressure that the softer body bears; none: elastic.")

theory_options = _group("model", lambda given: Model(**_given(given)), theory_option, *_MODEL_OPTIONS, hardness_option)

output_options = _group(
    "output",
    lambda given: Output(**given),
    click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table."),
    click.option("--csv", "as_csv", is_flag=True, help="Print CSV with '#' comments instead of a table."),
    click.option("--out", type=click.Path(path_type=Path), metavar="FILE", help="Write to a file instead."),
)

leakage_option = click.option("--leakage", is_flag=True, help="Add the flow conductance of the gaps [length^3].")
plot_option = click.option(
    "--plot", type=click.Path(path_type=Path), metavar="FILE", help="Draw a picture: FILE.png, .svg or .pdf."
)


def check_plot(plot: Path | None, out: Path | None) -> None:
    """Refuse a picture of an unknown kind, or one that another output would overwrite."""
    if plot is not None and plot.suffix not in PICTURES:
        raise InputError(f"--plot must end with one of {', '.join(PICTURES)}, got {plot}")
    if plot is not None and plot == out:
        raise InputError(f"--out and --plot name the same file, {out}")
