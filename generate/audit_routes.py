"""One question asked by every route: contact, law, joint, table, command line, exported C.

A joint with one rough face answers at a few pressures; each other route is asked the same, and its
difference is divided by what is allowed: rounding for routes that calculate alike, and for laws and
their C the `error` that they state, of slopes the `slope_error`.
"""

import ctypes
import json
import pathlib
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np
from click.testing import CliRunner

from mbma_tables import Bodies, ContactLaw, Joint, contact
from mbma_tables.cli import main
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.materials import METALS

THEORIES = ("mbma", "calibrated", "persson")
# relative: numbers pass through decimals, powers of ten of units and an inversion
ROUNDED = 1e-12
# pressures over the smaller of the hardness and a quarter of E* times the rms gradient
LIGHT = 1e-3
HEAVY = 0.3
PRESSURES = 5
QUANTITIES = (
    "area",
    "mean_separation",
    "stiffness",
    "unloading_stiffness",
    "solid_conductance",
)


class Question:
    """A joint with one rough face, drawn at random, and its contact at some pressures [GPa]."""

    def __init__(self, rng: np.random.Generator) -> None:
        longest = 10 ** rng.uniform(1.0, 3.0)
        self.face: dict[str, Any] = {
            "Rq": f"{longest * 10 ** rng.uniform(-3.5, -2.5)!r} um",
            "hurst": rng.uniform(0.3, 1.0),
            "longest": f"{longest!r} um",
            "shortest": f"{longest / 10 ** rng.uniform(0.7, 2.5)!r} um",
        }
        side = longest * 10 ** rng.uniform(1.0, 2.0)
        self.nominal_area = f"{side**2!r} um^2"
        self.materials = [
            f"{METALS[number]} hard" for number in rng.integers(len(METALS), size=2)
        ]
        self.theory = THEORIES[rng.integers(len(THEORIES))]
        self.joint = Joint(
            self.face,
            bodies=self.materials,
            gas="vacuum",
            nominal_area=self.nominal_area,
            theory=self.theory,
        )
        self.surface: Any = self.joint.surface
        # "57.5 GPa"
        self.E_star, self.hardness = (
            str(self.joint.bodies.E_star),
            str(self.joint.bodies.hardness),
        )
        flat = float(self.E_star.split()[0]) * float(self.surface.rms_gradient) / 4
        largest = min(flat, float(self.hardness.split()[0]))
        self.pressures = largest * np.geomspace(LIGHT, HEAVY, PRESSURES)
        self.answer = self.joint.at_pressure(self.pressures)

    def __repr__(self) -> str:
        pressures = f"{self.pressures[0]!r} to {self.pressures[-1]!r} GPa"
        return f"{self.face}, {self.nominal_area}, {self.materials}, {self.theory}, {pressures}"

    def values_of(self, found: Any) -> dict[str, FloatArray]:
        """The quantities of a contact."""
        values = {name: np.asarray(getattr(found, name)) for name in QUANTITIES[:-1]}
        values["solid_conductance"] = np.asarray(found.solid_conductance)
        return values

    def misses(self, values: dict[str, Any]) -> list[FloatArray]:
        """Differences from the joint's contact over what rounding allows."""
        expected = self.values_of(self.answer)
        return [
            np.abs(np.asarray(values[name], float) / expected[name] - 1) / ROUNDED
            for name in values
        ]


def by_contact(question: Question) -> list[FloatArray]:
    """`contact` of the surface and the metals."""
    found = contact(
        question.surface,
        tuple(question.materials),
        pressure=question.pressures,
        theory=question.theory,
    )
    return question.misses(question.values_of(found))


def by_texts(question: Question) -> list[FloatArray]:
    """Pressures as texts with another unit, one by one, and the hardness and modulus as numbers."""
    answers: dict[str, list[float]] = {name: [] for name in QUANTITIES[:-1]}
    for pressure in question.pressures.tolist():
        found = contact(
            question.surface,
            Bodies(question.E_star, hardness=question.hardness),
            pressure=f"{pressure * 1e3!r} MPa",
            theory=question.theory,
        )
        for name, values in answers.items():
            values.append(float(getattr(found, name)))
    return question.misses(answers)


def by_table(question: Question) -> list[FloatArray]:
    """`Joint.table`."""
    table = question.joint.table(question.pressures)
    return question.misses({name: table[name].values for name in QUANTITIES})


def command(*words: str) -> dict[str, Any]:
    """The columns that a command of `mbma` prints as JSON; its errors are those of the library."""
    ran = CliRunner().invoke(main, [*words, "--json"])
    if ran.exit_code:
        raise MbmaError(ran.stderr)
    columns: dict[str, Any] = json.loads(ran.stdout)["columns"]
    return columns


def by_joint_command(question: Question) -> list[FloatArray]:
    """`mbma joint FILE --json`."""
    face = "".join(
        f"{name} = {json.dumps(value)}\n" for name, value in question.face.items()
    )
    text = (
        f"bodies = {json.dumps(question.materials)}\n"
        f"nominal_area = {json.dumps(question.nominal_area)}\n"
        f'theory = "{question.theory}"\ngas = "vacuum"\n[part_a]\n{face}'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "joint.toml")
        path.write_text(text, encoding="utf-8")
        pressures = ",".join(
            f"{pressure!r}GPa" for pressure in question.pressures.tolist()
        )
        columns = command("joint", str(path), "--pressure", pressures)
    return question.misses({name: columns[name] for name in QUANTITIES})


def by_contact_command(question: Question) -> list[FloatArray]:
    """`mbma contact --json`, the surface by its five numbers, in mm and MPa."""
    surface = question.surface.to("mm")
    words = [
        "contact",
        "--theory",
        question.theory,
        "--length-unit",
        "mm",
        "--stress-unit",
        "MPa",
    ]
    words += ["--E-star", question.E_star, "--hardness", question.hardness]
    for name in ("hurst", "q0", "q1", "h_rms", "h_max"):
        words += [f"--{name.replace('_', '-')}", repr(float(getattr(surface, name)))]
    pressures = ",".join(f"{pressure!r}GPa" for pressure in question.pressures.tolist())
    columns = command(*words, "--pressure", pressures)
    to_um = np.array(columns["mean_separation"]) * 1e3
    # GPa/um is 1e6 MPa/mm
    stiffness = np.array(columns["stiffness"]) / 1e6
    unloading = np.array(columns["unloading_stiffness"]) / 1e6
    return question.misses(
        {
            "area": columns["area"],
            "mean_separation": to_um,
            "stiffness": stiffness,
            "unloading_stiffness": unloading,
        }
    )


def law_misses(
    question: Question, law: ContactLaw, values: dict[str, Any]
) -> list[FloatArray]:
    """Differences of a law's values at the contact's own gaps, over the errors that both state."""
    expected = question.values_of(question.answer) | {"pressure": question.pressures}
    gaps = np.asarray(question.answer.mean_separation)
    # conductances are unloading stiffnesses, which are slopes of the elastic law at the same gap
    elastic, _ = law.unloading()
    stated = {
        "stiffness": np.asarray(law.slope_error(gaps)),
        "solid_conductance": np.asarray(elastic.slope_error(gaps)),
    }
    misses = []
    for name, found in values.items():
        allowed = (
            stated.get(name, law.error) + np.asarray(question.answer.error) + ROUNDED
        )
        misses.append(np.abs(np.asarray(found, float) / expected[name] - 1) / allowed)
    return misses


def by_law(question: Question) -> list[FloatArray]:
    """`Joint.law` at the gaps of the contact, and the gaps that it gives for the pressures."""
    law = question.joint.law()
    answer = question.answer
    gaps = np.asarray(answer.mean_separation)
    values = {
        "pressure": law.pressure(gaps),
        "area": law.area(gaps),
        "stiffness": law.stiffness(gaps),
    }
    misses = law_misses(question, law, values)
    # an error of the pressure moves the gap by as much over the slope
    by_pressure = np.asarray(law.at_pressure(question.pressures).mean_separation)
    allowed = (
        law.error + answer.error
    ) * question.pressures / answer.stiffness + ROUNDED * gaps
    return [*misses, np.abs(by_pressure - gaps) / allowed]


def by_c(question: Question) -> list[FloatArray]:
    """The C of `Joint.export`, compiled, in mm and MPa."""
    law = question.joint.law()
    answer = question.answer
    gaps = np.asarray(answer.mean_separation)
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder, "joint.c")
        library = pathlib.Path(folder, "joint.so")
        source.write_text(
            str(question.joint.export("c-law", name="joint")), encoding="utf-8"
        )
        line = ["cc", "-O1", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"]
        subprocess.run(line, check=True, capture_output=True)
        compiled = ctypes.CDLL(str(library))

        def values_of(name: str) -> FloatArray:
            function = compiled[f"joint_{name}"]
            function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
            overclosures = (float(question.surface.h_max) - gaps) / 1e3
            return np.array(
                [function(overclosure) for overclosure in overclosures.tolist()]
            )

        values = {
            "pressure": values_of("pressure") / 1e3,
            "area": values_of("area"),
            "stiffness": values_of("tangent") / 1e6,
            # mW/(mm K) per mm^2 is 1000 W/(m^2 K)
            "solid_conductance": values_of("conductance") * 1e3,
        }
    return law_misses(question, law, values)


ROUTES: dict[str, Callable[[Question], list[FloatArray]]] = {
    "contact": by_contact,
    "texts, one by one": by_texts,
    "table": by_table,
    "`mbma joint`": by_joint_command,
    "`mbma contact`": by_contact_command,
    "law": by_law,
    "exported C": by_c,
}


def routes_here() -> dict[str, Callable[[Question], list[FloatArray]]]:
    """All routes, but C where there is no compiler."""
    return {
        name: route
        for name, route in ROUTES.items()
        if route is not by_c or shutil.which("cc")
    }
