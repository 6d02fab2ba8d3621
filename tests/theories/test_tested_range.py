"""`valid` is True only for surfaces and contacts like those simulated, by every theory."""

import numpy as np
import pytest
import xarray as xr
from helpers import contact_of

from generate.boundary_elements.evidence import evidence
from mbma_tables import Bodies, Surface, contact
from mbma_tables.theories import THEORIES

each = pytest.mark.parametrize("theory", THEORIES)


def random_surfaces(rng, count):
    """Surfaces within and outside of what was simulated, with rms gradients below one."""
    hurst = rng.uniform(0.01, 1.0, count)
    zeta_1 = 10 ** rng.uniform(0.6, 4, count)
    return Surface(hurst, 1e-6, 1e-6 * zeta_1, 1.0, rng.uniform(2.0, 10.0, count))


@each
def test_valid_implies_within_the_range_of_the_simulations(theory):
    alike = [one for one in evidence() if one.kind == "self_affine"]
    least_hurst = min(float(one.node[1]) for one in alike)
    zetas = [one.zeta_1 for one in alike]
    areas = np.concatenate([one.area for one in alike])
    rng = np.random.default_rng(46)
    surface = random_surfaces(rng, 2000)
    depth = np.where(
        rng.random(2000) < 0.5,
        10 ** rng.uniform(-6, 0, 2000),
        rng.uniform(0.2, 0.99, 2000),
    )
    options = {"outside": "nan"} if theory == "mbma" else {}
    pressed = contact_of(
        surface, mean_separation=surface.h_max * (1 - depth), theory=theory, **options
    )
    valid = pressed.valid
    assert valid.sum() > (5 if theory == "greenwood_williamson" else 30)
    assert (surface.hurst[valid] >= least_hurst * (1 - 1e-9)).all()
    assert (surface.zeta_1[valid] >= min(zetas) * (1 - 1e-9)).all()
    assert (surface.zeta_1[valid] <= max(zetas) * (1 + 1e-9)).all()
    assert (pressed.area[valid] >= areas[areas > 0].min()).all()
    assert (pressed.area[valid] <= areas.max()).all()
    assert np.isfinite(pressed.scatter[valid]).all()
    # and beside it no comparison is made up
    beyond = (surface.hurst < least_hurst) | (surface.zeta_1 > max(zetas))
    assert np.isnan(pressed.scatter[beyond]).all()


@each
def test_extreme_surfaces_are_not_valid(theory):
    for hurst, zeta_1 in ((0.05, 1e8), (0.01, 1e6)):
        surface = Surface(hurst, 1e-12, 1e-12 * zeta_1, 1.0, 4.0)
        options = {"outside": "exact"} if theory == "mbma" else {}
        pressed = contact_of(surface, area=1e-12, theory=theory, **options)
        assert not pressed.valid
        assert np.isnan(pressed.scatter)
        assert any(
            "the Hurst exponent is below 0.2" in reason for reason in pressed.reasons
        )


@each
def test_a_small_nominal_area_is_not_valid(theory):
    rough = {"Rq": 1.0, "longest": 100.0, "shortest": 2.0, "hurst": 0.8, "unit": "um"}
    for waves, tested in (
        (1.0, False),
        (2.0, False),
        (3.9, False),
        (4.0, True),
        (50.0, True),
    ):
        face = Surface.from_roughness(**rough, nominal_area=(100.0 * waves) ** 2)
        for surface in (face, face.to("mm"), face.sampled()):
            pressed = contact(surface, area=0.05, theory=theory)
            reasons = [
                reason for reason in pressed.reasons if "wavelengths a side" in reason
            ]
            assert len(reasons) == (not tested)
            assert not (pressed.valid and not tested)
    batch = Surface.from_roughness(**rough, nominal_area=np.array([1e4, 1e6]))
    masks = contact(batch, area=0.05, theory=theory).reasons
    assert [mask.tolist() for text, mask in masks.items() if "a side" in text] == [
        [True, False]
    ]
    small = Surface.from_roughness(**rough, nominal_area=1e4)
    labelled = contact(small, area=xr.DataArray([0.05, 0.1], dims="load"), theory=theory)
    assert not labelled.valid.any()


@each
def test_the_bulk_yields_from_a_third_of_the_hardness_on(theory):
    # smooth faces, so that much of them is in contact below the hardness
    surface = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=0.2, h_max=0.66)
    share = np.array([0.02, 0.33, 0.34, 0.7])
    pressed = contact(
        surface, Bodies(hardness=1e-3), pressure=1e-3 * share, theory=theory
    )
    masks = [
        mask.tolist()
        for text, mask in pressed.reasons.items()
        if "a third of the hardness" in text
    ]
    assert masks == [[False, False, True, True]]
    assert not pressed.valid[2:].any()
    elastic = contact(
        surface, Bodies(hardness=np.inf), pressure=1e-3 * share, theory=theory
    )
    assert not any("a third of the hardness" in reason for reason in elastic.reasons)
