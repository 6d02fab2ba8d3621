"""A joint, a surface, a law and rows reach files by one route: the same text by each way, and the same refusals."""

import hashlib
import io
import json
import pathlib
import re
import zipfile

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import refusals, skip_without_package

from mbma_tables import Bodies, Joint, Surface, contact_law
from mbma_tables.cli import main
from mbma_tables.export.registry import targets
from mbma_tables.export.request import export_law
from mbma_tables.export.rows.data import from_json, to_json

EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "joint.toml"
OF_LAWS = [name for name, each in targets().items() if name != "c"]
OF_ROWS = targets("SOLVERS", "DATA")
SPAN = ["--pressures", "10kPa:100MPa"]
SURFACE = ["--surface", "concrete", "--E-star", "13.3MPa", "--theory", "calibrated"]
SEVERAL = [name for name, kind in OF_ROWS.items() if kind.several]


def run(*words):
    return CliRunner().invoke(main, list(map(str, words)))


def options_of(target):
    if target in ("fmu", "fmu3"):
        return ["--binaries", "none"]
    return SPAN if targets()[target].rows else []


def without_command(content):
    """A file without the line of the command that wrote it."""
    if content[:2] == b"PK":
        held = zipfile.ZipFile(io.BytesIO(content))
        content = b"".join(held.read(name) for name in sorted(held.namelist()))
        # by the text of the source
        content = re.sub(rb"[{][0-9a-f-]{36}[}]", b"TOKEN", content)
    wrapped = re.sub(rb"\n(?: \*|#|!|%|//) ", b" ", content)
    return re.sub(
        rb"written by mbma_tables[^\n]*?mbma (?:joint|export) .*?-(?:-|%2D)out \S+",
        b"",
        wrapped,
    )


@pytest.mark.parametrize("target", OF_LAWS)
def test_both_commands_write_the_same_file_of_a_joint(target, tmp_path):
    skip_without_package(target)
    path = tmp_path / f"bolt{targets()[target].end or '.txt'}"
    named = ["--name", "bolt", "--out", path]
    done = run("joint", EXAMPLE, "--export", target, *named, *options_of(target))
    assert done.exit_code == 0, done.output
    first = path.read_bytes()
    again = run("export", target, "--joint", EXAMPLE, *named, *options_of(target))
    assert (again.exit_code, again.output) == (0, done.output)
    second = path.read_bytes()
    # the same from Python, with the lines of a command
    digest = hashlib.sha256(EXAMPLE.read_bytes()).hexdigest()
    command = f"mbma export {target} --out law {' '.join(options_of(target))}".strip()
    lines = (f"input {EXAMPLE}: sha256 {digest}", f"written by mbma_tables 0: {command}")
    options = {"name": "bolt", "path": path, "made_by": lines}
    if target in ("fmu", "fmu3"):
        options["binaries"] = "none"
    pressures = ("10kPa", "100MPa") if targets()[target].rows else None
    Joint.from_toml(EXAMPLE).export(target, pressures, **options)
    for written in (second, path.read_bytes()):
        if target in ("netcdf", "hdf5", "parquet", "xlsx", "matlab"):
            read = OF_ROWS[target].read
            for one, other in zip(read(first), read(written), strict=True):
                np.testing.assert_array_equal(one.y, other.y)
        else:
            assert without_command(first) == without_command(written)


@pytest.mark.parametrize("target", [name for name in OF_LAWS if name not in OF_ROWS])
def test_a_law_as_code_is_not_made_from_rows(target, rows_of_road, tmp_path):
    out = tmp_path / "law.txt"
    done = run("export", target, "--law", rows_of_road, "--out", out)
    assert done.exit_code == 2
    said = f"{target} is made from a surface or a joint, not from rows"
    assert said in done.output
    assert not out.exists()


@pytest.fixture(scope="module")
def rows_of_road(tmp_path_factory):
    path = tmp_path_factory.mktemp("rows") / "rows.json"
    assert run("export", "json", *SURFACE, "--rows", "9", "--out", path).exit_code == 0
    return path


REFUSED = [
    ["c-law", "--rows", "20"],
    ["csv", "--binaries", "none", *SPAN],
    ["csv"],
    ["csv", "--quantity", "presure", *SPAN],
    ["csv", "--quantity", "pressure,leakage", *SPAN],
    ["getdp", "--quantity", "pressure", "--leakage", *SPAN],
    ["geos", "--length-unit", "mm", *SPAN],
    ["geos", "--rtol", "0.1", "--rows", "20", *SPAN],
    ["lsdyna", "--name", "a b", "--pressures", "1"],
    ["matlab", *SPAN],
    ["abacus", *SPAN],
    ["csv", "--direction", "x", *SPAN],
    ["calculix-gapcon", "--without-heat"],
    ["c"],
]


@pytest.mark.parametrize("words", REFUSED, ids=" ".join)
def test_both_commands_refuse_the_same(words, tmp_path):
    target, *options = words
    out = ["--out", tmp_path / "law.txt"]
    of_joint = run("joint", EXAMPLE, "--export", target, *options, *out)
    of_export = run("export", target, "--joint", EXAMPLE, *options, *out)
    assert of_joint.exit_code == of_export.exit_code == 2
    if target != "c":
        assert of_joint.output == of_export.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("target", SEVERAL)
def test_several_quantities_of_a_surface_and_of_a_joint(target, tmp_path):
    path = tmp_path / f"law{targets()[target].end or '.txt'}"
    asked = ["--quantity", "pressure,leakage", "--rtol", "0.01", "--out", path]
    for source in (SURFACE, ["--joint", EXAMPLE]):
        done = run("export", target, *source, *asked, "--pressures", "0.01MPa:0.1MPa")
        assert done.exit_code == 0, done.output
        names = [curve.name for curve in OF_ROWS[target].read(path.read_bytes())]
        assert [name.rpartition("_")[2] for name in names] == ["pressure", "leakage"]


@pytest.mark.parametrize("target", OF_ROWS)
def test_a_file_of_rows_is_written_for_every_program_that_takes_it(target, tmp_path):
    skip_without_package(target)
    kind = OF_ROWS[target]
    # only a joint has a gas
    taken = kind.quantities or ["pressure"]
    usual = next(name for name in taken if name != "total_conductance")
    quantity = ["--quantity", usual]
    if usual == "solid_conductance":
        quantity += ["--conductivity", "2", "--conductivity-unit", "W/(m K)"]
    if usual == "film":
        quantity += ["--peklenik", "2"]
    else:
        quantity += ["--rows", "20", "--pressures", "1kPa:0.1MPa"]
    units = [] if kind.units is None else ["--length-unit", "m", "--stress-unit", "Pa"]
    rows = tmp_path / "rows.json"
    done = run("export", "json", *SURFACE, *units, *quantity, "--out", rows)
    assert done.exit_code == 0, done.output
    paths = [tmp_path / f"{name}{kind.end or '.txt'}" for name in ("law", "again")]
    for path, source in zip(paths, ([*SURFACE, *quantity], ["--law", rows]), strict=True):
        done = run("export", target, *source, "--name", path.stem, "--out", path)
        assert done.exit_code == 0, done.output
    one, other = (kind.read(path.read_bytes()) for path in paths)
    assert len(one) == len(other) > 0
    for curve, again in zip(one, other, strict=True):
        np.testing.assert_array_equal(curve.x, again.x)
        np.testing.assert_array_equal(curve.y, again.y)


def test_a_file_of_rows_comes_back_whole():
    heat = {"quantity": ("solid_conductance", "film"), "rows": 20}
    face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    joint = Joint(
        face, bodies="copper C11000 hard", nominal_area="4 cm^2", theory="calibrated"
    )
    content = joint.export("json", ("1 MPa", "100 MPa"), **heat).encode()
    laws = from_json(content)
    assert [law.quantity for law in laws] == ["solid_conductance", "film"]
    assert laws[0].behaviour.y_name == "pressure"
    assert to_json(laws) == content


test_a_file_that_holds_no_rows_is_refused = refusals(
    from_json,
    (b"", "no file of rows"),
    (b"[1, 2]", "no file of rows"),
    (b"{}", "no file of rows"),
    (json.dumps({"columns": {"c": [0, 1], "p": [0]}, "x": "c", "y": "p"}), "shape"),
    (
        json.dumps(
            {"columns": {"c": [0, 1, float("nan")], "p": [0, 1, 2]}, "x": "c", "y": "p"}
        ),
        "c must be finite",
    ),
    (
        json.dumps({"columns": {"c": [0, 2, 1], "p": [0, 1, 2]}, "x": "c", "y": "p"}),
        "c must rise",
    ),
)


def test_a_law_is_written_as_its_surface_is():
    road = Surface.named("concrete")
    law = contact_law(road, "13.3 MPa", "calibrated")
    asked = {"rows": 30, "made_by": ("test",)}
    range_ = ("1 kPa", "0.1 MPa")
    curves = targets()["csv"].read(export_law(law, "csv", range_, **asked).encode())
    out = run(
        "export",
        "csv",
        *SURFACE,
        "--rows",
        "30",
        "--pressures",
        "1kPa:0.1MPa",
        "--out",
        "-",
    )
    (own,) = targets()["csv"].read(out.stdout.encode())
    np.testing.assert_array_equal(curves[0].y, own.y)
    # in other units
    text = export_law(law, "csv", range_, length_unit="m", stress_unit="Pa", **asked)
    (in_si,) = targets()["csv"].read(text.encode())
    np.testing.assert_allclose(in_si.x, 1e-3 * own.x, rtol=1e-8)
    np.testing.assert_allclose(in_si.y, 1e6 * own.y, rtol=1e-8)


def test_a_law_has_the_quantities_of_its_bodies():
    bodies = Bodies("110 GPa", nu=0.3, conductivity="45 W/(m K)")
    surface = Surface(0.8, 0.05, 1.5, 0.5, 1.75, unit="um")
    law = contact_law(surface, bodies, "calibrated")
    for quantity in ("solid_conductance", "tangential_stiffness", "mean_pressure"):
        options = {"quantity": quantity, "length_unit": "m", "stress_unit": "Pa"}
        text = export_law(law, "csv", ("1 MPa", "300 MPa"), **options)
        (curve,) = targets()["csv"].read(text.encode())
        pressed = law.at(pressure=[f"{value!r} Pa" for value in curve.x[1:].tolist()])
        size = 1e15 if quantity == "tangential_stiffness" else 1.0
        size = 1e9 if quantity == "mean_pressure" else size
        expected = size * np.asarray(pressed.quantity(quantity))
        np.testing.assert_allclose(curve.y[1:], expected, rtol=2e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--nu", "0.3"], "nu does not belong to quantity=['pressure']"),
        (
            [
                "--quantity",
                "pressure",
                "--conductivity",
                "2",
                "--conductivity-unit",
                "W/(m K)",
            ],
            "conductivity does not belong to quantity=['pressure']",
        ),
        (
            ["--joint", EXAMPLE],
            "--joint has the surface: leave --E-star and --surface out",
        ),
        (["--direction", "x"], "direction is of leakage"),
    ],
)
def test_what_has_no_effect_is_refused(options, message):
    surface = SURFACE if "--joint" not in options else SURFACE[:4]
    done = run("export", "csv", *surface, *options, "--out", "-")
    assert done.exit_code == 2
    assert message in done.output


def test_rows_of_a_file_take_no_options_of_a_law(tmp_path):
    path = tmp_path / "rows.json"
    assert run("export", "json", *SURFACE, "--rows", "9", "--out", path).exit_code == 0
    for options, message in (
        (["--rtol", "0.1"], "rows are written as they are: leave rtol out"),
        (["--theory", "mbma"], "--law has its own: leave --theory out"),
        (["--joint", EXAMPLE], "--joint and --law are both given"),
    ):
        done = run("export", "csv", "--law", path, *options, "--out", "-")
        assert done.exit_code == 2
        assert message in done.output
    done = run("export", "c-law", "--law", path, "--out", "-")
    assert "c-law is made from a surface or a joint, not from rows" in done.output


# of which the numbers are fitted to the law, not as many as asked for
FITTED = ("lethe", "mbdyn", "moose-pressure")
HEAT = ["--conductivity", 0.3, "--conductivity-unit", "W/(m K)"]


def text_in(content):
    """Text of a file, with that of its parts where it is an archive."""
    if content[:2] == b"PK":
        held = zipfile.ZipFile(io.BytesIO(content))
        content = b"".join(held.read(name) for name in held.namelist())
    return content.decode("latin-1")


@pytest.mark.parametrize("target", OF_ROWS)
def test_rows_are_as_many_as_asked_for_and_headers_say_what_they_are(target, tmp_path):
    """Validity, the error of each column and the command that writes the file again, in all of them."""
    skip_without_package(target)
    kind = OF_ROWS[target]
    path = tmp_path / f"law{kind.end or '.txt'}"
    length, stress = kind.units or ("mm", "MPa")
    takes_heat = "conductivity" in kind.takes and kind.quantity != "film"
    asked = [
        *("--rows", 9, "--pressures", "1kPa:1MPa"),
        *("--length-unit", length, "--stress-unit", stress),
        *(HEAT if takes_heat and "solid_conductance" in kind.quantities else []),
    ]
    done = run("export", target, *SURFACE, *asked, "--out", path)
    assert done.exit_code == 0, done.output
    content = path.read_bytes()
    curves = kind.read(content)
    text = text_in(content)
    assert "not valid below p = " in text
    # in XML, whose comments have no two hyphens, one of them is %2D
    command = f"mbma export {target} --surface concrete --E-star 13.3MPa"
    assert command in text.replace("-%2D", "--")
    assert "largest error" in text or "misfit" in text
    # the closure of CalculiX beside conductances is a formula
    of_rows = [
        curve
        for curve in curves
        if target not in FITTED and (target, curve.name) != ("calculix", "pressure")
    ]
    for curve in of_rows:
        assert curve.x.size == 9
        if "pressure" in curve.name or "conductance" in curve.name:
            # nothing is pressed and nothing conducts at first contact
            assert (curve.x[0], curve.y[0]) == (0, 0)
    stated = re.findall(r"\w+: 9 rows; largest error [^.;]*? \d\.\de-\d\d", text)
    assert len({*stated}) >= len(of_rows)


@pytest.fixture(scope="module")
def conducting():
    bodies = Bodies("13.3 MPa", conductivity="0.3 W/(m K)")
    return contact_law(Surface.named("concrete"), bodies, "calibrated")


@pytest.mark.slow
@pytest.mark.parametrize("target", [name for name in OF_ROWS if name not in FITTED])
def test_the_error_that_is_asked_for_wins(target, conducting):
    """There are as few rows as it needs, over a hundred times that of the default."""
    skip_without_package(target)
    made = export_law(conducting, target, ("100 kPa", "1 MPa"), rtol=0.2)
    content = made[""] if isinstance(made, dict) else made
    content = content.encode() if isinstance(content, str) else content
    # of the quantity of the rows; columns beside it state their own
    stated = re.search(r"largest error [^.;]*? (\d\.\de-\d\d)", text_in(content))
    assert 0.02 < float(stated[1]) <= 0.2
    assert all(curve.x.size < 9 for curve in OF_ROWS[target].read(content)[:1])
