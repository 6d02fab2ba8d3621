"""Tables of totals as theories: beside the theories that they stand for, on every route, and what they refuse."""

import copy
import json
import pickle

import numpy as np
import pytest
import tabulated
from click.testing import CliRunner

from mbma_tables import (
    Bodies,
    InputError,
    Joint,
    OutOfRangeError,
    Scene,
    Surface,
    contact,
    contact_law,
)
from mbma_tables.cli import main
from mbma_tables.tables.make_function import make, wanted_of
from mbma_tables.theories import Tabulated
from mbma_tables.theories.totals import totals_of

LOGS = {"pressure": {"transform": "log"}, "area": {"transform": "log"}}
RANGES = {
    "greenwood_williamson": {
        "hurst": {"low": 0.7, "high": 0.9},
        "zeta_1": {"low": 100.0, "high": 300.0, "transform": "log"},
        "h_max": {"low": 2.8, "high": 3.3},
        "gap": {"low": 0.2, "high": 2.0},
    },
    "mbma": {
        "hurst": {"low": 0.7, "high": 0.9},
        "zeta_1": {"low": 100.0, "high": 300.0, "transform": "log"},
        "h_max": {"low": 2.8, "high": 3.3},
        "compression": {"low": 0.02, "high": 0.9, "transform": "log"},
    },
}
TARGETS = {"greenwood_williamson": 1e-6, "mbma": 1e-4}
FACE = Surface(0.8, 0.5, 100.0, 0.2, 0.6)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("totals")
    for name, axes in RANGES.items():
        entries = {
            "function": f"mbma_tables.theories.totals:{name}",
            "axes": axes,
            "outputs": LOGS,
            "chunk": 2048,
            "certificate_points": 2000,
        }
        make(wanted_of(entries, target=TARGETS[name]), folder / f"{name}.nc")
    return {name: str(folder / f"{name}.nc") for name in RANGES}


@pytest.mark.parametrize("name", RANGES)
def test_contacts_are_those_of_the_theory_within_the_tables_error(name, files):
    theory = Tabulated(files[name])
    target = TARGETS[name]
    gaps = np.linspace(0.1, 0.38, 40)
    found = contact(FACE, mean_separation=gaps, theory=theory)
    exact = contact(FACE, mean_separation=gaps, theory=name)
    for quantity in ("pressure", "area"):
        relative = np.abs(getattr(found, quantity) / getattr(exact, quantity) - 1)
        assert (relative <= found.error + exact.error).all()
        assert (found.error <= 2 * target).all()
    assert np.allclose(found.stiffness, exact.stiffness, rtol=300 * target)
    assert np.allclose(found.energy, exact.energy, rtol=10 * target)
    again = contact(FACE, pressure=found.pressure, theory=theory)
    # solved in the table, to rounding
    assert np.allclose(again.mean_separation, gaps, rtol=1e-12)
    # where the theory is valid, and with its scatter
    assert (found.valid == exact.valid).all()
    assert found.reasons.keys() == exact.reasons.keys()


def test_every_route_takes_the_file(files):
    file = files["mbma"]
    pressure = 2e-3
    expected = contact(FACE, pressure=pressure, theory=Tabulated(file)).area
    assert contact(FACE, pressure=pressure, theory=file).area == expected
    law = contact_law(FACE, theory=file)
    assert law.area(pressure=pressure) == pytest.approx(expected, rel=1e-3)
    assert law.energy(0.2) == pytest.approx(
        contact(FACE, mean_separation=0.2, theory="mbma").energy, rel=1e-3
    )
    joint = Joint(FACE, bodies=Bodies(1.0), theory=file)
    assert joint.at_pressure(pressure).area == expected
    numbers = [
        "--hurst",
        "0.8",
        "--q0",
        "0.5",
        "--q1",
        "100",
        "--h-rms",
        "0.2",
        "--h-max",
        "0.6",
    ]
    line = ["contact", *numbers, "--pressure", str(pressure), "--theory", file, "--json"]
    done = CliRunner().invoke(main, line)
    assert done.exit_code == 0, done.output
    assert json.loads(done.output)["columns"]["area"] == [
        pytest.approx(expected, rel=1e-12)
    ]
    batch = Surface(np.linspace(0.72, 0.88, 7), 0.5, 100.0, 0.2, 0.6)
    assert contact(batch, mean_separation=0.3, theory=file).pressure.shape == (7,)
    hard = contact(FACE, Bodies(hardness=0.05), pressure=pressure, theory=file)
    assert hard.area == pytest.approx(
        contact(FACE, Bodies(hardness=0.05), pressure=pressure, theory="mbma").area,
        rel=1e-3,
    )
    for theory in (file, Tabulated(file)):
        scene = Scene(
            FACE, quantities=["pressure"], separation=[0.2], theory=theory, rtol=1e-3
        )
        by_mbma = contact(FACE, separation=0.2, theory="mbma").pressure
        assert float(scene.run()["pressure"][0]) == pytest.approx(
            float(by_mbma), rel=1e-3
        )


def test_equal_tables_are_equal_theories(files):
    theory = Tabulated(files["mbma"])
    assert theory == Tabulated(files["mbma"]) != Tabulated(files["greenwood_williamson"])
    for same in (pickle.loads(pickle.dumps(theory)), copy.deepcopy(theory)):
        assert same == theory
        assert contact(FACE, mean_separation=0.3, theory=same).area > 0
    assert files["mbma"] in repr(theory)


def test_what_the_table_does_not_cover_is_refused(files):
    theory = Tabulated(files["mbma"])
    with pytest.raises(OutOfRangeError, match=r"hurst must be in \[0.7, 0.9\]"):
        contact(Surface(0.5, 0.5, 100.0, 0.2, 0.6), mean_separation=0.3, theory=theory)
    with pytest.raises(OutOfRangeError):
        contact(FACE, mean_separation=0.599, theory=theory)
    with pytest.raises(OutOfRangeError, match="pressure must be within the table's"):
        contact(FACE, pressure=1e-30, theory=theory)
    spectral = FACE.combined(Surface(0.8, 0.3, 30.0, 0.2, 0.6))
    with pytest.raises(InputError, match="five numbers"):
        contact(spectral, mean_separation=0.3, theory=theory)


def test_tables_of_something_else_are_refused(tmp_path):
    make(
        wanted_of(
            {"function": "tabulated:raises", "axes": {"x": {"low": 0.1, "high": 0.6}}}
        ),
        tmp_path / "other.nc",
    )
    with pytest.raises(InputError, match="totals of a theory have"):
        Tabulated(str(tmp_path / "other.nc"))
    with pytest.raises(OSError, match="cannot be read"):
        Tabulated(str(tmp_path / "missing.nc"))


def test_a_users_theory_is_tabulated_and_never_valid(tmp_path, monkeypatch):
    class Mine:
        name = "mine"

        def answer(self, surface, mean_separation):
            u = np.asarray(mean_separation) / surface.h_rms
            pressure = surface.rms_gradient * np.exp(-2 * u) / (1 + u)
            return pressure, 2 * np.exp(-2 * u) / (2 + u)

    monkeypatch.setattr(
        tabulated, "mine", totals_of(Mine(), of_h_max=False), raising=False
    )
    axes = {
        name: RANGES["greenwood_williamson"][name] for name in ("hurst", "zeta_1", "gap")
    }
    entries = {"function": "tabulated:mine", "axes": axes, "outputs": LOGS}
    make(wanted_of(entries, target=1e-6), tmp_path / "mine.nc")
    found = contact(FACE, mean_separation=0.3, theory=str(tmp_path / "mine.nc"))
    exact = contact(FACE, mean_separation=0.3, theory=Mine())
    assert found.pressure == pytest.approx(exact.pressure, rel=1e-6)
    assert found.stiffness == pytest.approx(exact.stiffness, rel=1e-3)
    assert not found.valid
    assert any("one of a user" in reason for reason in found.reasons)
    assert np.isnan(found.energy)


@pytest.mark.slow
def test_persson_is_tabulated_without_h_max(tmp_path):
    axes = {
        "hurst": {"low": 0.75, "high": 0.85},
        "zeta_1": {"low": 150.0, "high": 250.0, "transform": "log"},
        "gap": {"low": 0.2, "high": 3.0},
    }
    entries = {
        "function": "mbma_tables.theories.totals:persson",
        "axes": axes,
        "outputs": LOGS,
        "certificate_points": 500,
        "pieces": 1,
    }
    make(wanted_of(entries, target=1e-4), tmp_path / "p.nc")
    for h_max in (0.5, 0.9):
        face = Surface(0.8, 0.5, 100.0, 0.2, h_max)
        found = contact(
            face, mean_separation=[0.1, 0.5], theory=Tabulated(tmp_path / "p.nc")
        )
        exact = contact(face, mean_separation=[0.1, 0.5], theory="persson")
        assert np.allclose(found.pressure, exact.pressure, rtol=1e-4)


def test_members_are_theories_and_a_mean_of_theories_is_none_of_them(tmp_path):
    """A member is valid where its own theory is, and stands for that one alone."""
    entries = {
        "function": "mbma_tables.theories.totals:persson",
        "axes": {
            "hurst": {"low": 0.75, "high": 0.85},
            "zeta_1": {"low": 150.0, "high": 250.0},
            "gap": {"low": 0.5, "high": 1.5},
        },
        "outputs": LOGS,
        "certificate_points": 200,
        "pieces": 1,
    }
    members = {"functions": ["tabulated:half_of_persson"], "names": ["paper", "half"]}
    for rule in ("envelope", "replicas"):
        both = entries | {"members": members | {"rule": rule}}
        make(wanted_of(both, target=1e-5), tmp_path / f"{rule}.nc")
    found = {
        (rule, member): Tabulated(tmp_path / f"{rule}.nc", member=member)
        for rule in ("envelope", "replicas")
        for member in (None, "paper", "half")
    }
    for (rule, member), theory in found.items():
        shipped = member == "paper" or (member is None and rule == "envelope")
        assert (theory.stands_for is not None) == shipped
        answer = contact(FACE, mean_separation=0.2, theory=theory)
        exact = contact(FACE, mean_separation=0.2, theory="persson")
        factor = {"paper": 1.0, "half": 0.5, None: 1.0 if shipped else 0.75}[member]
        assert answer.pressure / exact.pressure == pytest.approx(factor, rel=3e-5)
        assert answer.valid <= shipped
    with pytest.raises(InputError, match="no member 'quarter'"):
        Tabulated(tmp_path / "envelope.nc", member="quarter")
