"""The documentation: its code runs, its measured parts are the generator's, and what it names exists."""

import ast
import doctest
import importlib
import math
import pkgutil
import re
import sys
import tomllib

import click
import netCDF4
import numpy as np
import pytest
from helpers import assert_same_output

import mbma_tables
from generate import distances
from generate.files import ROOT
from generate.page import MARKED, fill, printed, svg
from generate.pages import library
from mbma_tables.common.arguments import EXTRAS, needed
from mbma_tables.tables.open import shipped
from mbma_tables.tables.schema import FORMAT_VERSIONS, KINDS

PATHS = [*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")]
PAGES = {
    str(path.relative_to(ROOT)).removeprefix("docs/"): path.read_text(encoding="utf-8")
    for path in PATHS
}
# code with the output below it, if shown; commands after "$" with theirs
FENCE = re.compile(
    r"^```(python|\{code-cell\}|console)\n(.*?)^```\n(?:```text\n(.*?)^```)?",
    re.DOTALL | re.MULTILINE,
)
BLOCKS = {
    name: blocks
    for name, text in PAGES.items()
    if (blocks := FENCE.findall(MARKED.sub("", text)))
}
MODULES = [
    m.name
    for m in pkgutil.walk_packages(mbma_tables.__path__, "mbma_tables.")
    if "__main__" not in m.name
]
README = PAGES["README.md"]
TABLES = PAGES["tables.md"]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(name, marks=[] if name == "README.md" else pytest.mark.slow)
        for name in sorted(BLOCKS)
    ],
)
def test_a_page_runs_and_prints_what_it_shows(page, monkeypatch, capsys):
    for package in ("dask", "tamaas", "SurfaceTopography"):
        pytest.importorskip(package)
    monkeypatch.chdir(ROOT)
    names = {"__name__": "__main__"}
    for kind, block, shown in BLOCKS[page]:
        if kind == "console":
            assert_same_output(printed(block.splitlines()[0][2:]), f"```\n{block}```")
            continue
        exec(block, names)
        output = capsys.readouterr().out
        if shown:
            assert_same_output(output, shown)


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings(name):
    module = importlib.import_module(name)
    found = doctest.testmod(
        module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
    )
    assert found.failed == 0


def test_readme_quotes_the_audit():
    rows = re.findall(
        r"\| (?:`error`|inverses)[^|]*\| ([\d,]+) \| [\d,]+ \| 0 \|",
        PAGES["guarantees.md"],
    )
    assert len(rows) == 10
    assert (
        f"compared {sum(int(row.replace(',', '')) for row in rows):,} answers" in README
    )


def test_every_place_has_the_same_version():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    latest = re.search(r"^## (\S+) \((\S+)\)$", PAGES["CHANGELOG.md"], re.M)
    assert settings["project"]["version"] == mbma_tables.__version__ == latest[1]
    assert f"version: {latest[1]}\ndate-released: {latest[2]}\n" in citation


def test_public_names_have_examples():
    finder = doctest.DocTestFinder()
    public = (
        "Surface",
        "contact",
        "contact_law",
        "island",
        "open_table",
        "Scene",
        "Bodies",
        "Joint",
    )
    assert [
        n
        for n in public
        if not any(test.examples for test in finder.find(getattr(mbma_tables, n), n))
    ] == []


def test_links_and_figures_of_pages_exist():
    def anchors(page):
        return {
            re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-")
            for head in re.findall(r"^#+ (.*)", page, re.M)
        }

    links = 0
    for path in PATHS:
        for target in re.findall(
            r"\]\((?!https?:)([^)\s]*)\)", path.read_text(encoding="utf-8")
        ):
            file, _, anchor = target.partition("#")
            found = (path.parent / file).resolve() if file else path
            links = links + 1
            assert found.exists(), f"{path.name}: {target}"
            assert not anchor or anchor in anchors(found.read_text(encoding="utf-8")), (
                f"{path.name}: {target}"
            )
    assert links > 100


def functions_of(path):
    """Names of tests of a file: functions, and rows that a function of helpers.py made a test of."""
    names = set()
    for node in ast.parse((ROOT / path).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names |= {
                target.id for target in node.targets if isinstance(target, ast.Name)
            }
    return names


def test_every_named_test_exists():
    named = set(
        re.findall(r"`(tests/[a-z0-9_/]+(?:\.py)?)(?:::(\w+))?`", "".join(PAGES.values()))
    )
    assert [path for path, _ in sorted(named) if not (ROOT / path).exists()] == []
    with_function = sorted(pair for pair in named if pair[1])
    assert len(with_function) > 40
    assert [pair for pair in with_function if pair[1] not in functions_of(pair[0])] == []


def test_each_guarantee_names_the_tests_that_would_fail_without_it():
    before, _, hard_cases = PAGES["guarantees.md"].partition("## Hard cases")
    promises = MARKED.sub("", before + hard_cases.partition("## Range")[2])
    rows = [row for row in promises.splitlines() if re.match(r"\| (?!---|promise)", row)]
    assert len(rows) > 15
    test_of_a_file = r"`tests/[a-z0-9_/]+\.py::test_\w+`"
    tests = rf"{test_of_a_file}(, {test_of_a_file})*"
    assert [row for row in rows if not re.fullmatch(rf"\| .+ \| {tests} \|", row)] == []


def test_every_module_of_the_architecture_exists():
    text = PAGES["architecture.md"]
    named = set(re.findall(r"\b[a-z]+(?:/[a-z_0-9]+)+\.py", text))
    assert len(named) > 15
    homes = (ROOT / "mbma_tables", ROOT)
    missing = [
        name for name in named if not any((home / name).exists() for home in homes)
    ]
    assert missing == []
    path = re.findall(r"^\d\. `(\S+)`", text, re.MULTILINE)
    lines = [
        len((ROOT / "mbma_tables" / name).read_text(encoding="utf-8").splitlines())
        for name in path
    ]
    assert len(lines) == 7
    (stated,) = re.findall(r"complete MBMA model is in about ([\d,]+) lines", text)
    assert sum(lines) == pytest.approx(int(stated.replace(",", "")), rel=0.15)


def test_layers_of_the_table_are_those_of_the_import_contract():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "tool"
    ]["importlinter"]
    layers = {
        name
        for layer in settings["contracts"][0]["layers"]
        for name in layer.split(" : ")
    }
    assert {*library.rooms()[0], "__main__"} == layers


NUMBER = r"(?:[BCD]\.)?\d+[ab]?"
CITATION = re.compile(rf"Eqs?\.\s+({NUMBER}(?:(?:, | and |, and |-){NUMBER})*)")
TAGS = re.findall(rf"\\tag{{({NUMBER})}}", PAGES["model.md"])


def cited(path):
    """Numbers of equations in a file; a range stands for its members."""
    text = re.sub(r"\(|\)|\\\n", "", path.read_text(encoding="utf-8"))
    for part in (
        part
        for listed in CITATION.findall(text)
        for part in re.split(r", and |, | and ", listed)
    ):
        ends = part.split("-")
        yield from (
            map(str, range(int(ends[0]), int(ends[1]) + 1)) if len(ends) == 2 else ends
        )


@pytest.mark.parametrize("package", ["mbma_tables", "generate"])
def test_every_cited_equation_is_on_the_page_of_the_model_once(package):
    assert len(TAGS) == len(set(TAGS))
    assert {re.sub("[ab]", "", tag) for tag in TAGS} >= set(map(str, range(1, 52)))
    paths = [
        path for path in (ROOT / package).rglob("*") if path.suffix in (".py", ".toml")
    ]
    found = {(path.name, number) for path in paths for number in cited(path)}
    assert found
    assert {
        (name, number)
        for name, number in found
        if number not in TAGS and f"{number}a" not in TAGS
    } == set()


def test_measured_parts_are_what_the_table_files_hold():
    assert fill(TABLES, library.tables()[0]) == TABLES, "python -m generate pages tables"
    with pytest.raises(click.ClickException, match="marks"):
        fill("<!-- measured: nothing -->\n<!-- end -->", {"sizes": ""})


OF_COMMANDS = re.compile(
    r"^```\n\$ (mbma (?!cost)[^\n]*)\n(.*?)^```", re.DOTALL | re.MULTILINE
)


@pytest.mark.slow
@pytest.mark.parametrize("page", ["maps.md", "tutorials/map.md"])
def test_measured_parts_show_what_commands_print_today(page):
    """`python -m generate pages` writes them, and they went stale unnoticed."""
    parts = [part[0] for part in MARKED.finditer(PAGES[page])]
    blocks = OF_COMMANDS.findall("\n".join(parts))
    assert blocks
    for command, shown in blocks:
        assert_same_output(printed(command), f"```\n$ {command}\n{shown}```")


def test_page_of_tables_names_what_files_hold():
    names = set()
    for kind in KINDS:
        with netCDF4.Dataset(shipped(kind)) as dataset:
            names |= set(dataset.ncattrs()) | set(dataset.variables)
            names |= {
                n for variable in dataset.variables.values() for n in variable.ncattrs()
            }
        assert f"{FORMAT_VERSIONS[kind]} of `{kind}.nc`" in TABLES
    # what stands above is about lookups by the library
    of_files = TABLES[TABLES.index("## Transforms of the axes") :]
    # f stands for F or A
    words = re.findall(r"`([a-z]+[0-9]*(?:_[a-zA-Z0-9]+)+)`", of_files)
    quoted = {re.sub(r"_f(?=_|$)", "_F", word) for word in words}
    # words of the library, of formulas and of the surface, not of a file
    quoted -= {"mbma_tables", "zeta_d", "zeta_1", "h_d", "g_F", "g_A"}
    assert len(quoted) > 15
    assert quoted <= names


def test_the_index_begins_with_the_commands_of_the_readme():
    """Those are replayed by tests/tables/test_readme_table.py."""
    pattern = re.compile(r"^```\w+\n.*?^```\n", re.DOTALL | re.MULTILINE)
    section = README[README.index("## A table of your own") :]
    # the page is read where the library is installed
    blocks = [text.replace(".venv/bin/", "") for text in pattern.findall(section)[:2]]
    assert pattern.findall(PAGES["index.md"])[:2] == blocks


def test_readme_shows_results():
    assert [bool(shown) for *_, shown in BLOCKS["README.md"]] == [True] * 5


def test_measured_parts_of_the_readme_are_the_generators():
    parts, files = library.readme()
    assert fill(README, parts) == README
    for name, figure in files.items():
        assert (ROOT / name).read_bytes()[:5] == svg(figure)[:5] == b"<?xml"
    assert fill(PAGES["model.md"], library.formula()[0]) == PAGES["model.md"]


def test_pocket_laws_are_printed_as_they_are_computed():
    pocket = PAGES["model.md"][PAGES["model.md"].index("    t = p/(E* g)/") :]
    names = {name: getattr(math, name) for name in ("log", "erf", "exp", "sqrt")}
    names |= {"p": 0.04, "alpha": 30.0, "nu": 0.6, "x": 1.3}
    for line in pocket.splitlines()[:4]:
        name, _, text = line.strip().partition(" = ")
        text = (
            text.replace("E* q0 h_rms ", "")
            .replace("u/h_rms", "x")
            .replace("(E* g)", "1")
            .replace("ln(", "log(")
        )
        text = re.sub(r"\((x)\)\^(-[\d.]+) exp", r"\1**\2*exp", text)
        text = re.sub(r"([\d.]) (log|x|\()", r"\1*\2", text).replace("p/1 sqrt", "p*sqrt")
        names[name] = eval(text, {}, names)
        if name == "A/A0":
            assert abs(names[name] / float(distances.pocket_area(0.04, 30.0)) - 1) < 1e-12
    assert abs(names["p"] / float(distances.pocket_pressure(1.3, 0.6)) - 1) < 1e-12


def test_the_mean_gap_of_a_nominal_one_is_its_integral():
    """Patir and Cheng's h_T is the mean of h + delta where that is positive, delta Gaussian."""
    text = (ROOT / "docs" / "leakage.md").read_text(encoding="utf-8")
    (block,) = (
        part.split("```")[0]
        for part in text.split("```python\n")
        if part.startswith("import math")
    )
    names: dict = {}
    exec(block.split("h = 0.6")[0], names)
    for h in (0.05, 0.6, 2.0):
        z = np.linspace(-h / 0.5, 12, 200001)
        density = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
        assert names["mean_gap"](h, 0.5) == pytest.approx(
            np.trapezoid((h + 0.5 * z) * density, z), rel=1e-8
        )


def test_the_packages_of_tables_come_without_an_extra():
    """A lookup's Dataset and a formula asked for extras that nobody had named."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
        "project"
    ]
    names = {re.match(r"[\w-]+", line)[0] for line in project["dependencies"]}
    assert {"numpy", "scipy", "xarray", "netCDF4", "scikit-learn"} <= names
    extras = project["optional-dependencies"]
    assert {"maps", "plot", "simulate", "full"} <= set(extras)
    assert names.isdisjoint(extras)


def test_errors_name_the_extra_that_has_a_missing_package(monkeypatch):
    """README's block of a map failed with the name of a package that README does not have."""
    content = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = content["project"]["optional-dependencies"]
    for package, extra in EXTRAS.items():
        assert any(line.startswith(package) for line in extras[extra])
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(mbma_tables.MbmaError, match=f"or the extra '{extra}'"):
            needed(package)
    assert f"'.[{EXTRAS['SurfaceTopography']}]'" in README
