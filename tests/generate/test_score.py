"""Scores of theories: a row against its deviations computed otherwise, and files without a theory."""

import re

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.special import erf

from generate.__main__ import main
from generate.distances import OTHERS, RANGES, held_out, theories_of
from generate.theories_of_others import FORCES, Corrected
from mbma_tables import InputError, Surface
from mbma_tables.laws.calibrated import PERSSON, Law, Spectrum

# an exponential law that is inverted in closed form
POWER, DECAY, KAPPA = 0.4, 0.5, 1.8
FILE = f"""
import numpy as np

name = "exponential"

def answer(surface, mean_separation):
    pressure = {POWER} * surface.q0 * surface.h_rms * np.exp(-mean_separation / ({DECAY} * surface.h_rms))
    return pressure, {KAPPA} * pressure / surface.rms_gradient
"""
INVERTED = f"""
import numpy as np

class Exponential:
    name = "inverted"

    def at_pressure(self, surface, pressure):
        p0 = {POWER} * surface.q0 * surface.h_rms
        return {KAPPA} * pressure / surface.rms_gradient, -{DECAY} * surface.h_rms * np.log(pressure / p0)

theory = Exponential()
"""


def scored(path):
    done = CliRunner().invoke(main, ["score", str(path)], catch_exceptions=False)
    assert done.exit_code == 0
    return [[float(x) for x in re.findall(r"[\d.]+", line)] for line in done.stdout.splitlines()[2:]]


def expected():
    """Deviations of area and pressure of the file's law [%], in closed form."""
    seen = held_out()
    force, area, u = (np.concatenate([getattr(one, name) for one in seen]) for name in ("force", "area", "u"))
    g = np.concatenate([np.full(one.force.shape, one.surface.rms_gradient) for one in seen])
    touching = np.where(force * g < POWER, np.log(KAPPA * force / area), np.nan)
    errors = touching, np.log(POWER / g / force) - u / DECAY
    inside = [(area >= low) & (area <= high) for low, high in RANGES]
    return [100 * np.sqrt(np.nanmean(own[some] ** 2)) for own in errors for some in inside]


def test_a_row_is_what_the_data_set_says(tmp_path):
    (tmp_path / "own.py").write_text(FILE)
    (tmp_path / "other.py").write_text(INVERTED)
    (row,), (inverted,) = scored(tmp_path / "own.py"), scored(tmp_path / "other.py")
    assert row[:4] == pytest.approx(expected(), rel=0.05)
    # one law, given at gaps and at pressures
    assert inverted[:4] == pytest.approx(row[:4], rel=0.05)


def test_perssons_theory_is_the_correction_without_one():
    surface = Surface(0.7, 1.0, 40.0, 1.0, 3.3)
    law = Law(Spectrum.self_affine(0.7, 40.0), None, PERSSON)
    force = FORCES[(FORCES > 1e-3) & (FORCES < 2)]
    area, u = Corrected("none", (1.0,)).at_pressure(surface, force * float(surface.rms_gradient))
    assert area == pytest.approx(law.area(force), rel=1e-3)
    assert u == pytest.approx(law.separation(force), rel=1e-3, abs=1e-7)
    # the cover by its own equation solves it
    xu = theories_of(OTHERS)["Xu et al. 2024"]
    P = xu.cover(np.array([0.3, 1.0]))
    right = 2 * FORCES**2 / (np.array([[0.3], [1.0]]) * (xu.gamma + (1 - xu.gamma) * P))
    assert pytest.approx(erf(np.sqrt(right)), abs=1e-9) == P


@pytest.mark.parametrize("text", ["", "x = 3\n", "class Theory:\n    name = 'a'\n    def answer(self, s, u): ...\n"])
def test_files_without_a_theory_are_refused(text, tmp_path):
    (tmp_path / "none.py").write_text(text)
    with pytest.raises(InputError, match=r"must have a function answer\(surface, mean_separation\) or at_pressure"):
        theories_of(tmp_path / "none.py")
