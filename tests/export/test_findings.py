"""What running exports in their programs found, each as a test of its own."""

import importlib.util
import io
import json
import pathlib
import re
import subprocess
import sys
import zipfile

import law_points
import numpy as np
import pytest
from law_points import needs, points

from mbma_tables import InputError, Surface, contact, contact_law
from mbma_tables.export import solvers
from mbma_tables.export.data import matlab_reader, to_csv, to_matlab, to_netcdf
from mbma_tables.export.fmu import fmu
from mbma_tables.export.law_code import law_files
from mbma_tables.export.law_rows import describe_law

CONDUCTIVITY = 50.0  # mW/(mm K)
SIDES = {"mm": 10.0, "m": 0.01}
ROUGH = Surface.named("challenge").to("mm")
PRESSURES = np.geomspace(0.012, 1.9, 6)  # MPa
HEAT = {"conductivity": CONDUCTIVITY, "conductivity_unit": "mW/(mm K)"}
LOW, BETWEEN, TOP = range(1, 5), range(5, 13), range(13, 17)  # nodes


def heat_law(**options):
    asked = {"quantity": "conductance", "pressures": ("10 kPa", "2 MPa"), "rows": 20, **HEAT}
    return describe_law(ROUGH, "25 MPa", **(asked | options))


def each(nodes, words):
    return "".join(f"{node}, {words}\n" for node in nodes)


def blocks(card, steps, side, stiff, more="", kind="NODE TO SURFACE"):
    """Two blocks of one element each, so stiff that they do not count; `more` of their material."""
    corners = [(x, y, z) for z in (0.0, side, side, 2 * side) for x, y in ((0, 0), (side, 0), (side, side), (0, side))]
    nodes = "".join(f"{k + 1}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(corners))
    return (
        f"*NODE, NSET=ALL\n{nodes}*NSET, NSET=TOP\n13, 14, 15, 16\n*NSET, NSET=SLAVE\n9, 10, 11, 12\n"
        "*ELEMENT, TYPE=C3D8, ELSET=LOW\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
        "*ELEMENT, TYPE=C3D8, ELSET=UP\n2, 9, 10, 11, 12, 13, 14, 15, 16\n"
        f"*MATERIAL, NAME=STIFF\n*ELASTIC\n{stiff:.6e}, 0.\n{more}"
        "*SOLID SECTION, ELSET=LOW, MATERIAL=STIFF\n*SOLID SECTION, ELSET=UP, MATERIAL=STIFF\n"
        "*SURFACE, NAME=MASTER, TYPE=ELEMENT\n1, S2\n*SURFACE, NAME=SLAVES, TYPE=ELEMENT\n2, S1\n"
        f"{card}*CONTACT PAIR, INTERACTION=ROUGH, TYPE={kind}\nSLAVES, MASTER\n{steps}"
    )


def pressed(card, compressions, side, stiff):
    steps = "".join(
        f"*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n{each(LOW, '1, 3')}{each(TOP, '1, 2')}{each(TOP, f'3, 3, {-c:.12e}')}"
        f"{each(BETWEEN, '1, 2')}*NODE PRINT, NSET=TOP, TOTALS=ONLY\nRF\n*END STEP\n"
        for c in compressions
    )
    return blocks(card, steps, side, stiff)


def heated(card, loads, side, stiff):
    """A step for each load, a line on the top's nodes, 100 degrees above and 0 below, in steady state."""
    ends = each(LOW, "1, 3") + each(LOW, "11, 11, 0.") + each([*BETWEEN, *TOP], "1, 2") + each(TOP, "11, 11, 100.")
    output = "".join(f"*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000\n{what}\n" for what in ("RF", "RFL"))
    steps = "".join(
        f"*STEP, INC=1000\n*COUPLED TEMPERATURE-DISPLACEMENT, STEADY STATE\n1., 1.\n*BOUNDARY\n{ends}{load}"
        f"{output}*END STEP\n"
        for load in loads
    )
    steps = f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50.\n{steps}"
    return blocks(card, steps, side, stiff, f"*CONDUCTIVITY\n{CONDUCTIVITY!r}\n*EXPANSION\n0.\n", "SURFACE TO SURFACE")


def heated_and_moved(card, c, p):
    return heated(card, (each(TOP, f"3, 3, {-down:.9e}") for down in c + 20 * p / 1e6), 10.0, 1e6)


def calculix(deck, folder, side=10.0):
    """What CalculiX says of a deck, and the pressures and heat fluxes at the ends of its steps."""
    (folder / "joint.inp").write_text(deck)
    said = subprocess.run(["ccx", "joint"], cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    rows = [
        [abs(float(word)) / side**2 for word in line.split()]
        for line in (folder / "joint.dat").read_text().splitlines()
        if re.fullmatch(r"(\s+-?\d\.\d+E[+-]\d+)+", line)
    ]
    return said, np.array([row[2] for row in rows if len(row) == 3]), np.array([r[0] for r in rows if len(r) == 1])


def conductance(flux, side=10.0):
    return 1 / (100 / flux - 2 * side / CONDUCTIVITY)


@needs("ccx")
def test_calculix_has_closure_and_conductance_in_one_interaction(tmp_path):
    law = contact_law(ROUGH, E_star="25 MPa")
    card, c = solvers.calculix(heat_law()), law.h_max - law.at_pressure(PRESSURES).mean_separation
    said, p, flux = calculix(heated_and_moved(card, c, PRESSURES), tmp_path)
    assert len(p) == len(flux) == PRESSURES.size, said.stdout[-1000:]
    # the pressure is the law's to what the card says of its closure, and the conductance is of that pressure
    stated = float(re.search(r"within (\d+)% of the law", card.replace("\n**", ""))[1]) / 100
    assert 0.1 < np.abs(np.log(p / PRESSURES)).max() < np.log1p(stated) + 0.06
    expected = CONDUCTIVITY / 25 * law.at_pressure(p).stiffness
    np.testing.assert_allclose(conductance(flux)[:-1], expected[:-1], rtol=1e-2)
    assert p[-1] > heat_law().x[-1]
    assert conductance(flux)[-1] == pytest.approx(heat_law().y[-1], rel=1e-2)


JAX = """
import json
import jax
jax.config.update("jax_enable_x64", True)
import road
asked = [road.pressure, road.tangent, road.energy, road.area, road.leakage]
beyond = [jax.value_and_grad(f)(x) for f in asked for x in (9.0, float("nan"))]
beyond.append(jax.value_and_grad(road.overclosure)(100.0))
slopes = [jax.grad(road.leakage)(c) for c in (-1e-9, 0.0, 1e-9)]
print(json.dumps([[float(v) for pair in beyond for v in pair], [float(v) for v in slopes]]))
"""


@pytest.mark.skipif(importlib.util.find_spec("jax") is None, reason="not installed: jax")
def test_jax_has_no_derivative_where_it_has_no_value(tmp_path):
    (tmp_path / "road.py").write_text(law_points.text("jax-law", "calibrated", leakage=True))
    said = subprocess.run([sys.executable, "-c", JAX], cwd=tmp_path, capture_output=True, text=True, check=True)
    beyond, (below, at, above) = json.loads(said.stdout)
    assert np.isnan(beyond).all()
    assert at == pytest.approx(above, rel=1e-6)
    assert at == pytest.approx(below, rel=0.2)


@needs("gcc", "g++")
def test_the_header_of_a_law_in_c_and_cpp(tmp_path):
    files = law_files("c-law", law_points.ROAD, "13.3 MPa", name="road", leakage=True, **HEAT)
    (tmp_path / "road.c").write_text(files[""])
    (tmp_path / "road.h").write_text(files[".h"])
    program = '#include "road.h"\n#include "road.h"\n#include <stdio.h>\nint main(void) { double k; printf("%.17g", '
    program += "road_with_tangent(1.0, &k) + road_leakage(1.0) + road_conductance(1.0) + road_overclosure(0.01)); }\n"
    said = []
    subprocess.run(["gcc", "-c", "road.c"], cwd=tmp_path, check=True)
    for compiler, end in (("gcc", "c"), ("g++", "cpp")):
        (tmp_path / f"ask.{end}").write_text(program)
        strict = [compiler, "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
        subprocess.run([*strict, f"ask.{end}", "road.o", "-lm", "-o", "ask"], cwd=tmp_path, check=True)
        said.append(subprocess.run(["./ask"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout)
    law = points("mbma").law
    expected = law.pressure(2.0) + law.leakage(2.0) + CONDUCTIVITY / 13.3 * law.stiffness(2.0) + 3
    assert [float(one) for one in said] == pytest.approx(2 * [expected - float(law.at_pressure(0.01).mean_separation)])


@pytest.mark.parametrize("more", [{}, {"leakage": True, **HEAT}])
def test_types_of_a_law_in_javascript(more):
    files = law_files("javascript-law", law_points.ROAD, "13.3 MPa", name="road", **more)
    exported = re.findall(r"^export (?:const|function) (\w+)", files[""], flags=re.M)
    typed = re.findall(r"^export function (\w+)\(\w: number\): ", files[".d.mts"], flags=re.M)
    assert sorted(typed) == sorted(exported)


@pytest.mark.parametrize(
    "target", ["c-law", "javascript-law", "python-law", "matlab-law", "modelica-law", "fortran-law"]
)
def test_headers_name_functions_that_are_there(target):
    head, _, text = law_points.text(target, "calibrated", name="road", **HEAT).partition("Example: ")
    lines = " ".join(line.strip("*/!#%; ") for line in text.splitlines()[:4])
    called = re.findall(r"(?:road[._]|law\.)?(\w+)\([\d.]", lines)
    assert len(called) >= 2
    for name in called:
        assert re.search(rf"(?:function|def|const|double|kept\.|export) ?(?:road_)?{name}\b", text)
    assert "{{" not in head


@pytest.mark.parametrize("name", law_points.ASKED)
def test_a_turn_is_told_of_where_there_is_one(name):
    text, law = law_points.text("c-law", name), points(name).law
    turns = law.turning_point is not None and law.turning_point > law.lowest + 1e-9 * law.h_max
    assert ("where pressure turns down" in text) == turns


def test_units_of_modelica(tmp_path):
    text = law_points.text("modelica-law", "calibrated", name="road", leakage=True, **HEAT)
    for kind, unit in {"Overclosure": "mm", "Pressure": "MPa", "Tangent": "MPa/mm", "Energy": "MPa.mm"}.items():
        assert f'type {kind} = Real(unit = "{unit}");' in text
    assert 'output Real y(unit = "mm3");' in text


@needs("cc")
def test_an_fmu_runs_as_it_is(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    file = fmu(law_points.ROAD, "13.3 MPa", name="road", leakage=True)
    (tmp_path / "road.fmu").write_bytes(file)
    law = points("mbma").law
    for c in (0.5, 2.0):
        asked = {"start_values": {"overclosure": c}, "output": ["pressure", "tangent", "area", "energy", "leakage"]}
        found = fmpy.simulate_fmu(str(tmp_path / "road.fmu"), stop_time=1.0, **asked)[-1]
        known = law.values(3 - c)
        expected = [known.pressure, known.stiffness, known.area, known.energy, law.leakage(3 - c)]
        np.testing.assert_allclose(list(found)[1:], expected, rtol=1e-12)
    said = fmpy.read_model_description(str(tmp_path / "road.fmu")).description
    folders = {name.split("/")[1] for name in zipfile.ZipFile(tmp_path / "road.fmu").namelist() if "binaries/" in name}
    assert f"binaries: {', '.join(sorted(folders))}" in said
    assert len(folders) == 1
    assert fmu(law_points.ROAD, "13.3 MPa", name="road", leakage=True) == file


@pytest.mark.parametrize("fails", [False, True])
def test_an_fmu_without_a_compiler(fails, tmp_path, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    (tmp_path / "cc").write_text("#!/bin/sh\nexit 1\n")
    (tmp_path / "cc").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path / ("" if fails else "none")))
    file = fmu(law_points.ROAD, "13.3 MPa")
    archive = zipfile.ZipFile(io.BytesIO(file))
    assert archive.namelist() == ["modelDescription.xml", "sources/law.c"]
    assert "binaries: none, sources only" in archive.read("modelDescription.xml").decode()
    with pytest.raises(InputError, match="compiled by ziglang: pip install"):
        fmu(law_points.ROAD, "13.3 MPa", binaries="all")
    with pytest.raises(InputError, match="binaries must be one of"):
        fmu(law_points.ROAD, "13.3 MPa", binaries="linux")


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="not installed: ziglang")
def test_an_fmu_for_all_platforms():
    archive = zipfile.ZipFile(io.BytesIO(fmu(law_points.ROAD, "13.3 MPa", binaries="all")))
    begins = {name.split("/")[1]: archive.read(name)[:2] for name in archive.namelist() if "binaries/" in name}
    assert begins == {"linux64": b"\x7fE", "darwin64": b"\xcf\xfa", "win64": b"MZ"}


@pytest.mark.parametrize("theory", ["mbma", "calibrated", "persson"])
@pytest.mark.parametrize("pressures", [None, ("1 kPa", "0.5 MPa")])
def test_a_law_continued_by_its_tangents(theory, pressures):
    law = contact_law(Surface.named("concrete"), E_star="13.3 MPa", theory=theory)
    trial = law.continued(pressures)
    inner = np.linspace(trial.heavy, trial.light, 50)
    np.testing.assert_array_equal(trial.pressure(inner), law.pressure(inner))
    np.testing.assert_array_equal(trial.stiffness(inner), law.stiffness(inner))
    assert trial.inside(inner).all()
    for end, side in ((trial.light, 1.0), (trial.heavy, -1.0)):
        beyond = end + side * np.array([1e-9, 0.1, 1e3])
        found, slope = trial.pressure_and_stiffness(beyond)
        assert (slope == law.stiffness(end)).all()
        np.testing.assert_allclose(found, law.pressure(end) - law.stiffness(end) * (beyond - end), rtol=1e-13)
        assert not trial.inside(beyond).any()
    # Newton's method from first contact, and from far beyond full compression
    for u in (law.h_max, -5.0):
        for _ in range(60):
            p, k = trial.pressure_and_stiffness(u)
            u += (p - 0.1) / k
        assert law.pressure(u) == pytest.approx(0.1, rel=1e-12)
    if pressures:
        assert law.pressure([trial.light, trial.heavy]) == pytest.approx([1e-3, 0.5])


@pytest.mark.parametrize("pressures", [("2 kPa", "1 kPa"), (0.0, 0.1), "12", (1, 2, 3)])
def test_pressures_that_do_not_rise(pressures):
    law = contact_law(Surface.named("concrete"), E_star="13.3 MPa", theory="calibrated")
    with pytest.raises(InputError, match="two rising numbers"):
        law.continued(pressures)
    with pytest.raises(InputError, match="must be finite"):
        law.continued().pressure(np.nan)


@pytest.mark.skipif(importlib.util.find_spec("skfem") is None, reason="not installed: scikit-fem")
def test_newton_in_scikit_fem_from_zero_load():
    example = pathlib.Path(__file__).parents[2] / "examples" / "newton.py"
    said = subprocess.run(
        [sys.executable, str(example)], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    residuals = [float(line.split()[1]) for line in said[:-1]]
    assert residuals[-1] < 1e-12
    assert len(residuals) <= 14
    assert residuals[-2] < 1e-4 * residuals[-3]  # quadratic
    assert "force 8.000000" in said[-1]


@needs("ccx")
@pytest.mark.parametrize(("length", "stress", "theory"), [("mm", "MPa", "mbma"), ("m", "Pa", "calibrated")])
def test_calculix_feels_the_law(tmp_path, length, stress, theory):
    surface, E_star = Surface.named("concrete").to(length), {"MPa": 13.3, "Pa": 13.3e6}[stress]
    top = 0.04 * E_star
    law = describe_law(surface, E_star, stress_unit=stress, pressures=(1e-5 * top, top), rtol=5e-4, theory=theory)
    pressures = np.geomspace(1.01e-5, 0.99, 30) * top
    found = contact(surface, pressure=pressures, E_star=E_star, theory=theory)
    deck = pressed(solvers.calculix(law), float(surface.h_max) - found.mean_separation, SIDES[length], 1e9 * E_star)
    said, reached, _ = calculix(deck, tmp_path, SIDES[length])
    assert len(reached) == 30, said.stdout[-2000:]
    np.testing.assert_allclose(reached, pressures, rtol=2e-3)


@needs("octave-cli")
def test_octave_looks_up(tmp_path):
    law = describe_law(Surface.named("asphalt"), 20.0, length_unit="mm", stress_unit="MPa", rows=60)
    (tmp_path / "law.mat").write_bytes(to_matlab(law))
    (tmp_path / "law.m").write_bytes(matlab_reader(law, "law"))
    x = np.random.default_rng(1).uniform(0, law.x[-1], 200)
    np.savetxt(tmp_path / "x.txt", x, fmt="%.17g")
    script = "x = load('x.txt'); printf('%.17g\\n', law(x)); s = load('law.mat'); printf('%.17g\\n', s.x, s.y);"
    said = subprocess.run(
        ["octave-cli", "--no-init-file", "--eval", script], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    numbers = np.array(said.stdout.split(), dtype=float)
    np.testing.assert_allclose(numbers[:200], np.interp(x, law.x, law.y), rtol=1e-12)
    np.testing.assert_array_equal(numbers[200:], np.concatenate([law.x, law.y]))
    beyond = subprocess.run(
        ["octave-cli", "--no-init-file", "--eval", "law(1e3)"], cwd=tmp_path, capture_output=True, text=True
    )
    assert beyond.returncode != 0
    assert "x must be in" in beyond.stderr


@needs("ccx")
@pytest.mark.parametrize(("length", "stress"), [("mm", "MPa"), ("m", "Pa")], ids=["mm", "SI"])
def test_calculix_conducts_as_the_law_says(tmp_path, length, stress):
    asked = HEAT | {"conductivity_unit": "W/(m K)", "pressures": ("1 kPa", "2 MPa"), "rows": 20}
    law = describe_law(ROUGH, "25 MPa", length_unit=length, stress_unit=stress, quantity="conductance", **asked)
    side, unit = SIDES[length], {"MPa": 1.0, "Pa": 1e6}[stress]
    pressures, card = unit * np.geomspace(1.1e-3, 1.9, 8), solvers.calculix(law)
    slope = re.search(r"with the line (\S+) below", card.replace("\n** ", " "))[1]
    card = re.sub(r"=EXPONENTIAL\n.*\n", f"=LINEAR\n{slope}\n", card)
    forces = (f"*CLOAD\n{each(TOP, f'3, {-p * side**2 / 4:.9e}')}" for p in pressures)
    said, _, flux = calculix(heated(card, forces, side, 1e6 * unit), tmp_path, side)
    assert len(flux) == 8, said.stdout[-2000:]
    found = contact(ROUGH.to(length), pressure=pressures, E_star=25 * unit)
    np.testing.assert_allclose(conductance(flux, side), found.stiffness * CONDUCTIVITY / (25 * unit), rtol=1e-2)


@needs("Rscript")
def test_r_reads(tmp_path):
    law = describe_law(Surface.named("asphalt"), 20.0, stress_unit="MPa", rows=30)
    (tmp_path / "law.csv").write_bytes(to_csv(law))
    (tmp_path / "law.nc").write_bytes(to_netcdf(law))
    script = """
    rows <- read.csv("law.csv", comment.char = "#", check.names = FALSE)
    cat(names(rows), sep = "|"); cat("\n"); cat(sprintf("%.17g", rows[[1]]), sprintf("%.17g", rows[[2]])); cat("\n")
    if (requireNamespace("ncdf4", quietly = TRUE)) {
      file <- ncdf4::nc_open("law.nc")
      cat(sprintf("%.17g", c(ncdf4::ncvar_get(file, "overclosure"), ncdf4::ncvar_get(file, "pressure"))))
    }
    """
    said = subprocess.run(["Rscript", "-e", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    names, *tables = said.stdout.strip().splitlines()
    assert names == "overclosure [mm]|pressure [MPa]"
    for table in tables:
        np.testing.assert_array_equal(np.array(table.split(), dtype=float), np.concatenate([law.x, law.y]))
