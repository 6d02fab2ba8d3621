"""`contact` against brute force, its own bound, the paper's case, power laws, limits, invariants, bad input."""

import math

import numpy as np
import pytest
from catalogue import LEVEL, OWN

from mbma_tables import (
    ConvergenceError,
    OutOfRangeError,
    Surface,
    contact,
    greenwood_tripp,
)
from mbma_tables.islands.geometry import geometry, kinks
from mbma_tables.islands.variants import get_variant
from mbma_tables.theories import Mbma


def brute(surface, separation, variant):
    """(48) and (49) in units of E* q0 s and 1, by composite Gauss rules far finer than needed."""
    rule = get_variant(variant)
    hurst = surface.hurst
    zeta_1 = surface.zeta_1
    h_rms = surface.h_rms
    room = h_rms / surface.s
    reach = (surface.h_max - separation) / h_rms
    layer = zeta_1**-hurst
    # geometric towards first contact, even beyond, and broken where the floors are met
    graded = reach * 2.0 ** -np.arange(
        math.ceil(math.log2(reach / (1e-9 * min(layer, reach))))
    )
    even = np.arange(0, reach, 0.1)
    own_kinks = [k for k in kinks(hurst, zeta_1, rule) if k < reach]
    edges = np.unique(np.concatenate([[0.0, reach], graded, even, own_kinks]))
    x, weights = np.polynomial.legendre.leggauss(16)
    half = np.diff(edges) / 2
    delta = ((edges[1:] + edges[:-1])[:, None] / 2 + half[:, None] * x).ravel()
    measure = (half[:, None] * weights).ravel() * room

    g = geometry(delta, np.full_like(delta, hurst), np.full_like(delta, zeta_1), rule)
    phi = greenwood_tripp.solve(g["X"], g["mu"], rtol=1e-12)
    L = np.sqrt(2 * g["R_d"] * g["sigma"])
    force = g["sigma"] * L * phi.phi_F
    area = g["eta"] * math.pi * g["D"] * g["R_u"] * g["sigma"] * L**2 * phi.phi_A
    z = (separation / h_rms + delta) * room - g["h_d"]
    density = (
        g["D_d"]
        * np.exp(-0.5 * (z / g["sigma_d"]) ** 2)
        / (math.sqrt(2 * math.pi) * g["sigma_d"])
    )
    slope = 4 / 3 * rule.beta
    if rule.jacobian == "exact":
        slope = slope / room if rule.offset else 0.0
    shift = np.where(g["zeta_d"] > rule.floor_d, 1 - slope, 1.0)
    weight = density * shift * measure
    return surface.q0 * surface.s * (force @ weight), area @ weight


def one_surface(hurst, zeta_1, h_max=3.0, h_rms=1.0):
    return Surface(hurst, 0.2, 0.2 * zeta_1, h_rms, h_max * h_rms)


BRUTE_POINTS = [
    (0.1, 1e8, 0.9999, "reported"),
    (0.1, 1e8, 0.3, "printed"),
    (0.1, 1e8, -1.0, "reported"),
    (0.1, 3.01, 0.9999, "printed"),
    (0.1, 3.01, -1.0, "reported"),
    (0.6, 5.0, 0.5, "printed"),
    (0.8, 216.0, 2 / 3, "printed"),
    (0.8, 216.0, 0.9999, "reported"),
    (0.85, 1e4, 0.2, OWN),
    (0.6, 12.0, -0.5, OWN),
    (0.7, 100.0, 0.4, LEVEL),
    (math.nextafter(1, 0), 50.0, 0.1, "reported"),
    (1.0, 3.01, 0.9999, "reported"),
    (1.0, 3.01, -1.0, "printed"),
    (1.0, 1e8, 0.9999, "printed"),
    (1.0, 1e8, -1.0, "reported"),
]


@pytest.mark.parametrize(("hurst", "zeta_1", "share", "variant"), BRUTE_POINTS)
def test_against_brute_force(hurst, zeta_1, share, variant):
    surface = one_surface(hurst, zeta_1, h_max=3.3, h_rms=0.7)
    separation = share * surface.h_max
    found = contact(
        surface, separation=separation, theory=Mbma("exact", variant=variant, rtol=1e-9)
    )
    force, area = brute(surface, separation, variant)
    assert abs(found.pressure / force - 1) <= 1e-9
    assert abs(found.area / area - 1) <= 1e-9
    assert (
        max(abs(found.pressure / force - 1), abs(found.area / area - 1))
        <= found.error + 5e-12
    )


def test_the_papers_yang_persson_case():
    found = contact(
        Surface.named("yang-persson"),
        separation=2.0,
        theory=Mbma("exact", variant="printed"),
    )
    assert found.pressure == pytest.approx(2.5114e-5, abs=5e-10)
    assert found.area == pytest.approx(3.1145e-5, abs=5e-10)
    assert found.mean_separation == 2.5
    assert (found.variant, found.island_model) == ("printed", "exact")


@pytest.mark.parametrize("island_model", ["exact", "rigid"])
def test_no_contact_is_exactly_zero(island_model):
    surface = one_surface(0.8, 216.0)
    separation = np.array([3.0, math.nextafter(3, 4), 50.0, 1e300])
    found = contact(
        surface, separation=separation, theory=Mbma(island_model=island_model)
    )
    assert (
        found.pressure.tolist()
        == found.area.tolist()
        == found.error.tolist()
        == [0.0] * 4
    )
    assert (
        contact(
            surface,
            separation=math.nextafter(3, 2),
            theory=Mbma(island_model=island_model),
        ).pressure
        > 0
    )
    assert separation.tolist() == [
        3.0,
        math.nextafter(3, 4),
        50.0,
        1e300,
    ]  # arguments stay as they are


def test_below_full_compression():
    surfaces = Surface([[0.5], [0.8]], 0.2, 40.0, 1.0, [[3.0], [4.0]])
    with pytest.raises(
        OutOfRangeError, match="at least -h_max, where the model ends"
    ) as caught:
        contact(surfaces, separation=[0.0, -3.5, -5.0], theory=Mbma("exact"))
    assert caught.value.mask.tolist() == [[False, True, True], [False, False, True]]


def test_failure_has_the_shape_of_the_arguments(monkeypatch):
    monkeypatch.setattr(
        greenwood_tripp, "LEVELS", np.array([12])
    )  # too few nodes for any island at 1e-8
    surfaces = Surface([[0.5], [0.8]], 0.2, 40.0, 1.0, [[3.0], [4.0]])
    with pytest.raises(ConvergenceError) as caught:
        contact(surfaces, separation=[0.0, 3.5, 1.0], theory=Mbma("exact"))
    assert caught.value.mask.tolist() == [[True, False, True], [True, True, True]]


ROUGH = Surface(0.8, 1.0, 216.0, 1.0, 3.0)
GAPS = np.linspace(-2.0, 2.9, 40)


KINDS = {
    "strided": np.repeat(GAPS, 3)[::3],
    "read-only": np.broadcast_to(GAPS, GAPS.shape),
    "reversed view": GAPS[::-1].copy()[::-1],
    "Fortran order": np.asfortranarray(GAPS.reshape(5, 8)),
    "list": GAPS.tolist(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_layout_does_not_matter(kind):
    found, expected = (
        contact(ROUGH, separation=gaps, theory=Mbma("exact"))
        for gaps in (KINDS[kind], GAPS)
    )
    np.testing.assert_array_equal(np.ravel(found.pressure), expected.pressure)
    np.testing.assert_array_equal(np.ravel(found.area), expected.area)


@pytest.mark.parametrize(
    ("variant", "numbers", "compression", "rtol"),
    [
        (
            "printed",
            (0.531947294354621, 716405.4119302577, 3.982572903065155),
            1.67147,
            1e-8,
        ),
        (
            "printed",
            (0.5913947825075665, 463746.61320114444, 3.708447610995201),
            1.26928,
            1e-5,
        ),
        (
            "fitted",
            (0.24255115327802002, 31377.867654901776, 0.8042366230900542),
            1.21085,
            1e-5,
        ),
    ],
)
def test_many_surfaces_keep_their_bound_where_sums_agree_by_chance(
    variant, numbers, compression, rtol
):
    hurst, zeta_1, top = numbers
    surfaces = Surface(hurst, 1.0, zeta_1, 1.0, np.full((30, 1), top))
    gaps = top - compression * (1 + np.linspace(-1e-3, 1e-3, 41))
    found, known = (
        contact(surfaces, separation=gaps, theory=Mbma("exact", variant, asked))
        for asked in (rtol, 1e-11)
    )
    for name in ("pressure", "area"):
        assert (
            np.abs(getattr(found, name) / getattr(known, name) - 1) <= found.error
        ).all()
    assert found.error.max() <= rtol


def test_many_surfaces_by_the_four_number_table_are_summed_as_each_alone():
    """Each needed a profile of its own, 0.9 ms a surface."""
    rng = np.random.default_rng(4)
    hurst = rng.uniform(0.35, 0.95, 40)
    zeta_1 = rng.uniform(20, 500, 40)
    surfaces = Surface(hurst, 2.0, zeta_1, 0.1, 0.35)
    separation = rng.uniform(-0.1, 0.3, 40)
    theory = Mbma("island4d")
    found = contact(surfaces, separation=separation, theory=theory)
    exact = contact(surfaces, separation=separation, theory=Mbma("exact"))
    for name in ("pressure", "area"):
        difference = np.abs(getattr(found, name) / getattr(exact, name) - 1)
        assert (difference <= found.error + exact.error).all()
    for k in range(5):
        one = Surface(hurst[k], 2.0, zeta_1[k], 0.1, 0.35)
        alone = contact(one, separation=separation[k], theory=theory)
        assert found.pressure[k] == pytest.approx(alone.pressure, rel=1e-6)
        assert found.stiffness[k] == pytest.approx(alone.stiffness, rel=1e-6)


def test_many_surfaces_of_which_the_four_number_table_lacks_some():
    hurst = np.where(np.arange(40) == 7, 0.2, 0.8)
    surfaces = Surface(hurst, 2.0, 200.0, 0.1, 0.35)
    with pytest.raises(OutOfRangeError, match=r"0\.3 <= hurst <= 1\)") as caught:
        contact(surfaces, separation=0.1, theory=Mbma("island4d"))
    assert caught.value.mask.nonzero()[0].tolist() == [7]
    left = contact(surfaces, separation=0.1, theory=Mbma("island4d", outside="nan"))
    assert np.isnan(left.pressure).nonzero()[0].tolist() == [7]
    solved = contact(surfaces, separation=0.1, theory=Mbma("island4d", outside="exact"))
    exact = contact(
        Surface(0.2, 2.0, 200.0, 0.1, 0.35), separation=0.1, theory=Mbma("exact")
    )
    assert solved.pressure[7] == pytest.approx(exact.pressure, rel=1e-7)
