"""Numbers that are not known: quantiles, shares and replicas against Monte Carlo, and refused ranges."""

import dataclasses
import json
import pathlib
import time

import numpy as np
import pytest
from helpers import refused, run
from scipy import stats

from mbma_tables import (
    Bodies,
    InputError,
    Joint,
    OutOfRangeError,
    Surface,
    contact,
    uncertainty,
)
from mbma_tables.common.distributions import distribution_of
from mbma_tables.surfaces.roughness import processes

FACE = {"hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
RANGES = {
    "part_a": FACE | {"Ra": "0.4 um +- 0.04 um"},
    "part_b": FACE | {"Ra": "0.5..0.7 um"},
    "nominal_area": "3..5 cm^2",
    "bodies": Bodies(
        metals=METALS,
        hardness="0.9..1.1 GPa",
        conductivity=("40..50 W/(m K)", "167 W/(m K)"),
    ),
}
PRESSURE = "10 MPa"


@pytest.fixture(scope="module")
def joint():
    return Joint(**RANGES)


@pytest.fixture(scope="module")
def found(joint):
    return joint.uncertainty(PRESSURE)


@pytest.fixture(scope="module")
def direct():
    """The same inputs by scipy's distributions and another seed, one batch of plain numbers."""
    rng = np.random.default_rng(77)
    count = 20_000
    numbers = {
        "part_a.Ra": stats.truncnorm(-4, 4, 0.4, 0.04).rvs(count, random_state=rng),
        "part_b.Ra": rng.uniform(0.5, 0.7, count),
        "nominal_area": rng.uniform(3e8, 5e8, count),
        "bodies.hardness": rng.uniform(0.9, 1.1, count),
        "bodies.conductivity.0": rng.uniform(40, 50, count),
    }
    plain = {"hurst": 0.8, "longest": 500.0, "shortest": 8.0, "unit": "um"}
    made = Joint(
        plain | {"Ra": numbers["part_a.Ra"]},
        plain | {"Ra": numbers["part_b.Ra"]},
        nominal_area=numbers["nominal_area"],
        bodies=Bodies(
            metals=METALS,
            hardness=numbers["bodies.hardness"],
            conductivity=(
                [f"{k!r} W/(m K)" for k in numbers["bodies.conductivity.0"].tolist()],
                ["167 W/(m K)"] * count,
            ),
        ),
    )
    return made.at_pressure(PRESSURE), rng.standard_normal(count), numbers


@pytest.mark.parametrize(
    ("name", "scatter", "sign"),
    [
        ("area", "area_scatter", 1),
        ("total_conductance", "total_conductance_scatter", 1),
        ("solid_conductance", "solid_conductance_scatter", 1),
        ("tangential_stiffness", "unloading_stiffness_scatter", 1),
        ("mean_separation", "separation_scatter", -1),
    ],
)
def test_quantiles_are_those_of_a_direct_monte_carlo(found, direct, name, scatter, sign):
    pressed, error, _ = direct
    value = getattr(pressed, name)
    spread = getattr(pressed, scatter)
    if name == "mean_separation":
        spread = spread / value
    table = value * np.exp(sign * error * spread)
    for level, quantile in zip(found.levels, found.quantiles[name][:, 0], strict=True):
        share_below = np.mean(table < quantile)
        sampling = np.sqrt(level * (1 - level) * (1 / found.draws + 1 / error.size))
        assert abs(share_below - level) < 4 * sampling


@pytest.mark.parametrize("name", ["area", "total_conductance", "mean_separation"])
def test_shares_are_sobol_indices_by_freezing_each_input(found, direct, name):
    """Saltelli's estimate: covariance of the results of two samples that have one input in common."""
    _, error, numbers = direct
    half = error.size // 2

    def results(first, second, shared):
        values = {
            key: np.where(key == shared, column[first], column[second])
            for key, column in numbers.items()
        }
        plain = {"hurst": 0.8, "longest": 500.0, "shortest": 8.0, "unit": "um"}
        both = (
            [f"{k!r} W/(m K)" for k in values["bodies.conductivity.0"].tolist()],
            ["167 W/(m K)"] * half,
        )
        bodies = Bodies(
            metals=METALS, hardness=values["bodies.hardness"], conductivity=both
        )
        made = Joint(
            plain | {"Ra": values["part_a.Ra"]},
            plain | {"Ra": values["part_b.Ra"]},
            nominal_area=values["nominal_area"],
            bodies=bodies,
        ).at_pressure(PRESSURE)
        own = error[first] if shared == "model" else error[second]
        scatter = {
            "area": made.area_scatter,
            "total_conductance": made.total_conductance_scatter,
            "mean_separation": -made.separation_scatter / made.mean_separation,
        }[name]
        return np.log(getattr(made, name)) + own * scatter

    first, second = slice(0, half), slice(half, 2 * half)
    base = results(first, first, "none")
    for key in (*numbers, "model"):
        other = results(first, second, key)
        products = (base - base.mean()) * (other - other.mean()) / base.var()
        share = found.shares[name][key][0]
        # sampling errors of both estimates, of the polynomials from 2,000 draws
        sampling = np.hypot(products.std() / np.sqrt(half), 1 / np.sqrt(found.draws))
        assert abs(share - products.mean()) < 4 * sampling


def test_inputs_of_narrow_ranges_hardly_interact(found):
    for shares in found.shares.values():
        known = [share[0] for share in shares.values() if np.isfinite(share[0])]
        assert 0.97 < sum(known) <= 1


def test_a_conductance_without_gas_follows_its_conductivity_alone():
    face = FACE | {"Ra": "0.4 um"}
    bodies = Bodies("60 GPa", conductivity="20..80 W/(m K)")
    vacuum = Joint(face, bodies=bodies, nominal_area="4 cm^2", gas="vacuum")
    found = vacuum.uncertainty(PRESSURE, quantities=["solid_conductance"])
    scatter = vacuum.central.at_pressure(PRESSURE).solid_conductance_scatter
    # of k uniform between a and b the variance of ln k is 1 - a b ln^2(b/a)/(b - a)^2
    of_input = 1 - 20 * 80 * np.log(4) ** 2 / 60**2
    expected = of_input / (of_input + scatter**2)
    share = found.shares["solid_conductance"]["bodies.conductivity"][0]
    assert share == pytest.approx(expected, abs=4 / np.sqrt(found.draws))


def test_replicas_are_the_first_draws_and_belong_together(joint, found):
    replicas = joint.replicas(60, seed=found.seed)
    assert [each.inputs for each in joint.replicas(20)] == [
        each.inputs for each in replicas[:20]
    ]
    replica = replicas[3]
    part_a = RANGES["part_a"] | {"Ra": replica.inputs["part_a.Ra"]}
    part_b = RANGES["part_b"] | {"Ra": replica.inputs["part_b.Ra"]}
    bodies = dataclasses.replace(
        RANGES["bodies"],
        hardness=replica.inputs["bodies.hardness"],
        conductivity=(replica.inputs["bodies.conductivity.0"], "167 W/(m K)"),
    )
    area = replica.inputs["nominal_area"]
    made = Joint(part_a, part_b, bodies=bodies, nominal_area=area)
    pressures = ["10 MPa", "50 MPa"]
    pressed = made.at_pressure(pressures)
    drawn = replica.at_pressure(pressures)
    np.testing.assert_allclose(
        drawn.solid_conductance / pressed.solid_conductance,
        np.exp(replica.model * pressed.solid_conductance_scatter),
        rtol=1e-12,
    )
    np.testing.assert_allclose(
        drawn.tangential_stiffness / drawn.solid_conductance,
        pressed.tangential_stiffness / pressed.solid_conductance,
        rtol=1e-12,
    )
    # where the model makes the area larger, the gap is smaller
    assert np.all((drawn.area > pressed.area) == (replica.model > 0))
    assert np.all(
        (drawn.mean_separation < pressed.mean_separation) == (replica.model > 0)
    )
    np.testing.assert_array_equal(drawn.psi, pressed.psi)


def test_the_model_makes_errors_of_area_and_gap_opposite():
    """As boundary elements show: at a force, a law's area that is too large comes with too small a gap."""
    pytest.importorskip("xarray")
    from mbma_tables.theories.dataset import boundary_elements

    elastic = boundary_elements()["elastic"].to_dataset()
    errors = []
    for k in np.flatnonzero(np.isfinite(elastic.zeta_1) & (elastic.kind == 4)):
        one = elastic.isel(surface=k)
        q0 = float(one.q0_h_rms)
        surface = Surface(
            float(one.hurst), q0, q0 * float(one.zeta_1), 1.0, float(one.h_max)
        )
        use = ((one.area > 0.005) & (one.area < 0.1)).values
        force = one.force.values[use] * surface.rms_gradient
        law = contact(surface, pressure=force, theory="calibrated")
        area = np.log(one.area.values[use] / law.area)
        gap = one.mean_separation.values[use] - law.mean_separation
        stiffness = np.log(
            one.stiffness.values[use] * surface.rms_gradient / law.stiffness
        )
        errors.append([area, gap, stiffness])
    table = np.concatenate(errors, axis=1)
    table = table[:, np.isfinite(table).all(axis=0)]
    correlations = np.corrcoef(table)[np.triu_indices(3, 1)]
    of_area_gap, of_area_stiffness, of_gap_stiffness = correlations
    assert of_area_gap < 0
    assert of_area_stiffness > 0.3
    assert of_gap_stiffness < -0.3


def test_a_contact_of_a_surface_has_the_same_quantiles_as_its_joint():
    face = FACE | {"Ra": "0.4 um +- 0.05 um", "hurst": "0.7..0.9"}
    joint = Joint(face, bodies=METALS, nominal_area="4 cm^2", gas="vacuum")
    options = {"pressure": PRESSURE, "quantities": ["area"], "theory": "calibrated"}
    alone = uncertainty(face | {"nominal_area": "4 cm^2"}, METALS, **options)
    together = joint.uncertainty(PRESSURE, quantities=["area"])
    np.testing.assert_allclose(alone.quantiles["area"], together.quantiles["area"])


def test_moduli_and_ratios_of_poisson_may_be_ranges():
    face = FACE | {"Ra": "0.4 um"}
    E = ("200..220 GPa", "70 GPa +- 1 GPa")
    bodies = Bodies(E=E, nu=("0.28..0.3", 0.33), hardness="1 GPa")
    joint = Joint(face, bodies=bodies, nominal_area="4 cm^2", gas="vacuum")
    assert [*joint.inputs] == ["bodies.nu.0", "bodies.E.0", "bodies.E.1"]
    names = ["tangential_stiffness"]
    found = joint.uncertainty(PRESSURE, draws=100, quantities=names)
    drawn = []
    for replica in joint.replicas(100):
        numbers = [replica.inputs[f"bodies.E.{k}"] for k in (0, 1)]
        nu = (replica.inputs["bodies.nu.0"], 0.33)
        own = Bodies(E=tuple(numbers), nu=nu, hardness="1 GPa")
        one = Joint(face, bodies=own, nominal_area="4 cm^2", gas="vacuum")
        pressed = one.at_pressure(PRESSURE)
        scatter = pressed.unloading_stiffness_scatter
        drawn.append(pressed.tangential_stiffness * np.exp(replica.model * scatter))
    np.testing.assert_allclose(
        found.quantiles[names[0]][:, 0], np.quantile(drawn, found.levels), rtol=1e-9
    )


def test_parts_of_different_bands_are_drawn_one_after_the_other():
    other = FACE | {"Ra": "0.8 um", "longest": "400..600 um"}
    joint = Joint(
        RANGES["part_a"], other, bodies=METALS, nominal_area="4 cm^2", gas="vacuum"
    )
    found = joint.uncertainty(PRESSURE, draws=100, quantities=["area"])
    drawn = [
        each.at_pressure(PRESSURE).area for each in joint.replicas(100, seed=found.seed)
    ]
    np.testing.assert_allclose(
        found.quantiles["area"][:, 0], np.quantile(drawn, found.levels), rtol=1e-9
    )


def test_valid_is_of_the_whole_range():
    """A range of which the draws are valid, and a corner is not."""
    face = FACE | {"Ra": "0.4 um"}
    valid = Joint(
        face,
        bodies=METALS,
        nominal_area="4 cm^2",
        gas={"name": "air", "temperature": "300..310"},
    )
    assert valid.uncertainty(PRESSURE).valid.all()
    soft = Bodies("60 GPa", hardness="0.02..1 GPa")
    wide = Joint(face, bodies=soft, nominal_area="4 cm^2")
    corner = Joint(
        face, bodies=Bodies("60 GPa", hardness="0.02 GPa"), nominal_area="4 cm^2"
    )
    at_corner = corner.at_pressure(PRESSURE)
    assert not at_corner.valid
    found = wide.uncertainty(PRESSURE)
    assert not found.valid.any()
    assert set(at_corner.reasons) <= set(found.reasons)


def test_two_thousand_draws_of_five_ranges_take_a_second(joint):
    joint.uncertainty(PRESSURE)
    times = []
    for _ in range(3):
        begin = time.process_time()
        joint.uncertainty(PRESSURE)
        times.append(time.process_time() - begin)
    assert min(times) < 1.0


REFUSED = {
    "longest = '2.5..0.25 mm': the range is upside down": {"longest": "2.5..0.25 mm"},
    "longest = '500..500 um': the range has no width": {"longest": "500..500 um"},
    "part_a: longest without a unit": {"longest": "250..500"},
    "Ra = '1 um [+]- 0.2': a unit is missing": {"Ra": "1 um +- 0.2"},
    "part_a: Ra must be positive, got -1": {"Ra": "1 um +- 0.5 um"},
    "part_a: hurst must be in [(]0, 1], got 1.2; at the ends": {"hurst": "0.7..1.2"},
    "hurst = '0.8 [+]- 0': the standard deviation": {"hurst": "0.8 +- 0"},
    "Ra = '..1 um' is no range of numbers": {"Ra": "..1 um"},
    "Ra: measured values are a list of at least two": {"Ra": {"measured": ["1 um"]}},
    "Ra: write the unit to each": {"Ra": {"measured": ["1 um", "2"]}},
    "longest .um. must be more than 3 times shortest": {"longest": "20..500 um"},
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_range_that_is_none_is_refused_by_name(message):
    face = FACE | {"Ra": "1 um"} | REFUSED[message]
    with pytest.raises(InputError, match=message):
        Joint(face, bodies=METALS, nominal_area="4 cm^2")


def test_what_is_of_known_numbers_says_which_are_not(joint):
    for ask in (
        lambda: joint.at_pressure(PRESSURE),
        joint.law,
        lambda: joint.sensitivity(PRESSURE),
        lambda: joint.export("csv"),
    ):
        with pytest.raises(InputError, match=r"part_a.Ra, part_b.Ra.* are distributions"):
            ask()
    known = joint.central
    assert known.inputs == {}
    assert known.at_pressure(PRESSURE).area > 0
    with pytest.raises(InputError, match="has no number that is not known"):
        known.uncertainty(PRESSURE)
    with pytest.raises(InputError, match=r"Ra = .* is a range, and one number"):
        Surface.from_roughness(**RANGES["part_a"], h_max="2 um")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"draws": 10}, "draws must be a whole number"),
        ({"quantiles": [0.9, 0.1]}, "quantiles must rise"),
        ({"quantiles": [0.0, 0.5]}, "quantiles must be between 0 and 1"),
        ({"quantities": ["aera"]}, "did you mean 'area'"),
        ({"seed": -1}, "seed must be"),
    ],
)
def test_options_of_uncertainty_are_checked(joint, options, message):
    with pytest.raises((InputError, OutOfRangeError), match=message):
        joint.uncertainty(PRESSURE, **options)


def test_tables_and_plots_show_the_band(joint, found, tmp_path):
    table = joint.table([PRESSURE, "50 MPa"])
    assert table.area.dims == ("quantile", "pressure")
    np.testing.assert_array_equal(table.area[:, 0], found.quantiles["area"][:, 0])
    share = table.area_share.sel(input="bodies.hardness")
    of_one = found.shares["area"]["bodies.hardness"][0]
    assert float(share[0]) == pytest.approx(of_one, rel=1e-9)
    assert table.attrs["part_b.Ra"] == "0.5..0.7 um"
    figure = joint.plot(tmp_path / "band.svg", pressures=("5 MPa", "50 MPa"))
    assert "quantiles from 0.05 to 0.95" in figure.get_suptitle()
    assert all(axes.collections for axes in figure.axes)


@pytest.mark.parametrize(
    ("text", "low", "median", "high"),
    [
        ("0.25..2.5 mm", 0.25, 1.375, 2.5),
        ("250 um..2.5 mm", 0.25, 1.375, 2.5),
        ("1.6 um +- 0.2 um", 0.8, 1.6, 2.4),
        ("1.6 ± 0.2 um", 0.8, 1.6, 2.4),
        ("1.6 um +/- 12.5%", 0.8, 1.6, 2.4),
        ({"measured": ["2 um", "1 um", "4 um"]}, 1.0, 2.0, 4.0),
        ({"measured": [2, 1]}, 1.0, 1.5, 2.0),
    ],
)
def test_ranges_as_they_are_typed(text, low, median, high):
    found = distribution_of("longest", text)
    np.testing.assert_allclose([found.low, found.median, found.high], [low, median, high])
    np.testing.assert_allclose(found.quantile([0.0, 1.0]), [low, high])


@pytest.mark.parametrize("text", ["1.6 um", 1.6, [1.0, 2.0], {"name": "air"}, None])
def test_other_numbers_are_no_distributions(text):
    assert distribution_of("Ra", text) is None


EXAMPLE = str(pathlib.Path(__file__).parents[2] / "examples" / "joint.toml")


def test_the_command_prints_the_band_and_the_shares(found, tmp_path):
    path = tmp_path / "joint.toml"
    path.write_text(
        """
        nominal_area = "3..5 cm^2"
        bodies.metals = ["steel 4140 hard", "aluminium 6061 hard"]
        bodies.hardness = "0.9..1.1 GPa"
        bodies.conductivity = ["40..50 W/(m K)", "167 W/(m K)"]
        part_a = {Ra = "0.4 um +- 0.04 um", hurst = 0.8, longest = "500 um", shortest = "8 um"}
        part_b = {Ra = "0.5..0.7 um", hurst = 0.8, longest = "500 um", shortest = "8 um"}
        """
    )
    text = run("joint", path, "--pressure", PRESSURE)
    assert f"shares in area at 0.01 GPa: {found.shares_text('area', 0)}" in text
    printed = json.loads(run("joint", path, "--pressure", PRESSURE, "--json"))
    for name, rows in found.quantiles.items():
        columns = [printed["columns"][f"{name}{end}"] for end in ("_low", "", "_high")]
        np.testing.assert_array_equal(columns, rows)
    assert printed["shares"]["area"]["model"] == found.shares["area"]["model"].tolist()
    other = json.loads(run("joint", path, "-p", PRESSURE, "--json", "--seed", 5))
    assert other["columns"]["area"] != printed["columns"]["area"]


def test_settings_stand_for_entries_of_the_file_or_for_a_file():
    known = run("joint", EXAMPLE, "--pressure", PRESSURE)
    assert run("joint", EXAMPLE, "--set", "part_a.Rq=0.4 um", "-p", PRESSURE) == known
    entries = ["nominal_area=4 cm^2", "friction=0.2", "gas=air"]
    entries.append("bodies=['steel 4140 hard', 'aluminium 6061 hard']")
    for part, Rq in (("part_a", "0.4 um"), ("part_b", "0.7 um")):
        face = {"Rq": Rq, "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        entries += [f"{part}.{name}={value}" for name, value in face.items()]
    settings = [word for entry in entries for word in ("--set", entry)]
    alone = run("joint", *settings, "-p", PRESSURE)
    assert alone.partition("\n")[2] == known.partition("\n")[2]
    wider = run("joint", EXAMPLE, "--set", "part_a.Rq=0.3..0.5 um", "-p", PRESSURE)
    assert "part_a.Rq: 0.3..0.5 um" in wider
    export = ["--export", "csv", "--pressures", "20MPa:50MPa", "--out", "-"]
    rougher = run("joint", EXAMPLE, "--set", "part_a.Rq=0.8 um", *export)
    assert rougher != run("joint", EXAMPLE, *export)


def test_options_of_a_face_stand_for_a_file():
    numbers = {"Ra": "0.4 um +- 0.04 um", "hurst": "0.75..0.85"}
    band = {"longest": "500um", "shortest": "8um"}
    words = [w for name, text in (numbers | band).items() for w in (f"--{name}", text)]
    words += ["--nominal-area", "4cm^2", "--bodies", ", ".join(METALS)]
    printed = json.loads(run("joint", *words, "-p", PRESSURE, "--json"))
    joint = Joint(numbers | band, bodies=METALS, nominal_area="4 cm^2")
    found = joint.uncertainty(PRESSURE)
    assert printed["columns"]["area_low"] == found.quantiles["area"][0].tolist()
    assert printed["columns"]["valid"] == ["yes"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-p", PRESSURE], "a joint is needed: its FILE, or --Ra"),
        ([EXAMPLE, "--set", "part_a.Rq", "-p", "1MPa"], "settings are NAME=VALUE"),
        ([EXAMPLE, "--Ra", "1um", "-p", "1MPa"], "--Ra are of a joint without a file"),
        (["--Ra", "1um", "-p", "1MPa"], "argument: 'bodies'"),
        ([EXAMPLE, "--set", "gas.name=air", "-p", "1MPa"], "'gas' is no table"),
        ([EXAMPLE, "--set", "part_a.Rz=1 um", "-p", "1MPa"], "no argument 'Rz'"),
        ([EXAMPLE, "--seed", "1", "-p", "1MPa"], "--seed are of a joint with ranges"),
        ([EXAMPLE, "--set", "part_a.Rq=2..1 um", "-p", "1MPa"], "upside down"),
    ],
)
def test_settings_and_ranges_of_the_command_are_checked(words, message):
    assert message in refused("joint", *words)


def plain_joint(**changed):
    entries = {"part_a": FACE | {"Ra": "0.4 um"}, "bodies": METALS}
    return Joint(**entries | {"nominal_area": "4 cm^2"} | changed)


def test_pressures_may_be_ranges_and_are_drawn_with_everything_else():
    """As a direct Monte Carlo has it; a replica's own draw of the load is that of the quantiles."""
    joint = plain_joint()
    found = joint.uncertainty(["8..12 MPa", "50 MPa"], quantities=["area"])
    rng = np.random.default_rng(5)
    pressed = joint.at_pressure(rng.uniform(0.008, 0.012, 20_000))
    table = pressed.area * np.exp(rng.standard_normal(20_000) * pressed.area_scatter)
    for level, quantile in zip(found.levels, found.quantiles["area"][:, 0], strict=True):
        sampling = np.sqrt(level * (1 - level) * (1 / found.draws + 1 / table.size))
        assert abs(np.mean(table < quantile) - level) < 4 * sampling
    of_load = found.shares["area"]["pressure"]
    logarithms = np.log(pressed.area).var() / np.log(table).var()
    assert of_load[0] == pytest.approx(logarithms, abs=4 / np.sqrt(found.draws))
    assert of_load[1] == pytest.approx(0, abs=4 / np.sqrt(found.draws))
    both = plain_joint(nominal_area="3..5 cm^2")
    drawn = [
        each.at_pressure("8..12 MPa").area for each in both.replicas(200, seed=found.seed)
    ]
    quantiles = both.uncertainty("8..12 MPa", draws=200, quantities=["area"])
    np.testing.assert_allclose(
        quantiles.quantiles["area"][:, 0], np.quantile(drawn, quantiles.levels), rtol=1e-9
    )


def test_a_range_of_forces_is_one_of_pressures():
    joint = plain_joint()
    for force, pressure in (
        ("4..5 kN", "10..12.5 MPa"),
        ("4 kN +- 10%", "10 MPa +- 10%"),
        ({"measured": ["4 kN", "5 kN"]}, {"measured": ["10 MPa", "12.5 MPa"]}),
    ):
        by_force = joint.uncertainty(joint.pressure_of(force), draws=100)
        by_pressure = joint.uncertainty(pressure, draws=100)
        for name, rows in by_force.quantiles.items():
            np.testing.assert_allclose(rows, by_pressure.quantiles[name], rtol=1e-9)


def test_friction_may_be_a_range_that_replicas_draw():
    joint = plain_joint(friction="0.1..0.3")
    assert [*joint.inputs] == ["friction"]
    slips = []
    for replica in joint.replicas(20):
        sheared = replica.at_pressure(PRESSURE).contact.tangential()
        assert sheared.friction == replica.inputs["friction"]
        one = joint.central.at_pressure(PRESSURE).tangential(sheared.friction)
        assert sheared.gross_slip == pytest.approx(float(one.gross_slip), rel=1e-12)
        slips.append(float(sheared.gross_slip))
    assert max(slips) > 1.5 * min(slips)
    with pytest.raises(InputError, match=r"friction = '0.3..0.1': .* upside down"):
        plain_joint(friction="0.3..0.1")
    with pytest.raises(OutOfRangeError, match="friction must be"):
        plain_joint(friction="-0.1..0.3")


def test_five_numbers_may_be_ranges():
    numbers = {"hurst": 0.8, "q0": 0.0126, "q1": 0.8, "h_max": 3.0, "unit": "um"}
    ranged = numbers | {"h_rms": "0.6..0.8 um", "q1": "0.6..0.8 1/um"}
    ranged |= {"q0": "0.0126 1/um", "h_max": "3 um"}
    found = uncertainty(ranged, "60 GPa", pressure=PRESSURE, quantities=["area"])
    rng = np.random.default_rng(3)
    drawn = numbers | {
        "h_rms": rng.uniform(0.6, 0.8, 20_000),
        "q1": rng.uniform(0.6, 0.8, 20_000),
    }
    pressed = contact(Surface(**drawn), "60 GPa", pressure=PRESSURE, theory="calibrated")
    table = pressed.area * np.exp(rng.standard_normal(20_000) * pressed.area_scatter)
    for level, quantile in zip(found.levels, found.quantiles["area"][:, 0], strict=True):
        sampling = np.sqrt(level * (1 - level) * (1 / found.draws + 1 / table.size))
        assert abs(np.mean(table < quantile) - level) < 4 * sampling
    # a joint takes the same numbers
    alone = Joint(ranged, bodies="60 GPa", gas="vacuum")
    of_joint = alone.uncertainty(PRESSURE, quantities=["area"])
    np.testing.assert_allclose(
        of_joint.quantiles["area"], found.quantiles["area"], rtol=1e-9
    )


def test_one_modulus_of_two_may_be_a_range():
    bodies = Bodies(E=("200..220 GPa", "70 GPa"), nu=(0.3, 0.33))
    face = FACE | {"Ra": "0.4 um", "nominal_area": "4 cm^2"}
    found = uncertainty(face, bodies, pressure=PRESSURE, draws=100, quantities=["area"])
    assert [*found.inputs] == ["bodies.E.0"]
    stiff, soft = (
        contact(
            Surface.from_roughness(**face),
            Bodies(E=(E, "70 GPa"), nu=(0.3, 0.33)),
            pressure=PRESSURE,
        )
        for E in ("220 GPa", "200 GPa")
    )
    assert stiff.area < found.quantiles["area"][1, 0] < soft.area


SURFACE = [
    *[
        "--hurst",
        "0.8",
        "--longest",
        "500um",
        "--shortest",
        "8um",
        "--nominal-area",
        "4cm^2",
    ]
]


def test_the_contact_command_takes_ranges_wherever_a_number_is_typed(tmp_path):
    given = FACE | {"Ra": "0.4 um +- 0.04 um", "nominal_area": "4 cm^2"}
    bodies = Bodies("58..62 GPa", hardness="0.9..1.1 GPa")
    found = uncertainty(given, bodies, pressure=["10 MPa", "20..25 MPa"])
    arguments = [
        "contact",
        "--Ra",
        "0.4 um +- 0.04 um",
        *SURFACE,
        "--E-star",
        "58..62GPa",
    ]
    load = ["--hardness", "0.9..1.1 GPa", "-p", "10MPa,20..25MPa"]
    printed = json.loads(run(*arguments, *load, "--json"))
    for name, rows in found.quantiles.items():
        columns = [printed["columns"][f"{name}{end}"] for end in ("_low", "", "_high")]
        np.testing.assert_allclose(columns, rows, rtol=1e-12)
    assert printed["shares"]["area"]["pressure"][1] > 0.1
    text = run(*arguments, *load)
    assert f"shares in area at 0.01 GPa: {found.shares_text('area', 0)}" in text
    # of a file
    path = tmp_path / "surface.toml"
    path.write_text(
        """
        [surface]
        Ra = "0.4 um +- 0.04 um"
        hurst = 0.8
        longest = "500 um"
        shortest = "8 um"
        nominal_area = "4 cm^2"
        [material]
        E_star = "58..62 GPa"
        """
    )
    of_file = json.loads(run("contact", "--file", path, *load, "--json"))
    assert of_file["columns"] == printed["columns"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--hardness", "2..1GPa"], "hardness = '2..1GPa': the range is upside down"),
        (["--conductivity", "5..4 W/(m K)"], "conductivity = '5..4 W/(m K)': the range"),
        (["--E-star", "60..50GPa"], "E_star = '60..50GPa': the range is upside down"),
        (["--Ra", "0.5um..0.4um"], "Ra = '0.5um..0.4um': the range is upside down"),
        (["-p", "9..8MPa"], "pressure = '9..8MPa': the range is upside down"),
        (["--Ra", "0.4..0.5um", "--leakage"], "--quantity flow_coefficient"),
        (["--draws", "200"], "--draws and --seed are of numbers that are ranges"),
    ],
)
def test_the_contact_command_refuses_ranges_that_are_none(more, said):
    options = {"--Ra": "0.4um", "--E-star": "60GPa", "-p": "10MPa"}
    if more[0] in options:
        options[more[0]] = more[1]
        more = more[2:]
    base = [word for pair in options.items() for word in pair]
    assert said in refused("contact", *SURFACE, *base, *more)


def test_commands_of_known_numbers_name_those_that_take_ranges():
    base = ["--Ra", "0.4..0.5um", *SURFACE, "--E-star", "60GPa"]
    for command in (["curve"], ["sensitivity", "-p", "10MPa"]):
        said = refused(*command, *base)
        assert "Ra = '0.4..0.5um' is a range" in said
        assert "mbma contact, joint and batch take ranges" in said


def test_the_flow_of_faces_of_a_process_is_as_uncertain_as_that_of_maps_of_it():
    """It had the band of Gaussian faces, seven times narrower than that of the cube of the gap."""
    face = {"Ra": "0.1 um", "process": "lapped"}
    joint = Joint(face, face, bodies="steel 304 soft", nominal_area="3 cm^2")
    names = ["flow_coefficient", "hydraulic_aperture"]
    drawn = joint.uncertainty("30 MPa", quantities=names)
    flow, aperture = (np.ptp(np.log(drawn.quantiles[name])) for name in names)
    of_maps = stats.norm.ppf(0.95) - stats.norm.ppf(0.05)
    of_maps *= float(processes()["lapped"]["flow_spread"])
    assert flow == pytest.approx(of_maps, rel=0.05)
    assert aperture == pytest.approx(flow / 3, rel=1e-6)
    replica = joint.replicas(2)[0].at_pressure("30 MPa")
    assert replica.hydraulic_aperture == pytest.approx(
        np.cbrt(replica.flow_coefficient), rel=1e-12
    )
