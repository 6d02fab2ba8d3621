"""The file of the calibrated law: its table, the table's errors, and how far theories are from simulation."""

import dataclasses
import datetime
import functools
import json
import os
import pathlib
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from generate.calibrated_file import QUANTITIES, coordinates, made_by, variable, write_part
from generate.splines import coefficients
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.calibrated import Constants, Law, Spectrum
from mbma_tables.theories.calibrated_table import AXES, load

# answered inside; nodes reach further, since a spline is worst near its ends
COVERED = {"hurst": (0.1, 1.0), "log_zeta_1": (np.log(3.0), np.log(1e5)), "log_separation": (np.log(1e-6), np.log(8.0))}
HURST = np.linspace(0.01, 1.09, 42)
LOG_ZETA = np.linspace(np.log(1.7), np.log(2.5e5), 46)
LOG_U = np.linspace(np.log(5e-7), np.log(10.0), 150)
LOG_FORCE = np.linspace(-38.0, 1.3, 240)  # ln F^ between whose separations the nodes lie
DEGREE = 5
CERTIFICATE = (300, 40)  # held-out surfaces, separations of each
HIGHEST = (2.5, 6.0)  # their h_max/h_rms
NEAREST = 0.95  # of h_max: nearer to it force is a small difference
PROCESSES = 2
MIN_ERRORS = 5  # that state a scatter
STATISTICS = ("bias", "standard_deviation", "largest_of_nine_in_ten", "number")
MODULES = (
    *("mbma_tables.laws.calibrated", "mbma_tables.laws.map_curves", "generate.calibrated"),
    *("generate.calibrated_bars", "generate.calibrated_file", "generate.calibrated_table"),
)
LONG_NAMES = {
    "hurst": "Hurst exponent",
    "log_zeta_1": "natural logarithm of q1/q0",
    "log_separation": "natural logarithm of the mean separation over h_rms",
}
COMMENT = (
    "F = F_G (1 - r)^(3/2)/(1 + r), r = F_G(h_max)/F_G(u); lengths in h_rms. quantity: area at equal force, force at "
    "equal mean separation, stiffness at equal force. calibrated_map: where a map is at hand. stated_scatter: of "
    "calibrated from cross-validation, of calibrated_map on the training set, of other theories on self-affine surfaces"
)


def log_force(law: Law) -> FloatArray:
    """ln F_G at the nodes in separation."""
    u, _ = law.separation_persson(np.exp(LOG_FORCE))
    x = make_interp_spline(np.log(u[::-1]), LOG_FORCE[::-1], k=5)(LOG_U)
    for _ in range(2):
        value, slope = law.separation_persson(np.exp(x))
        x = x - np.clip((np.log(value) - LOG_U) * value / slope, -0.5, 0.5)
    return np.asarray(x - law.tail * np.exp(3 * LOG_U))


def _row(constants: Constants, hurst: float) -> FloatArray:
    """`log_force` of one Hurst exponent."""
    spectra = (Spectrum.self_affine(float(hurst), float(np.exp(z))) for z in LOG_ZETA)
    return np.array([log_force(Law(spectrum, None, constants)) for spectrum in spectra])


def certificate(path: pathlib.Path) -> dict[str, float]:
    """Largest and 99% relative errors of the table in a file, against the law's own quadrature at held-out points."""
    table, rng, misses = load(path), np.random.default_rng(20), []
    surfaces, points = CERTIFICATE
    for _ in range(surfaces):
        # one in five on each edge
        hurst, log_zeta = (
            float(np.clip(low + (high - low) * rng.uniform(-0.3, 1.3), low, high))
            for low, high in (COVERED["hurst"], COVERED["log_zeta_1"])
        )
        top = rng.uniform(*HIGHEST)
        low, far = COVERED["log_separation"][0], NEAREST * top
        u = np.concatenate([rng.uniform(0, far, points // 2), np.exp(rng.uniform(low, np.log(far), points // 2))])
        out = table.prepared(np.array([[hurst], [log_zeta], [top]]), u.size)[0]((np.zeros(u.size, np.int64), u))
        law = Law(Spectrum.self_affine(hurst, float(np.exp(log_zeta))), top, table.constants)
        force, stiffness = law.contact(u)[::2]
        misses.append(np.abs(out[[0, 2, 1]] / np.stack([force, stiffness, law.area(force)]) - 1))
    values = dict(zip(("force", "stiffness", "area"), np.concatenate(misses, axis=1), strict=True))
    largest = {f"largest_error_{name}": float(row.max()) for name, row in values.items()}
    return largest | {f"p99_error_{name}": float(np.quantile(row, 0.99)) for name, row in values.items()}


def dataset(
    constants: Constants, edges: Sequence[float], stated: dict[str, FloatArray], sets: dict[str, FloatArray]
) -> xr.Dataset:
    """The file's variables, from statistics of errors by theory and by set of surfaces."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        values = np.array(list(pool.map(functools.partial(_row, constants), HURST)))
    bias, deviation, _, number = np.moveaxis(np.array(list(stated.values())), -1, 0)
    scatter = np.where(number >= MIN_ERRORS, np.hypot(bias, deviation), np.nan)
    spline = "ln F_G, F/(A0 E* g) of a surface without end: cardinal quintic B-splines"
    known_from, ends = "statistics of ln(theory/simulation), and their number", np.array(edges)
    return xr.Dataset(
        {
            "spline": variable([f"{name}_knot" for name in AXES], coefficients(values, DEGREE, 3), spline),
            "stated_scatter": variable(
                ("theory", "quantity", "contact"), scatter, "root mean square of ln(theory/simulation)"
            ),
            "accuracy": variable(
                ("set", "quantity", "contact", "statistic"), np.array(list(sets.values())), known_from
            ),
        },
        coordinates(
            dict(zip(AXES, (HURST, LOG_ZETA, LOG_U), strict=True)),
            LONG_NAMES,
            COVERED,
            ends,
            np.sqrt(ends[1:] * ends[:-1]),
        ),
    )


def write(
    path: os.PathLike[str] | str,
    constants: Constants,
    map_constants: Any,
    edges: Sequence[float],
    stated: dict[str, FloatArray],
    sets: dict[str, FloatArray],
    facts: dict[str, Any],
) -> dict[str, float]:
    """Write the root of the file from what `generate calibrated` found; the table's certificate."""
    data, target = dataset(constants, edges, stated, sets), pathlib.Path(path)
    # single precision keeps the certificate: where ln F_G is large, force is nothing
    data.spline.encoding["dtype"] = "f4"
    data.attrs = {
        "Conventions": "CF-1.11",
        "title": "Contact of rough surfaces: Persson's energy integral calibrated on boundary elements, tabulated",
        "institution": "mbma_tables contributors",
        "source": "mbma_tables.laws.calibrated, constants fitted to the training set of the boundary-element campaign",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate calibrated",
        "references": "docs/calibrated.md",
        "comment": COMMENT,
        "mbma_kind": "calibrated",
        "theories": " ".join(stated),
        "quantities": " ".join(QUANTITIES),
        "statistics": " ".join(STATISTICS),
        "sets": "; ".join(sets),
        **{f"law_{name}": value for name, value in dataclasses.asdict(constants).items()},
        **{f"map_{name}": value for name, value in dataclasses.asdict(map_constants).items()},
        **{name: json.dumps(value) for name, value in facts.items()},
        **made_by(MODULES),
        "largest_error_force": np.nan,
    }
    write_part(target, data)
    found = certificate(target)
    data.attrs |= found | {"certificate_points": CERTIFICATE[0] * CERTIFICATE[1]}
    write_part(target, data)
    return found
