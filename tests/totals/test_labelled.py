"""xarray in, xarray out; dask stays lazy and gives the same bits; cold tables opened by many threads."""

import dask
import dask.array
import numpy as np
import pytest
import xarray as xr
from dask.callbacks import Callback
from helpers import fresh, refusals

from mbma_tables import InputError, Surface, contact, contact_law, island

FIELDS = ("pressure", "area", "error")
SMOOTH = Surface(0.8, 0.2, 40.0, 1.0, 3.0)


def gaps_over(n, **kwargs):
    return xr.DataArray(np.linspace(-2.9, 3.1, n), dims="gap", coords={"gap": np.arange(n)}, name="d", **kwargs)


def surfaces_over():
    hurst = xr.DataArray([0.4, 0.7, 1.0], dims="surface", coords={"surface": ["a", "b", "c"]}, attrs={"units": "1"})
    h_max = xr.DataArray([3.0, 3.2], dims="case")
    return Surface(hurst, 0.2, 40.0, 1.0, h_max)


class Tasks(Callback):
    def __init__(self):
        super().__init__()
        self.ran = 0

    def _pretask(self, key, dsk, state):
        self.ran += 1


def test_dimensions_by_name():
    gaps = gaps_over(7, attrs={"units": "mm", "long_name": "separation"})
    found, h_max = contact(surfaces_over(), separation=gaps), np.array([3.0, 3.2])[:, None]
    plain = contact(Surface(np.array([0.4, 0.7, 1.0])[:, None, None], 0.2, 40.0, 1.0, h_max), separation=gaps.values)
    assert found.islands is None
    for name in FIELDS:
        values = getattr(found, name)
        assert (values.name, values.attrs["units"]) == (name, "1")
        assert set(values.dims) == {"surface", "case", "gap"}
        np.testing.assert_array_equal(values.transpose("surface", "case", "gap"), getattr(plain, name))
        assert values.surface.values.tolist() == ["a", "b", "c"]
        assert values.gap.values.tolist() == list(range(7))
    assert found.pressure.attrs["long_name"] == "force over nominal area"
    assert found.separation is gaps
    assert gaps.attrs == {"units": "mm", "long_name": "separation"}
    # above h_max the bodies are apart
    expected = np.maximum((h_max + gaps.values) / 2, gaps.values)
    np.testing.assert_array_equal(found.mean_separation.isel(surface=0).transpose("case", "gap"), expected)
    assert xr.Dataset({name: getattr(found, name) for name in FIELDS}).sizes == {"surface": 3, "case": 2, "gap": 7}


@pytest.mark.parametrize("scheduler", ["synchronous", "threads"])
def test_dask_is_lazy_and_gives_the_same_answers(scheduler):
    gaps, surfaces = gaps_over(50), surfaces_over()
    eager = contact(surfaces, separation=gaps)
    lazy_surfaces = Surface(surfaces.hurst.chunk(surface=2), 0.2, 40.0, 1.0, surfaces.h_max.chunk(case=1))

    def outputs(found):
        return {name: getattr(found, name) for name in (*FIELDS, "mean_separation", "separation")}

    with Tasks() as tasks:
        lazy = outputs(contact(lazy_surfaces, separation=gaps.chunk(gap=11)))
        assert all(dask.is_dask_collection(value) for value in lazy.values())
        assert tasks.ran == 0
    with dask.config.set(scheduler=scheduler, num_workers=4), Tasks() as tasks:
        computed = dask.compute(lazy)[0]
    assert tasks.ran > 10
    for name, expected in outputs(eager).items():
        assert (computed[name].dims, lazy[name].attrs) == (expected.dims, expected.attrs)
        # at few gaps of one surface islands are summed, at more there is a series: within their errors
        if name == "error":
            assert (computed[name] <= 1e-8).all()
        else:
            np.testing.assert_allclose(computed[name], expected, rtol=float(2 * eager.error.max()))


def test_the_bits_of_one_surface_depend_neither_on_the_kind_of_argument_nor_on_the_chunks():
    surface, gaps = SMOOTH, gaps_over(5000)
    eager, plain = contact(surface, separation=gaps), contact(surface, separation=gaps.values)
    assert plain.islands < 5000  # one series for all gaps
    for k in (0, 17, 2500, 4999):
        one = contact(surface, separation=float(gaps[k]))
        assert (one.pressure, one.area, one.error) == (plain.pressure[k], plain.area[k], plain.error[k])
    lazy = contact(surface, separation=gaps.chunk(gap=(7, 493, 4500)))
    with dask.config.set(scheduler="threads", num_workers=4):
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(plain, name), getattr(eager, name))
            np.testing.assert_array_equal(getattr(lazy, name).compute(), getattr(eager, name))


def test_chunks_without_entries():
    gaps = gaps_over(12)
    for ask in (lambda d: contact(SMOOTH, separation=d).pressure, lambda d: contact_law(SMOOTH).area(separation=d)):
        np.testing.assert_array_equal(ask(gaps.chunk(gap=(5, 0, 7))).compute(), ask(gaps.values))
    with pytest.raises(InputError, match="separation is empty"):
        contact(SMOOTH, separation=gaps[:0])


def test_bad_input_is_refused_when_it_is_computed():
    bad = xr.DataArray([1.0, np.nan], dims="t")
    with pytest.raises(InputError, match=r"separation must be finite, got nan at \(1,\)"):
        contact(SMOOTH, separation=bad)
    lazy = contact(SMOOTH, separation=bad.chunk(t=1)).pressure
    with pytest.raises(InputError, match="separation must be finite"):
        lazy.compute(scheduler="synchronous")


def labelled(values, **coords):
    return xr.DataArray(values, dims="t", coords=coords and {"t": coords["t"]})


test_labelled_arguments_that_are_refused = refusals(
    lambda hurst, h_rms, gaps: contact(Surface(hurst, 0.2, 0.2e8, h_rms, 3.0), separation=gaps),
    (labelled([0.8, 1.2]), 1.0, 1.0, r"hurst must be in \(0, 1\]"),
    (labelled([0.05, 0.8]), 1.0, 1.0, "outside of island model .universal"),
    (labelled([0.8, 0.9]), 1.0, [0.0, 1.0, 2.0], r"separation must be one or a scalar, got shape \(3,\)"),
    (labelled([0.8, 0.9]), np.ones(2), 1.0, r"beside DataArrays, h_rms must be"),
    (labelled([0.8, 0.9], t=[0, 1]), 1.0, labelled([1.0, 2.0], t=[1, 2]), "join|align"),
    error=ValueError,
)


def test_options_go_through():
    gaps, surfaces = gaps_over(3), Surface(xr.DataArray([0.05, 0.8], dims="s"), 0.2, 0.2e8, 1.0, 3.0)
    found = contact(surfaces, separation=gaps, outside="nan").pressure
    assert np.isnan(found.transpose("s", "gap")).values.tolist() == [[True, True, False], [False] * 3]
    options = {"island_model": "rigid", "variant": "printed", "rtol": 1e-4}
    rigid = contact(SMOOTH, separation=gaps, **options)
    assert (rigid.island_model, rigid.variant) == ("rigid", "printed")
    np.testing.assert_array_equal(rigid.pressure, contact(SMOOTH, separation=gaps.values, **options).pressure)


COLD = """
import dask, numpy as np, xarray as xr
from mbma_tables import Surface, contact
gaps = xr.DataArray(np.linspace(-2.9, 3.1, 120), dims="gap")
surface = Surface(xr.DataArray([0.5, 0.8], dims="surface").chunk(surface=1), 0.2, 40.0, 1.0, 3.0)
with dask.config.set(scheduler="threads", num_workers=8):
    few, many = gaps.chunk(gap=3), gaps.chunk(gap=15)
    lazy = contact(surface, separation=few), contact(surface, separation=many, island_model="island4d", rtol=1e-3)
    first, second = dask.compute(lazy[0].pressure, lazy[1].pressure)
assert (abs(first - second) <= 0.01 * first).all()
print(len(first.gap))
"""


@pytest.mark.slow
def test_cold_tables_opened_by_many_threads():
    assert fresh(COLD) == 120


def test_islands_are_of_plain_arrays():
    with pytest.raises(InputError, match="plain arrays"):
        island(SMOOTH, gaps_over(3))
