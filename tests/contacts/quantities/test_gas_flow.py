"""Leak rates of gases: Q against the solved Boltzmann equation, limits, units, and flow through simulated gaps."""

import dataclasses
import itertools
import math
import pathlib

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from helpers import refusals
from scipy.integrate import quad

from mbma_tables import (
    InputError,
    Joint,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
    sealing_pressure,
)
from mbma_tables.contacts.quantities.gas_flow import (
    AREAS,
    RATE_UNITS,
    gas_for_flow,
    gas_scatter,
    poiseuille,
    poiseuille_integral,
    width_of_channels,
)

FACE = Surface(hurst=0.8, q0=0.01, q1=0.4, h_rms=2.0, h_max=7.0, unit="um")
R = 8.314462618
DATA = pathlib.Path(__file__).parents[3] / "docs" / "data" / "gas_flow.csv"


def leak(**where):
    return contact(
        FACE, "20 MPa", theory="calibrated", **(where or {"area": 0.1})
    ).leakage


def solved_flow(D, cells=400):
    """Q by Cercignani's integral equation of the linearised Bhatnagar-Gross-Krook model.

    psi(x) = 1 + integral T_-1(|x - y|) psi(y) dy/sqrt(pi) over the channel, Q = (mean of
    psi - 1)/D; here by constants in cells, with T_-1 integrated to -T_0.
    """

    def T_0(x):
        near = quad(lambda t: math.exp(-t * t - x / t), 0, 1, limit=200)[0]
        return near + quad(lambda t: math.exp(-t * t - x / t), 1, 10)[0]

    edges = D / 2 * np.cos(np.linspace(math.pi, 0, cells + 1))  # denser at the walls
    middle = (edges[1:] + edges[:-1]) / 2
    x = np.concatenate([[0.0], np.geomspace(1e-9 * D, D, 1500)])
    values = np.array([T_0(one) if one else math.sqrt(math.pi) / 2 for one in x])
    signed = edges[None, :] - middle[:, None]
    # integral of T_-1 from 0 to s is T_0(0) - T_0(s), odd in s
    primitive = np.sign(signed) * (values[0] - np.interp(np.abs(signed), x, values))
    kernel = np.diff(primitive, axis=1) / math.sqrt(math.pi)
    psi = np.linalg.solve(np.eye(cells) - kernel, np.ones(cells))
    return ((psi * np.diff(edges)).sum() / D - 1) / D


@pytest.mark.parametrize("D", [0.01, 0.08, 0.3, 1.0, 4.0, 20.0])
def test_flow_between_plates_is_that_of_the_boltzmann_equation(D):
    assert poiseuille(D) == pytest.approx(solved_flow(D), rel=0.01)


def test_free_molecules_and_a_continuum():
    assert poiseuille(1e4) == pytest.approx(1e4 / 6 + 1.0162, rel=1e-7)
    # one more decade of Knudsen numbers adds ln(10)/sqrt(pi)
    assert poiseuille(1e-5) - poiseuille(1e-4) == pytest.approx(
        math.log(10) / math.sqrt(math.pi), rel=1e-12
    )


@pytest.mark.parametrize("D", [1e-4, 0.01, 0.1, 0.15, 2.0, 5.0, 300.0])
def test_the_integral_is_that_of_the_flow(D):
    ends = [0.0, *(one for one in (0.01, 0.15, 5.0) if one < D), D]
    by_parts = sum(
        quad(lambda x: float(poiseuille(x)), a, b, epsabs=0, epsrel=1e-11)[0]
        for a, b in itertools.pairwise(ends)
    )
    assert poiseuille_integral(D) == pytest.approx(by_parts, rel=1e-9)


def test_at_high_pressure_it_is_the_compressible_flow_of_a_continuum():
    found = leak(area=0.02)
    rate = found.gas("nitrogen", "300 bar", "200 bar", "2 mm", temperature=300.0)
    R_s = R / 28.014e-3
    K = found.K * 1e-18
    expected = K * (300e5**2 - 200e5**2) / (24 * 17.9e-6 * R_s * 300.0 * 2e-3)
    assert rate == pytest.approx(expected, rel=0.01)
    assert rate > expected  # slip


def test_of_free_molecules_flow_is_in_proportion_to_the_pressure_difference():
    found = leak()
    rates = [
        found.gas("helium", high, low, "2 mm", unit="mbar l/s")
        for high, low in ((1e-3, 0.0), (2e-3, 1e-3))
    ]
    assert rates[1] == pytest.approx(rates[0], rel=0.12)  # but for ln of the pressure
    helium = gas_for_flow("helium", 293.15)
    h = float(width_of_channels(found.K * 1e-18, 0.1))
    D = 0.5e-3 * h / float(helium.viscosity * helium.speed)
    # plates of the same flow of a liquid: K h^-3 of them side by side
    plates = found.K * 1e-18 / h**3 * h**2 * float(poiseuille(D)) * 1e-3
    mass = plates / float(helium.speed) / 2e-3
    kg = found.gas("helium", 1e-3, 0.0, "2 mm")
    assert kg == pytest.approx(mass, rel=0.05)


def test_units_of_rates():
    found = leak()
    rates = {
        unit: found.gas("helium", "1 bar", "0 bar", "2 mm", "0.3 m", unit=unit)
        for unit in RATE_UNITS
    }
    # an ideal gas: mass of 1 mbar l at 293.15 K, and 1 standard cm^3 of 22414 a mole
    assert rates["mbar l/s"] * 0.1 * 4.0026e-3 / (R * 293.15) == pytest.approx(
        rates["kg/s"], rel=1e-9
    )
    assert rates["sccm"] / 60 / 22413.97 * 4.0026e-3 == pytest.approx(
        rates["kg/s"], rel=1e-5
    )
    assert rates["mg/h"] == pytest.approx(3.6e9 * rates["kg/s"])
    assert rates["mbar l/s"] == pytest.approx(10 * rates["Pa m^3/s"])
    per_metre = found.gas("helium", "1 bar", "0 bar", "2 mm")
    assert per_metre * 0.3 == pytest.approx(rates["kg/s"])


def test_the_mean_free_path_of_air():
    # 66 nm at 1 atm and 20 deg C, S. G. Jennings, J. Aerosol Sci. 19 (1988) 159
    air = gas_for_flow("air", 293.15)
    assert 1e9 * float(air.mean_free_path(101325.0)) == pytest.approx(66.0, rel=0.02)
    own = gas_for_flow({"mass": 28.97e-3, "viscosity": float(air.viscosity)}, 293.15)
    assert own.mean_free_path(101325.0) == pytest.approx(
        float(air.mean_free_path(101325.0))
    )


def test_arrays_and_labels():
    areas = xr.DataArray([0.02, 0.1, 0.5], dims="load")
    found = leak(area=areas)
    rates = found.gas("air", xr.DataArray([1e5, 2e5], dims="side"), 0.0, "2 mm")
    assert rates.dims == ("load", "side")
    assert float(rates[2].max()) == 0.0
    one = leak(area=0.1).gas("air", "2 bar", 0.0, "2 mm")
    assert float(rates[1, 1]) == pytest.approx(one, rel=1e-12)


def test_temperatures_and_numbers_of_a_gas_keep_their_labels():
    found = leak(area=xr.DataArray([0.02, 0.1], dims="load"))
    seal = (2e5, 0.0, "2 mm")
    by_temperature = found.gas(
        "air", *seal, temperature=xr.DataArray([250.0, 300.0, 400.0], dims="T")
    )
    assert by_temperature.dims == ("load", "T")
    one = leak(area=0.1).gas("air", *seal, temperature=400.0)
    assert float(by_temperature[1, 2]) == pytest.approx(one, rel=1e-12)
    viscosity = xr.DataArray([1.5e-5, 1.9e-5], dims="gas")
    by_gas = found.gas({"mass": 0.029, "viscosity": viscosity}, *seal)
    assert by_gas.dims == ("load", "gas")


def test_contacts_laws_and_joints_leak_alike():
    face = {"Rq": "2 um", "hurst": 0.8, "longest": "500 um", "shortest": "10 um"}
    joint = Joint(face, bodies="20 MPa", nominal_area="4 cm^2", theory="calibrated")
    asked = ("air", "2 bar", "0 bar", "2 mm")
    of_joint = joint.at_pressure("0.05 MPa").leakage.gas(*asked)
    of_law = joint.law().at_pressure("0.05 MPa").leakage.gas(*asked)
    surface = joint.surface
    of_contact = contact(
        surface, "20 MPa", pressure="0.05 MPa", theory="calibrated"
    ).leakage.gas(*asked)
    assert of_joint == pytest.approx(of_contact, rel=1e-12)
    assert of_law == pytest.approx(of_contact, rel=1e-3)


def test_simulated_gaps_that_no_constant_was_fitted_to():
    """Reynolds' equation with the flow of a gas between plates, on surfaces with eight longest waves a side."""
    data = pd.read_csv(DATA)
    data = data[data.waves == 8]
    assert len(data) > 30
    paths = [name for name in data if name.startswith("flow_")]
    h = width_of_channels(data["flow"].to_numpy(), data.area.to_numpy())
    for name in paths:
        D = math.sqrt(math.pi) / 2 * h / float(name.removeprefix("flow_"))
        law = data["flow"] * 6 * poiseuille(D) / D
        error = np.abs(np.log(law / data[name]))
        assert error[data.area < 0.3].max() < 0.11
        stated = gas_scatter(data.area)
        assert (error < 2 * stated).mean() > 0.9
    assert AREAS[0] > data.area.min()


def test_the_pressure_that_seals():
    law = contact_law(FACE, "20 MPa", theory="calibrated")
    seal = {"inlet": "2 bar", "outlet": "1 bar", "width": "2 mm", "length": "0.2 m"}
    found = sealing_pressure(law, "1e-2 mg/h", gas="nitrogen", **seal)
    leaks = contact(FACE, "20 MPa", pressure=found.pressure, theory="calibrated").leakage
    rate = leaks.gas("nitrogen", *seal.values(), unit="mg/h")
    assert rate == pytest.approx(1e-2, rel=1e-3)
    assert found.low < found.pressure < found.high
    up = contact(FACE, "20 MPa", pressure=found.high, theory="calibrated").leakage
    high = up.gas("nitrogen", *seal.values(), unit="mg/h")
    # the rate of the larger K, which free molecules make less of than in proportion
    wider = dataclasses.replace(up, K=up.K * np.exp(up.scatter))
    of_flow = math.log(wider.gas("nitrogen", *seal.values(), unit="mg/h") / high)
    assert of_flow < 0.95 * up.scatter
    spread = math.hypot(of_flow, float(gas_scatter(up._contact.area)))
    assert math.log(1e-2 / high) == pytest.approx(spread, rel=0.02)
    more = sealing_pressure(law, "1e-4 mg/h", gas="nitrogen", **seal)
    assert more.pressure > found.pressure


def asked(**changes):
    given = {"gas": "air", "inlet": "1 bar", "outlet": "0 bar", "width": "2 mm"}
    return leak().gas(**(given | changes))


test_what_is_refused = refusals(
    lambda ask: ask(),
    (lambda: asked(gas="helum"), "helium"),
    (lambda: asked(gas={"mass": 0.004}), "'mass' and 'viscosity'"),
    (lambda: asked(inlet=np.nan), "inlet"),
    (lambda: asked(inlet=-1.0), OutOfRangeError, "inlet"),
    (lambda: asked(outlet="2 bar"), OutOfRangeError, "outlet"),
    (lambda: asked(width="0 mm"), OutOfRangeError, "width"),
    (lambda: asked(unit="mbar*l/s"), "mbar l/s"),
    (lambda: asked(temperature=100.0), OutOfRangeError, "from 200 to 600 K"),
    (
        lambda: contact(Surface(0.8, 0.01, 0.4, 2.0, 7.0), 20.0, area=0.1).leakage.gas(
            "air", "1 bar", "0 bar", 2000.0
        ),
        "give the surface its unit",
    ),
    (
        lambda: sealing_pressure(
            contact_law(FACE, "20 MPa", theory="calibrated"),
            "1e-6 l/s",
            gas="air",
            inlet="1 bar",
            outlet="0 bar",
            width="2 mm",
        ),
        "must be a number with its unit",
    ),
    (
        lambda: sealing_pressure(
            contact_law(FACE, "20 MPa", theory="calibrated"),
            "1e9 mbar l/s",
            gas="air",
            inlet="1 bar",
            outlet="0 bar",
            width="2 mm",
        ),
        OutOfRangeError,
        "leaks less",
    ),
    error=InputError,
)
