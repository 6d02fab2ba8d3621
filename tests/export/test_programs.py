"""Rows of laws read by CalculiX, Octave and R."""

import pathlib
import re
import subprocess
import sys
import types
from unittest import mock

import numpy as np
import pytest
from law_points import needs

from mbma_tables import Joint, Surface, contact, contact_law
from mbma_tables.export.rows import solvers
from mbma_tables.export.rows.data import matlab_reader, to_csv, to_matlab, to_netcdf
from mbma_tables.export.rows.law_rows import describe_law

CONDUCTIVITY = 50.0  # mW/(mm K)
MAPS = pathlib.Path(__file__).parents[2] / "docs" / "data" / "maps"
SIDES = {"mm": 10.0, "m": 0.01}
ROUGH = Surface.named("challenge").to("mm")
PRESSURES = np.geomspace(0.012, 1.9, 6)  # MPa
HEAT = {"conductivity": CONDUCTIVITY, "conductivity_unit": "mW/(mm K)"}
# nodes
LOW = range(1, 5)
BETWEEN = range(5, 13)
TOP = range(13, 17)


def each(nodes, words):
    return "".join(f"{node}, {words}\n" for node in nodes)


def blocks(card, steps, side, stiff, more="", kind="NODE TO SURFACE"):
    """Two blocks of one element each, so stiff that they do not count; `more` of their material."""
    corners = [
        (x, y, z)
        for z in (0.0, side, side, 2 * side)
        for x, y in ((0, 0), (side, 0), (side, side), (0, side))
    ]
    nodes = "".join(
        f"{k + 1}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(corners)
    )
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
    ends = (
        each(LOW, "1, 3")
        + each(LOW, "11, 11, 0.")
        + each([*BETWEEN, *TOP], "1, 2")
        + each(TOP, "11, 11, 100.")
    )
    output = "".join(
        f"*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000\n{what}\n"
        for what in ("RF", "RFL")
    )
    steps = "".join(
        f"*STEP, INC=1000\n*COUPLED TEMPERATURE-DISPLACEMENT, STEADY STATE\n1., 1.\n*BOUNDARY\n{ends}{load}"
        f"{output}*END STEP\n"
        for load in loads
    )
    steps = f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50.\n{steps}"
    return blocks(
        card,
        steps,
        side,
        stiff,
        f"*CONDUCTIVITY\n{CONDUCTIVITY!r}\n*EXPANSION\n0.\n",
        "SURFACE TO SURFACE",
    )


def calculix(deck, folder, side=10.0):
    """What CalculiX says of a deck, and the pressures and heat fluxes at the ends of its steps."""
    (folder / "joint.inp").write_text(deck)
    said = subprocess.run(
        ["ccx", "joint"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    rows = [
        [abs(float(word)) / side**2 for word in line.split()]
        for line in (folder / "joint.dat").read_text().splitlines()
        if re.fullmatch(r"(\s+-?\d\.\d+E[+-]\d+)+", line)
    ]
    return (
        said,
        np.array([row[2] for row in rows if len(row) == 3]),
        np.array([r[0] for r in rows if len(r) == 1]),
    )


def conductance(flux, side=10.0):
    return 1 / (100 / flux - 2 * side / CONDUCTIVITY)


@needs("ccx")
def test_calculix_has_closure_and_conductance_in_one_interaction(tmp_path):
    law = contact_law(ROUGH, "25 MPa", theory="mbma")
    asked = HEAT | {"pressures": ("10 kPa", "2 MPa"), "rows": 20, "theory": "mbma"}
    rows = describe_law(ROUGH, "25 MPa", quantity="solid_conductance", **asked)
    card = solvers.calculix(rows)
    c = law.h_max - law.at_pressure(PRESSURES).mean_separation
    moved = (each(TOP, f"3, 3, {-down:.9e}") for down in c + 20 * PRESSURES / 1e6)
    said, p, flux = calculix(heated(card, moved, 10.0, 1e6), tmp_path)
    assert len(p) == len(flux) == PRESSURES.size, said.stdout[-1000:]
    # the pressure is the law's to what the card says of its closure, and the conductance is
    # of that pressure
    stated = (
        float(re.search(r"within (\d+)% of the law", card.replace("\n**", ""))[1]) / 100
    )
    assert 0.1 < np.abs(np.log(p / PRESSURES)).max() < np.log1p(stated) + 0.06
    # the formula of the comments, with its numbers, is what CalculiX calculates
    words = " ".join(card.replace("\n**", "").split())
    assert "p = p0 exp(ln(100) c/c0)" in words
    c0, p0 = (
        float(re.search(rf"{name} = (\S+) ", words)[1]) for name in ("with c0", "and p0")
    )
    overlap = c + 20 * PRESSURES / 1e6 - 20 * p / 1e6
    np.testing.assert_allclose(p0 * np.exp(np.log(100) * overlap / c0), p, rtol=1e-3)
    expected = CONDUCTIVITY / 25 * law.at_pressure(p).stiffness
    np.testing.assert_allclose(conductance(flux)[:-1], expected[:-1], rtol=1e-2)
    assert p[-1] > rows.x[-1]
    assert conductance(flux)[-1] == pytest.approx(rows.y[-1], rel=1e-2)


@needs("ccx")
@pytest.mark.parametrize(
    ("length", "stress", "theory"), [("mm", "MPa", "mbma"), ("m", "Pa", "calibrated")]
)
def test_calculix_feels_the_law(tmp_path, length, stress, theory):
    surface = Surface.named("concrete").to(length)
    E_star = {"MPa": 13.3, "Pa": 13.3e6}[stress]
    top = 0.04 * E_star
    law = describe_law(
        surface,
        E_star,
        stress_unit=stress,
        pressures=(1e-5 * top, top),
        rtol=5e-4,
        theory=theory,
    )
    pressures = np.geomspace(1.01e-5, 0.99, 30) * top
    found = contact(surface, E_star, pressure=pressures, theory=theory)
    deck = pressed(
        solvers.calculix(law),
        float(surface.h_max) - found.mean_separation,
        SIDES[length],
        1e9 * E_star,
    )
    said, reached, _ = calculix(deck, tmp_path, SIDES[length])
    assert len(reached) == 30, said.stdout[-2000:]
    np.testing.assert_allclose(reached, pressures, rtol=2e-3)


@needs("ccx")
@pytest.mark.slow
@pytest.mark.parametrize(("length", "side"), [("mm", 1.0), ("mm", 1e-3), ("um", 1.0)])
def test_calculix_feels_rows_of_nanometres_in_any_unit(tmp_path, length, side):
    """Rows 1e-7 mm apart are followed from first touch, over seven decades, as well as the same ones in um.

    The blocks are 1e9 times as stiff as the joint: of stiffer ones CalculiX loses the
    digits of small overlaps.
    """
    surface = Surface.from_map(MAPS / "top-1.top", short_cutoff="9.4 nm").to(length)
    low = 1e-4
    high = 1000.0
    E_star = 1e5
    law = describe_law(
        surface,
        E_star,
        stress_unit="MPa",
        theory="calibrated",
        pressures=(low, high),
        rtol=1e-3,
    )
    pressures = np.geomspace(1.01 * low, 0.99 * high, 15)
    found = contact(surface, E_star, pressure=pressures, theory="calibrated")
    deck = pressed(
        solvers.calculix(law),
        float(surface.h_max) - found.mean_separation,
        side,
        1e9 * E_star,
    )
    said, reached, _ = calculix(deck, tmp_path, side)
    assert len(reached) == 15, said.stdout[-2000:]
    # compliance of the blocks: p 2 side/(1e9 E*) over p/slope
    soft = 2 * side * np.asarray(found.stiffness) / (1e9 * E_star)
    assert (np.abs(reached / pressures - 1) <= 1.1e-3 + soft).all()


@needs("octave-cli")
def test_octave_looks_up(tmp_path):
    law = describe_law(
        Surface.named("asphalt"), 20.0, length_unit="mm", stress_unit="MPa", rows=60
    )
    (tmp_path / "law.mat").write_bytes(to_matlab(law))
    (tmp_path / "law.m").write_bytes(matlab_reader(law, "law"))
    x = np.random.default_rng(1).uniform(0, law.x[-1], 200)
    np.savetxt(tmp_path / "x.txt", x, fmt="%.17g")
    script = "x = load('x.txt'); printf('%.17g\\n', law(x)); s = load('law.mat'); printf('%.17g\\n', s.x, s.y); law(1e3)"
    said = subprocess.run(
        ["octave-cli", "--no-init-file", "--eval", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert said.returncode != 0
    assert "x must be in" in said.stderr
    numbers = np.array(said.stdout.split(), dtype=float)
    np.testing.assert_allclose(numbers[:200], np.interp(x, law.x, law.y), rtol=1e-12)
    np.testing.assert_array_equal(numbers[200:], np.concatenate([law.x, law.y]))


@needs("ccx")
@pytest.mark.parametrize(
    ("length", "stress"), [("mm", "MPa"), ("m", "Pa")], ids=["mm", "SI"]
)
def test_calculix_conducts_as_the_law_says(tmp_path, length, stress):
    asked = HEAT | {
        "conductivity_unit": "W/(m K)",
        "pressures": ("1 kPa", "2 MPa"),
        "rows": 20,
        "theory": "mbma",
    }
    law = describe_law(
        ROUGH,
        "25 MPa",
        length_unit=length,
        stress_unit=stress,
        quantity="solid_conductance",
        **asked,
    )
    side = SIDES[length]
    unit = {"MPa": 1.0, "Pa": 1e6}[stress]
    pressures = unit * np.geomspace(1.1e-3, 1.9, 8)
    card = solvers.calculix(law)
    slope = re.search(r"with the line (\S+) below", card.replace("\n** ", " "))[1]
    card = re.sub(r"=EXPONENTIAL\n.*\n", f"=LINEAR\n{slope}\n", card)
    forces = (f"*CLOAD\n{each(TOP, f'3, {-p * side**2 / 4:.9e}')}" for p in pressures)
    said, _, flux = calculix(heated(card, forces, side, 1e6 * unit), tmp_path, side)
    assert len(flux) == 8, said.stdout[-2000:]
    found = contact(ROUGH.to(length), 25 * unit, pressure=pressures, theory="mbma")
    np.testing.assert_allclose(
        conductance(flux, side), found.stiffness * CONDUCTIVITY / (25 * unit), rtol=1e-2
    )


class Slope(str):
    """A quantity of FreeCAD as far as its writer asks for it."""

    def in_mpa_per_mm(self):
        value, unit = self.split(" ")
        assert unit == "MPa/mm"
        return float(value)


def card_of_freecad(macro):
    """What FreeCAD's write_constraint_contact.py writes of a selected contact after the macro."""
    contact = types.SimpleNamespace(Friction=False)
    selection = types.SimpleNamespace(getSelection=lambda: [contact])
    gui = types.SimpleNamespace(Selection=selection)
    with mock.patch.dict(sys.modules, FreeCADGui=gui):
        exec(macro, {})
    assert contact.SurfaceBehavior == "Linear"
    slope = Slope(contact.Slope).in_mpa_per_mm()
    card = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n{slope:.13G}\n"
    if contact.Friction:
        stick = Slope(contact.StickSlope).in_mpa_per_mm()
        card += f"*FRICTION\n{contact.FrictionCoefficient:.13G}, {stick:.13G}\n"
    if contact.EnableThermalContact:
        lines = [f"{value}\n" for value in contact.ThermalContactConductance]
        card += f"*GAP CONDUCTANCE\n{''.join(lines)}"
    return f"*SURFACE INTERACTION, NAME=ROUGH\n{card}"


@needs("ccx")
def test_what_freecad_writes_for_calculix_conducts_as_the_law_says(tmp_path):
    pressures = np.geomspace(1.1e-3, 1.9, 8)  # MPa
    law = describe_law(
        ROUGH,
        "25 MPa",
        length_unit="m",
        stress_unit="Pa",
        quantity="solid_conductance",
        conductivity=CONDUCTIVITY,
        conductivity_unit="W/(m K)",
        pressures=("1 kPa", "2 MPa"),
        rows=20,
        theory="mbma",
    )
    card = card_of_freecad(solvers.freecad(law))
    forces = (f"*CLOAD\n{each(TOP, f'3, {-p * 100 / 4:.9e}')}" for p in pressures)
    said, _, flux = calculix(heated(card, forces, 10.0, 1e6), tmp_path)
    assert len(flux) == 8, said.stdout[-2000:]
    found = contact(ROUGH.to("mm"), 25.0, pressure=pressures, theory="mbma")
    expected = found.stiffness * CONDUCTIVITY / 25.0
    np.testing.assert_allclose(conductance(flux), expected, rtol=1e-2)


def test_a_macro_of_freecad_has_the_friction_of_the_joint():
    face = Surface(0.8, 0.06, 3.0, 1.0, 3.5, unit="um")
    joint = Joint(face, bodies="steel 4140 hard", nominal_area="4 cm^2", friction=0.2)
    asked = {"quantity": "solid_conductance", "friction_pressure": "5 MPa", "rows": 5}
    pressures = ("1 MPa", "50 MPa")
    macro = joint.export("freecad", pressures, length_unit="m", stress_unit="Pa", **asked)
    friction = re.search(r"\*FRICTION\n(\S+), (\S+)\n", card_of_freecad(macro))
    at = joint.at_pressure("5 MPa")
    # of a small unloading, over kappa: in GPa/um, of which one is 1e6 MPa/mm
    assert float(friction[1]) == 0.2
    assert float(friction[2]) == pytest.approx(1e6 * at.tangential_stiffness, rel=1e-3)


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
    said = subprocess.run(
        ["Rscript", "-e", script],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    names, *tables = said.stdout.strip().splitlines()
    assert names == "overclosure [mm]|pressure [MPa]"
    for table in tables:
        np.testing.assert_array_equal(
            np.array(table.split(), dtype=float), np.concatenate([law.x, law.y])
        )
