"""Functions that tests tabulate, by their names as module:function."""

import os
import time

import numpy as np


def smooth(x, y):
    """Two outputs of two numbers."""
    return np.exp(x * y / 5) * x**1.5, np.sin(x) * y


def kinked(x, y):
    """A kink across one axis, where no box is halved."""
    return 1 + np.abs(x - 0.4231) + y * y


def steep(x, y):
    """A step along a diagonal, 1/40 wide."""
    return np.tanh(40 * (x + y - 1))


def periodic(x, y, z):
    """Periodic along its first axis."""
    return 3 + np.sin(2 * np.pi * x) * np.cos(3 * y) + z


def six(a, b, c, d, e, f):
    """Six numbers."""
    return np.exp(-(a * b + c * d + e * f))


def four(x, y, z, w):
    """Four numbers."""
    return 1 / (1 + x + 2 * y * z + w * w)


def bent(x, y=1.0, z=1.0):
    """Two outputs of one, two or three numbers, whose polynomials are not exact."""
    return np.exp(x * y * z), np.sin(3 * x * y + z)


def single(x):
    """One point a call."""
    return {"square": float(x) ** 2, "cube": float(x) ** 3}


def diagonal(x, y):
    """A kink along a diagonal."""
    return 1 + abs(x - y)


def raises(x):
    """Raises beyond 0.7."""
    if np.any(x > 0.7):
        raise ZeroDivisionError("too deep")
    return x


def not_a_number(x):
    """NaN beyond 0.7."""
    return np.where(x > 0.7, np.nan, 1 + x)


def holed(x, y):
    """Two outputs, NaN beyond 0.7 of the first number."""
    a = np.where(x > 0.7, np.nan, 1 + x * np.sin(3 * y))
    return a, np.exp(x + y)


def wrong_shape(x):
    """Three numbers whatever it is given."""
    return np.zeros(3)


def complex_numbers(x):
    """Numbers with an imaginary part."""
    return x + 1j


def texts(x):
    """No numbers."""
    return ["a"] * x.size


def negative(x):
    """Below 0 in half of its range."""
    return x - 0.5


def jump(x):
    """A jump of 1."""
    return np.where(x < 0.3217, 1.0, 2.0)


def slow(x, y):
    """As `smooth`, but 2 ms a call; the environment variable of that name makes one call of many end the process."""
    time.sleep(0.002)
    counter = os.environ.get("MBMA_TEST_CALLS")
    if counter:
        with open(counter, "ab") as stream:
            stream.write(b".")
        if os.path.getsize(counter) == int(os.environ["MBMA_TEST_END"]):
            os.kill(os.getpid(), 9)
    return smooth(x, y)


def limping(x, y):
    """As `smooth`, but 0.1 s a call in the first process that calls it, of those that add their numbers to a file."""
    place = os.environ["MBMA_TEST_CALLS"]
    with open(place, "a+") as stream:
        stream.write(f"{os.getpid()}\n")
        stream.flush()
        stream.seek(0)
        first = int(stream.readline())
    time.sleep(0.1 if first == os.getpid() else 0.002)
    return smooth(x, y)


def killed_or_slow(number, mark, kills):
    """The square of a number; the first call of 0 ends its process, or takes 2 s."""
    if number == 0 and not os.path.exists(mark):
        with open(mark, "w"):
            pass
        if kills:
            os.kill(os.getpid(), 9)
        time.sleep(2.0)
    return number * number


def replica(x, y, seed=0, *, unused=None):
    """One of many calibrations: exponents that differ a little."""
    return np.exp(x * y / 5) * x ** (1.5 + 0.02 * np.sin(7 * seed)), np.sin(x) * y


def softer(x, y):
    """Another variant of `smooth`."""
    return np.exp(x * y / 6) * x**1.4, np.sin(x) * y


def bumped(x, y):
    """A third variant, with a bump in one place."""
    return np.exp(x * y / 5 + 0.1 / (1 + 50 * (y - 0.6) ** 2)) * x, np.sin(x) * y


def waved(x, y):
    """A fourth variant, with a bump in one place of the other axis."""
    return np.exp(x * y / 5 + 0.1 / (1 + 50 * (np.log(x) - 1) ** 2)) * x, np.sin(x) * y


def half_of_persson(hurst, zeta_1, gap):
    """Totals of a theory with half of the pressure and area of Persson's."""
    from mbma_tables.theories.totals import totals_of

    found = totals_of("persson", of_h_max=False)(hurst, zeta_1, gap)
    return {name: 0.5 * values for name, values in found.items()}


def island(X, spread, sphere, hurst):
    """Force and area of the paper's island on the axes of the four-number table."""
    from mbma_tables.islands import greenwood_tripp
    from mbma_tables.islands.variants import get_variant
    from mbma_tables.tables.island4d import band_fields

    mu = band_fields(spread, sphere, hurst, get_variant("reported"))[0]
    solved = greenwood_tripp.solve(X, mu, rtol=1e-9)
    rigid = greenwood_tripp.rigid_sphere(X, mu)
    return solved.phi_F / rigid[0], solved.phi_A / rigid[1]
