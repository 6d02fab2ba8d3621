"""What several test files do alike."""

import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import warnings

import numpy as np
import pytest
from click.testing import CliRunner

from mbma_tables import Bodies, InputError, contact, contact_law, sensitivity
from mbma_tables.theories import Mbma

SCALE = int(os.environ.get("MBMA_GAUNTLET", "1"))  # multiplies the counts of random tests


def needs(*programs):
    missing = [program for program in programs if shutil.which(program) is None]
    return pytest.mark.skipif(
        bool(missing), reason=f"not installed: {', '.join(missing)}"
    )


def skip_without_package(target):
    """Skip a test of data whose package is not installed."""
    package = {"parquet": "pyarrow", "xlsx": "openpyxl"}.get(target)
    if package is not None:
        pytest.importorskip(package)


NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")


def assert_same_output(output, shown, rtol=1e-3):
    """The same words, and numbers that agree; spaces do not count."""
    assert NUMBER.sub("#", " ".join(output.split())) == NUMBER.sub(
        "#", " ".join(shown.split())
    )
    np.testing.assert_allclose(
        *(np.array(NUMBER.findall(text), float) for text in (output, shown)), rtol=rtol
    )


def difference_weights(offsets):
    """Weights of values at `offsets` for the derivative at 0, exact for polynomials of that many terms."""
    return np.linalg.solve(np.vander(offsets, increasing=True).T, np.eye(offsets.size)[1])


def with_slopes(law):
    """Pressure and area of a law, each with its slope by -d."""
    return (law.pressure, lambda separation: law.stiffness(separation=separation) / 2), (
        law.area,
        law.area_slope,
    )


def random_map(points, low, high, power=1.8, seed=1, phases=False):
    """A periodic random map with waves between `low` and `high` [1/step], amplitudes falling as a power of them.

    Of random `phases` alone its amplitudes are fixed.
    """
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((points, points)))
    noise /= np.abs(noise) if phases else 1
    q = np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points))
    return np.fft.irfft2(
        np.where((q > low) & (q < high), noise * np.maximum(q, 1e-3) ** -power, 0)
    )


def topographies():
    """The package SurfaceTopography, whose import warns of its own missing optional parts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip("SurfaceTopography")


def fresh(code, *arguments):
    """What `code` prints as JSON in a new interpreter."""
    command = [sys.executable, "-W", "error", "-c", code, *arguments]
    return json.loads(
        subprocess.run(command, capture_output=True, text=True, check=True).stdout
    )


def run(*arguments):
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
        text = str(caught.value)
        assert "\n" not in text
        assert "np." not in text
        # one traceback, not two
        assert caught.value.__suppress_context__ or caught.value.__context__ is None

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


WORDS = [
    *b' nan inf -1 1e400 [ ] { } = , # \n \x00 \xff \' " """ 1979-05-27T07:32:00Z \xef\xbb\xbf'.split(
        b" "
    )
]
WORDS += [b"0" * 400, b"9" * 5000, b"0x" + b"f" * 9000, "\u202e\u00b2\u0663".encode()]
WORDS += [3000 * word for word in (b"[", b'{"a":', b"a=", b"a.")]


def spoilt(content, rng):
    """Bytes with a few cut, doubled, swapped or replaced places."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at, to = sorted(int(place) for place in rng.integers(0, len(data) + 1, 2))
        kind = rng.integers(6)
        if kind == 0:
            del data[at : min(to, at + 40)]
        elif kind == 1:
            data[at:at] = data[at : min(to, at + 200)]
        elif kind == 2:
            data[at:at] = WORDS[rng.integers(len(WORDS))]
        elif kind == 3 and data:
            data[min(at, len(data) - 1)] = rng.integers(256)
        elif kind == 4:
            length = min(40, (to - at) // 2)
            data[at : at + length], data[to - length : to] = (
                data[to - length : to],
                data[at : at + length],
            )
        else:
            data = data[: max(at, 1)]
    return bytes(data)


def compiled_law(source, *options, name="road"):
    """A law in C, compiled by gcc without a warning: its functions, by what they answer, of arrays."""
    library = source.with_suffix(".so")
    command = [
        "gcc",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        *options,
        "-shared",
        "-fPIC",
        str(source),
        "-lm",
    ]
    subprocess.run([*command, "-o", str(library)], check=True)
    law = ctypes.CDLL(str(library))

    def answer(what, given):
        function = law[f"{name}_{what}"]
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
        with np.errstate(invalid="ignore"):
            return np.vectorize(function, otypes=[float])(given)

    answer.library = law
    return answer


OF_BODIES = ("E_star", "hardness", "metals", "conductivity", "nu", "E")
OF_MBMA = ("island_model", "variant", "rtol", "outside")


def sorted_arguments(bodies, arguments, of_theory=OF_MBMA):
    """Bodies and a theory from arguments by their names, and the arguments of neither."""
    others = dict(arguments)
    of_bodies = {name: others.pop(name) for name in OF_BODIES if name in others}
    if bodies is not None:
        fields = {name: getattr(Bodies.of(bodies), name) for name in OF_BODIES}
        stated = {name: value for name, value in fields.items() if value is not None}
        of_bodies = stated | of_bodies
    options = {name: others.pop(name) for name in of_theory if name in others}
    if options:
        assert others.get("theory", "mbma") == "mbma"
        others["theory"] = Mbma(**options)
    return Bodies(**of_bodies), others


def contact_of(surface, bodies=None, **arguments):
    """`contact`, with the constants of its bodies and the options of MBMA by their names."""
    bodies, others = sorted_arguments(bodies, arguments)
    return contact(surface, bodies, **others)


def law_of_names(surface, bodies=None, **arguments):
    """`contact_law`, with the same arguments; the tolerance is that of the law."""
    bodies, others = sorted_arguments(bodies, arguments, ("island_model", "variant"))
    return contact_law(surface, bodies, **others)


def sensitivity_of(surface, bodies=None, **arguments):
    """`sensitivity`, with the same arguments."""
    bodies, others = sorted_arguments(bodies, arguments)
    return sensitivity(surface, bodies, **others)
