"""The compiled functions against themselves as plain Python, which neither reads past an end nor reorders a sum."""

import functools
import json
import os
import pathlib
import subprocess
import sys

import numpy as np
import plain_answers
import pytest

PROGRAM = pathlib.Path(plain_answers.__file__)
# of rounding; derivatives of the table of four numbers are differences of nearby islands, and promised to 1e-6
ROUNDING, DIFFERENCED = 1e-11, 1e-6


@functools.cache
def plain():
    path = os.pathsep.join(filter(None, [str(PROGRAM.parents[1]), os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-W", "error", str(PROGRAM)]
    env = os.environ | {"PYTHONPATH": path}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("group", plain_answers.GROUPS, ids=lambda group: group.__name__)
def test_the_same_uncompiled(group):
    for name, value in group():
        own, other = np.ravel(value).astype(float), np.array(plain()[name])
        allowed = DIFFERENCED if name == "four numbers, slopes" else ROUNDING
        np.testing.assert_allclose(own, other, rtol=allowed, atol=0, err_msg=name)


def test_what_ends_without_an_answer():
    """Held by number, for two that agree may both be wrong."""
    from mbma_tables.models.universal_kernel import OK, UNRESOLVED, X_ABOVE

    found = {name: tuple(value) for name, value in plain_answers.statuses()}
    assert found == {
        "unresolved": (UNRESOLVED,) * 3,
        "nothing": (OK,) * 3,
        "outside": (X_ABOVE,) * 3,
        "at the table's end": (OK, OK, X_ABOVE),
        "no contact": (OK,) * 3,
    }
