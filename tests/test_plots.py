import sys

import numpy as np
import pytest

from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.plots import Curve, draw_compression, to_picture

GAP = np.array([3.0, 2.0, 1.0, 0.0])
FORCE = np.array([0.0, 2e-5, 3e-4, 2e-2])
AREA = np.array([0.0, 3e-5, 4e-4, 3e-2])


def two_curves() -> list[Curve]:
    return [Curve("first", GAP, FORCE, AREA), Curve("second", GAP[:3] + 0.5, 2 * FORCE[1:], AREA[1:])]


def test_lines_hold_the_arrays_as_given():
    curves = two_curves()
    by_gap, by_force = draw_compression(curves).axes
    for curve, left, right in zip(curves, by_gap.lines, by_force.lines, strict=True):
        np.testing.assert_array_equal(left.get_xydata(), np.stack([curve.gap, curve.pressure], axis=1))
        np.testing.assert_array_equal(right.get_xydata(), np.stack([curve.pressure, curve.area], axis=1))


def test_scatter_is_a_band_of_one_standard_deviation():
    scatter = np.array([np.nan, 0.7, 0.3, 0.1])
    figure = draw_compression([Curve("law", GAP, FORCE, AREA, scatter, 0.1 * scatter), *two_curves()])
    for axes, x, y, spread in ((figure.axes[0], GAP, FORCE, scatter), (figure.axes[1], FORCE, AREA, 0.1 * scatter)):
        (band,) = axes.collections
        corners = band.get_paths()[0].vertices
        for k in (1, 2, 3):
            for side in (1, -1):
                assert np.isclose(corners, [x[k], y[k] * np.exp(side * spread[k])], rtol=1e-12).all(axis=1).any()
        assert corners[:, 0].min() >= x[1:].min()
    unknown = draw_compression([Curve("law", GAP, FORCE, AREA, np.full(4, np.nan))])
    assert not unknown.axes[0].collections
    with pytest.raises(InputError, match="one length"):
        Curve("law", GAP, FORCE, AREA, scatter[:2])


@pytest.mark.parametrize("outlines", [False, True])
def test_drawings_repeat_with_letters_as_asked(outlines):
    first, second = (to_picture(draw_compression(two_curves()), "svg", outlines=outlines) for _ in range(2))
    assert first == second
    assert (b"<text" in first) != outlines


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ((GAP, FORCE, AREA[:2]), "one length"),
        ((GAP[0], FORCE[1], AREA[1]), "1-D"),
        ((GAP, FORCE * np.nan, AREA), "must be finite"),
        (([], [], []), "empty"),
        ((GAP, 0 * FORCE, AREA), "no contact"),
    ],
)
def test_bad_curves_are_refused(arrays, message):
    with pytest.raises(InputError, match=message):
        Curve("name", *arrays)
    with pytest.raises(InputError, match="at least one"):
        draw_compression([])


def test_missing_matplotlib_is_named_with_the_cure(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MbmaError, match=r"pip install 'mbma_tables\[plot\]'"):
        draw_compression(two_curves())


def test_a_third_panel_for_leakage_without_blocked_contacts():
    force, k = np.array([0.0, 1e-3, 1e-2, 1e-1]), np.array([9.0, 1.0, 0.1, 0.0])
    curve = Curve("seal", np.array([3.0, 2.0, 1.0, 0.5]), force, force, leakage=k, leakage_scatter=np.full(4, 0.2))
    *_, flow = draw_compression([curve], leakage_label="K [um^3]").axes
    y = flow.lines[0].get_ydata()
    assert flow.get_ylabel() == "K [um^3]"
    assert np.isfinite(y).tolist() == [False, True, True, False]
    band = flow.collections[0].get_paths()[0].vertices
    assert band[:, 1].max() == pytest.approx(np.exp(0.2))
    assert len(draw_compression([Curve("no", [2.0, 1.0], [1e-3, 1e-2], [1e-3, 1e-2])]).axes) == 2
