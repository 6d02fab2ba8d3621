"""Public names, typed errors, and the messages of the argument checks."""

import contextlib
import functools
import math

import h5py
import numpy as np
import pytest
import xarray as xr
from helpers import contact_of, fresh, refusals

import mbma_tables
from mbma_tables import (
    Bodies,
    Surface,
    contact,
    contact_law,
    flow_factors,
    greenwood_tripp,
    island,
    open_table,
)
from mbma_tables.bodies.materials import effective_modulus
from mbma_tables.common.arguments import SHOWN, finite_array, require
from mbma_tables.common.errors import (
    ConvergenceError,
    InputError,
    MbmaError,
    NotSelfAffineError,
    OutOfRangeError,
)
from mbma_tables.islands.greenwood_tripp import height_integral
from mbma_tables.theories import Mbma


def test_one_base_and_the_builtin_kinds():
    for kind in (InputError, NotSelfAffineError):
        assert issubclass(kind, MbmaError)
        assert issubclass(kind, ValueError)
    assert issubclass(OutOfRangeError, InputError)
    assert set(ConvergenceError.__bases__) == {MbmaError, ArithmeticError}


test_what_is_no_number_is_named = refusals(
    lambda value: finite_array("x", value),
    (math.nan, "x must be finite, got nan"),
    ([1.0, math.inf, -math.inf], r"x must be finite, got inf at \(1,\), -inf at \(2,\)$"),
    ([[1.0, math.nan]], r"x must be finite, got nan at \(0, 1\)$"),
    ([math.nan] * 5, r"nan at \(2,\) and 2 more$"),
    ([], "x is empty: at least one number is needed"),
    (np.ones((0, 3)), "x is empty"),
    ("deep", "x must be real numbers: entries of type"),
    (1j, "x must be real numbers: entries of type complex128"),
    (True, "x must be real numbers: entries of type bool"),
    (None, "x must be real numbers"),
    ([1.0, [2.0, 3.0]], "x must be real numbers"),
    (10**400, "x must be real numbers"),
    (np.datetime64("2020-01-01"), "x must be real numbers"),
)


@pytest.mark.parametrize(
    "take",
    [
        lambda x: finite_array("x", x),
        lambda x: height_integral(1.5, x),
        lambda x: Surface(0.8, 0.5, 100.0, x, 3.0),
        lambda x: contact(Surface.named("concrete"), separation=x),
        lambda x: greenwood_tripp.solve(x, 1.0),
    ],
)
def test_masked_entries_are_refused_not_uncovered(take):
    with pytest.raises(
        InputError,
        match=r"has 1 masked entries among 3: leave them out with \.compressed\(\), or put",
    ):
        take(np.ma.masked_array([0.1, 0.2, 0.3], [False, True, False]))
    take(np.ma.masked_array([0.1, 0.2, 0.3], False))


def test_quantities_of_other_libraries_are_refused():
    class Quantity:
        magnitude = 5.0

        def __array__(self, dtype=None, copy=None):
            return np.asarray(self.magnitude)

    given = [Quantity()]
    with contextlib.suppress(ImportError):
        import pint

        given += [5 * pint.UnitRegistry().MPa, np.ones(2) * pint.UnitRegistry().MPa]
    for quantity in given:
        with pytest.raises(
            InputError, match="pressure is a Quantity with a unit of its own: convert it"
        ):
            contact(ROAD, "1 GPa", pressure=quantity)


def test_other_containers_of_xarray_and_hdf5_are_refused(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        for value in (
            xr.Variable("t", [0.1]),
            xr.Dataset({"a": ("t", [0.1])}),
            file.create_dataset("x", data=[0.1]),
        ):
            message = f"x must be numbers, .* inside that {type(value).__name__}"
            with pytest.raises(InputError, match=message):
                finite_array("x", value)
            with pytest.raises(InputError, match="h_rms must be numbers"):
                Surface(0.8, 0.5, 100.0, value, 3.0)


ROUGH = Surface(0.8, 0.5, 100.0, 0.2, 0.6)
CALLS = {
    "Surface": (
        Surface,
        {"hurst": 0.8, "q0": 0.5, "q1": 100.0, "h_rms": 0.2, "h_max": 0.6},
    ),
    "from_moments": (
        Surface.from_moments,
        {"hurst": 0.7, "m0": 0.071, "m2": 0.27, "m4": 62.0, "h_max": 1.1},
    ),
    "power_spectrum": (ROUGH.power_spectrum, {"q": 1.0}),
    "height_integral": (functools.partial(height_integral, 1.5), {"x": 1.0}),
    "greenwood_tripp": (greenwood_tripp.solve, {"X": 1.0, "mu": 1.0}),
    "island": (functools.partial(island, ROUGH), {"delta": 0.1, "E_star": 1.0}),
    **{
        f"{theory} by {known}": (
            functools.partial(contact_of, ROUGH, theory=theory),
            {known: 0.1, "E_star": 1.0},
        )
        for theory in ("mbma", "greenwood_williamson", "persson", "calibrated")
        for known in ("separation", "mean_separation", "pressure", "area")
    },
    "universal": (open_table("universal").answer, {"X": 1.0, "mu": 1.0}),
    "island4d": (
        open_table("island4d").lookup,
        {"delta": 1.5, "zeta_d": 2.0, "zeta_u": 20.0, "hurst": 0.7},
    ),
    "law by separation": (contact_law(ROUGH, rtol=1e-3).pressure, {"separation": 0.3}),
    "effective_modulus": (
        effective_modulus,
        {"E1": 1.0, "nu1": 0.3, "E2": 2.0, "nu2": 0.3},
    ),
}


@pytest.mark.parametrize(
    ("call", "name"), [(call, name) for call, (_, good) in CALLS.items() for name in good]
)
def test_every_argument_is_refused_by_name(call, name):
    function, good = CALLS[call]
    for bad in (
        math.nan,
        math.inf,
        [0.5, -math.inf],
        [],
        "rough",
        None,
        [None],
        1j,
        True,
    ):
        # no pressure at all is another mistake
        if bad is not None or " by " not in call:
            with pytest.raises(InputError, match=f"^{name} "):
                function(**{**good, name: bad})


@pytest.mark.parametrize(
    "call", [call for call, (_, good) in CALLS.items() if len(good) > 1]
)
def test_shapes_that_do_not_broadcast_are_listed(call):
    function, good = CALLS[call]
    first, second = list(good)[:2]
    shapes = {first: [good[first]] * 2, second: [good[second]] * 3}
    with pytest.raises(
        InputError, match=rf"do not broadcast: .*{first} \(2,\).*{second} \(3,\)"
    ):
        function(**(good | shapes))


def test_out_of_range_entries_are_quoted():
    value = np.array([0.5, -1.0, -2.0, -3.0, -4.0])
    with pytest.raises(OutOfRangeError) as caught:
        require("x", value, value > 0, "positive")
    assert SHOWN == 3
    assert (
        str(caught.value)
        == "x must be positive, got -1 at (1,), -2 at (2,), -3 at (3,) and 1 more"
    )
    assert caught.value.mask.tolist() == [False, True, True, True, True]
    with pytest.raises(OutOfRangeError, match=r"^x must be positive, got -1$"):
        require("x", np.array(-1.0), np.array(False), "positive")
    require("x", value, value < 1, "below 1")
    # digits enough to tell neighbours apart
    with pytest.raises(OutOfRangeError, match=r"1\.0000000000000002$"):
        require("x", np.array(math.nextafter(1, 2)), np.array(False), "at most 1")


ROAD = Surface(0.8, 0.2, 40.0, 1.0, 3.0, unit="um")
BAND = {"longest": "100 um", "shortest": "2 um", "hurst": 0.8, "h_max": "9 um"}


test_natural_mistakes_have_a_message_with_the_remedy = refusals(
    lambda ask: ask(),
    (
        lambda: contact("concrete", separation=1.0),
        "surface must be a Surface, got 'concrete'; a named",
    ),
    (lambda: contact_law(None), "surface must be a Surface, got None"),
    (lambda: Surface.named([]), r"no surface is named \[\]; there are"),
    (
        lambda: contact(ROAD, separation=1.0, theory=np.ones(3)),
        r"theory must be one of .* got array\(\[1",
    ),
    (
        lambda: contact_law(ROAD, theory=np.ones(3)),
        r"theory must be one of .* got array\(\[1",
    ),
    (
        lambda: flow_factors("concrete", 1.0),
        "surface must be a Surface, got 'concrete'; a named",
    ),
    (
        lambda: contact(ROAD, separation=1.0, theory=Mbma(rtol=np.ones((2, 3)))),
        r"rtol must be a number in \[1e-11, 0.1\], got array",
    ),
    (
        lambda: contact(ROAD, Bodies(hardness=10**400), separation=1.0),
        "hardness must be real numbers: entries of type obj",
    ),
    (
        lambda: contact(ROAD, 5e-324, pressure=1.0, theory="mbma"),
        "pressure must be at most what theory .mbma. reaches",
    ),
    (
        lambda: contact(ROAD, Bodies(5e-324, hardness=1.0), pressure=1.0),
        "pressure must be at most what theory .calib",
    ),
    (lambda: island(ROAD, 5e-324), "delta must be at least 1e-250, got 5e-324"),
    (
        lambda: Surface(0.8, 5e-324, 1.0, 1.0, 3.0),
        "q0 must be from 1e-50 to 1e\\+50: take another unit",
    ),
    (
        lambda: Surface(5e-324, 1.0, 10.0, 1.0, 3.0),
        r"hurst must be in \(0, 1\], got 5e-324",
    ),
    (
        lambda: contact(ROAD, separation="50 MPa"),
        "'MPa' is no known unit of length but one of stress",
    ),
    (
        lambda: contact(ROAD, "1 GPa", pressure=[["5 MPa"], [50]]),
        "pressure: 50 has no unit beside others",
    ),
    (
        lambda: contact(ROAD, separation=["1 um", "2"]),
        "separation: '2' has no unit beside others that have",
    ),
    (
        lambda: Surface.from_roughness(Rq=["1.6 um", 2.0], **BAND),
        "Rq: 2.0 has no unit beside others",
    ),
)


HEAVY = ("scipy", "matplotlib", "xarray", "sklearn", "SurfaceTopography", "pandas")


def test_nothing_heavy_comes_with_the_package_its_errors_and_its_dir():
    code = (
        "import mbma_tables, sys, json; dir(mbma_tables); mbma_tables.InputError; mbma_tables.__version__;"
        "print(json.dumps(sorted(sys.modules)))"
    )
    loaded = {name.partition(".")[0] for name in fresh(code)}
    assert "mbma_tables" in loaded
    assert loaded.isdisjoint(HEAVY)


def test_public_names_are_there_and_others_are_not():
    for name in mbma_tables.__all__:
        assert getattr(mbma_tables, name) is not None
        assert name in dir(mbma_tables)
    with pytest.raises(AttributeError, match="no attribute 'contakt'"):
        _ = mbma_tables.contakt
    with pytest.raises(TypeError, match="takes from 1 to 2 positional arguments"):
        contact(ROAD, 1.0, 1.0)


ROAD = Surface.named("concrete")
test_odd_input_has_a_typed_error = refusals(
    lambda ask: ask(),
    (
        lambda: contact(
            ROAD, Bodies(13.0, hardness=[[1, 2], [3]]), pressure=0.1, theory="calibrated"
        ),
        "hardness must be real numbers",
    ),
    (lambda: mbma_tables.Scene(3), "surface must be a Surface, got 3"),
    (lambda: mbma_tables.Scene("concrete"), r"a named one is Surface\.named"),
    (lambda: mbma_tables.Scene(None), "surface must be a Surface, got None"),
    (
        lambda: open_table(np.zeros(3)),
        "a table must be 'universal', 'island4d' or the path of a file",
    ),
    (lambda: open_table(3), "the path of a file, got 3"),
)
test_a_number_too_large_for_a_double_is_not_infinity = refusals(
    lambda hardness: contact(
        ROAD, Bodies("13 MPa", hardness=hardness), pressure="1 kPa", theory="calibrated"
    ),
    ("1e400", "hardness = '1e400' is above the largest number"),
    ("1e400 GPa", "hardness = '1e400 GPa' is above the largest number"),
    ("1e306 GPa", "above the largest number of 64 bits in MPa"),
    ("1e400 HV", "hardness must be finite"),
    ("1.2.3 HV", "no known unit of stress"),
)
