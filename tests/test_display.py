"""Figures, and what results display in a terminal, in a notebook and as Datasets."""

import re
import subprocess
import sys

import numpy as np
import pytest
from helpers import refusals

from mbma_tables import (
    InputError,
    Joint,
    Surface,
    contact,
    contact_law,
    island,
    sensitivity,
)
from mbma_tables.common.plots import Line, draw_compression, to_picture
from mbma_tables.export.rows.law_rows import describe_law

ROAD = Surface.named("concrete")
SPECTRUM = Surface.from_spectrum(
    np.geomspace(1, 100, 40),
    1e-3 * np.geomspace(1, 100, 40) ** -3.0,
    h_max=0.3,
    unit="um",
)


DISPLAYED = (
    lambda: ROAD,
    lambda: SPECTRUM,
    lambda: contact(ROAD, "13.3 MPa", separation=np.linspace(1, -1, 9)),
    lambda: contact(SPECTRUM, pressure=[0.001, 0.01], theory="calibrated"),
    lambda: contact_law(ROAD, "13.3 MPa"),
    lambda: contact_law(ROAD, theory="calibrated"),
    lambda: describe_law(ROAD, "13.3 MPa", rows=20),
)


@pytest.fixture(
    scope="module", params=DISPLAYED, ids=lambda make: f"{DISPLAYED.index(make)}"
)
def thing(request):
    return request.param()


def test_a_line_and_a_notebooks_table(thing):
    line = repr(thing)
    shown = thing._repr_html_()
    assert "\n" not in line
    # with the condition under which a contact of five numbers is valid, and the evidence
    assert len(line) < 600
    assert line.startswith(type(thing).__name__)
    assert not re.search(r"np\.|array|object at", line)
    assert shown.count("<tr>") == len(thing._facts())
    assert "<table>" in shown
    assert len(shown) < 4_000


def rough_map(seed=1, points=64):
    """Heights of waves of 5 to 32 steps, periodic."""
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((points, points)))
    q = np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points))
    return 0.3 * np.fft.irfft2(np.where((q > 0.03) & (q < 0.2), noise, 0))


# what finds a gap, fits, simulates or draws; theories may read their curves at known gaps
SOLVING = {
    "mbma_tables/theories": ("loaded", "mean_separation_at", "pressed", "of", "fit"),
    "mbma_tables/theories/simulated": ("press", "simulated", "simulate"),
    "mbma_tables/law": ("law_of", "at", "values"),
    "matplotlib": ("savefig", "subplots"),
}


def calls_of(show):
    """Names of the functions of `SOLVING` that are called meanwhile."""
    called = []

    def note(frame, event, _):
        place = frame.f_code.co_filename.replace("\\", "/")
        name = frame.f_code.co_name
        if event == "call" and any(
            folder in place and name in names for folder, names in SOLVING.items()
        ):
            called.append(f"{place}: {name}")

    sys.setprofile(note)
    try:
        show()
    finally:
        sys.setprofile(None)
    return called


def displayed_things():
    """Joints, contacts, laws and surfaces, of numbers and of a map."""
    surface = Surface.from_map(rough_map(), dx=1.0, periodic=True, unit="um")
    metals = ("steel 4140 hard", "aluminium 6061 hard")
    joint = Joint(surface, bodies=metals)
    yield joint
    yield Joint(surface, bodies=metals, theory="simulated")
    yield surface
    yield contact(surface, "100 GPa", pressure="10 MPa", theory="calibrated")
    drawn = Joint(SPECTRUM, bodies=metals, theory="calibrated")
    yield drawn
    yield drawn.at_pressure(["1 MPa", "20 MPa"])
    yield drawn.law()
    yield contact_law(ROAD, "13.3 MPa")


def test_what_shows_an_object_neither_solves_nor_draws():
    """Text, table, facts, equality and hash are asked for by editors and notebooks unasked."""
    for shown in displayed_things():
        assert not calls_of(lambda shown=shown: (repr(shown), shown._repr_html_()))
        assert not calls_of(
            lambda shown=shown: (shown._facts(), shown == shown.__class__)
        )
        assert not calls_of(lambda shown=shown: (hash(shown), shown in [shown]))


def test_what_a_contact_shows_was_read_when_it_was_made():
    """The first text of a process read the shipped file of the law anew, twice: 40 to 70 ms."""
    code = """
import mbma_tables.common.netcdf as netcdf, mbma_tables.theories.evidence as evidence
from mbma_tables import Bodies, Surface, contact
surface = Surface(hurst=0.8, q0=0.01, q1=1.0, h_rms=1.0, h_max=3.5, unit="um")
bodies = Bodies("100 GPa", hardness="1 GPa", conductivity="45 W/(m K)")
pressed = contact(surface, bodies, pressure="10 MPa", theory="calibrated")
evidence.read_sealed = netcdf.read_sealed = lambda *_: 1 / 0
assert "scatter" in repr(pressed) and "unloading_stiffness_scatter" in repr(pressed)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("theory", [None, "calibrated"])
def test_the_text_of_a_joint_takes_no_solver_into_memory(theory):
    """It imported all that simulates maps, half a second, to see that its faces are no map."""
    code = f"""
import sys
from mbma_tables import Joint
face = {{"Rq": "1 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}}
joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory={theory!r})
before = set(sys.modules)
repr(joint), joint._repr_html_(), hash(joint), joint == 1
more = set(sys.modules) - before
assert not [name for name in more if name.split(".")[0] in ("scipy", "netCDF4")], more
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_name_of_a_default_is_that_of_its_answers():
    """It is known without the simulation whether there will be one, unless that fails."""
    surface = Surface.from_map(rough_map(2), dx=1.0, periodic=True, unit="um")
    joint = Joint(surface, bodies="steel 4140 hard")
    assert joint.facts()["theory"].startswith("simulated")
    assert joint.at_pressure("1 MPa").theory == "simulated"
    for other in (
        Joint(SPECTRUM, bodies="steel 4140 hard"),
        Joint(surface, bodies="steel 4140 hard", theory="persson"),
    ):
        assert other.facts()["theory"] == other.at_pressure("1 MPa").theory


def test_a_figure_is_none_of_pyplots_and_kept(thing, tmp_path):
    before = "matplotlib.pyplot" in sys.modules
    figure = thing.plot()
    assert all(axes.get_xlabel() and axes.get_ylabel() for axes in figure.axes)
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert ("matplotlib.pyplot" in sys.modules) == before
    thing.plot(tmp_path / "thing.svg")
    assert b"<svg" in (tmp_path / "thing.svg").read_bytes()
    with pytest.raises(InputError, match="must end with one of"):
        thing.plot(tmp_path / "thing.xyz")


def test_every_variable_has_its_unit(thing):
    found = thing.to_dataset()
    assert found.variables
    assert all(variable.attrs["units"] for variable in found.variables.values())
    assert all(isinstance(value, str) for value in found.attrs.values())


def test_a_dataset_holds_the_answers():
    answer = contact(ROAD, "13.3 MPa", separation=[[0.8, 0.2], [0.1, 0.0]])
    found = answer.to_dataset()
    for name in (
        "separation",
        "pressure",
        "area",
        "stiffness",
        "mean_pressure",
        "energy",
        "scatter",
        "valid",
        "error",
    ):
        np.testing.assert_array_equal(found[name], getattr(answer, name))
    assert found["stiffness"].dims == ("dim_0", "dim_1")
    assert (found["stiffness"].units, found["pressure"].units) == ("MPa/mm", "MPa")
    assert found.attrs["surface"] == repr(ROAD)
    law = contact_law(ROAD, 13.3, theory="mbma").to_dataset()
    direct = contact(ROAD, 13.3, separation=law["separation"].values)
    np.testing.assert_allclose(law["pressure"], direct.pressure, rtol=1e-8)
    np.testing.assert_allclose(law["stiffness"], direct.stiffness, rtol=1e-6)
    np.testing.assert_array_equal(SPECTRUM.to_dataset()["C"], SPECTRUM.C)


def test_a_lazy_answer_stays_lazy():
    da = pytest.importorskip("dask.array")
    import xarray as xr

    def fail(block):
        raise AssertionError("computed")

    gaps = xr.DataArray(
        da.ones(6, chunks=3).map_blocks(fail, dtype=float, meta=np.empty(0)), dims="gap"
    )
    answer = contact(ROAD, separation=gaps)
    assert "{'gap': 6}" in repr(answer)
    assert answer.to_dataset()["stiffness"].units == "1/mm" or answer.to_dataset()[
        "stiffness"
    ].dims == ("gap",)
    assert (
        "<table>"
        in Surface(xr.DataArray([0.5, 0.8], dims="site"), 1, 100, 1, 3)._repr_html_()
    )


def test_batches_are_summed_up():
    batch = Surface(np.linspace(0.2, 0.9, 100), 1, 100, 1, 3)
    assert "hurst=<100 numbers, 0.2 to 0.9>" in repr(batch)
    answer = contact(batch, separation=1.0)
    assert "valid 0 of 100" in repr(answer)
    assert len(repr(answer)) < 400
    for single in (batch, answer, contact(ROAD, separation=0.1)):
        assert "<img" not in single._repr_html_()
        with pytest.raises(InputError):
            single.plot()


test_misspelt_arguments_get_a_hint = refusals(
    lambda ask: ask(),
    (
        lambda: contact(ROAD, u=0.3),
        "contact has no argument 'u': did you mean 'mean_separation'[?]",
    ),
    (lambda: contact(ROAD, presure=0.3), "did you mean 'pressure'[?]"),
    (
        lambda: contact_law(ROAD, theroy="persson"),
        "contact_law has no argument 'theroy': did you mean 'theory'[?]",
    ),
    (lambda: island(ROAD, dleta=0.1), "did you mean 'delta'[?]"),
    (lambda: sensitivity(ROAD, p=0.1), "did you mean 'pressure'[?]"),
    (lambda: describe_law(ROAD, 1.0, row=3), "did you mean 'rows'[?]"),
    (
        lambda: Surface.from_map("x", detrnd="plane"),
        "Surface.from_map has no argument 'detrnd': did you mean",
    ),
    (lambda: Surface.from_profile("x", shortcutoff=1), "did you mean 'short_cutoff'[?]"),
    (
        lambda: Surface(0.8, 0.5, 100.0, hrms=0.2),
        "Surface has no argument 'hrms': did you mean 'h_rms'[?]",
    ),
    (lambda: Surface.from_moments(H=0.7), "did you mean 'hurst'[?]"),
    (lambda: Surface.from_roughness(rq=0.7), "did you mean 'Rq'[?]"),
    (
        lambda: Surface.from_roughness(Rz=0.7),
        "^Surface.from_roughness has no argument 'Rz': a peak-to-valley height is no rms",
    ),
    (lambda: Surface.from_roughness(lambda_c=0.7), "longest wavelength .* longest="),
    (lambda: Surface(Ra=0.7, hurst=0.8), "from_roughness takes roughness parameters"),
    (lambda: Surface.from_spectrum([1], [1], hmax=1), "did you mean 'h_max'[?]"),
    error=TypeError,
)


GAP = np.array([3.0, 2.0, 1.0, 0.0])
FORCE = np.array([0.0, 2e-5, 3e-4, 2e-2])
AREA = np.array([0.0, 3e-5, 4e-4, 3e-2])


def lines(name, gap, force, area, scatter=None, area_scatter=None):
    return {
        "gap": Line(name, gap),
        "pressure": Line(name, force, scatter),
        "area": Line(name, area, area_scatter),
    }


def two_curves():
    return [
        lines("first", GAP, FORCE, AREA),
        lines("second", GAP[:3] + 0.5, 2 * FORCE[1:], AREA[1:]),
    ]


def test_scatter_is_a_band_of_one_standard_deviation():
    scatter = np.array([np.nan, 0.7, 0.3, 0.1])
    figure = draw_compression(
        [lines("law", GAP, FORCE, AREA, scatter, 0.1 * scatter), *two_curves()]
    )
    for axes, x, y, spread in (
        (figure.axes[0], GAP, FORCE, scatter),
        (figure.axes[1], FORCE, AREA, 0.1 * scatter),
    ):
        (band,) = axes.collections
        corners = band.get_paths()[0].vertices
        for k in (1, 2, 3):
            for side in (1, -1):
                assert (
                    np.isclose(
                        corners, [x[k], y[k] * np.exp(side * spread[k])], rtol=1e-12
                    )
                    .all(axis=1)
                    .any()
                )
        assert corners[:, 0].min() >= x[1:].min()
    unknown = draw_compression([lines("law", GAP, FORCE, AREA, np.full(4, np.nan))])
    assert not unknown.axes[0].collections
    for bad in ([], [lines("law", GAP, 0 * FORCE, AREA)]):
        with pytest.raises(InputError, match=r"no contact|at least one"):
            draw_compression(bad)


@pytest.mark.parametrize("outlines", [False, True])
def test_drawings_repeat_with_letters_as_asked(outlines):
    first, second = (
        to_picture(draw_compression(two_curves()), "svg", outlines=outlines)
        for _ in range(2)
    )
    assert first == second
    assert (b"<text" in first) != outlines
