"""Laws as source code: equal to the library's law in each language, down to first contact."""

import ctypes
import functools
import importlib.util
import json
import math
import re
import shutil
import subprocess
import sys
import types

import law_points
import numpy as np
import pytest
from helpers import compiled_law, law_of_names, refusals
from law_points import ASKED, CONDUCTIVITY, KAPPA, VALUES, needs, points

from mbma_tables import Surface, contact
from mbma_tables.core import core
from mbma_tables.export import LAWS
from mbma_tables.export.code.core_code import core_text
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.code.law_code import asked_law, law_files, law_text, text_of
from mbma_tables.export.text import bound, core_file

SUBROUTINES = [target for target, language in LANGUAGES.items() if language.subroutine]
QUANTITIES = ("pressure", "tangent", "area", "energy", "leakage")
FIELDS = {"pressure": "p"}  # of points, where they have another name
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
STRICT = ("-std=c99", "-Wconversion", "-Wfloat-conversion", "-Wshadow")
HEAT = {"conductivity": CONDUCTIVITY, "conductivity_unit": "mW/(mm K)"}


def run(*command, folder, last_words=""):
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, timeout=300, check=False
    )
    assert (done.returncode, done.stderr.strip()) in ((0, ""), (0, last_words)), (
        done.stderr
    )
    return done.stdout


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laws")
    found = {}
    for name in ASKED:
        path = folder / f"{name}.c"
        asked = HEAT | {"kappa": KAPPA, "leakage": True}
        path.write_text(law_points.text("c-law", name, name="road", **asked))
        for level in ("-O3", "-O2"):
            found[name] = compiled_law(
                path, *STRICT, "-Wmissing-prototypes", "-Wstrict-prototypes", level
            )
    return found


@needs("gcc")
@pytest.mark.parametrize("name", ASKED)
def test_c(name, compiled):
    known = points(name)
    law = compiled[name]
    found = [law(quantity, known.c) for quantity in QUANTITIES]
    known.assert_equal(*found)
    known.assert_inverse(law("overclosure", known.pressures()))
    both = law.library.road_with_tangent
    both.restype, both.argtypes = (
        ctypes.c_double,
        [ctypes.c_double, ctypes.POINTER(ctypes.c_double)],
    )
    slope = ctypes.c_double()
    assert (both(float(known.c[0]), ctypes.byref(slope)), slope.value) == (
        found[0][0],
        found[1][0],
    )
    known.assert_slopes(
        *(law(what, known.c) for what in ("solid_conductance", "tangential_stiffness"))
    )


@needs("gcc")
@pytest.mark.parametrize("name", ASKED)
def test_c_outside_its_range(name, compiled):
    answer = compiled[name]
    law = points(name).law
    beyond = [math.nan, math.inf, 0.5 * (law.h_max - law.lowest) * (1 + 1e-9)]
    before = (
        []
        if math.isinf(law.highest)
        else [-math.inf, 0.5 * (law.h_max - law.highest) * (1 + 1e-9)]
    )
    for quantity in (*QUANTITIES, "curvature"):
        found = answer(quantity, [5e-324, 1e-320, 1e-310, 2.3e-308])
        assert np.isfinite(found).all(), quantity
        assert (found >= 0).all() or quantity == "curvature" or before, quantity
        assert np.isnan(answer(quantity, beyond + before)).all()
        if not before and quantity not in ("leakage", "curvature"):
            assert (answer(quantity, [0.0, -0.0, -1.0, -math.inf]) == 0).all()
    most = float(
        law.pressure(
            separation=law.lowest if law.turning_point is None else law.turning_point
        )
    )
    assert np.isnan(answer("overclosure", [-1.0, math.nan, math.inf, 1.01 * most])).all()
    assert before or answer("overclosure", [0.0]) == 0


@needs("gcc")
@pytest.mark.parametrize("name", ["mbma", "calibrated", "persson"])
def test_leakage_apart_and_where_gaps_close(name, compiled):
    law = points(name).law
    leakage = functools.partial(compiled[name], "leakage")
    apart = np.geomspace(1e-9, 1e3 if math.isinf(law.highest) else 26, 200)
    np.testing.assert_allclose(
        leakage(-apart), law.leakage(law.h_max + apart), rtol=VALUES
    )
    if name != "mbma":
        blocked = law.h_max - law.leakage.blocked_at
        assert (
            (leakage(blocked + np.array([-1e-12, 1e-12, 1e-3])) == 0)
            == [False, True, True]
        ).all()


def test_headers_say_what_is_there():
    assert tuple(LANGUAGES) == LAWS
    for target in LAWS:
        # the core has leakage in its header
        plain = law_points.text(target, "calibrated", **HEAT).replace(
            core_text("law"), ""
        )
        assert not any(word in plain.lower() for word in ("leakage", "@if", "@end"))
    text = " ".join(
        law_points.text("python-law", "calibrated", leakage=True).replace("#", "").split()
    )
    leakage = points("calibrated").law.leakage
    facts = (
        f"K is within {bound(leakage.error)} of that at the law's area",
        "one standard deviation of ln K: 0.1",
    )
    facts += f"c = {float(3 - leakage.blocked_at)!r} on", "leakage: A/A0 is above 0.3"
    assert all(fact in text for fact in facts)
    assert "import { pressure, with_tangent, curvature" in law_points.text(
        "javascript-law", "mbma"
    )
    text = law_points.text(
        "modelica-law", "calibrated", name="road", leakage=True, **HEAT
    )
    assert "overclosure(" not in text.partition("package")[0]
    for kind, unit in {
        "Overclosure": "mm",
        "Pressure": "MPa",
        "Tangent": "MPa/mm",
        "Energy": "MPa.mm",
    }.items():
        assert f'type {kind} = Real(unit = "{unit}");' in text
    assert 'output Real y(unit = "mm3");' in text


test_requests_that_are_refused = refusals(
    lambda target, law, options: law_points.text(target, law, **options),
    *(
        (target, "calibrated", HEAT | {"leakage": True}, "has no place for leakage")
        for target in SUBROUTINES
    ),
    *(
        (target, "mbma", {}, "conductance needs conductivity")
        for target in SUBROUTINES
        if "gapcon" in target
    ),
    ("c-law", "calibrated", {"kappa": 3.0}, "kappa must be"),
    ("cobol-law", "mbma", {}, "target must be one of"),
    ("c-law", "mbma", {"name": "1 x"}, "a name must be a letter"),
    (
        "fortran-law",
        "mbma",
        {"name": "Energy"},
        "which a function of the law needs for itself",
    ),
)


@needs("gcc")
@pytest.mark.parametrize("name", ["mbma", "calibrated", "hardened"])
def test_c_is_the_library(name, tmp_path):
    """The core's text as it is; compiled as the library is, it has the library's bits."""
    text = law_points.text("c-law", name, name="road", leakage=True)
    for file in ("mbma.h", "elementary.h", "law.c"):
        assert re.sub(r'(?m)^#include ".*"\n', "", core_file(file)) in text
    (tmp_path / "road.c").write_text(text)
    level = (
        core.__name__.partition("._")[2]
        .replace("x86_64_", "-march=x86-64-")
        .replace("plain", "-O3")
    )
    flags = (
        "-std=c11",
        "-O3",
        "-ffp-contract=off",
        "-fno-math-errno",
        "-fno-trapping-math",
        level,
    )
    answer = compiled_law(tmp_path / "road.c", *flags)
    known = points(name)
    for quantity in QUANTITIES:
        np.testing.assert_array_equal(
            answer(quantity, known.c), getattr(known, FIELDS.get(quantity, quantity))
        )


@needs("gcc")
def test_digits_next_to_first_contact(compiled):
    """An overclosure keeps its digits where a separation has none left: there pressure is a power of it."""
    functions = ("pressure", "tangent", "overclosure")
    pressure, tangent, inverse = (
        functools.partial(compiled["mbma"], what) for what in functions
    )
    c = np.geomspace(1e-70, 1e-14, 100)
    np.testing.assert_allclose(c * tangent(c) / pressure(c), 3.5, rtol=1e-6)
    np.testing.assert_allclose(inverse(pressure(c)), c, rtol=1e-14)
    assert (inverse(np.array([5e-324, 1e-310, 1e-200])) > 0).all()


@needs("gcc", "g++")
def test_two_laws_with_headers_in_c_and_cpp(tmp_path):
    for name, law in {"road": "mbma", "seal": "persson"}.items():
        surface, asked = ASKED[law]
        files = law_files(
            "c-law", surface, "13.3 MPa", name=name, leakage=True, **HEAT, **asked
        )
        (tmp_path / f"{name}.c").write_text(files[""])
        (tmp_path / f"{name}.h").write_text(files[".h"])
    (tmp_path / "uinter.c").write_text(law_points.text("abaqus-uinter", "mbma", **HEAT))
    asks = "road_with_tangent(1.0, &k), road_leakage(1.0), road_solid_conductance(1.0), road_overclosure(0.01), seal_area(0.5)"
    text = '#include "road.h"\n#include "seal.h"\n#include "road.h"\n#include <stdio.h>\nint main(void) { double k; '
    (tmp_path / "ask.c").write_text(
        f'{text}printf("%.17g %.17g %.17g %.17g %.17g", {asks}); return 0; }}\n'
    )
    law = points("mbma").law
    seal = points("persson").law
    known = [
        law.pressure(2.0),
        law.leakage(2.0),
        CONDUCTIVITY / 13.3 * law.stiffness(2.0),
    ]
    known += [3 - law.at_pressure(0.01).mean_separation, seal.area(2.5)]
    for compiler in (("gcc", "-std=c99"), ("g++", "-x", "c++", "-std=c++11")):
        run(
            *compiler,
            *WARNINGS,
            "-c",
            "road.c",
            "seal.c",
            "uinter.c",
            "ask.c",
            folder=tmp_path,
        )
        run(compiler[0], "road.o", "seal.o", "ask.o", "-lm", "-o", "ask", folder=tmp_path)
        np.testing.assert_allclose(
            np.array(run("./ask", folder=tmp_path).split(), float), known, rtol=1e-11
        )


FORTRAN = """program ask
  use, intrinsic :: iso_fortran_env, only: dp => real64
  use road
  implicit none
  real(dp) :: c, p, slope
  integer :: status
  open (10, file="c.txt")
  open (11, file="values.txt")
  do
    read (10, *, iostat=status) c
    if (status /= 0) exit
    call with_tangent(c, p, slope)
    write (11, "(5es25.16e3)") pressure(c), tangent(c), area(c), energy(c), leakage(c)
    if (p < pressure(c) .or. slope < tangent(c)) error stop
  end do
  open (12, file="p.txt")
  open (13, file="inverse.txt")
  do
    read (12, *, iostat=status) p
    if (status /= 0) exit
    write (13, "(es25.16e3)") overclosure(p)
  end do
  ! of an overclosure beyond the range there is no answer
  if (pressure(1e9_dp) >= 0 .or. area(1e9_dp) >= 0 .or. overclosure(1e9_dp) >= 0 .or. leakage(1e9_dp) >= 0) error stop
  ! functions are elemental
  if (any(abs(pressure([0.5_dp, 1.0_dp]) - [pressure(0.5_dp), pressure(1.0_dp)]) > 0)) error stop
end program
"""


NODE = """
import { readFileSync, writeFileSync } from "node:fs";
import { pressure, tangent, with_tangent, area, energy, overclosure, leakage } from "./road.mjs";
const lines = (name) => readFileSync(name, "utf8").trim().split("\\n").map(Number);
const both = (c) => with_tangent(c).join() === `${pressure(c)},${tangent(c)}`;
const values = lines("c.txt").map((c) => [pressure(c), tangent(c), area(c), energy(c), leakage(c)].join(" "));
writeFileSync("values.txt", values.join("\\n"));
writeFileSync("inverse.txt", lines("p.txt").map(overclosure).join("\\n"));
const fault = (ask) => { try { ask(); return "none"; } catch (found) { return found.name; } };
const asks = [() => pressure("1"), () => area(NaN), () => tangent(1e9), () => overclosure(-1), () => leakage()];
console.log(both(1e-3), ...asks.map(fault));
"""


@pytest.mark.parametrize("name", ASKED)
def test_python(name, tmp_path):
    known = points(name)
    road = types.ModuleType("road")
    heat = {} if name == "hardened" else HEAT
    (tmp_path / "road.py").write_text(
        law_points.text("python-law", name, leakage=True, **heat)
    )
    exec(compile((tmp_path / "road.py").read_text(), "road.py", "exec"), road.__dict__)
    known.assert_equal(*(getattr(road, what)(known.c) for what in QUANTITIES))
    known.assert_inverse(road.overclosure(known.pressures()))
    turns = (
        known.law.turning_point is not None
        and known.law.turning_point > known.law.lowest + 1e-9 * known.law.h_max
    )
    assert (
        "where pressure turns down"
        in " ".join((tmp_path / "road.py").read_text().replace("#", "").split())
    ) == turns
    if heat:
        np.testing.assert_allclose(
            road.solid_conductance(known.c),
            CONDUCTIVITY / 13.3 * road.tangent(known.c),
            rtol=1e-15,
        )
    assert road.pressure(known.c[:6].reshape(2, 3)).shape == (2, 3)
    assert float(road.pressure(float(known.c[0]))) == road.pressure(known.c)[0]
    assert not np.isnan(road.leakage(known.c)).any()
    for bad in ([1.0, 1e9], math.nan, math.inf):
        with pytest.raises(ValueError, match=r"overclosure must be in \[.*\] mm, got"):
            road.pressure(bad)
    with pytest.raises(ValueError, match=r"pressure must be in \[.*\] MPa, got"):
        road.overclosure(1e9)
    if name == "calibrated":  # numpy is all that it needs
        code = "import sys, road; print(sorted({'scipy', 'numba', 'mbma_tables'} & sys.modules.keys()))"
        assert run(sys.executable, "-c", code, folder=tmp_path) == "[]\n"


@pytest.mark.parametrize("hardness", [0.02, 0.6, 5.0])
def test_the_flow_of_a_yielded_seal_is_not_zero_where_the_elastic_one_is_blocked(
    hardness,
):
    made = law_of_names(
        law_points.ROAD, "13.3 MPa", theory="calibrated", hardness=hardness
    )
    text = law_text(
        "python-law", law_points.ROAD, "13.3 MPa", theory="calibrated",
        hardness=hardness, leakage=True,
    )  # fmt: skip
    road = types.ModuleType("road")
    exec(text, road.__dict__)
    blocked_at = made.leakage.blocked_at
    assert (made.area(blocked_at) > 0.5) == (hardness == 0.02)
    c = 3.0 - np.geomspace(1e-5, 2.9, 2001)
    known = np.asarray(made.leakage(3.0 - c))
    np.testing.assert_allclose(road.leakage(c), known, rtol=VALUES, atol=1e-12)
    assert ((known == 0) == (3.0 - c <= blocked_at)).all()
    listed = " ".join(text.replace("#", " ").split())
    assert "K is not known" not in listed
    assert "blocked, K = 0, from" in listed


def random_faces(count, seed):
    """Surfaces of any size, whose h_max is a dyadic number times h_rms."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        q0 = 10.0 ** rng.uniform(-4, 4)
        h_rms = 2.0 ** rng.integers(-8, 8)
        q1 = q0 * 10 ** rng.uniform(0.6, 6)
        h_max = h_rms * rng.integers(20, 48) / 8
        yield Surface(rng.uniform(0.1, 1.0), q0, q1, h_rms, h_max, unit="um")


OF_POLYNOMIALS = ("python-law", "jax-law", "matlab-law", "modelica-law")


@pytest.mark.slow
def test_laws_of_any_modulus_are_written():
    """A pressure near the smallest double is a number like any other, in each of the languages of polynomials."""
    rng = np.random.default_rng(53)
    for surface in random_faces(5, 53):
        modulus = 10.0 ** rng.uniform(-300, 3)
        made = asked_law(
            surface, modulus, theory="greenwood_williamson", stress_unit="GPa"
        )
        texts = {target: text_of(target, made) for target in OF_POLYNOMIALS}
        road = types.ModuleType("road")
        exec(texts["python-law"], road.__dict__)
        c = surface.h_max * np.arange(1, 64) / 64
        known = contact(
            surface,
            modulus,
            mean_separation=surface.h_max - c,
            theory="greenwood_williamson",
        )
        # doubles near the smallest one have fewer digits, in the polynomials too
        np.testing.assert_allclose(
            road.pressure(c), known.pressure, rtol=1e-7, atol=1e-290
        )


JAX = """
import jax, json, sys
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp, numpy as np, road
c, p = np.loadtxt("c.txt"), np.loadtxt("p.txt")
slope = jax.jit(jax.vmap(jax.grad(road.pressure)))(c)
values = np.stack([jax.jit(road.pressure)(c), slope, road.area(c), jax.vmap(road.energy)(c), road.leakage(c)], axis=-1)
np.savetxt("values.txt", values, "%.17g")
np.savetxt("inverse.txt", jax.jit(road.overclosure)(p), "%.17g")
by_law = jax.grad(lambda law: road.pressure(c[0], law))(road.LAW)
assert jax.tree.structure(by_law) == jax.tree.structure(road.LAW)
inverse = jax.vmap(jax.grad(road.overclosure))(p[:100])
assert jnp.abs(inverse * road.tangent(road.overclosure(p[:100])) - 1).max() < 1e-9
assert jnp.abs(jax.vmap(jax.grad(road.energy))(c[:100]) / road.pressure(c[:100]) - 1).max() < 1e-9
asked = [road.pressure, road.tangent, road.energy, road.area, road.leakage]
beyond = [jax.value_and_grad(f)(x) for f in asked for x in (1e9, float("nan"))]
print(bool(jnp.isnan(jnp.array([*beyond, jax.value_and_grad(road.overclosure)(1e9)])).all()))
below, at, above = (float(jax.grad(road.leakage)(c)) for c in (-1e-9, 0.0, 1e-9))
assert abs(above / at - 1) < 1e-6 and abs(below / at - 1) < 0.2
"""


OCTAVE = """
road = road(); c = load('c.txt'); p = load('p.txt');
values = [road.pressure(c), road.tangent(c), road.area(c), road.energy(c), road.leakage(c)];
file = fopen('values.txt', 'w'); fprintf(file, '%.17g %.17g %.17g %.17g %.17g\\n', values'); fclose(file);
file = fopen('inverse.txt', 'w'); fprintf(file, '%.17g\\n', road.overclosure(p)); fclose(file);
if ~isequal(size(road.pressure(c(1:6)')), [1, 6]), error('shape'), end
try, road.pressure(1e9); catch fault, disp(fault.message), end
"""


# what 7.3 says at its end after a caught error
OCTAVE_ENDS = "error: ignoring const execution_exception& while preparing to exit"
STRICT_FORTRAN = "gfortran -std=f2008 -Wall -Wextra -Wpedantic -Werror -fcheck=all -O1 road_c.o road.f90 ask.f90 -o ask"
# what a program needs, itself, the end of its files, commands, and what it says
LANGUAGE = {
    "fortran-law": ("gfortran", FORTRAN, "f90", ("gcc -std=c99 -O1 -c road_c.c", STRICT_FORTRAN, "./ask"), ""),
    "javascript-law": ("node", NODE, "mjs", ("node ask.mjs",),
                       "true TypeError TypeError RangeError RangeError TypeError\n"),
    "jax-law": (sys.executable, JAX, "py", (f"{sys.executable} ask.py",), "True\n"),
    "matlab-law": ("octave-cli", OCTAVE, "m", ("octave-cli --no-init-file ask.m",),
                   "road: overclosure must be in ["),
}  # fmt: skip
SLOW = ("jax-law", "matlab-law")


@pytest.mark.parametrize("name", ["mbma", "calibrated", "persson", "hardened"])
@pytest.mark.parametrize(
    "target",
    [pytest.param(t, marks=pytest.mark.slow if t in SLOW else ()) for t in LANGUAGE],
)
def test_a_program_in_the_laws_language(target, name, tmp_path):
    program, text, end, commands, said = LANGUAGE[target]
    if shutil.which(program) is None or (
        target == "jax-law" and importlib.util.find_spec("jax") is None
    ):
        pytest.skip(f"not installed: {target}")
    heat = HEAT if (target, name) == ("fortran-law", "mbma") else {}
    known = points(name)
    law = law_points.text(target, name, name="road", leakage=True, **heat)
    (tmp_path / f"road.{end}").write_text(law)
    (tmp_path / f"ask.{end}").write_text(text)
    if target == "fortran-law":
        assert max(map(len, law.splitlines())) <= 132
        (tmp_path / "road_c.c").write_text(
            law_points.text("c-law", name, name="road", leakage=True, **heat)
        )
    np.savetxt(tmp_path / "c.txt", known.c, "%.17g")
    np.savetxt(tmp_path / "p.txt", known.pressures(), "%.17g")
    words = OCTAVE_ENDS if target == "matlab-law" else ""
    found = [
        run(*command.split(), folder=tmp_path, last_words=words) for command in commands
    ][-1]
    known.assert_equal(*np.loadtxt(tmp_path / "values.txt", ndmin=2).T)
    known.assert_inverse(np.loadtxt(tmp_path / "inverse.txt"))
    assert found.startswith(said)


# a solver's list of arguments, asked for each number of a file
PROGRAM = """program ask
  use, intrinsic :: iso_fortran_env, only: dp => real64
  implicit none
  character(len=80) :: ciname, slname, msname
  real(dp) :: temp(2) = [20.0_dp, 120.0_dp], predef(2, 1), time(2), coords(3), c
  integer :: status
  {declared}
  call get_command_argument(1, ciname)
  open (10, file="c.txt")
  open (11, file="values.txt")
  do
    read (10, *, iostat=status) c
    if (status /= 0) exit
    {asked}
  end do
end program

subroutine xit
  stop 7
end subroutine
"""
UINTER = PROGRAM.format(
    declared="""integer, parameter :: ndir = 3, nstatv = 2, npred = 1, nprops = 1, mcrd = 3
  real(dp) :: flux(2), stress(ndir), ddsddr(ndir, ndir), amki(ndir, ndir), amski(ndir, ndir), ddfddt(2, 2), &
    ddsddt(ndir, 2), ddfddr(2, ndir), statev(nstatv), sed, sfd, spd, svd, scd, pnewdt, rdisp(ndir), drdisp(ndir), &
    dtemp(2), dpred(2, npred), props(nprops), alocaldir(3, 3), drot(2, 2)
  integer :: lopenclose, lstate, lsdi""",
    asked="""rdisp = [c, 1.0_dp, 1.0_dp]
    stress = -1
    ddsddr = -1
    pnewdt = 1d36
    lopenclose = -1
    call uinter(stress, ddsddr, amki, amski, flux, ddfddt, ddsddt, ddfddr, statev, sed, sfd, spd, svd, scd, pnewdt, &
      rdisp, drdisp, temp, dtemp, predef, dpred, time, 1d0, 0d0, ciname, slname, msname, props, coords, alocaldir, &
      drot, 1d0, 1d0, 7, ndir, nstatv, npred, nprops, mcrd, 1, 1, 1, 0, lopenclose, lstate, lsdi, 0)
    write (11, "(12es25.16e3, i3)") stress(1), ddsddr(1, 1), sed, flux, ddfddt, ddfddr(:, 1), &
      sum(abs(stress(2:))) + sum(abs(ddsddr(2:, :))) + sum(abs(ddsddr(1, 2:))) + min(pnewdt, 1d0), lopenclose""",
)
GAPCON = PROGRAM.format(
    declared="real(dp) :: ak(5), d(2), flowm(2)",
    asked="""d = [0.0_dp, c]
    call gapcon(ak, d, flowm, temp, predef, time, ciname, slname, msname, coords, 1, 2, 1, 1, 1AREA)
    write (11, "(5es25.16e3)") ak""",
)


def called(target, program, name, folder, asked):
    """What a subroutine answers, called from a program in Fortran with its solver's list of arguments."""
    (folder / "road.c").write_text(law_points.text(target, name, name="road", **HEAT))
    (folder / "ask.f90").write_text(program)
    np.savetxt(folder / "c.txt", asked, "%.17g")
    run("gcc", *WARNINGS, *STRICT, "-O1", "-c", "road.c", folder=folder)
    fortran = ("gfortran", *WARNINGS, "-std=f2008", "-fcheck=all", "-O1")
    run(*fortran, "ask.f90", "road.o", "-lm", "-o", "ask", folder=folder)
    done = subprocess.run(
        ("./ask", "ROAD"), cwd=folder, capture_output=True, text=True, check=True
    )
    return *np.loadtxt(folder / "values.txt").T, done.stderr


def assert_slope(law, x, slope):
    """A subroutine's derivative is that of the library's law by differences, but for a few points where pieces meet."""
    difference = (law(x * (1 + 1e-5)) - law(x * (1 - 1e-5))) / (2e-5 * x)
    assert np.quantile(np.abs(slope - difference) / np.abs(law(x) / x), 0.99) < 1e-5


@needs("gfortran")
@pytest.mark.parametrize("name", ["mbma", "calibrated"])
def test_abaqus_uinter(name, tmp_path):
    known = points(name)
    c = np.concatenate([known.c, [0.0, -1e-3, -1e36, 5.0]])
    p, slope, energy, flux_1, flux_2, *others, opened, _ = called(
        "abaqus-uinter", UINTER, name, tmp_path, c
    )
    inside = slice(known.c.size)
    out = slice(known.c.size, None)
    known.assert_equal(
        p[inside], slope[inside], known.area, energy[inside], known.leakage
    )
    by_temperature = np.array(others[:4])
    by_gap = others[4:6]
    rest = others[6]
    heat = CONDUCTIVITY / 13.3 * known.tangent
    np.testing.assert_allclose(
        by_temperature[:, inside], np.outer([1, -1, -1, 1], heat), rtol=1e-11
    )
    np.testing.assert_allclose(flux_1[inside], 100 * heat, rtol=1e-11)
    assert (flux_1 == -flux_2).all()
    assert (by_gap[0] == -by_gap[1]).all()
    far = (known.c > 1e-3) & (known.c < 2.9)

    def flux(c):
        stiffness = known.law.stiffness(separation=known.law.h_max - 2 * c)
        return 100 * CONDUCTIVITY / 13.3 * stiffness

    assert_slope(flux, known.c[far], by_gap[0][inside][far])
    # no shear and no hint of a smaller step, but beyond the law, where the increment is to
    # be tried again
    assert (rest == [*np.ones(known.c.size + 3), 0.25]).all()
    assert (opened == [*np.ones(known.c.size), 0, 0, 0, 1]).all()
    assert (p[out][:3] == 0).all()


# what Abaqus does with a surface interaction: it hands over the stress and the energies of
# the beginning of an increment in each iteration, and keeps those of the last one
INCREMENTS = """program increments
  use, intrinsic :: iso_fortran_env, only: dp => real64
  implicit none
  integer, parameter :: ndir = NDIR, nstatv = 1, npred = 1, nprops = 1, mcrd = 3
  real(dp), parameter :: by = 1e-6_dp, spring = SPRING
  real(dp) :: begun(ndir), stress(ndir), tangent(ndir, ndir), numeric(ndir, ndir), place(ndir), moved(ndir)
  real(dp) :: wanted(ndir), rest(ndir), energies(2), kept(2), one(ndir), other(ndir), nothing(ndir, ndir)
  real(dp) :: residual(40)
  integer :: status, k, rounds
  character(len=8) :: kind
  begun = 0
  place = 0
  energies = 0
  open (10, file="steps.txt")
  open (11, file="values.txt")
  do
    read (10, *, iostat=status) kind, wanted
    if (status /= 0) exit
    moved = 0
    residual = 0
    if (kind == "place") then
      moved = wanted - place
      call ask(moved, stress, tangent, kept)
      rounds = 0
    else
      do rounds = 1, 40
        call ask(moved, stress, tangent, kept)
        rest = spring * (wanted - place - moved) - stress
        residual(rounds) = maxval(abs(rest))
        if (residual(rounds) < 1e-13_dp * spring * maxval(abs(wanted))) exit
        if (kind == "symmetry") tangent = (tangent + transpose(tangent)) / 2
        do k = 1, ndir
          tangent(k, k) = tangent(k, k) + spring
        end do
        moved = moved + solved(tangent, rest)
      end do
      call ask(moved, stress, tangent, kept)
    end if
    do k = 1, ndir
      moved(k) = moved(k) + by * 1e-3_dp
      call ask(moved, one, nothing, rest)
      moved(k) = moved(k) - 2e-3_dp * by
      call ask(moved, other, nothing, rest)
      moved(k) = moved(k) + by * 1e-3_dp
      numeric(:, k) = (one - other) / (2e-3_dp * by)
    end do
    begun = stress
    energies = kept
    place = place + moved
    write (11, "(*(es25.16e3))") place, stress, tangent, numeric, kept, real(rounds, dp), residual(1:8)
  end do
contains
  subroutine ask(moved, stress, tangent, kept)
    real(dp), intent(in) :: moved(ndir)
    real(dp), intent(out) :: stress(ndir), tangent(ndir, ndir), kept(:)
    real(dp) :: flux(2), amki(ndir, ndir), amski(ndir, ndir), ddfddt(2, 2), ddsddt(ndir, 2), ddfddr(2, ndir), &
      statev(nstatv), sed, sfd, spd, svd, scd, pnewdt, dtemp(2), dpred(2, npred), props(nprops), &
      alocaldir(3, 3), drot(2, 2), temp(2), predef(2, npred), time(2), coords(3)
    integer :: lopenclose, lstate, lsdi
    character(len=80) :: ciname, slname, msname
    ciname = "ROAD"
    temp = 0
    stress = begun
    sed = energies(1)
    sfd = energies(2)
    pnewdt = 1
    call uinter(stress, tangent, amki, amski, flux, ddfddt, ddsddt, ddfddr, statev, sed, sfd, spd, svd, scd, pnewdt, &
      place + moved, moved, temp, dtemp, predef, dpred, time, 1d0, 0d0, ciname, slname, msname, props, coords, &
      alocaldir, drot, 1d0, 1d0, 7, ndir, nstatv, npred, nprops, mcrd, 1, 1, 1, 0, lopenclose, lstate, lsdi, 0)
    kept = 0
    kept(1:2) = [sed, sfd]
  end subroutine
  function solved(matrix, right) result(x)
    real(dp), intent(in) :: matrix(ndir, ndir), right(ndir)
    real(dp) :: x(ndir), a(ndir, ndir + 1)
    integer :: i, j
    a(:, 1:ndir) = matrix
    a(:, ndir + 1) = right
    do i = 1, ndir
      a(i, :) = a(i, :) / a(i, i)
      do j = 1, ndir
        if (j /= i) a(j, :) = a(j, :) - a(j, i) * a(i, :)
      end do
    end do
    x = a(:, ndir + 1)
  end function
end program

subroutine xit
  stop 7
end subroutine
"""
RUBBED = 0.3
SPRING = 0.02  # MPa/mm, of the bodies that the driver presses together


def increments(steps, folder, name="calibrated"):
    """What the driver finds at the ends of increments, each by what is prescribed and its numbers."""
    ndir = len(steps[0]) - 1
    text = law_points.text(
        "abaqus-uinter", name, name="road", kappa=KAPPA, friction=RUBBED
    )
    (folder / "road.c").write_text(text)
    program = INCREMENTS.replace("NDIR", str(ndir)).replace("SPRING", f"{SPRING!r}_dp")
    (folder / "ask.f90").write_text(program)
    lines = [" ".join([step[0], *map(repr, step[1:])]) for step in steps]
    (folder / "steps.txt").write_text("\n".join(lines) + "\n")
    run("gcc", *WARNINGS, *STRICT, "-O1", "-c", "road.c", folder=folder)
    run("g++", "-x", "c++", *WARNINGS, "-fsyntax-only", "road.c", folder=folder)
    fortran = ("gfortran", *WARNINGS, "-std=f2008", "-fcheck=all", "-O1")
    run(*fortran, "ask.f90", "road.o", "-lm", "-o", "ask", folder=folder)
    run("./ask", folder=folder)
    rows = np.loadtxt(folder / "values.txt", ndmin=2)
    ends = np.cumsum([ndir, ndir, ndir**2, ndir**2, 2, 1])
    place, stress, tangent, numeric, energy, rounds, residual = np.split(rows, ends, 1)
    shape = (-1, ndir, ndir)
    # columns of Fortran
    matrices = [each.reshape(shape).transpose(0, 2, 1) for each in (tangent, numeric)]
    return place, stress, *matrices, energy, rounds[:, 0].astype(int), residual


def sheared(law, c, walk):
    """Pressure, shear stress, elastic and dissipated energy of a spring that slips, along a path."""
    sloped, factor = law.unloading()
    gap = law.h_max - 2 * c
    p = np.asarray(law.pressure(separation=gap))
    stiffness = factor * np.asarray(sloped.stiffness(separation=gap)) / KAPPA
    shear = np.zeros_like(walk)
    spent = np.zeros(c.size)
    elastic = np.array(law.values(separation=gap).energy)
    last, before, slips = np.zeros(walk.shape[1]), np.zeros(walk.shape[1]), 0
    for k in range(c.size):
        trial = last + stiffness[k] * (walk[k] - before)
        size = np.linalg.norm(trial)
        last = trial
        if size > RUBBED * p[k]:
            last = RUBBED * p[k] * trial / size
            slips += 1
        shear[k] = last
        spent[k] = spent[k - 1] if k else 0.0
        if stiffness[k] > 0:
            elastic[k] += last @ last / (2 * stiffness[k])
            spent[k] += last @ (trial - last) / stiffness[k]
        before = walk[k]
    return p, shear, elastic, spent, slips


@needs("gfortran", "gcc", "g++")
@pytest.mark.parametrize(("name", "directions"), [("calibrated", 1), ("hardened", 2)])
def test_uinter_sticks_and_slips_as_coulombs_law_says(name, directions, tmp_path):
    """A path of displacements: stress, tangent and energies are those of springs that slip, integrated by themselves."""
    rng = np.random.default_rng(63)
    law = points(name).law
    c = np.concatenate([[0.3], 0.3 + 0.1 * np.sin(np.arange(30) / 3), [-0.1, 0.2]])
    walk = 0.05 * np.cumsum(rng.uniform(-1, 1, (c.size, directions)), axis=0)
    steps = [("place", *row) for row in np.column_stack([c, walk]).tolist()]
    place, stress, tangent, numeric, energy, *_ = increments(steps, tmp_path, name)
    np.testing.assert_allclose(place[:, 0], c, rtol=1e-14)
    p, shear, elastic, spent, slips = sheared(law, c, walk)
    np.testing.assert_allclose(stress[:, 1:], shear, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(energy[:, 0], elastic, rtol=1e-9)
    np.testing.assert_allclose(energy[:, 1], spent, rtol=1e-9)
    assert 3 < slips < c.size - 3
    np.testing.assert_allclose(stress[:, 0], p, rtol=1e-12)
    scale = np.abs(numeric).max()
    np.testing.assert_allclose(tangent, numeric, atol=2e-6 * scale, rtol=2e-5)
    # apart there is nothing
    assert (tangent[c < 0] == 0).all()
    assert (stress[c < 0] == 0).all()


# all nodes of a surface at once, each with its own path; energies are written to, not added
EXPLICIT = """program explicit
  use, intrinsic :: iso_fortran_env, only: dp => real64
  implicit none
  integer, parameter :: nodes = NODES, ndir = NDIR, n = nodes, nprops = 1
  real(dp) :: stress(ndir, nodes), sed(n), sfd(n), scd(n), spd(n), svd(n), fluxslv(n), fluxmst(n), statev(1, n)
  real(dp) :: rdisp(ndir, n), drdisp(ndir, n), drot(2, 2, n), stiff(n), cond(n), shapes(4, n), coord(ndir, n)
  real(dp) :: local(ndir, ndir, n), props(nprops), area(n), temp(n), dtemp(n), predef(1, n), dpredef(1, n)
  integer :: status, uid(n), con(4, n)
  character(len=80) :: surfint, surfslv, surfmst
  call get_command_argument(1, surfint)
  rdisp = 0
  stress = 0
  open (10, file="steps.txt")
  open (11, file="values.txt")
  do
    drdisp = rdisp
    read (10, *, iostat=status) rdisp
    if (status /= 0) exit
    drdisp = rdisp - drdisp
    sed = -1
    sfd = -1
    call vuinter(sfd, scd, spd, svd, stress, fluxslv, fluxmst, sed, statev, 1, 1, 4, nodes, 4, 2, ndir, 1, nprops, 0, &
      1, n, uid, uid, con, 1d0, 1d0, 1d-6, surfint, surfslv, surfmst, rdisp, drdisp, drot, stiff, cond, shapes, coord, &
      coord, local, props, area, temp, dtemp, predef, dpredef, temp, dtemp, predef, dpredef)
    write (11, "(*(es25.16e3))") stress, sed, sfd
  end do
end program

subroutine xplb_exit
  stop 7
end subroutine
"""


@needs("gfortran", "gcc", "g++")
@pytest.mark.parametrize(("name", "directions"), [("calibrated", 1), ("hardened", 2)])
def test_vuinter_has_the_law_at_all_nodes(name, directions, tmp_path):
    rng = np.random.default_rng(64)
    law = points(name).law
    nodes, steps = 4, 30
    c = 0.3 + 0.1 * np.sin(np.arange(steps) / 3 + np.arange(nodes)[:, None])
    # one that lifts off and comes back
    c[-1, 10:15] = -0.1
    walk = 0.05 * np.cumsum(rng.uniform(-1, 1, (nodes, steps, directions)), axis=1)
    places = np.concatenate([c[..., None], walk], axis=2).transpose(1, 0, 2)
    np.savetxt(tmp_path / "steps.txt", places.reshape(steps, -1), "%.17g")
    asked = {"kappa": KAPPA, "friction": RUBBED}
    text = law_points.text("abaqus-vuinter", name, name="road", **asked)
    (tmp_path / "road.c").write_text(text)
    program = EXPLICIT.replace("NODES", str(nodes)).replace("NDIR", str(1 + directions))
    (tmp_path / "ask.f90").write_text(program)
    run("gcc", *WARNINGS, *STRICT, "-O1", "-c", "road.c", folder=tmp_path)
    run("g++", "-x", "c++", *WARNINGS, "-fsyntax-only", "road.c", folder=tmp_path)
    fortran = ("gfortran", *WARNINGS, "-std=f2008", "-fcheck=all", "-O1")
    run(*fortran, "ask.f90", "road.o", "-lm", "-o", "ask", folder=tmp_path)
    run("./ask", "ROAD", folder=tmp_path)
    rows = np.loadtxt(tmp_path / "values.txt")
    stress, sed, sfd = np.split(rows, [nodes * (1 + directions), -nodes], axis=1)
    stress = stress.reshape(steps, nodes, 1 + directions)
    for node in range(nodes):
        p, shear, elastic, spent, slips = sheared(law, c[node], walk[node])
        assert slips > 3
        np.testing.assert_allclose(stress[:, node, 0], p, rtol=1e-12)
        np.testing.assert_allclose(stress[:, node, 1:], shear, rtol=1e-9, atol=1e-14)
        np.testing.assert_allclose(sed[:, node], elastic, rtol=1e-9)
        np.testing.assert_allclose(np.cumsum(sfd[:, node]), spent, rtol=1e-9)
    done = subprocess.run(("./ask", "SEAL"), cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 7
    assert "no law for the surface interaction 'SEAL', only for 'ROAD'" in done.stderr


@needs("gfortran", "gcc", "g++")
def test_newton_converges_with_the_tangent_of_uinter(tmp_path):
    """Bodies that are pressed and moved until the point slips: quadratic with the tangent, slower with its symmetric part."""
    start, further = (0.6, 0.0, 0.0), (0.8, 1.0, 0.4)
    ends = {}
    for kind in ("spring", "symmetry"):
        folder = tmp_path / kind
        folder.mkdir()
        place, stress, *_, rounds, residual = increments(
            [("place", *start), (kind, *further)], folder
        )
        # it slips in equilibrium
        shear = np.hypot(*stress[1, 1:])
        assert shear == pytest.approx(RUBBED * stress[1, 0], rel=1e-10)
        pulled = SPRING * (np.array(further) - place[1])
        np.testing.assert_allclose(stress[1], pulled, rtol=1e-9)
        ends[kind] = place[1], int(rounds[1])
        if kind == "spring":
            errors = residual[1, : rounds[1] - 1] / residual[1, 0]
            late = errors[errors < 0.1]
            assert (late[1:] < 100 * late[:-1] ** 2 + 1e-11).all()
    np.testing.assert_allclose(ends["spring"][0], ends["symmetry"][0], rtol=1e-8)
    assert ends["spring"][1] <= 8 < ends["symmetry"][1]


@needs("gfortran")
@pytest.mark.parametrize(
    ("target", "more"), [("abaqus-gapcon", ""), ("calculix-gapcon", ", 1d0")]
)
@pytest.mark.parametrize("name", ["mbma", "calibrated"])
def test_gapcon(target, more, name, tmp_path):
    law = points(name).law
    pressure = np.geomspace(1e-9, 0.9, 2000) * points(name).pressures().max()
    asked = np.concatenate([pressure, [0.0, -1.0, 1e3, 2e3]])
    *found, said = called(target, GAPCON.replace("AREA", more), name, tmp_path, asked)
    found, none, beyond = np.split(np.array(found), [-4, -2], axis=1)
    # as the library's law inverts and differentiates
    np.testing.assert_allclose(
        found[0], CONDUCTIVITY / 13.3 * law.at_pressure(pressure).stiffness, rtol=1e-11
    )
    assert_slope(
        lambda p: CONDUCTIVITY / 13.3 * law.at_pressure(p).stiffness, pressure, found[2]
    )
    assert (found[[1, 3, 4]] == 0).all()
    assert (none == 0).all()
    # beyond the law it keeps its last value, and tells once
    last = CONDUCTIVITY / 13.3 * law.stiffness(separation=law.lowest)
    np.testing.assert_allclose(beyond, np.outer([1, 0, 0, 0, 0], [last, last]), rtol=1e-6)
    assert said.count("beyond the law's range") == 1
    text = " ".join((tmp_path / "road.c").read_text().replace("\n *", " ").split())
    for words in (
        "TYPE=SURFACE TO SURFACE",
        "PRESSURE-OVERCLOSURE=EXPONENTIAL or LINEAR",
        "-o gapcon.o, ar r ccx_",
    ):
        assert (words in text) == bool(more)


# a target, the program that calls it, and the status with which it ends a job
INTERACTIONS = {
    "abaqus-uinter": (UINTER, 7),
    "abaqus-gapcon": (GAPCON.replace("AREA", ""), 7),
    "calculix-gapcon": (GAPCON.replace("AREA", ", 1d0"), 201),
}
LISTED = 'INTERFACE("ROAD", road) INTERFACE("INTPROP-2", seal)'


def joined(how, routine, folder):
    """Object files of a job with the two laws road and seal, exported by themselves."""
    line = f"#define {routine}_INTERFACES {LISTED}\n"
    road, seal = ((folder / file).read_text() for file in ("road.c", "seal.c"))
    if how == "separate":
        (folder / "one.c").write_text(line + road)
        run("gcc", *WARNINGS, *STRICT, "-c", "one.c", folder=folder)
        run(
            "gcc",
            *WARNINGS,
            *STRICT,
            f"-D{routine}_ELSEWHERE",
            "-c",
            "seal.c",
            folder=folder,
        )
        return "one.o", "seal.o"
    both = road + seal if how == "copied" else '#include "road.c"\n#include "seal.c"\n'
    (folder / "job.c").write_text(line + both)
    compilers = {"included in C++": ("g++", "-x", "c++", "-std=c++11")}
    run(*compilers.get(how, ("gcc", *STRICT)), *WARNINGS, "-c", "job.c", folder=folder)
    return ("job.o",)


@needs("gfortran", "gcc", "g++")
@pytest.mark.parametrize("how", ["copied", "included", "included in C++", "separate"])
@pytest.mark.parametrize("target", INTERACTIONS)
def test_two_exported_laws_in_one_job_by_surface_interaction(target, how, tmp_path):
    """Each surface interaction has its own law, in capital letters or not; any other name stops the job."""
    program, stopped = INTERACTIONS[target]
    laws = {"road": "mbma", "seal": "calibrated"}
    for name, law in laws.items():
        (tmp_path / f"{name}.c").write_text(
            law_points.text(target, law, name=name, **HEAT)
        )
    objects = joined(how, LANGUAGES[target].subroutine.upper(), tmp_path)
    (tmp_path / "ask.f90").write_text(program)
    # overclosures, or pressures for conductance
    x = np.array([0.05, 0.4, 1.5]) if "uinter" in target else np.array([1e-5, 1e-3, 1e-2])
    np.savetxt(tmp_path / "c.txt", x, "%.17g")
    fortran = ("gfortran", *WARNINGS, "-std=f2008", "-fcheck=all")
    run(*fortran, "ask.f90", *objects, "-lm", "-o", "ask", folder=tmp_path)
    for interaction, name in {
        "ROAD": "road",
        "INTPROP-2": "seal",
        "IntProp-2": "seal",
    }.items():
        run("./ask", interaction, folder=tmp_path)
        values = np.loadtxt(tmp_path / "values.txt")[:, 0]
        law = points(laws[name]).law
        if "uinter" in target:
            expected = law.pressure(separation=law.h_max - 2 * x)
        else:
            expected = CONDUCTIVITY / 13.3 * law.at_pressure(x).stiffness
        np.testing.assert_allclose(values, expected, rtol=1e-11)
    for unknown in ("SEAL", "ROAD2", "ROA", "INTPROP-2" + 72 * "X", ""):
        done = subprocess.run(
            ("./ask", unknown), cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == stopped
        assert (
            f"no law for the surface interaction '{unknown[:80]}', only for 'ROAD' 'INTPROP-2'"
            in done.stderr
        )


@needs("gcc")
@pytest.mark.parametrize("target", INTERACTIONS)
def test_several_laws_in_one_file_without_a_list_do_not_compile(target, tmp_path):
    """A law that no surface interaction could reach is an error of the compiler; so are laws of different versions."""
    texts = [
        law_points.text(target, law, name=law, **HEAT) for law in ("mbma", "persson")
    ]
    of_another_version = re.sub(r"(MBMA_LAW_CODE (?:!= )?)0x\w+", r"\g<1>0x1", texts[1])
    routine = LANGUAGES[target].subroutine.upper()
    listed = f'#define {routine}_INTERFACES INTERFACE("MBMA", mbma) INTERFACE("PERSSON", persson)\n'
    refused = {"several laws in one file": "".join(texts)}
    refused["laws of different versions"] = listed + texts[0] + of_another_version
    for message, text in refused.items():
        (tmp_path / "job.c").write_text(text)
        command = ("gcc", "-fsyntax-only", "job.c")
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode != 0
        assert message in done.stderr


MODELICA = """
package asked
  constant Real gaps[{size}] = {{{gaps}}};
  function at
    input Real time_;
    output Real c;
  protected
    Integer k;
  algorithm
    k := integer(floor(time_ + 1.5));
    c := gaps[k];
  end at;
end asked;
model Ask
  Real c; Real p; Real k; Real h; Real s; Real a; Real e; Real l;
equation
  c = asked.at(time); p = road.pressure(c); h = road.solid_conductance(c); a = road.area(c); e = road.energy(c);
  l = road.leakage(c); k = road.tangent(c); s = road.tangential_stiffness(c);
end Ask;
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["mbma", "calibrated", "hardened"])
def test_modelica(name, tmp_path):
    rumoca = pytest.importorskip("rumoca")
    known = points(name)
    assert np.isfinite(known.leakage).all()
    text = law_points.text(
        "modelica-law", name, name="road", leakage=True, kappa=KAPPA, **HEAT
    )
    answers = []
    for k, c in enumerate(np.array_split(known.c, 25)):
        asks = MODELICA.format(size=c.size, gaps=", ".join(map(repr, c.tolist())))
        (tmp_path / f"{k}").mkdir()
        (tmp_path / f"{k}" / "ask.mo").write_text(text + asks)
        model = rumoca.Session().load(str(tmp_path / f"{k}" / "ask.mo"), model="Ask")
        found = model.simulate(t=(0, c.size - 1), dt=1)
        assert (np.asarray(found["c"]) == c).all()
        answers.append([found[what] for what in ("h", "s", "p", "k", "a", "e", "l")])
    conductance, sheared, *others = np.concatenate(answers, axis=1)
    known.assert_equal(*others, close=1e-9)
    known.assert_slopes(conductance, sheared)


@needs("gcc")
def test_c_of_a_polynomial_over_many_decades(tmp_path):
    surface = Surface(0.3, 1.0, 3.5, 0.125, 0.125, unit="mm")
    asked = {"theory": "mbma", "hardness": "0.06 MPa"}
    (tmp_path / "law.c").write_text(
        law_text("c-law", surface, "1 MPa", name="road", **asked)
    )
    u = 0.125 * (1 - np.geomspace(1e-12, 1, 500)[:-1])
    found = compiled_law(tmp_path / "law.c", *STRICT)("pressure", 0.125 - u)
    np.testing.assert_allclose(
        found, law_of_names(surface, "1 MPa", **asked).pressure(u), rtol=1e-10
    )


@pytest.mark.parametrize("target", LAWS)
def test_a_unit_never_becomes_code(target):
    hostile = 'W */ int evil(void); /* {{ NAME }} {name} """ system(\'evil\') <!-- %'
    mark = LANGUAGES[target].mark
    live = [
        [
            line
            for line in text.splitlines()
            if not line.startswith((mark, " *") if mark == "/*" else mark)
        ]
        for text in (
            law_points.text(
                target, "calibrated", conductivity=1.0, conductivity_unit=unit
            )
            for unit in (hostile, "W")
        )
    ]
    assert live[0] == live[1]
    assert len(live[0]) > 40


@pytest.mark.parametrize("more", [{}, {"leakage": True, **HEAT}])
def test_types_of_a_law_in_javascript(more):
    files = law_files("javascript-law", ASKED["mbma"][0], "13.3 MPa", name="road", **more)
    assert sorted(files) == ["", ".cjs", ".d.cts", ".d.mts"]
    for module, types_, begin in (
        ("", ".d.mts", "export"),
        (".cjs", ".d.cts", "module.exports ="),
    ):
        exported = files[module].partition(f"\n{begin} {{")[2].rpartition("}")[0]
        typed = re.findall(
            r"^export function (\w+)\(\w: number\): ", files[types_], flags=re.M
        )
        assert sorted(typed) == sorted(re.findall(r"\w+", exported))


def javascript_files(folder):
    """A law as modules of both kinds, and the overclosures at which it is asked."""
    surface, asked = ASKED["calibrated"]
    files = law_files("javascript-law", surface, "13.3 MPa", name="road", **HEAT, **asked)
    for end, text in files.items():
        (folder / f"road{end or '.mjs'}").write_text(text)
    return [0.01, 0.5, 1.0, 2.5]


ASK_BOTH = """
const answers = (road, c) => [
  road.pressure(c), ...road.with_tangent(c), road.tangent(c), road.curvature(c), road.solid_conductance(c),
];
console.log(JSON.stringify(%s.map((c) => answers(road, c))));
"""


@needs("node")
@pytest.mark.parametrize(
    ("program", "opens"),
    [
        ("ask.mjs", 'import * as road from "./road.mjs";'),
        ("ask.mjs", 'import road from "./road.cjs";'),
        ("ask.mjs", 'const road = await import("./road.mjs");'),
        ("ask.cjs", 'const road = require("./road.cjs");'),
        ("ask.js", 'const road = require("./road");'),
    ],
)
def test_node_opens_a_law_by_import_and_by_require(program, opens, tmp_path):
    c = javascript_files(tmp_path)
    (tmp_path / "package.json").write_text("{}")
    (tmp_path / "road.js").write_text('module.exports = require("./road.cjs");')
    (tmp_path / program).write_text(opens + ASK_BOTH % c)
    answers = np.array(json.loads(run("node", program, folder=tmp_path)))
    law = points("calibrated").law
    gaps = law.h_max - np.array(c)
    pressure, tangent = law.pressure_and_stiffness(gaps)
    curvature = (law.stiffness(gaps - 1e-5) - law.stiffness(gaps + 1e-5)) / 2e-5
    known = [
        pressure,
        pressure,
        tangent,
        tangent,
        curvature,
        CONDUCTIVITY / 13.3 * tangent,
    ]
    np.testing.assert_allclose(answers.T, known, rtol=1e-6)
    assert "await" not in (tmp_path / "road.mjs").read_text()


TYPED = """
const pressure: number = road.pressure(0.2);
const both: [number, number] = road.with_tangent(0.2);
const more: number[] = [road.curvature(0.2), road.solid_conductance(0.2), road.overclosure(pressure), ...both];
export { more };
"""


@pytest.mark.slow
@needs("tsc")
def test_typescript_compiles_both_modules(tmp_path):
    javascript_files(tmp_path)
    (tmp_path / "ask.mts").write_text('import * as road from "./road.mjs";' + TYPED)
    (tmp_path / "ask.cts").write_text('import * as road from "./road.cjs";' + TYPED)
    options = (
        "--strict --noEmit --module node16 --moduleResolution node16 --target es2020"
    )
    run("tsc", *options.split(), "ask.mts", "ask.cts", folder=tmp_path)
    # types are checked: an answer is no text
    (tmp_path / "wrong.mts").write_text(
        'import { tangent } from "./road.mjs";\nconst text: string = tangent(0.2);\n'
    )
    wrong = subprocess.run(
        ["tsc", *options.split(), "wrong.mts"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert "'number' is not assignable to type 'string'" in wrong.stdout


@pytest.mark.parametrize(
    "target",
    [
        "c-law",
        "javascript-law",
        "python-law",
        "matlab-law",
        "modelica-law",
        "fortran-law",
    ],
)
def test_headers_name_functions_that_are_there(target):
    head, _, text = law_points.text(target, "calibrated", name="road", **HEAT).partition(
        "Example: "
    )
    lines = " ".join(line.strip("*/!#%; ") for line in text.splitlines()[:4])
    called = re.findall(r"(?:road[._]|law\.)?(\w+)\([\d.]", lines)
    assert len(called) >= 2
    for name in called:
        assert re.search(
            rf"(?:function|def|const|double|kept\.|export) ?(?:road_)?{name}\b", text
        )
    assert "{{" not in head
