"""Films, apertures and conductances in the words of other codes: read back by their formulas, GetDP run."""

import dataclasses
import io
import json
import re
import subprocess
import xml.etree.ElementTree

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import refusals, skip_without_package, told
from law_points import needs

from mbma_tables import Surface, contact_law, flow_factors
from mbma_tables.cli import main
from mbma_tables.export import DATA
from mbma_tables.export.registry import targets
from mbma_tables.export.rows import data, solvers
from mbma_tables.export.rows.law_rows import describe_law

BEARING = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")
SI = {"length_unit": "m", "stress_unit": "Pa"}
HEAT = {
    "quantity": "solid_conductance",
    "conductivity": 50.0,
    "conductivity_unit": "W/(m K)",
}
RANGE = {"pressures": ("1 MPa", "0.5 GPa")}
FILM = {"quantity": "film", "peklenik": 3.0}
APERTURE = {"quantity": "hydraulic_aperture", "theory": "calibrated"}


def rows_of(**changed):
    return describe_law(BEARING, "110 GPa", **(SI | changed))


def pressed(numbers, u, E_star):
    """MBDyn's `GreenwoodTrippCM::ContactPressureTpl`, in the words of its source."""
    sigma = numbers["sigma"]
    eta = numbers["eta"]
    beta = numbers["beta"]
    K = 16 * np.sqrt(2) / 15 * np.pi * (eta * beta * sigma) ** 2 * np.sqrt(sigma / beta)
    k = 4.4086e-5 * K * E_star
    H = u / sigma - numbers["delta"] / sigma
    H0 = numbers["H0"]
    a0 = (4 - H0) ** 6.804
    a1 = -6.804 * (4 - H0) ** 5.804
    return np.where(
        H > 4,
        0.0,
        k * np.where(H >= H0, np.maximum(4 - H, 0) ** 6.804, a0 + a1 * (H - H0)),
    )


def read(text):
    return {
        key: float(value)
        for key, value in re.findall(r"^set: real joint_(\w+) = (\S+);$", text, re.M)
    }


def test_rows_of_a_film_are_the_flow_factors():
    film = rows_of(**FILM)
    assert (film.x.size, film.quantity) == (200, "film")
    assert film.x[[0, -1]] == pytest.approx([1e-7, 5e-6], rel=1e-8)
    own = flow_factors(BEARING, film.x * 1e6, "110 GPa", peklenik=3)
    for name, (values, unit) in list(film.columns.items())[1:-1]:
        scale = 1e9 if unit == "Pa" else 1
        np.testing.assert_allclose(
            values, scale * np.asarray(getattr(own, name)), rtol=1e-6, err_msg=name
        )
    law = contact_law(BEARING, "110 GPa", theory="calibrated")
    inner = film.x < 1.5e-6
    np.testing.assert_allclose(
        film.more["stiffness"][0][inner],
        1e15 * law.stiffness(film.x[inner] * 1e6),
        rtol=2e-4,
    )


@pytest.mark.parametrize("rows", [25, 200])
def test_the_stated_error_of_a_film_is_its_largest(rows):
    film = rows_of(**FILM, rows=rows)
    u = np.random.default_rng(3).uniform(film.x[0], film.x[-1], 2000)
    own = flow_factors(BEARING, u * 1e6, "110 GPa", peklenik=3)
    off = []
    for name in ("phi_x", "phi_y", "shear_x", "shear_y", "pressure"):
        value = np.asarray(getattr(own, name)) * (1e9 if name == "pressure" else 1)
        kept = own.valid & (value > (film.floor if name == "pressure" else 0))
        off.append(
            np.abs(
                np.interp(u, film.x, film.columns[name][0]) / np.where(kept, value, 1) - 1
            )[kept].max()
        )
    assert 0.5 * film.largest_error < max(off) < 2.5 * film.largest_error


def test_mbdyn_finds_its_own_numbers_again():
    film = rows_of(**FILM)
    made = {
        "sigma": 5e-7,
        "eta": 0.05 / (5e-7 * 2e-6),
        "beta": 2e-6,
        "delta": 4e-7,
        "H0": -100.0,
    }
    own = dataclasses.replace(
        film, more=dict(film.more) | {"pressure": (pressed(made, film.x, 1.1e11), "Pa")}
    )
    numbers = read(solvers.mbdyn(own, name="joint"))
    assert [numbers[key] for key in ("eta", "beta", "delta")] == pytest.approx(
        [made[key] for key in ("eta", "beta", "delta")], rel=1e-5
    )


@pytest.mark.parametrize("pressures", [None, ("1 MPa", "50 MPa")])
def test_mbdyn_reads_the_pressure_within_the_stated_misfit(pressures):
    film = rows_of(**FILM, pressures=pressures)
    text = solvers.mbdyn(film, name="joint")
    numbers = read(text)
    low, high, unit = re.search(
        r"fitted from p = (\S+) to (\S+) (\w+),", text.replace("\n# ", " ")
    ).groups()
    root, most = map(
        float,
        re.search(r"is (\S+) root mean\s(?:# )?square,\s(?:# )?(\S+) at", text).groups(),
    )
    u = film.x
    p = film.more["pressure"][0]
    kept = (p >= float(low) * 0.999) & (p <= float(high) * 1.001)
    off = np.log(pressed(numbers, u[kept], numbers["E"]) / p[kept])
    assert unit == "Pa"
    assert [np.sqrt(np.mean(off**2)), np.abs(off).max()] == pytest.approx(
        [root, most], rel=0.06
    )
    assert most < 0.2
    # E1 = E2 = 2 E*, nu = 0 have the modulus E*; continuous slope below H0
    assert numbers["E"] == 1.1e11
    below = pressed(
        numbers, u[kept][0] * np.array([0.97, 1 - 1e-9, 1 + 1e-9, 1.03]), numbers["E"]
    )
    assert (np.diff(below) < 0).all()
    # Mindlin's ratio of nu = 0.3 about the law's stiffness over pressure
    slip = film.more["stiffness"][0][kept] / p[kept] * 2 * (1 - 0.3) / (2 - 0.3)
    assert slip.min() < numbers["sigma0"] < slip.max()
    assert numbers["Rq"] * np.sqrt(2) == pytest.approx(5e-7)
    assert numbers["lambdax"] == 3
    # the order in which its parser asks for keywords
    order = (
        "flow factors",
        "lambdax",
        "lambdaz",
        "contact model",
        "E1",
        "nu1",
        "E2",
        "nu2",
        "unit system",
        "standard",
    )
    order += (
        "asperity density",
        "asperity curvature",
        "asperity mean height",
        "linearize",
        "friction model",
        "micro",
    )
    deck = text[text.index("# in the element") :]
    places = [deck.index(word) for word in order]
    assert places == sorted(places)


def test_geos_takes_the_tables():
    law = rows_of(**APERTURE, **RANGE)
    text = solvers.geos(law)
    root = xml.etree.ElementTree.fromstring(text)
    held = {
        found.get("name"): [
            np.array([float(word) for word in found.get(axis).strip("{} ").split(",")])
            for axis in ("coordinates", "values")
        ]
        for found in root.iter("TableFunction")
    }
    own = contact_law(BEARING, "110 GPa", theory="calibrated")
    aperture = lambda u: np.cbrt(np.asarray(own.leakage(u * 1e6))) * 1e-6  # noqa: E731
    # `validateApertureTable`: ends at zero with a slope below 1; coordinates rise
    jump, w = held["rough_byJump"]
    assert jump[-1] == 0
    assert (w[-1] - w[-2]) / (jump[-1] - jump[-2]) < 1
    assert all((np.diff(x) > 0).all() for x, _ in held.values())
    at = np.linspace(jump[0], 0, 500)
    off = np.interp(at, jump, w) / aperture(1.75e-6 + at) - 1
    assert np.abs(off).max() < law.largest_error
    # against stress, above the least pressure
    stress, u = held["rough_aperture"]
    p = np.geomspace(1e6, 0.499e9, 500)
    exact = np.asarray(own.at_pressure(p * 1e-9).mean_separation) * 1e-6
    assert np.abs(np.interp(p, stress, u) / exact - 1).max() < 2 * law.largest_error
    assert (
        np.abs(np.interp(p, *held["rough_hydraulicAperture"]) / aperture(exact) - 1).max()
        < 1.05 * law.largest_error
    )
    x, slope = held["rough_derivative"]
    inner = (
        np.asarray(
            own.at_pressure(x[1:-1] * 1e-9 * np.array([[1.001], [0.999]])).mean_separation
        )
        * 1e-6
    )
    np.testing.assert_allclose(
        slope[1:-1],
        (aperture(inner[0]) - aperture(inner[1])) / (0.002 * x[1:-1]),
        rtol=1e-5,
    )
    bandis = next(root.iter("BartonBandis"))
    w0, reference = (
        float(bandis.get(key)) for key in ("referenceAperture", "referenceNormalStress")
    )
    kept = law.x >= law.x[1]
    misfit = np.log(w0 / (1 + 9 * law.x[kept] / reference) / law.y[kept])
    assert (
        f"is {misfit.std():.2g} root mean square, {np.abs(misfit).max():.2g} at most"
        in text
    )
    assert (
        next(root.iter("HydraulicApertureTable")).get("apertureTableName")
        == "rough_byJump"
    )


@pytest.mark.parametrize("options", [FILM, HEAT | RANGE, APERTURE | RANGE, {"rows": 30}])
def test_moose_takes_functions(options):
    law = rows_of(**options)
    text = solvers.moose_function(law, name="f")
    blocks = re.findall(
        r"^  \[f_(\w+)\]\n    type = PiecewiseLinear\n    x = '(.*)'\n    y = '(.*)'\n  \[\]$",
        text,
        re.M,
    )
    assert [name for name, *_ in blocks] == list(law.columns)[1:]
    for name, x, y in blocks:
        np.testing.assert_allclose(np.array(x.split(), float), law.x, rtol=1e-9)
        np.testing.assert_allclose(
            np.array(y.split(), float), law.columns[name][0], rtol=1e-9
        )


def test_lethe_conducts_within_the_stated_misfit():
    law = rows_of(**HEAT, **RANGE)
    text = solvers.lethe(law)
    set_ = {key: float(value) for key, value in re.findall(r"set ([\w ]+) = (\S+)", text)}
    # two faces: squares add up, the harmonic mean of the hardness;
    # calculate_microcontact_resistance times its area
    sigma = np.hypot(set_["surface roughness particles"], set_["surface roughness wall"])
    slope = np.hypot(set_["surface slope particles"], set_["surface slope wall"])
    H = 2 / (1 / set_["microhardness particles"] + 1 / set_["microhardness wall"])
    peak = law.x[1:]
    # of Hertz's pressure up to the peak the mean of h is h(peak)/(1 + 0.96/2)
    conductance = (1 + 0.96 / 2) * 50.0 * slope / (1.184 * sigma) * (peak / H) ** 0.96
    stated = float(re.search(r"\^0.96 is within (\S+) of", text).group(1))
    assert np.expm1(np.abs(np.log(conductance / law.y[1:])).max()) == pytest.approx(
        stated, rel=0.05
    )
    assert sigma == pytest.approx(5e-7)
    assert slope == pytest.approx(
        np.sqrt(2 / np.pi) * float(BEARING.rms_gradient) / np.sqrt(2), rel=1e-6
    )


GETDP = """
Include "law.pro";
Group { D = Region[1]; }
FunctionSpace { { Name S; Type Form0; BasisFunction { { Name s; NameOfCoef c; Function BF_Node; Support D;
  Entity NodesOf[All]; } } } }
Jacobian { { Name J; Case { { Region All; Jacobian Vol; } } } }
Integration { { Name I; Case { { Type Gauss; Case { { GeoElement Line; NumberOfPoints 1; } } } } } }
Formulation { { Name F; Type FemEquation; Quantity { { Name v; Type Local; NameOfSpace S; } }
  Equation { Galerkin { [ Dof{v}, {v} ]; In D; Jacobian J; Integration I; } } } }
Resolution { { Name R; System { { Name A; NameOfFormulation F; } } Operation { PRINTS } } }
"""
MESH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n$Elements\n1\n1 1 2 1 1 1 2\n"


@needs("getdp")
@pytest.mark.parametrize("options", [FILM, HEAT | RANGE])
def test_getdp_interpolates(options, tmp_path):
    law = rows_of(**options)
    (tmp_path / "law.pro").write_text(solvers.getdp(law))
    (tmp_path / "a.msh").write_text(f"{MESH}$EndElements\n")
    x = np.linspace(law.x[0], law.x[-1], 7)
    names = list(law.columns)[1:]
    asked = "".join(
        f"Print[{{{', '.join(f'rough_{name}[{value:.12g}]' for value in x[:-1])}}}, Format "
        f'"{name} {" ".join(["%.12g"] * 6)}"];\n'
        for name in names
    )
    (tmp_path / "a.pro").write_text(GETDP.replace("PRINTS", asked))
    ran = subprocess.run(
        ["getdp", "a.pro", "-msh", "a.msh", "-solve", "R"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    for name in names:
        found = re.search(rf"^{name} (.*)$", ran.stdout, re.M)
        assert found, ran.stdout + ran.stderr
        expected = np.interp(x[:-1], law.x, law.columns[name][0])
        np.testing.assert_allclose(np.array(found[1].split(), float), expected, rtol=1e-6)


@pytest.mark.parametrize("name", DATA)
def test_data_of_a_film_come_back(name, tmp_path):
    skip_without_package(name)
    film = rows_of(**FILM)
    path = tmp_path / "film"
    path.write_bytes(getattr(data, f"to_{name}")(film))
    if name == "json":
        again = json.loads(path.read_bytes())
        assert (again["y_unit"], again["largest_error"]) == ("1", film.largest_error)
        assert again["facts"] == {key: list(fact) for key, fact in film.facts.items()}
        found = again["columns"]
    elif name == "csv":
        lines = [
            line for line in path.read_text().splitlines() if not line.startswith("#")
        ]
        assert lines[0].startswith("mean_separation [m],phi_x [1],")
        found = dict(
            zip(
                film.columns,
                np.array([line.split(",") for line in lines[1:]], float).T,
                strict=True,
            )
        )
    elif name == "matlab":
        from scipy.io import loadmat

        held = loadmat(path, appendmat=False)
        assert held["largest_error"].item() == film.largest_error
        found = {
            key: held[{"mean_separation": "x", "phi_x": "y"}.get(key, key)][:, 0]
            for key in film.columns
        }
    elif name in ("netcdf", "hdf5"):
        with pytest.importorskip("h5py").File(path) as held:
            assert held["pressure"].attrs["units"] in ("Pa", b"Pa")
            # CF 1.11, section 2.5.1
            assert not any("_FillValue" in held[key].attrs for key in film.columns)
            found = {key: held[key][:] for key in film.columns}
    elif name == "xlsx":
        import openpyxl

        rows, about = openpyxl.load_workbook(io.BytesIO(path.read_bytes())).worksheets
        head, *cells = rows.iter_rows(values_only=True)
        assert head[0] == "mean_separation [m]"
        found = dict(zip(film.columns, np.array(cells, float).T, strict=True))
        lines = [row[0].value for row in about]
        assert about["B1"].value == pytest.approx(film.largest_error, rel=1e-15)
        assert lines[2:] == list(film.comments)
    else:
        held = pytest.importorskip("pyarrow.parquet").read_table(path)
        assert json.loads(held.schema.metadata[b"units"])["pressure"] == "Pa"
        found = {key: held[key].to_numpy() for key in film.columns}
    for key, (values, _) in film.columns.items():
        # cells have 16 digits
        digits = 1e-15 if name == "xlsx" else 0
        np.testing.assert_allclose(found[key], values, rtol=digits, err_msg=key)


def written(*words):
    ran = CliRunner().invoke(
        main,
        ["export", *words, "--surface", "concrete", "--E-star", "13.3MPa", "--out", "-"],
    )
    assert ran.exit_code == 0
    text = ran.stdout
    assert ("lengths in m\n" in text.replace(" -->", "")) == (
        targets()[words[0]].units is not None
    )
    assert ("E* = 13300000.0 Pa" in text) == (targets()[words[0]].units is not None)
    return text


HEAT_WORDS = ("--conductivity", "2", "--conductivity-unit", "W/(m K)")
test_the_command_writes_them = told(
    written,
    ("mbdyn", "--peklenik", "2", "set: real rough_lambdax = 2.0;"),
    (
        "geos",
        "--theory",
        "calibrated",
        "--pressures",
        "1kPa:1MPa",
        '<BartonBandis name="rough_fitted"',
    ),
    ("moose-function", "--quantity", "film", "--rows", "9", "[rough_phi_x]"),
    ("csv", "--quantity", "film", "--peklenik", "2", "mean_separation [mm],phi_x [1]"),
    ("lethe", *HEAT_WORDS, "--pressures", "1kPa:1MPa", "microhardness"),
)


test_refused = refusals(
    lambda target, asked, options: getattr(solvers, target)(rows_of(**asked), **options),
    (
        "mbdyn",
        {},
        {},
        "MBDyn takes film against mean_separation here, got pressure against",
    ),
    ("geos", FILM, {}, "GEOS takes hydraulic_aperture against pressure here, got phi_x"),
    (
        "mbdyn",
        FILM | {"length_unit": "um"},
        {},
        "MBDyn takes m and Pa here, got um and Pa",
    ),
    ("mbdyn", FILM, {"name": "a b"}, "a name must be a letter"),
    (
        "mbdyn",
        FILM | {"pressures": ("3 GPa", "4 GPa")},
        {},
        r"needs 3 rows at pressures with A/A0 <=",
    ),
    ("mbdyn", FILM | {"rtol": 1e-3}, {}, "rtol does not belong to quantity='film'"),
    ("mbdyn", FILM | {"rows": 2}, {}, "rows must be a whole number in"),
    ("mbdyn", {"peklenik": 2.0}, {}, "peklenik does not belong to quantity='pressure'"),
    ("mbdyn", FILM | {"peklenik": 20.0}, {}, "peklenik"),
)
