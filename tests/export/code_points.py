"""Many points for exported code, as a points' file: random islands, slopes, geometry and totals by the runtime."""

import functools

import numpy as np

from mbma_tables.export import conformance
from mbma_tables.export.c_code import FORM
from mbma_tables.models import closed_form_certificates
from mbma_tables.models.tables import universal_model
from mbma_tables.surfaces.variants import get_variant

POINTS = 10_000
SURFACES = 60
SHARES = (1e-4, 0.01, 0.2, 0.5, 0.9, 0.99)  # u/h_max
GAPS = (-0.9, 0.1, 0.6, 0.97)  # d/h_max
TOLERANCES = {"phi": 1e-13, "slopes": 1e-11, "geometry": 1e-13, "total": 1e-13, "status": 0.0, "formula": 1e-13}
TOLERANCES |= {"calibrated": 1e-12, "separation": 1e-12}  # whose logarithm is the table's


def random_islands():
    rng = np.random.default_rng(2008)
    axis_X, axis_mu = universal_model().content.axes
    X = rng.uniform(axis_X.low, axis_X.high, POINTS)
    mu = np.exp(rng.uniform(np.log(1e-10), np.log(axis_mu.high), POINTS))
    X[:4], mu[:4] = (axis_X.low, axis_X.low, axis_X.high, axis_X.high), (1e-8, axis_mu.high) * 2
    return X, mu


def random_formula_islands():
    """X and mu over the closed form's range, both ends and no roughness included."""
    rng = np.random.default_rng(26)
    (low, high), (_, mu_high) = (closed_form_certificates.RANGES[FORM][name] for name in ("X", "mu"))
    X, mu = rng.uniform(low, high, POINTS), np.exp(rng.uniform(np.log(1e-6), np.log(mu_high), POINTS))
    X[:2], mu[:2] = (low, high), mu_high
    return X, mu


def random_approaches():
    """Approach, hurst and zeta_1; some with hurst = 1, where powers vanish."""
    rng = np.random.default_rng(1973)
    hurst = rng.uniform(0.1, 1.0, POINTS // 10)
    hurst[:20] = 1.0
    zeta_1 = np.exp(rng.uniform(np.log(4.0), np.log(1e6), hurst.size))
    return np.exp(rng.uniform(np.log(1e-9), np.log(12.0), hurst.size)), hurst, zeta_1


def random_surfaces():
    rng = np.random.default_rng(48)
    _, hurst, zeta_1 = random_approaches()
    found = []
    for H, ratio in zip(hurst[:SURFACES], zeta_1[:SURFACES], strict=True):
        q0, h_rms = np.exp(rng.uniform(-8.0, 8.0, 2))
        found.append(tuple(map(float, (H, q0, q0 * ratio, h_rms, h_rms * rng.uniform(2.0, 6.0)))))
    return found


@functools.cache
def points_text(variant="reported"):
    model, rule = universal_model(), get_variant(variant)
    lines = [
        *conformance.phi_rows(model, *random_islands()),
        *conformance.status_rows(model),
        *conformance.formula_rows(*random_formula_islands()),
    ]
    lines += conformance.geometry_rows(*random_approaches(), rule)
    for surface in random_surfaces():
        lines += conformance.total_rows(surface, surface[4] * np.array(GAPS), rule)
    return "\n".join(lines) + "\n"


@functools.cache
def calibrated_text():
    """Rows of the calibrated law, of the surfaces that its table holds."""
    held = [surface for surface in random_surfaces() if 3.01 < surface[2] / surface[1] < 9.9e4]
    return "\n".join(line for surface in held for line in conformance.calibrated_rows(surface, SHARES, 7.5)) + "\n"


def write_points(folder, variant="reported"):
    path = folder / "many_points.csv"
    path.write_text(points_text(variant) + calibrated_text(), encoding="utf-8")
    return path


def assert_equal_to_runtime(replay):
    assert replay.failed == 0
    islands = {"phi": POINTS, "slopes": POINTS, "geometry": POINTS // 10, "status": 10, "formula": POINTS}
    totals, calibrated = 4 * SURFACES, calibrated_text().count("\n") // 2
    contacts = {"total": totals, "calibrated": calibrated, "separation": calibrated}
    assert replay.points == islands | contacts
    for kind, largest in replay.largest.items():
        assert largest <= TOLERANCES[kind], (kind, largest)
