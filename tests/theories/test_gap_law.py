"""The distribution of gaps against boundary elements that no constant was fitted to."""

import numpy as np
import pytest

from generate.boundary_elements.surfaces import REFINEMENT, SPLITS
from generate.gaps import FILE, HELD_OUT, KIND, errors_of, simulated
from mbma_tables import Bodies, Surface, contact
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.theories import gap_law
from mbma_tables.theories.dataset import read_groups
from mbma_tables.theories.simulated.map_gaps import restored


@pytest.fixture(scope="module")
def campaign():
    return read_groups(FILE)[KIND]


def test_mean_decay_of_held_out_surfaces(campaign):
    """Half of the means of exp(-gap/range) within 2%, and 95% within twice what is stated."""
    held = simulated(campaign, HELD_OUT)
    errors = np.abs(errors_of(held, gap_law.CONSTANTS))
    stated = gap_law.scatter_of_decay(held.area[:, None], np.array(gap_law.RANGES))
    inside = np.isfinite(stated)
    assert inside.sum() > 1500
    assert np.median(errors) < 0.02
    assert (errors[inside] < 2 * stated[inside]).mean() > 0.95
    # a scatter that were far too large would hold, too
    assert (errors[inside] < stated[inside]).mean() < 0.9


def test_long_ranges_against_the_points_of_the_grid(campaign):
    """Ranges from h_rms on see no edges: raw means of held-out surfaces, without any correction."""
    place = int(np.abs(campaign["range"].values - 1.0).argmin())
    errors = []
    for number in range(campaign.sizes["surface"]):
        one = campaign.isel(surface=number)
        if SPLITS[int(one.split)] not in HELD_OUT or int(one.points) < 512:
            continue
        alpha = 4 * float(one.band_curvature.sum())
        area, u = one.area_raw.values, one.mean_separation.values
        share, gap = gap_law.open_gaps(u, area, alpha)
        law = (share * np.exp(-gap / float(campaign["range"][place]))).sum(axis=-1)
        errors.append(np.log(law / one.gap_moment.values[:, place]))
    assert len(errors) >= 6
    assert np.median(np.abs(errors)) < 0.01
    # light contacts are few spots, of which two surfaces of one spectrum have other ones
    heavy = np.abs(errors)[:, campaign.force.values[0] > 0.05]
    assert heavy.max() < 0.05


def test_restored_gaps_do_not_depend_on_the_grid(campaign):
    """One surface on grids of 4 to 32 points a wave: points alone lose most of the small gaps."""
    grids = {}
    for number in range(campaign.sizes["surface"]):
        one = campaign.isel(surface=number)
        if SPLITS[int(one.split)] == REFINEMENT and float(one.hurst) == 0.8:
            grids[int(one.points)] = one
    assert sorted(grids) == [64, 128, 256, 512]
    _, weight = gap_law.rule()
    place = int(np.abs(campaign["range"].values - 0.01).argmin())
    for load in (5, 7, 9):
        found = {}
        for points, one in grids.items():
            area, raw, u = (
                float(values[load])
                for values in (one.area, one.area_raw, one.mean_separation)
            )
            gaps = restored(one.gap_quantile.values[load].astype(float), area, raw, u)
            decay = (weight * np.exp(-gaps / 0.01)).sum() * (1 - area)
            found[points] = decay, float(one.gap_moment[load, place])
        finest = found[512][0]
        assert abs(np.log(found[64][0] / finest)) < 0.15
        assert abs(np.log(found[256][0] / finest)) < 0.06
        assert found[64][1] < 0.6 * finest


def test_identities_and_the_limit_beside_edges():
    u, area = np.array([2.0, 0.7, 0.05]), np.array([0.01, 0.1, 0.7])
    for alpha in (1.6, 10.0, 5e3):
        share, gap = gap_law.open_gaps(u, area, alpha)
        assert share.sum(axis=-1) == pytest.approx(1 - area, rel=1e-9)
        assert (share * gap).sum(axis=-1) == pytest.approx(u, rel=1e-12)
        assert (np.diff(gap, axis=-1) > 0).all()
        low, high = (
            gap_law.density(gap, area, np.array(size)) for size in (1e-13, 8e-13)
        )
        assert low / high == pytest.approx(2.0, rel=1e-4)  # 8^(1/3)
        assert gap_law.share_below(gap, area, np.array(0.0)) == pytest.approx(area)
        assert gap_law.share_below(gap, area, np.array(1e3)) == pytest.approx(1.0)


@pytest.mark.parametrize("area", [0.0, 1e-14, 1e-6, 0.5, 1 - 1e-9, 1.0])
@pytest.mark.parametrize("u", [1e-12, 0.3, 4.0, 30.0])
def test_gaps_of_any_contact_are_finite_and_rise(u, area):
    share, gap = gap_law.open_gaps(u, area, 12.0)
    assert np.isfinite(gap).all()
    assert (np.diff(gap) > 0).all()
    assert (share >= 0).all()


SURFACE = Surface(hurst=0.8, q0=0.1, q1=3.2, h_rms=1.0, h_max=3.5, unit="um")


def test_contacts_have_their_gaps():
    pressed = contact(SURFACE, "1 GPa", area=[0.02, 0.2], theory="calibrated")
    assert pressed.gap_mean(np.abs) == pytest.approx(pressed.mean_separation)
    assert pressed.gap_mean(lambda gap: np.ones_like(gap)) == pytest.approx(
        1 - pressed.area
    )
    one = contact(SURFACE, "1 GPa", area=0.2, theory="calibrated")
    step = 1e-4
    slope = np.diff(one.gap_share([0.1 - step, 0.1 + step]))[0] / (2 * step)
    assert one.gap_density("100 nm") == pytest.approx(slope, rel=1e-4)
    median = one.gap_share(one.median_gap)
    assert median == pytest.approx(one.area + 0.5 * (1 - one.area), rel=1e-3)
    # in other units of length the same shares
    in_nm = contact(SURFACE.to("nm"), "1 GPa", area=0.2, theory="calibrated")
    assert in_nm.gap_share(100.0) == pytest.approx(one.gap_share(0.1), rel=1e-9)


def test_what_the_gaps_refuse():
    pressed = contact(SURFACE, "1 GPa", area=0.2, theory="calibrated")
    for wrong in (np.nan, np.inf, -0.1):
        with pytest.raises((InputError, OutOfRangeError)):
            pressed.gap_share(wrong)
    with pytest.raises(OutOfRangeError):
        pressed.gap_density(0.0)
    with pytest.raises(InputError, match="finite"), np.errstate(all="ignore"):
        pressed.gap_mean(lambda gap: gap * np.nan)
    with pytest.raises(InputError, match="shape"):
        pressed.gap_mean(lambda gap: gap[..., :3])
    metal = contact(
        SURFACE, Bodies("1 GPa", hardness="20 MPa"), area=0.2, theory="calibrated"
    )
    for ask in (lambda: metal.gap_mean(np.abs), lambda: metal.gap_share(0.1)):
        with pytest.raises(InputError, match="elastic"):
            ask()


def test_a_simulated_map_has_its_own_gaps():
    noise = np.fft.rfft2(np.random.default_rng(4).standard_normal((128, 128)))
    q = np.hypot(np.fft.fftfreq(128)[:, None], np.fft.rfftfreq(128))
    # nine points to the shortest wave
    power = np.where((q > 0.03) & (q < 0.11), np.maximum(q, 0.01) ** -1.8, 0)
    heights = np.fft.irfft2(noise * power)
    surface = Surface.from_map(heights / heights.std(), dx=0.1, periodic=True, unit="um")
    pressed = contact(surface, "1 GPa", area=0.2)
    assert pressed.theory == "simulated"
    field = pressed.map().gap
    open_part = field[field > 0]
    for length in (0.1, 0.3, 1.0):
        found = pressed.gap_mean(lambda gap, rho=length: np.exp(-gap / rho))
        of_points = np.exp(-open_part / length).sum() / field.size
        # cells cut by edges are contact in the map, with gaps of about zero
        cut = 1 - open_part.size / field.size - pressed.area
        assert 0 < cut < 0.05
        assert of_points < found < of_points + 1.05 * cut
