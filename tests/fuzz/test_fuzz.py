"""Odd maps and spectra; spoilt table files, under right hashes too; damaged scenes."""

import pathlib
import warnings

import numpy as np
import pytest
from fuzzing import finite, spoilt
from helpers import SCALE
from small_tables import edited

from mbma_tables import Scene, Surface
from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.tables import verify
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.netcdf import attributes_digest, digest_arrays, read_table
from mbma_tables.tablefiles.schema import KINDS, UNIVERSAL

POINTS = 40
NOISE = np.random.default_rng(0).standard_normal((POINTS, POINTS))
Q = 2 * np.pi * np.hypot(np.fft.fftfreq(POINTS)[:, None], np.fft.rfftfreq(POINTS)[None, :])
ROUGH = np.fft.irfft2(np.fft.rfft2(NOISE) / np.where(Q > 0, Q, np.inf) ** 1.8, s=NOISE.shape)
DTYPES = ["f2", "f4", ">f8", "f16", "i1", "i8", "u8", "?", "c16", "O", "U3", "S3", "M8[s]", "m8[s]", "V4", "f8,i4"]
SPECIAL = [np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, 1e-200, 1e154, 1e300, -1e308, 1e18]


def odd_array(values, rng):
    """An array like the given one in an odd type, shape, order or with odd entries."""
    array = np.array(values)
    for _ in range(rng.integers(1, 4)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numpy, while it makes the input
            match rng.integers(12):
                case 0:
                    try:
                        array = array.astype(DTYPES[rng.integers(len(DTYPES))])
                    except (TypeError, ValueError):
                        continue
                case 1 | 2 if array.dtype.kind == "f" and array.size:
                    array = array.copy()
                    at = rng.integers(0, array.size, rng.integers(1, 5))
                    array.flat[at] = SPECIAL[rng.integers(len(SPECIAL))]
                case 3 if array.ndim and array.dtype.kind == "f":
                    array = array.copy()
                    array[rng.integers(0, max(len(array), 1)) :] = SPECIAL[rng.integers(len(SPECIAL))]
                case 4 if array.dtype.kind == "f":
                    array = array * 10.0 ** rng.uniform(-310, 308)
                case 5:
                    array = array.reshape([(-1,), (*array.shape, 1), (1, *array.shape), array.shape][rng.integers(4)])
                case 6 if array.ndim:
                    array = array[tuple(slice(0, rng.integers(0, n + 1)) for n in array.shape)]
                case 7:
                    array = array.T
                case 8 if array.ndim:
                    array = array[:: -int(rng.integers(1, 3))]
                case 9:
                    array = np.asfortranarray(array)
                case 10:
                    array = np.ma.masked_array(array, rng.random(array.shape) < rng.choice([0.0, 0.01, 1.0]))
                case 11 if array.ndim:
                    array = np.broadcast_to(array[:1], array.shape)
    return array


def odd_number(rng):
    """Something in place of a length."""
    given = [1.0, 1, np.float32(2), 1e-30, 1e30, 1e300, 5e-324, 0, -1, np.nan, np.inf, 10**400, True, "1", None, [1.0]]
    return given[rng.integers(len(given))] if rng.integers(3) == 0 else float(10 ** rng.uniform(-3, 3))


def options(rng):
    every = {
        "periodic": rng.integers(2) == 0,
        "detrend": [None, "mean", "plane", "quadratic", "cubic", 1][rng.integers(6)],
        "h_max": odd_number(rng),
        "band": [None, (0.3, 2.0), (2.0, 0.3), (1, 2, 3), (np.nan, 1.0), "ab", 5][rng.integers(7)],
    }
    return {key: value for key, value in every.items() if rng.integers(3) == 0}


def surface_is_right(surface):
    """A surface of positive finite numbers; or none."""
    numbers = () if surface is None else (surface.q0, surface.q1, surface.h_rms, surface.h_max)
    numbers += (surface.hurst,) if isinstance(surface, Surface) else ()
    return finite(*numbers) and all(number > 0 for number in numbers)


def test_map_arrays(tally):
    rng = np.random.default_rng(11)
    for _ in range(100 * SCALE):
        heights = odd_array(ROUGH, rng)
        before = np.asarray(heights).tobytes()
        found = tally.read(lambda: Surface.from_map(heights, odd_number(rng), **options(rng)))  # noqa: B023
        assert surface_is_right(found)
        assert np.asarray(heights).tobytes() == before


def test_spectra(tally):
    rng = np.random.default_rng(13)
    q = np.geomspace(1.0, 100.0, 50)
    for _ in range(50 * SCALE):
        given = (odd_array(q, rng), q**-3.4) if rng.integers(2) else (q, odd_array(q**-3.4, rng))
        own = {key: value for key, value in options(rng).items() if key == "band"}
        own["convention"] = ["paper", "isotropic", "profile", "none", None][rng.integers(5)]
        own["model"] = ["self-affine", "measured"][rng.integers(2)]
        assert surface_is_right(tally.read(lambda: Surface.from_spectrum(*given, h_max=odd_number(rng), **own)))  # noqa: B023


SPECIAL_VALUES = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 700.1, 5e-324)
ODD = ("", "x" * 5000, -1, 0, 2**40, 5e-324, 1e308, np.nan, -np.inf, [1.5, 2.5], "1", "log", "a\nb")


def forge(dataset, rng):
    """Something odd in one or two places, under hashes that are right."""
    for _ in range(rng.integers(1, 3)):
        variable = list(dataset.variables.values())[rng.integers(len(dataset.variables))]
        owner = (dataset, variable, None)[rng.integers(3)]
        if owner is None:
            values = variable[...]
            values.flat[rng.integers(0, values.size, 3)] = SPECIAL_VALUES[rng.integers(len(SPECIAL_VALUES))]
            variable[...] = values
        else:
            name = owner.ncattrs()[rng.integers(len(owner.ncattrs()))]
            if rng.integers(4):
                owner.setncattr(name, ODD[rng.integers(len(ODD))])
            else:
                owner.delncattr(name)
    values = {name: np.ma.getdata(variable[...]) for name, variable in dataset.variables.items()}
    dataset.setncattr("values_sha256", digest_arrays(values))
    dataset.setncattr("attributes_sha256", attributes_digest(dataset))


def answers(path):
    """Answers of a table, as far as its axes reach, and how far its conformance points are from them."""
    content = read_table(path)
    places = np.linspace(0, 1, 7)
    if content.kind == UNIVERSAL:
        X, mu = (axis.coordinate(places * (axis.nodes - 1)) for axis in content.axes)
        found = UniversalModel(content).answer(X[:, None], mu)
        values = found.phi_F, found.phi_A, found.error
    else:
        raw = (content.conformance[name] for name in ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst"))
        values = tuple(Island4dModel(content).lookup(*raw))
    return (*values, verify(path).table_error)


@pytest.mark.parametrize("kind", KINDS)
def test_content_under_right_hashes(kind, sources, tmp_path, tally):
    rng = np.random.default_rng(23)
    path = tmp_path / "table.nc"
    # the file as it is passes
    assert finite(*answers(edited(path, sources[kind], lambda dataset: None)))
    for _ in range(40 * SCALE):
        edited(path, sources[kind], lambda dataset: forge(dataset, rng))
        found = tally.read_file(path, path.read_bytes(), answers)
        assert found is None or finite(*found)


EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"
SCENES = sorted(path.name for path in EXAMPLES.glob("scene_*.toml"))


def scene_numbers(path):
    scene = Scene.from_toml(path)
    surface = scene.surface
    return [scene.E_star, scene.rtol or 1e-3, surface.hurst, surface.q0, surface.q1, surface.h_rms, surface.h_max]


@pytest.mark.parametrize("name", SCENES)
def test_scene_bytes(name, tmp_path, tally):
    rng = np.random.default_rng(3)
    path, text = tmp_path / "scene.toml", (EXAMPLES / name).read_bytes()
    for _ in range(60 * SCALE):
        found = tally.read_file(path, spoilt(text, rng), scene_numbers)
        assert found is None or finite(*found)
