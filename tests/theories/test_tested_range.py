"""`valid` is True only for surfaces and contacts like those simulated, by every theory."""

import numpy as np
import pytest
import xarray as xr
from helpers import contact_of

from generate.boundary_elements.evidence import evidence
from mbma_tables import Bodies, InputError, Joint, Surface, contact, contact_law
from mbma_tables.common.files import records, shipped_file
from mbma_tables.theories import THEORIES, Calibrated, Mbma, Persson
from mbma_tables.theories.hardness import with_hardness

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
    if theory == "calibrated":
        with xr.open_dataset("docs/data/bandwidth.nc", group="bandwidth") as wide:
            # of the others there are too few
            evident = (wide["shape"] == 0) & (wide.waves >= 2)
            zetas += wide.zeta_1.values[evident].tolist()
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
    # a theory that was not compared with simulations is never valid
    least = 0 if np.isnan(pressed.scatter).all() else 6
    assert valid.sum() >= (least if theory == "greenwood_williamson" else 5 * least)
    assert least or not valid.any()
    assert (surface.hurst[valid] >= least_hurst * (1 - 1e-9)).all()
    assert (surface.zeta_1[valid] >= min(zetas) * (1 - 1e-9)).all()
    assert (surface.zeta_1[valid] <= max(zetas) * (1 + 1e-9)).all()
    assert (pressed.area[valid] >= areas[areas > 0].min()).all()
    assert (pressed.area[valid] <= areas.max()).all()
    assert np.isfinite(pressed.scatter[valid]).all()
    # and beside it no comparison is made up
    beyond = (surface.hurst < least_hurst) | (surface.zeta_1 > max(zetas))
    assert np.isnan(pressed.scatter[beyond]).all()


@pytest.mark.parametrize(
    "theory",
    [
        "calibrated",
        "persson",
        Persson("simplified"),
        "mbma",
        Mbma(variant="printed"),
        Mbma(variant="fitted"),
    ],
    ids=str,
)
def test_heights_beyond_those_simulated_are_not_valid_by_any_form_of_a_theory(theory):
    """Forms with a scatter of their own were taken for theories that know the heights of a map."""
    heights = np.array([2.3, 3.5, 8.2])
    surface = Surface(0.8, 0.01, 0.2, 1.0, heights)
    pressed = contact(surface, area=0.01, theory=theory)
    assert pressed.valid.tolist() == [False, True, False]


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


# ratio of the unloading stiffnesses of two theories, in standard deviations of their difference
MOST_APART = 3.0


@pytest.mark.parametrize("theory", [name for name in THEORIES if name != "calibrated"])
@pytest.mark.parametrize("side", [4.0, 20.0, 100.0, 1000.0])
def test_valid_faces_that_yield_agree_with_the_law_fitted_to_simulations(theory, side):
    """Faces with a nominal area, whose highest point is up to 6 h_rms: MBMA is 20 times off there."""
    face = Surface.from_roughness(
        Rq="2 um",
        longest="250 um",
        shortest="4 um",
        hurst=0.8,
        nominal_area=f"{(side * 250) ** 2} um^2",
    )
    pressure = ["3 MPa", "10 MPa", "50 MPa", "200 MPa"]
    for hardness in ("0.4 GPa", "1 GPa", "6 GPa"):
        bodies = Bodies("115 GPa", hardness=hardness)
        pressed = contact(face, bodies, pressure=pressure, theory=theory)
        law = contact(face, bodies, pressure=pressure, theory="calibrated")
        ratio = np.log(pressed.unloading_stiffness / law.unloading_stiffness)
        scatter = np.hypot(
            pressed.unloading_stiffness_scatter, law.unloading_stiffness_scatter
        )
        assert np.isfinite(scatter[pressed.valid]).all()
        assert (np.abs(ratio) <= MOST_APART * scatter)[pressed.valid].all()


def test_a_theory_that_was_not_compared_with_a_hardness_is_not_valid():
    face = Surface(hurst=0.8, q0=0.06, q1=1.9, h_rms=0.2, h_max=0.7, unit="um")
    pressed = contact(
        face,
        Bodies("115 GPa", hardness="1 GPa"),
        area=0.05,
        theory="greenwood_williamson",
    )
    assert not pressed.valid
    assert any(
        "not compared with simulations with a hardness" in r for r in pressed.reasons
    )
    # an infinite hardness is the elastic contact, which was
    elastic = contact(
        face, Bodies("115 GPa", hardness=np.inf), area=0.05, theory="greenwood_williamson"
    )
    assert elastic.valid


class WithoutScatter:
    """A theory of a user, of which no comparison is stated."""

    name = "without scatter"

    def answer(self, surface, u):
        pressure = 0.1 * np.exp(-2 * u / surface.h_rms)
        return pressure, 2 * pressure / surface.rms_gradient


def test_without_a_stated_scatter_nothing_is_valid():
    face = Surface(hurst=0.8, q0=0.06, q1=1.9, h_rms=1.0, h_max=3.5)
    pressed = contact(face, pressure=1e-3, theory=WithoutScatter())
    assert np.isnan(pressed.scatter)
    assert not pressed.valid
    assert any("model uncertainty" in reason for reason in pressed.reasons)


@pytest.mark.parametrize("theory", ["calibrated", "persson"])
@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"q1": 0.32}, "less than 8 times the shortest"),
        ({"h_max": 0.3}, "h_max/h_rms is outside"),
        ({"h_max": 3.0}, "h_max/h_rms is outside"),
        ({"hurst": 0.05}, "Hurst exponent"),
        ({"q1": 60.0}, "times the shortest"),
    ],
)
def test_a_spectrum_is_valid_where_its_five_numbers_are(theory, changed, reason):
    numbers = {"hurst": 0.8, "q0": 0.1, "q1": 6.0, "h_rms": 0.3, "h_max": 1.1}
    tested = Surface(**numbers, unit="um")
    assert contact(tested, area=0.1, theory=theory).valid
    assert contact(tested.sampled(), area=0.1, theory=theory).valid
    surface = Surface(**numbers | changed, unit="um")
    for face in (surface, surface.sampled()):
        pressed = contact(face, area=0.1, theory=theory)
        assert not pressed.valid
        assert any(reason in text for text in pressed.reasons)


def test_short_wavelengths_of_a_bent_spectrum_weigh_like_a_low_hurst_exponent():
    # two power laws that meet, so that the spectrum as a whole has no exponent
    q = np.geomspace(0.1, 6.0, 60)
    for exponent, tested in ((2.05, False), (2.3, True), (3.6, True)):
        C = np.where(q < 1.0, q**-exponent, q ** -(exponent + 0.3))
        h_rms = Surface.from_spectrum(q, C, h_max=1.0, convention="paper").h_rms
        surface = Surface.from_spectrum(
            q, C * (0.1 / h_rms) ** 2, h_max=0.35, convention="paper"
        )
        assert surface.hurst is None
        pressed = contact(surface, area=0.1, theory="calibrated")
        assert bool(pressed.valid) == tested
        low = [text for text in pressed.reasons if "a Hurst exponent of 0.2" in text]
        assert bool(low) != tested


def test_valid_contacts_name_what_they_were_compared_with():
    face = Surface(hurst=0.8, q0=0.06, q1=1.9, h_rms=1.0, h_max=3.5)
    elastic, hard, untested = (
        contact(face, Bodies(hardness=hardness), area=area, theory="calibrated")
        for hardness, area in ((np.inf, 0.1), (0.2, 0.1), (np.inf, 1e-4))
    )
    assert [bool(one.valid) for one in (elastic, hard, untested)] == [True, True, False]
    assert elastic.evidence == (
        "139 simulated surfaces (docs/fidelity.md), hurst 0.2 to 1, q1/q0 8 to 512, "
        "h_max/h_rms 2.5 to 8, A/A0 0.001 to 0.97"
    )
    assert hard.evidence.startswith(elastic.evidence)
    assert "; with a hardness 50 simulated surfaces (docs/yield.md), " in hard.evidence
    for one in (elastic, hard):
        assert f"evidence {one.evidence}" in repr(one)
    assert "evidence" not in repr(untested)


def test_numbers_of_simulated_surfaces_are_those_of_the_data():
    counts = {}
    for path, group in (
        ("boundary_elements.nc", "elastic"),
        ("boundary_elements.nc", "hardness"),
        ("bandwidth.nc", "bandwidth"),
    ):
        with xr.open_dataset(f"docs/data/{path}", group=group) as data:
            named = {
                name: np.array(data[name].flag_meanings.split())[data[name].values]
                for name in ("kind", "split")
            }
            own = named["split"] != "refine"
            if group == "bandwidth":
                own &= (data["shape"] == 0).values & (data.waves >= 2).values
            is_self_affine = named["kind"] == "self_affine"
            counts[group] = int((own & is_self_affine).sum()), int(own.sum())
    with xr.open_dataset("docs/data/boundary_elements.nc", group="machined") as data:
        counts["machined"] = data.sizes["surface"], data.sizes["yielding"]
    for row in records(shipped_file("tested.csv")):
        of_spectra, of_maps = counts[row["evidence"]]
        by_map = row["theory"] == "calibrated_map" or (
            row["theory"] == "simulated" and row["contact"] == "hardness"
        )
        assert int(row["surfaces"]) == (of_maps if by_map else of_spectra), row


def test_two_faces_have_no_hurst_exponent_that_is_too_low():
    """Their bands barely overlap: the reason named an exponent below 0.2, and both have larger ones."""
    smooth = Surface(hurst=0.8, q0=0.01, q1=0.1, h_rms=1.0, h_max=4.0)
    rough = Surface(hurst=0.5, q0=0.04, q1=0.2, h_rms=1.0, h_max=4.0)
    (reason,) = contact(smooth.combined(rough), area=0.1, theory="calibrated").reasons
    assert reason.startswith("short wavelengths have more of the height than")


def test_a_smooth_second_face_does_not_widen_what_was_tested():
    narrow = {"Rq": "0.3 um", "hurst": 0.8, "longest": "63 um", "shortest": "20 um"}
    options = {"bodies": "100 GPa", "nominal_area": "4 cm^2"}
    for faces in ((narrow,), (narrow, narrow | {"Rq": "1e-6 um"})):
        assert not Joint(*faces, **options).at_pressure("10 MPa").valid


def test_a_theory_with_a_hardness_is_no_theory_of_an_elastic_contact():
    """Beside `Bodies` it was applied twice, and without them its unloading stiffness was that of loading."""
    face = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5)
    theory = with_hardness(Calibrated(), 0.01, 1.0)
    for bodies in (1.0, Bodies(hardness=0.01)):
        with pytest.raises(InputError, match="a hardness is of the bodies"):
            contact(face, bodies, pressure=1e-3, theory=theory)
        with pytest.raises(InputError, match="a hardness is of the bodies"):
            contact_law(face, bodies, theory=theory)
