"""docs/architecture.md says what is so: files, names, equations, the sequence of a call, and the core."""

import ast
import os
import pathlib
import re
import sys

import numpy as np
import pytest
from helpers import fresh

import mbma_tables
from generate.pages import ideas, library
from mbma_tables import Joint, Surface, contact, contact_law, core
from mbma_tables.contacts.result import Contact
from mbma_tables.core import GENERATIONS
from mbma_tables.theories import THEORIES, Mbma, resolve
from mbma_tables.theories.hardness import with_hardness
from mbma_tables.theories.mbma import sums

ROOT = pathlib.Path(__file__).parents[1]
PACKAGE = ROOT / "mbma_tables"
CORE = PACKAGE / "core"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
FACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")


def entered(request):
    """Files of the package that a request enters, in order, and its functions."""
    package = os.path.join(os.path.dirname(os.path.abspath(mbma_tables.__file__)), "")
    places = []

    def note(frame, event, _):
        name = frame.f_code.co_filename
        if event == "call" and name.startswith(package):
            file = pathlib.PurePath(name.removeprefix(package)).as_posix()
            places.append((file, frame.f_code.co_qualname))

    sys.setprofile(note)
    try:
        request()
    finally:
        sys.setprofile(None)
    files = list(dict.fromkeys(file for file, _ in places))
    return files, [function for _, function in places]


def test_every_name_on_the_page_is_in_the_code():
    """It named a class that was gone."""
    sources = [*ROOT.glob("*.toml"), ROOT / "setup.py"]
    for folder in (PACKAGE, ROOT / "generate"):
        sources += [
            path for path in folder.rglob("*") if path.suffix in (".py", ".c", ".h")
        ]
    words = set()
    for path in sources:
        words |= set(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    code = re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL))
    # neither commands nor files, which have tests of their own, but options of commands
    spans = [span for span in code if not re.search(r"^python -m|^mbma |^lint-|/", span)]
    assert len(spans) > 40
    missing = []
    for span in spans:
        if span.endswith("*"):  # the beginning of names
            continue
        names = re.findall(r"[A-Za-z_]\w{2,}", span.replace(".py", "").replace(".h", ""))
        missing += [name for name in names if name not in words]
    assert missing == []


def test_the_picture_has_every_room_with_its_subject():
    """It is stale where a room was added, or changed its subject."""
    picture = (ROOT / "docs" / "figures" / "architecture.svg").read_text(encoding="utf-8")
    drawn = re.findall(r"<!-- (.+?) +[\d,]+ -->", picture)
    texts = library.rooms()[1].values()
    subjects = [re.sub(r" +[\d,]+$", "", text) for text in texts]
    assert sorted(drawn) == sorted(subjects)


CITED = re.compile(r"(?:(?<=\s)|(?<=\[))\((\d+)[ab]?\)(?:\s*-\s*\((\d+)[ab]?\))?")
OF_EQUATIONS = re.compile(r"Eqs?\.\s*((?:\(?[\d]+[ab]?\)?(?:, and |, | and |-)?)+)")


def numbers(first, last):
    """Numbers of equations from one to another, or of one."""
    return set(range(int(first), int(last or first) + 1))


def cited(path):
    """Numbers of equations that a file cites."""
    text = path.read_text(encoding="utf-8")
    found = set()
    for first, last in CITED.findall(text):
        found |= numbers(first, last)
    for listed in OF_EQUATIONS.findall(text):
        for first, last in re.findall(r"\(?(\d+)[ab]?\)?(?:-\(?(\d+)[ab]?\)?)?", listed):
            found |= numbers(first, last)
    return found


def test_files_of_the_table_cite_its_equations():
    table = PAGE[PAGE.index("| step | where") :].splitlines()
    rows = [line for line in table if line.startswith("| ") and "---" not in line][1:]
    assert len(rows) > 12
    for row in rows:
        _, step, where, equations, _ = row.split("|")
        listed = set()
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", equations):
            listed |= numbers(first, last)
        found = set()
        folder = PACKAGE
        for name in re.findall(r"`([^`(]+\.[a-z]+)`", where):
            path = PACKAGE / name if "/" in name else folder / name
            folder = path.parent
            found |= cited(path)
        assert listed <= found, step


def test_a_call_goes_through_the_files_in_their_order():
    theory = Mbma(island_model="exact")
    # profiles of faces are kept: no other test asks about this one
    face = Surface(hurst=0.79, q0=0.011, q1=2.1, h_rms=1.0, h_max=3.0, unit="um")
    files, _ = entered(lambda: contact(face, separation=1.0, theory=theory))
    listed = []
    for line in PAGE.partition("```text\n")[2].partition("```")[0].splitlines():
        on_line = re.findall(r"[a-z_/]+/\w+\.py", line)
        assert [name for name in on_line if name not in files] == []
        listed += on_line[:1]
    # arguments are checked at the door, and islands are answered between those of a profile
    ordered = [name for name in listed if name != "common/arguments.py"]
    ordered.remove("islands/island_models.py")
    assert len(ordered) > 7
    assert ordered == sorted(ordered, key=files.index)


def test_a_question_is_checked_once():
    law = contact_law(FACE, "100 GPa")
    joint = Joint(FACE, bodies="100 GPa")
    requests = [
        lambda: contact(FACE, "100 GPa", pressure="1 MPa"),
        lambda: law.at(pressure="1 MPa"),
        lambda: law.at_pressure("1 MPa"),
        lambda: joint.at(pressure="1 MPa"),
        lambda: joint.at_pressure("1 MPa"),
    ]
    for request in requests:
        assert isinstance(request(), Contact)
        _, functions = entered(request)
        assert functions.count("Question.of") == 1


@pytest.mark.parametrize("theory", THEORIES)
@pytest.mark.parametrize("given", [{"pressure": 1e-3}, {"area": 0.01}], ids=str)
def test_a_theorys_curve_is_inverted_where_it_has_no_inverse(theory, given):
    def request():
        return contact(FACE, theory=theory, **given)

    request()
    files, functions = entered(request)
    assert any(name.endswith(".mean_separation_at") for name in functions)
    has_inverse = theory in ("calibrated", "persson")
    assert ("theories/inversion.py" in files) != has_inverse


@pytest.mark.parametrize("theory", THEORIES)
def test_of_the_shipped_theories_mbma_has_curves_of_its_law(theory):
    curves = resolve(theory).law_curves(FACE, 1e-6)
    assert (curves is not None) == (theory == "mbma")


def test_the_domain_is_that_of_the_interval_by_default():
    for name in THEORIES:
        theory = resolve(name)
        (low, high), (least, most) = theory.domain(FACE), theory.interval(FACE)
        assert low <= least
        # bodies farther apart do not touch
        assert high == np.inf or high == most


def test_a_hardness_is_added_to_any_theory():
    for name in THEORIES:
        metal = with_hardness(resolve(name), 0.01)
        assert metal.elastic is resolve(name)
        assert metal.answer(FACE, np.array(1.0)).pressure < 0.01


class Recorded:
    """The core, with the names of the functions that were asked for."""

    def __init__(self):
        self.names = []

    def __getattr__(self, name):
        self.names.append(name)
        return getattr(core.core, name)


@pytest.mark.parametrize(
    ("surfaces", "gaps", "by_profiles"), [(16, 2, True), (17, 2, False), (17, 300, True)]
)
def test_many_surfaces_are_integrated_gap_by_gap(
    monkeypatch, surfaces, gaps, by_profiles
):
    recorded = Recorded()
    monkeypatch.setattr(sums, "core", recorded)
    hurst = np.linspace(0.5, 0.9, surfaces)
    batch = Surface(hurst=hurst, q0=0.02, q1=1.0, h_rms=1.0, h_max=3.2)
    separation = np.linspace(1.0, 2.0, gaps)[:, None]
    contact(batch, separation=separation, theory="mbma")
    assert ("totals" in recorded.names) == (not by_profiles)


ALLOCATE = r"\b(malloc|calloc|realloc|free|alloca|strdup)\s*\("
COMMUNICATE = r"\b(printf|fprintf|puts|fopen|fread|fwrite|getenv|system|scanf)\s*\("
# a variable of a file, or one that a function keeps, which is no constant
STATE = r"^\s*(static|extern)\s+(?!.*\b(const|inline)\b)[\w\s*]+(\[[^\]]*\]\s*)*(=|;)"


def without_comments(path):
    """The text of a C file without its comments."""
    return re.sub(r"/\*.*?\*/", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_the_core_allocates_keeps_and_writes_nothing():
    # `binding.c` is Python's side of it
    paths = [*CORE.glob("*.c"), *CORE.glob("*.h")]
    others = ("binding.c", "calls.h", "stable_abi.h")
    checked = [path for path in paths if path.name not in others]
    assert len(checked) > 12
    for path in checked:
        text = without_comments(path)
        for pattern in (ALLOCATE, COMMUNICATE, STATE):
            assert not re.search(pattern, text, re.MULTILINE), (path.name, pattern)
    for planted in ("static double last;", "static int calls = 0;", "x = malloc (8);"):
        assert any(
            re.search(pattern, planted, re.MULTILINE)
            for pattern in (ALLOCATE, COMMUNICATE, STATE)
        )


def test_files_of_the_core_begin_with_a_comment_and_its_functions_are_python_s():
    for path in (*CORE.glob("*.c"), *CORE.glob("*.h")):
        assert path.read_text(encoding="utf-8").startswith("/* ")
    calls = (CORE / "calls.h").read_text(encoding="utf-8")
    functions = re.findall(r"^ +FN\((\w+),", calls, re.MULTILINE)
    assert len(functions) > 25
    of_python = {name for name in dir(core.core) if callable(getattr(core.core, name))}
    assert {*functions} <= of_python
    classes = {name for name in of_python if isinstance(getattr(core.core, name), type)}
    assert of_python - {*functions} - classes == set()


def test_the_core_is_built_for_each_generation():
    built = {path.name.split(".")[0].strip("_") for path in CORE.glob("_*")}
    assert built & {*GENERATIONS} == {*GENERATIONS} - ({"x86_64_v4", "x86_64_v3"} - built)
    named = {name.replace("-", "_") for name in re.findall(r"x86-64-v\d", PAGE)}
    assert named == {*GENERATIONS} - {"plain"}
    generation = core.core.__name__.rpartition("._")[2]
    usable = [name for name in GENERATIONS if GENERATIONS[name] <= core.core.generation]
    assert generation == os.environ.get("MBMA_TABLES_CORE", usable[0])


def test_surfaces_and_islands_know_nothing_above_them():
    above = {"surfaces": ("islands", "theories"), "islands": ("theories",)}
    for room, others in above.items():
        for path in (PACKAGE / room).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.module:
                    assert not node.module.startswith(
                        tuple(f"mbma_tables.{other}" for other in others)
                    ), path


LAZY = """
import json, sys
import mbma_tables
heavy = sorted({"scipy", "xarray"} & sys.modules.keys())
before = set(sys.modules)
mbma_tables.contact
loaded = sorted(name for name in set(sys.modules) - before if name.startswith("mbma_tables."))
print(json.dumps([heavy, loaded]))
"""


def test_public_names_import_their_modules_when_first_used():
    heavy, loaded = fresh(LAZY)
    assert heavy == []
    assert "mbma_tables.contacts.contact" in loaded


FIRST_CONTACT = """
import json, sys
from mbma_tables import Surface, contact
face = Surface(hurst=0.8, q0=0.06, q1=2.0, h_rms=1.0, h_max=3.5)
contact(face, 1.0, pressure=1e-4).area
print(json.dumps(sorted({"scipy", "xarray"} & sys.modules.keys())))
"""


def test_a_first_contact_imports_no_large_package():
    """Of an elastic surface of five numbers; these imports take longer than all else of it."""
    assert fresh(FIRST_CONTACT) == []


def test_answers_and_laws_are_told_by_their_members(tmp_path):
    (tmp_path / "toy.py").write_text(
        "class Answer:\n    pressure: float\n    area: float\n"
        "class Further(Answer):\n    pass\n"
        "class Question:\n    pressure: float | None = None\n    area: float | None = None\n"
        "class Law:\n    def pressure(self, u): ...\n    def area(self, u): ...\n"
        "class Displayed:\n    @property\n    def area(self): ...\n    force = property(len)\n"
        "class ByOthers:\n    force = made('force')\n    stiffness = made('stiffness')\n",
        encoding="utf-8",
    )
    known = ideas.classes(tmp_path)
    assert len(known) == 6
    assert ideas.of_contacts(known) == (
        ["Answer", "Displayed", "Further"],
        ["ByOthers", "Law"],
    )
    recipes = ideas.files_of_recipes()
    # no recipe takes the number of another one
    assert recipes["A quantity"] == "four"
    assert "Set-up" not in recipes
