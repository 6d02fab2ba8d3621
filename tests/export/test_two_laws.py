"""Two laws in one program, in each language: neither hides the other's functions or numbers."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from law_points import TANGENTS, VALUES

from mbma_tables import Bodies, Surface, contact_law
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.code.law_code import law_files

SLOW = ("jax-law", "matlab-law", "modelica-law")
AT = 0.25  # overclosure [mm]
C = """\
#include <stdio.h>
#include "road.h"
#include "seal.h"
int main(void) {{
    printf("%.17g %.17g ", road_pressure({c}), seal_pressure({c}));
    printf("%.17g %.17g\\n", road_solid_conductance({c}), seal_solid_conductance({c}));
    return 0;
}}
"""
FORTRAN = """\
program ask
  use road, only: of_road => pressure, road_conducts => solid_conductance
  use seal, only: of_seal => pressure, seal_conducts => solid_conductance
  implicit none
  print "(4es25.16e3)", of_road({c}d0), of_seal({c}d0), road_conducts({c}d0), seal_conducts({c}d0)
end program
"""
JAVASCRIPT = """\
import * as road from "./road.mjs";
import * as seal from "./seal.mjs";
console.log(road.pressure({c}), seal.pressure({c}));
console.log(road.solid_conductance({c}), seal.solid_conductance({c}));
"""
MATLAB = """\
a = road(); b = seal(); printf('%.17g %.17g ', a.pressure({c}), b.pressure({c}))
printf('%.17g %.17g', a.solid_conductance({c}), b.solid_conductance({c}))
"""
PYTHON = """\
import road, seal
print(road.pressure({c}), seal.pressure({c}))
print(road.solid_conductance({c}), seal.solid_conductance({c}))
"""
JAX = f'import jax\njax.config.update("jax_enable_x64", True)\n{PYTHON}'
MODELICA = """\
import pathlib
import rumoca
MODEL = '''
model Ask
  Real c, y1, y2, y3, y4;
equation
  c = {c} + 0*time;
  y1 = road.pressure(c);
  y2 = seal.pressure(c);
  y3 = road.solid_conductance(c);
  y4 = seal.solid_conductance(c);
end Ask;
'''
both = pathlib.Path("both", "both.mo")
both.parent.mkdir()
both.write_text(pathlib.Path("road.mo").read_text() + pathlib.Path("seal.mo").read_text() + MODEL)
found = rumoca.Session().load(str(both), model="Ask").simulate(t=(0, 1), dt=1)
print(*(repr(float(found[name][0])) for name in ("y1", "y2", "y3", "y4")))
"""
# by target: end of a law's file, program, and the commands that build and run it
PROGRAMS = {
    "c-law": (".c", "ask.c", C, "gcc road.c seal.c ask.c -o ask -lm", "./ask"),
    "fortran-law": (
        ".f90",
        "ask.f90",
        FORTRAN,
        "gcc -c road_c.c seal_c.c",
        "gfortran road_c.o seal_c.o road.f90 seal.f90 ask.f90 -o ask",
        "./ask",
    ),
    "javascript-law": (".mjs", "ask.mjs", JAVASCRIPT, "node ask.mjs"),
    "matlab-law": (".m", "ask.m", MATLAB, "octave-cli --no-init-file ask.m"),
    "python-law": (".py", "ask.py", PYTHON, "python ask.py"),
    "jax-law": (".py", "ask.py", JAX, "python ask.py"),
    "modelica-law": (".mo", "ask.py", MODELICA, "python ask.py"),
}
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
    end, file, text, *commands = PROGRAMS[target]
    for command in commands:
        program = command.split()[0]
        if program not in ("python", "./ask") and shutil.which(program) is None:
            pytest.skip(f"not installed: {program}")
    known = []
    conducted = []
    asked = {"theory": "calibrated", "hardness": HARDNESS}
    heat = {"conductivity": CONDUCTIVITY, "conductivity_unit": "W/(m K)"}
    for name, surface in LAWS.items():
        rough = Surface.named(surface).to("mm")
        files = law_files(target, rough, "13.3 MPa", name=name, **asked, **heat)
        for key, content in files.items():
            (tmp_path / f"{name}{key or end}").write_text(content)
        law = contact_law(rough, Bodies("13.3 MPa", hardness=HARDNESS), "calibrated")
        pressed = law.at(mean_separation=law.h_max - AT)
        known.append(float(pressed.pressure))
        conducted.append(CONDUCTIVITY / 13.3 * float(pressed.unloading_stiffness))
        # not along its own slope
        assert pressed.unloading_stiffness > 1.05 * pressed.stiffness
    (tmp_path / file).write_text(text.format(c=AT))
    for command in commands:
        words = [sys.executable if word == "python" else word for word in command.split()]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert 0 < known[0] != known[1] > 0
    found = np.array(done.stdout.split(), dtype=float)
    np.testing.assert_allclose(found[:2], known, rtol=VALUES)
    np.testing.assert_allclose(found[2:], conducted, rtol=TANGENTS)
