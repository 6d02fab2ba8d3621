"""What fuzzing found, each by itself."""

import dataclasses
import types

import numpy as np
import pytest
from small_tables import small_table

from generate.tables import campaign
from mbma_tables import InputError, Scene, Surface
from mbma_tables.tablefiles.consistency import misfit
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL

HUGE = 10**400
SCENE = '[effects]\non = ["force"]\n[prescribed]\nseparations = [{}]\nover_h_rms = true\n[surface]\nname = "concrete"\n'


def test_a_scene_with_a_number_beyond_doubles(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE.format(HUGE))
    with pytest.raises(InputError, match="must be real numbers"):
        Scene.from_toml(tmp_path / "scene.toml")


def test_an_empty_spectrum(tmp_path):
    (tmp_path / "psd.txt").write_text("# q C\n")
    (tmp_path / "scene.toml").write_text(
        '[surface]\npsd = "psd.txt"\nh_max = 1.0\n[effects]\non = ["force"]\n[prescribed]\nseparations = 1.0\n'
    )
    with pytest.raises(InputError, match="must hold two columns"):
        Scene.from_toml(tmp_path / "scene.toml")


def test_a_topography_whose_sizes_are_no_numbers():
    given = types.SimpleNamespace(heights=lambda: np.ones((40, 40)), physical_sizes=("a", "b"))
    with pytest.raises(InputError, match="physical_sizes must be real numbers"):
        Surface.from_map(given)


def test_a_map_of_records():
    given = np.ma.masked_array(np.zeros((40, 40), "f8,i4"))
    with pytest.raises(InputError, match="heights must be real numbers"):
        Surface.from_map(given, 1.0)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (0, 2)])
def test_a_kept_chunk_comes_back(order, shape, tmp_path):
    values = np.asarray(np.random.default_rng(1).random(shape), order=order)
    campaign._store(tmp_path, "k", values)
    found = campaign._load(tmp_path, "k")
    np.testing.assert_array_equal(found, values)
    assert found.flags.writeable
    assert found.flags.f_contiguous == values.flags.f_contiguous


def with_axis(content, number, **changes):
    axes = list(content.axes)
    axes[number] = dataclasses.replace(axes[number], **changes)
    return dataclasses.replace(content, axes=tuple(axes))


def with_points(content, **points):
    return dataclasses.replace(content, conformance=content.conformance | points)


MISFITS = {
    "axes": (KINDS, lambda c: with_axis(c, 0, name="Y"), "its axes are"),
    "order of axes": (KINDS, lambda c: dataclasses.replace(c, axes=c.axes[::-1]), "its axes are"),
    "transform": (KINDS, lambda c: with_axis(c, 0, transform="linear"), "its axes are"),
    "falling": (KINDS, lambda c: with_axis(c, 0, low=c.axes[0].high), "axis X does not rise"),
    "no logarithm": (KINDS, lambda c: with_axis(c, 1, low=-1.0), "does not rise"),
    "endless": (KINDS, lambda c: with_axis(c, 0, high=np.inf), "axis X does not rise"),
    "offset": (KINDS, lambda c: with_axis(c, 1, offset=1.0), "does not rise"),
    "no Hurst exponent": ([ISLAND4D], lambda c: with_axis(c, 3, high=1.1), "axis hurst"),
    "nodes": (KINDS, lambda c: with_axis(c, 0, nodes=c.axes[0].nodes + 1), "not over its axes"),
    "coefficients": (KINDS, lambda c: dataclasses.replace(c, coefficients=c.coefficients[1:]), "not over its axes"),
    "errors": (KINDS, lambda c: dataclasses.replace(c, local_error=c.local_error[:0]), "errors are not over"),
    "negative error": (KINDS, lambda c: dataclasses.replace(c, local_error=-c.local_error), "errors below zero"),
    "no points": (KINDS, lambda c: dataclasses.replace(c, conformance={}), "not complete"),
    "fewer points": (KINDS, lambda c: with_points(c, tolerance=np.ones(3)), "not complete"),
    "points outside": ([UNIVERSAL], lambda c: with_points(c, mu=-c.conformance["mu"]), "outside"),
    "islands outside": ([ISLAND4D], lambda c: with_points(c, zeta_d=0 * c.conformance["zeta_d"]), "outside"),
    "islands beyond": ([ISLAND4D], lambda c: with_points(c, zeta_u=1e9 * c.conformance["zeta_u"]), "outside"),
    "nothing stored": (KINDS, lambda c: with_points(c, table_F=0 * c.conformance["table_F"]), "outside"),
    "not a ratio": (KINDS, lambda c: dataclasses.replace(c, log_ratio=c.log_ratio + 200), "no logarithms"),
    "NaN": (KINDS, lambda c: dataclasses.replace(c, coefficients=c.coefficients * np.nan), "no logarithms"),
    "no reading": (KINDS, lambda c: dataclasses.replace(c, attributes=c.attributes | {"reading": 1}), "lacks some"),
}


@pytest.mark.parametrize(("kinds", "change", "said"), MISFITS.values(), ids=MISFITS)
def test_parts_that_do_not_fit(kinds, change, said):
    for kind in kinds:
        content = small_table(kind)
        # as `write_table` adds them
        content = dataclasses.replace(
            content, attributes=content.attributes | {"data_version": "", "physics_sha256": ""}
        )
        assert misfit(content) == ""
        assert said in misfit(change(content))
