"""Surfaces of drawings that give little more than Ra: ranges, their spread, and machined maps in it."""

import json

import numpy as np
import pytest
from helpers import run

from generate.drawing import Reduced, covered, errors, flows_in_bands, reduced
from generate.machined import campaign
from mbma_tables import Bodies, InputError, Joint, Surface, contact, uncertainty
from mbma_tables.common.distributions import distribution_of
from mbma_tables.surfaces.drawing import drawing_of
from mbma_tables.surfaces.roughness import processes

METAL = "steel 1020 hard"
QUANTITIES = ("area", "mean_separation", "unloading_stiffness", "solid_conductance")


def width(found, name="unloading_stiffness"):
    low, high = found.quantiles[name][[0, -1], 0]
    return np.log(high / low)


def of(part, **more):
    joint = Joint(part, bodies=METAL, **{"nominal_area": "4 cm^2"} | more)
    return joint.uncertainty("5 MPa", draws=600, quantities=QUANTITIES)


@pytest.mark.parametrize(
    ("Ra", "cut_off", "filter_"),
    # ISO 21920-3, table of default settings, and ISO 3274
    [
        ("0.02 um", 80, 2.5),
        ("0.05 um", 250, 2.5),
        ("0.4 um", 800, 2.5),
        ("2 um", 800, 2.5),
        ("0.0021 mm", 2500, 8),
        ("12 um", 8000, 25),
    ],
)
def test_filters_are_those_of_iso(Ra, cut_off, filter_):
    numbers = drawing_of({"Ra": Ra, "process": "ground"})[0]
    longest = distribution_of("longest", numbers["longest"])
    shortest = distribution_of("shortest", numbers["shortest"])
    assert (longest.high, shortest.low) == (cut_off, filter_)
    assert (longest.unit, shortest.unit) == ("um", "um")
    # every corner is a rough surface
    assert longest.low > 3 * shortest.high


def test_the_root_mean_square_height_has_the_filter_of_its_mean_one():
    # Ra = sqrt(2/pi) Rq: 2.4 um are an Ra of 1.91 um, below 2 um
    assert drawing_of({"Rq": "2.4 um"})[0]["longest"].endswith("..800 um log")
    assert drawing_of({"Ra": "2.4 um"})[0]["longest"].endswith("..2500 um log")


def test_a_surface_of_a_drawing_is_not_valid_and_says_what_it_assumes():
    face = Surface.from_drawing(Ra="1.6 um", process="gaussian", nominal_area="4 cm^2")
    found = contact(face, "58 GPa", pressure="50 MPa", theory="calibrated")
    assert not found.valid
    assert any("are ranges" in reason for reason in found.reasons)
    assumed = found.to_dataset().attrs["assumed"]
    for text in ("ISO 21920-3", "lambda_s = 2.5 um", "Persson"):
        assert text in assumed


def test_nothing_is_assumed_of_a_drawing_with_all_numbers():
    known = {"Ra": "1 um", "hurst": 0.8, "longest": "0.25 mm", "shortest": "4 um"}
    known |= {"nominal_area": "4 cm^2", "process": "gaussian"}
    drawn, plain = Surface.from_drawing(**known), Surface.from_roughness(**known)
    assert repr(drawn) == repr(plain)
    assert drawn.provenance == plain.provenance


def test_joint_and_uncertainty_and_surface_agree():
    given = {"Ra": "1.6 um", "process": "milled"}
    found = [
        uncertainty(given, METAL, pressure="5 MPa", quantities=QUANTITIES[:3]),
        uncertainty(
            Surface.from_drawing(**given),
            METAL,
            pressure="5 MPa",
            quantities=QUANTITIES[:3],
        ),
        Joint(given, bodies=METAL).uncertainty("5 MPa", quantities=QUANTITIES[:3]),
        Joint(Surface.from_drawing(**given), bodies=METAL).uncertainty(
            "5 MPa", quantities=QUANTITIES[:3]
        ),
    ]
    for other in found[1:]:
        for name in QUANTITIES[:3]:
            np.testing.assert_allclose(
                other.quantiles[name], found[0].quantiles[name], rtol=1e-6
            )
        assert not other.valid.any()


def test_of_two_faces_the_wider_spread_counts():
    milled = {"Ra": "1.6 um", "process": "milled"}
    worn = {"Ra": "0.8 um", "process": "worn"}
    pairs = [
        Joint(milled, other, bodies=METAL, nominal_area="4 cm^2")
        for other in (milled, worn)
    ]
    found = [joint.uncertainty("5 MPa", draws=400) for joint in pairs]
    assert "part_b.hurst" in pairs[1].assumed
    assert width(found[1]) > width(found[0])


def test_each_number_that_is_given_narrows_the_band():
    part = {"Ra": "1.6 um", "process": "ground"}
    widths = [width(of(part))]
    for more in ({"longest": "0.25 mm"}, {"hurst": 0.8}, {"shortest": "4 um"}):
        part |= more
        joint = Joint(part, bodies=METAL, nominal_area="4 cm^2")
        if joint.inputs:
            widths.append(width(of(part)))
    assert (np.diff(widths) < 0).all(), widths
    # of a Gaussian face, whose numbers are known, with the law's own scatter
    face = {**part, "process": "gaussian"}
    known = Joint(face, bodies=METAL, nominal_area="4 cm^2").at_pressure("5 MPa")
    assert 2 * 1.645 * known.unloading_stiffness_scatter < widths[-1]


def test_knowing_less_never_looks_better():
    # a face whose process is not named against each that may be meant, and against a map
    unknown = of({"Ra": "1.6 um", "process": "unknown"})
    for process, row in processes().items():
        found = of({"Ra": "1.6 um", "process": process})
        assert not found.valid.any()
        for name in QUANTITIES:
            assert width(found, name) <= width(unknown, name), (process, name)
            if int(row["maps"]) and process != "gaussian":
                kind = {"area": "area", "mean_separation": "gap"}.get(name, "stiffness")
                maps = 2 * 1.645 * float(row[f"{kind}_spread"])
                assert width(found, name) > 0.95 * maps, (process, name)


@pytest.mark.parametrize(
    ("part", "number"),
    [
        ({"Ra": "1.6 um", "process": "milled"}, "longest"),
        ({"Ra": "0.4 um", "process": "ground", "longest": "0.25 mm"}, "shortest"),
        ({"Ra": "3.2 um", "process": "turned"}, "hurst"),
        ({"Ra": "0.8 um", "process": "lapped", "hurst": 0.6}, "longest"),
        ({"Ra": "6.3 um", "process": "blasted"}, "shortest"),
        ({"Ra": "1 um", "process": "gaussian", "hurst": 0.8}, "longest"),
    ],
)
def test_a_band_is_no_narrower_without_a_number(part, number):
    # of one value a band may be wider than that of the range; over its values it is not
    names = ("unloading_stiffness", "solid_conductance", "total_conductance")

    def band(**more):
        joint = Joint(part | more, bodies=METAL, nominal_area="4 cm^2")
        found = joint.uncertainty("5 MPa", draws=100, quantities=names)
        return [width(found, name) for name in names], bool(found.valid[0])

    without, valid = band()
    own = distribution_of(number, drawing_of(part)[0][number])
    values = [
        own.written(float(own.quantile(level))) for level in (0.1, 0.3, 0.5, 0.7, 0.9)
    ]
    known = [band(**{number: value}) for value in values]
    assert (np.mean([each for each, _ in known], axis=0) < without).all()
    assert not valid
    assert not any(with_it for _, with_it in known) or part["process"] == "gaussian"


@pytest.mark.parametrize("theory", ["calibrated", "persson"])
def test_what_is_valid_without_a_number_is_valid_with_it(theory):
    face = {"Ra": "1.6 um", "process": "gaussian", "longest": "250 um"}
    elastic = Bodies("58 GPa", hardness=np.inf)

    def valid(**more):
        part = face | more
        joint = Joint(part, bodies=elastic, theory=theory, nominal_area="4 cm^2")
        found = joint.uncertainty("20 MPa", draws=100, quantities=["area"])
        return bool(found.valid.all())

    own = distribution_of("shortest", drawing_of(face)[0]["shortest"])
    ends = [own.written(float(own.quantile(level))) for level in (0, 0.3, 1)]
    assert valid()
    assert all(valid(shortest=value) for value in ends)


def test_more_numbers_never_turn_an_answer_into_a_refusal():
    """A coarse stylus was refused beside the default's long waves, and a full face for want of an area."""
    part = {"Ra": "1.6 um", "process": "milled", "shortest": "100 um"}
    longest = drawing_of(part)[0]["longest"]
    assert longest == "400..800 um log"
    assert of(part).draws == 600
    # a wave that is given leaves shorter ones a band of four
    assert drawing_of({**part, "shortest": None, "longest": "20 um"})[0]["shortest"] == (
        "2.5..5 um log"
    )
    full = part | {"longest": "0.8 mm", "hurst": 0.8}
    joint = Joint(full, bodies=METAL)
    assert list(joint.inputs) == ["nominal_area"]
    assert joint.assumed["nominal_area"].startswith("1..100 cm^2")
    by_name = uncertainty(full, METAL, pressure="5 MPa", draws=100, quantities=["area"])
    assert np.isfinite(by_name.quantiles["area"]).all()


def test_gaussian_ranges_of_a_tested_kind_are_valid_and_others_are_not():
    face = {
        "Ra": "1.6 um",
        "process": "gaussian",
        "longest": "250 um",
        "shortest": "4 um",
    }
    elastic = Bodies("58 GPa", hardness=np.inf)
    joint = Joint(face, bodies=elastic, nominal_area="4 cm^2")
    assert joint.uncertainty("20 MPa", draws=200).valid.all()
    broad = face | {"shortest": "0.1 um"}
    wide = Joint(broad, bodies=elastic, nominal_area="4 cm^2")
    assert not wide.uncertainty("20 MPa", draws=200).valid.any()


def test_what_to_measure_ranks_by_what_narrows_most():
    part = {"Ra": "1.6 um", "process": "milled"}
    found = of(part)
    ranked = found.what_to_measure("unloading_stiffness")
    assert next(iter(ranked)) == "part_a.longest"
    assert all(0 <= share[0] <= 1 for share in ranked.values())
    # by the variance that is left where the number is known, over its range
    inputs = distribution_of("longest", drawing_of(part)[0]["longest"])
    logs = []
    for level in np.linspace(0.05, 0.95, 10):
        one = of(part | {"longest": f"{float(inputs.quantile(level))!r} um"})
        low, high = one.quantiles["unloading_stiffness"][[0, -1], 0]
        logs.append(np.log(high / low))
    assert np.mean(logs) / width(found) == pytest.approx(
        ranked["part_a.longest"][0], abs=0.1
    )
    with pytest.raises(InputError, match="quantity must be one of"):
        found.what_to_measure("friction")


def test_slopes_and_other_heights_are_taken():
    sloped, _ = drawing_of({"Ra": "1.6 um", "process": "ground", "Rdq": 0.15})
    assert "shortest" not in sloped
    assert of({"Ra": "1.6 um", "process": "ground", "Rdq": 0.15}).draws == 600
    # Rz from 4 to 7 times Ra
    by_Rz = distribution_of("Ra", drawing_of({"Rz": "7 um"})[0]["Ra"])
    assert (by_Rz.low, by_Rz.high) == pytest.approx((1.0, 1.75))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"process": "milled"}, "needs a height"),
        ({"Ra": 1.6}, "no unit of length"),
        ({"Ra": ["1.6 um", "2 um"]}, "one positive number"),
        ({"Ra": "1.6 um", "Rz": "8 um"}, "beside another height"),
        ({"Ra": "-1 um"}, "one positive number"),
        ({"Ra": "1.6 um", "process": "miled"}, "did you mean 'milled'"),
        ({"Ra": "1.6 um", "Rqq": 1.0}, "no argument 'Rqq'|unexpected keyword"),
    ],
)
def test_drawings_that_are_refused(given, message):
    with pytest.raises((InputError, TypeError), match=message):
        Surface.from_drawing(**given)


def test_commands_and_files_take_a_drawing(tmp_path):
    path = tmp_path / "joint.toml"
    rows = 'Ra = "1.6 um"\nprocess = "milled"\n'
    path.write_text(f'bodies = "{METAL}"\nnominal_area = "4 cm^2"\n[part_a]\n{rows}')
    printed = run("joint", path, "--pressure", "5MPa")
    assert "assumed: part_a.longest 80..800 um log: at most lambda_c" in printed
    options = ["--Ra", "1.6um", "--process", "milled", "--nominal-area", "4cm^2"]
    answers = [
        json.loads(run("joint", *rest, "--pressure", "5MPa", "--json"))
        for rest in ([path], [*options, "--bodies", METAL])
    ]
    assert answers[0]["shares"] == answers[1]["shares"]


def test_ranges_of_logarithms():
    wave = distribution_of("longest", "1..100 um log")
    assert wave.median == pytest.approx(10.0)
    np.testing.assert_allclose(wave.quantile([0, 0.25, 1]), [1, 10**0.5, 100])
    with pytest.raises(InputError, match="positive"):
        distribution_of("skew", "-1..1 log")


def maps(number) -> list[Reduced]:
    """One map of every family."""
    chosen = [part for part in campaign.parts() if part.number == number]
    return list(reduced(chosen[:13]))


@pytest.mark.slow
def test_machined_maps_lie_in_the_bands_of_their_Ra():
    found = [covered(one, Ra) for one in maps(3) for Ra in (0.8, 3.2)]
    for name in found[0]:
        assert np.mean([each[name] for each in found]) > 0.9, name


@pytest.mark.slow
def test_spreads_are_those_of_the_maps():
    own = [part for part in campaign.parts() if part.family == "milled"]
    reduced_maps = list(reduced(own))
    of_maps = [errors(one) for one in reduced_maps]
    for kind in ("area", "gap", "stiffness", "flow"):
        found = np.sqrt(np.mean(np.concatenate([each[kind] for each in of_maps]) ** 2))
        stated = float(processes()["milled"][f"{kind}_spread"])
        assert found == pytest.approx(stated, abs=0.001)
    # both axes of ten maps, at the four loads up to 20% contact
    flows = flows_in_bands(reduced_maps)
    assert flows.size == 80
    assert flows.mean() > 0.9
