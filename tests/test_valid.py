"""A valid answer of each kind of input lies within its stated model uncertainty of simulations of that kind.

The simulations are the boundary elements of docs/data/README.md that no fit saw. Each kind has its
own share of errors within two standard deviations; the least is that of docs/fidelity.md,
docs/yield.md, docs/leakage.md, docs/fidelity.md and docs/maps.md.
"""

import csv
import gzip
import pathlib

import numpy as np
import pytest

from mbma_tables import Bodies, Joint, Surface, contact
from mbma_tables.theories.dataset import boundary_elements

TRACES = pathlib.Path(__file__).parents[1] / "docs/data/profiles.csv.gz"
HELD_OUT = ("held_out_surface", "held_out_spectrum")
# q0 h_rms of the surfaces here: slopes are small, as theories and simulations take them
GRADIENT = 1e-3
SIDE = 4  # longest wavelengths a side, fewer of which are not valid
WITHIN_TWO = 0.92  # least share of errors within two standard deviations


@pytest.fixture(scope="module")
def simulations():
    return boundary_elements()


def names_of(flags):
    """The meanings of a variable of flags, one for each surface."""
    meanings = np.array(flags.attrs["flag_meanings"].split())
    return meanings[np.searchsorted(flags.attrs["flag_values"], flags.values)]


def held_out(group):
    """Numbers of the held-out self-affine surfaces of a group, and their rows of simulated loads."""
    kind = names_of(group["kind"])
    split = names_of(group["split"])
    rows = (
        (kind == "self_affine")
        & np.isin(split, HELD_OUT)
        & (group["waves"].values >= SIDE)
    )
    assert rows.any(), (sorted(set(kind)), sorted(set(split)))
    return np.flatnonzero(rows)


def five_numbers(group, row):
    """The surface of a row by its five numbers."""
    numbers = {
        name: float(group[name].values[row]) for name in ("hurst", "zeta_1", "h_max")
    }
    q1 = GRADIENT * numbers["zeta_1"]
    return Surface(numbers["hurst"], GRADIENT, q1, 1.0, numbers["h_max"])


def within(deviations, scatters):
    """Share of deviations of logarithms that lie within two standard deviations, and their number."""
    sizes = np.abs(np.concatenate(deviations)) / np.concatenate(scatters)
    return float(np.mean(sizes <= 2)), sizes.size


@pytest.mark.parametrize("theory", ["calibrated", "persson"])
def test_valid_contacts_of_five_numbers(simulations, theory):
    group = simulations["elastic"]
    deviations = []
    scatters = []
    for row in held_out(group):
        surface = five_numbers(group, row)
        gradient = float(surface.rms_gradient)
        force = group["force"].values[row]
        loads = np.isfinite(force)
        pressed = contact(surface, pressure=force[loads] * gradient, theory=theory)
        deviation = np.log(pressed.area / group["area"].values[row, loads])
        deviations.append(deviation[pressed.valid])
        scatters.append(pressed.area_scatter[pressed.valid])
    share, number = within(deviations, scatters)
    assert number > 100
    assert share >= WITHIN_TWO


def test_valid_contacts_that_yield(simulations):
    group = simulations["hardness"]
    deviations = []
    scatters = []
    for row in held_out(group):
        surface = five_numbers(group, row)
        gradient = float(surface.rms_gradient)
        for k, eta in enumerate(group["eta"].values):
            force = group["force"].values[row, k]
            simulated = group["area"].values[row, k]
            reached = np.isfinite(force) & np.isfinite(simulated) & (force < eta)
            if not reached.any() or not np.isfinite(eta):
                continue
            pressed = contact(
                surface,
                Bodies(hardness=eta * gradient),
                pressure=force[reached] * gradient,
                theory="calibrated",
            )
            deviations.append(np.log(pressed.area / simulated[reached])[pressed.valid])
            scatters.append(pressed.area_scatter[pressed.valid])
    share, number = within(deviations, scatters)
    assert number > 100
    assert share >= WITHIN_TWO


def test_valid_leakage(simulations):
    group = simulations["leakage"]
    deviations = []
    scatters = []
    for row in held_out(group):
        surface = five_numbers(group, row)
        gradient = float(surface.rms_gradient)
        force = group["force"].values[row]
        loads = np.isfinite(force)
        flow = np.sqrt(group["flow"].values[row, loads].prod(axis=-1))
        pressed = contact(surface, pressure=force[loads] * gradient, theory="calibrated")
        valid = pressed.leakage.valid & (flow > 0)
        deviations.append(
            np.log(pressed.leakage.K / np.where(flow > 0, flow, 1.0))[valid]
        )
        scatters.append(pressed.leakage.scatter[valid])
    share, number = within(deviations, scatters)
    assert number > 50
    assert share >= WITHIN_TWO


@pytest.mark.parametrize("theory", ["calibrated", "simulated"])
@pytest.mark.parametrize("quantity", ["area", "stiffness"])
def test_valid_contacts_of_machined_maps(simulations, theory, quantity):
    """The answers stored with the maps' simulations; those of maps that are simulated now are tested beside `maps`."""
    group = simulations["machined"]
    valid = group[f"{theory}_valid"].values.astype(bool)
    deviation = np.log(group[f"{theory}_{quantity}"].values / group[quantity].values)
    scatter = group[f"{theory}_{quantity}_scatter"].values
    valid &= np.isfinite(deviation) & np.isfinite(scatter)
    share, number = within([deviation[valid]], [scatter[valid]])
    assert number > 20
    assert share >= WITHIN_TWO


def test_contacts_from_traces():
    """Of maps of all families, other ones than the least length was chosen by."""
    with gzip.open(TRACES, "rt", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len({row["family"] for row in rows}) > 15
    valid = [row for row in rows if row["valid"] == "1"]
    for way, sides in (("one", "32"), ("both", "32")):
        own = [row for row in valid if (row["way"], row["sides"]) == (way, sides)]
        columns = [
            [np.array([float(row[name]) for row in own])] for name in ("error", "scatter")
        ]
        share, number = within(*columns)
        assert number > 300
        assert share >= WITHIN_TWO
    # none of worn, patchy, machined or stretched faces looks Gaussian and isotropic
    assert {row["family"] for row in valid} <= {
        "self_affine",
        "plateau",
        "filtered",
        "gaussian",
    }


def test_a_trace_without_a_roll_off_is_not_valid():
    heights = np.random.default_rng(1).standard_normal(4096).cumsum()
    trace = Surface.from_profile(
        1e-3 * (heights - np.linspace(heights[0], heights[-1], 4096)),
        dx=1.0,
        isotropic=True,
    )
    pressed = contact(trace, area=[0.01, 0.1], theory="calibrated")
    assert not pressed.valid.any()
    assert any("trace" in reason for reason in pressed.reasons)


def test_a_joint_is_valid_where_the_contact_of_its_surface_is():
    """Two faces are one surface with the sum of their spectra."""
    face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    for metal in ("copper C11000 hard", "steel 52100 hard"):
        joint = Joint(
            face,
            face | {"longest": "60 um"},
            bodies=metal,
            nominal_area="4 cm^2",
            theory="calibrated",
        )
        pressures = ["0.01 MPa", "1 MPa", "30 MPa", "300 MPa"]
        pressed = joint.at_pressure(pressures)
        alone = contact(joint.surface, metal, pressure=pressures, theory="calibrated")
        np.testing.assert_array_equal(pressed.valid, alone.valid)
        assert pressed.reasons.keys() == alone.reasons.keys()
