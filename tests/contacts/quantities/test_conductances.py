"""Conductance of solid spots, of a gas and of both: model uncertainties, and when there is none."""

import numpy as np
import pytest

from mbma_tables import Bodies, Gas, Joint, contact
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.quantities.gas import (
    exponent_of_gap,
    mean_inverse,
    scatter_of_mean,
)

FACE = {"Rq": "0.8 um", "hurst": 0.8, "longest": "100 um", "shortest": "2 um"}
METAL = "aluminium 6061 hard"
AREA = "4 cm^2"


def pressed(gas):
    joint = Joint(FACE, bodies=METAL, nominal_area=AREA, gas=gas)
    return joint.at_pressure(["10 MPa", "50 MPa"])


@pytest.mark.parametrize("eta", [0.1, np.inf])
def test_exponent_of_gap_is_the_slope_of_the_conductance_of_a_gas(eta):
    """By central differences; of 3% contact the shape of the gaps hardly depends on u (1e-5/0.03 of d)."""
    u = np.array([0.8, 1.2, 1.6])
    area = np.array([0.3, 0.1, 0.03])
    step = 1e-4
    above, below = (
        np.log(mean_inverse(u * np.exp(sign * step), area, 0.3, 1.0, eta))
        for sign in (1, -1)
    )
    slope = (below - above) / (2 * step)
    np.testing.assert_allclose(exponent_of_gap(u, area, 0.3, 1.0, eta), slope, atol=1e-4)


def test_scatter_of_a_gas_is_that_of_its_comparison_and_nan_elsewhere():
    # the table of docs/joints.md
    jumps = [3.0, 1.0, 0.3, 0.1, 0.03]
    np.testing.assert_allclose(
        scatter_of_mean(0.1, jumps, 1.0), [0.003, 0.008, 0.019, 0.034, 0.055]
    )
    between = scatter_of_mean(0.1, [0.6, 6.0], 2.0)
    np.testing.assert_allclose(between, [0.019, 0.003])
    assert np.isnan(scatter_of_mean([0.1, 1e-6, 0.9], [0.02, 0.3, 0.3], 1.0)).all()


def test_each_conductance_has_its_scatter():
    """That of the total is of its parts by their shares, as random parts have it."""
    both = pressed("air")
    np.testing.assert_array_equal(
        both.solid_conductance_scatter, both.unloading_stiffness_scatter
    )
    rng = np.random.default_rng(1)
    parts = []
    for name in ("solid_conductance", "gas_conductance"):
        relative = 1e-3 * both.scatter_of(name) * rng.standard_normal((200_000, 1))
        parts.append(both.quantity(name) * (1 + relative))
    measured = np.log(sum(parts)).std(axis=0) / 1e-3
    np.testing.assert_allclose(both.total_conductance_scatter, measured, rtol=0.01)
    np.testing.assert_array_equal(
        both.scatter_of("total_conductance"), both.total_conductance_scatter
    )


def test_scatter_of_a_gas_includes_that_of_the_mean_gap():
    found = pressed(Gas("air"))
    joint = found.mean_separation, found.separation_scatter
    moved = [
        mean_inverse(u, found.area, 0.2997, found.surface.h_rms, found.psi**-1)
        for u in (joint[0] - joint[1] / 10, joint[0] + joint[1] / 10)
    ]
    of_gap = 5 * np.log(moved[0] / moved[1])
    of_mean = scatter_of_mean(found.area, 0.2997, found.surface.h_rms)
    np.testing.assert_allclose(
        found.gas_conductance_scatter, np.hypot(of_gap, of_mean), rtol=0.01
    )


def test_vacuum_conducts_nothing_without_uncertainty():
    found = pressed("vacuum")
    np.testing.assert_array_equal(found.gas_conductance_scatter, 0.0)
    np.testing.assert_allclose(
        found.total_conductance_scatter, found.solid_conductance_scatter, rtol=1e-14
    )


def test_conductances_without_a_gas_and_of_electricity():
    joint = Joint(FACE, bodies=METAL, nominal_area=AREA)
    alone = contact(joint.surface, METAL, pressure="10 MPa")
    assert alone.solid_conductance > 0
    for name in ("gas_conductance", "total_conductance", "total_conductance_scatter"):
        with pytest.raises(InputError, match=rf"{name} needs .*gas.*gas='air'"):
            alone.quantity(name)
        assert name not in alone.available()
    current = Joint(
        joint.surface, bodies=Bodies("30 GPa", conductivity="38e6 S/m")
    ).at_pressure("10 MPa")
    assert current.units["solid_conductance"] == "S/m^2"
    with pytest.raises(InputError, match="total_conductance needs thermal conductivity"):
        _ = current.total_conductance


def test_the_total_is_shown_first_with_its_scatter():
    """In text, tables and pictures of a joint in a gas; a vacuum has none to draw."""
    joint = Joint(FACE, bodies=METAL, nominal_area=AREA)
    found = joint.at_pressure(["10 MPa", "50 MPa"])
    names = [name for name in found._facts() if "conductance" in name]
    assert names[:2] == ["total_conductance", "total_conductance_scatter"]
    assert names[2:] == [
        f"{part}_conductance{end}"
        for part in ("solid", "gas")
        for end in ("", "_scatter")
    ]
    listed = [name for name in found.available() if name.endswith("conductance")]
    assert listed == ["total_conductance", "solid_conductance", "gas_conductance"]
    for figure in (joint.plot(pressures=("10 MPa", "50 MPa")), found.plot()):
        (panel,) = (axes for axes in figure.axes if "conductance" in axes.get_ylabel())
        lines = [line.get_label() for line in panel.lines]
        assert lines == ["total conductance", "solid conductance", "gas conductance"]
        # a band for each line
        assert len(panel.collections) == 3
        half_width = np.exp(float(found.total_conductance_scatter[0]))
        ends = panel.collections[0].get_paths()[0].vertices[:, 1]
        assert ends.min() == pytest.approx(found.total_conductance[0] / half_width)
    alone = Joint(FACE, bodies=METAL, nominal_area=AREA, gas="vacuum")
    (panel,) = (
        axes
        for axes in alone.plot(pressures=("10 MPa", "50 MPa")).axes
        if "conductance" in axes.get_ylabel()
    )
    assert panel.lines[0].get_label() == "total conductance"
    assert "gas conductance" not in [line.get_label() for line in panel.lines]


def test_the_panel_of_a_current_has_its_unit():
    """It was called thermal, in W/(m^2 K)."""
    face = Joint(FACE, bodies=METAL, nominal_area=AREA).surface
    joint = Joint(face, bodies=Bodies("30 GPa", conductivity="38e6 S/m"), gas="vacuum")
    labels = [axes.get_ylabel() for axes in joint.plot(pressures=("1 MPa", "5 MPa")).axes]
    assert "conductance [S/m^2]" in labels
