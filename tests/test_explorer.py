"""The page of `mbma explore` in a headless Chromium: its curves are the library's, its controls do what they say."""

import csv
import dataclasses
import functools
import json
import re
import shutil
import urllib.parse

import numpy as np
import pytest
from helpers import compiled_law, contact_of, random_map, refused, run

from generate.explorer import c_sources, digest_of, law_sources
from mbma_tables import Bodies, InputError, Surface, contact
from mbma_tables.common.units import Units
from mbma_tables.contacts.quantities import registry
from mbma_tables.core import core
from mbma_tables.export.code.languages.javascript import LAW_MODULE
from mbma_tables.export.page.explorer import MODULE, explorer_page
from mbma_tables.export.text import page_file
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.sums import by_table

QUANTITIES = ("mean_separation", "pressure", "area", "stiffness")
NAMES = ("hurst", "q0", "q1", "h_rms", "h_max")
GO = """(text) => new Promise((done) => {
  addEventListener("hashchange", () => setTimeout(done), { once: true });
  location.hash = text;
})"""

# the text of the button's file without its download: hundreds of those from one page are
# not reliable in a browser
CSV = """() => {
  const { createObjectURL } = URL, { click } = HTMLAnchorElement.prototype;
  let written;
  URL.createObjectURL = (blob) => ((written = blob), "#");
  HTMLAnchorElement.prototype.click = () => {};
  document.getElementById("csv").click();
  Object.assign(URL, { createObjectURL });
  Object.assign(HTMLAnchorElement.prototype, { click });
  return written.text();
}"""


@pytest.fixture(scope="module")
def opened():
    pytest.importorskip("playwright")
    from generate.explorer import browser, program

    if program() is None:
        pytest.skip("not installed: chromium")
    with browser() as found:
        yield found


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    path = tmp_path_factory.mktemp("explorer") / "page with blanks.html"
    run("explore", "--surface", "concrete", "--E-star", "13.3MPa", "--out", str(path))
    return path.as_uri()


@pytest.fixture
def visit(opened, address):
    """Opens the page in a state; nothing may fail or be fetched meanwhile."""
    from generate.explorer import visit

    tabs = []
    faults = []

    def at(state="", **options):
        tab = visit(opened, f"{address}#{state}", **options)
        tab.on("pageerror", lambda fault: faults.append(str(fault)))
        tab.on("request", lambda request: faults.append(request.url))
        tabs.append(tab)
        return tab

    yield at
    for tab in tabs:
        tab.context.close()
    assert [fault for fault in faults if not fault.startswith("blob:")] == []


def download(tab, button: str) -> str:
    with tab.expect_download() as found:
        tab.click(button)
    return found.value.path().read_text(encoding="utf-8")


def columns(tab) -> dict[str, np.ndarray]:
    rows = [line for line in tab.evaluate(CSV).splitlines() if not line.startswith("#")]
    head, *body = csv.reader(rows)
    numbers = np.array(
        [[float(cell) if cell else np.nan for cell in row] for row in body]
    )
    return {name.split(" [")[0]: numbers[:, k] for k, name in enumerate(head)}


def random_state(rng: np.random.Generator) -> dict:
    q0, h_rms = np.exp(rng.uniform(-8, 8, 2))
    hurst = rng.choice([1.0, rng.uniform(0.1, 1.0)], p=[0.1, 0.9])
    numbers = (
        hurst,
        q0,
        q0 * np.exp(rng.uniform(np.log(5.2), np.log(5e4))),
        h_rms,
        h_rms * rng.uniform(2.0, 6.0),
    )
    return {
        **dict(zip(NAMES, map(float, numbers), strict=True)),
        "E_star": float(np.exp(rng.uniform(-5, 12))),
        "theory": str(rng.choice(["mbma", "calibrated", "persson"])),
        "variant": str(rng.choice(["reported", "printed", "fitted"])),
        "against": str(rng.choice(["gap", "pressure"])),
        "beside": "mbma,calibrated,persson",
    }


def largest_difference(state: dict, found: dict[str, np.ndarray], rows: slice) -> float:
    """Of the page's answers from the library's at the page's gaps, relative, in every quantity and theory."""
    surface = Surface(*(state[name] for name in NAMES))
    worst = 0.0
    for theory in ("mbma", "calibrated", "persson"):
        known = {name: found[f"{theory} {name}"] for name in QUANTITIES}
        answered = np.flatnonzero(np.isfinite(known["mean_separation"]))[rows]
        assert answered.size > 3
        options = {
            "mean_separation": known["mean_separation"][answered],
            "E_star": state["E_star"],
            "theory": theory,
        }
        expected = contact_of(
            surface,
            **options,
            **({"variant": state["variant"]} if theory == "mbma" else {}),
        )
        for name, scatter in {
            "pressure": expected.scatter,
            "area": expected.area_scatter,
        }.items():
            np.testing.assert_allclose(
                found[f"{theory} scatter of ln {name}"][answered], scatter, rtol=1e-6
            )
        force = expected.pressure
        area = expected.area
        stiffness = expected.stiffness
        if theory == "mbma":
            # islands summed gap by gap, as the page does it
            sums = np.empty((5, answered.size))
            depth = 2 * (surface.h_max - options["mean_separation"])
            how = Mbma(variant=state["variant"], rtol=1e-11).sums
            by_table(
                surface,
                depth / surface.h_rms,
                np.arange(answered.size),
                how.model,
                how,
                sums,
            )
            stress = state["E_star"] * surface.q0 * surface.s
            force = stress * sums[0]
            area = sums[1]
            stiffness = 2 * stress / surface.h_rms * sums[2]
            area = (
                -np.expm1(-area) if state["variant"] == "fitted" else area
            )  # the cover of its islands
        for name, values in {
            "pressure": force,
            "area": area,
            "stiffness": stiffness,
        }.items():
            worst = max(worst, np.abs(known[name][answered] / values - 1).max())
        conductance = (
            50 / 1e-3 / state["E_star"] * found[f"{theory} stiffness"]
        )  # of 50 W/(m K), lengths in mm
        np.testing.assert_allclose(
            found[f"{theory} solid_conductance"], conductance, rtol=1e-12
        )
        np.testing.assert_allclose(
            found[f"{theory} tangential_stiffness"],
            found[f"{theory} stiffness"] * 1.4 / 1.7,
            rtol=1e-12,
        )
    if state["against"] == "pressure":
        pressures = np.nanmax(
            [found[f"{theory} pressure"] for theory in ("mbma", "calibrated", "persson")],
            axis=0,
        )
        assert np.allclose(np.diff(np.log(pressures)), np.log(1e5) / 99, rtol=1e-6)
    return worst


@pytest.mark.parametrize("number", [4, pytest.param(200, marks=pytest.mark.slow)])
def test_curves_are_those_of_the_library(number, visit):
    rng = np.random.default_rng(2026)
    tab = visit()
    worst = []
    assert download(tab, "#csv") == tab.evaluate(CSV)
    for _ in range(number):
        state = random_state(rng)
        tab.evaluate(GO, urllib.parse.urlencode(state))
        worst.append(
            largest_difference(state, columns(tab), slice(rng.integers(9), None, 9))
        )
    assert max(worst) < 1e-9


# multiplies what functions of the module write last
CHANGED = """(factors) => {
  const instantiate = WebAssembly.instantiate;
  WebAssembly.instantiate = async (...given) => {
    const { instance } = await instantiate.apply(WebAssembly, given), exports = { ...instance.exports };
    for (const [name, factor] of Object.entries(factors)) {
      exports[name] = (...places) => {
        const status = instance.exports[name](...places);
        new Float64Array(exports.memory.buffer, places.at(-1), 1)[0] *= factor;
        return status;
      };
    }
    return { instance: { exports } };
  };
}"""


@pytest.mark.slow
def test_what_the_page_shows_is_computed_by_the_core(visit, opened, address):
    """Its JavaScript had formulas of its own: with those, a change of the core changed nothing."""
    state = "theory=mbma&variant=fitted&beside=calibrated"
    before = columns(visit(state))
    factors = {
        "mbma_tangential_ratios": 2,
        "mbma_tangential_stiffnesses": 8,
        "mbma_solid_conductances": 16,
        "mbma_covered_areas": 32,
    }
    changed = {"tangential_stiffness": 4.0, "solid_conductance": 16.0, "area": 32.0}
    context = opened.new_context()
    context.add_init_script(f"({CHANGED})({json.dumps(factors)})")
    tab = context.new_page()
    tab.goto(f"{address}#{state}")
    tab.wait_for_selector("html[data-ready]", state="attached")
    after = columns(tab)
    context.close()
    for name in (*QUANTITIES, "tangential_stiffness", "solid_conductance"):
        expected = changed.get(name, 1.0) * before[f"mbma {name}"]
        np.testing.assert_array_equal(after[f"mbma {name}"], expected)


def test_formulas_of_the_core_are_those_of_physics():
    """(2 - nu)/(2 (1 - nu)) is of Mindlin (1949), k_s/E* times the stiffness of Barber (2003)."""
    nu = np.array([-0.9, 0.0, 0.3, 0.5])
    kappa = np.empty(4)
    core.tangential_ratios(nu, np.full(4, 0.5), kappa)
    np.testing.assert_allclose(kappa, (2 - nu) / (2 * (1 - nu)), rtol=1e-15)
    out = np.empty(4)
    core.tangential_stiffnesses(np.full(4, 3.0), kappa, out)
    np.testing.assert_allclose(out, 3.0 / kappa, rtol=1e-15)
    core.solid_conductances(np.full(4, 3.0), np.full(4, 45.0), 10.0 ** np.arange(4), out)
    np.testing.assert_allclose(out, [135.0, 13.5, 1.35, 0.135], rtol=1e-15)
    core.covered_areas(np.array([0.0, 1e-12, 0.5, 40.0]), out)
    np.testing.assert_allclose(out, [0.0, 1e-12, 1 - np.exp(-0.5), 1.0], rtol=1e-11)


@pytest.mark.parametrize(
    ("module", "texts"), [(MODULE, c_sources()[0]), (LAW_MODULE, law_sources())]
)
def test_the_modules_are_of_this_c(module, texts):
    assert page_file(module).endswith(digest_of(texts)), (
        "run: python -m generate explorer"
    )


def test_one_file_of_at_most_four_megabytes_that_asks_for_nothing():
    page = explorer_page(
        Surface.named("concrete"), title="</script><img src=x onerror=alert(1)>"
    )
    assert len(page.encode()) < 4e6
    assert "<img" not in page
    assert not re.search(r"<(link|script|img|iframe)[^>]*(src|href)=\"(?!data:)", page)
    assert "The MIT License" in page


def test_bad_requests_are_refused(tmp_path):
    out = tmp_path / "page.html"
    for words, said in (
        ("--surface concrete --theory greenwood_williamson", "the page has the theories"),
        ("--surface concrete --variant mine", "'mine' is not one of"),
        ("--hurst 0.8", "h_max"),
        ("", "one surface is needed"),
    ):
        assert said in refused("explore", *words.split(), "--out", str(out))
    assert not out.exists()
    with pytest.raises(InputError, match="one surface"):
        explorer_page(Surface(0.8, 1.0, [10.0, 20.0], 1.0, 3.0))
    q = np.geomspace(1, 100, 501)
    with pytest.raises(InputError, match="at most 500 samples"):
        explorer_page(Surface.from_spectrum(q, q**-3.6, h_max=1.0))


def test_a_slider_moves_curves_and_address_and_a_link_brings_them_back(visit):
    tab = visit("theory=calibrated&against=pressure&log=no&beside=persson")
    before = columns(tab)
    tab.evaluate(
        "const s = document.getElementById('slide-h_max'); s.value = 600; s.dispatchEvent(new Event('input'));"
    )
    moved = columns(tab)
    assert tab.input_value("#h_max") == "1.74338"
    assert (
        moved["calibrated mean_separation"] > before["calibrated mean_separation"]
    ).all()
    tab.wait_for_timeout(400)
    state = tab.evaluate("location.hash").lstrip("#")
    assert dict(urllib.parse.parse_qsl(state))["h_max"] == "1.74338"
    again = visit(state)
    assert again.input_value("#h_max") == "1.74338"
    assert not again.is_checked("#log")
    for name, values in columns(again).items():
        assert np.array_equal(values, moved[name], equal_nan=True), name
    again.click("button[type=reset]")
    assert again.input_value("#h_max") == "1.1"


def test_bad_numbers_are_told_beside_their_field(visit):
    tab = visit()
    for field, text, said in (
        ("hurst", "1.2", "H must be in (0, 1], got 1.2"),
        ("q1", "1e6", "longest must be more than 3 times shortest"),
        ("q1", "1e-12", "at most 1e8 times shortest"),
        ("hardness", "-2", "hardness must be positive, got -2"),
        ("nu", "0.7", "nu must be in (-1, 0.5], got 0.7"),
        ("h_rms", "-1", "h_rms must be positive, got -1"),
        ("E_star", "thirteen", "E_star must be a number"),
        ("spectrum", "1 2 3", "line 1"),
        ("spectrum", "1 1\n0.5 1", "q must rise"),
        ("spectrum", "1 1\n2 1", "a factor 3"),
    ):
        if field == "spectrum":
            tab.check("input[value=spectrum]")
        tab.fill(f"#{field}", text)
        assert said in tab.inner_text(f"#error-{field}")
        assert tab.is_disabled("#csv")
        if field != "spectrum":
            assert tab.get_attribute(f"#{field}", "aria-invalid") == "true"
            assert "stale" in (tab.locator("section").get_attribute("class") or "")
        tab.click("button[type=reset]")
        assert tab.inner_text(f"#error-{field}") == ""
        assert not tab.is_disabled("#csv")
    for state, field, said in (
        ("theory=hertz", "theory", "theory must be one of"),
        ("color=red", "theory", "nothing here"),
        ("variant=fitted&q1=2.5&theory=mbma", "q1", "more than 5.14 times shortest"),
    ):
        assert said in visit(state).inner_text(f"#error-{field}")


@pytest.mark.parametrize("against", ["gap", "pressure"])
@pytest.mark.parametrize("hardness", [0.05, 0.5, 5.0])
def test_a_hardness_is_that_of_the_library(visit, against, hardness):
    """In E* = 13.3 MPa on the road, whose rms gradient is near 1/2: plasticity indices from 100 to 1."""
    tab = visit()
    road = Surface.named("concrete")
    tab.evaluate(
        GO,
        urllib.parse.urlencode(
            {"theory": "calibrated", "against": against, "hardness": hardness}
        ),
    )
    found = columns(tab)
    gap = found["calibrated mean_separation"]
    seen = np.isfinite(gap) & np.isfinite(found["calibrated area"])
    assert seen.sum() > 20
    known = contact(
        road,
        Bodies(13.3, hardness=hardness, nu=0.3),
        mean_separation=gap[seen],
        theory="calibrated",
    )
    expected = {
        "pressure": known.pressure,
        "area": known.area,
        "stiffness": known.stiffness,
    }
    expected |= {"solid_conductance": 50 / 1e-3 / 13.3 * known.unloading_stiffness}
    expected |= {"tangential_stiffness": known.tangential_stiffness}
    for name, values in expected.items():
        # the area alone is at the elastic separation of a force, which the page iterates to 1e-7
        np.testing.assert_allclose(
            found[f"calibrated {name}"][seen],
            values,
            rtol=1e-6 if name == "area" else 1e-11,
            err_msg=name,
        )
    assert "Python library" in tab.inner_text("#concerns")
    # the road's spectrum is within the tested range, and only the hardness is not judged
    judged = {
        row.split("\t")[-1] for row in tab.locator("#readout tbody tr").all_inner_texts()
    }
    assert "not known" in judged
    assert "yes" not in judged
    tab.fill("#hardness", "")
    assert "Python library" not in tab.inner_text("#concerns")


SAMPLES = np.geomspace(0.2, 50, 60)
SPECTRUM = 0.01 * np.minimum(1, SAMPLES**-3.6)


def rows(q: np.ndarray, C: np.ndarray) -> str:
    return "\n".join(f"{x!r}, {y!r}" for x, y in zip(q.tolist(), C.tolist(), strict=True))


def test_a_pasted_spectrum_is_answered_as_the_library_does(visit):
    tab = visit()
    tab.check("input[value=spectrum]")
    assert "paste two columns" in tab.inner_text("#error-spectrum")
    tab.fill("#spectrum", rows(SAMPLES, SPECTRUM))
    found = columns(tab)
    surface = Surface.from_spectrum(SAMPLES, SPECTRUM, h_max=1.1)
    for theory in ("calibrated", "persson"):
        expected = contact(
            surface,
            13.3,
            mean_separation=found[f"{theory} mean_separation"],
            theory=theory,
        )
        for name in QUANTITIES:
            # the library's own law of a spectrum is within 1e-7
            np.testing.assert_allclose(
                found[f"{theory} {name}"], getattr(expected, name), rtol=1e-7
            )
    # in SurfaceTopography's convention
    tab.fill("#spectrum", rows(SAMPLES, 4 * np.pi**2 * SPECTRUM))
    tab.select_option("#convention", "isotropic")
    np.testing.assert_allclose(
        columns(tab)["calibrated pressure"], found["calibrated pressure"], rtol=1e-9
    )
    tab.select_option("#theory", "mbma")
    assert "needs five numbers" in tab.inner_text("#error-theory")


def test_a_map_is_taken_by_its_spectrum_which_the_page_says(opened, tmp_path):
    from generate.explorer import visit

    path = tmp_path / "map.html"
    surface = Surface.from_map(
        (0.04 * random_map(64, 0.024, 0.239, seed=8)) ** 3, 1.0, periodic=True
    )
    path.write_text(explorer_page(surface), encoding="utf-8")
    tab = visit(opened, path.as_uri())
    assert "goes by its heights" in tab.inner_text("#origin")
    assert tab.input_value("#theory") == "calibrated"
    assert surface.departures()
    for reason in surface.departures():
        assert reason in tab.inner_text("#concerns")
    tab.context.close()
    with pytest.raises(InputError, match="of five numbers"):
        explorer_page(surface, theory="mbma")


@pytest.mark.slow
@pytest.mark.parametrize("theory", ["mbma", "calibrated", "persson"])
def test_the_law_as_c_is_the_theory_and_names_the_librarys_own(theory, visit, tmp_path):
    if shutil.which("gcc") is None:
        pytest.skip("not installed: gcc")
    path = tmp_path / "page.c"
    own = tmp_path / "own.c"
    path.write_text(
        download(visit(f"theory={theory}&h_rms=0.25"), "#law"), encoding="ascii"
    )
    compiled = functools.partial(compiled_law, name="law")
    law = compiled(path, "-std=c99")
    surface = dataclasses.replace(Surface.named("concrete"), h_rms=0.25)
    c = float(surface.h_max) * np.exp(
        np.random.default_rng(3).uniform(np.log(1e-4), np.log(0.99), 300)
    )
    known = contact(surface, 13.3, mean_separation=surface.h_max - c, theory=theory)
    np.testing.assert_allclose(law("pressure", c), known.pressure, rtol=3e-8)
    np.testing.assert_allclose(law("area", c), known.area, rtol=3e-8)
    np.testing.assert_allclose(law("tangent", c), known.stiffness, rtol=3e-6)
    assert np.isnan(law("pressure", [1e-6, 2.0])).all()
    # the command in its header writes a law of the same functions
    command = re.search(r"mbma export (c-law .* --out) law.c", path.read_text())
    run("export", *command[1].split(), str(own))
    np.testing.assert_allclose(
        compiled(own)("pressure", c[c > 1e-3]), law("pressure", c[c > 1e-3]), rtol=1e-6
    )
    assert law("pressure", [-0.1, 0.0]).tolist() == [0.0, 0.0]


def press(tab, *keys):
    tab.locator(".chart").first.focus()
    for key in keys:
        tab.keyboard.press(key)


def test_numbers_under_the_cursor_by_keyboard(visit):
    tab = visit("theory=calibrated&beside=persson")
    press(tab, "End", "ArrowLeft")
    rows = tab.locator("#readout tr")
    assert rows.count() == 3
    assert rows.nth(0).inner_text().startswith("u = 1.078 mm")
    known = contact(
        Surface.named("concrete"), 13.3, mean_separation=1.078, theory="calibrated"
    )
    shown = float(rows.nth(1).locator("td").first.inner_text().split(" ±")[0])
    assert shown == pytest.approx(known.pressure, rel=1e-4)
    assert not known.valid
    assert "calibrated: A/A0 is below 0.001." in tab.inner_text("#concerns")


def test_concerns_are_those_of_the_library(visit):
    state = {
        "hurst": 0.15,
        "q0": 1.0,
        "q1": 500.0,
        "h_rms": 0.001,
        "h_max": 0.009,
        "theory": "calibrated",
    }
    tab = visit(urllib.parse.urlencode(state))
    said = tab.inner_text("#concerns")
    gap = float(tab.locator("#readout th").first.inner_text().split()[2])
    known = contact(
        Surface(*(state[name] for name in NAMES)),
        mean_separation=gap,
        theory="calibrated",
    ).reasons
    assert len(known) > 2
    for reason in known:
        assert reason.split(" (")[0] in said


def test_where_a_theory_has_no_answer_the_page_says_why(visit):
    steep = urllib.parse.urlencode(
        {"hurst": 0.1, "q0": 1, "q1": 1e7, "h_rms": 1, "h_max": 3, "theory": "mbma"}
    )
    for state, key, why in (
        (steep, "Home", "mu is above the range"),
        ("theory=mbma&against=pressure", "End", "it does not reach such a pressure"),
    ):
        tab = visit(state)
        press(tab, key)
        assert f"MBMA: has no answer here: {why}." in tab.inner_text("#concerns")


def test_on_a_phone_and_in_the_dark(visit, tmp_path):
    from matplotlib import image

    tab = visit(
        viewport={"width": 360, "height": 740},
        color_scheme="dark",
        has_touch=True,
        is_mobile=True,
    )
    assert tab.evaluate("document.documentElement.scrollWidth") <= 360
    assert tab.locator("canvas").count() == 5
    tab.screenshot(path=str(tmp_path / "dark.png"))
    picture = image.imread(tmp_path / "dark.png")[..., :3]
    assert np.median(picture) < 0.2
    assert (picture.max(axis=-1) > 0.6).mean() > 0.005


def test_titles_and_units_are_those_of_the_declarations(visit):
    """The page had names, titles and units of its own: "tangential", "thermal conductance"."""
    tab = visit()
    heads = tab.locator("#readout thead th").all()
    said = {
        cell.inner_text().partition(" [")[0].strip().replace(" ", "_"): cell
        for cell in heads[1:-1]
    }
    assert {"pressure", "solid_conductance", "tangential_stiffness"} <= set(said)
    for name, cell in said.items():
        declared = registry.get(name)
        assert cell.get_attribute("title") == declared.meaning
        unit = declared.unit_in(Units("mm", "MPa"))
        assert (f"[{unit}]" in cell.inner_text()) == (unit != "1")
