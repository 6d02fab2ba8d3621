"""One question asked by every route: contact, law, joint, table, commands, files and exported C.

A question is a joint and its pressures, drawn at random. The answer of reference is that of
`contact` with modulus, hardness and pressures in GPa. Each route is asked the same in its own
way; differences of values are divided by what is allowed, which is rounding for routes that
calculate alike, and the stated errors for laws and their exports. `valid`, the model
uncertainties and the reasons are compared too: they are equal, or counted as a difference.
"""

import contextlib
import csv
import ctypes
import dataclasses
import functools
import json
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from click.testing import CliRunner

from mbma_tables import Bodies, Joint, contact
from mbma_tables.bodies.materials import METALS
from mbma_tables.cli import main
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, MbmaError
from mbma_tables.theories import Mbma

# relative: numbers pass through decimals, powers of ten of units and an inversion
ROUNDED = 1e-12
# relative, of uncertainties at the areas of a law, which differ by its error
SCATTER_OF_LAW = 1e-3
PRESSURES = 5
# in the forms in which people give a theory: a name, options, nothing
THEORIES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "calibrated": ("calibrated", ("--theory", "calibrated")),
    "persson": ("persson", ("--theory", "persson")),
    "mbma": ("mbma", ("--theory", "mbma")),
    "greenwood_williamson": (
        "greenwood_williamson",
        ("--theory", "greenwood_williamson"),
    ),
    "by default": (None, ()),
    "mbma, printed": (Mbma(variant="printed"), ("--variant", "printed")),
    "mbma, rtol 1e-5": (Mbma(rtol=1e-5), ("--rtol", "1e-5")),
    "mbma, exact outside": (Mbma(outside="exact"), ()),
}
# forms of the bodies; "untempered" names metals without the hardness that they have
FORMS = ("elastic", "hardness", "metals", "untempered")

Misses = dict[str, FloatArray]


@dataclasses.dataclass(frozen=True)
class Question:
    """A joint as it is typed, and the pressures [GPa] at which it is asked for."""

    parts: tuple[dict[str, Any], ...]
    nominal_area: str
    form: str
    metals: tuple[str, str]
    E_star: float  # GPa, of forms without metals
    hardness: float  # GPa, of form "hardness"
    theory_name: str
    loads: tuple[float, ...]  # pressures over the largest of `_largest`

    @classmethod
    def random(cls, rng: np.random.Generator) -> "Question":
        """A question of random numbers."""
        longest = 10 ** rng.uniform(1.0, 3.0)
        ratio = 10 ** rng.uniform(0.7, 2.5)
        parts = []
        for _ in range(rng.integers(1, 3)):
            height = longest * 10 ** rng.uniform(-3.5, -2.5)
            parts.append(
                {
                    "Rq": f"{height!r} um",
                    "hurst": rng.uniform(0.15, 1.0),
                    "longest": f"{longest!r} um",
                    "shortest": f"{longest / ratio!r} um",
                }
            )
        side = longest * 10 ** rng.uniform(0.3, 2.0)
        form = FORMS[rng.integers(len(FORMS))]
        temper = " hard" if form == "metals" else ""
        chosen = [list(METALS)[number] for number in rng.integers(len(METALS), size=2)]
        first, second = (f"{name}{temper}" for name in chosen)
        E_star = 10 ** rng.uniform(-2, 2.5)
        return cls(
            parts=tuple(parts),
            nominal_area=f"{side**2!r} um^2",
            form=form,
            metals=(first, second),
            E_star=E_star,
            hardness=E_star * 10 ** rng.uniform(-3, -0.5),
            theory_name=list(THEORIES)[rng.integers(len(THEORIES))],
            loads=tuple(np.sort(10 ** rng.uniform(-3, -0.3, PRESSURES)).tolist()),
        )

    @property
    def named(self) -> bool:
        """Whether the bodies are metals by name."""
        return self.form in ("metals", "untempered")

    @property
    def theory(self) -> Any:
        """The theory as Python takes it."""
        return THEORIES[self.theory_name][0]

    @property
    def bodies(self) -> Any:
        """The bodies as they are given to `contact` for the answer of reference."""
        if self.named:
            return self.metals
        conductivity = "40 W/(m K)"
        hardness = f"{self.hardness!r} GPa" if self.form == "hardness" else None
        return Bodies(
            f"{self.E_star!r} GPa", hardness=hardness, nu=0.3, conductivity=conductivity
        )

    def joint(self, bodies: Any) -> Joint:
        """The joint of these parts with its bodies in one of their spellings."""
        return Joint(
            *self.parts, bodies=bodies, nominal_area=self.nominal_area, theory=self.theory
        )

    def spellings(self) -> Iterator[tuple[str, Any]]:
        """The same bodies in other words, as a joint takes them; a plain modulus is in GPa."""
        given = Bodies.of(self.bodies)
        if self.named:
            yield "a list of metals", list(self.metals)
            yield "Bodies of metals", Bodies(metals=self.metals)
            return
        hardness = None if given.hardness is None else f"{self.hardness * 1e3!r} MPa"
        others = {"nu": given.nu, "conductivity": given.conductivity}
        yield "a number", Bodies(self.E_star, hardness=hardness, **others)
        in_MPa = f"{self.E_star * 1e3!r} MPa"
        yield "a text in MPa", Bodies(in_MPa, hardness=hardness, **others)
        yield "a mapping", {"E_star": in_MPa, "hardness": hardness, **others}


def _pressures(question: Question, surface: Any) -> FloatArray:
    """The pressures [GPa]: up to half of the hardness, or of the mean pressure in light contact."""
    in_units = Bodies.of(question.bodies).in_units(surface, "GPa")
    flat = float(in_units.E_star) * float(surface.rms_gradient) / 4
    return min(flat, float(in_units.hardness)) * np.array(question.loads)


def refusals(question: Question) -> FloatArray:
    """Infinite for each route that answers a question which the joint refuses, or refuses it otherwise."""
    joint = question.joint(question.bodies)
    texts = Reference.texts("GPa", _pressures(question, joint.surface))
    routes: tuple[Callable[[], Any], ...] = (
        lambda: joint.at_pressure(texts),
        lambda: contact(
            joint.surface, question.bodies, pressure=texts, theory=question.theory
        ),
        lambda: joint.law().at(pressure=texts),
        lambda: joint.table(texts),
    )
    kinds = []
    for route in routes:
        try:
            route()
            kinds.append("answered")
        except MbmaError as fault:
            kinds.append(type(fault).__name__)
    return np.array([0.0 if kind == kinds[0] else np.inf for kind in kinds])


class Reference:
    """The answer of `contact`, and what else is asked about the same joint."""

    def __init__(self, question: Question) -> None:
        self.question = question
        self.joint = question.joint(question.bodies)
        self.surface: Any = self.joint.surface
        self.pressures = _pressures(question, self.surface)
        self.answer = self.joint.at_pressure(self.texts("GPa", self.pressures))
        self.names = [
            name
            for name in self.answer.available()
            if np.asarray(self.answer.quantity(name)).dtype.kind == "f"
        ]

    @staticmethod
    def texts(unit: str, numbers: Any, factor: float = 1.0) -> list[str]:
        """Numbers as texts with their unit."""
        return [f"{number * factor!r} {unit}" for number in np.asarray(numbers).tolist()]

    @functools.cached_property
    def law(self) -> Any:
        """The joint's law; None where its polynomials do not converge, which is an error of laws alone."""
        try:
            return self.joint.law()
        except ConvergenceError:
            return None

    def ratios(self, values: Mapping[str, Any], rtol: float = ROUNDED) -> Misses:
        """Differences from the answer over what is allowed, by name of the quantity."""
        allowed = {}
        for name in values:
            allowed[name] = np.full(np.shape(self.answer.quantity(name)), rtol)
        return self.ratios_to(values, allowed)

    def ratios_to(self, values: Mapping[str, Any], allowed: Mapping[str, Any]) -> Misses:
        """The same with tolerances of each quantity; NaN stands for what is not known."""
        found = {}
        for name, value in values.items():
            expected = np.asarray(self.answer.quantity(name), float)
            given = np.asarray(value, float)
            if given.shape != expected.shape:
                found[name] = np.array([np.inf])
                continue
            scale = np.abs(expected)
            if name.endswith("separation"):
                # gaps are measured from first contact, where d changes its sign
                scale = np.full(expected.shape, float(self.surface.h_max))
            with np.errstate(all="ignore"):
                ratio = np.abs(given - expected) / (allowed[name] * scale)
            same = (given == expected) | (np.isnan(given) & np.isnan(expected))
            found[name] = np.where(same, 0.0, np.where(np.isnan(ratio), np.inf, ratio))
        return found

    def statements(
        self, valid: Any, reasons: Any = None, error: FloatArray | None = None
    ) -> Misses:
        """Infinite where `valid` or the reasons differ, else 0.

        With the relative `error` of a law, what is stated at pressures that differ by twice
        as much counts too: at the end of a tested range either side is right.
        """
        answers = [self.answer]
        if error is not None:
            for shift in (-2 * error, 2 * error):
                texts = self.texts("GPa", self.pressures * (1 + shift))
                # the theory may end at the pressures themselves
                with contextlib.suppress(MbmaError):
                    answers.append(self.joint.at_pressure(texts))
        differs = np.all([np.asarray(valid) != each.valid for each in answers], axis=0)
        found = {"valid": np.where(differs, np.inf, 0.0)}
        if reasons is not None:
            stated = [set(each.reasons) for each in answers]
            least = set.intersection(*stated)
            most = set.union(*stated)
            same = least <= set(reasons) <= most
            found["reasons"] = np.array([0.0 if same else np.inf])
        return found

    def all_of(self, pressed: Any, rtol: float = ROUNDED) -> Misses:
        """Every quantity, `valid` and the reasons of a contact that calculates alike."""
        values = {name: pressed.quantity(name) for name in self.names}
        return self.ratios(values, rtol) | self.statements(pressed.valid, pressed.reasons)


def by_contact(reference: Reference) -> Misses:
    """`contact` of the joint's surface, where no gas and no friction is given."""
    question = reference.question
    texts = reference.texts("MPa", reference.pressures, 1e3)
    pressed = contact(
        reference.surface, question.bodies, pressure=texts, theory=question.theory
    )
    names = [name for name in reference.names if name in pressed.available()]
    values = {name: pressed.quantity(name) for name in names}
    found = reference.ratios(values)
    return found | reference.statements(pressed.valid, pressed.reasons)


def by_number(reference: Reference) -> Misses:
    """`contact` one pressure at a time, as plain numbers in GPa."""
    question = reference.question
    names = ("area", "mean_separation", "stiffness", "unloading_stiffness", "scatter")
    values: dict[str, list[float]] = {name: [] for name in names}
    valid = []
    for pressure in reference.pressures.tolist():
        pressed = contact(
            reference.surface,
            question.bodies,
            pressure=f"{pressure!r} GPa",
            theory=question.theory,
        )
        valid.append(bool(pressed.valid))
        for name in names:
            values[name].append(float(pressed.quantity(name)))
    return reference.ratios(values) | reference.statements(valid)


def by_gap(reference: Reference) -> Misses:
    """`contact` at the gaps of the answer, in another unit."""
    question = reference.question
    gaps = np.asarray(reference.answer.mean_separation)
    pressed = contact(
        reference.surface,
        question.bodies,
        mean_separation=reference.texts("mm", gaps, 1e-3),
        theory=question.theory,
    )
    # the pressure at a gap changes by this much where the gap is rounded
    slope = reference.answer.stiffness * gaps / reference.answer.pressure
    allowed = 1e-12 * (1 + np.abs(slope))
    names = ("area", "pressure", "mean_separation")
    values = {name: pressed.quantity(name) for name in names}
    inverted = np.asarray(reference.answer.error)
    found = reference.ratios_to(values, dict.fromkeys(names, allowed + inverted))
    return found | reference.statements(pressed.valid, pressed.reasons)


def by_area(reference: Reference) -> Misses:
    """`contact` at the areas of the answer."""
    question = reference.question
    answer = reference.answer
    # an error of the area moves the pressure by as much times d ln p/d ln A
    nearby = reference.joint.at_pressure(
        reference.texts("GPa", reference.pressures, 1 + 1e-4)
    )
    with np.errstate(divide="ignore"):
        steepness = 1e-4 / np.log(nearby.area / answer.area)
    pressed = contact(
        reference.surface, question.bodies, area=answer.area, theory=question.theory
    )
    error = np.asarray(answer.error) + ROUNDED
    allowed = {"pressure": 2 * error * (1 + np.abs(steepness)), "area": 2 * error}
    values = {name: pressed.quantity(name) for name in allowed}
    found = reference.ratios_to(values, allowed)
    return found | reference.statements(pressed.valid, pressed.reasons)


def by_list(reference: Reference) -> Misses:
    """Lists of moduli and hardnesses without units, one of each pressure."""
    question = reference.question
    in_units = Bodies.of(question.bodies).in_units(reference.surface, "GPa")
    moduli = PRESSURES * [float(in_units.E_star)]
    bodies: Any = moduli
    if in_units.yields:
        bodies = Bodies(moduli, hardness=PRESSURES * [float(in_units.hardness)])
    pressed = contact(
        reference.surface,
        bodies,
        pressure=reference.pressures.tolist(),
        theory=question.theory,
    )
    names = ("area", "mean_separation", "stiffness", "unloading_stiffness", "scatter")
    return reference.ratios({name: pressed.quantity(name) for name in names}, 1e-11)


def by_spellings(reference: Reference) -> Misses:
    """Joints whose bodies are given in other words, at plain pressures."""
    found: Misses = {}
    for label, bodies in reference.question.spellings():
        joint = reference.question.joint(bodies)
        in_GPa = reference.texts("GPa", reference.pressures)
        pressed = joint.at_pressure(in_GPa)
        unit = pressed.units["pressure"]
        scale = {"GPa": 1.0, "MPa": 1e3}[unit]
        plain = joint.at_pressure(reference.pressures * scale)
        for route, answer in (("texts", pressed), ("numbers", plain)):
            values = {}
            for name in reference.names:
                same_unit = answer.units[name] == reference.answer.units[name]
                values[name] = answer.quantity(name) / (1.0 if same_unit else scale)
            misses = reference.ratios(values, 1e-11)
            misses |= reference.statements(answer.valid, answer.reasons)
            found |= {f"{label}, {route}: {name}": row for name, row in misses.items()}
    return found


def by_table(reference: Reference) -> Misses:
    """`Joint.table`."""
    table = reference.joint.table(reference.texts("GPa", reference.pressures))
    names = [name for name in reference.names if name in table]
    values = {
        name: np.broadcast_to(table[name].values, reference.pressures.shape)
        for name in names
        if np.ndim(reference.answer.quantity(name))
    }
    return reference.ratios(values) | reference.statements(table["valid"].values)


def by_law(reference: Reference) -> Misses:
    """The law of the joint at the answer's gaps and pressures, within its stated errors."""
    law = reference.law
    if law is None:
        return {}
    answer = reference.answer
    gaps = np.asarray(answer.mean_separation)
    found: Misses = {}
    error = law.error + np.asarray(answer.error) + ROUNDED
    slope = np.asarray(law.slope_error(gaps)) + np.asarray(answer.error) + ROUNDED
    elastic, _ = law.unloading()
    unloading = np.asarray(elastic.slope_error(gaps)) + np.asarray(answer.error) + ROUNDED
    allowed = {
        "pressure": error,
        "area": error,
        "stiffness": slope,
        "unloading_stiffness": unloading,
    }
    pressed = law.at(mean_separation=gaps)
    values = {name: pressed.quantity(name) for name in allowed}
    found |= reference.ratios_to(values, allowed)
    found |= reference.statements(pressed.valid, pressed.reasons, error)
    methods = {
        "pressure": law.pressure(gaps),
        "area": law.area(gaps),
        "stiffness": law.stiffness(gaps),
    }
    misses = reference.ratios_to(methods, allowed)
    found |= {f"method {name}": row for name, row in misses.items()}
    return found | _by_law_of_pressure(reference, law, error)


def _by_law_of_pressure(reference: Reference, law: Any, error: FloatArray) -> Misses:
    """The gaps and uncertainties that a law gives for the pressures."""
    answer = reference.answer
    pressed = law.at(pressure=reference.texts("GPa", reference.pressures))
    gaps = np.asarray(answer.mean_separation)
    # an error of the pressure moves the gap by as much over the slope
    h_max = float(reference.surface.h_max)
    moved = error * reference.pressures / np.asarray(answer.stiffness) / h_max
    found = reference.ratios_to(
        {"mean_separation": pressed.mean_separation},
        {"mean_separation": moved + ROUNDED * (1 + gaps / h_max)},
    )
    names = [name for name in reference.names if name.endswith("_scatter")]
    names = [name for name in names if "separation" not in name] + ["scatter"]
    found |= reference.ratios(
        {name: pressed.quantity(name) for name in names}, SCATTER_OF_LAW
    )
    misses = reference.statements(pressed.valid, pressed.reasons, error)
    return {f"law at pressures: {name}": row for name, row in (found | misses).items()}


def _text_of(question: Question) -> str:
    """The joint as a TOML file."""
    if question.named:
        bodies = json.dumps(question.metals)
    else:
        given = question.bodies
        entries = {"E_star": given.E_star, "hardness": given.hardness, "nu": given.nu}
        entries["conductivity"] = given.conductivity
        listed = [f"{name} = {json.dumps(v)}" for name, v in entries.items() if v]
        bodies = "{" + ", ".join(listed) + "}"
    lines = [f"bodies = {bodies}", f"nominal_area = {json.dumps(question.nominal_area)}"]
    if question.theory is not None:
        lines.append(f'theory = "{question.theory}"')
    for name, part in zip(("part_a", "part_b"), question.parts, strict=False):
        lines.append(f"[{name}]")
        lines += [f"{key} = {json.dumps(value)}" for key, value in part.items()]
    return "\n".join(lines) + "\n"


def _run(*words: str) -> str:
    """What a command of `mbma` prints; its errors are those of the library."""
    ran = CliRunner().invoke(main, list(words))
    if ran.exit_code:
        raise MbmaError(ran.stderr)
    return str(ran.stdout)


def _of_columns(reference: Reference, columns: Mapping[str, list[Any]]) -> Misses:
    """Columns of a command, in the units of the joint."""
    names = [name for name in reference.names if name in columns]
    values = {
        name: np.array(
            [np.nan if entry in (None, "") else float(entry) for entry in columns[name]]
        )
        for name in names
        if np.ndim(reference.answer.quantity(name))
    }
    valid = [entry == "yes" for entry in columns["valid"]]
    return reference.ratios(values, 1e-11) | reference.statements(valid)


def by_joint_command(reference: Reference) -> Misses:
    """`mbma joint FILE` as JSON and as CSV."""
    if not isinstance(reference.question.theory, str | None):
        return {}  # a file names a theory
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "joint.toml")
        path.write_text(_text_of(reference.question), encoding="utf-8")
        pressures = ",".join(reference.texts("GPa", reference.pressures))
        words = ("joint", str(path), "--pressure", pressures)
        answer = json.loads(_run(*words, "--json"))
        lines = _run(*words, "--csv").splitlines()
    found = _of_columns(reference, answer["columns"])
    found |= reference.statements(
        [entry == "yes" for entry in answer["columns"]["valid"]], answer["reasons"]
    )
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    misses = _of_columns(reference, columns)
    return found | {f"csv: {name}": row for name, row in misses.items()}


def by_contact_command(reference: Reference) -> Misses:
    """`mbma contact --json` of a surface by its five numbers, in mm and MPa."""
    question = reference.question
    options = THEORIES[question.theory_name][1]
    if (
        question.named
        or len(question.parts) > 1
        or bool(options) != bool(question.theory)
    ):
        return {}  # the command has no pairs, no combined surfaces, and not this theory
    words = ["contact", *options]
    words += ["--length-unit", "mm", "--stress-unit", "MPa"]
    words += ["--E-star", f"{question.E_star!r} GPa"]
    if question.form == "hardness":
        words += ["--hardness", f"{question.hardness!r} GPa"]
    for part, value in question.parts[0].items():
        words += [f"--{part}", str(value)]
    words += ["--nominal-area", question.nominal_area]
    words += ["--pressure", ",".join(reference.texts("GPa", reference.pressures))]
    answer = json.loads(_run(*words, "--json"))
    columns = answer["columns"]
    values = {
        "area": columns["area"],
        "mean_separation": np.array(columns["mean_separation"]) * 1e3,
    }
    for name in ("stiffness", "unloading_stiffness"):
        if name in columns:
            # MPa/mm is 1e-6 GPa/um
            values[name] = np.array(columns[name]) / 1e6
    found = reference.ratios(values, 1e-11)
    return found | reference.statements(answer["valid"], answer["reasons"])


def _refused_by(route: Callable[[], Any]) -> Misses:
    """Infinite unless a route refuses what has no law with the error of the law."""
    try:
        route()
    except ConvergenceError:
        return {"refusal": np.array([0.0])}
    return {"refusal": np.array([np.inf])}


def by_c(reference: Reference) -> Misses:
    """The C of `Joint.export`, compiled, in mm and MPa."""
    law = reference.law
    if law is None:
        return _refused_by(lambda: reference.joint.export("c-law", name="joint"))
    answer = reference.answer
    gaps = np.asarray(answer.mean_separation)
    overclosures = ((float(reference.surface.h_max) - gaps) / 1e3).tolist()
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder, "joint.c")
        library = pathlib.Path(folder, "joint.so")
        code = reference.joint.export("c-law", name="joint")
        source.write_text(str(code), encoding="utf-8")
        line = ["cc", "-O1", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"]
        subprocess.run(line, check=True, capture_output=True)
        compiled = ctypes.CDLL(str(library))

        def values_of(name: str) -> FloatArray:
            function = compiled[f"joint_{name}"]
            function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
            return np.array([function(overclosure) for overclosure in overclosures])

        values = {
            "pressure": values_of("pressure") / 1e3,
            "area": values_of("area"),
            "stiffness": values_of("tangent") / 1e6,
        }
    error = law.error + np.asarray(answer.error) + ROUNDED
    slope = np.asarray(law.slope_error(gaps)) + np.asarray(answer.error) + ROUNDED
    allowed = {"pressure": error, "area": error, "stiffness": slope}
    return reference.ratios_to(values, allowed)


def by_rows(reference: Reference) -> Misses:
    """Rows of a file of pressure against overclosure, within the error that the file states."""
    low, high = reference.texts("GPa", reference.pressures[[0, -1]])
    if low == high:
        return {}
    law = reference.law
    if law is None:
        return _refused_by(
            lambda: reference.joint.export("json", (low, high), heat=False)
        )
    text = reference.joint.export("json", (low, high), heat=False)
    content = json.loads(str(text))
    columns = [np.array(content["columns"][content[axis]]) for axis in ("x", "y")]
    overclosure, pressure = columns
    inside = (pressure > content["floor"]) & (overclosure > 0)
    u = float(reference.surface.h_max) - overclosure[inside] * 1e3
    question = reference.question
    # the file is of a law, whose error adds to that of the rows
    expected = np.asarray(
        contact(
            reference.surface, question.bodies, mean_separation=u, theory=question.theory
        ).pressure
    )
    allowed = law.error + content["largest_error"] + ROUNDED
    # rows have a limited number of digits
    ratio = np.abs(pressure[inside] / 1e3 / expected - 1) / allowed
    return {"rows": ratio}


ROUTES: dict[str, Callable[[Reference], Misses]] = {
    "contact": by_contact,
    "numbers, one by one": by_number,
    "gaps": by_gap,
    "areas": by_area,
    "lists": by_list,
    "other words": by_spellings,
    "table": by_table,
    "law": by_law,
    "`mbma joint`": by_joint_command,
    "`mbma contact`": by_contact_command,
    "rows": by_rows,
    "exported C": by_c,
}


def routes_here() -> dict[str, Callable[[Reference], Misses]]:
    """All routes, but C where there is no compiler."""
    return {
        name: route
        for name, route in ROUTES.items()
        if route is not by_c or shutil.which("cc")
    }
