"""xarray in, xarray out; dask stays lazy and gives the same bits; cold tables opened by many threads."""

import subprocess
import sys

import dask
import dask.array
import numpy as np
import pytest
import xarray as xr
from dask.callbacks import Callback

from mbma_tables import InputError, OutOfRangeError, Surface, contact, contact_law, island, theories

FIELDS = ("pressure", "area", "error")


def gaps_over(n, **kwargs):
    return xr.DataArray(np.linspace(-2.9, 3.1, n), dims="gap", coords={"gap": np.arange(n)}, name="d", **kwargs)


def surfaces_over():
    hurst = xr.DataArray([0.4, 0.7, 1.0], dims="surface", coords={"surface": ["a", "b", "c"]}, attrs={"units": "1"})
    h_max = xr.DataArray([3.0, 3.2], dims="case")
    return Surface(hurst, 0.2, 40.0, 1.0, h_max)


class Tasks(Callback):
    """Counts what dask runs."""

    def __init__(self):
        super().__init__()
        self.ran = 0

    def _pretask(self, key, dsk, state):
        self.ran += 1


def test_dimensions_by_name():
    gaps = gaps_over(7, attrs={"units": "mm", "long_name": "separation"})
    found = contact(surfaces_over(), separation=gaps)
    plain = contact(
        Surface(np.array([0.4, 0.7, 1.0])[:, None, None], 0.2, 40.0, 1.0, np.array([3.0, 3.2])[:, None]),
        separation=gaps.values,
    )
    assert found.islands is None
    assert (found.island_model, found.variant) == ("universal", "reported")
    for name in FIELDS:
        values = getattr(found, name)
        assert isinstance(values, xr.DataArray)
        assert values.name == name
        assert set(values.dims) == {"surface", "case", "gap"}
        np.testing.assert_array_equal(values.transpose("surface", "case", "gap"), getattr(plain, name))
        assert values.surface.values.tolist() == ["a", "b", "c"]
        assert values.gap.values.tolist() == list(range(7))
    assert found.pressure.attrs == {"long_name": "force over nominal area", "units": "1"}
    assert found.area.attrs["units"] == found.error.attrs["units"] == "1"
    assert found.separation is gaps
    assert gaps.attrs == {"units": "mm", "long_name": "separation"}
    np.testing.assert_array_equal(
        found.mean_separation.transpose("case", "gap"), (np.array([3.0, 3.2])[:, None] + gaps.values) / 2
    )
    together = xr.Dataset({name: getattr(found, name) for name in FIELDS})
    assert together.sizes == {"surface": 3, "case": 2, "gap": 7}


@pytest.mark.parametrize("which", ["separation", "surface", "E_star"])
def test_one_labelled_argument_is_enough(which):
    label = {name: (lambda x: xr.DataArray(x, dims="t")) if name == which else (lambda x: x[1]) for name in (
        "separation", "surface", "E_star"
    )}  # fmt: skip
    found = contact(
        Surface(label["surface"]([0.5, 0.8]), 0.2, 40.0, 1.0, 3.0),
        separation=label["separation"]([0.5, 1.5]),
        E_star=label["E_star"]([1.0, 2.0]),
    )
    assert found.pressure.dims == ("t",)
    assert found.pressure.values[1] == contact(Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=1.5, E_star=2.0).pressure


def test_no_dimensions_at_all():
    found = contact(Surface(xr.DataArray(0.8), 0.2, 40.0, 1.0, 3.0), separation=1.0)
    assert found.pressure.shape == ()
    assert float(found.pressure) == contact(Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=1.0).pressure


@pytest.mark.parametrize("scheduler", ["synchronous", "threads"])
@pytest.mark.parametrize("derivatives", [False, True])
def test_dask_is_lazy_and_gives_the_same_answers(scheduler, derivatives):
    gaps, surfaces = gaps_over(50), surfaces_over()
    eager = contact(surfaces, separation=gaps, derivatives=derivatives)
    lazy_surfaces = Surface(surfaces.hurst.chunk(surface=2), 0.2, 40.0, 1.0, surfaces.h_max.chunk(case=1))
    with Tasks() as tasks:
        lazy = contact(lazy_surfaces, separation=gaps.chunk(gap=11), derivatives=derivatives)
        outputs = {name: getattr(lazy, name) for name in (*FIELDS, "mean_separation", "separation")}
        if derivatives:
            outputs |= {f"pressure_{name}": slope for name, slope in lazy.pressure_by.items()}
            outputs |= {f"area_{name}": slope for name, slope in lazy.area_by.items()}
        assert all(dask.is_dask_collection(value) for value in outputs.values())
        assert tasks.ran == 0
    expected = {name: getattr(eager, name) for name in (*FIELDS, "mean_separation", "separation")}
    if derivatives:
        expected |= {f"pressure_{name}": slope for name, slope in eager.pressure_by.items()}
        expected |= {f"area_{name}": slope for name, slope in eager.area_by.items()}
    with dask.config.set(scheduler=scheduler, num_workers=4), Tasks() as tasks:
        computed = dask.compute(outputs)[0]
    assert tasks.ran > 10
    assert computed.keys() == expected.keys()
    for name, value in computed.items():
        assert value.dims == expected[name].dims
        # at few gaps of one surface islands are summed, at more there is a series: within their errors
        close = float(2 * expected["error"].max()) if not derivatives else 1e-13
        if name == "error" and not derivatives:
            assert (value <= 1e-8).all()
        else:
            np.testing.assert_allclose(value, expected[name], rtol=close)
    assert lazy.pressure.attrs == eager.pressure.attrs


def test_the_bits_of_one_surface_depend_neither_on_the_kind_of_argument_nor_on_the_chunks():
    surface, gaps = Surface(0.8, 0.2, 40.0, 1.0, 3.0), gaps_over(5000)
    eager, plain = contact(surface, separation=gaps), contact(surface, separation=gaps.values)
    for k in (0, 17, 2500, 4999):
        one = contact(surface, separation=float(gaps[k]))
        assert (one.pressure, one.area, one.error) == (plain.pressure[k], plain.area[k], plain.error[k])
    lazy = contact(surface, separation=gaps.chunk(gap=(7, 493, 4500)))
    with dask.config.set(scheduler="threads", num_workers=4):
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(plain, name), getattr(eager, name))
            np.testing.assert_array_equal(getattr(lazy, name).compute(), getattr(eager, name))


def test_chunks_without_entries():
    gaps = gaps_over(12).chunk(gap=(5, 0, 7))
    surface = Surface(0.8, 0.2, 40.0, 1.0, 3.0)
    found = contact(surface, separation=gaps).pressure.compute()
    np.testing.assert_array_equal(found, contact(surface, separation=gaps.values).pressure)
    np.testing.assert_array_equal(
        contact_law(surface).area(separation=gaps).compute(), contact_law(surface).area(separation=gaps.values)
    )
    with pytest.raises(InputError, match="separation is empty"):
        contact(surface, separation=xr.DataArray(np.zeros(0), dims="gap"))


def test_outside_and_island_models_go_through():
    surfaces = Surface(xr.DataArray([0.05, 0.8], dims="s"), 0.2, 0.2e8, 1.0, 3.0)
    gaps = gaps_over(3)
    found = contact(surfaces, separation=gaps, outside="nan")
    assert np.isnan(found.pressure.sel(s=0)).values.tolist() == [True, True, False]
    assert np.isfinite(found.pressure.sel(s=1)).all()
    with pytest.raises(OutOfRangeError, match="outside the universal table"):
        contact(surfaces, separation=gaps)
    rigid = contact(
        Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=gaps, island_model="rigid", variant="printed", rtol=1e-4
    )
    assert (rigid.island_model, rigid.variant) == ("rigid", "printed")
    plain = contact(
        Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=gaps.values, island_model="rigid", variant="printed", rtol=1e-4
    )
    np.testing.assert_array_equal(rigid.pressure, plain.pressure)


def test_bad_input_is_refused_when_it_is_computed():
    surface = Surface(0.8, 0.2, 40.0, 1.0, 3.0)
    bad = xr.DataArray([1.0, np.nan], dims="t")
    with pytest.raises(InputError, match=r"separation must be finite, got nan at \(1,\)"):
        contact(surface, separation=bad)
    lazy = contact(surface, separation=bad.chunk(t=1)).pressure
    with pytest.raises(InputError, match="separation must be finite"):
        lazy.compute(scheduler="synchronous")
    wrong = Surface(xr.DataArray([0.8, 1.2], dims="s"), 0.2, 40.0, 1.0, 3.0)
    with pytest.raises(OutOfRangeError, match=r"hurst must be in \(0, 1\]"):
        contact(wrong, separation=1.0)


def test_arrays_without_names_beside_named_ones():
    with pytest.raises(InputError, match=r"beside DataArrays, separation must be one or a scalar, got shape \(3,\)"):
        contact(surfaces_over(), separation=[0.0, 1.0, 2.0])
    with pytest.raises(InputError, match=r"beside DataArrays, h_rms must be"):
        contact(Surface(xr.DataArray([0.8, 0.9], dims="s"), 0.2, 40.0, np.ones(2), 3.0), separation=1.0)


def test_coordinates_that_differ_are_not_joined():
    hurst = xr.DataArray([0.8, 0.9], dims="t", coords={"t": [0, 1]})
    with pytest.raises(ValueError, match=r"join|align"):
        contact(
            Surface(hurst, 0.2, 40.0, 1.0, 3.0), separation=xr.DataArray([1.0, 2.0], dims="t", coords={"t": [1, 2]})
        )


COLD = """
import dask, numpy as np, xarray as xr
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from mbma_tables import Surface, contact
gaps = xr.DataArray(np.linspace(-2.9, 3.1, 120), dims="gap")
surface = Surface(xr.DataArray([0.5, 0.8], dims="surface").chunk(surface=1), 0.2, 40.0, 1.0, 3.0)
with dask.config.set(scheduler="threads", num_workers=8):
    few, many = gaps.chunk(gap=3), gaps.chunk(gap=15)
    lazy = contact(surface, separation=few), contact(surface, separation=many, island_model="island4d", rtol=1e-3)
    first, second = dask.compute(lazy[0].pressure, lazy[1].pressure)
assert (abs(first - second) <= 0.01 * first).all()
from mbma_tables.models.tables import shipped
from mbma_tables.tablefiles.netcdf import read_table
barrier = Barrier(8)
def read(kind):
    barrier.wait()
    return read_table(shipped(kind), kind).coefficients.sum()
with ThreadPoolExecutor(8) as pool:
    sums = list(pool.map(read, ["universal", "island4d"] * 4))
assert len(set(sums)) == 2
print("whole")
"""


@pytest.mark.slow
def test_cold_tables_opened_by_many_threads():
    done = subprocess.run([sys.executable, "-c", COLD], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "whole\n"


def test_islands_of_labelled_surfaces_are_lazy_and_the_same():
    hurst = np.random.default_rng(8).uniform(0.4, 0.9, 12)
    delta = np.array([0.1, 1.0, 3.0])
    plain = island(Surface(hurst[:, None], 0.2, 40.0, 1.0, 3.0), delta, E_star=2.0)
    lazy = island(
        Surface(xr.DataArray(hurst, dims="sample").chunk(sample=5), 0.2, 40.0, 1.0, 3.0),
        xr.DataArray(delta, dims="depth"),
        E_star=2.0,
    )
    assert dask.base.is_dask_collection(lazy.force)
    for name in ("zeta_d", "mu", "force", "area", "error"):
        found = getattr(lazy, name).transpose("sample", "depth").compute()
        np.testing.assert_array_equal(found, getattr(plain, name))


LABELLED = Surface(xr.DataArray([0.5, 0.8], dims="s"), 0.3, 60.0, 0.7, 2.1)
LABELLED_GAPS = xr.DataArray([-1.0, 0.4, 2.0], dims="d")


@pytest.mark.parametrize(("wanted", "other"), [("pressure", "area"), ("area", "pressure")])
def test_slopes_of_one_quantity_of_labelled_surfaces(wanted, other):
    found = contact(LABELLED, separation=LABELLED_GAPS, derivatives=True, quantities=[wanted])
    both = contact(LABELLED, separation=LABELLED_GAPS, derivatives=True)
    for name, slope in getattr(both, f"{wanted}_by").items():
        np.testing.assert_array_equal(getattr(found, f"{wanted}_by")[name], slope)
    assert getattr(found, other) is getattr(found, f"{other}_by") is None
    none = contact(LABELLED, separation=LABELLED_GAPS)
    assert none.pressure_by is none.area_by is None


@pytest.mark.parametrize("method", ["full", "simplified"])
def test_theories_of_labelled_surfaces(method):
    h_rms = xr.DataArray(dask.array.from_array([1.0, 1.5, 2.0], chunks=2), dims="sample")
    gaps = xr.DataArray([0.4, 1.0], dims="gap")
    theory = theories.Persson(method)
    lazy = contact(Surface(0.8, 1.0, 100.0, h_rms, 6.0), mean_separation=gaps, theory=theory).pressure
    assert lazy.dims == ("sample", "gap")
    assert lazy.chunks is not None
    plain = Surface(0.8, 1.0, 100.0, np.array([1.0, 1.5, 2.0])[:, None], 6.0)
    np.testing.assert_array_equal(lazy.compute(), contact(plain, mean_separation=gaps.values, theory=theory).pressure)
    summits = contact(Surface(0.8, 1.0, 100.0, h_rms, 6.0), separation=gaps, theory="greenwood_williamson")
    expected = contact(plain, separation=gaps.values, theory="greenwood_williamson")
    np.testing.assert_array_equal(summits.area.compute(), expected.area)
