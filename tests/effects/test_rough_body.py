"""Rough spheres and cylinders: Hertz, Greenwood and Tripp's problem and remark, laws of force, and code of them."""

import ctypes
import functools
import math
import shutil
import subprocess

import numpy as np
import pytest

from generate.pages.simulations import spheres
from mbma_tables import (
    Adhesion,
    Bodies,
    InputError,
    OutOfRangeError,
    Surface,
    contact,
    greenwood_tripp,
    rough_contact,
)
from mbma_tables.bodies.adhesion import AdhesionInUnits
from mbma_tables.effects.attracting_body import AttractingBody
from mbma_tables.effects.force_law import plane_basis
from mbma_tables.effects.rough_contact import CELLS
from mbma_tables.export.code.law_code import law_files, law_text
from mbma_tables.export.registry import targets
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.islands.greenwood_tripp import height_integral
from mbma_tables.theories import Theory, TheoryAnswer, resolve
from mbma_tables.theories.adhesion import with_adhesion

FACE = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_smooth_bodies_are_hertz(shape):
    """The distance falls with the height of the roughness, to below 3e-4."""
    R = 1000.0
    E = 110.0
    before = np.inf
    for h_rms in (0.05, 0.005, 0.0005):
        face = Surface(0.8, 0.05, 1.5, h_rms, 3.5 * h_rms)
        found = rough_contact(face, R, E, shape=shape, approach=1.0, theory="calibrated")
        if shape == "sphere":
            a = math.sqrt(R)
            force = 4 / 3 * E * math.sqrt(R)
        else:  # Johnson (4.43), (5.57) of a cylinder on a rigid flat
            a = math.sqrt(4 * R * found.force / (math.pi * E))
            force = math.pi * E / (2 * math.log(4 * R / a) - 1)
        p0 = 2 * E * a / math.pi / R if shape == "sphere" else E * a / (2 * R)
        off = max(
            abs(
                np.log(
                    [
                        found.force / force,
                        found.contact_radius / a,
                        found.pressure[0] / p0,
                    ]
                )
            )
        )
        assert off < max(before / 3, 3e-4)
        before = off
    assert off < 3e-4


def test_the_plane_operator_is_that_of_the_logarithm():
    """Hertz's pressure has w = 1/2 + ln 2 - x^2 over a p0/E*, against a point at the distance a: Johnson (2.42)."""
    known = plane_basis(256)
    w = known.operator @ (np.sqrt(1 - known.v) * known.root_weights) / known.root_weights
    np.testing.assert_allclose(w, 0.5 + math.log(2) - known.v, atol=1e-5)


class Asperities(Theory):
    """Greenwood and Tripp's layer, with sigma 1 and L^2 = 2 R: p = mu/(2 L) F_3/2(d), u = d + ABOVE."""

    name = "asperities"
    ends_at_h_max = False
    ABOVE = 40.0

    def __init__(self, mu, L):
        self.strength = mu / 2 / L

    def answer(self, surface, mean_separation):
        d = np.asarray(mean_separation) - self.ABOVE
        force, area, slope = (height_integral(n, d) for n in (1.5, 1.0, 0.5))
        return TheoryAnswer(
            self.strength * force,
            1e-3 * area,
            1.5 * self.strength * slope,
            np.full(d.shape, 1e-13),
        )

    def interval(self, surface, quantity="pressure"):
        return np.asarray(0.0), np.asarray(self.ABOVE + 30)

    def pressed(self, R, X):
        face = Surface(0.8, 0.05, 1.5, 1.0, 7.0)
        return rough_contact(face, R, approach=np.asarray(X) - self.ABOVE, theory=self)


@pytest.mark.parametrize("mu", [1.0, 30.0])
def test_the_island_problem_by_another_solver(mu):
    R = 300.0
    X = np.array([-1.0, 3.0, 8.0])
    L = math.sqrt(2 * R)
    found = Asperities(mu, L).pressed(R, X)
    np.testing.assert_allclose(
        found.force / L, greenwood_tripp.solve(X, mu).phi_F, rtol=1e-6
    )


@pytest.mark.parametrize("mu", [4.0, 17.0])
def test_the_published_limit_of_roughness(mu):
    """Up to alpha = sigma R/a0^2 = 0.05 Hertz is off by 7% at most (Greenwood, Johnson, Matsubara, Wear 100, 1984)."""
    R = 300.0
    X = np.array([5.0, 10.0, 20.0, 30.0])
    found = Asperities(mu, math.sqrt(2 * R)).pressed(R, X)
    a0 = np.cbrt(0.75 * found.force * R)
    alpha = R / a0**2
    p0 = 2 * a0 / math.pi / R
    assert alpha.min() < 0.05 < alpha.max()
    wider, lower = (
        np.interp(0.05, alpha[::-1], ratio[::-1])
        for ratio in (found.contact_radius / a0, found.pressure[:, 0] / p0)
    )
    assert 1.01 < wider < 1.07
    assert 0.93 < lower < 0.99


def test_force_laws_and_their_code(tmp_path):
    found = rough_contact(
        FACE, "5 mm", "110 GPa", approach=["-1 um", "0.5 um", "2 um"], theory="calibrated"
    )
    law = found.law(1e-4)
    for name in ("force", "stiffness", "area"):
        np.testing.assert_allclose(
            getattr(law, name)(found.approach), getattr(found, name), rtol=1e-3
        )
    np.testing.assert_allclose(
        law.approach([f"{value:.17g} N" for value in found.force]),
        found.approach,
        rtol=1e-5,
    )
    # the work is the integral of the force
    x = np.linspace(law.first, 1.0, 2001)
    assert law.energy(1.0) == pytest.approx(np.trapezoid(law.force(x), x), rel=1e-5)
    assert law.force(-3.0) == 0
    text = law_text("c-law", law, name="ball")
    assert "here pressure is the force [N], and A/A0 the real area [um^2]" in text
    assert "not valid below p = " in text
    if shutil.which("gcc"):
        (tmp_path / "ball.c").write_text(text)
        subprocess.run(
            ["gcc", "-O1", "-shared", "-fPIC", "ball.c", "-lm", "-o", "ball.so"],
            cwd=tmp_path,
            check=True,
        )
        code = ctypes.CDLL(str(tmp_path / "ball.so"))
        code.ball_pressure.restype, code.ball_pressure.argtypes = (
            ctypes.c_double,
            [ctypes.c_double],
        )
        assert code.ball_pressure(0.5 - law.first) == pytest.approx(
            float(law.force(0.5)), rel=1e-12
        )
    rows = describe_law(law, rows=20)
    assert (rows.y_name, rows.y_unit) == ("force", "N")
    assert targets()["csv"].files(rows)[""]
    with pytest.raises(InputError, match="CalculiX takes pressure"):
        targets()["calculix"].files(rows)
    for target, more in (
        ("abaqus-uinter", {}),
        ("c-law", {"leakage": True}),
        ("c-law", {"theory": "mbma"}),
    ):
        with pytest.raises(InputError):
            law_files(target, law, name="ball", **more)
    with pytest.raises(InputError, match="stress_unit"):
        law_text("c-law", rough_contact(FACE, 5e3, approach=1.0).law(1e-2))


@pytest.mark.parametrize("theory", ["persson", "mbma"])
def test_force_and_approach_are_inverse(theory):
    for shape, force in (
        ("sphere", ["10 mN", "0.05 kN"]),
        ("cylinder", ["10 N/m", "0.05 kN/mm"]),
    ):
        found = rough_contact(
            FACE, "5 mm", "110 GPa", shape=shape, force=force, theory=theory
        )
        np.testing.assert_allclose(found.force, [0.01, 50], rtol=1e-6)
        again = rough_contact(
            FACE, 5e3, 110.0, shape=shape, approach=found.approach, theory=theory
        )
        np.testing.assert_allclose(
            again.force * (1e-3 if shape == "sphere" else 1.0), found.force, rtol=1e-6
        )
        # the slope is that of the curve, and the profile adds up to the force
        step = 1e-4
        beside = rough_contact(
            FACE, 5e3, 110.0, shape=shape, approach=found.approach + step, theory=theory
        )
        np.testing.assert_allclose(
            (beside.force - again.force) / step, again.stiffness, rtol=1e-3
        )
        r = again.position
        p = again.pressure
        whole = np.trapezoid(2 * np.pi * r * p if shape == "sphere" else 2 * p, r)
        np.testing.assert_allclose(whole, again.force, rtol=2e-3)


def test_units_validity_and_what_is_refused(tmp_path):
    found = rough_contact(
        FACE, "5 mm", "110 GPa", force=["1 N", "100 N"], theory="calibrated"
    )
    data = found.to_dataset()
    assert data["force"].attrs["units"] == "N"
    assert data["pressure"].dims == ("load", "place")
    found.plot(tmp_path / "ball.svg")
    assert found.valid.all()
    assert 0 < 5 * found.scatter[1] < found.scatter[0] < 0.7
    unknown = Asperities(1.0, 30.0).pressed(300.0, 3.0)
    assert np.isnan(unknown.scatter)
    wide = rough_contact(FACE, 100.0, "110 GPa", approach=2.0, theory="calibrated")
    assert not wide.valid
    assert "tenth of the radius" in "".join(wide.reasons)
    asked = {"bodies": "110 GPa", "theory": "mbma"}
    for wrong, match in (
        ({"approach": -1.75}, "apart"),
        ({"approach": 1.0, "force": 1.0}, "exactly one of approach, force; got approach"),
        ({"force": "3 N/mm"}, "like '10 N'"),
        ({"force": -1.0}, "positive"),
        ({"force": [[1.0]]}, "number or a list"),
        ({"force": 1.0, "shape": "cube"}, "sphere"),
        ({"force": 1.0, "reference": 2.0}, "cylinder"),
        ({"approach": 500.0}, "where the law of 'mbma' ends"),
        ({"force": "2 kN"}, "where the law of 'mbma' ends"),
    ):
        with pytest.raises((InputError, OutOfRangeError), match=match):
            rough_contact(FACE, "5 mm", **{**asked, **wrong})
    with pytest.raises(InputError, match="E_star are known"):
        rough_contact(FACE, "5 mm", force="3 N")
    with pytest.raises(InputError, match="radius"):
        rough_contact(FACE, 0.1, force=1.0)


@pytest.mark.slow
def test_boundary_elements_of_rough_spheres():
    """The stated scatter covers 24 simulated spheres; wide contacts are near."""
    pytest.importorskip("pandas")
    seen = spheres()
    assert seen["off"].size == 96
    valid = seen["valid"] > 0
    assert valid.sum() > 50
    for sd, least in ((1, 0.6), (2, 0.9)):
        assert np.mean(np.abs(seen["force"] / seen["scatter"])[valid] < sd) > least
        assert (
            np.mean(np.abs(seen["off"] / (CELLS[0] / seen["width"] ** CELLS[1])) < sd)
            > least
        )
    wide = seen["width"] > 4.5
    assert np.abs(seen["off"][wide].mean()) < 0.1
    assert seen["off"][wide].std() < 0.2
    assert np.abs(seen["area"][wide].mean()) < 0.1
    assert np.abs(seen["mean_radius"][wide].mean()) < 0.1


# nearly smooth: the layer is a tenth of the range thick where it carries
SMOOTH = Surface(0.8, q0=10.0, q1=80.0, h_rms=0.02, h_max=0.07)
STICKY = Bodies(1.0, adhesion=Adhesion(0.02, 1.0))


@functools.cache
def work_of_parting():
    free = contact(SMOOTH, STICKY, pressure=0.0, theory="calibrated")
    return float(free.effective_work)


def attracted(radius, **given):
    return rough_contact(SMOOTH, radius, STICKY, theory="calibrated", **given)


@pytest.mark.slow
def test_small_stiff_spheres_part_at_the_tension_of_derjaguin_muller_toporov():
    """2 pi w R where nothing is deformed, from which softness takes away."""
    loads = np.array([1e-3, 0.0, -1e-3])
    ball = attracted(0.1, force=loads)
    limit = 2 * np.pi * work_of_parting() * 0.1
    assert 0.99 * limit < ball.pull_off < limit
    np.testing.assert_allclose(ball.force, loads, atol=1e-8)
    assert not ball.valid.any()
    assert "simulated" in " ".join(ball.reasons)
    slope = (loads[0] - loads[2]) / (ball.approach[0] - ball.approach[2])
    assert ball.stiffness[1] == pytest.approx(slope, rel=5e-3)
    part = np.array([-1.01 * limit, -0.99 * ball.pull_off]) / ball.layer.E_star
    with pytest.raises(OutOfRangeError, match="part"):
        ball._body.approach_at(part[0])
    assert ball._body.approach_at(part[1]) < ball.approach[2]


@pytest.mark.slow
def test_large_soft_spheres_part_at_the_tension_of_johnson_kendall_roberts():
    """3/2 pi w R where the attraction is as short as nothing beside what it deforms."""
    net = with_adhesion(
        resolve("calibrated", SMOOTH),
        AdhesionInUnits(0.02, 1.0, Adhesion(0.02, 1.0).shape, is_exponential=True),
    )
    over = []
    for radius in (10.0, 3e4):
        body = AttractingBody(None, radius, False, 0.0, SMOOTH, net.elastic, {}, 1.0, net=net, nodes=128)  # fmt: skip
        over.append(body.pull_off / (np.pi * work_of_parting() * radius))
    # Tabor's numbers of the spheres are 0.16 and 2.2
    assert 2.0 > over[0] > 1.9
    assert 1.5 < over[1] < 1.06 * 1.5


def test_what_attracting_bodies_are_refused():
    with pytest.raises(InputError, match="cylinders that attract"):
        attracted(10.0, shape="cylinder", approach=0.0)
    # without work nothing differs
    none = Bodies(1.0, adhesion=Adhesion(0.0, 1.0))
    ball, plain = (
        rough_contact(SMOOTH, 50.0, bodies, theory="calibrated", approach=0.05)
        for bodies in (none, 1.0)
    )
    assert ball.force == plain.force
    assert ball.pull_off == plain.pull_off == 0
