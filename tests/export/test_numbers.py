"""Numbers in files for other programs: a decimal point in each, and the same double when it is read again."""

import dataclasses
import json
import math
import re
import subprocess

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from law_points import PLAIN, needs
from test_fields import GETDP, MESH, rows_of

from mbma_tables import InputError, Surface
from mbma_tables.cli import main
from mbma_tables.export.code.law_code import law_text
from mbma_tables.export.law_table import LawTable
from mbma_tables.export.registry import targets
from mbma_tables.export.rows import data, solvers
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.export.text import number

FINITE = st.floats(allow_nan=False, allow_infinity=False)
# positive numbers of any unit, and whole ones, which a careless writer prints without a point
POSITIVE = st.one_of(
    st.floats(1e-30, 1e30),
    st.integers(1, 10**25).map(float),
    st.sampled_from([2.0**31, 3.24e9, 9999999999.0, 1e16, 1e22]),
)
NUMBER = re.compile(r"(?<![\w.#])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![\w.])")
UNITS = [
    ("m", "Pa"),
    ("mm", "MPa"),
    ("um", "GPa"),
    ("um", "Pa"),
    ("m", "GPa"),
    ("nm", "Pa"),
]


def has_point(token):
    return "." in token.lower().partition("e")[0]


def table_of(values, y_name="pressure", x_name="overclosure"):
    """Rows of numbers that no law has to have made."""
    x = np.unique(np.cumsum(np.asarray(values)))
    units = {"overclosure": "m", "pressure": "Pa", "solid_conductance": "W/(m^2 K)"}
    facts = {"h_rms": (1.0, "m"), "E_star": (1.0, "Pa")}
    names = x_name, y_name, units[x_name], units[y_name]
    title = f"{y_name} [{units[y_name]}] against {x_name} [{units[x_name]}]"
    return LawTable(x, x[::-1].copy(), *names, 1e-3, (title,), "calibrated", facts=facts)


@given(FINITE)
def test_a_number_reads_back_as_the_same_double(value):
    written = number(value)
    assert has_point(written)
    assert float(written) == value
    fortran = number(value, exponent="d")
    assert "d" in fortran
    assert float(fortran.replace("d", "e")) == value


@given(FINITE, st.sampled_from([16, 20]))
def test_a_number_in_a_field_is_within_its_columns_and_the_error_that_they_allow(
    value, width
):
    written = number(value, width=width)
    assert len(written) <= width
    assert has_point(written)
    # numbers below the normal ones have fewer digits themselves
    allowed = {16: 5e-9, 20: 5e-13}[width] * abs(value)
    assert (
        abs(float(written) - value) <= max(allowed, 5e-324) or len(number(value)) <= width
    )


def test_what_is_no_number_is_refused():
    for value in (math.nan, math.inf):
        with pytest.raises(InputError, match="must be finite"):
            number(value)
    assert number(-math.inf, infinity="np.inf") == "-np.inf"
    with pytest.raises(InputError, match="does not fit"):
        number(1e-300, width=4)


@settings(deadline=None, max_examples=60)
@given(st.lists(POSITIVE, min_size=3, max_size=8), st.sampled_from(PLAIN))
def test_every_number_of_rows_reads_back(values, target):
    law = table_of(values)
    if target == "calculix" and (np.diff(law.x) <= 1e-10).any():
        return
    kind = targets()[target]
    given_name = {"name": "law"} if kind.end else {}
    (curve,) = kind.read(kind.files(law, **given_name)[""])
    np.testing.assert_allclose(curve.x, law.x, rtol=curve.rtol, atol=0)
    np.testing.assert_allclose(curve.y, law.y, rtol=curve.rtol, atol=0)


@settings(deadline=None, max_examples=30)
@given(st.lists(POSITIVE, min_size=3, max_size=8))
def test_data_keep_the_type_and_the_bits_of_a_number(values):
    law = table_of(values)
    lines = [
        line
        for line in data.to_csv(law).decode().splitlines()
        if not line.startswith("#")
    ]
    for line, row in zip(lines[1:], zip(law.x, law.y, strict=True), strict=True):
        assert all(has_point(cell) for cell in line.split(","))
        assert tuple(map(float, line.split(","))) == row
    columns = json.loads(data.to_json(law))["columns"]
    assert all(
        isinstance(value, float) for value in columns["overclosure"] + columns["pressure"]
    )
    assert columns["overclosure"] == law.x.tolist()


@pytest.mark.parametrize(("length", "stress"), UNITS)
def test_numbers_of_films_and_fits_have_a_point(length, stress):
    """MBDyn reads 3121854086 as an integer of 32 bits: its scalars have points in any unit of the input."""
    surface = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")
    film = rows_of(quantity="film", peklenik=3.0)
    assigned = re.findall(r"^set: real \w+ = (\S+);$", solvers.mbdyn(film), re.M)
    assert len(assigned) == 9
    assert all(has_point(value) for value in assigned)
    law = describe_law(
        surface, "110 GPa", length_unit=length, stress_unit=stress, rows=12, theory="calibrated",
        quantity="tangential_stiffness", kappa=1.2, pressures=("1 MPa", "500 MPa"),
    )  # fmt: skip
    body = solvers.getdp(law).split("Function {")[1]
    tokens = NUMBER.findall(body.replace("$1", ""))
    assert len(tokens) == 2 * law.x.size
    assert all(has_point(token) for token in tokens)
    header = re.search(r"E\* = (\S+) ", " ".join(law.comments))[1]
    assert has_point(header)


WHOLE = Surface(
    hurst=0.5, q0=1.0, q1=100.0, h_rms=1.0, h_max=4.0, unit="m"
)  # whole numbers wherever they may be


def test_numbers_of_code_have_a_point():
    heat = {"conductivity": 6e9, "conductivity_unit": "W/(m K)"}
    targets = (
        "fortran-law",
        "matlab-law",
        "modelica-law",
        "python-law",
        "javascript-law",
        "c-law",
    )
    code = {
        target: law_text(
            target, WHOLE, 3e9, stress_unit="Pa", theory="calibrated", **heat
        )
        for target in targets
    }
    fortran = re.search(r"h_max = (\S+), least", code["fortran-law"])[1]
    assert fortran == "4.0d0"
    assert re.search(r"constant Real h_max = (\S+),", code["modelica-law"])[1] == "4.0"
    assert "y := 2.0*tangent(c);" in code["modelica-law"]
    declared = re.search(r"law_solid_conductance_OF = \{(.*?)\}", code["c-law"], re.S)[1]
    assert "2.0" in NUMBER.findall(declared)
    assert "solid_conductance = (c) => 2.0 * ask" in code["javascript-law"]
    assert "@(c) 2.0*law_tangent" in code["matlab-law"]
    for arrays in ("edges", "centre", "rate", "energies", "p", "a"):
        held = re.search(rf'"{arrays}": np.array\((.*?)\)', code["python-law"], re.S)[1]
        assert all(has_point(token) for token in NUMBER.findall(held))


@needs("getdp")
def test_getdp_reads_stiffnesses_of_billions(tmp_path):
    """2147483648 Pa/m and more were read as integers of 32 bits: -1.05e9 where the rows have 3.24e9."""
    words = (
        "export getdp --surface concrete --E-star 13.3MPa --theory calibrated --length-unit m --stress-unit Pa "
        "--quantity tangential_stiffness --nu 0.3 --pressures 10kPa:1MPa --name road --out"
    )
    ran = CliRunner().invoke(main, [*words.split(), str(tmp_path / "law.pro")])
    assert ran.exit_code == 0
    law = describe_law(
        Surface.named("concrete"), "13.3 MPa", length_unit="m", stress_unit="Pa", theory="calibrated",
        quantity="tangential_stiffness", kappa=(2 - 0.3) / (2 * (1 - 0.3)), pressures=("10 kPa", "1 MPa"),
    )  # fmt: skip
    pressures = np.geomspace(1.1e4, 0.99e6, 40)
    expected = np.interp(pressures, law.x, law.y)
    assert (expected > 2**31).sum() > 5
    prints = "".join(
        f'Print[{{road_tangential_stiffness[{number(p)}]}}, Format "k %.17g"];\n'
        for p in pressures
    )
    (tmp_path / "a.msh").write_text(f"{MESH}$EndElements\n")
    (tmp_path / "a.pro").write_text(GETDP.replace("PRINTS", prints))
    done = subprocess.run(
        ["getdp", "a.pro", "-msh", "a.msh", "-solve", "R"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    values = [float(word) for word in re.findall(r"^k (\S+)", done.stdout, re.M)]
    np.testing.assert_allclose(values, expected, rtol=1e-9)


@needs("ccx")
def test_calculix_takes_no_more_columns_than_a_field_has():
    """CalculiX reads 20 columns: a longer number loses its exponent."""
    law = dataclasses.replace(
        table_of([1e-9, 2e-9, 3e-9]), y=np.array([1.2345678901234567e-05] * 3)
    )
    rows = solvers.calculix(law).split("TABULAR\n")[1].splitlines()
    assert max(len(cell.strip()) for row in rows for cell in row.split(",")) <= 20
    assert float(rows[0].split(",")[0]) == pytest.approx(
        1.2345678901234567e-05, rel=5e-13
    )
