"""Laws in every language of the registry: random laws, run back and compared with the library's within what they state."""

import math
import shutil
import subprocess
import sys

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st
from law_points import KAPPA, TANGENTS, VALUES

from benchmarks import programs
from mbma_tables import Bodies, Gas, Surface
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import Interface
from mbma_tables.core import core
from mbma_tables.export.code.curves import curve_of_gas
from mbma_tables.export.code.language import FUNCTIONS, evaluator
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.code.law_code import asked_law, text_of
from mbma_tables.export.exported_law import GasInGaps, exported_law
from mbma_tables.export.text import core_file

HEAT = {"conductivity": 45.0, "conductivity_unit": "W/(m K)"}
MORE = ("thermal_time", "mean_pressure", "flow_coefficient", "elastic_hardness")
POINTS = 60
SLOW = ("jax-law", "matlab-law", "modelica-law")
QUICK = ("c-law", "javascript-law", "python-law")
# laws a language; a program of the slow ones takes seconds to tens of seconds
EXAMPLES = dict.fromkeys(LANGUAGES, 4) | dict.fromkeys(SLOW, 2)


@pytest.fixture(autouse=True)
def _thermal_time(monkeypatch):
    """A quantity that is declared in a file of its own, beside the tests of the registry."""
    folder = __file__.rpartition("/export/")[0] + "/contacts/quantities"
    monkeypatch.syspath_prepend(folder)
    monkeypatch.setattr(registry, "MODULES", [*registry.MODULES, "thermal_time"])


@pytest.mark.parametrize("target", LANGUAGES)
def test_an_evaluator_is_a_plain_file_that_its_own_tools_check(target, tmp_path):
    language = LANGUAGES[target]
    if not language.check:
        assert not language.evaluator
        return
    if language.check[0] != "python" and shutil.which(language.check[0]) is None:
        pytest.skip(f"not installed: {language.check[0]}")
    for module in language.program.modules:
        pytest.importorskip(module)
    path = tmp_path / language.evaluator
    path.write_text(evaluator(language.evaluator))
    for header in ("mbma.h", "elementary.h"):
        (tmp_path / header).write_text(core_file(header))
    command = [sys.executable if word == "python" else word for word in language.check]
    for text, is_right in ((path.read_text(), True), (path.read_text() + "\n)(", False)):
        path.write_text(text)
        done = subprocess.run(
            [word.format(file=language.evaluator) for word in command],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert (done.returncode == 0) == is_right, done.stderr


# of these the error was stated too small, by up to 33 times
WITH_KINKS = (
    (Surface(0.87, 0.01, 1.2589254, 2.0**-5, 0.14453125, unit="um"), "persson", math.inf),
    (Surface(0.35, 10.0, 2511.886, 0.5, 1.4375, unit="um"), "calibrated", "1 GPa"),
    (Surface(0.91, 0.1, 12.589254, 16.0, 46.0, unit="um"), "mbma", "1 GPa"),
)


@pytest.mark.parametrize(("surface", "theory", "hardness"), WITH_KINKS)
def test_the_error_of_a_gas_holds_between_the_gaps_at_which_it_is_found(
    surface, theory, hardness
):
    bodies = Bodies("100 GPa", hardness=hardness)
    made = exported_law(surface, bodies, stress_unit="GPa", theory=theory)
    gas = GasInGaps(Gas("air"), 1e-6)
    curve = curve_of_gas(made, gas)
    law = made.law
    ends = law.lowest + 1e-9 * law.h_max, min(law.h_max, law.highest)
    d = np.random.default_rng(1).uniform(*ends, 20_000)
    written = np.empty(d.size)
    core.law_fill(d, curve.block, written, *[None] * 4)
    exact = gas.conductance(made.answer((law.h_max + d) / 2))
    first = gas.conductance(made.answer(np.array([law.h_max])))
    error = np.abs(written - curve.offset - exact) / np.maximum(exact, first)
    assert 0 < error.max() <= curve.error


@st.composite
def surfaces(draw):
    """Surfaces of any size, whose h_max is a dyadic number, so that c = (h_max - d)/2 is exact."""
    h_rms = 2.0 ** draw(st.integers(-6, 6))
    h_max = h_rms * draw(st.integers(20, 40)) / 8
    hurst = draw(st.floats(0.3, 0.95))
    q0 = 10.0 ** draw(st.floats(-3, 1))
    decades = draw(st.floats(0.8, 3.0))
    if draw(st.integers(0, 3)):
        return Surface(hurst, q0, q0 * 10**decades, h_rms, h_max, unit="um")
    rng = np.random.default_rng(draw(st.integers(0, 1000)))
    q = np.hypot(4 * np.fft.fftfreq(32)[:, None], 4 * np.fft.fftfreq(32)[None])
    noise = np.fft.fft2(rng.normal(size=(32, 32)))
    heights = np.fft.ifft2(np.where((q > 0.1) & (q < 1.0), noise, 0)).real
    return Surface.from_map(
        h_rms * heights / heights.std(), 1.0, periodic=True, unit="um"
    )


@st.composite
def asked_laws(draw):
    """Laws of spectra and maps by several theories, elastic and yielded, with all that a file may have."""
    surface = draw(surfaces())
    theories = ["calibrated", "persson"]
    if isinstance(surface, Surface):
        # MBMA refuses maps whose waves it does not resolve
        theories.append("mbma")
    theory = draw(st.sampled_from(theories))
    hardness = draw(st.sampled_from([math.inf, "1 GPa"]))
    options = {"theory": theory, "stress_unit": "GPa"}
    bodies = Bodies("100 GPa", hardness=hardness, conductivity=("45 W/(m K)",) * 2)
    gas = Gas(draw(st.sampled_from(["air", "helium"])))
    return surface, bodies, gas, options


def made(target, law):
    """The law of a file, with what its target takes."""
    surface, bodies, gas, options = law
    more = {**HEAT, "kappa": KAPPA, "gas": GasInGaps(gas, 1e-6)}
    if not LANGUAGES[target].subroutine:
        more |= {"leakage": True, "quantity": MORE, "interface": Interface(gas=gas)}
    return asked_law(surface, bodies, "road", **more, **options)


def known(asked, gas, name, c):
    """A quantity by the law of the library itself, and what errors are relative to."""
    exported = asked.exported
    law = exported.law
    d = law.h_max - 2 * c
    if name == "leakage":
        value = exported.leakage(separation=d)
        return value, np.abs(value)
    unloading = law.unloading()[0]
    slope = law.unloading()[1] * np.asarray(unloading.stiffness(separation=d))
    # about a maximum of pressure slopes are small
    scale = np.maximum(np.abs(slope), 1e-2 * np.asarray(law.pressure(separation=d)) / c)
    solid = asked.functions["solid_conductance"].ratio / law.unloading()[1]
    if name in ("gas_conductance", "total_conductance"):
        of_gas = GasInGaps(gas, 1e-6).conductance(exported.answer((law.h_max + d) / 2))
        first = GasInGaps(gas, 1e-6).conductance(exported.answer(np.array([law.h_max])))
        value = of_gas + (solid * slope if name == "total_conductance" else 0.0)
        # relative to first contact next to full contact
        return value, np.maximum(value, first)
    if name == "solid_conductance":
        return solid * slope, solid * scale
    if name == "tangential_stiffness":
        return slope / KAPPA, scale / KAPPA
    value = np.asarray(law.at(separation=d).quantity(name)) + 0 * c
    return value, np.abs(value)


def run(target, asked, names, c, folder):
    """What the program of a language answers, a row for each function."""
    program = LANGUAGES[target].program
    (folder / f"road{program.end}").write_text(text_of(target, asked))
    for file in LANGUAGES[target].beside:
        (folder / f"road{file.end}").write_text(
            text_of(file.target or target, asked, file)
        )
    return programs.run(program, names, c, folder)


def compared(target, law, folder):
    """The largest error of each function over what its file states."""
    asked = made(target, law)
    exported = asked.exported
    rng = np.random.default_rng(56)
    # dyadic shares of h_max
    most = int(min(exported.c_turn, exported.law.h_max) / exported.law.h_max * 2**20) - 1
    # of a map it is not dyadic, and gaps have fewer digits than overclosures next to contact
    least = 8 if (exported.law.h_max * 8) % 2.0**-6 == 0 else most // 8
    c = exported.law.h_max * rng.integers(least, most, POINTS) / 2**20
    end = min([curve.end for curve in asked.curves.values()], default=math.inf)
    # where the flow is blocked it is zero, or not known
    c = np.sort(c[c < min(end, exported.law.h_max - exported.leakage.blocked_at)])
    hypothesis.assume(c.size > 1)
    names = [name for name in FUNCTIONS if name not in ("with_tangent", "overclosure")]
    if LANGUAGES[target].array is not None:
        # languages of polynomials have none
        names.remove("curvature")
    names += list(asked.functions)
    found = dict(zip(names, run(target, asked, names, c, folder), strict=True))
    of_law = exported.law.values(separation=exported.law.h_max - 2 * c)
    for name in ("pressure", "area", "energy"):
        np.testing.assert_allclose(found[name], getattr(of_law, name), rtol=VALUES)
    scale = np.maximum(np.abs(of_law.stiffness), 1e-2 * of_law.pressure / c)
    assert np.abs((found["tangent"] - of_law.stiffness) / scale).max() <= TANGENTS
    shares = {}
    for name in asked.functions:
        value, size = known(asked, law[2], name, c)
        error = np.abs(found[name] - value)[size > 0] / size[size > 0]
        shares[name] = error.max(initial=0.0) / programs.stated(
            " ".join(asked.said), name
        )
        assert (found[name][size == 0] == 0).all(), name
    return shares


@pytest.mark.parametrize(
    "target",
    [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in LANGUAGES
    ],
)
def test_random_laws_are_run_back_within_their_stated_error(target, tmp_path_factory):
    program = LANGUAGES[target].program
    words = {command.split()[0] for command in program.commands} - {"python"}
    for word in words:
        if not word.startswith("./") and shutil.which(word) is None:
            pytest.skip(f"not installed: {word}")
    for module in program.modules:
        pytest.importorskip(module)

    @hypothesis.settings(
        max_examples=EXAMPLES[target],
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
        phases=[hypothesis.Phase.generate],
    )
    @hypothesis.given(asked_laws())
    def one(law):
        shares = compared(target, law, tmp_path_factory.mktemp("law"))
        assert max(shares.values()) <= 1, shares

    one()
