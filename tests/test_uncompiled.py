"""Tests of every layer without numba: as plain Python, loops neither read past an end nor reorder a sum."""

import subprocess
import sys

import pytest

WITHOUT_NUMBA = (
    "import sys, pytest\n"
    "sys.modules['numba'] = sys.modules['llvmlite'] = None\n"
    "sys.exit(pytest.main(['-n', '0', '-p', 'no:cacheprovider', '-m', 'not slow', *sys.argv[1:]]))\n"
)
# those that ask few islands of loops that numba makes fast
TESTS = (
    "tests/islands/test_island.py",
    "tests/islands/test_classical.py::test_agrees_with_newton_within_its_own_error",
    "tests/models/test_four_number_slopes.py",
    "tests/models/test_model_limits.py",
    "tests/tablefiles/test_splines.py",
    "tests/theories/test_laws_of_theories.py::test_a_force_that_turns_and_a_stiffness_that_passes_its_maximum",
    "tests/theories/test_laws_of_theories.py::test_inverses[cones]",
    "tests/theories/test_laws_of_theories.py::test_inverses[greenwood_williamson]",
    "tests/theories/test_protocol.py",
    "tests/totals/test_contact.py::test_one_quantity_alone",
    "tests/totals/test_cover.py",
    "tests/totals/test_kernel.py",
    "tests/totals/test_own_models.py",
    "tests/totals/test_tiers.py::test_outside_as_nan",
)


@pytest.mark.slow
def test_they_pass_without_numba(pytestconfig):
    command = [sys.executable, "-c", WITHOUT_NUMBA, *TESTS]
    done = subprocess.run(command, cwd=pytestconfig.rootpath, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
