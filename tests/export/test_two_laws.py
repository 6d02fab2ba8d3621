"""Two laws in one program, in each language: neither hides the other's functions or numbers."""

import shutil
import subprocess
import sys

import numpy as np
import pytest

from mbma_tables import Surface, contact_law
from mbma_tables.export.code.law_code import law_files

AT = 0.25  # overclosure [mm]
C = """\
#include <stdio.h>
#include "road.h"
#include "seal.h"
int main(void) {{ printf("%.17g %.17g\\n", road_pressure({c}), seal_pressure({c})); return 0; }}
"""
FORTRAN = """\
program ask
  use road, only: of_road => pressure
  use seal, only: of_seal => pressure
  implicit none
  print "(2es25.16e3)", of_road({c}d0), of_seal({c}d0)
end program
"""
JAVASCRIPT = """\
import * as road from "./road.mjs";
import * as seal from "./seal.mjs";
console.log(road.pressure({c}), seal.pressure({c}));
"""
MATLAB = (
    "a = road(); b = seal(); printf('%.17g %.17g', a.pressure({c}), b.pressure({c}))\n"
)
PYTHON = "import road, seal\nprint(road.pressure({c}), seal.pressure({c}))\n"
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
}
LAWS = {"road": ("concrete", "calibrated"), "seal": ("asphalt", "persson")}


@pytest.mark.parametrize("target", PROGRAMS)
def test_two_laws_answer_in_one_program(target, tmp_path):
    end, file, text, *commands = PROGRAMS[target]
    for command in commands:
        program = command.split()[0]
        if program not in ("python", "./ask") and shutil.which(program) is None:
            pytest.skip(f"not installed: {program}")
    known = []
    for name, (surface, theory) in LAWS.items():
        rough = Surface.named(surface).to("mm")
        files = law_files(target, rough, "13.3 MPa", name=name, theory=theory)
        for key, content in files.items():
            (tmp_path / f"{name}{key or end}").write_text(content)
        law = contact_law(rough, "13.3 MPa", theory)
        known.append(float(law.pressure(law.h_max - AT)))
    (tmp_path / file).write_text(text.format(c=AT))
    for command in commands:
        words = [sys.executable if word == "python" else word for word in command.split()]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    assert 0 < known[0] != known[1] > 0
    found = np.array(done.stdout.split(), dtype=float)
    np.testing.assert_allclose(found, known, rtol=1e-13)
