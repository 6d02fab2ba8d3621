"""Contacts with a hardness: limits, bounds, monotony, against mpmath and boundary elements."""

import json
import pickle

import mpmath
import numpy as np
import pytest
import xarray as xr
from helpers import contact_of, law_of_names, random_map, refusals
from scipy.differentiate import derivative

from generate.boundary_elements.solve import Contact as Elastic
from generate.boundary_elements.surfaces import Recipe, heights
from generate.calibrated_hardness import BARS, FORMS, OTHERS, blind
from mbma_tables import Bodies, InputError, OutOfRangeError, Surface, contact, contact_law
from mbma_tables.surfaces.bearing_curve import bearing
from mbma_tables.theories import THEORIES, Mbma, resolve
from mbma_tables.theories.evidence import shipped_deviations, shipped_part
from mbma_tables.theories.simulated.boundary_elements import (
    BoundaryElementContact,
    project,
)
from mbma_tables.theories.yielding import formulas as hardness
from mbma_tables.theories.yielding.theory import MANY, Yielding

SURFACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
MODULUS = 100e3
HARDNESS = 1500.0
each = pytest.mark.parametrize("theory", THEORIES)


@each
def test_each_stiffness_has_its_own_uncertainty(theory):
    """With a hardness the simulated stiffness is that of unloading; the slope of loading has no stated uncertainty."""
    numbers = {"area": 0.05, "E_star": MODULUS, "theory": theory}
    elastic = contact_of(SURFACE, **numbers)
    assert elastic.unloading_stiffness_scatter == pytest.approx(
        elastic.stiffness_scatter, nan_ok=True
    )
    both = contact_of(SURFACE, Bodies(hardness=[np.inf, HARDNESS]), **numbers)
    np.testing.assert_allclose(
        both.stiffness_scatter, [elastic.stiffness_scatter, np.nan], rtol=1e-12
    )
    assert both.unloading_stiffness_scatter[0] == pytest.approx(
        elastic.stiffness_scatter, nan_ok=True
    )
    if theory == "calibrated":
        # what the file of simulations states for the frozen contact
        own = contact_of(SURFACE, Bodies(hardness=HARDNESS), **numbers)
        assert 0.02 < own.unloading_stiffness_scatter < 0.3
        assert both.unloading_stiffness_scatter[1] == own.unloading_stiffness_scatter


def test_the_text_of_contacts_that_yield_names_first_loading():
    """Pressures that fall in a request are not unloading, which the text must not leave open."""
    falling = {"pressure": [50.0, 25.0], "E_star": MODULUS, "theory": "calibrated"}
    found = contact_of(SURFACE, Bodies(hardness=HARDNESS), **falling)
    assert "loading first; each pressure is reached from no contact" in repr(found)
    assert (
        found.mean_separation[1]
        == contact_of(
            SURFACE, Bodies(hardness=HARDNESS), **falling | {"pressure": 25.0}
        ).mean_separation
    )
    assert "each pressure is reached" not in repr(contact_of(SURFACE, **falling))


@each
def test_without_yielding_answers_are_elastic_to_the_last_bit(theory):
    u = [0.5, 1.9, 2.9]
    elastic = contact(SURFACE, MODULUS, mean_separation=u, theory=theory)
    for cap in (np.inf, [np.inf, np.inf, HARDNESS]):
        found = contact(
            SURFACE, Bodies(MODULUS, hardness=cap), mean_separation=u, theory=theory
        )
        for name in ("pressure", "area", "stiffness", "error", "unloading_stiffness"):
            rel = (
                (1e-8 if name == "error" else 1e-14)
                if theory == "mbma" and np.ndim(cap)
                else 0
            )
            assert getattr(found, name)[:2] == pytest.approx(
                getattr(elastic, name)[:2], rel=rel, abs=0
            ), name
        assert (found.yielded[:2] == 0).all()
        assert (np.broadcast_to(found.psi, 3)[:2] == 0).all()


@each
def test_pressure_is_inverted_and_slopes_are_those_of_the_curve(theory):
    pressure = np.array([1e-3, 1.0, 30.0, 300.0])
    known = {"E_star": MODULUS, "theory": theory, "hardness": HARDNESS}
    found = contact_of(SURFACE, pressure=pressure, **known)
    assert found.pressure == pytest.approx(pressure, rel=1e-10)
    assert (found.area >= pressure / HARDNESS * (1 - 1e-10)).all()
    assert (found.mean_pressure <= HARDNESS * (1 + 1e-12)).all()
    step = 1e-5
    near = [
        contact_of(
            SURFACE, mean_separation=found.mean_separation + way * step, **known
        ).pressure
        for way in (-1, 1)
    ]
    kept = found.mean_separation < 3.0 - 100 * step
    assert found.stiffness[kept] == pytest.approx(
        ((near[0] - near[1]) / (2 * step))[kept], rel=1e-5
    )
    assert (found.unloading_stiffness > found.stiffness).all()
    assert (found.plane_separation <= found.mean_separation).all()
    # what comes back is more than that of a linear spring as stiff as the first unloading
    assert (
        found.energy[kept] > (found.pressure**2 / found.unloading_stiffness / 2)[kept]
    ).all()


@pytest.mark.parametrize(
    ("theory", "rtol", "surface", "shares"),
    [
        ("calibrated", 1e-5, SURFACE, np.linspace(0.2, 0.99, 50)),
        # where the elastic force is finite, the share of heights is not smooth
        ("mbma", 1e-7, Surface(0.8, 1.0, 64.0, 1.0, 3.3), np.geomspace(1e-6, 0.999, 200)),
        ("persson", 1e-8, SURFACE, np.geomspace(3e-6, 9.7, 20)),
    ],
)
def test_a_law_with_a_hardness_is_a_law(theory, rtol, surface, shares):
    asked = {
        "theory": theory,
        "E_star": MODULUS,
        "hardness": HARDNESS if theory != "mbma" else 0.5 * MODULUS,
    }
    law = law_of_names(surface, rtol=rtol, **asked)
    u = shares * surface.h_max
    found = contact_of(surface, mean_separation=u, **asked)
    for name in ("pressure", "area"):
        np.testing.assert_allclose(
            getattr(law, name)(u), getattr(found, name), rtol=max(rtol, law.error)
        )
    # the first one may be where the law ends, beyond whose pressure rounding leads
    assert law.at_pressure(found.pressure[1:]).mean_separation == pytest.approx(
        u[1:], rel=10 * law.error
    )
    assert pickle.loads(pickle.dumps(law)).pressure(1.0) == law.pressure(1.0)
    if theory == "mbma":
        assert law.lowest == pytest.approx((2e-6 - 1) * surface.h_max)
    with pytest.raises(InputError, match="hardness must be one number"):
        contact_law(surface, Bodies(hardness=[0.01, 0.02]), theory=theory)


@each
@pytest.mark.parametrize("cap", [0.005, 0.05, 5.0])
def test_many_pressures_on_one_surface(theory, cap):
    share = 10 ** np.random.default_rng(4).uniform(
        -6, np.log10(min(0.5, 0.005 / cap)), MANY
    )
    if theory == "calibrated":
        # beyond the gaps from which others start
        share = np.append(share, [1e-12, min(0.99, 0.1 / cap)])
    asked = Yielding(resolve(theory), cap)
    u = asked.mean_separation_at(SURFACE, "pressure", cap * share)
    found = asked.answer(SURFACE, u)
    # but for the last bits of u
    rounding = 16 * np.finfo(float).eps * (cap * share + u * found.stiffness)
    assert (np.abs(found.pressure - cap * share) <= rounding + 1e-12 * cap * share).all()


def test_ten_thousand_contacts_keep_bounds_and_order():
    rng = np.random.default_rng(16)
    n = 10_000
    zeta = 10 ** rng.uniform(0.6, 4, n)
    surface = Surface(rng.uniform(0.1, 1, n), 1.0, zeta, 10 ** rng.uniform(-3, 0, n), 1.0)
    surface = Surface(
        surface.hurst, 1.0, zeta, surface.h_rms, surface.h_rms * rng.uniform(2.5, 5.5, n)
    )
    eta = 10 ** rng.uniform(-4, 2, n) * surface.rms_gradient
    u = surface.h_max * rng.uniform(1e-3, 0.999, n)
    theory = resolve("calibrated")

    def state(cap, gap):
        found = Yielding(theory, cap).loaded(surface, gap)
        return found.answer, found.yielded * found.answer.area

    answer, yielded = state(eta, u)
    x = answer.pressure / eta
    assert (answer.area >= x * (1 - 1e-15)).all()
    assert (answer.area <= 1).all()
    assert (yielded <= x * (1 + 1e-14)).all()
    for closer, harder in ((0.99, 1.0), (1.0, 1.05)):
        other, _ = state(eta * harder, u * closer)
        assert (other.pressure >= answer.pressure * (1 - 1e-13)).all()
    # at one force: more area under more load, less of it if harder
    elastic = theory.area_at(surface, answer.pressure)
    force = answer.pressure / surface.rms_gradient
    cap = eta / surface.rms_gradient
    more = theory.area_at(surface, 1.01 * answer.pressure)
    assert (
        hardness.area(np.minimum(1.01 * force, cap), more, cap)
        >= answer.area * (1 - 1e-12)
    ).all()
    harder = hardness.area(force, elastic, 1.05 * cap)
    assert (harder <= answer.area * (1 + 1e-12)).all()
    assert (
        hardness.area(force, elastic, 1.05 * cap, yielded=True)
        <= yielded * (1 + 1e-12) + 1e-300
    ).all()


def test_batches_labels_and_units():
    caps = np.array([500.0, 1500.0, np.inf])
    plain = contact(
        SURFACE,
        Bodies(MODULUS, hardness=caps),
        pressure=[[1.0], [30.0]],
        theory="calibrated",
    )
    assert plain.area.shape == (2, 3)
    one = contact(
        SURFACE, Bodies(MODULUS, hardness=1500.0), pressure=30.0, theory="calibrated"
    )
    assert plain.area[1, 1] == pytest.approx(one.area, rel=1e-12)
    named = {
        "pressure": xr.DataArray([1.0, 30.0], dims="load"),
        "hardness": xr.DataArray(caps, dims="metal"),
    }
    labelled = contact_of(SURFACE, MODULUS, **named, theory="calibrated")
    for name in ("area", "yielded", "unloading_stiffness", "scatter", "psi", "valid"):
        own = getattr(labelled, name)
        assert set(own.dims) <= {"load", "metal"}
        expected = np.broadcast_to(getattr(plain, name), own.shape)
        # lighter contacts than those compared with simulations have no scatter
        assert own.values == pytest.approx(
            expected, rel=1e-12, nan_ok=name == "scatter"
        ), name
    given = {"pressure": "30 MPa", "E_star": "100 GPa", "hardness": "1500 MPa"}
    named = contact_of(
        Surface(0.8, 0.01, 2.0, 1.0, 3.0, unit="um"), **given, theory="calibrated"
    )
    assert named.area == pytest.approx(one.area, rel=1e-12)
    assert named.units["unloading_stiffness"] == "GPa/um"


def test_a_map_yields_by_its_own_heights():
    heights = random_map(64, 0.05, 0.25, power=0)
    surface = Surface.from_map(heights, dx=1.0, periodic=True)
    soft = 1e-5 * float(surface.rms_gradient)
    level = np.quantile(heights - heights.mean(), 0.8)
    u = np.maximum(level - (heights - heights.mean()), 0).mean()
    found = contact(
        surface, Bodies(hardness=soft), mean_separation=u, theory="calibrated"
    )
    assert found.area == pytest.approx(0.2, rel=0.03)
    assert found.scatter < shipped_deviations().standard_deviation(
        "calibrated", "pressure", found.area
    )
    law = contact_law(
        surface,
        Bodies(hardness=0.3 * float(surface.rms_gradient)),
        theory="calibrated",
        rtol=1e-3,
    )
    assert law.turning_point is None


test_what_cannot_be_asked = refusals(
    lambda asked: contact_of(
        SURFACE,
        **({"E_star": MODULUS, "hardness": HARDNESS, "theory": "calibrated"} | asked),
    ),
    ({"pressure": 2000.0}, "pressure must be at most the hardness, 1500, got 2000"),
    (
        {"pressure": "2 GPa", "E_star": "100 GPa", "hardness": "1.5 GPa"},
        r"pressure \[GPa\] .* 1.5, got 2",
    ),
    ({"pressure": 1.0, "hardness": 0.0}, "hardness must be positive, or infinite"),
    ({"pressure": 1.0, "hardness": np.nan}, "hardness must be finite"),
    ({"pressure": 1.0, "hardness": "hard"}, "hardness must be a number"),
    (
        {"pressure": 1.0, "hardness": [1.0, 2.0, 3.0], "E_star": [1.0, 2.0]},
        "do not broadcast",
    ),
)


def test_scatter_of_any_theory():
    area = np.array([0.02, 0.2])
    soft = 0.05 * float(SURFACE.rms_gradient)
    for theory in map(resolve, ("mbma", "persson", "greenwood_williamson")):
        each = (
            theory,
            Yielding(theory, soft),
            Yielding(resolve("calibrated"), soft),
            Yielding(theory, 50 * soft),
        )
        known, found, own, hard = (
            np.array([one.scatter(SURFACE, what, area) for what in ("pressure", "area")])
            for one in each
        )
        assert (np.isfinite(found) == np.isfinite(known)).all()
        assert (found < known)[
            np.isfinite(known)
        ].all()  # the area of a soft contact is F/p_m by any theory
        assert (found[1] < 2 * own[1])[np.isfinite(known[1])].all()
        np.testing.assert_array_equal(hard, known)


def test_reasons_and_what_elastic_answers_say():
    known = {"E_star": MODULUS, "theory": "calibrated"}
    found = contact_of(
        SURFACE, Bodies(hardness=[30.0, 3000.0]), pressure=[1.0, 2.0], **known
    )
    masks = [
        mask.tolist()
        for reason, mask in found.reasons.items()
        if "hardness over E*" in reason
    ]
    assert masks == [[True, False]]
    elastic = contact_of(SURFACE, pressure=30.0, **known)
    limit = contact_of(
        SURFACE, Bodies(hardness=float(elastic.elastic_hardness)), pressure=30.0, **known
    )
    assert limit.area == pytest.approx(elastic.area, rel=0.05)
    assert limit.psi == pytest.approx(1.1)
    # rms gradient 0.054: E* g/2 is 2.7 GPa
    for pressure, told in ((2.0, False), (4.0, True)):
        found = contact(SURFACE, "100 GPa", pressure=pressure, theory="calibrated")
        assert ("above E* g/2 = 2.7" in repr(found)) is told
    found = contact_of(
        SURFACE, Bodies(hardness=[HARDNESS, np.inf, 50.0]), area=[0.1, 0.3, 0.5], **known
    )
    assert found.area == pytest.approx([0.1, 0.3, 0.5], rel=1e-10)
    # asperities that lie on one another have areas above one
    asked = {"mean_separation": 0.01, "theory": "greenwood_williamson"}
    elastic = contact_of(SURFACE, **asked)
    assert elastic.area > 1
    assert contact_of(
        SURFACE, Bodies(hardness=[1e3, 1e200]), **asked
    ).area == pytest.approx([elastic.area] * 2, rel=1e-12)
    found = contact(
        SURFACE, Bodies(hardness=0.02), separation=0.5, theory=Mbma(variant="printed")
    )
    assert (found.variant, found.island_model) == ("printed", "universal")


def test_a_force_with_a_hardness_takes_few_elastic_answers(monkeypatch):
    """A search begins where the elastic force or that of the heights is the wanted one."""
    rng = np.random.default_rng(4)
    size = 200
    h_rms = rng.uniform(0.5, 2.0, size)
    # half of them beyond the calibrated table
    h_max = np.where(np.arange(size) % 2, 3.5, 8.5) * h_rms
    surfaces = Surface(
        rng.uniform(0.5, 0.95, size), 0.01, rng.uniform(0.5, 5.0, size), h_rms, h_max
    )
    cap = np.where(rng.random(size) < 0.2, np.inf, 10 ** rng.uniform(-2, 0, size))
    theory = Yielding(resolve("calibrated"), cap)
    most = np.minimum(cap, np.asarray(surfaces.rms_gradient))
    wanted = most * 10 ** rng.uniform(-6, -0.1, size)
    answers = []
    of_curve = Yielding.curve

    def counted(self, surface, quantity):
        values = of_curve(self, surface, quantity)

        def count(u):
            answers.append(np.broadcast(u, surface.h_rms).size)
            return values(u)

        return count

    monkeypatch.setattr(Yielding, "curve", counted)
    u = theory.mean_separation_at(surfaces, "pressure", wanted)
    assert sum(answers) < 6.5 * size
    found = theory.answer(surfaces, u)
    # a rounding of u beside last contact
    rounding = 4e-16 * u * found.stiffness / wanted
    np.testing.assert_array_less(np.abs(found.pressure / wanted - 1), 1e-12 + rounding)


@each
@pytest.mark.parametrize("cap", [1e-320, 1e-300, 1e-100, 1e100, 1e200, 1.7e308])
def test_hardnesses_of_any_size(theory, cap):
    # of next to none the bearing curve, of a huge one the elastic contact
    u = np.array([0.3, 1.0, 1.5, 2.9 if cap > 1e-310 else 2.0])
    elastic = contact(SURFACE, mean_separation=u, theory=theory)
    share = hardness.bearing_share(u, 3.0 if resolve(theory).ends_at_h_max else None)[0]
    pressure, area = (cap * share, share) if cap < 1 else (elastic.pressure, elastic.area)
    for asked in ({"pressure": pressure}, {"mean_separation": u}, {"area": area}):
        found = contact_of(SURFACE, Bodies(hardness=cap), **asked, theory=theory)
        if cap < 1:
            rel = 1e-2 if cap < 1e-310 else 1e-12
            assert found.pressure == pytest.approx(cap * share, rel=0.01)
            assert found.area == pytest.approx(found.pressure / cap, rel=rel)
            assert found.yielded == pytest.approx(np.ones(4), rel=rel)
        else:
            for name in (
                "mean_separation",
                "pressure",
                "area",
                "stiffness",
                "unloading_stiffness",
            ):
                assert getattr(found, name) == pytest.approx(
                    getattr(elastic, name), rel=1e-10
                ), name
            assert (found.yielded == 0).all()


@pytest.mark.parametrize(
    ("theory", "most"), [("calibrated", 4), ("mbma", 5), ("greenwood_williamson", 5)]
)
def test_a_pressure_takes_few_elastic_answers(monkeypatch, theory, most):
    kind = type(resolve(theory))
    asked = []
    original = kind.answer
    monkeypatch.setattr(
        kind, "answer", lambda self, *given: asked.append(given) or original(self, *given)
    )
    for pressure in (0.1, 3.0, 30.0, 500.0):
        asked.clear()
        contact(
            SURFACE, Bodies(MODULUS, hardness=HARDNESS), pressure=pressure, theory=theory
        )
        assert len(asked) <= most


@each
def test_pressures_short_of_the_hardness_are_held_or_refused(theory):
    concrete = Surface.named("concrete")
    known = {"theory": theory, "hardness": 0.02}
    deepest = contact_of(
        concrete, mean_separation=1e-9 * concrete.h_rms, **known
    ).pressure
    for share in (0.9, 0.9795, 0.99995, 1 - 5e-9):
        if 0.02 * share < deepest or (theory == "calibrated" and share < 1 - 1e-6):
            found = contact_of(concrete, pressure=0.02 * share, **known)
            assert found.pressure == pytest.approx(0.02 * share, rel=1e-11)
        else:
            with pytest.raises(OutOfRangeError, match="must be at most what theory"):
                contact_of(concrete, pressure=0.02 * share, **known)


def test_the_lightest_pressures_are_held():
    # the last step there ends at the elastic contact's separation
    surface = Surface(hurst=0.096, q0=0.0015, q1=0.27, h_rms=0.043, h_max=0.3)
    cap = 0.3 * float(surface.rms_gradient)
    for depth in np.geomspace(1e-5, 1e-3, 9):
        force = contact(
            surface, Bodies(hardness=cap), mean_separation=0.3 * (1 - depth)
        ).pressure
        assert contact(
            surface, Bodies(hardness=cap), pressure=force
        ).pressure == pytest.approx(force, rel=1e-9)


def between_walls(x, tau):
    """Areas by images alone, in 60 digits."""
    with mpmath.workdps(60):
        x = mpmath.mpf(float(x))
        width = 2 * mpmath.sqrt(mpmath.mpf(float(tau)))
        reach = range(int(12 * width) + 3)
        touching = mpmath.erf(x / width) + mpmath.fsum(
            mpmath.erfc((2 * k - x) / width) - mpmath.erfc((2 * k + x) / width)
            for k in reach
            if k
        )
        yielded = mpmath.fsum(
            mpmath.erfc((2 * k + 1 - x) / width) - mpmath.erfc((2 * k + 1 + x) / width)
            for k in reach
        )
        return float(touching), float(yielded)


def test_areas_are_those_of_a_diffusion_between_walls():
    rng = np.random.default_rng(3)
    tau = np.append(10 ** rng.uniform(-3, 1, 60), [0.0599, 0.0601])
    x = 10 ** rng.uniform(-12, 0, 62)
    exact = np.array([between_walls(*point) for point in zip(x, tau, strict=True)])
    for column, (sign, rel) in enumerate(((1.0, 1e-12), (-1.0, 1e-11))):
        assert hardness.diffused(x, tau, sign) == pytest.approx(
            exact[:, column], rel=rel, abs=1e-250
        )


def test_levels_of_mean_gaps():
    u = np.append(
        10 ** np.random.default_rng(2).uniform(-290, 1, 40),
        [3.8e-4, np.nextafter(3.8e-4, 0), 3.0, 8.3],
    )
    u = np.append(u, np.geomspace(1e-6, 8, 60))
    found = hardness._levels(u)
    with mpmath.workdps(40):
        for gap, level in zip(u.tolist(), found.tolist(), strict=True):
            d = mpmath.mpf(level)
            for _ in range(3):
                below = mpmath.erfc(-d / mpmath.sqrt(2)) / 2
                mean = d * below + mpmath.npdf(d)
                d -= mpmath.log(mean / gap) * mean / below
            assert level == pytest.approx(float(d), abs=1e-14, rel=1e-15)


def test_flattening_is_that_of_gaussian_heights_above_a_level():
    share = np.concatenate([np.geomspace(1e-250, 0.4, 30), [0.5, 0.6, 0.99, 1 - 1e-9]])
    gap = hardness.plane_separation(0.0, share, 0.0)
    with mpmath.workdps(300):
        for x, found in zip(share.tolist(), gap.tolist(), strict=True):
            d = mpmath.sqrt(2) * mpmath.erfinv(1 - 2 * mpmath.mpf(x))
            above = mpmath.npdf(d) - d * x
            assert -found == pytest.approx(float(above), rel=1e-12, abs=1e-250)


def test_without_yielding_the_area_is_the_elastic_one():
    """By the inverse of erf and back, whatever the area."""
    elastic = np.concatenate(
        [np.geomspace(1e-300, 0.5, 40), 1 - np.geomspace(1e-16, 0.5, 40)]
    )
    for yielded, expected in ((False, elastic), (True, 0.0 * elastic)):
        found = hardness.area(0.3 * elastic, elastic, 1e6, yielded=yielded)
        np.testing.assert_allclose(found, expected, rtol=1e-14, atol=1e-300)


def test_bearing_curve_of_a_map_is_that_of_its_heights():
    surface = heights(Recipe("worn", 0.8, 8, 4, 3, 128, 0.5))
    known = bearing(surface, (1.0, 1.0))
    curve = hardness.BearingCurve(
        known.mean_height / known.h_rms, known.h_max / known.h_rms
    )
    levels = np.quantile(surface, [0.02, 0.1, 0.5, 0.9, 0.99])
    u = np.array([np.maximum(level - surface, 0).mean() for level in levels])
    assert curve(u)[0] == pytest.approx([0.98, 0.9, 0.5, 0.1, 0.01], rel=0.03)
    slope = derivative(lambda x: curve(x)[0], u, initial_step=0.001).df
    assert curve(u)[1] == pytest.approx(slope, rel=1e-2)
    assert curve(known.h_max / known.h_rms)[0] == 0


def test_a_flat_with_a_pit_has_no_bearing_curve():
    pit = np.zeros((64, 64))
    pit[30, 30] = -1
    known = bearing(pit, (1.0, 1.0))
    with pytest.raises(InputError, match="of the map or more is its highest point"):
        hardness.BearingCurve(known.mean_height / known.h_rms, known.h_max / known.h_rms)


def test_projection_is_the_nearest_allowed_field():
    p = np.random.default_rng(1).normal(size=(16, 16))
    found = project(p, 0.3, 0.8)
    assert (found.mean(), found.min(), found.max()) == (
        pytest.approx(0.3, rel=1e-12),
        0,
        0.8,
    )
    shift = (p - found)[(found > 0) & (found < 0.8)]
    assert np.ptp(shift) < 1e-12  # so it is the Euclidean projection


@pytest.mark.parametrize(
    "recipe",
    [Recipe("self_affine", 0.8, 8, 2, 1, 64), Recipe("stretched", 0.8, 8, 2, 1, 64, 4.0)],
)
def test_capped_boundary_elements(recipe):
    pytest.importorskip("tamaas")
    unscaled = heights(recipe)
    surface = unscaled / bearing(unscaled, recipe.sizes).gradient
    elastic, capped = (
        BoundaryElementContact(surface, recipe.sizes, hardness=cap)
        for cap in (np.inf, 0.2)
    )
    for force in (0.01, 0.1):
        free = elastic.press(force)
        held = capped.press(force)
        other = Elastic(surface, recipe.sizes).press(force)
        for name in ("area", "mean_separation", "energy"):
            assert free[name] == pytest.approx(other[name], rel=2e-4), name
        assert held["area"] >= force / 0.2 >= held["area_yielded"] > 0
        assert capped.pressure.max() <= 0.2
        assert held["mean_separation"] < free["mean_separation"]
        # -dF/du of the elastic contact, whose area changes only to second order
        step = 1e-3 * force
        above, below = (
            elastic.press(force + way * step)["mean_separation"] for way in (1, -1)
        )
        elastic.press(force)
        assert elastic.frozen_stiffness() == pytest.approx(
            2 * step / (below - above), rel=0.05
        )


def test_held_out_surfaces_are_within_the_stated_bars():
    variables, attributes = shipped_part("hardness")
    assert all(
        attributes[f"law_{name}"] == value
        for name, value in vars(hardness.CONSTANTS).items()
    )
    sets = attributes["sets"].split()
    quantities = attributes["quantities"].split()
    numbers = dict(zip(sets, variables["accuracy"], strict=True))
    held = np.stack([numbers[name] for name in ("held_out_surface", "held_out_spectrum")])
    share = (held[..., 2] * held[..., 4]).sum(axis=0) / held[..., 4].sum(axis=0)
    with_h_max, with_heights = (dict(zip(quantities, row, strict=True)) for row in share)
    assert with_h_max["area"] > 0.97
    assert (
        min(with_h_max["yielded"], with_h_max["stiffness"], with_heights["stiffness"])
        > 0.95
    )
    # of surfaces with two longest waves a side h_max says little of the highest heights
    assert numbers["three_waves"][0, quantities.index("force"), 2] > 0.97
    stretched = dict(zip(quantities, numbers["stretched"][1, :, 2], strict=True))
    assert stretched["area"] > 0.97
    assert with_heights["force"] == stretched["force"] == 1


def test_surfaces_of_another_code():
    errors = blind()
    assert errors["area"].size > 1000
    for quantity, least in {
        "area": 0.97,
        "yielded": 0.95,
        "force": 0.97,
        "stiffness": 0.95,
    }.items():
        assert np.mean(np.abs(errors[quantity]) < BARS[quantity]) > least, quantity


def test_stated_scatter_is_what_held_out_errors_have():
    _, attributes = shipped_part("hardness")
    covered = json.loads(attributes["coverage"])
    assert set(covered) == {
        f"{name} {q}"
        for name in (*FORMS, *OTHERS)
        for q in ("area", "force", "stiffness")
    }
    for name, (one, two) in covered.items():
        assert 0.55 < one < 0.8, name
        # MBMA's stiffness is off by a bias more than by chance
        assert 0.88 < two < (1.01 if name == "mbma stiffness" else 0.99), name
