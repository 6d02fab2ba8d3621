"""What several test files do alike."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

from mbma_tables import InputError

SCALE = int(os.environ.get("MBMA_GAUNTLET", "1"))  # multiplies the counts of random tests


def difference_weights(offsets):
    """Weights of values at `offsets` for the derivative at 0, exact for polynomials of that many terms."""
    return np.linalg.solve(np.vander(offsets, increasing=True).T, np.eye(offsets.size)[1])


def with_slopes(law):
    """Pressure and area of a law, each with its slope by -d."""
    return (law.pressure, lambda separation: law.stiffness(separation=separation) / 2), (law.area, law.area_slope)


def random_map(points, low, high, power=1.8, seed=1, phases=False):
    """A periodic random map with waves between `low` and `high` [1/step], amplitudes falling as a power of them.

    Of random `phases` alone its amplitudes are fixed.
    """
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((points, points)))
    noise /= np.abs(noise) if phases else 1
    q = np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points))
    return np.fft.irfft2(np.where((q > low) & (q < high), noise * np.maximum(q, 1e-3) ** -power, 0))


def fresh(code, *arguments):
    """What `code` prints as JSON in a new interpreter."""
    command = [sys.executable, "-W", "error", "-c", code, *arguments]
    return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def run(*arguments):
    """What `mbma` prints."""
    from mbma_tables.cli import main

    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert (result.exit_code, result.stderr) == (0, "")
    return result.stdout


def refused(*arguments):
    """What `mbma` says as it refuses: a line or two, and nothing else."""
    from mbma_tables.cli import main

    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert result.stderr.startswith("mbma: ")
    assert 1 <= len(result.stderr.splitlines()) <= 2
    return result.stderr


def refusals(ask, *rows, error=InputError):
    """A test of rows: arguments of `ask`, the type of the error if it is another, and what its message says."""

    @pytest.mark.parametrize("row", rows, ids=lambda row: row[-1])
    def test(row):
        *given, said = row
        kind = given.pop() if isinstance(given[-1], type) else error
        with pytest.raises(kind, match=said) as caught:
            ask(*given)
        assert "\n" not in str(caught.value)

    return test


def told(ask, *rows):
    """A test of rows, each of arguments of `ask` and of what is in the text that it answers."""

    @pytest.mark.parametrize("row", rows, ids=lambda row: row[-1])
    def test(row):
        *given, said = row
        assert said in ask(*given)

    return test


class Springs:
    """A user's theory: an exponential force, its area proportional to it."""

    name = "springs"

    def answer(self, surface, mean_separation):
        force = np.exp(-3 * mean_separation / surface.h_rms)
        return force, 0.1 * force
