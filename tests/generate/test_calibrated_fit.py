"""The fit of the calibrated law: it finds constants that are known, and says how far off a law is."""

import dataclasses

import numpy as np
import pytest
import xarray as xr

from generate.boundary_elements.evidence import Case
from generate.boundary_elements.surfaces import HELD_OUT_SURFACE, TRAINING
from generate.calibrated import (
    EDGES,
    coverage,
    cross_validate,
    errors,
    fit,
    measure,
    summary,
    told,
)
from generate.calibrated_file import QUANTITIES, write_part
from mbma_tables.common.errors import TableFileError
from mbma_tables.theories.calibrated.formulas import CONSTANTS, Spectrum, SpectrumLaw
from mbma_tables.theories.dataset import read_groups

FORCES = np.geomspace(4e-4, 1.0, 15)
TRUE = dataclasses.replace(
    CONSTANTS,
    area_s0=0.55,
    area_slope=0.02,
    weight=0.47,
    weight_slope=0.2,
    cubic=0.35,
    tail=0.1,
)


def case(hurst, zeta_1, h_max=6.0, factor=1.0):
    """A surface on which simulation agrees with TRUE, forces times a factor."""
    spectrum = Spectrum.self_affine(hurst, zeta_1)
    law = SpectrumLaw(spectrum, h_max, TRUE)
    return Case(
        "self_affine", TRAINING, (hurst, zeta_1), 4, 256, spectrum, spectrum, h_max, {}, FORCES, law.area(FORCES),
        law.separation(FORCES / factor),
    )  # fmt: skip


@pytest.mark.slow
def test_known_constants_are_found():
    found = fit(
        [case(hurst, zeta_1) for hurst in (0.3, 0.6, 1.0) for zeta_1 in (8.0, 64.0)]
    )
    for name, value in dataclasses.asdict(TRUE).items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-3), name


def test_errors_are_those_of_equal_separation_force_and_stiffness():
    off = case(0.8, 32.0, factor=1.1)
    law = off.law(TRUE)
    np.testing.assert_allclose(errors(off, law, "force"), -np.log(1.1), rtol=1e-6)
    np.testing.assert_allclose(errors(off, law, "area"), 0, atol=1e-12)
    compliance, there = (
        (law.separation(F / 1.001) - law.separation(F * 1.001))
        for F in (FORCES / 1.1, FORCES)
    )
    np.testing.assert_allclose(
        errors(off, law, "stiffness")[1:-1], np.log(compliance / there)[1:-1], atol=0.01
    )


@pytest.mark.slow
def test_cross_validation_states_errors_that_cover(monkeypatch):
    monkeypatch.setattr("generate.calibrated_file.FOLDS", 2)
    rng = np.random.default_rng(1)
    seen = [
        case(h, z, factor=np.exp(0.05 * rng.normal()))
        for h in (0.3, 0.6, 0.9)
        for z in (16.0, 24.0)
    ]
    area, force, _ = stated = cross_validate(seen)
    known = told(seen, lambda one: one.law(TRUE))
    covered = coverage(known, stated)
    assert all(0 <= one <= two <= 1 for one, two in covered.values())
    # areas are exact but for what half of the spectra leave open, forces are off by 5% each
    assert np.nanmax(np.hypot(*area.T[:2])) < 0.01
    assert 0.02 < np.hypot(*force[4, :2]) < 0.1
    assert summary(known)[0, 4, :2] == pytest.approx([0, 0], abs=1e-12)
    assert stated.shape == (len(QUANTITIES), len(EDGES) - 1, 4)


def test_floor_is_what_surfaces_of_one_spectrum_differ_by():
    spread = np.array([-0.06, 0.0, 0.06])
    seen = [case(0.6, 16.0, factor=np.exp(shift)) for shift in spread]

    def measured(cases):
        forms = dict.fromkeys(("spectrum", "map"), told(cases, lambda one: one.law(TRUE)))
        return {bar["what"]: bar for bar in measure(forms)}

    bar = measured(seen)[
        "force by spectrum, 10-97% contact, self-affine, 2 or more waves"
    ]
    assert bar["noise"] == pytest.approx(0.06 * np.sqrt(1.5), rel=1e-3)
    assert bar["surfaces"] == 0
    assert np.isnan(bar["found"])
    unseen = [dataclasses.replace(one, split=HELD_OUT_SURFACE) for one in seen]
    force = measured(unseen)[bar["what"]]
    assert force["found"] == pytest.approx(np.expm1(0.06), rel=1e-3)
    assert force["surfaces"] == 3


def test_parts_of_the_file_leave_one_another_alone(tmp_path):
    path = tmp_path / "calibrated.nc"
    root = xr.Dataset(
        {"a": ("contact", [1.0, 2.0])}, attrs={"theories": "calibrated persson"}
    )
    write_part(path, root)
    # a dimension of the same name and another length
    group = xr.Dataset(
        {"b": ("contact", np.arange(3, dtype="i4")), "c": 2.5}, attrs={"eta": 0.4}
    )
    write_part(path, group, "hardness")
    write_part(path, xr.Dataset(attrs={"limit": 0.3}), "leakage")
    write_part(path, root.assign(a=root.a * 2))
    parts = read_groups(path)
    assert list(parts) == ["/", "hardness", "leakage"]
    assert parts["hardness"].identical(group)
    assert parts["leakage"].attrs == {"limit": 0.3}
    assert parts["/"].a.values.tolist() == [2, 4]
    path.write_bytes(path.read_bytes()[:-5])
    with pytest.raises(TableFileError):
        write_part(path, root)
