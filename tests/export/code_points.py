"""Many points for exported code, as a points' file: random islands and surfaces by the runtime."""

import functools

import numpy as np

from mbma_tables.export import conformance
from mbma_tables.models.closed_form_certificates import RANGES
from mbma_tables.models.tables import universal_model
from mbma_tables.surfaces.variants import get_variant

POINTS, SURFACES = 10_000, 60
SHARES = (1e-4, 0.01, 0.2, 0.5, 0.9, 0.99)  # u/h_max
DEPTHS = (1.9, 0.9, 0.4, 0.03)  # (h_max - d)/h_max
TOLERANCES = {"phi": 1e-13, "geometry": 1e-13, "total": 1e-13, "formula": 1e-13}
TOLERANCES |= {"calibrated": 1e-12, "separation": 1e-12}  # whose logarithm is the table's


def random_islands():
    """X and mu over the table, then over the closed form's range, with the ends of both."""
    rng, found = np.random.default_rng(2008), []
    axes, form = universal_model().content.axes, RANGES[conformance.FORM]
    for (low, high), least, most in (
        ((axes[0].low, axes[0].high), 1e-10, axes[1].high),
        (form["X"], 1e-6, form["mu"][1]),
    ):
        X = rng.uniform(low, high, POINTS // 2)
        mu = np.exp(rng.uniform(np.log(least), np.log(most), X.size))
        X[:4], mu[:4] = (low, low, high, high), (least, most) * 2
        found.append((X, mu))
    return np.concatenate(found, axis=1)


@functools.cache
def points_text(variant):
    """The points' file; some surfaces have hurst = 1, where powers vanish, and some the calibrated table lacks."""
    model, rng = universal_model(), np.random.default_rng(48)
    islands = random_islands()
    lines = [*conformance.rows("phi", islands, model.answer(*islands)), *conformance.formula_rows(*islands)]
    for hurst in [*np.ones(3), *rng.uniform(0.1, 1.0, SURFACES - 3)]:
        (q0, h_rms), zeta_1 = np.exp(rng.uniform(-8.0, 8.0, 2)), np.exp(rng.uniform(np.log(4.0), np.log(1e6)))
        surface = tuple(map(float, (hurst, q0, q0 * zeta_1, h_rms, h_rms * rng.uniform(2.0, 6.0))))
        approach = np.exp(rng.uniform(np.log(1e-9), np.log(12.0), POINTS // 10 // SURFACES))
        shares = SHARES if zeta_1 < 9.9e4 else ()
        lines += conformance.surface_rows(surface, get_variant(variant), approach, DEPTHS, shares, 7.5)
    return "\n".join(lines) + "\n"


def write_points(folder, variant="reported"):
    path = folder / "many_points.csv"
    path.write_text(points_text(variant), encoding="utf-8")
    return path


def assert_equal_to_runtime(replay):
    assert replay.failed == 0
    lines = points_text("reported").splitlines()
    assert {kind: n for kind, n in replay.points.items() if n} == {
        kind: sum(line.startswith(f"{kind},") for line in lines) for kind in TOLERANCES
    }
    assert replay.points["formula"] > POINTS // 2
    assert replay.points["total"] == 4 * SURFACES
    assert replay.points["calibrated"] > 5 * SURFACES // 2
    for kind, most in TOLERANCES.items():
        assert replay.largest[kind] <= most, (kind, replay.largest[kind])
