"""The leak rate of a joint's seal with its band: against draws made by hand, plain formulas and limits of the flow of a gas."""

import csv

import numpy as np
import pytest
from helpers import refused, run
from scipy import stats

from mbma_tables import Bodies, InputError, Joint, Surface, contact
from mbma_tables.contacts.quantities.gas_flow import gas_for_flow, gas_scatter, mass_flow
from mbma_tables.design.batch import batch
from mbma_tables.surfaces.roughness import processes

MILLED = {"Ra": "1.6 um", "process": "milled"}
LAPPED = {"Ra": "0.1 um", "process": "lapped"}
KNOWN = {"Rq": "0.8 um", "hurst": 0.8, "longest": "100 um", "shortest": "4 um"}
METAL = "steel 304 soft"
AREA = "3 cm^2"
OIL = {
    "viscosity": "0.05..0.2 Pa s",
    "pressure_drop": "0.5 MPa",
    "width": "2 mm",
    "length": "0.3 m",
    "unit": "ml/h",
}
HELIUM = {
    "gas": "helium",
    "inlet": "1..2 bar",
    "outlet": "0 bar",
    "width": "2 mm",
    "length": "0.3 m",
}


def by_hand(face, seal, pressure, seed, count):
    """Each draw as a joint of known numbers, with K of its model's error in the plain formulas of flow."""
    joint = Joint(face, face, bodies=METAL, nominal_area=AREA, seal=seal)
    spread = float(processes()[face["process"]]["flow_spread"])
    rates = []
    for replica in joint.replicas(count, seed):
        parts = [dict(face), dict(face)]
        own = dict(seal)
        for place, number in replica.inputs.items():
            where, name = place.split(".")
            target = {"part_a": parts[0], "part_b": parts[1], "seal": own}[where]
            target[name] = number
        made = Joint(*parts, bodies=METAL, nominal_area=AREA)
        pressed = made.at_pressure(pressure)
        K = float(pressed.leakage.K) * 1e-18
        area = float(pressed.area)
        drawn = K * np.exp(-replica.model * spread)
        if "gas" in seal:
            inlet = 1e5 * float(own["inlet"].split()[0])
            helium = gas_for_flow("helium", 293.15)
            plain, moved = (
                0.3 * float(mass_flow(each, area, helium, inlet, 0.0, 2e-3))
                for each in (K, drawn)
            )
            own_error = replica.model * float(gas_scatter(area))
            size = np.hypot(np.log(moved / plain), own_error)
            rates.append(plain * np.exp(-np.sign(replica.model) * size))
        else:
            viscosity = float(own["viscosity"].split()[0])
            rates.append(3.6e9 * 0.3 * drawn * 5e5 / (12 * viscosity * 2e-3))
    return joint, np.array(rates)


@pytest.mark.parametrize(
    ("face", "seal", "pressure"),
    [(MILLED, OIL, "20 MPa"), (LAPPED, HELIUM, "100 MPa")],
    ids=["oil", "helium"],
)
def test_the_band_is_that_of_draws_made_by_hand(face, seal, pressure):
    joint, rates = by_hand(face, seal, pressure, 4, 100)
    levels = (0.05, 0.25, 0.5, 0.75, 0.95)
    found = joint.uncertainty(
        pressure, draws=100, quantiles=levels, quantities=["leak_rate"], seed=4
    )
    assert found.units["leak_rate"] == seal.get("unit", "kg/s")
    np.testing.assert_allclose(
        found.quantiles["leak_rate"][:, 0], np.quantile(rates, levels), rtol=1e-6
    )
    assert "seal.viscosity" in found.inputs or "seal.inlet" in found.inputs
    replica = joint.replicas(3, 4)[2].at_pressure(pressure)
    assert replica.leak_rate == pytest.approx(rates[2], rel=1e-6)
    # other draws have the same distribution
    other = joint.uncertainty(
        pressure, draws=500, quantities=["leak_rate"], quantiles=levels, seed=9
    )
    for level, quantile in zip(levels, other.quantiles["leak_rate"][:, 0], strict=True):
        below = int((rates < quantile).sum())
        low, high = stats.binom.interval(1 - 1e-5, rates.size, level)
        assert low <= below <= high


def test_the_leak_rate_of_known_faces_has_the_scatter_of_its_law():
    """Without a range the band of a row is that of the model alone."""
    seal = OIL | {"viscosity": "0.1 Pa s"}
    joint = Joint(KNOWN, bodies=METAL, nominal_area=AREA, seal=seal, theory="calibrated")
    pressed = joint.at_pressure("50 MPa")
    rate = pressed.leakage.liquid("0.1 Pa s", "0.5 MPa", "2 mm")  # um^2/s
    assert pressed.leak_rate == pytest.approx(float(rate) * 0.3e6 * 1e-12 * 3600)
    assert pressed.leak_rate_scatter == pytest.approx(pressed.leakage.scatter, rel=1e-12)
    table = joint.table(["20 MPa", "50 MPa"])
    assert table.leak_rate.attrs["units"] == "ml/h"
    assert table.leak_rate.values[1] == pytest.approx(pressed.leak_rate)
    assert float(table.leak_rate_scatter[1]) == pytest.approx(pressed.leakage.scatter)


@pytest.mark.parametrize(
    ("inlet", "power"),
    [("1e5 bar", 1.0), ("1e-9 bar", 2 / 3)],
    ids=["continuum", "free molecules"],
)
def test_the_band_of_a_gas_is_narrower_where_molecules_are_free(inlet, power):
    """Flow goes like K in a continuum, and but for logarithms like K^(2/3) of free molecules."""
    seal = HELIUM | {"inlet": inlet}
    joint = Joint(LAPPED, LAPPED, bodies=METAL, nominal_area=AREA, seal=seal)
    names = ["flow_coefficient", "leak_rate"]
    found = joint.uncertainty("30 MPa", quantities=names, draws=500)
    flow, rate = (np.ptp(np.log(found.quantiles[name])) for name in names)
    assert rate / flow == pytest.approx(power, rel=0.03)


def test_numbers_of_a_batch_of_seals_broadcast():
    seal = OIL | {"viscosity": "0.1 Pa s", "width": np.array([2e3, 4e3])}
    joint = Joint(KNOWN, bodies=METAL, nominal_area=AREA, seal=seal, theory="calibrated")
    assert joint.shape == (2,)
    wide = joint.at_pressure([["20 MPa"], ["50 MPa"]]).leak_rate
    assert wide.shape == (2, 2)
    np.testing.assert_allclose(wide[:, 0], 2 * wide[:, 1])
    texts = Joint(
        KNOWN,
        bodies=METAL,
        nominal_area=AREA,
        seal=seal | {"width": ["2 mm", "4 mm"]},
        theory="calibrated",
    )
    np.testing.assert_allclose(
        texts.at_pressure([["20 MPa"], ["50 MPa"]]).leak_rate, wide
    )
    with pytest.raises(InputError, match=r"of one seal, and seal\.width have several"):
        joint.sensitivity("20 MPa")


def test_derivatives_of_a_leak_rate_are_differences_of_it():
    seal = HELIUM | {"inlet": "2 bar"}
    given = {"bodies": METAL, "nominal_area": AREA, "seal": seal, "theory": "calibrated"}
    slopes = Joint(KNOWN, **given).sensitivity("20 MPa").slopes
    rates = [
        Joint(KNOWN | {"Rq": f"{number} um"}, **given).leak_rate("20 MPa")
        for number in (0.79, 0.81)
    ]
    slope = np.log(rates[1] / rates[0]) / np.log(0.81 / 0.79)
    assert slopes["part_a.Rq"]["leak_rate"] == pytest.approx(slope, rel=1e-3)


def test_files_have_the_seal_by_column_and_the_band(tmp_path):
    table = tmp_path / "designs.csv"
    table.write_text(
        "seal.viscosity [Pa s],seal.width [mm],pressure [MPa]\n0.05..0.2,2,20\n0.1,1,20\n"
    )
    seal = {n: OIL[n] for n in ("pressure_drop", "length", "unit")}
    common = {
        "part_a": MILLED,
        "part_b": MILLED,
        "bodies": METAL,
        "nominal_area": AREA,
        "seal": seal,
    }
    out = tmp_path / "answers.csv"
    batch(table, out, common=common, draws=200, seed=3)
    rows = list(csv.DictReader(out.read_text().splitlines()))
    for row, own in zip(
        rows,
        ({}, {"viscosity": "0.1 Pa s", "width": "1 mm"}),
        strict=True,
    ):
        joint = Joint(MILLED, MILLED, bodies=METAL, nominal_area=AREA, seal=OIL | own)
        found = joint.uncertainty("20 MPa", draws=200, seed=3)
        cells = [float(row[f"leak_rate{end} [ml/h]"]) for end in ("_low", "", "_high")]
        np.testing.assert_allclose(cells, found.quantiles["leak_rate"][:, 0], rtol=1e-9)


def test_a_batch_without_a_seal_has_no_column_of_it(tmp_path):
    table = tmp_path / "designs.csv"
    table.write_text("part_a.Rq [um],pressure [MPa]\n0.8,20\n")
    common = {"part_a": KNOWN, "bodies": METAL, "nominal_area": AREA}
    del (face := dict(KNOWN))["Rq"]
    batch(table, tmp_path / "answers.csv", common=common | {"part_a": face})
    assert "leak" not in (tmp_path / "answers.csv").read_text().splitlines()[0]


def test_the_command_prints_the_band_of_the_leak_rate():
    words = ["--Ra", "1.6um", "--process", "milled", "--nominal-area", AREA]
    words += ["--bodies", METAL, "--pressure", "20MPa", "--draws", "100", "--csv"]
    for name, value in HELIUM.items():
        words += ["--set", f"seal.{name}={value}"]
    printed = run("joint", *words, "--set", "seal.unit=mg/h")
    assert "seal.inlet: 1..2 bar" in printed
    lines = [line for line in printed.splitlines() if not line.startswith("#")]
    (row,) = csv.DictReader(lines)
    seal = HELIUM | {"unit": "mg/h"}
    joint = Joint(MILLED, bodies=METAL, nominal_area=AREA, seal=seal)
    found = joint.uncertainty("20 MPa", draws=100)
    cells = [float(row[f"leak_rate{end}"]) for end in ("_low", "", "_high")]
    np.testing.assert_allclose(cells, found.quantiles["leak_rate"][:, 0], rtol=1e-12)


@pytest.mark.parametrize(
    ("seal", "message"),
    [
        ("helium", "seal has its numbers by name"),
        ({"gas": "helium", "inlet": "1 bar", "width": "2 mm"}, "seal needs outlet"),
        (OIL | {"outlet": "1 bar"}, "seal has no 'outlet'"),
        (HELIUM | {"widht": "1 mm"}, "did you mean 'width'"),
        (OIL | {"unit": "ml/hour"}, "did you mean 'ml/h'"),
        (HELIUM | {"unit": "ml/h"}, "did you mean 'mg/h'"),
    ],
)
def test_seals_that_are_refused(seal, message):
    with pytest.raises(InputError, match=message):
        Joint(KNOWN, bodies=METAL, nominal_area=AREA, seal=seal)


def test_what_a_leak_rate_needs_is_named():
    joint = Joint(KNOWN, bodies=METAL, nominal_area=AREA)
    with pytest.raises(InputError, match="leak_rate needs seal, which is missing: Joint"):
        joint.at_pressure("20 MPa").quantity("leak_rate")
    with pytest.raises(InputError, match="seal needs viscosity, pressure_drop, width"):
        Joint(KNOWN, bodies=METAL, nominal_area=AREA, seal={"unit": "ml/h"})


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("leakage", "flow_coefficient"),
        ("leak", "leak_rate"),
        ("leakage_scater", "leakage_scatter"),
        ("aera", "area"),
        ("torque", ""),
    ],
)
def test_an_unknown_quantity_is_refused_with_what_is_meant_and_all_that_are_known(
    name, meant
):
    """'leakage' was taken for 'leakage_scatter', and no name that is known was listed."""
    joint = Joint(MILLED, bodies=METAL, nominal_area=AREA)
    with pytest.raises(InputError) as refusal:
        joint.uncertainty("20 MPa", quantities=[name], draws=100)
    said = str(refusal.value)
    hint, _, known = said.partition("known are ")
    expected = f"did you mean {meant!r}? " if meant else ""
    assert hint == f"no quantity is named {name!r}; {expected}"
    assert {"area", "flow_coefficient", "leak_rate"} <= {*known.split(", ")}


def test_a_metal_without_a_temper_is_called_elastic_where_its_contact_is_printed():
    soft = Surface.from_drawing(Ra="1.6 um", process="milled")
    without = contact(soft, "aluminium 6061", pressure="5 MPa")
    said = "hardness not known, so that contacts are elastic: of aluminium 6061 give its temper"
    assert said in repr(without)
    joint = Joint(MILLED, bodies="aluminium 6061", nominal_area=AREA)
    assert said in repr(joint)
    assert said in repr(joint.central.at_pressure("5 MPa"))
    printed = str(joint.uncertainty("5 MPa", draws=100, quantities=["area"]))
    assert "aluminium 6061 yields here: give its temper" in printed
    for bodies in (
        "aluminium 6061 hard",
        Bodies(metals="aluminium 6061", hardness=np.inf),
        "70 GPa",
    ):
        assert "not known, so that" not in repr(contact(soft, bodies, pressure="5 MPa"))
    words = ["joint", "--Ra", "1.6um", "--process", "milled", "--nominal-area", AREA]
    printed = run(
        *words, "--bodies", "aluminium 6061", "--pressure", "5MPa", "--draws", "100"
    )
    assert f"{said.replace('hardness ', 'hardness: ')}" in printed


def test_the_command_refuses_a_seal_with_other_numbers():
    assert "seal has no 'colour'" in refused(
        "joint", "--Ra", "1.6um", "--process", "milled", "--nominal-area", AREA,
        "--bodies", METAL, "--pressure", "5MPa", "--set", "seal.colour=red",
    )  # fmt: skip


def test_a_leak_rate_is_valid_where_the_flow_is():
    """Contacts up to a zeta_1 of 128 are tested with a hardness, the flow up to 64."""
    face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "100 um", "shortest": "1 um"}
    joint = Joint(
        face | {"Rq": "0.8 um +- 0.01 um"},
        bodies=METAL,
        nominal_area=AREA,
        seal=OIL,
        theory="calibrated",
    )
    flow = "leakage: the longest wavelength is more than 64 times the shortest, beyond simulated flow"
    found = {
        name: joint.uncertainty("50 MPa", quantities=[name], draws=100)
        for name in ("area", "leak_rate", "hydraulic_aperture")
    }
    assert found["area"].valid.all()
    for name in ("leak_rate", "hydraulic_aperture"):
        assert not found[name].valid.any()
        assert [*found[name].reasons] == [flow]
    known = Joint(face, bodies=METAL, nominal_area=AREA, theory="calibrated")
    pressed = known.at_pressure("50 MPa")
    assert pressed.judged(["area", "scatter"]) is pressed
    assert pressed.judged(["area", "leakage_scatter"]) is pressed.leakage
