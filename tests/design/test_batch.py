"""`mbma batch`: rows of CSV, Parquet and netCDF against single joints, rows that are refused, flat memory."""

import csv
import json
import subprocess
import sys

import netCDF4
import numpy as np
import pytest
from helpers import refused

from mbma_tables import Bodies, InputError, Joint, Surface
from mbma_tables.design import row_files
from mbma_tables.design.batch import batch

HEADER = (
    "design,bodies.metals,bodies.hardness [GPa],part_a.Ra [um],part_b.Rq,"
    "part_a.longest [mm],pressure [MPa],nominal_area [cm^2]"
)
BAND = {"hurst": 0.8, "shortest": "8 um"}
COMMON = {"part_a": BAND, "part_b": BAND | {"longest": "0.5 mm"}}
ROWS = [
    "1,steel 1020,1.2,0.4,700 nm,0.5,10,4",
    "2,copper C11000 hard,1.1,0.3,0.4 um,0.5,20,4",
    '3,"[""steel 1020"", ""copper C11000 hard""]",1.2,0.4,0.7 um,0.5,10,5',
    "4,steel 1020,1.3,0.5,0.7 um,0.4,10,4",  # bands differ
]
SINGLE = [
    ("steel 1020", "1.2 GPa", "0.4 um", "0.7 um", "0.5 mm", "10 MPa", "4 cm^2"),
    ("copper C11000 hard", "1.1 GPa", "0.3 um", "0.4 um", "0.5 mm", "20 MPa", "4 cm^2"),
    (
        ("steel 1020", "copper C11000 hard"),
        *("1.2 GPa", "0.4 um", "0.7 um", "0.5 mm", "10 MPa", "5 cm^2"),
    ),
    ("steel 1020", "1.3 GPa", "0.5 um", "0.7 um", "0.4 mm", "10 MPa", "4 cm^2"),
]
REFUSED = {
    "5,steel 1020,1.2,-0.4,0.7 um,0.5,10,4": "Ra must be positive",
    "6,steel 1020,1.2,,0.7 um,0.5,10,4": "part_a.Ra is empty",
    "7,steel 1020,1.2,0.4,0.7,0.5,10,4": "part_b.Rq = '0.7' has no unit",
    "8,steel 1020,1.2,0.4 um,0.7 um,0.5,10,4": "its unit is in the header, um",
    "9,steeel 1020,1.2,0.4,0.7 um,0.5,10,4": "no metal is named 'steeel 1020'",
    "10,steel 1020,1.2,0.4,0.7 um,0.5,10": "the row has 7 cells, the header 8",
    "11,steel 1020,1.2,0.4,0.7 um,0.5,10,4,9": "the last ones ['9']",
    "12,steel 1020,1.2,0.4,0.6..0.7 um,0.5,10,4": "is a range, and a row has one number",
    "13,steel 1020,inf,0.4,0.7 um,0.5,10,4": "bodies.hardness must be finite",
    "14,steel 1020,1.2,0.4,0.7 um,0.01,10,4": "must be more than 3 times shortest",
    "15,steel 1020,1.2,0.4,0.7 GPa,0.5,10,4": "part_b.Rq: 'GPa' is no known unit of length",
}


def joint_of(metals, hardness, Ra, Rq, longest, _, area):
    return Joint(
        BAND | {"Ra": Ra, "longest": longest},
        COMMON["part_b"] | {"Rq": Rq},
        bodies=Bodies(metals=metals, hardness=hardness),
        nominal_area=area,
    )


def rows_of(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "designs.csv"
    path.write_text("\n".join(["# a comment", HEADER, *ROWS, "", *REFUSED]) + "\n")
    return path


def test_rows_have_the_quantities_of_single_joints(table, tmp_path):
    out = tmp_path / "answers.csv"
    found = batch(table, out, common=COMMON, keep=["design"])
    assert (found.rows, found.refused) == (15, 11)
    rows = rows_of(out)
    assert [row["design"] for row in rows] == [str(k + 1) for k in range(15)]
    for row, numbers in zip(rows, SINGLE, strict=False):
        pressed = joint_of(*numbers).at_pressure(numbers[5])
        assert row["part_a.Ra [um]"] == numbers[2].removesuffix(" um")
        assert row["valid"] == ("yes" if pressed.valid else "no")
        for header, value in {
            "area": pressed.area,
            "mean_separation [um]": pressed.mean_separation,
            "stiffness [GPa/um]": pressed.stiffness,
            "total_conductance [W/(m^2 K)]": pressed.total_conductance,
            "total_conductance_scatter": pressed.total_conductance_scatter,
        }.items():
            # the spectrum of one joint of two bands is sampled, of a batch it is exact
            rtol = 1e-9 if numbers is not SINGLE[3] else 1e-6
            assert float(row[header]) == pytest.approx(float(value), rel=rtol), header


def test_refused_rows_stay_with_their_reason(table, tmp_path):
    out = tmp_path / "answers.csv"
    batch(table, out, common=COMMON, keep=["design"])
    for row, (given, reason) in zip(rows_of(out)[4:], REFUSED.items(), strict=True):
        assert reason in row["reason"]
        assert (row["area"], row["valid"]) == ("", "")
        # what was given is still there
        assert row["part_b.Rq"] == given.split(",")[4]


def test_reasons_against_valid_answers_are_in_the_table(tmp_path):
    path = tmp_path / "designs.csv"
    path.write_text("part_a.Rq [um],pressure [MPa]\n0.4,0.1\n0.4,20\n")
    common = {
        "part_a": BAND | {"longest": "0.5 mm"},
        "bodies": "copper C11000 hard",
        "nominal_area": "4 cm^2",
    }
    found = batch(path, tmp_path / "answers.csv", common=common)
    assert (found.rows, found.refused, found.not_valid) == (2, 0, 1)
    light, heavy = rows_of(tmp_path / "answers.csv")
    assert (light["valid"], heavy["valid"], heavy["reason"]) == ("no", "yes", "")
    joint = Joint(**common | {"part_a": common["part_a"] | {"Rq": "0.4 um"}})
    assert light["reason"] == "; ".join(joint.at_pressure("0.1 MPa").reasons)


@pytest.mark.parametrize("rows", [0, 1, 7, 8, 17])
def test_no_row_is_lost_between_chunks(tmp_path, monkeypatch, rows):
    monkeypatch.setattr(row_files, "CHUNK", 8)
    path = tmp_path / "designs.csv"
    heights = np.linspace(0.2, 0.8, rows)
    lines = [f"{number!r},10" for number in heights.tolist()]
    path.write_text("\n".join(["part_a.Rq [um],pressure [MPa]", *lines]) + "\n")
    common = {
        "part_a": BAND | {"longest": "0.5 mm"},
        "bodies": "copper C11000 hard",
        "nominal_area": "4 cm^2",
    }
    options = {"common": common, "quantities": ["area"]}
    out = tmp_path / "answers.csv"
    if rows == 0:
        with pytest.raises(ValueError, match="the table has no rows"):
            batch(path, out, **options)
        assert not out.exists()
        return
    batch(path, out, **options)
    band = BAND | {"longest": 500.0, "shortest": 8.0, "unit": "um", "Rq": heights}
    joints = Joint(**common | {"part_a": band})
    area = [float(row["area"]) for row in rows_of(out)]
    np.testing.assert_allclose(area, joints.at_pressure("10 MPa").area, rtol=1e-9)
    for suffix in (".nc", ".parquet"):
        if suffix == ".parquet":
            pytest.importorskip("pyarrow")
        other = tmp_path / f"answers{suffix}"
        batch(path, other, **options)
        again = tmp_path / f"again{suffix}"
        # what was written is a table that can be read
        names = ["area", "area_scatter", "valid", "reason"]
        with pytest.raises(ValueError, match="columns are named as those of answers"):
            batch(other, again, **options, keep=names)
        np.testing.assert_allclose(_column(other, "area"), area)
        np.testing.assert_allclose(_column(other, "part_a.Rq", "um"), heights)


@pytest.mark.parametrize("suffix", [".csv", ".nc"])
def test_processes_write_the_rows_of_one_in_their_order(
    table, tmp_path, monkeypatch, suffix
):
    monkeypatch.setattr(row_files, "CHUNK", 2)
    files = [tmp_path / f"{workers} workers{suffix}" for workers in (1, 3)]
    found = [
        batch(table, out, common=COMMON, keep=["design"], workers=workers)
        for out, workers in zip(files, (1, 3), strict=True)
    ]
    assert found[0] == found[1]
    assert found[0].refused == len(REFUSED)
    if suffix == ".csv":
        assert files[0].read_bytes() == files[1].read_bytes()
        return
    with netCDF4.Dataset(files[0]) as one, netCDF4.Dataset(files[1]) as other:
        assert list(one.variables) == list(other.variables)
        for name in one.variables:
            np.testing.assert_array_equal(one[name][:], other[name][:])


@pytest.mark.parametrize("workers", [0, 1.5, "two", 1000])
def test_a_number_of_processes_is_checked_before_any_row(table, tmp_path, workers):
    with pytest.raises(InputError, match="workers must be a whole number"):
        batch(table, tmp_path / "out.csv", common=COMMON, workers=workers)


def test_cells_with_signs_of_csv_are_read_as_they_were_written(tmp_path):
    """Python's own reader of CSV is the other side."""
    texts = ["plain", 'a "quoted" word', "two\nlines", "one,two", "", "\r"]
    numbers = np.array([1.5, np.nan, -0.0, 1e-300, np.inf, 0.1 + 0.2])
    path = tmp_path / "rows.csv"
    columns = {"text": texts, "number, with a comma": numbers}
    with row_files.open_writer(path, {"text": "", "number, with a comma": "um"}) as write:
        write(columns)
    rows = rows_of(path)
    assert [row["text"] for row in rows] == texts
    again = [row["number, with a comma [um]"] for row in rows]
    assert again == ["1.5", "", "-0.0", "1e-300", "inf", repr(0.1 + 0.2)]


def _column(path, name, unit=""):
    if path.suffix == ".nc":
        with netCDF4.Dataset(path) as data:
            assert data[name].units == (unit or "1")
            return np.array(data[name][:])
    import pyarrow.parquet

    header = f"{name} [{unit}]" if unit else name
    return pyarrow.parquet.read_table(path)[header].to_numpy()


@pytest.mark.parametrize("suffix", [".nc", ".parquet"])
def test_tables_of_other_formats_are_read(tmp_path, suffix):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    Rq = np.array([0.3, 0.4, np.nan])
    path = tmp_path / f"designs{suffix}"
    if suffix == ".nc":
        with netCDF4.Dataset(path, "w") as data:
            data.createDimension("design", 3)
            data.createVariable("part_a.Rq", "f8", ("design",)).units = "um"
            data["part_a.Rq"][:] = Rq
            data.createVariable("theory", str, ("design",))
            data["theory"][:] = np.array(["calibrated"] * 3, dtype=object)
    else:
        import pyarrow as pa
        import pyarrow.parquet

        made = pa.table({"part_a.Rq [um]": Rq, "theory": ["calibrated"] * 3})
        pa.parquet.write_table(made, path)
    common = {
        "part_a": BAND | {"longest": "0.5 mm"},
        "bodies": "copper C11000 hard",
        "nominal_area": "4 cm^2",
        "pressure": "10 MPa",
    }
    out = tmp_path / "answers.csv"
    found = batch(path, out, common=common, quantities=["area"])
    assert (found.rows, found.refused) == (3, 1)
    rows = rows_of(out)
    assert rows[2]["reason"] == "part_a.Rq is empty"
    face = common["part_a"] | {"Rq": "0.4 um"}
    joint = Joint(face, bodies="copper C11000 hard", nominal_area="4 cm^2")
    expected = float(joint.at_pressure("10 MPa").area)
    assert float(rows[1]["area"]) == pytest.approx(expected, rel=1e-9)


def test_surfaces_of_five_numbers_and_other_loads(tmp_path):
    path = tmp_path / "designs.csv"
    path.write_text(
        "part_a.hurst,part_a.q0 [1/mm],part_a.q1 [1/um],part_a.h_rms [nm],part_a.h_max [um],"
        "bodies.E_star [MPa],bodies.conductivity [W/(m K)],mean_separation [um]\n"
        "0.8,12,0.8,500,2,70000,40,1.2\n"
    )
    out = tmp_path / "answers.csv"
    batch(path, out, common={"gas": "vacuum"})
    (row,) = rows_of(out)
    surface = Surface(0.8, 0.012, 0.8, 0.5, 2.0, unit="um")
    bodies = Bodies("70 GPa", conductivity="40 W/(m K)")
    pressed = Joint(surface, bodies=bodies, gas="vacuum").at(mean_separation="1.2 um")
    # lengths are in the unit of the first column
    assert float(row["pressure [GPa]"]) == pytest.approx(
        float(pressed.pressure), rel=1e-9
    )
    conductance = float(row["solid_conductance [W/(m^2 K)]"])
    assert conductance == pytest.approx(float(pressed.solid_conductance), rel=1e-9)
    assert "mean_separation_scatter" not in row


def test_a_modulus_in_another_unit_does_not_change_that_of_stresses(tmp_path):
    path = tmp_path / "designs.csv"
    path.write_text(
        "part_a.Rq [um],bodies.hardness [MPa],pressure [kPa]\n0.4,1500,10000\n"
    )
    out = tmp_path / "answers.csv"
    face = BAND | {"longest": "0.5 mm"}
    common = {
        "part_a": face,
        "bodies": {"E_star": "60000 MPa"},
        "nominal_area": "4 cm^2",
        "gas": "vacuum",
    }
    batch(path, out, common=common)
    (row,) = rows_of(out)
    bodies = Bodies("60 GPa", hardness="1.5 GPa")
    joint = Joint(
        face | {"Rq": "0.4 um"}, bodies=bodies, nominal_area="4 cm^2", gas="vacuum"
    )
    pressed = joint.at_pressure("10 MPa")
    assert float(row["area"]) == pytest.approx(float(pressed.area), rel=1e-9)
    stiffness = float(row["stiffness [GPa/um]"])
    assert stiffness == pytest.approx(float(pressed.stiffness), rel=1e-9)


FACE = ["part_a.hurst=0.8", "part_a.longest=0.5 mm", "part_a.shortest=8 um"]
ALL = [*FACE, "bodies=copper C11000 hard", "nominal_area=4 cm^2"]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("part_a.Rz [um],pressure [MPa]", "did you mean 'part_a.Rq'"),
        ("Rq [um],pressure [MPa]", "column 'Rq [um]' is no argument"),
        ("part_a.Rq [um],part_a.Rq [mm]", "two columns are named 'part_a.Rq'"),
        ("part_a.Rq [GPa],pressure [MPa]", "column 'part_a.Rq [GPa]': 'GPa'"),
        ("part_a.Rq [um]", "one of separation, mean_separation, pressure, area, force"),
        ("part_a.Rq [um],pressure [MPa],area", "got pressure and area"),
        ("part_a.Rq [um],bodies.hardness [GPa],force [kN]", "'bodies' is no table"),
        ("part_a.Rq [um],force [MPa]", "no known unit of force"),
        ("theory [um],pressure [MPa]", "has names, and no unit"),
        (",pressure [MPa]", "a column has no name"),
    ],
)
def test_columns_are_checked_before_any_row(tmp_path, header, message):
    path = tmp_path / "designs.csv"
    path.write_text(header + "\n" + "1," * header.count(",") + "1\n")
    out = tmp_path / "answers.csv"
    settings = [word for entry in ALL for word in ("--set", entry)]
    assert message in refused("batch", path, *settings, "--out", out)
    assert not out.exists()


def test_the_command_reads_and_writes_pipes(table):
    command = [sys.executable, "-m", "mbma_tables", "batch", "-", "--out", "-"]
    command += ["--set", "part_a.hurst=0.8", "--set", "part_a.shortest=8 um"]
    for name, value in COMMON["part_b"].items():
        command += ["--set", f"part_b.{name}={value}"]
    command += ["--keep", "design", "--quantity", "area"]
    ran = subprocess.run(
        command, input=table.read_text(), capture_output=True, text=True, check=True
    )
    rows = list(csv.DictReader(ran.stdout.splitlines()))
    assert len(rows) == 15
    assert ran.stderr.startswith("mbma batch: 15 rows, 11 of them refused")


MEMORY = """
import json, pathlib, re, sys
from mbma_tables.design.batch import batch
common = json.loads(sys.argv[2])
options = {"common": common, "quantities": ["area"], "workers": int(sys.argv[3])}
batch(sys.argv[1], sys.argv[1] + ".csv", **options)
status = pathlib.Path("/proc/self/status").read_text()
print(re.search(r"VmHWM:\\s*(\\d+) kB", status)[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("workers", [1, 2])
def test_memory_does_not_grow_with_the_table(tmp_path, workers):
    common = {
        "part_a": BAND | {"longest": "0.5 mm"},
        "bodies": "copper C11000 hard",
        "nominal_area": "4 cm^2",
        "pressure": "10 MPa",
    }
    largest = []
    for rows in (60_000, 300_000):
        path = tmp_path / f"{rows}.csv"
        heights = np.linspace(0.2, 0.8, rows).tolist()
        path.write_text("part_a.Rq [um]\n" + "\n".join(map(repr, heights)) + "\n")
        ran = subprocess.run(
            [sys.executable, "-c", MEMORY, str(path), json.dumps(common), str(workers)],
            capture_output=True,
            text=True,
            check=True,
        )
        largest.append(int(ran.stdout))
    # 240,000 rows more would be 30 MB of numbers and texts alone
    assert largest[1] < largest[0] + 15_000


RANGED = (
    "design,part_a.Ra [um],part_b.Rq,bodies.hardness [GPa],pressure [MPa]\n"
    "1,0.35..0.45,0.7 um,1.2,10\n"
    "2,0.4,0.7 um +- 5%,1.1..1.3,8..12\n"
    "3,0.4,0.7 um,1.2,10\n"
    '4,"{measured = [0.3, 0.4, 0.6]}",0.7 um,1.2,10\n'
    "5,0.45..0.35,0.7 um,1.2,10\n"
    "6,0.4,0.7 um,1.3 GPa..1.2 GPa,10\n"
    "7,0.4,0.6..0.7,1.2,10\n"
    "8,0.35 um..0.45 um,0.7 um,1.2,10\n"
    "9,-0.1..0.45,0.7 um,1.2,10\n"
)
RANGED_COMMON = {
    "part_a": BAND | {"longest": "0.5 mm"},
    "part_b": BAND | {"longest": "0.5 mm"},
    "bodies": {"metals": "steel 1020"},
    "nominal_area": "4 cm^2",
}


def ranged_joint(Ra, Rq, hardness):
    return Joint(
        RANGED_COMMON["part_a"] | {"Ra": Ra},
        RANGED_COMMON["part_b"] | {"Rq": Rq},
        bodies=Bodies(metals="steel 1020", hardness=hardness),
        nominal_area="4 cm^2",
    )


def test_cells_may_be_ranges_whose_rows_have_quantiles(tmp_path):
    path = tmp_path / "designs.csv"
    path.write_text(RANGED)
    out = tmp_path / "answers.csv"
    asked = ["area", "total_conductance"]
    options = {"common": RANGED_COMMON, "quantities": asked, "keep": ["design"]}
    found = batch(path, out, draws=300, seed=2, **options)
    assert (found.rows, found.refused) == (9, 5)
    rows = rows_of(out)
    joints = [
        (ranged_joint("0.35..0.45 um", "0.7 um", "1.2 GPa"), "10 MPa"),
        (ranged_joint("0.4 um", "0.7 um +- 5%", "1.1..1.3 GPa"), "8..12 MPa"),
        None,
        (
            ranged_joint(
                {"measured": ["0.3 um", "0.4 um", "0.6 um"]}, "0.7 um", "1.2 GPa"
            ),
            "10 MPa",
        ),
    ]
    headers = {"area": "area", "total_conductance": "total_conductance{} [W/(m^2 K)]"}
    headers["area"] = "area{}"
    for row, one in zip(rows, joints, strict=False):
        if one is None:
            continue
        joint, pressure = one
        alone = joint.uncertainty(pressure, draws=300, seed=2, quantities=asked)
        for name, header in headers.items():
            cells = [float(row[header.format(end)]) for end in ("_low", "", "_high")]
            np.testing.assert_allclose(cells, alone.quantiles[name][:, 0], rtol=1e-9)
        assert row["valid"] == ("yes" if alone.valid.all() else "no")
    # a row of known numbers has the model's band
    pressed = ranged_joint("0.4 um", "0.7 um", "1.2 GPa").at_pressure("10 MPa")
    low, high = (float(rows[2][f"area{end}"]) for end in ("_low", "_high"))
    width = 2 * 1.6449 * float(pressed.area_scatter)
    assert np.log(high / low) == pytest.approx(width, rel=0.2)
    said = [
        "Ra = '0.45..0.35': the range is upside down",
        "hardness = '1.3 GPa..1.2 GPa': the range is upside down",
        "part_b.Rq = '0.6..0.7' has no unit",
        "part_a.Ra = '0.35 um..0.45 um' has a unit beside that of its header",
        "Ra must be positive",
    ]
    for row, reason in zip(rows[4:], said, strict=True):
        assert reason in row["reason"]
        assert (row["area"], row["area_low"], row["valid"]) == ("", "", "")
    # without draws a range is refused, and one that is none for what is wrong with it
    batch(path, out, **options)
    rows = rows_of(out)
    assert "is a range, and a row has one number: quantiles" in rows[0]["reason"]
    assert "the range is upside down" in rows[4]["reason"]


def test_ranges_that_all_rows_have_in_common(tmp_path):
    path = tmp_path / "designs.csv"
    path.write_text("part_a.Ra [um],force [kN]\n0.4,4\n0.8,4..5\n")
    common = RANGED_COMMON | {"part_b": RANGED_COMMON["part_b"] | {"Rq": "0.6..0.8 um"}}
    out = tmp_path / "answers.nc"
    batch(path, out, common=common, quantities=["area"], draws=100)
    joint = ranged_joint("0.8 um", "0.6..0.8 um", None)
    pressure = joint.pressure_of("4..5 kN")
    alone = joint.uncertainty(pressure, draws=100, quantities=["area"])
    with netCDF4.Dataset(out) as data:
        cells = [data[f"area{end}"][1] for end in ("_low", "", "_high")]
    np.testing.assert_allclose(cells, alone.quantiles["area"][:, 0], rtol=1e-9)
    path.write_text("part_a.Ra [um],area\n0.4,0.01\n")
    with pytest.raises(InputError, match="at a pressure or a force, got area"):
        batch(path, out, common=common, draws=100)
