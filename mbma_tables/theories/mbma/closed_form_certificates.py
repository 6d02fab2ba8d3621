"""Ranges of the closed forms, and their certificates; the forms are in `closed_forms.toml`.

Made by `python -m generate formulas`; do not edit.
"""

# fmt: off

from mbma_tables.islands.island_models import Certificate

RANGES: dict[str, dict[str, tuple[float, float]]] = {
    "pocket": {"X": (0.8, 25.0), "mu": (0.0, 2000.0)},
    "standard": {"X": (0.0, 25.0), "mu": (0.0, 2000.0)},
    "long": {"X": (0.0, 25.0), "mu": (0.0, 2000.0)},
    "totals": {"d_over_h_rms": (-4.5, 4.5), "h_max_over_h_rms": (3.0, 4.5), "zeta_1": (10.0, 1000.0), "hurst": (0.5,
        1.0), "area": (1e-06, 1.0)},
}

CERTIFICATES: dict[str, dict[str, Certificate]] = {
    "pocket": {"phi_F": Certificate(coefficients=8, largest=0.0371, median=0.00521, points=20000, worst_at={"X": 8.571,
        "mu": 30.85}), "phi_A": Certificate(coefficients=10, largest=0.0317, median=0.00305, points=20000,
        worst_at={"X": 0.8, "mu": 2000.0})},
    "standard": {"phi_F": Certificate(coefficients=23, largest=0.00164, median=0.000384, points=20000, worst_at={"X":
        0.0, "mu": 0.6372}), "phi_A": Certificate(coefficients=23, largest=0.00768, median=0.00201, points=20000,
        worst_at={"X": 6.16, "mu": 0.06695})},
    "long": {"phi_F": Certificate(coefficients=43, largest=0.00054, median=0.000138, points=20000, worst_at={"X":
        0.3042, "mu": 0.5951}), "phi_A": Certificate(coefficients=53, largest=0.000718, median=0.000205, points=20000,
        worst_at={"X": 8.683, "mu": 26.31})},
    "totals": {"pressure": Certificate(coefficients=40, largest=0.0906, median=0.0272, points=46081,
        worst_at={"d_over_h_rms": 3.328, "h_max_over_h_rms": 3.718, "zeta_1": 1000.0, "hurst": 0.5917}), "area":
        Certificate(coefficients=40, largest=0.0968, median=0.0329, points=46081, worst_at={"d_over_h_rms": 2.999,
        "h_max_over_h_rms": 4.5, "zeta_1": 615.1, "hurst": 1.0})},
}
