"""Odd maps; damaged scenes."""

import contextlib
import pathlib
import warnings

import numpy as np
import pytest
from helpers import SCALE, random_map, spoilt

from mbma_tables import MbmaError, Scene, Surface

ROUGH = random_map(40, 0, 1)
DTYPES = [
    "f2",
    "f4",
    ">f8",
    "f16",
    "i1",
    "i8",
    "u8",
    "?",
    "c16",
    "O",
    "U3",
    "S3",
    "M8[s]",
    "m8[s]",
    "V4",
    "f8,i4",
]
SPECIAL = [np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, 1e-200, 1e154, 1e300, -1e308, 1e18]


def odd_array(values, rng):
    """An array with a few faults: of shape, type, order or mask, or in some of its numbers."""

    def spotted(a):
        a = a.astype(float)
        a.flat[rng.integers(0, a.size, 4)] = SPECIAL[rng.integers(len(SPECIAL))]
        return a

    ways = [
        *(np.ravel, np.transpose, np.asfortranarray, spotted),
        *(lambda a: a[..., None], lambda a: a[None]),
        lambda a: a.astype(DTYPES[rng.integers(len(DTYPES))]),
        lambda a: np.ma.masked_array(
            a, rng.random(a.shape) < rng.choice([0.0, 0.01, 1.0])
        ),
        lambda a: a[tuple(slice(0, rng.integers(0, n + 1)) for n in a.shape)],
        lambda a: a[:: -int(rng.integers(1, 3))],
        lambda a: np.broadcast_to(a[:1], a.shape),
        lambda a: a * 10.0 ** rng.uniform(-310, 308),
    ]
    array = np.array(values)
    for _ in range(rng.integers(1, 4)):
        with (
            warnings.catch_warnings(),
            contextlib.suppress(TypeError, ValueError, IndexError),
        ):
            warnings.simplefilter("ignore")  # of numpy, while it makes the input
            array = ways[rng.integers(len(ways))](array)
    return array


def odd_number(rng):
    given = [
        1.0,
        1,
        np.float32(2),
        1e-30,
        1e30,
        1e300,
        5e-324,
        0,
        -1,
        np.nan,
        np.inf,
        10**400,
        True,
        "1",
        None,
        [1.0],
    ]
    return (
        given[rng.integers(len(given))]
        if rng.integers(3) == 0
        else float(10 ** rng.uniform(-3, 3))
    )


def options(rng):
    every = {
        "periodic": rng.integers(2) == 0,
        "detrend": [None, "mean", "plane", "quadratic", "cubic", 1][rng.integers(6)],
        "h_max": odd_number(rng),
        "band": [None, (0.3, 2.0), (2.0, 0.3), (1, 2, 3), (np.nan, 1.0), "ab", 5][
            rng.integers(7)
        ],
    }
    return {key: value for key, value in every.items() if rng.integers(3) == 0}


def read(reader, *given):
    """What a reader answers; None for a typed error. Anything else comes through."""
    try:
        return reader(*given)
    except (MbmaError, OSError):
        return None


def test_map_arrays():
    rng = np.random.default_rng(11)
    for _ in range(100 * SCALE):
        heights = odd_array(ROUGH, rng)
        before = np.asarray(heights).tobytes()
        found = read(lambda: Surface.from_map(heights, odd_number(rng), **options(rng)))  # noqa: B023
        for name in ("q0", "q1", "h_rms", "h_max"):
            assert 0 < getattr(found, name, 1.0) < np.inf
        assert np.asarray(heights).tobytes() == before


EXAMPLES = pathlib.Path(__file__).parents[1] / "examples"
SCENES = sorted(path.name for path in EXAMPLES.glob("scene_*.toml"))


def scene_numbers(path):
    scene = Scene.from_toml(path)
    surface = scene.surface
    return [
        scene.in_units.E_star,
        scene.rtol or 1e-3,
        surface.hurst,
        surface.q0,
        surface.q1,
        surface.h_rms,
        surface.h_max,
    ]


@pytest.mark.parametrize("name", SCENES)
def test_scene_bytes(name, tmp_path):
    rng = np.random.default_rng(3)
    path = tmp_path / "scene.toml"
    text = (EXAMPLES / name).read_bytes()
    for _ in range(60 * SCALE):
        content = spoilt(text, rng)
        path.write_bytes(content)
        assert np.isfinite(np.asarray(read(scene_numbers, path) or 0, dtype=float)).all()
        assert path.read_bytes() == content
