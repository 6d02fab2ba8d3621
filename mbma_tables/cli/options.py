"""The options that commands share; each group reaches its command as one argument."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import click

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import KINDS
from mbma_tables.common.toml_files import value_of
from mbma_tables.contacts.question import PRESCRIBED
from mbma_tables.design import specimen as specimens
from mbma_tables.design.specimen import Specimen
from mbma_tables.islands.island_models import ISLAND_MODELS
from mbma_tables.islands.variants import NAMED
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.roughness import ROUGHNESS
from mbma_tables.surfaces.self_affine import CASES
from mbma_tables.theories import THEORIES
from mbma_tables.theories.named import OF_MAPS
from mbma_tables.theories.simulated.grids import GRIDS

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

DEFAULT_RTOL = 1e-8
MANY = 24  # options of a command whose help has sections
PICTURES = tuple(f".{kind}" for kind in KINDS)


class Model(NamedTuple):
    """Arguments of `contact` and `island` other than the surface and the gap."""

    island_model: str
    variant: str
    rtol: float
    theory: Any = None  # a name or None, and after `of` an object
    hardness: float | str | None = None
    largest_pressure: float | str | None = None
    grid: str | None = None  # of theory "simulated"
    options: Mapping[str, Any] = MappingProxyType({})  # others of the theory, by name

    @property
    def yields(self) -> bool:
        """Whether there is a hardness, and not an infinite one."""
        return self.hardness not in (None, math.inf)

    def of(self, surface: AnySurface, given_name: str | None = None) -> Model:
        """The same with the theory as an object, for a contact at a given quantity, None for a curve."""
        from mbma_tables.theories import resolve

        theory = resolve(self.theory, surface, given_name, self._changed_options())
        return self._replace(theory=theory)

    def _changed_options(self) -> dict[str, Any]:
        """Options of theories that differ from their defaults."""
        defaults = {
            "island_model": "universal",
            "variant": "reported",
            "rtol": DEFAULT_RTOL,
            "grid": None,
        }
        changed = {}
        for name, default in defaults.items():
            value = getattr(self, name)
            if value != default:
                changed[name] = value
        twice = [name for name in self.options if name in changed]
        if twice:
            raise InputError(f"{', '.join(twice)}: given twice, by --option too")
        return {**changed, **self.options}

    def bodies(
        self, specimen: Specimen, conductivity: Sequence[float | str] | None = None
    ) -> Bodies:
        """The bodies in contact, of the specimen's modulus."""
        # an absent conductivity is not one of zero entries
        conductivities = tuple(conductivity) if conductivity else None
        if conductivities is not None and len(conductivities) == 1:
            conductivities = 2 * conductivities
        return Bodies(
            specimen.modulus,
            hardness=self.hardness,
            largest_pressure=self.largest_pressure,
            conductivity=conductivities,
        )


class Output(NamedTuple):
    """Destination and format of a report."""

    as_json: bool
    as_csv: bool
    out: Path | None


def _output(given: Mapping[str, Any]) -> Output:
    if given["as_json"] and given["as_csv"]:
        raise InputError("one of --json and --csv, not both")
    return Output(**given)


def _parse_number(ctx: click.Context, param: click.Parameter, given: Any) -> Any:
    """A number, or a number with its unit or a range as text, which is converted later."""
    try:
        return None if given is None else float(given)
    except ValueError:
        if given.lstrip().startswith("{"):
            # measured values, as a file has them
            return value_of(given)
        if not given.strip().startswith(tuple("+-.0123456789")):
            raise click.BadParameter(
                f"{given!r} is not a number, nor one with its unit.", ctx, param
            ) from None
        return given


def _parse_numbers(
    ctx: click.Context, param: click.Parameter, given: tuple[str, ...]
) -> list[float | str] | None:
    """All numbers of a repeated option, with commas between them; None where it was not given."""
    numbers: list[Any] = []
    for text in given:
        is_measured = text.lstrip().startswith("{")
        parts = [text] if is_measured else text.split(",") if text.strip() else []
        numbers += [_parse_number(ctx, param, part) for part in parts]
    return numbers if given else None


def quantity_option(*names: str, help: str) -> Decorator:
    """An option that takes a number, or one with its unit."""
    return click.option(*names, callback=_parse_number, metavar="X[UNIT]", help=help)


def numbers_option(*names: str, help: str) -> Decorator:
    """An option that may be repeated, each time with one number or several, each perhaps with its unit."""
    return click.option(
        *names,
        multiple=True,
        callback=_parse_numbers,
        metavar="X[UNIT][,X...]",
        help=help,
    )


def option_group(
    argument: str, build: Callable[[dict[str, Any]], Any], *options: Any
) -> Decorator:
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


def given_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """The options that were given, by name."""
    return {name: value for name, value in values.items() if value is not None}


def surface_in(given: Mapping[str, Any]) -> dict[str, Any]:
    """What options have of a surface without a file; an error for none and for several."""
    known = (*specimens.NUMBERS, *specimens.MAP_OPTIONS, "map", "model")
    surface = given_values(
        {"name": given["surface"]} | {name: given[name] for name in known}
    )
    if (given["file"] is None) == (not surface):
        got = ", ".join(["file"] * (given["file"] is not None) + list(surface)) or "none"
        raise InputError(
            f"one surface is needed: --surface NAME, --file TOML, --map MAP, or its numbers; got {got}"
        )
    return surface


def specimen_of(
    given: Mapping[str, Any], entries: Mapping[str, Any] | None = None
) -> Specimen:
    """The surface that the options describe, with its modulus; a modulus option overrides that of a file.

    `entries` are those of the file, if it was read.
    """
    length = given["length_unit"]
    stress = given["stress_unit"]
    surface = surface_in(given)
    material = given_values({name: given[name] for name in specimens.MATERIAL})
    if given["file"] is not None:
        specimen = specimens.read_specimen(given["file"], entries)
    else:
        tables = {"surface": surface | {"length_unit": length}}
        specimen = specimens.from_tables(tables, Path(), "surface given by numbers")
    if material:
        modulus, unit = specimens.effective_modulus_of(material, stress)
        specimen = dataclasses.replace(
            specimen, E_star=modulus, stress_unit=unit or specimen.stress_unit
        )
    return specimen.in_units(length, stress)


def _option(name: str, help: str, **kind: Any) -> Decorator:
    """The option for one argument of the library, by its name; a quantity unless another kind is given."""
    flag = f"--{name.replace('_', '-')}"
    kind = kind or {"callback": _parse_number, "metavar": "X[UNIT]"}
    return click.option(flag, name.partition("/")[0], help=help, **kind)


# of a number without a unit, or a range of them
_NUMBER: dict[str, Any] = {"callback": _parse_number, "metavar": "X"}
PATH: Any = click.Path(path_type=Path)
# options of `MAP_OPTIONS`, named as in `mbma_tables.surfaces.treatment.Treatment`
_MAP_OPTIONS = (
    _option("dx", "Sampling step [length], of a map whose file has none;"),
    _option("dy", "and along its second axis, if another."),
    _option("channel", "Number of the map's channel in its file.", type=int),
    _option(
        "periodic/--not-periodic", "Whether the map continues periodically.", default=None
    ),
    _option(
        "detrend",
        "What to subtract: mean, plane, quadratic, or a mode of SurfaceTopography.",
        metavar="MODE",
    ),
    _option(
        "outliers",
        "Remove points beyond N standard deviations; try 10.",
        type=float,
        metavar="N",
    ),
    _option("fill", "Fill undefined points, however many.", metavar="harmonic"),
    _option("short_cutoff", "Shortest wavelength to keep [length], the resolution."),
    _option("long_cutoff", "Longest wavelength to keep [length]."),
    _option("s_filter", "Nesting index of an S-filter, ISO 25178 [length],"),
    _option("l_filter", "and of an L-filter [length]."),
    _option(
        "confirmed",
        "What looks like an artefact and is the surface, such as 'bow,spikes'.",
        metavar="NAMES",
    ),
    _option("extrapolate_to", "Continue the spectrum to this wavelength [length],"),
    _option("extrapolate_hurst", "by this Hurst exponent.", type=float),
)
length_unit = functools.partial(
    click.option,
    "--length-unit",
    metavar="UNIT",
    help="Unit of plain lengths and of the answer, such as mm.",
)
stress_unit_option = _option(
    "stress_unit", "Unit of plain moduli and of the answer, such as MPa.", metavar="UNIT"
)

# of a drawing, besides the Hurst exponent
_ROUGHNESS_OPTIONS = (
    _option(
        "Rq", "Surface by a drawing: rms height of a profile [length], with hurst, h_max,"
    ),
    _option("Ra", "or its mean absolute height,"),
    _option("Sq", "or rms height of a map,"),
    _option("Sa", "or mean absolute height of a map;"),
    _option("Rdq", "rms slope of a profile,"),
    _option("Sdq", "or rms gradient of a map,"),
    _option("Rsm", "or mean spacing of a profile's elements [length];"),
    _option("longest", "longest wavelength [length],"),
    _option("shortest", "or shortest wavelength [length],"),
    _option(
        "rolloff",
        "wavelength from which on a power law follows a flat spectrum [length],",
    ),
    _option("Sp", "highest point of a map [length] in place of --h-max,"),
    _option(
        "nominal_area",
        "or the nominal area [length^2], which determines the highest point.",
    ),
    _option(
        "process",
        "What made the face, such as milled: whether results are valid depends on it.",
        metavar="NAME",
    ),
)
_SPECIMEN_OPTIONS = (
    _option(
        "surface",
        f"Surface: a case of the paper, {', '.join(CASES)}.",
        type=click.Choice([*CASES]),
        metavar="NAME",
    ),
    _option("file", "Surface: a TOML file.", type=PATH, metavar="TOML"),
    _option("map", "Surface: a measured map or line scan.", type=PATH, metavar="MAP"),
    *_MAP_OPTIONS,
    _option(
        "model",
        "Of a map: its own spectrum, or five numbers.",
        type=click.Choice(("measured", "self-affine")),
    ),
    _option("hurst", "Surface in numbers: Hurst exponent, in (0, 1].", **_NUMBER),
    _option("q0", "Smallest wavenumber [1/length]."),
    _option("q1", "Largest wavenumber [1/length]; or give --zeta-1."),
    _option("zeta_1", "Largest magnification q1/q0, above 3.", **_NUMBER),
    _option("h_rms", "Root-mean-square height [length]."),
    _option("h_max", "Highest point above the mid-plane [length]."),
    _option("m0", "Surface by moments: hurst, h_max, variance of height [length^2],"),
    _option("m2", "variance of a profile's slope,", **_NUMBER),
    _option("m4", "variance of a profile's second derivative [1/length^2]."),
    *_ROUGHNESS_OPTIONS,
    _option(
        "E_star",
        "Effective modulus; export needs one, elsewhere forces are over E* without it.",
    ),
    _option("E1", "Instead of --E-star: Young's modulus,"),
    _option("nu1", "and Poisson's ratio of one body,", **_NUMBER),
    _option("E2", "Young's modulus of the other,"),
    _option("nu2", "and its Poisson's ratio.", **_NUMBER),
    length_unit(),
    stress_unit_option,
)
map_options = option_group("treatment", given_values, *_MAP_OPTIONS, length_unit("unit"))
specimen_options = option_group("specimen", specimen_of, *_SPECIMEN_OPTIONS)
# of a joint of one rough face, in place of its file
face_options = option_group(
    "face",
    given_values,
    _option("hurst", "Without a file, the rough face in numbers: Hurst exponent,"),
    *_ROUGHNESS_OPTIONS,
    click.option(
        "--bodies",
        metavar="NAME[,NAME]",
        help="Metals of both parts, or the effective modulus.",
    ),
)


def _pair(ctx: click.Context, param: click.Parameter, given: str | None) -> Any:
    """The smallest and the largest pressure, with a colon between them."""
    if given is None:
        return None
    ends = tuple(given.split(":"))
    if len(ends) != 2:
        raise InputError(f"--pressures must be like 0.1:100 or 1MPa:50MPa, got {given!r}")
    return ends


def _names(ctx: click.Context, param: click.Parameter, given: str | None) -> Any:
    return None if given is None else given.split(",")


# of the command line, by kinds of options of files
_KINDS: dict[str, dict[str, Any]] = {
    "text": {},
    "whole": {"type": int},
    "number": {"type": float},
    "names": {"callback": _names, "metavar": "NAME[,NAME]"},
    "quantity": {"callback": _parse_number, "metavar": "X[UNIT]"},
    "range": {"callback": _pair, "metavar": "X:X"},
    "flag": {"is_flag": True},
    "off": {"flag_value": False},
}


@functools.cache
def _file_options(*groups: str) -> tuple[click.Option, ...]:
    """Options of files for other programs, as the targets of some groups or of all declare them."""
    from mbma_tables.export.registry import declared_options

    made = []
    for name, field in declared_options(*groups).items():
        kind = field.metadata["kind"]
        words = f"--{'without-' if kind == 'off' else ''}{name.replace('_', '-')}"
        how = _KINDS.get(kind) or (
            {"type": click.Choice(kind.split("|"))} if "|" in kind else {}
        )
        if kind:
            help = field.metadata["help"]
            made.append(click.Option([words, name], help=help, default=None, **how))
    return tuple(made)


class WithFileOptions(click.Command):
    """A command that takes the options of files for other programs; it receives those given as `asked`.

    They are those of all targets, or of some groups of them.
    """

    def __init__(self, *args: Any, groups: Sequence[str] = (), **options: Any) -> None:
        super().__init__(*args, **options)
        self._groups = tuple(groups)

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Its own options, those of files, and --help."""
        own = super().get_params(ctx)
        names = {each.name for each in own}
        declared = _file_options(*self._groups)
        more = [each for each in declared if each.name not in names]
        return [*own[:-1], *more, own[-1]]

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command with the options of files as one argument."""
        own = {each.name for each in self.params}
        more = [name for name in ctx.params if name not in own]
        ctx.params["asked"] = given_values({name: ctx.params.pop(name) for name in more})
        return super().invoke(ctx)


# of a command that takes a surface or something else: as they were given
optional_specimen_options = option_group("specimen", dict, *_SPECIMEN_OPTIONS)


def load_options(option: Callable[..., Decorator]) -> Decorator:
    """Quantities of which one is given, each an `option` of numbers; the command receives those given as `loads`."""
    return option_group(
        "loads",
        given_values,
        option("--separation", "-d", help="Gap d from the mid-plane [length]."),
        option(
            "--mean-separation",
            "-u",
            help="Instead: mean separation u = (h_max + d)/2 [length].",
        ),
        option(
            "--pressure",
            "-p",
            help="Instead: force over nominal area, over E* where none is given.",
        ),
        option("--area", "-a", help="Instead: real over nominal contact area."),
    )


def work_options(of: str = "") -> Decorator:
    """Who does many pieces of work, besides processes of this machine; `of` begins the help."""

    def with_options(command: Callable[..., Any]) -> Callable[..., Any]:
        options = (
            click.option(
                "--part",
                metavar="K/N",
                help=f"{of}do part K of N, on one of N machines or in an array of jobs.",
            ),
            click.option(
                "--scheduler",
                metavar="ADDRESS",
                help=f"{of}dask scheduler whose workers do it, such as tcp://host:8786.",
            ),
            click.option(
                "--local-cluster",
                type=click.IntRange(1),
                metavar="N",
                help=f"{of}a dask cluster of N processes, which replaces those that are killed.",
            ),
        )
        for option in reversed(options):
            command = option(command)
        return command

    return with_options


def json_option(instead: str) -> Decorator:
    """The option that prints JSON in place of a table, or of text."""
    return click.option(
        "--json",
        "as_json",
        is_flag=True,
        help=f"Print one JSON object instead of {instead}.",
    )


def _named_values(texts: Sequence[str]) -> dict[str, Any]:
    """Values by name of texts such as "rtol=1e-4": numbers where they are, else texts."""
    values: dict[str, Any] = {}
    for text in texts:
        name, separator, value = text.partition("=")
        if not separator or not name or name in values:
            raise InputError(f"--option takes NAME=VALUE, each name once, got {text!r}")
        try:
            values[name] = float(value)
        except ValueError:
            values[name] = value
    return values


class _NameOrTable(click.Choice[str]):
    """The name of an island model or a theory, or the file of a table."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        if isinstance(value, str) and (value.endswith(".nc") or Path(value).is_file()):
            return value
        return super().convert(value, param, ctx)


SHOWN: dict[str, Any] = {"show_default": True}
variant_option = _option(
    "variant",
    "Variant of the paper's equations, of mbma.",
    default="reported",
    type=click.Choice([*NAMED]),
    **SHOWN,
)
_MODEL_OPTIONS = (
    variant_option,
    _option(
        "island_model",
        "Island model, by name or as the FILE.nc of a table.",
        default="universal",
        type=_NameOrTable(ISLAND_MODELS),
        **SHOWN,
    ),
    _option(
        "rtol",
        "Requested numerical relative error.",
        type=float,
        default=DEFAULT_RTOL,
        **SHOWN,
    ),
)
theory_option = _option(
    "theory",
    "Theory; only mbma has an island model, variant and rtol. Default: mbma for these and at a --separation, else "
    "simulated for a map, calibrated for other surfaces. Also the file of a table of totals.",
    type=_NameOrTable([*THEORIES, *OF_MAPS]),
)
grid_option = _option(
    "grid",
    "Points and loads of theory simulated: quick, the default; full, more accurate, from 0.1% to "
    "90% contact; half, full on half of the points along each side.",
    type=click.Choice([*GRIDS]),
)
theory_option_option = _option(
    "option",
    "Another option of the theory, by its name in the library: method=simplified of persson, "
    "outside=exact of mbma; may be repeated.",
    multiple=True,
    metavar="NAME=VALUE",
    callback=lambda ctx, param, given: _named_values(given),
)
# for islands, which only MBMA has
model_options = option_group("model", lambda given: Model(**given), *_MODEL_OPTIONS)
hardness_option = _option(
    "hardness",
    "Largest pressure that the softer body bears, also '200 HV', '58 HRC' or 'steel 4140 hard'; none: elastic.",
    callback=lambda ctx, param, given: given if given and given[0].isalpha() and given != "inf"
    else _parse_number(ctx, param, given),
    metavar="X[UNIT]",
)  # fmt: skip
largest_pressure_option = _option(
    "largest_pressure",
    "With a hardness: the largest pressure so far, below which contacts unload and reload.",
    callback=_parse_number,
    metavar="X[UNIT]",
)
theory_options = option_group(
    "model",
    lambda given: Model(options=given.pop("option"), **given_values(given)),
    theory_option,
    theory_option_option,
    grid_option,
    *_MODEL_OPTIONS,
    hardness_option,
    largest_pressure_option,
)

output_options = option_group(
    "output",
    _output,
    json_option("a table"),
    click.option(
        "--csv",
        "as_csv",
        is_flag=True,
        help="Print CSV with '#' comments instead of a table.",
    ),
    _option("out", "Write to a file instead.", type=PATH, metavar="FILE"),
)
# of numbers that are ranges
draws_options = option_group(
    "drawn",
    given_values,
    click.option(
        "--draws", type=int, help="Of numbers that are ranges; 2000 by default."
    ),
    click.option("--seed", type=int, help="Of their random numbers; 0 by default."),
)
leakage_option = _option(
    "leakage", "Add the flow coefficient of the gaps [length^3].", is_flag=True
)
columns_option = click.option(
    "--quantity",
    metavar="NAME[,NAME]",
    callback=_names,
    help="Add columns of further quantities: mean_pressure, hydraulic_aperture, ...",
)
results_option = click.option(
    "--quantity",
    metavar="NAME[,NAME]",
    callback=_names,
    help="Quantities of the contact; else those that tables show, with a model uncertainty.",
)
conductivity_option = numbers_option(
    "--conductivity",
    help="Of both bodies, or of each: adds conductance. In W/(m^2 K) of '45 W/(m K)'.",
)
plot_option = _option(
    "plot", "Draw a picture: FILE.png, .svg or .pdf.", type=PATH, metavar="FILE"
)


# headings of help, and the options below them; others are below "Options"
_SECTIONS = {
    "What is known": PRESCRIBED,
    "Surface": ("surface", "file", "map"),
    "Measured map": (*specimens.MAP_OPTIONS, "model"),
    "Surface in numbers": (
        "hurst",
        "q0",
        "q1",
        "zeta_1",
        "h_rms",
        "h_max",
        "nominal_area",
        "m0",
        "m2",
        "m4",
    ),
    "Surface by roughness parameters": ROUGHNESS,
    "Bodies": (
        *specimens.MATERIAL,
        "hardness",
        "conductivity",
        "length_unit",
        "stress_unit",
    ),
    "Theory": ("theory", "grid", "variant", "island_model", "rtol"),
    "Options": (),
}


def format_options(
    command: click.Command, context: click.Context, formatter: click.HelpFormatter
) -> None:
    """The options of a command for its help, in sections where there are many."""
    parameters = [
        each for each in command.get_params(context) if isinstance(each, click.Option)
    ]
    titles = {
        name: title for title, names in reversed(_SECTIONS.items()) for name in names
    }
    titles = titles if len(parameters) > MANY else {}
    for title in _SECTIONS:
        own = [
            each for each in parameters if titles.get(str(each.name), "Options") == title
        ]
        if own:
            with formatter.section(title):
                formatter.write_dl(
                    [each.get_help_record(context) or ("", "") for each in own]
                )


def check_plot(plot: Path | None, out: Path | None) -> None:
    """Refuse a picture of an unknown kind, or one that another output would overwrite."""
    if plot is not None and plot.suffix not in PICTURES:
        raise InputError(f"--plot must end with one of {', '.join(PICTURES)}, got {plot}")
    if plot is not None and plot == out:
        raise InputError(f"--out and --plot name the same file, {out}")
