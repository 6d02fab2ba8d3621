"""Laws tried in the program itself: CalculiX presses and heats two blocks, Octave looks up, ncdump and R read."""

import re
import subprocess

import numpy as np
import pytest
from law_points import needs

from mbma_tables import Surface, contact
from mbma_tables.export.data import matlab_reader, to_csv, to_matlab, to_netcdf
from mbma_tables.export.law_rows import describe_law
from mbma_tables.export.solvers import calculix

SIDE = {"mm": 10.0, "m": 0.01}


def blocks(law, card, compressions, side, stiff):
    """Two blocks of one element each, so stiff that they do not count, the upper one pressed down step by step."""
    nodes = ""
    for number, z in enumerate((0.0, side, side, 2 * side)):
        for corner, (x, y) in enumerate(((0, 0), (side, 0), (side, side), (0, side))):
            nodes += f"{4 * number + corner + 1}, {x!r}, {y!r}, {z!r}\n"
    steps = "".join(
        "*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 1, 3\n4, 1, 3\n"
        + "".join(f"{node}, 1, 2\n{node}, 3, 3, {-c:.12e}\n" for node in (13, 14, 15, 16))
        + "".join(f"{node}, 1, 2\n" for node in (5, 6, 7, 8, 9, 10, 11, 12))
        + "*NODE PRINT, NSET=TOP, TOTALS=ONLY\nRF\n*END STEP\n"
        for c in compressions
    )
    return (
        f"*NODE, NSET=ALL\n{nodes}*NSET, NSET=TOP\n13, 14, 15, 16\n*NSET, NSET=SLAVE\n9, 10, 11, 12\n"
        "*ELEMENT, TYPE=C3D8, ELSET=LOW\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
        "*ELEMENT, TYPE=C3D8, ELSET=UP\n2, 9, 10, 11, 12, 13, 14, 15, 16\n"
        f"*MATERIAL, NAME=STIFF\n*ELASTIC\n{stiff:.6e}, 0.\n"
        "*SOLID SECTION, ELSET=LOW, MATERIAL=STIFF\n*SOLID SECTION, ELSET=UP, MATERIAL=STIFF\n"
        "*SURFACE, NAME=MASTER, TYPE=ELEMENT\n1, S2\n*SURFACE, NAME=SLAVES, TYPE=ELEMENT\n2, S1\n"
        f"{card}*CONTACT PAIR, INTERACTION=ROUGH, TYPE=NODE TO SURFACE\nSLAVES, MASTER\n{steps}"
    )


@needs("ccx")
@pytest.mark.parametrize(("length", "stress", "theory"), [("mm", "MPa", "mbma"), ("m", "Pa", "calibrated")])
def test_calculix_feels_the_law(tmp_path, length, stress, theory):
    """Within 0.2% of the law itself from 1e-5 of the largest pressure asked for on."""
    surface, E_star = Surface.named("concrete").to(length), {"MPa": 13.3, "Pa": 13.3e6}[stress]
    top = 0.04 * E_star
    law = describe_law(surface, E_star, stress_unit=stress, pressures=(1e-5 * top, top), rtol=5e-4, theory=theory)
    pressures = np.geomspace(1.01e-5, 0.99, 30) * top
    found = contact(surface, pressure=pressures, E_star=E_star, theory=theory)
    side = SIDE[length]
    deck = blocks(law, calculix(law), float(surface.h_max) - found.mean_separation, side, stiff=1e9 * E_star)
    (tmp_path / "press.inp").write_text(deck)
    said = subprocess.run(["ccx", "press"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    reached = [
        abs(float(line.split()[2])) / side**2
        for line in (tmp_path / "press.dat").read_text().splitlines()
        if re.fullmatch(r"(\s+-?\d\.\d+E[+-]\d+){3}", line)
    ]
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


@needs("ncdump")
def test_ncdump_reads(tmp_path):
    law = describe_law(Surface.named("asphalt"), 20.0, length_unit="mm", stress_unit="MPa", rows=30)
    (tmp_path / "law.nc").write_bytes(to_netcdf(law))
    said = subprocess.run(["ncdump", "-p", "17", "law.nc"], cwd=tmp_path, capture_output=True, text=True, check=True)
    values = re.search(r"\n pressure = ([^;]*);", said.stdout).group(1)
    np.testing.assert_array_equal([float(v) for v in values.split(",")], law.y)
    assert 'pressure:units = "MPa"' in said.stdout


def heated(card, pressures, side, stiff, conductivity):
    """The two blocks pressed by forces, 100 degrees above and 0 below, steady state at each pressure."""
    deck = blocks(None, card, [], side, stiff).replace("NODE TO SURFACE", "SURFACE TO SURFACE")
    deck = deck.replace("*SOLID", f"*CONDUCTIVITY\n{conductivity!r}\n*EXPANSION\n0.\n*SOLID", 1)
    steps = "".join(
        "*STEP\n*COUPLED TEMPERATURE-DISPLACEMENT, STEADY STATE\n1., 1.\n*BOUNDARY\n"
        + "".join(f"{node}, 1, 3\n{node}, 11, 11, 0.\n" for node in (1, 2, 3, 4))
        + "".join(f"{node}, 1, 2\n" for node in range(5, 17))
        + "".join(f"{node}, 11, 11, 100.\n" for node in (13, 14, 15, 16))
        + "*CLOAD\n"
        + "".join(f"{node}, 3, {-p * side**2 / 4:.9e}\n" for node in (13, 14, 15, 16))
        + "*NODE PRINT, NSET=TOP, TOTALS=ONLY\nRFL\n*END STEP\n"
        for p in pressures
    )
    return deck + "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50.\n" + steps


@needs("ccx")
@pytest.mark.parametrize(("length", "stress"), [("mm", "MPa"), ("m", "Pa")], ids=["mm", "SI"])
def test_calculix_conducts_as_the_law_says(tmp_path, length, stress):
    """Heat through two blocks and their joint, against the resistances in series."""
    surface, k = Surface.named("challenge"), 50.0  # mW/(mm K), or W/(m K)
    law = describe_law(
        surface,
        "25 MPa",
        length_unit=length,
        stress_unit=stress,
        quantity="conductance",
        conductivity=k,
        conductivity_unit="W/(m K)",
        pressures=("1 kPa", "2 MPa"),
        rows=20,
    )
    side = SIDE[length]
    unit = {"MPa": 1.0, "Pa": 1e6}[stress]
    pressures = unit * np.geomspace(1.1e-3, 1.9, 8)
    card = calculix(law)
    # as its header says, of loads by forces alone
    slope = re.search(r"with the line (\S+) below", card.replace("\n** ", " "))[1]
    card = re.sub(r"=EXPONENTIAL\n.*\n", f"=LINEAR\n{slope}\n", card)
    (tmp_path / "heat.inp").write_text(heated(card, pressures.tolist(), side, 1e6 * unit, k))
    said = subprocess.run(["ccx", "heat"], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    flux = [
        abs(float(line)) / side**2
        for line in (tmp_path / "heat.dat").read_text().splitlines()
        if re.fullmatch(r"\s+-?\d\.\d+E[+-]\d+", line)
    ]
    assert len(flux) == 8, said.stdout[-2000:]
    joint = 1 / (100 / np.array(flux) - 2 * side / k)
    found = contact(surface.to(length), pressure=pressures, E_star=25 * unit)
    np.testing.assert_allclose(joint, found.stiffness * k / (25 * unit), rtol=1e-2)


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
