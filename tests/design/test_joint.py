"""`Joint`: one description of two parts, the same numbers as the single calls, and no more work than they."""

import ctypes
import dataclasses
import json
import math
import pathlib
import runpy
import shutil
import subprocess

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from helpers import random_map, run
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import mutually_broadcastable_shapes

from mbma_tables import (
    Bodies,
    Gas,
    InputError,
    Joint,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
    materials,
)
from mbma_tables.cli import main
from mbma_tables.contacts.quantities.gas import GASES
from mbma_tables.export.code.law_code import law_text
from mbma_tables.export.registry import targets
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.surfaces.self_affine import SelfAffine
from mbma_tables.theories.calibrated.theory import Calibrated

FACE = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
EXAMPLE = pathlib.Path(__file__).parents[2] / "examples" / "joint.toml"


@pytest.fixture(scope="module")
def joint():
    return Joint(
        FACE, FACE | {"Rq": "0.7 um"}, bodies=METALS, nominal_area="4 cm^2", friction=0.2
    )


def test_a_joint_is_the_contact_of_the_combined_surface(joint):
    a, b = (
        Surface.from_roughness(**FACE | {"Rq": Rq}, nominal_area="4 cm^2")
        for Rq in ("0.4 um", "0.7 um")
    )
    known = contact(
        a.combined(b, "4 cm^2"), METALS, pressure=["1 MPa", "50 MPa"], theory="calibrated"
    )
    table = joint.table(["1 MPa", "50 MPa"])
    np.testing.assert_array_equal(table["area"], known.area)
    np.testing.assert_array_equal(table["solid_conductance"], known.solid_conductance)
    np.testing.assert_array_equal(
        table["total_conductance"], known.solid_conductance + known.gap_conductance("air")
    )
    np.testing.assert_array_equal(
        table["tangential_stiffness"], known.tangential().stiffness
    )
    assert table["pressure"].attrs["units"] == "GPa"
    assert table["solid_conductance"].attrs["units"] == "W/(m^2 K)"
    assert joint.surface.h_rms == pytest.approx(np.hypot(0.4, 0.7), rel=1e-6)


@pytest.mark.parametrize(
    "asked",
    [
        {"separation": "1 um"},
        {"mean_separation": ["1.5 um", "2 um"]},
        {"pressure": "10 MPa"},
        {"area": [0.001, 0.01]},
    ],
    ids=lambda asked: next(iter(asked)),
)
def test_it_is_asked_as_contact_is(joint, asked):
    found = joint.at(**asked)
    known = contact(joint.surface, METALS, **asked)
    assert found.theory == known.theory
    for name in ("pressure", "area", "mean_separation", "separation", "stiffness"):
        np.testing.assert_array_equal(getattr(found, name), getattr(known, name))
    assert np.all(found.total_conductance > found.solid_conductance)
    with pytest.raises(InputError, match="give exactly one of"):
        joint.at(**asked, **({"area": 0.1} if "pressure" in asked else {"pressure": 1}))


def test_its_law_and_sensitivity(joint):
    law = joint.law()
    found = joint.at_pressure("10 MPa")
    assert float(law.at_pressure(0.01).mean_separation) == pytest.approx(
        float(found.mean_separation), rel=1e-5
    )
    slopes = joint.sensitivity("10 MPa").slopes
    assert slopes["hardness"]["area"] == pytest.approx(-0.75, abs=0.02)
    # a longer wavelength of the drawing at the same Rq lowers the gap; one that is cut off
    # takes height away
    faces = [{**FACE, "Rq": Rq, "longest": "501 um"} for Rq in ("0.4 um", "0.7 um")]
    longer = Joint(
        *faces, bodies=METALS, nominal_area="4 cm^2", theory=joint.theory
    ).at_pressure("10 MPa")
    by_both = sum(
        slopes[f"{part}.longest"]["mean_separation"] for part in ("part_a", "part_b")
    )
    by_hand = np.log(longer.mean_separation / found.mean_separation) / np.log(501 / 500)
    assert by_both == pytest.approx(by_hand, abs=0.01)


STEEL = materials.Metal("some steel", 205.0, 0.29, (5.76, 5.76), (42.7, 42.7))
LIGHT = materials.Metal("some light metal", 69.0, 0.33, (0.95, 0.95), (160.0, 160.0))
# rows of the sensitivities of a joint of two faces, and a number in other units
ROWS = {
    **{f"part_{end}.{name}": 1.0 for end in "ab" for name in (
        "hurst", "Rq", "longest", "shortest", "E", "nu", "conductivity",
    )},
    "nominal_area": 1.0, "pressure": 1.0, "hardness": 1.0,
}  # fmt: skip


def pressed_again(factors, theory, unit, size, answers):
    """Logarithms of answers at 50 MPa of the joint described anew, each number times its factor."""
    factor = {**ROWS, **factors}
    faces = []
    for end, Rq in (("a", 0.4), ("b", 0.7)):
        lengths = {"Rq": Rq, "longest": 500.0, "shortest": 8.0}
        face = {
            name: f"{size * factor[f'part_{end}.{name}'] * number!r} {unit}"
            for name, number in lengths.items()
        }
        faces.append(face | {"hurst": 0.8 * factor[f"part_{end}.hurst"]})
    metals = [
        dataclasses.replace(
            metal,
            E=metal.E * factor[f"part_{end}.E"],
            nu=metal.nu * factor[f"part_{end}.nu"],
        )
        for end, metal in (("a", STEEL), ("b", LIGHT))
    ]
    described = Joint(
        *faces,
        bodies=Bodies(
            metals=metals,
            hardness=0.95 * factor["hardness"],
            conductivity=tuple(
                f"{number * factor[f'part_{end}.conductivity']!r} W/(m K)"
                for end, number in (("a", 42.7), ("b", 160.0))
            ),
        ),
        nominal_area=f"{4 * factor['nominal_area']!r} cm^2",
        theory=theory,
    )
    if not answers:
        return described
    pressed = described.at_pressure(0.05 * factor["pressure"])
    return np.log([float(getattr(pressed, name)) for name in answers])


@pytest.mark.parametrize(
    ("theory", "unit", "size"),
    [
        ("calibrated", "um", 1.0),
        ("calibrated", "mm", 1e-3),
        ("persson", "um", 1.0),
        ("mbma", "um", 1.0),
    ],
)
@pytest.mark.slow
def test_sensitivities_are_differences_of_joints_described_anew(theory, unit, size):
    """Each row holds for the number that was typed, all others and the pressure unchanged."""
    answers = ("mean_separation", "area", "stiffness", "solid_conductance")
    joint = pressed_again({}, theory, unit, size, ())
    slopes = joint.sensitivity("50 MPa").slopes
    assert set(slopes) == set(ROWS)
    step = 0.005
    for row in ROWS:
        up, down = (
            pressed_again({row: math.exp(sign * step)}, theory, unit, size, answers)
            for sign in (1, -1)
        )
        known = [slopes[row][name] for name in answers]
        np.testing.assert_allclose(
            known, (up - down) / (2 * step), atol=1e-3, err_msg=row
        )


def test_a_smooth_other_face_and_other_metals():
    copper = Joint(FACE, bodies="copper C11000 hard", gas="vacuum", nominal_area="1 cm^2")
    table = copper.table("10 MPa")
    assert float(table["gas_conductance"][0]) == 0
    assert copper.surface.h_rms == 0.4
    own = Surface.from_roughness(**FACE, nominal_area="1 cm^2")
    assert Joint(own, bodies="copper C11000 hard").surface is own
    larger = Joint(own, bodies="copper C11000 hard", nominal_area="100 cm^2")
    assert larger.surface.h_max > own.h_max


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(InputError, match="nominal_area"):
        Joint(FACE, bodies=METALS)
    with pytest.raises(TypeError, match="direction"):
        Joint(FACE, bodies=METALS, directon="along")
    path = tmp_path / "joint.toml"
    path.write_text("bodies = 'steel 4140 hard'\nnominal_are = 1\n")
    with pytest.raises(InputError, match="nominal_area"):
        Joint.from_toml(path)


def test_untempered_metals_are_not_valid():
    found = Joint(
        FACE, bodies=("steel 4140", "aluminium 6061"), nominal_area="4 cm^2"
    ).at_pressure("50 MPa")
    assert not found.valid
    assert any("hardness=" in reason for reason in found.reasons)


def test_parts_may_be_maps(tmp_path):
    np.save(
        tmp_path / "face.npy", random_map(64, 0.03, 0.2) / random_map(64, 0.03, 0.2).std()
    )
    part = '{map = "face.npy", dx = 1.0, periodic = true, unit = "um"}'
    (tmp_path / "joint.toml").write_text(
        f'bodies = {{metals = "steel 1020", hardness = "1.5 GPa"}}\npart_a = {part}\n'
    )
    mapped = Joint.from_toml(tmp_path / "joint.toml")
    assert mapped.surface.bearing is not None
    assert mapped.at_pressure("5 MPa").area > 0


def test_command(tmp_path, capsys):
    picture = tmp_path / "joint.svg"
    with pytest.raises(SystemExit) as end:
        main(
            [
                "joint",
                str(EXAMPLE),
                "--pressure",
                "10MPa",
                "--csv",
                "--plot",
                str(picture),
            ]
        )
    assert end.value.code == 0
    assert picture.stat().st_size > 10_000
    head, row = capsys.readouterr().out.splitlines()[-2:]
    found = dict(zip(head.split(","), row.split(","), strict=True))
    assert float(found["area"]) == float(
        Joint.from_toml(EXAMPLE).at_pressure("10 MPa").area
    )
    assert found["valid"] == "yes"


def test_cards_hold_the_joint(joint):
    card = joint.export("calculix", ("1 MPa", "50 MPa"), name="JOINT")
    text = card[card.index("*GAP CONDUCTANCE") :].splitlines()[1:]
    k, p = np.array([[float(number) for number in line.split(",")] for line in text]).T
    assert p[-1] == pytest.approx(50, rel=0.02)
    # mW/(mm^2 K) is 1000 W/(m^2 K)
    found = joint.at_pressure((p[1:] / 1000).tolist())
    # of the solid spots and of the air in the gaps
    both = found.solid_conductance + found.gap_conductance("air")
    np.testing.assert_allclose(1000 * k[1:], both, rtol=2e-3)  # of the rows
    assert "hardness = 950.0 MPa" in card
    closure = joint.export("abaqus", ("1 MPa", "50 MPa"), heat=False)
    assert "GAP CONDUCTANCE" not in closure
    with pytest.raises(InputError, match="calculix"):
        joint.export("calculux", (1, 50))


def test_friction_cards_have_the_stiffness_before_slip(joint):
    found = joint.at_pressure(["1 MPa", "7 MPa"])
    stick = 1e6 * found.tangential().stiffness  # MPa/mm of GPa/um
    card = joint.export("calculix", ("1 MPa", "49 MPa"))  # the geometric mean is 7 MPa
    mu, slope = map(float, card.split("*FRICTION\n")[1].splitlines()[0].split(","))
    assert (mu, slope) == (0.2, pytest.approx(stick[1], rel=1e-6))
    assert f"{stick[0]:.4g}.0 at 1.0," in " ".join(card.replace("\n**", "").split())
    own = joint.export(
        "abaqus", ("1 MPa", "49 MPa"), heat=False, friction_pressure="1 MPa"
    )
    slip, mu = own.split("*FRICTION, ELASTIC SLIP=")[1].splitlines()[:2]
    assert float(mu) * 1.0 / float(slip) == pytest.approx(stick[0], rel=1e-6)
    # rows of the tangential stiffness, for programs of data
    rows = describe_law(
        joint.surface, joint.pair.E_star, length_unit="mm", stress_unit="MPa", quantity="tangential_stiffness",
        pressures=("1 MPa", "49 MPa"), kappa=float(found.tangential().ratio), theory="calibrated", hardness="0.95 GPa",
    )  # fmt: skip
    assert np.interp(7.0, rows.x, rows.y) == pytest.approx(stick[1], rel=1e-2)
    with pytest.raises(InputError, match="takes no friction"):
        targets()["lsdyna"].files(
            describe_law(
                joint.surface,
                "57 GPa",
                stress_unit="MPa",
                friction=0.2,
                kappa=1.2,
                friction_pressure=1.0,
            )
        )
    with pytest.raises(InputError, match="friction needs kappa"):
        describe_law(joint.surface, "57 GPa", stress_unit="MPa", friction=0.2)


@pytest.mark.skipif(shutil.which("cc") is None, reason="not installed: cc")
def test_functions_of_yielded_joints(joint, tmp_path):
    (tmp_path / "bolt.c").write_text(joint.export("c-law", name="bolt"))
    subprocess.run(
        ["cc", "-O1", "-shared", "-fPIC", "-w", "bolt.c", "-lm", "-o", "bolt.so"],
        cwd=tmp_path,
        check=True,
    )
    bolt = ctypes.CDLL(str(tmp_path / "bolt.so"))
    found = joint.at_pressure("10 MPa")
    c = 1e-3 * float(joint.surface.h_max - found.mean_separation)  # mm of um
    for what, value in {
        "pressure": 10.0,
        "tangent": 1e6 * found.stiffness,
        "tangential_stiffness": 1e6 * found.tangential().stiffness,
        "solid_conductance": 1e-3 * found.solid_conductance,
        "gas_conductance": 1e-3 * found.gas_conductance,
        "total_conductance": 1e-3 * found.total_conductance,
    }.items():
        function = bolt[f"bolt_{what}"]
        function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
        assert function(c) == pytest.approx(float(value), rel=1e-4), what
    package = joint.export("modelica-law", name="bolt")
    assert "function tangential_stiffness" in package
    assert "elastic_tangent(c)" in package
    assert joint.export("fmu", name="bolt")[:2] == b"PK"


@pytest.mark.skipif(shutil.which("ccx") is None, reason="not installed: ccx")
def test_two_heated_and_sheared_blocks_in_calculix():
    example = runpy.run_path(str(EXAMPLE.with_name("two_blocks.py")))
    rows = example["compared"]()
    for name, simulated, law in rows:
        assert simulated == pytest.approx(law, rel=0.01), name
    by_law, dots, perfect = example["draw"](rows).axes[0].lines
    np.testing.assert_allclose(dots.get_ydata(), by_law.get_ydata(), atol=0.5)
    # the same heat flows through both blocks, whose faces are as warm as each other
    slopes = np.diff(perfect.get_ydata()) / np.diff(perfect.get_xdata())
    assert slopes[0] * 42.7 == pytest.approx(slopes[1] * 167.0)


def test_parts_with_a_lay_have_a_direction():
    rng = np.random.default_rng(2)
    q = np.hypot(4 * np.fft.fftfreq(64)[:, None], np.fft.fftfreq(64)[None])
    heights = np.fft.ifft2(
        np.where((q > 0.03) & (q < 0.3), np.fft.fft2(rng.normal(size=(64, 64))), 0)
    ).real
    ground = Surface.from_map(heights / heights.std(), 1.0, periodic=True, unit="um")
    bodies = Bodies(metals="steel 1020", hardness="1.5 GPa")
    with pytest.raises(InputError, match="give direction"):
        Joint(ground, bodies=bodies, friction=0.2).table("60 MPa")
    along, across = (
        Joint(ground, bodies=bodies, friction=0.2, direction=way)
        for way in ("along", "across")
    )
    stiff = [
        float(one.table("60 MPa")["tangential_stiffness"][0]) for one in (along, across)
    ]
    assert stiff[0] < stiff[1]
    cards = [
        one.export(
            "calculix", ("10 MPa", "100 MPa"), heat=False, friction_pressure="60 MPa"
        )
        for one in (along, across)
    ]
    slopes = [
        float(card.split("*FRICTION\n")[1].splitlines()[0].split(",")[1])
        for card in cards
    ]
    np.testing.assert_allclose(slopes, 1e6 * np.array(stiff), rtol=1e-3)
    # rows follow the ratio of each contact area; functions, which have one ratio, leave it out
    rows = json.loads(
        along.export("json", ("30 MPa", "100 MPa"), quantity="tangential_stiffness")
    )["columns"]
    assert np.interp(60, rows["pressure"], rows["tangential_stiffness"]) == pytest.approx(
        1e6 * stiff[0], rel=1.5e-3
    )
    assert "without tangential stiffness" in along.export("c-law")


def test_effects_that_are_not_called_for_cost_nothing(joint, monkeypatch):
    answer = Calibrated.answer
    calls = []
    monkeypatch.setattr(
        Calibrated, "answer", lambda *given: calls.append(1) or answer(*given)
    )
    contact(joint.surface, METALS, pressure="10 MPa", theory="calibrated")
    plain = len(calls)
    found = joint.at_pressure("10 MPa")
    assert len(calls) == 2 * plain
    # all effects together cost at most three elastic answers
    joint.quantities(found)
    assert len(calls) - 2 * plain <= 3
    # a law as code makes the elastic one for an unloading stiffness alone
    made = []
    law = contact_law(joint.surface, Bodies(1.0, hardness=0.05), theory="calibrated")
    monkeypatch.setattr("mbma_tables.export.exported_law.law_of", lambda *given: law)
    law = dataclasses.replace(
        law,
        elastic=lambda: made.append(1) or contact_law(joint.surface, theory="calibrated"),
    )
    given = {
        "length_unit": "um",
        "stress_unit": "GPa",
        "theory": "calibrated",
        "hardness": 0.05,
    }
    law_text("c-law", joint.surface, 1.0, **given)
    assert not made
    law_text("c-law", joint.surface, 1.0, kappa=1.2, **given)
    assert made


@pytest.mark.parametrize(
    ("changed", "match"),
    [
        ({"gas": "nitrogn"}, "did you mean 'nitrogen'"),
        ({"gas": 5}, "no gas is named 5"),
        ({"gas": {"temperature": 3000}}, "temperature must be from 200 to 600 K"),
        ({"gas": {"pressure": "-1 atm"}}, "gas_pressure must be positive"),
        ({"theory": "calibratd"}, "did you mean 'calibrated'"),
        ({"theory": "simulated"}, "is of one map"),
        ({"theory": 5}, "theory must be one of"),
        ({"friction": -0.2}, "friction must be positive"),
        ({"bodies": Bodies(metals=METALS, hardness="60 HRB")}, "from 71.2 to 99.5"),
        ({"bodies": Bodies(metals=METALS, hardness=-1.0)}, "hardness must be positive"),
        ({"direction": "alon"}, "direction must be one of"),
        ({"direction": "along"}, "direction needs a surface"),
        ({"bodies": "steel 4141"}, "steel 4140"),
        ({"nominal_area": "-4 cm^2"}, "nominal_area must be positive"),
        ({"part_b": "face.sur"}, "part_b is a surface, or its numbers by name"),
        (
            {"part_b": {"Ra": "1.6 um"}},
            r"part_b: roughness has Ra, .*missing: hurst.*two of longest, shortest"
            r".*lambda_c is longest.*docs/surfaces.md, 'From Ra and a filter",
        ),
        (
            {"nominal_area": None},
            r"part_a: roughness has .*one of h_max, Sp, nominal_area \(the last of a joint",
        ),
        (
            {"part_b": {"Rz": "6 um"}},
            r"part_b: Surface.from_roughness has no argument 'Rz': .*is no rms height",
        ),
        ({"part_b": FACE | {"Rqq": "1.6 um"}}, "part_b: .*no argument 'Rqq'"),
        ({"part_b": FACE | {"hurst": 2.0}}, "part_b: hurst must be"),
        ({"part_b": FACE | {"nominal_area": 4}}, r"of the joint, Joint\(part_a,"),
    ],
    ids=str,
)
def test_a_joint_is_checked_when_it_is_described(changed, match):
    described = {
        "part_a": FACE,
        "bodies": METALS,
        "nominal_area": "4 cm^2",
        "theory": "calibrated",
    }
    with pytest.raises(InputError, match=match):
        Joint(**described | changed)


def test_all_numbers_that_a_face_lacks_are_named_at_once():
    with pytest.raises(
        InputError, match=r"hurst.*two of longest.*one of h_max, Sp, nominal_area"
    ):
        Joint({"Ra": "1.6 um"}, bodies=METALS)


def test_a_nominal_area_is_of_a_map_too():
    """Whether the map is named in a mapping or made before."""
    heights = random_map(64, 0.03, 0.2)
    named = {"map": heights / heights.std(), "dx": 1.0, "periodic": True, "unit": "um"}
    made = Surface.from_map(named["map"], 1.0, periodic=True, unit="um")
    given = {"bodies": "steel 1020", "nominal_area": "4 cm^2", "theory": "calibrated"}
    one = Joint(named, **given)
    other = Joint(made, **given)
    assert one.surface.h_max == other.surface.h_max > made.h_max


def test_a_joint_names_what_its_faces_assume(joint):
    """All that a face given by numbers assumes is in the text, the table and the command, each line once."""
    faces = [
        Surface.from_roughness(**FACE | {"Rq": Rq}, nominal_area="4 cm^2")
        for Rq in ("0.4 um", "0.7 um")
    ]
    expected = {
        line
        for face in faces
        for record in face.provenance
        for line in record.get("assumed", ())
    }
    assert any("heights are Gaussian" in line for line in expected)
    assumed = joint.facts()["assumed"]
    for line in expected:
        assert assumed.count(line) == 1
        assert line in repr(joint)
    assert joint.table("10 MPa").attrs["assumed"] == assumed
    output = run("joint", EXAMPLE, "-p", "10MPa")
    shown = [line for line in output.splitlines() if line.startswith("assumed: ")]
    assert len(shown) == len(set(shown)) > 3


def test_results_without_units_are_displayed():
    plain = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5)
    joint = Joint(plain, bodies="steel 1020", theory="calibrated")
    assert "steel 1020" in repr(joint)
    pressed = joint.at_pressure([0.01, 0.02])
    assert "solid_conductance needs the surface's unit" in repr(pressed)
    assert "solid_conductance" not in pressed.to_dataset()
    assert "theory" in pressed._repr_html_()
    assert "solid_conductance needs the surface's unit" in repr(joint.at_pressure(0.01))
    for name in ("solid_conductance", "gas_conductance", "total_conductance"):
        assert name not in joint.table(0.01)
        with pytest.raises(InputError, match="give the surface its unit"):
            getattr(pressed, name)
    assert joint.plot().axes
    with pytest.raises(InputError, match="nominal_area"):
        joint.pressure_of("40 kN")


def test_forces_are_pressures_on_the_nominal_area(joint, capsys):
    table = joint.table([joint.pressure_of("4 kN"), joint.pressure_of(40e3)])
    np.testing.assert_allclose(
        table["pressure"], [0.01, 0.1], rtol=1e-12
    )  # GPa on 4 cm^2
    assert joint.pressure_of("10 lbf") == joint.pressure_of(44.482216152605)
    for force, match in (
        ("-4 kN", "force must be positive"),
        ("4 kg", "unit of force"),
        ("many", "force must be"),
    ):
        with pytest.raises(InputError, match=match):
            joint.pressure_of(force)
    with pytest.raises(SystemExit) as end:
        main(["joint", str(EXAMPLE), "--force", "4kN", "--csv"])
    assert end.value.code == 0
    by_force = capsys.readouterr().out.splitlines()[-1]
    with pytest.raises(SystemExit):
        main(["joint", str(EXAMPLE), "--pressure", "10MPa", "--csv"])
    assert [float(x) for x in by_force.split(",")[:3]] == pytest.approx(
        [float(x) for x in capsys.readouterr().out.splitlines()[-1].split(",")[:3]],
        rel=1e-12,
    )


def test_a_picture_has_the_pressures_that_were_asked_for(joint, tmp_path):
    figure = joint.plot(tmp_path / "joint.svg", pressures=("1 MPa", "50 MPa"))
    x = figure.axes[0].lines[0].get_xdata()
    assert (x[0], x[-1]) == (pytest.approx(1e-3), pytest.approx(0.05))
    assert (tmp_path / "joint.svg").stat().st_size > 10_000
    # axes of one or two decades have numbers between powers of ten
    figure.draw_without_rendering()
    for axes in figure.axes:
        shown = {tick.get_text() for tick in axes.get_xticklabels()}
        assert {"0.001", "0.002", "0.005", "0.01", "0.02", "0.05"} <= shown
    for wrong in (("50 MPa", "1 MPa"), "1 MPa", (0.0, 1.0)):
        with pytest.raises(InputError, match="pressures"):
            joint.plot(pressures=wrong)


def test_metals_of_ones_own_in_a_file(tmp_path):
    text = EXAMPLE.read_text().replace(
        '"steel 4140 hard", "aluminium', '"6061-T6", "aluminium'
    )
    own = 'name = "own", E = "69 GPa", nu = 0.33, hardness = "0.95 GPa", conductivity = "160 W/(m K)"'
    (tmp_path / "joint.toml").write_text(
        text.replace('"aluminium 6061 hard"', f"{{{own}}}")
    )
    read = Joint.from_toml(tmp_path / "joint.toml")
    assert [metal.name for metal in read.pair.metals] == ["aluminium 6061 hard", "own"]
    assert read.pair.softer.E == 69.0


@pytest.mark.parametrize(
    ("gas", "molar_mass"), [("nitrogen", 28.0134), ("argon", 39.948)]
)
def test_gases_against_kinetic_theory(gas, molar_mass):
    """Conductivity over viscosity and heat capacity (Eucken's factor), accommodation by Song and Yovanovich (1987)."""
    data = GASES[gas]
    assert 1000 * data.mass == pytest.approx(molar_mass, rel=1e-3)
    monatomic = gas == "argon"
    capacity = 8.314462618 / data.mass / (data.gamma - 1)
    eucken = (9 * data.gamma - 5) / 4
    ratio = np.array(data.conductivity) / (np.array(data.viscosity) * capacity)
    np.testing.assert_allclose(ratio, eucken, rtol=0.06)
    # of engineering surfaces at 300 K, with the molar mass of iron; stated to 25%
    effective = molar_mass * (1.0 if monatomic else 1.4)
    relative = molar_mass / 55.85
    clean = 2.4 * relative / (1 + relative) ** 2
    cold = np.exp(-0.57 * (300 - 273) / 273)
    expected = cold * effective / (6.8 + effective) + clean * (1 - cold)
    assert data.accommodation == pytest.approx(expected, rel=0.25)


def test_a_subroutine_has_the_friction_of_the_joint_or_says_that_it_has_none():
    face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    given = {
        "bodies": "copper C11000 hard",
        "nominal_area": "4 cm^2",
        "theory": "calibrated",
    }
    without = "WITHOUT FRICTION: the faces slide freely."
    for friction in (0.2, None):
        text = Joint(face, friction=friction, **given).export("abaqus-uinter", heat=False)
        words = " ".join(text.replace("\n *", " ").split())
        assert ("_FRICTION = 0.2;" in words) == (friction is not None)
        assert (without in words) == (friction is None)
    # without Poisson's ratios there is no stiffness before slip
    given["bodies"] = "120 GPa"
    text = Joint(face, friction=0.2, **given).export("abaqus-uinter", heat=False)
    words = " ".join(text.replace("\n *", " ").split())
    assert "the joint's friction, 0.2, is left out: the faces slide freely" in words
    assert without in words


def closures(joint):
    """Overclosures [mm] and pressures [MPa] of a joint's card for Abaqus."""
    card = joint.export("abaqus", ("0.1 MPa", "10 MPa"), heat=False)
    rows = card.split("TABULAR\n")[1].splitlines()
    numbers = [row.split(",")[:2] for row in rows if row and row[0] not in "*"]
    pressure, closure = np.array(numbers, dtype=float).T
    return closure, pressure


@pytest.mark.parametrize("hardness", [None, 2.0])
@pytest.mark.parametrize(
    "modulus", [58, "58", "58 GPa", Bodies(58.0), {"E_star": 58}, Bodies("58 GPa")]
)
def test_a_plain_modulus_is_in_gigapascals_for_every_route(modulus, hardness, tmp_path):
    described = {"nominal_area": "4 cm^2", "theory": "calibrated", "gas": "vacuum"}
    bodies = dataclasses.replace(Bodies.of(modulus), hardness=hardness, nu=0.3)
    joint = Joint(FACE, bodies=bodies, **described)
    surface = Surface.from_roughness(**FACE, nominal_area="4 cm^2")
    own = None if hardness is None else f"{hardness} GPa"
    known = contact(
        surface,
        Bodies("58000 MPa", hardness=own, nu=0.3),
        pressure="10 MPa",
        theory="calibrated",
    )
    found = joint.at_pressure("10 MPa")
    assert found.area == pytest.approx(known.area, rel=1e-12)
    assert found.pressure == pytest.approx(0.01, rel=1e-12)
    assert joint.facts()["E_star"] == "58 GPa"
    assert joint.at_pressure(0.01).area == found.area
    law = joint.law()
    assert law.at_pressure("10 MPa").area == pytest.approx(known.area, rel=1e-6)
    assert float(joint.table(["10 MPa"])["area"][0]) == found.area
    assert joint.table([0.01])["pressure"].attrs["units"] == "GPa"
    slopes = joint.sensitivity("10 MPa")
    assert slopes.parameters["E_star"] == 58.0
    assert slopes.answers["area"] == pytest.approx(known.area, rel=1e-9)
    closure, pressure = closures(joint)
    gaps = law.h_max - 1e3 * closure[1:]
    # rows begin at the smallest pressure, which they leave out
    rise = 1e3 * (law.pressure(gaps) - law.pressure(gaps[0]))
    # the rows' own tolerance at either end
    np.testing.assert_allclose(rise, pressure[1:] - pressure[1], rtol=2e-3)
    picture = tmp_path / "joint.svg"
    joint.plot(picture, pressures=(0.001, 0.01))
    assert "[GPa]" in picture.read_text(encoding="utf-8")


def test_a_modulus_of_a_file_is_in_gigapascals(tmp_path):
    path = tmp_path / "joint.toml"
    numbers = "".join(f"{name} = {value!r}\n" for name, value in FACE.items())
    text = f'nominal_area = "4 cm^2"\ntheory = "calibrated"\n\n[part_a]\n{numbers}'
    path.write_text(f"bodies = 57.53\n{text}", encoding="utf-8")
    plain = Joint.from_toml(path)
    path.write_text(f'bodies = "57530 MPa"\n{text}', encoding="utf-8")
    named = Joint.from_toml(path)
    for one, other in zip(closures(plain), closures(named), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    # plain pressures are in the unit that the modulus has
    for joint, size in ((plain, 1e-3), (named, 1.0)):
        area = joint.at_pressure("5 MPa").area
        assert joint.at_pressure(5 * size).area == pytest.approx(area, rel=1e-12)
        assert float(joint.table([5 * size])["area"][0]) == pytest.approx(area, rel=1e-12)
        answers = joint.sensitivity(5 * size).answers
        assert answers["area"] == pytest.approx(area, rel=1e-9)
        drawn = joint.plot(pressures=(size, 50 * size))
        ends = drawn.axes[0].lines[0].get_xdata()[[0, -1]]
        np.testing.assert_allclose(ends, [size, 50 * size], rtol=1e-9)


@pytest.mark.parametrize(
    ("typed", "name"),
    [
        ("1.4301", "stainless steel 304"), ("6061", "aluminium 6061"), ("3.3211", "aluminium 6061"),
        ("6061-T6", "aluminium 6061 hard"), ("42CrMo4", "steel 4140"), ("7075 hard", "aluminium 7075 hard"),
        (("1.4301", "6061-T6"), ("stainless steel 304", "aluminium 6061 hard")),
        (["42CrMo4", "silver"], ("steel 4140", "silver")),
    ],
)  # fmt: skip
def test_metals_whose_names_begin_with_a_digit(typed, name):
    joint = Joint(FACE, bodies=typed, nominal_area="4 cm^2")
    assert joint.pair == materials.pair(name)
    surface = joint.surface
    assert (
        contact(surface, typed, pressure="1 MPa").area
        == contact(surface, name, pressure="1 MPa").area
    )


@pytest.mark.parametrize(
    ("changed", "match"),
    [
        ({"bodies": None}, "bodies are missing"),
        ({"bodies": []}, r"bodies are metals.*got \[\]"),
        ({"bodies": ("210 GPa", "70 GPa")}, r"bodies are metals.*E=.*E_star=\["),
        ({"bodies": Bodies([[100.0], [200.0, 3.0]])}, "E_star must be real numbers"),
        ({"bodies": Bodies([100.0, -200.0])}, r"positive, got -200 at \(1,\)"),
        ({"bodies": {"E_star": 1, "x": 2}}, "no argument 'x'"),
        ({"bodies": {"E_star": 1, "hardnes": 2}}, "did you mean 'hardness'"),
        ({"bodies": "42CrMo5"}, "no known unit of stress"),
        ({"bodies": True}, "real numbers"),
        ({"bodies": Bodies(58.0, nu=[0.1, 0.2, 0.3])}, "nu must be one number"),
        ({"bodies": Bodies(58.0, hardness=[1.0, 0.0])}, r"positive.*got 0 at \(1,\)"),
        (
            {"bodies": Bodies([57.0, 58.0], hardness=[1.0, 2.0, 3.0])},
            r"do not broadcast: .*E_star \(2,\), hardness \(3,\)",
        ),
        (
            {"bodies": Bodies(58.0, conductivity=np.array([1.0, -2.0]))},
            r"positive, got -2 at \(1,\)",
        ),
        (
            {"bodies": Bodies(58.0, conductivity=(["45 W/(m K)", "45 S/m"], 1.0))},
            "conductivities are numbers, or texts",
        ),
        (
            {"bodies": Bodies(58.0, conductivity=(["45 W/(m K)", "45 S/m"],) * 2)},
            "both thermal or both electrical",
        ),
        ({"bodies": Bodies(58.0, conductivity="45 furlong")}, "conductivities are"),
        ({"gas": {"name": "air", "temp": 3}}, "no argument 'temp'.*temperature"),
        (
            {
                "gas": Gas(temperature=[300.0, 400.0]),
                "bodies": Bodies([57.0, 58.0, 59.0]),
            },
            r"do not broadcast: .*E_star \(3,\).*temperature \(2,\)",
        ),
        ({"part_b": FACE | {"Rq": ["1 um", "-1 um"]}}, r"part_b: Rq.*got -1 at \(1,\)"),
        ({"part_b": FACE | {"Rq": ["1 um", 2.0]}}, "Rq: 2.0 has no unit beside others"),
        ({"part_b": FACE | {"hurst": []}}, "part_b: hurst is empty"),
        ({"nominal_area": ["4 cm^2", "nan cm^2"]}, "nominal_area must be"),
        ({"gas": None}, "no gas is named None"),
    ],
    ids=str,
)
def test_odd_bodies_and_gases_of_a_joint_are_refused(changed, match):
    described = {"part_a": FACE, "bodies": METALS, "nominal_area": "4 cm^2"}
    with pytest.raises(InputError, match=match):
        Joint(**described | changed)


def test_the_command_has_reasons_and_says_how_pressures_are_reached():
    """JSON had the entries that are not valid without reasons, and neither said "first loading"."""
    content = json.loads(run("joint", EXAMPLE, "-p", "50MPa,1e-5MPa", "--json"))
    assert content["columns"]["valid"] == ["yes", "no"]
    found = Joint.from_toml(EXAMPLE).at_pressure(["50 MPa", "1e-5 MPa"])
    assert content["valid"] == found.valid.tolist() == [True, False]
    assert content["reasons"] == {reason: [1] for reason in found.reasons}
    assert content["loading"] == found.loading
    output = run("joint", EXAMPLE, "-p", "50MPa,1e-5MPa")
    assert f"loading: {found.loading}" in output.splitlines()
    assert "first; each pressure is reached from no contact" in found.loading


def test_falling_pressures_are_told_not_to_be_unloading(joint):
    rising = joint.at_pressure(["1 MPa", "10 MPa"]).loading
    falling = joint.at_pressure(["10 MPa", "1 MPa"]).loading
    assert falling.startswith(rising)
    assert "no unloading" in falling
    assert "unloading" not in rising
    assert joint.at_pressure("10 MPa").loading == rising
    elastic = Joint(joint.surface, bodies=Bodies("100 GPa"), theory="calibrated")
    assert elastic.at_pressure(["10 MPa", "1 MPa"]).loading == ""
    assert "loading" not in elastic.table(["10 MPa"]).attrs
    assert joint.table(["10 MPa"]).attrs["loading"] == rising


def test_a_joint_tells_the_ranges_of_its_conductivities(joint):
    """The middle of 154 to 180 W/(m K) was taken without a word."""
    low, high = materials.pair("aluminium 6061 hard").softer.conductivity
    assert low < high
    text = joint.facts()["conductivities"]
    assert f"and {low:g} to {high:g} W/(m K); of a range the geometric mean" in text
    assert text in repr(joint)
    # what a user states is no mean of a range
    stated = Bodies(metals=METALS, conductivity="50 W/(m K)")
    assert "conductivities" not in dataclasses.replace(joint, bodies=stated).facts()


def test_a_side_that_is_too_short_is_not_said_to_be_long_enough():
    """It was "4 longest wavelengths a side, fewer than 4"."""
    face = Surface.from_roughness(**FACE, nominal_area=f"{(0.5 * 3.98) ** 2} mm^2")
    (reason,) = (
        reason
        for reason in contact(
            face, "100 GPa", pressure="10 MPa", theory="calibrated"
        ).reasons
        if "a side" in reason
    )
    assert "has 3.98 longest wavelengths a side, fewer than 4" in reason


# numbers of a joint of two faces, each of which may be an array
DRAWN = {
    "Ra": (0.3, 0.9), "Rq": (0.3, 1.2), "hurst": (0.6, 0.95), "longest": (200.0, 600.0), "shortest": (2.0, 9.0),
    "nominal_area": (2.0, 6.0), "E_star": (40.0, 120.0), "hardness": (0.8, 3.0), "conductivity": (20.0, 200.0),
    "temperature": (250.0, 500.0), "gas_pressure": (1e4, 1e6), "accommodation": (0.2, 1.0), "pressure": (1e-3, 0.05),
}  # fmt: skip


def described_by(numbers, theory="calibrated"):
    """The joint of two faces with these numbers, one or an array for each name."""
    band = {name: numbers[name] for name in ("hurst", "longest", "shortest")}
    faces = [band | {name: numbers[name], "unit": "um"} for name in ("Ra", "Rq")]
    conductivity = np.char.add(numbers["conductivity"].astype(str), " W/(m K)").tolist()
    bodies = Bodies(
        numbers["E_star"],
        hardness=numbers["hardness"],
        conductivity=(conductivity, "160 W/(m K)"),
        nu=0.3,
    )
    gas = Gas(
        "helium",
        temperature=numbers["temperature"],
        pressure=numbers["gas_pressure"],
        accommodation=numbers["accommodation"],
    )
    area = 1e8 * numbers["nominal_area"]  # um^2 of cm^2
    return Joint(
        *faces, bodies=bodies, nominal_area=area, friction=0.2, gas=gas, theory=theory
    )


def compare_with_single_joints(numbers, theory, rtol):
    """Every quantity of a batch is that of a loop over its joints, and has the broadcast shape."""
    pressed = described_by(numbers, theory).at_pressure(numbers["pressure"])
    shape = np.broadcast_shapes(*(value.shape for value in numbers.values()))
    everywhere = {name: np.broadcast_to(value, shape) for name, value in numbers.items()}
    names = pressed.available()
    assert {"total_conductance", "tangential_stiffness", "flow_coefficient", "psi"} <= {
        *names
    }
    for name in names:
        assert np.shape(pressed.quantity(name)) == shape, name
    reasons = pressed.reasons
    for place in np.ndindex(shape):
        single = {name: np.asarray(value[place]) for name, value in everywhere.items()}
        alone = described_by(single, theory).at_pressure(float(single["pressure"]))
        for name in names:
            np.testing.assert_allclose(
                pressed.quantity(name)[place],
                alone.quantity(name),
                rtol=rtol,
                err_msg=name,
            )
        assert len([1 for mask in reasons.values() if mask[place]]) == len(alone.reasons)


@given(
    shapes=mutually_broadcastable_shapes(num_shapes=len(DRAWN), max_dims=2, max_side=2),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=15, deadline=None)
def test_a_batch_is_a_loop_of_joints(shapes, seed):
    """Whatever of its numbers are arrays, of whatever shapes."""
    rng = np.random.default_rng(seed)
    numbers = {
        name: rng.uniform(*ends, shape)
        for (name, ends), shape in zip(DRAWN.items(), shapes.input_shapes, strict=True)
    }
    compare_with_single_joints(numbers, "calibrated", rtol=1e-10)


@pytest.mark.parametrize("theory", ["persson", "greenwood_williamson", "mbma"])
def test_batches_of_every_theory(theory):
    rng = np.random.default_rng(3)
    numbers = {
        name: rng.uniform(*ends, 3 if name in ("Ra", "hurst", "hardness") else ())
        for name, ends in DRAWN.items()
    }
    numbers = {name: np.asarray(value) for name, value in numbers.items()}
    compare_with_single_joints(numbers, theory, rtol=1e-7)


def test_pressures_broadcast_with_a_batch():
    faces = FACE, FACE | {"Rq": ["0.4 um", "0.7 um", "1 um"]}
    batch = Joint(*faces, bodies=METALS, nominal_area="4 cm^2")
    pressures = [["1 MPa"], ["10 MPa"]]
    found = batch.at_pressure(pressures)
    assert found.area.shape == found.psi.shape == (2, 3)
    assert batch.shape == (3,)
    assert batch.total_conductance(pressures).shape == (2, 3)
    one = Joint(FACE, FACE | {"Rq": "0.7 um"}, bodies=METALS, nominal_area="4 cm^2")
    of_one = one.at_pressure(["1 MPa", "10 MPa"])
    for name in ("area", "total_conductance", "tangential_stiffness"):
        np.testing.assert_allclose(
            found.quantity(name)[:, 1], of_one.quantity(name), rtol=1e-12
        )
    with pytest.raises(InputError, match=r"do not broadcast: pressure \(2,\)"):
        batch.at_pressure(["1 MPa", "10 MPa"])
    by_area = batch.at(area=found.area)
    np.testing.assert_allclose(by_area.pressure, found.pressure, rtol=1e-6)


def test_a_batch_whose_gas_alone_differs():
    gas = Gas("helium", temperature=[300.0, 400.0])
    found = Joint(FACE, bodies=METALS, nominal_area="4 cm^2", gas=gas).at_pressure(
        "1 MPa"
    )
    assert found.gas_conductance.shape == found.area.shape == (2,)
    hot = Gas("helium", temperature=400.0)
    alone = Joint(FACE, bodies=METALS, nominal_area="4 cm^2", gas=hot).at_pressure(
        "1 MPa"
    )
    assert found.gas_conductance[1] == pytest.approx(alone.gas_conductance, rel=1e-14)


def test_a_plain_batch_of_moduli_is_in_gigapascals():
    given = {"nominal_area": "4 cm^2", "theory": "calibrated"}
    plain = Joint(FACE, bodies=Bodies([57.0, 58.0], hardness=[1.5, 2.0]), **given)
    named = Bodies(["57 GPa", "58000 MPa"], hardness=["1500 MPa", "2 GPa"])
    found = plain.at_pressure("10 MPa")
    known = Joint(FACE, bodies=named, **given).at_pressure("10 MPa")
    np.testing.assert_allclose(found.area, known.area, rtol=1e-14)
    assert found.units["pressure"] == "GPa"
    assert plain.at_pressure(0.01).area.tolist() == found.area.tolist()
    facts = plain.facts()
    assert facts["E_star"] == "57 to 58 GPa"
    assert facts["hardness"] == "1.5 to 2 GPa"
    assert "57 to 58 GPa" in repr(plain)


def test_areas_of_a_batch_have_a_pressure_each():
    areas = ["1 cm^2", "4 cm^2"]
    batch = Joint(FACE, FACE, bodies=METALS, nominal_area=areas)
    pressures = batch.pressure_of("4 kN")
    found = batch.at_pressure(pressures)
    for place, area in enumerate(areas):
        one = Joint(FACE, FACE, bodies=METALS, nominal_area=area)
        alone = one.at_pressure(one.pressure_of("4 kN"))
        assert found.area[place] == pytest.approx(alone.area, rel=1e-12)


@pytest.mark.parametrize(
    "ask",
    [
        lambda joint: joint.table("10 MPa"),
        lambda joint: joint.plot(),
        lambda joint: joint.plot(pressures=("1 MPa", "10 MPa")),
        lambda joint: joint.law(),
        lambda joint: joint.export("calculix", ("1 MPa", "50 MPa")),
        lambda joint: joint.to_dataset(),
    ],
)
@pytest.mark.parametrize("which", ["faces", "gas", "labelled"])
def test_what_is_of_one_joint_names_the_way_for_a_batch(ask, which):
    changed = {
        "faces": {"part_a": FACE | {"Rq": ["0.4 um", "0.7 um"]}},
        "gas": {"gas": Gas("air", temperature=[300.0, 400.0])},
        "labelled": {"bodies": Bodies(xr.DataArray([57.0, 58.0], dims="metal"))},
    }[which]
    described = {"part_a": FACE, "bodies": METALS, "nominal_area": "4 cm^2"} | changed
    with pytest.raises(InputError, match=r"of one joint.*batch.*one entry.*at_pressure"):
        ask(Joint(**described))


def test_labelled_numbers_of_a_joint():
    """DataArrays broadcast by name, lazily where they are lazy."""
    face = Surface.from_roughness(**FACE, h_max="2 um")
    heights = xr.DataArray([0.4, 0.7], dims="finish")
    finishes = dataclasses.replace(face, h_rms=heights, h_max=5 * heights, provenance=())
    hardness = xr.DataArray([0.95, 1.5, 2.0], dims="metal").chunk(metal=2)
    bodies = Bodies("57 GPa", hardness=hardness, conductivity="50 W/(m K)", nu=0.3)
    joint = Joint(finishes, face, bodies=bodies, theory="calibrated")
    found = joint.at_pressure(xr.DataArray([0.001, 0.01], dims="pressure"))
    sizes = {"finish": 2, "metal": 3, "pressure": 2}
    for name in ("area", "total_conductance", "tangential_stiffness", "psi"):
        value = found.quantity(name)
        assert dict(value.sizes) == sizes, name
        assert value.chunks is not None
    one = dataclasses.replace(face, h_rms=0.7, h_max=3.5)
    alone = Joint(
        one,
        face,
        bodies=dataclasses.replace(bodies, hardness=1.5),
        theory="calibrated",
    ).at_pressure(0.01)
    place = {"finish": 1, "metal": 1, "pressure": 1}
    for name in ("area", "total_conductance", "tangential_stiffness"):
        known = float(found.quantity(name).isel(place))
        assert known == pytest.approx(float(alone.quantity(name)), rel=1e-10), name


def test_a_batch_in_a_file_is_told_of_by_the_command(tmp_path):
    path = tmp_path / "joint.toml"
    numbers = "".join(
        f"{name} = {value!r}\n" for name, value in FACE.items() if name != "Rq"
    )
    path.write_text(
        f'bodies = "steel 1020"\nnominal_area = "4 cm^2"\n[part_a]\n{numbers}'
        'Rq = ["0.4 um", "0.7 um"]\n',
        encoding="utf-8",
    )
    assert Joint.from_toml(path).at_pressure("1 MPa").area.shape == (2,)
    refused = CliRunner().invoke(main, ["joint", str(path), "-p", "1MPa"])
    assert refused.exit_code != 0
    assert "a table is of one joint, and this is a batch of shape (2,)" in refused.output


def test_a_path_has_each_pressure_after_the_largest_before_it():
    face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    joint = Joint(
        face,
        bodies="steel 1020",
        nominal_area="4 cm^2",
        theory="calibrated",
        friction=0.2,
    )
    pressed = joint.path(["1 MPa", "50 MPa", "25 MPa", "60 MPa"])
    names = (
        "mean_separation",
        "area",
        "unloading_stiffness",
        "total_conductance",
        "energy",
    )
    for place, (pressure, largest) in enumerate(
        [("1 MPa", "1 MPa"), ("50 MPa", "50 MPa"), ("25 MPa", "50 MPa"), ("60 MPa",) * 2]
    ):
        alone = joint.after(largest).at_pressure(pressure)
        for name in names:
            assert pressed.quantity(name)[place] == pytest.approx(
                alone.quantity(name), rel=1e-9
            )
    first = joint.at_pressure("25 MPa")
    assert pressed.stiffness[2] > 1.5 * first.stiffness
    assert pressed.tangential().stiffness[2] == pytest.approx(
        joint.after("50 MPa").at_pressure("25 MPa").tangential_stiffness, rel=1e-9
    )
    # at the largest pressure unloading begins with a constant stiffness, so that less slips
    loops = [one.tangential().energy_loss("0.1 MPa") for one in (pressed, first)]
    assert 0 < loops[1] < loops[0][2]
    with pytest.raises(InputError, match="a list of numbers in their order"):
        joint.path("50 MPa")
    # what stays is what loading closes beyond what unloading opens
    settled = joint.settling(["10 MPa", "50 MPa"], "1 MPa")
    after = joint.after("50 MPa").at_pressure("1 MPa").plane_separation
    at_first = joint.at_pressure("1 MPa").plane_separation
    assert settled[1] == pytest.approx(at_first - after, rel=1e-12)
    assert 0 < settled[0] < settled[1] < float(joint.surface.h_max)
    with pytest.raises(OutOfRangeError, match="reference must be below the pressure"):
        joint.settling("1 MPa", "1 MPa")


@pytest.mark.slow
def test_exports_about_a_preload_are_of_unloading():
    face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    bodies = dataclasses.replace(Bodies(metals="steel 1020"))
    joint = Joint(face, bodies=bodies, nominal_area="4 cm^2", theory="calibrated").after(
        "50 MPa"
    )
    pressed = joint.at_pressure(["10 MPa", "30 MPa"])
    for quantity in ("solid_conductance", "unloading_stiffness"):
        rows = json.loads(
            joint.export("json", ("1 MPa", "100 MPa"), quantity=quantity, rows=60)
        )
        own = rows["columns"]
        found = np.interp([10, 30], own["pressure"], own[quantity])
        scale = found / pressed.quantity(quantity)
        assert scale[0] == pytest.approx(scale[1], rel=1e-2)
    assert "after a largest pressure of 50.0 MPa" in joint.export(
        "calculix", ("1 MPa", "100 MPa"), heat=False, rows=20
    )
    code = joint.export("c-law")
    assert "jump at the largest pressure" in code
    # the core's own function of this name is not one of the law
    own = code.replace("mbma_solid_conductances", "").replace("without", "")
    assert "solid_conductance" not in own


def test_the_numbers_of_a_joint_are_checked_once(monkeypatch):
    """Two faces, their sum, and that with its highest point: no surface is made to be thrown away."""
    made = []
    check = SelfAffine.__post_init__

    def counted(surface, nominal_area):
        made.append(surface)
        check(surface, nominal_area)

    monkeypatch.setattr(SelfAffine, "__post_init__", counted)
    face = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    metals = ("steel 4140 hard", "aluminium 6061 hard")
    joint = Joint(face, face | {"Rq": "0.7 um"}, bodies=metals, nominal_area="4 cm^2")
    assert len(made) == 4
    assert Joint(face, bodies=metals, nominal_area="4 cm^2").pair is joint.pair
