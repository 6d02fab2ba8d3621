"""The compiled core's quintic splines over surfaces, the calibrated law's table and the flow through its gaps."""

import importlib
import math

import mpmath
import numpy as np
import pytest
from scipy.interpolate import NdBSpline

from mbma_tables.answers import leakage_table
from mbma_tables.answers.leakage_table import shipped_flow
from mbma_tables.core import GENERATIONS, core
from mbma_tables.laws.calibrated import Spectrum
from mbma_tables.theories.calibrated_table import FEW, shipped

PLAIN = importlib.import_module("mbma_tables.core._plain")
FUSED = [importlib.import_module(f"mbma_tables.core._{name}") for name, least in GENERATIONS.items()
         if name != "plain" and PLAIN.generation >= least]  # fmt: skip
CORES = [PLAIN, *FUSED]
TABLE, FLOW = shipped(), shipped_flow()
BAD = [math.nan, math.inf, -math.inf, 5e-324, -5e-324, 1e308, -1e308, 0.0, -0.0, -1.0]


def batch(n, seed=0, top=12.0):
    """Surfaces inside the table, with some on its edges, and gaps from full compression to beyond last contact."""
    rng = np.random.default_rng(seed)
    (h0, h1), (z0, z1) = TABLE.covered[:2]
    rows = rng.uniform((h0, z0, 2), (h1, z1, top), (n, 3)).T.copy()
    rows[:2, :2] = [[h0, h1], [z0, z1]]
    u = rows[2] * np.where(rng.random(n) < 0.5, rng.uniform(0, 1.02, n), 10.0 ** rng.uniform(-12, 0, n))
    return rows, u


def fill(rows, owner, u, used=core, pieces=None):
    """Force, area and stiffness."""
    ends, out = np.empty((rows.shape[1], 2)), np.empty((3, u.size))
    used.calibrated_ends(*TABLE.core_table, *rows, None, None, ends)
    given = *TABLE.core_table, *rows, ends, pieces
    bad = used.calibrated_contact(*given, owner, u, *out)
    assert bad == np.isnan(out[0]).sum()
    return out


def separations(rows, owner, force, used=core, pieces=None):
    """Their inverse."""
    ends, out = np.empty((rows.shape[1], 2)), np.empty(force.size)
    used.calibrated_ends(*TABLE.core_table, *rows, None, None, ends)
    bad = used.calibrated_separation(*TABLE.core_table, *rows, ends, pieces, owner, force, out)
    assert bad == np.isnan(out).sum()
    return out


def flow(rows, owner, u, area, pieces=None):
    """Flow coefficient."""
    return leakage_table._flow((*FLOW.core_table, *rows[:2], None, None, pieces), owner, u, area)


def pieces_of(table, rows, used=core):
    out = np.empty((rows.shape[1], int(table.cells[2]), 6))
    used.spline_pieces(*table.core_table, *rows[:2], None, None, None, out)
    return out


@pytest.mark.parametrize("used", CORES)
def test_erf_within_1e_15(used):
    x = np.concatenate([np.geomspace(1e-300, 1e-3, 200), np.linspace(1e-3, 6.5, 3001)])
    found = np.empty(x.size)
    used.elementary(4, x, found)
    with mpmath.workdps(40):
        exact = np.array([mpmath.erf(mpmath.mpf(value)) for value in x.tolist()])
        assert max(abs(found / exact - 1)) < 1e-15
    mirrored = np.empty(x.size)
    used.elementary(4, -x, mirrored)
    np.testing.assert_array_equal(mirrored, -found)


class TestSpline:
    def test_is_the_tensor_spline_of_scipy(self):
        rows, _ = batch(300, seed=2)
        x = np.random.default_rng(3).uniform(TABLE.first[2], TABLE.last, 300)
        knots = tuple(first + step * np.arange(-5, cells + 6) for first, step, cells
                      in zip(TABLE.first, TABLE.step, TABLE.cells, strict=True))  # fmt: skip
        expected = NdBSpline(knots, TABLE.coefficients.astype(float), 5)(np.stack([*rows[:2], x], axis=1))
        place = (x - TABLE.first[2]) / TABLE.step[2]
        cell = place.astype(int)
        six = pieces_of(TABLE, rows)[np.arange(300), cell]
        found = [np.polynomial.polynomial.polyval(z, c) for z, c in zip(place - cell, six, strict=True)]
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)

    def test_surfaces_outside_have_no_pieces(self):
        rows = np.array([[0.05, 0.8, 0.8, math.nan], [4.0, 0.1, 4.0, 4.0]])
        out = np.empty((4, int(TABLE.cells[2]), 6))
        assert core.spline_pieces(*TABLE.core_table, *rows, None, None, None, out) == 3
        assert np.isnan(out).all(axis=(1, 2)).tolist() == [True, True, False, True]


class TestBits:
    """An answer is the same, whatever is asked beside it."""

    def test_alone_in_a_batch_and_with_pieces(self):
        rows, u = batch(400)
        everyone = np.arange(400)
        out = fill(rows, everyone, u)
        force = np.where(out[0] > 0, np.minimum(out[0], 1e3), 1e-3)
        gaps, area = separations(rows, everyone, force), np.random.default_rng(1).uniform(0, 0.5, 400)
        k = flow(rows, everyone, u, area)
        mixed = np.random.default_rng(2).permutation(np.tile(everyone, 3))
        pieces, own = pieces_of(TABLE, rows), pieces_of(FLOW, rows)
        for made, made_flow in ((None, None), (pieces, own)):
            np.testing.assert_array_equal(fill(rows, mixed, u[mixed], pieces=made), out[:, mixed])
            np.testing.assert_array_equal(separations(rows, mixed, force[mixed], pieces=made), gaps[mixed])
            np.testing.assert_array_equal(flow(rows, mixed, u[mixed], area[mixed], pieces=made_flow), k[mixed])
        for n in range(0, 400, 7):
            one, first = np.ascontiguousarray(rows[:, n : n + 1]), np.zeros(1, np.int64)
            np.testing.assert_array_equal(fill(one, first, u[n : n + 1])[:, 0], out[:, n])
            np.testing.assert_array_equal(separations(one, first, force[n : n + 1])[0], gaps[n])
            np.testing.assert_array_equal(flow(one, first, u[n : n + 1], area[n : n + 1])[0], k[n])

    def test_the_table_in_python(self):
        rows, u = batch(FEW + 30)
        everyone = np.arange(u.size)
        out, few = TABLE.fill(rows, everyone, u), np.ascontiguousarray(rows[:, :3])
        many = np.tile(np.arange(3), 4000)
        np.testing.assert_array_equal(TABLE.fill(few, many, u[many]), out[:, many])
        force = out[0, :3].clip(1e-9)
        np.testing.assert_array_equal(
            TABLE.separations(few, many, force[many]), TABLE.separations(few, np.arange(3), force)[many]
        )


@pytest.mark.parametrize("used", CORES)
class TestAnyInput:
    def test_of_gaps_forces_and_areas(self, used):
        rows, _ = batch(4)
        x = np.array(BAD)
        for pieces in (None, pieces_of(TABLE, rows, used)):
            out = fill(rows, np.zeros(x.size, np.int64), x, used, pieces)
            assert np.isnan(out[:, 0]).all()
            np.testing.assert_array_equal(out[:, [1, 5]], 0.0)
            full = x <= 0
            assert np.isinf(out[0, full]).all()
            np.testing.assert_array_equal(out[1, full], 1.0)
            # as at the least separation that counts
            np.testing.assert_array_equal(
                out[:2, 3], fill(rows, np.zeros(1, np.int64), np.array([1e-300]), used)[:2, 0]
            )
            u = separations(rows, np.zeros(x.size, np.int64), x, used, pieces)
            assert np.isfinite(u).tolist() == (x == 5e-324).tolist()
            assert u[3] == pytest.approx(rows[2, 0], rel=1e-12)
        for pieces in (None, pieces_of(FLOW, rows, used)):
            for area in BAD:
                k = flow(rows, np.zeros(x.size, np.int64), x, np.full(x.size, area), pieces)
                assert np.isnan(k).tolist() == (np.isnan(x) | np.isnan(area)).tolist()
                assert area < 0.4 or not np.nan_to_num(k).any()

    def test_of_surfaces_and_owners(self, used):
        rows, u = batch(len(BAD) * 3, seed=4)
        for row in range(3):
            rows[row, row * len(BAD) : (row + 1) * len(BAD)] = BAD
        everyone = np.arange(u.size)
        out, inside = fill(rows, everyone, np.full(u.size, 0.5), used), TABLE.covers(*rows[:2]) & (rows[2] >= 1e-300)
        assert np.isfinite(out).all(axis=0).tolist() == inside.tolist()
        assert inside.sum() == 2  # h_max of infinity and 1e308
        assert np.isfinite(separations(rows, everyone, np.full(u.size, 1e-3), used)).tolist() == inside.tolist()
        k = flow(rows, everyone, np.full(u.size, 0.5), np.full(u.size, 0.1))
        assert np.isfinite(k).tolist() == FLOW.covers(*rows[:2]).tolist()
        rows, _ = batch(3)
        wrong = np.array([-1, 3, 2**62, -(2**62), 1])
        for pieces in (None, pieces_of(TABLE, rows, used)):
            found = (
                *fill(rows, wrong, np.full(5, 0.5), used, pieces),
                separations(rows, wrong, np.full(5, 0.1), used, pieces),
            )
            assert (np.isfinite(found) == [*[False] * 4, True]).all()
        nobody, half = np.empty((3, 0)), np.full(5, 0.5)
        for ask in (fill, separations):
            with pytest.raises(ValueError, match="sizes"):
                ask(nobody, wrong, half, used)
        with pytest.raises(ValueError, match="sizes"):
            flow(nobody, wrong, half, half)


@pytest.mark.parametrize(("hurst", "log_zeta_1"), [(0.1, 1.1), (0.37, 5.0), (1.0, 11.5), (1e-9, 2.0), (1 - 1e-12, 3.0)])
def test_moments_of_self_affine_surfaces(hurst, log_zeta_1):
    alpha, gradient = np.empty(1), np.empty(1)
    assert core.self_affine(np.array([hurst]), np.array([log_zeta_1]), alpha, gradient) == 0
    with mpmath.workdps(40):
        m0, m2, m4 = (mpmath.quad(lambda t, k=k: mpmath.exp((2 * k - 2 * mpmath.mpf(hurst)) * t), [0, log_zeta_1])
                      for k in range(3))  # fmt: skip
        assert alpha[0] == pytest.approx(float(1.5 * m0 * m4 / m2**2), rel=4e-15)
        assert gradient[0] == pytest.approx(float(mpmath.sqrt(m2 / m0)), rel=2e-15)
    assert alpha[0] == pytest.approx(Spectrum.self_affine(hurst, math.exp(log_zeta_1)).alpha, rel=1e-13)
    for bad in BAD:
        given = np.array([bad, 0.5]), np.array([1.0, bad])
        out = np.empty((2, 2))
        assert core.self_affine(*given, *out) == np.isnan(out[0]).sum() == np.isnan(out[1]).sum() >= 1
