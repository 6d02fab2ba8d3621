"""The compiled pass: its rule, its islands against `islands.geometry`, its independence of order and batch."""

import math

import numpy as np
import pytest
from catalogue import LEVEL, OWN
from numpy.polynomial import legendre

from mbma_tables import ConvergenceError, Surface, contact
from mbma_tables.islands.geometry import geometry
from mbma_tables.models.tables import universal_model
from mbma_tables.models.universal_kernel import UNRESOLVED
from mbma_tables.surfaces.readings import PRINTED, REPORTED
from mbma_tables.totals import intervals
from mbma_tables.totals import kernel as lookup
from mbma_tables.totals.island_sum import kinks


@pytest.mark.parametrize(("straight", "width", "points"), [(False, 1.0, 31), (True, 3.0, 31), (True, 1.0, 21)])
def test_the_rules_by_their_degrees(straight, width, points):
    """2 n + 1 Kronrod points are exact up to degree 3 n + 1, n Gauss points up to 2 n - 1, and not beyond."""
    nodes, kronrod, gauss = intervals.rule_for(intervals.Interval(0.0, width, straight, straight))
    n, nodes = points // 2, nodes[:points]
    assert kronrod.size == points
    np.testing.assert_allclose(nodes[1::2], legendre.leggauss(n)[0], rtol=0, atol=2e-16)
    np.testing.assert_allclose(gauss[1::2], legendre.leggauss(n)[1], rtol=1e-14)
    assert (gauss[::2] == 0).all()
    for degree in range(0, 3 * n + 6, 2):
        integral = 2.0 if degree == 0 else 0.0
        # Legendre polynomials show every digit, powers do not
        shape = legendre.legval(nodes, [0] * degree + [1])
        assert (abs(kronrod @ shape - integral) < 1e-14) == (degree <= 3 * n + 1)
        assert (abs(gauss @ shape - integral) < 1e-14) == (degree <= 2 * n - 1)


@pytest.mark.parametrize("reading", [REPORTED, PRINTED, LEVEL], ids=lambda reading: reading.name)
def test_islands_are_those_of_geometry(reading):
    rng = np.random.default_rng(40)
    hurst = rng.uniform(0.1, 1, 3000)
    hurst[::10] = 1
    hurst[1::10] = 1 - 10 ** rng.uniform(-15, -3, 300)
    zeta_1 = 10 ** rng.uniform(math.log10(3.01), 8, 3000)
    x = 10 ** rng.uniform(-12, 1, 3000)
    g = geometry(x, hurst, zeta_1, reading)
    at_d, at_u = kinks(hurst, zeta_1, reading)
    nodes = np.array(
        [
            lookup.island_node(
                x[k],
                x[k] > at_d[k],
                x[k] > at_u[k],
                lookup.surface_constants(hurst[k], zeta_1[k], reading.numbers, True),
            )
            for k in range(x.size)
        ]
    ).T[:7]
    force = g["sigma"] * np.sqrt(2 * g["R_d"] * g["sigma"])
    area = 2 * math.pi * g["eta"] * g["D"] * g["R_u"] * g["R_d"] * g["sigma"] ** 2
    expected = np.stack([g["X"], g["mu"], force, area, g["h_d"], g["D_d"], g["sigma_d"]])
    np.testing.assert_allclose(nodes, expected, rtol=1e-11)
    assert np.median(np.abs(nodes[:4] / expected[:4] - 1)) < 1e-14


def totals(compression, rtol=1e-9, jacobian=5 / 9):
    """Status, force, area and error of `intervals.total` of one surface."""
    surface = lookup.surface_constants(0.8, 216.0, REPORTED.numbers, True)._replace(jacobian=jacobian)
    gap, out = intervals.Gap(compression, 3.0), np.empty((2, 1))
    status, error, _ = intervals.total(gap, rtol, surface, None, universal_model().kernel, out)
    return status, *out[:, 0], error


def test_what_cannot_be_resolved_is_said(monkeypatch):
    """A tolerance below rounding ends in a status, never in a number that looks right."""
    assert totals(4.0, rtol=1e-9)[0] == lookup.OK
    status, _, _, error = totals(4.0, rtol=1e-30)
    assert status == UNRESOLVED
    assert math.isnan(error)
    surface = Surface(np.linspace(0.2, 0.9, 20)[:, None], 0.2, 40.0, 1.0, 3.0)

    def unresolved(*given):
        *_, status, out, bound = given
        status[:] = lookup.OK
        status[3] = UNRESOLVED
        out[:] = bound[:] = 1.0
        return 31

    monkeypatch.setattr(intervals, "fill_totals", unresolved)
    with pytest.raises(ConvergenceError, match="quadrature did not reach its tolerance") as caught:
        contact(surface, [0.0, 1.0], outside="nan")
    assert np.argwhere(caught.value.mask).tolist() == [[1, 1]]


@pytest.mark.parametrize("reading", [REPORTED, OWN], ids=lambda reading: reading.name)
def test_kinks_are_where_geometry_reaches_its_floors(reading):
    rng = np.random.default_rng(6)
    hurst, zeta_1 = rng.uniform(0.1, 1, 200), 3.51 * 10 ** rng.uniform(0, 7, 200)
    for kink, name, floor in zip(
        kinks(hurst, zeta_1, reading), ("zeta_d", "zeta_u"), (reading.floor_d, reading.floor_u), strict=True
    ):
        before, beyond = (geometry(kink * (1 + sign * 1e-9), hurst, zeta_1, reading)[name] for sign in (-1, 1))
        assert (before > floor).all()
        assert (beyond == floor).all()
