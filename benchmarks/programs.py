"""Every target of exports: random laws in four systems of units, written, read back or run, beside the library.

Numbers of files are converted to metres, pascals and watts here, and compared with contacts
of the same surface in metres and pascals, so that neither the writers' conversions nor the
laws' approximations are used on both sides.
"""

from __future__ import annotations

import csv
import ctypes
import dataclasses
import datetime
import functools
import importlib.metadata
import io
import math
import pathlib
import platform
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import click
import numpy as np

from generate import page
from generate.files import ROOT
from generate.pages.export import MEASURED, formats
from mbma_tables import Bodies, ContactLaw, Joint, Surface, contact, contact_law
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.files import write_file
from mbma_tables.contacts.quantities.registry import in_files
from mbma_tables.effects.film import flow_factors
from mbma_tables.export.code.language import Program
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.law_table import FILM, Curve, LawTable
from mbma_tables.export.model.c_code import SOURCES, write_code
from mbma_tables.export.registry import targets
from mbma_tables.export.request import export_law, files_of
from mbma_tables.export.rows.data import from_json
from mbma_tables.export.targets import Target
from mbma_tables.theories import Mbma

# of units, in metres and pascals
METRES = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
PASCALS = {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "psi": 4.4482216152605 / 0.0254**2}
SYSTEMS = (("m", "Pa"), ("mm", "MPa"), ("um", "GPa"), ("in", "psi"))
KINDS = ("joint", "map", "mbma", "unloading")
# powers of length, stress and heat of columns, by their names
POWERS = {
    "overclosure": (1, 0, 0),
    "mean_separation": (1, 0, 0),
    "aperture": (1, 0, 0),
    "hydraulic_aperture": (1, 0, 0),
    "pressure": (0, 1, 0),
    "mean_pressure": (0, 1, 0),
    "tangent": (-1, 1, 0),
    "stiffness": (-1, 1, 0),
    "tangential_stiffness": (-1, 1, 0),
    "energy": (1, 1, 0),
    "leakage": (3, 0, 0),
    "solid_conductance": (-2, 0, 1),
    "gas_conductance": (-2, 0, 1),
    "total_conductance": (-2, 0, 1),
}
# programs that know the conductivity themselves: their files are of the rest
PER_CONDUCTIVITY = ("lethe",)
NU = 0.3
CONDUCTIVITY = "45 W/(m K)"
LAW_RTOL = 1e-8  # of the polynomials of all files
MAPS = 4  # of which each is simulated once
MAP_POINTS = 32
POINTS = 40  # overclosures at which code is asked
# agreement of code where its header states no error: roundings, which slopes have more of
VALUES = 1e-13
SLOPES = 1e-11
RTOL = 1e-8  # of sums by the package of C
# functions that code has with every law, and those that some files have
OF_LAWS = ("pressure", "tangent", "area", "energy")
FURTHER = (
    "solid_conductance",
    "gas_conductance",
    "total_conductance",
    "tangential_stiffness",
    "leakage",
)


# programs that take ten seconds for a law run it in one of so many turns
SLOW = ("jax-law", "modelica-law")
SLOW_TURNS = 4


class Found(NamedTuple):
    """The largest relative error of a file's numbers, and the largest share of the error that it states."""

    error: float
    share: float

    def or_larger(self, other: Found) -> Found:
        """The larger one of each."""
        return Found(max(self.error, other.error), max(self.share, other.share))


NOTHING = Found(0.0, 0.0)


@dataclasses.dataclass(frozen=True)
class Case:
    """A random law, in metres and pascals, and the units of its files."""

    kind: str
    surface: Any
    bodies: Bodies
    theory: str
    length: str
    stress: str
    least: float  # pressures of the rows
    largest: float
    # numbers of the library by column and abscissas, which many programs share
    known: dict[Any, Any] = dataclasses.field(default_factory=dict)

    def size(self, name: str) -> float:
        """One unit of a column in the SI."""
        length, stress, heat = POWERS.get(name, (0, 0, 0))
        # the power of the system mm, N, MPa is mW
        watt = 1e-3 if (self.length, self.stress) == ("mm", "MPa") else 1.0
        unit: float = METRES[self.length] ** length * PASCALS[self.stress] ** stress
        return unit * watt**heat

    @functools.cached_property
    def of_user(self) -> Joint | ContactLaw:
        """The joint or law of the user, in the units of the files."""
        surface = self.surface.to(self.length)
        pascal = PASCALS[self.stress]
        numbers: dict[str, Any] = {}
        for name in ("hardness", "largest_pressure"):
            value = getattr(self.bodies, name)
            if value is not None:
                numbers[name] = value / pascal
        bodies = Bodies(
            f"{self.bodies.E_star / pascal!r} {self.stress}",
            conductivity=self.bodies.conductivity,
            nu=self.bodies.nu,
            **numbers,
        )
        return _law_of(self.kind, surface, bodies, self.theory)

    @functools.cached_property
    def in_si(self) -> Joint | ContactLaw:
        """The same joint or law in metres and pascals."""
        return _law_of(self.kind, self.surface, self.bodies, self.theory)

    @functools.cached_property
    def law_in_si(self) -> ContactLaw:
        """The law of the joint, or the law."""
        made = self.in_si
        return made.law() if isinstance(made, Joint) else made

    @functools.cached_property
    def law_of_user(self) -> ContactLaw:
        """The same in the units of the files."""
        made = self.of_user
        return made.law() if isinstance(made, Joint) else made

    def at_pressure(self, pressure: FloatArray) -> Any:
        """The library's contact at pressures [Pa]."""
        if isinstance(self.in_si, Joint):
            return self.in_si.at_pressure(pressure)
        return contact(self.surface, self.bodies, pressure=pressure, theory=self.theory)

    def at_gap(self, u: FloatArray) -> Any:
        """The library's contact at mean separations [m]."""
        surface = self.law_in_si.surface
        return contact(surface, self.bodies, mean_separation=u, theory=self.theory)

    def export(self, target: str, **options: Any) -> Any:
        """A file of the target, as a user asks for it."""
        units = {"length_unit": self.length, "stress_unit": self.stress}
        if isinstance(self.of_user, Joint):
            return self.of_user.export(target, **units, **options)
        return export_law(self.of_user, target, **units, **options)


def _law_of(kind: str, surface: Any, bodies: Bodies, theory: str) -> Joint | ContactLaw:
    if kind != "joint":
        return contact_law(surface, bodies, theory, rtol=LAW_RTOL)
    # wide beside the longest wave
    side = 1000 / float(surface.to("m").q0)
    options = {"friction": 0.2, "gas": "air", "nominal_area": f"{side**2!r} m^2"}
    return Joint(surface, bodies=bodies, theory=theory, **options)


@functools.cache
def _map(seed: int) -> Any:
    """A random map, whose law is simulated the first time that it is asked for."""
    rng = np.random.default_rng(seed)
    waves = 4 * np.fft.fftfreq(MAP_POINTS)
    q = np.hypot(waves[:, None], waves[None])
    noise = np.fft.fft2(rng.normal(size=q.shape))
    heights = np.fft.ifft2(np.where((q > 0.1) & (q < 1.0), noise, 0)).real
    return Surface.from_map(5e-7 * heights / heights.std(), 1e-6, periodic=True, unit="m")


def case(number: int, kind: str = "", system: tuple[str, str] | None = None) -> Case:
    """The law of a number, of a kind and in units that are drawn where they are not given."""
    rng = np.random.default_rng([63, number])
    kind = kind or KINDS[rng.integers(len(KINDS))]
    length, stress = system or SYSTEMS[rng.integers(len(SYSTEMS))]
    if kind == "map":
        surface = _map(int(rng.integers(MAPS)))
    else:
        h_rms = 10 ** rng.uniform(-7, -4)
        # slopes from 1% to 100%
        q0 = 10 ** rng.uniform(-2, -0.7) / h_rms / 10
        q1 = q0 * 10 ** rng.uniform(1.0, 2.5)
        h_max = h_rms * rng.uniform(2.8, 4.5)
        surface = Surface(rng.uniform(0.5, 0.95), q0, q1, h_rms, h_max, unit="m")
    modulus = 10 ** rng.uniform(6, 11.5)
    yielding = modulus * float(surface.rms_gradient)
    largest = yielding * 10 ** rng.uniform(-2.0, -1.0)
    numbers = {}
    if kind == "unloading":
        numbers["hardness"] = yielding * 10 ** rng.uniform(-0.5, 0.3)
        # from the largest pressure so far down
        largest = numbers["hardness"] * 10 ** rng.uniform(-1.5, -0.7)
        numbers["largest_pressure"] = largest
        largest *= 0.95
    bodies = Bodies(modulus, nu=NU, conductivity=(CONDUCTIVITY,) * 2, **numbers)
    theory = {"map": "simulated", "mbma": "mbma"}.get(kind, "calibrated")
    least = largest * 10 ** rng.uniform(-2.0, -0.7)
    return Case(kind, surface, bodies, theory, length, stress, least, largest)


def quantities(one: Case) -> Iterator[str]:
    """Quantities of rows that a law has."""
    yield "pressure"
    yield "total_conductance" if one.kind == "joint" else "solid_conductance"
    yield "tangential_stiffness"
    yield "mean_pressure"
    if one.kind != "unloading":
        yield "hydraulic_aperture"
    if one.kind == "joint":
        yield "solid_conductance"
        yield FILM


def rows(one: Case, quantity: str) -> LawTable:
    """Rows of a quantity, as JSON has them, from which those of every program are written."""
    options: dict[str, Any] = {"quantity": quantity}
    if quantity == FILM:
        options["peklenik"] = 2.0
    else:
        # as many as CalculiX and FreeCAD keep
        options["rows"] = 20 if "conductance" in quantity else 60
    ends = one.least / PASCALS[one.stress], one.largest / PASCALS[one.stress]
    text = one.export("json", pressures=ends, **options)
    (law,) = from_json(text.encode())
    return law


def column_of(law: LawTable, name: str) -> tuple[LawTable, str]:
    """The rows and column that a program calls so, perhaps with a prefix: of the law, or those beside it."""
    columns = list(law.columns)[1:]
    found = [key for key in columns if f"_{name}".endswith(f"_{key}")]
    found = found or [key for key in columns if key.endswith(f"_{name}")]
    if found:
        return law, max(found, key=len)
    assert law.behaviour is not None
    assert name == law.behaviour.y_name
    return law.behaviour, law.behaviour.y_name


def in_rows(one: Case, target: Target, law: LawTable) -> Found | None:
    """Numbers of a file of rows beside the library's; None where the program does not take these rows."""
    units = target.units
    if not target.takes_rows(law.quantity) or units not in (
        None,
        (one.length, one.stress),
    ):
        return None
    if law.x.size > target.most.get(law.quantity, law.x.size):
        return None
    out = pathlib.Path(f"law{target.end or '.txt'}")
    content = files_of([law], target.name, {}, out).files[""]
    assert target.read is not None
    found = NOTHING
    curves = target.read(content)
    assert curves
    for curve in curves:
        of, name = column_of(law, curve.name)
        found = found.or_larger(_of_curve(one, target.name, of, name, curve))
    return found


def _of_curve(one: Case, target: str, law: LawTable, name: str, curve: Curve) -> Found:
    """The column of a program beside the library's numbers, in the rows and between them."""
    x = one.size(law.x_name) * curve.x
    y = one.size(name) * curve.y
    if target in PER_CONDUCTIVITY:
        y *= law.facts["conductivity"][0] / one.size(name) / one.size("overclosure")
    if name == law.y_name:
        # what programs interpolate has an error that the header states
        middle = (x[1:] + x[:-1]) / 2
        x, y = np.append(x, middle), np.append(y, np.interp(middle, x, y))
    key = f"{law.quantity} {name}", x.tobytes()
    if key not in one.known:
        one.known[key] = library(one, law, name, x)
    expected, floor, stated = one.known[key]
    # the header's error holds from the floor on
    taken = np.isfinite(expected) & (np.abs(expected) > 0) & (expected >= floor)
    if law.x_name == "pressure":
        # below the smallest pressure asked for there is the row of pressure zero alone
        taken &= x >= law_begins(one, law)
    error = float(np.abs(y[taken] / expected[taken] - 1).max())
    allowed = (1 + stated) * (1 + curve.rtol) - 1
    return Found(error, error / allowed)


def law_begins(one: Case, law: LawTable) -> float:
    """The pressure [Pa] from which the header's error holds, where it has one."""
    found = re.search(r", from pressure (\S+) \S+ on", " ".join(law.comments))
    return one.size("pressure") * float(found[1]) if found else 0.0


def stated_of(comments: tuple[str, ...], column: str) -> float:
    """The error of a column's rows and that of the law about its theory, as headers state them."""
    text = " ".join(comments)
    of_law = re.search(r"the law is within (\S+) of its theory", text)
    of_rows = re.search(
        rf"\b{column}: \d+ rows; largest error of linear interpolation (\S+),", text
    ) or re.search(
        rf"largest errors of linear interpolation, .*?\b{column} (\S+?)[,;]", text
    )
    assert of_law is not None
    assert of_rows is not None, column
    return float(of_law[1]) + float(of_rows[1])


def library(
    one: Case, law: LawTable, name: str, x: FloatArray
) -> tuple[FloatArray, float, float]:
    """Numbers of a column by the library in the SI, the floor of its errors, and the error that the header states."""
    stated = stated_of(law.comments, name)
    floor = one.size(law.y_name) * law.floor
    if law.quantity == FILM:
        return *_of_film(one, name, x), stated
    if law.x_name == "overclosure":
        found = one.at_gap(np.maximum(one.law_in_si.h_max - x, 0.0))
        return np.asarray(found.pressure), floor, stated
    known = np.full(x.size, np.nan)
    # no spots conduct at pressure zero; of the gas there are other rows
    pressed = x > 0
    found = one.at_pressure(x[pressed])
    known[pressed] = QUANTITIES.get(name, _by_name(name))(one, found)
    return known, floor if name == law.y_name else 0.0, stated


def _by_name(name: str) -> Callable[[Case, Any], FloatArray]:
    def asked(one: Case, found: Any) -> FloatArray:
        quantity = in_files()[name].name if name in in_files() else name
        return np.asarray(found.quantity(quantity), dtype=float)

    return asked


def _derivative(one: Case, found: Any) -> FloatArray:
    """Of the hydraulic aperture by the gap, by differences."""
    u = np.asarray(found.mean_separation)
    step = 1e-5 * one.law_in_si.h_max
    ends = [one.at_gap(u + side).quantity("hydraulic_aperture") for side in (step, -step)]
    return np.asarray((ends[0] - ends[1]) / (2 * step))


QUANTITIES: Mapping[str, Callable[[Case, Any], FloatArray]] = {
    "aperture": lambda one, found: np.asarray(found.mean_separation),
    "derivative": _derivative,
}


def _of_film(one: Case, name: str, u: FloatArray) -> tuple[FloatArray, float]:
    """A column of a film at mean separations, and the floor of its errors."""
    found = flow_factors(
        one.law_in_si.surface, u, one.bodies, peklenik=2.0, theory=one.theory
    )
    if name == "stiffness":
        return np.asarray(one.at_gap(u).unloading_stiffness), 0.0
    value = np.array(getattr(found, name), dtype=float)
    floor = one.least if name == "pressure" else 0.0
    return value, floor


def kinds_of(target: str) -> tuple[str, ...]:
    """Kinds of laws that a target can be of."""
    if target in targets("CODE"):
        return ("joint", "mbma")
    language = LANGUAGES.get(target)
    if language is not None and language.conductance_alone:
        # conductance as a function of the gap jumps at the largest pressure
        return KINDS[:-1]
    return KINDS


def in_code(one: Case, target: str, folder: pathlib.Path) -> Found:
    """Functions of code, run by the program of its language, beside the library's law."""
    program = LANGUAGES[target].program
    options: dict[str, Any] = {"name": "road", "path": folder / f"road{program.end}"}
    if "leakage" in targets()[target].takes and one.kind != "unloading":
        options["leakage"] = True
    one.export(target, **options)
    text = (folder / f"road{program.end}").read_text()
    law = one.law_of_user
    c, d = _overclosures(law, one.kind)
    names = [*OF_LAWS]
    for name in FURTHER:
        # the core, which files have, knows leakage
        is_there = re.search(rf"\b(road_)?{name}\b", text)
        if options.get(name, is_there and name != "leakage"):
            names.append(name)
    answers = dict(zip(names, run(program, names, c, folder), strict=True))
    return of_functions(one, law, c, d, answers, text)


def _overclosures(law: ContactLaw, kind: str) -> tuple[FloatArray, FloatArray]:
    """Overclosures up to full contact or to where leakage ends, and their separations, without rounding."""
    most = law.h_max - max(law.lowest, law.turning_point or -math.inf)
    if kind != "unloading" and law.leakage.blocked_at > -math.inf:
        most = min(most, 2 * (law.h_max - law.leakage.blocked_at))
    # separations are doubles, and so are their halves
    d = law.h_max - most * np.geomspace(1e-4, 0.98, POINTS)
    c = (law.h_max - d) / 2
    return c, d


def run(
    program: Program,
    names: list[str],
    c: FloatArray,
    folder: pathlib.Path,
    laws: Sequence[str] = ("road",),
) -> FloatArray:
    """What the program of a language answers, a row for each function of each law."""
    (folder / program.file).write_text(program.written(laws, names))
    np.savetxt(folder / "c.txt", c, "%.17g")
    for command in program.built(laws):
        words = command.replace("python ", f"{sys.executable} ").split()
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return np.loadtxt(folder / "values.txt", ndmin=2).T


def stated(text: str, name: str) -> float:
    """The largest relative error of a function, as the header states it; roundings of one that it does not name."""
    words = " ".join(text.replace("#", " ").replace("!", " ").replace("%", " ").split())
    words = words.replace(" * ", " ").replace(" // ", " ")
    # the solid spots' part of the total is that of the law
    named = {"leakage": "K", "total_conductance": "gas_conductance"}.get(name, name)
    found = re.search(rf"\b{named} is within (\S+) of", words)
    return float(found[1]) if found else SLOPES


def of_functions(
    one: Case,
    law: ContactLaw,
    c: FloatArray,
    d: FloatArray,
    answers: Mapping[str, FloatArray],
    text: str,
) -> Found:
    """Answers of functions beside those of the law in the same units."""
    of_law = law.values(separation=d)
    found = NOTHING
    scales = {"tangent": np.maximum(np.abs(of_law.stiffness), 1e-2 * of_law.pressure / c)}
    for name, value in answers.items():
        if name in OF_LAWS:
            known = np.asarray(getattr(of_law, {"tangent": "stiffness"}.get(name, name)))
            allowed = SLOPES if name == "tangent" else VALUES
        else:
            known = _further(one, law, d, name)
            allowed = stated(text, name)
        scale = scales.get(name, np.abs(known))
        error = float((np.abs(value - known)[scale > 0] / scale[scale > 0]).max())
        found = found.or_larger(Found(error, error / allowed))
    return found


def _further(one: Case, law: ContactLaw, d: FloatArray, name: str) -> FloatArray:
    """A quantity besides those of every law, in the units of the file."""
    if name == "leakage":
        return np.asarray(law.leakage(separation=d))
    value = np.asarray(law.at(separation=d).quantity(name), dtype=float)
    if "conductance" in name:
        # contacts have it in W/(m^2 K) in any units
        return value / one.size(name)
    return value


def in_fmu(one: Case, target: str, folder: pathlib.Path) -> Found:
    """Outputs of an FMU, simulated by FMPy, beside the library's law."""
    import fmpy

    path = folder / "road.fmu"
    options = {} if one.kind == "unloading" else {"leakage": True}
    one.export(target, name="road", path=path, **options)
    description = fmpy.read_model_description(str(path))
    outputs = [each.name for each in description.modelVariables]
    names = [name for name in (*OF_LAWS, *FURTHER) if name in outputs]
    law = one.law_of_user
    c, d = _overclosures(law, one.kind)
    times = np.arange(c.size + 1.0)
    columns = [("time", float), ("overclosure", float)]
    given = np.array([*zip(times, np.append(c, c[-1]), strict=True)], columns)
    simulated = fmpy.simulate_fmu(
        str(path),
        fmi_type="ModelExchange",
        input=given,
        output=["overclosure", *names],
        stop_time=times[-1],
        solver="Euler",
        step_size=1.0,
        output_interval=1.0,
    )[: c.size]
    assert (simulated["overclosure"] == c).all()
    answers = {name: np.asarray(simulated[name]) for name in names}
    return of_functions(one, law, c, d, answers, description.description)


class _Surface(ctypes.Structure):
    _fields_ = tuple(
        (name, ctypes.c_double) for name in ("hurst", "q0", "q1", "h_rms", "h_max")
    )


class _Contact(ctypes.Structure):
    _fields_ = tuple(
        (name, ctypes.c_double) for name in ("force", "area", "stiffness", "error")
    )


@functools.cache
def _package() -> Any:
    """The whole model in C, compiled once, with the optimizer's freedom of any user."""
    with tempfile.TemporaryDirectory() as work:
        folder = pathlib.Path(work)
        write_code(folder)
        sources = [name for name in SOURCES if name != "mbma_selftest.c"]
        command = ["cc", "-std=c11", "-O2", "-shared", "-fPIC", *sources, "-lm"]
        subprocess.run([*command, "-o", "model.so"], cwd=folder, check=True)
        library = ctypes.CDLL(str(folder / "model.so"))
    for name in ("mbma_total_of", "mbma_calibrated_of"):
        getattr(library, name).restype = ctypes.c_int
    return library


def in_package(one: Case, target: str, folder: pathlib.Path) -> Found:
    """Contacts by the package of C, of MBMA and of the calibrated law, beside the library's."""
    surface = one.law_of_user.surface
    numbers = (float(getattr(surface, name)) for name, _ in _Surface._fields_)
    of_c = _Surface(*numbers)
    modulus = float(one.law_of_user.E_star)
    _, d = _overclosures(one.law_of_user, one.kind)
    answers = []
    bounds = []
    for separation in d:
        found = _Contact()
        if one.theory == "mbma":
            rest = (ctypes.c_double(separation), ctypes.c_double(modulus))
            status = _package().mbma_total_of(
                ctypes.byref(of_c), *rest, ctypes.c_double(RTOL), ctypes.byref(found)
            )
        else:
            u = (float(surface.h_max) + separation) / 2
            rest = (ctypes.c_double(u), ctypes.c_double(modulus))
            status = _package().mbma_calibrated_of(
                ctypes.byref(of_c), *rest, ctypes.byref(found)
            )
        assert status == 0
        answers.append((found.force, found.area, found.stiffness))
        bounds.append(found.error)
    theory = Mbma(rtol=RTOL) if one.theory == "mbma" else one.theory
    known = contact(surface, modulus, separation=d, theory=theory)
    expected = np.stack([known.pressure, known.area, known.stiffness], axis=-1)
    errors = np.abs(np.array(answers) / expected - 1).max(axis=1)
    # C states the error of each answer
    return Found(float(errors.max()), float((errors / bounds).max()))


# by group of targets that are no rows
RUNS: Mapping[str, Callable[[Case, str, pathlib.Path], Found]] = {
    "LAWS": in_code,
    "FMUS": in_fmu,
    "CODE": in_package,
}


def of_code() -> dict[str, Callable[[Case, str, pathlib.Path], Found]]:
    """How each target that is no rows is run."""
    found = {}
    for group, run_it in RUNS.items():
        for name in targets(group):
            found[name] = run_it
    return found


@dataclasses.dataclass
class Measured:
    """What was measured of a target."""

    laws: int = 0
    found: Found = NOTHING


def measured(
    numbers: range,
    results: dict[str, Measured],
    write: Callable[[Mapping[str, Measured]], None],
) -> None:
    """Measure laws and add to the results by target, which `write` is given after every tenth law.

    Every law is written as rows of one quantity for all programs that take it, and as code
    of one target, both in turns. Laws that do not converge are refused by every target.
    """
    for number in numbers:
        try:
            of_targets = [*of_one_law(number)]
        except ConvergenceError as fault:
            click.echo(f"law {number} is refused: {fault}")
            continue
        for name, found in of_targets:
            if found.share > 1:
                click.echo(f"{name}, law {number}: {found}")
            so_far = results.setdefault(name, Measured())
            so_far.laws += 1
            so_far.found = so_far.found.or_larger(found)
        if number % 10 == 9 or number == numbers[-1]:
            write(results)


def of_one_law(number: int) -> Iterator[tuple[str, Found]]:
    """A law of a number in a target of code, and in all programs that take rows of it."""
    programs = of_code()
    name = list(programs)[number % len(programs)]
    kinds = kinds_of(name)
    turn = number // len(programs)
    one = case(number, kinds[turn % len(kinds)])
    if name not in SLOW or turn % SLOW_TURNS == 0:
        with tempfile.TemporaryDirectory() as folder:
            yield name, programs[name](one, name, pathlib.Path(folder))
    names = list(quantities(one))
    law = rows(one, names[(number + turn // len(kinds)) % len(names)])
    for target in targets("SOLVERS", "DATA").values():
        of_rows = in_rows(one, target, law)
        if of_rows is not None:
            yield target.name, of_rows


# commands that say the version of a program, by the first word of the commands that run it
VERSIONS = {
    "gcc": ("gcc", "-dumpfullversion"),
    "gfortran": ("gfortran", "-dumpfullversion"),
    "node": ("node", "--version"),
    "octave-cli": ("octave-cli", "--version"),
    "octave": ("octave", "--version"),
}
# packages that read rows or run code, by target
PACKAGES = {
    "json": "",
    "netcdf": "netCDF4",
    "hdf5": "netCDF4",
    "parquet": "pyarrow",
    "xlsx": "openpyxl",
    "matlab": "scipy",
    "python-law": "numpy",
    "jax-law": "jax",
    "modelica-law": "rumoca",
    "fmu": "fmpy",
    "fmu3": "fmpy",
}
OWN_READER = "the library's reader"


def program_of(name: str) -> str:
    """The program that ran or read a target, with its version on this machine."""
    if name in PACKAGES:
        package = PACKAGES[name]
        if not package:
            return f"json of Python {platform.python_version()}"
        return f"{package} {importlib.metadata.version(package)}"
    if name in targets("SOLVERS", "DATA"):
        return OWN_READER
    used = ["gcc"]
    if name in LANGUAGES:
        used = [command.split()[0] for command in LANGUAGES[name].program.commands]
    said = []
    for word in dict.fromkeys(used):
        if word in VERSIONS:
            done = subprocess.run(VERSIONS[word], capture_output=True, text=True)
            number = re.search(r"\d+(\.\d+)+", done.stdout)
            assert number is not None, done.stdout
            said.append(f"{word} {number[0]}")
    return ", ".join(said)


def write_csv(results: Mapping[str, Measured]) -> None:
    """Write measurements to the file from which docs/export.md has its table."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(("target", "program", "laws", "error", "share", "date"))
    today = datetime.date.today().isoformat()
    for name in targets():
        if name in results:
            one = results[name]
            numbers = (f"{value:.1e}" for value in one.found)
            writer.writerow((name, program_of(name), one.laws, *numbers, today))
    write_file(MEASURED, stream.getvalue().encode())


def read_csv() -> dict[str, Measured]:
    """Measurements of the file, to which more laws are added."""
    results = {}
    with MEASURED.open(encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            found = Found(float(row["error"]), float(row["share"]))
            results[row["target"]] = Measured(int(row["laws"]), found)
    return results


@click.command("exports")
@click.option("--laws", type=int, default=1000, show_default=True, help="How many.")
@click.option("--first", type=int, default=0, help="Go on with this one.")
@click.option("--write", is_flag=True, help="Put the table into docs/export.md.")
def exports_command(laws: int, first: int, write: bool) -> None:
    """Random laws in every target of exports beside the library (an hour)."""

    def keep(results: Mapping[str, Measured]) -> None:
        if write:
            write_csv(results)

    results = read_csv() if first else {}
    measured(range(first, laws), results, keep)
    for name, one in results.items():
        click.echo(
            f"{name}: {one.laws} laws, error {one.found.error:.1e}, "
            f"of the stated one {one.found.share:.2f}"
        )
    if write:
        page.write("docs/export.md", formats()[0], {}, ROOT)
