"""What running exports in their programs found, each as a test of its own."""

from __future__ import annotations

import re
import subprocess
from typing import Any

import numpy as np
import pytest
from law_points import needs
from test_solver_runs import blocks

from mbma_tables import Surface, contact, contact_law
from mbma_tables.export import solvers
from mbma_tables.export.law_rows import LawTable, describe_law

SIDE, BLOCKS, CONDUCTIVITY = 10.0, 1e6, 50.0  # mm, MPa, mW/(mm K)
ROUGH = Surface.named("challenge").to("mm")
PRESSURES = np.geomspace(0.012, 1.9, 6)  # MPa
HEAT = {"conductivity": CONDUCTIVITY, "conductivity_unit": "mW/(mm K)"}


def heat_law(**options: Any) -> LawTable:
    asked = {"quantity": "conductance", "pressures": ("10 kPa", "2 MPa"), "rows": 20, **HEAT}
    return describe_law(ROUGH, "25 MPa", **(asked | options))


def calculix(deck: str, folder: Any) -> tuple[subprocess.CompletedProcess[str], np.ndarray, np.ndarray]:
    """What CalculiX says of a deck, and the pressures and heat fluxes at the ends of its steps."""
    (folder / "joint.inp").write_text(deck)
    said = subprocess.run(["ccx", "joint"], cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    rows = [
        [abs(float(word)) / SIDE**2 for word in line.split()]
        for line in (folder / "joint.dat").read_text().splitlines()
        if re.fullmatch(r"(\s+-?\d\.\d+E[+-]\d+)+", line)
    ]
    return said, np.array([row[2] for row in rows if len(row) == 3]), np.array([r[0] for r in rows if len(r) == 1])


def pressed(card: str, c: np.ndarray, p: np.ndarray, coupled: str = "*COUPLED") -> str:
    """Two blocks pressed by displacements and heated, in one step for each overclosure."""
    deck = blocks(None, card, [], SIDE, BLOCKS).replace("NODE TO SURFACE", "SURFACE TO SURFACE")
    deck = deck.replace("*SOLID", f"*CONDUCTIVITY\n{CONDUCTIVITY!r}\n*EXPANSION\n0.\n*SOLID", 1)
    ends = "".join(f"{node}, 1, 3\n{node}, 11, 11, 0.\n" for node in (1, 2, 3, 4))
    ends += "".join(f"{node}, 1, 2\n" for node in range(5, 17))
    ends += "".join(f"{node}, 11, 11, 100.\n" for node in (13, 14, 15, 16))
    output = "".join(f"*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000\n{what}\n" for what in ("RF", "RFL"))
    steps = "".join(
        f"*STEP, INC=1000\n{coupled} TEMPERATURE-DISPLACEMENT, STEADY STATE\n1., 1.\n*BOUNDARY\n{ends}"
        + "".join(f"{node}, 3, 3, {-down:.9e}\n" for node in (13, 14, 15, 16))
        + f"{output}*END STEP\n"
        for down in c + 2 * SIDE * p / BLOCKS
    )
    return f"{deck}*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 50.\n{steps}"


def conductance(flux: np.ndarray) -> np.ndarray:
    """That of the joint, in series with the blocks."""
    joint: np.ndarray = 1 / (100 / flux - 2 * SIDE / CONDUCTIVITY)
    return joint


@needs("ccx")
def test_calculix_has_closure_and_conductance_in_one_interaction(tmp_path: Any) -> None:
    law = contact_law(ROUGH, E_star="25 MPa")
    card, c = solvers.calculix(heat_law()), law.h_max - law.at_pressure(PRESSURES).mean_separation
    said, p, flux = calculix(pressed(card, c, PRESSURES), tmp_path)
    assert len(p) == len(flux) == PRESSURES.size, said.stdout[-1000:]
    # the pressure is the law's to what the card says of its closure, and the conductance is of that pressure
    stated = float(re.search(r"within (\d+)% of the law", card.replace("\n**", ""))[1]) / 100
    assert 0.1 < np.abs(np.log(p / PRESSURES)).max() < np.log1p(stated) + 0.06
    expected = CONDUCTIVITY / 25 * law.at_pressure(p).stiffness
    np.testing.assert_allclose(conductance(flux)[:-1], expected[:-1], rtol=1e-2)
    # beyond the last row it is that of the last
    assert p[-1] > heat_law().x[-1]
    assert conductance(flux)[-1] == pytest.approx(heat_law().y[-1], rel=1e-2)


@needs("ccx")
def test_calculix_uncoupled_is_an_increment_late(tmp_path: Any) -> None:
    law = contact_law(ROUGH, E_star="25 MPa")
    pressures = np.repeat([0.1, 0.5, 0.9], 2)
    c = law.h_max - law.at_pressure(pressures).mean_separation
    _, p, flux = calculix(pressed(solvers.calculix(heat_law()), c, pressures, "*UNCOUPLED"), tmp_path)
    off = conductance(flux) * 25 / CONDUCTIVITY / law.at_pressure(p).stiffness - 1
    # as the card says: loads must be held for one more increment
    assert (off[::2] < -0.3).all()
    assert np.abs(off[1::2]).max() < 1e-2
    assert "loads must be held for one more" in " ".join(solvers.calculix(heat_law()).replace("**", "").split())


@needs("ccx")
@pytest.mark.parametrize("rows", [20, 50])
def test_calculix_does_not_read_tabular_surface_to_surface(rows: int, tmp_path: Any) -> None:
    law = describe_law(ROUGH, "25 MPa", pressures=("10 kPa", "2 MPa"), rows=rows)
    found = contact(ROUGH, pressure=PRESSURES, E_star="25 MPa")
    deck = blocks(law, solvers.calculix(law), ROUGH.h_max - found.mean_separation, SIDE, 1e9)
    said, p, _ = calculix(deck.replace("NODE TO SURFACE\nSLAVES", "SURFACE TO SURFACE\nSLAVES"), tmp_path)
    assert (p < 1e-6).all()
    assert (said.returncode != 0) == (rows == 50)  # of Debian's build, which finds that the stack was overwritten
    text = " ".join(solvers.calculix(law).replace("**", "").split())
    assert "no force at up to 41 rows, without a message, and from 50 rows on it aborts" in text


def test_rows_of_conductance_are_where_it_is_used() -> None:
    law = heat_law()
    assert law.x[:2] == pytest.approx([0, 0.01], rel=1e-2)
    assert law.largest_error < 3e-3


def test_the_exponential_card_states_its_limits() -> None:
    text = solvers.exponential(Surface.named("concrete"), "13.3 MPa")
    for share, p in re.findall(r"(\d+)% up to p = ([\d.e-]+)", text):
        c0, p0 = map(float, text.splitlines()[-1].split(", "))
        found = contact(Surface.named("concrete"), pressure=float(p), E_star="13.3 MPa", theory="persson")
        written = p0 * np.exp((1.1 - found.mean_separation) / (c0 / np.log(100)))
        assert abs(written / float(p) - 1) == pytest.approx(float(share) / 100, rel=0.05)
    assert text.count("up to p") == 2
