"""Two laws in one program, in each language: neither hides the other's functions or numbers."""

import shutil

import numpy as np
import pytest
from law_points import TANGENTS, VALUES

from benchmarks import programs
from mbma_tables import Bodies, Surface, contact_law
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.code.law_code import law_files

SLOW = ("jax-law", "matlab-law", "modelica-law")
AT = 0.25  # overclosure [mm]
LAWS = {"road": "concrete", "seal": "asphalt"}
HARDNESS = 1.0  # [MPa]
CONDUCTIVITY = 45.0
# of subroutines, which are the C, tests/export/test_law_code.py has several laws
PLAIN = [name for name, language in LANGUAGES.items() if not language.subroutine]


def marks(target):
    """Marks of a language, strict where its tool fails: docs/export.md says so."""
    slow = [pytest.mark.slow] if target in SLOW else []
    reason = "rumoca 0.10 takes the functions of the last package for both"
    fails = pytest.mark.xfail(strict=True, raises=AssertionError, reason=reason)
    return [*slow, fails] if target == "modelica-law" else slow


@pytest.mark.parametrize("target", [pytest.param(n, marks=marks(n)) for n in PLAIN])
def test_two_yielded_laws_answer_in_one_program(target, tmp_path):
    """Each has the elastic law beside its own, along which it unloads."""
    for module in LANGUAGES[target].program.modules:
        pytest.importorskip(module)
    program = LANGUAGES[target].program
    for command in program.built([*LAWS]):
        word = command.split()[0]
        if word not in ("python", "./ask") and shutil.which(word) is None:
            pytest.skip(f"not installed: {word}")
    known = []
    conducted = []
    asked = {"theory": "calibrated", "hardness": HARDNESS}
    heat = {"conductivity": CONDUCTIVITY, "conductivity_unit": "W/(m K)"}
    for name, surface in LAWS.items():
        rough = Surface.named(surface).to("mm")
        files = law_files(target, rough, "13.3 MPa", name=name, **asked, **heat)
        for key, content in files.items():
            (tmp_path / f"{name}{key or program.end}").write_text(content)
        law = contact_law(rough, Bodies("13.3 MPa", hardness=HARDNESS), "calibrated")
        pressed = law.at(mean_separation=law.h_max - AT)
        known.append(float(pressed.pressure))
        conducted.append(CONDUCTIVITY / 13.3 * float(pressed.unloading_stiffness))
        # not along its own slope
        assert pressed.unloading_stiffness > 1.05 * pressed.stiffness
    functions = ["pressure", "solid_conductance"]
    found = programs.run(program, functions, np.array([AT]), tmp_path, [*LAWS])
    assert 0 < known[0] != known[1] > 0
    np.testing.assert_allclose(found[::2, 0], known, rtol=VALUES)
    np.testing.assert_allclose(found[1::2, 0], conducted, rtol=TANGENTS)
