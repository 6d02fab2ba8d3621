"""The file of the calibrated law: its table, what that is worth, and how far theories are from simulation."""

from __future__ import annotations

import dataclasses
import datetime
import functools
import json
import os
import pathlib
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from generate.boundary_elements.evidence import Case, TheoryCurve
from generate.calibrated_file import QUANTITIES, bins_of, made_by, nodes_of, variable, write_part
from generate.splines import coefficients
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.calibrated import Constants, Law, Spectrum
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.calibrated_table import AXES, load
from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.persson import Persson

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
SELF_AFFINE = Surface(0.8, 1.0, 100.0, 1.0, 3.0)  # any: theories' scatter has one name on all of them
MIN_ERRORS = 5  # that state a scatter
STATISTICS = ("bias", "standard_deviation", "largest_of_nine_in_ten", "number")
MODULES = (
    "mbma_tables.laws.calibrated",
    "mbma_tables.laws.map_curves",
    "generate.calibrated",
    "generate.calibrated_bars",
    "generate.calibrated_file",
    "generate.calibrated_table",
)
LONG_NAMES = {
    "hurst": "Hurst exponent",
    "log_zeta_1": "natural logarithm of q1/q0",
    "log_separation": "natural logarithm of the mean separation over h_rms",
}

Summary = Callable[[Sequence[Case], Callable[[Case], Any]], dict[str, Any]]


def _made(curves: dict[int, TheoryCurve], one: Case) -> TheoryCurve:
    return curves[id(one)]


def others(found: Sequence[Case], summary: Summary) -> dict[str, dict[str, Any]]:
    """Errors of theories that nothing was fitted for, on all self-affine surfaces of two or more waves a side."""
    told = {}
    variants = [Mbma(variant=name, outside="nan") for name in ("reported", "printed", "fitted")]
    for theory in (*variants, Persson(), Persson("simplified"), GreenwoodWilliamson()):
        reached: list[tuple[Case, TheoryCurve]] = []
        for one in (one for one in found if one.kind == "self_affine" and one.gaussian):
            curve = TheoryCurve(theory, one)
            kept = np.isfinite(curve.separation(one.force))
            if kept.sum() > 3:
                reached.append((one.at(kept), curve))
        made = {id(one): curve for one, curve in reached}
        told[theory.scatter_name(SELF_AFFINE)] = summary([one for one, _ in reached], functools.partial(_made, made))
    return told


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
    return np.array(
        [log_force(Law(Spectrum.self_affine(float(hurst), float(np.exp(z))), None, constants)) for z in LOG_ZETA]
    )


def certificate(path: pathlib.Path) -> dict[str, float]:
    """Largest and 99% relative errors of the table in a file, against the law's own quadrature at held-out points."""
    table, rng = load(path), np.random.default_rng(20)
    surfaces, points = CERTIFICATE
    misses = []
    for _ in range(surfaces):
        # one in five on each edge
        hurst, log_zeta = (
            float(np.clip(low + (high - low) * rng.uniform(-0.3, 1.3), low, high))
            for low, high in (COVERED["hurst"], COVERED["log_zeta_1"])
        )
        top = rng.uniform(*HIGHEST)
        spectrum = Spectrum.self_affine(hurst, float(np.exp(log_zeta)))
        far = NEAREST * top
        u = np.concatenate(
            [
                rng.uniform(0, far, points // 2),
                np.exp(rng.uniform(COVERED["log_separation"][0], np.log(far), points // 2)),
            ]
        )
        out = table.fill(np.array([[hurst], [log_zeta], [top]]), np.zeros(u.size, np.int64), u)
        law = Law(spectrum, top, table.constants)
        force, stiffness = law.force_and_stiffness(u)
        exact = (force, stiffness, law.area(force))
        misses.append([np.abs(mine / theirs - 1) for mine, theirs in zip(out[[0, 2, 1]], exact, strict=True)])
    values = np.concatenate(misses, axis=1)
    names = ("force", "stiffness", "area")
    return {f"largest_error_{name}": float(row.max()) for name, row in zip(names, values, strict=True)} | {
        f"p99_error_{name}": float(np.quantile(row, 0.99)) for name, row in zip(names, values, strict=True)
    }


def _cells(told: dict[str, Any], bins: int) -> FloatArray:
    """Statistics by quantity and contact, NaN where there are none."""
    return np.array(
        [[part or [np.nan] * len(STATISTICS) for part in told[name]] + [] for name in QUANTITIES], float
    ).reshape(len(QUANTITIES), bins, len(STATISTICS))


def _stated(cells: FloatArray) -> FloatArray:
    """Root mean square errors where there are enough of them."""
    return np.where(cells[..., 3] >= MIN_ERRORS, np.hypot(cells[..., 0], cells[..., 1]), np.nan)


def _attributes(told: dict[str, Any], constants: Constants, theories: list[str], sets: list[str]) -> dict[str, Any]:
    """What the file says of itself."""
    return {
        "Conventions": "CF-1.11",
        "title": "Contact of rough surfaces: Persson's energy integral calibrated on boundary elements, tabulated",
        "institution": "mbma_tables contributors",
        "source": "mbma_tables.laws.calibrated, constants fitted to the training set of the boundary-element campaign",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate calibrated",
        "references": "docs/calibrated.md",
        "comment": "F(u) = F_G(u) - F_G(h_max); lengths in h_rms. "
        "quantity: area at equal force, force at equal mean separation, stiffness at equal force. calibrated_map: "
        "where a map is at hand. stated_scatter: of calibrated from cross-validation, of calibrated_map on the "
        "training set, of other theories on self-affine surfaces",
        "mbma_kind": "calibrated",
        "theories": " ".join(theories),
        "quantities": " ".join(QUANTITIES),
        "statistics": " ".join(STATISTICS),
        "sets": "; ".join(sets),
        **{f"law_{name}": value for name, value in dataclasses.asdict(constants).items()},
        **{f"map_{name}": value for name, value in told["map_constants"].items()},
        "coverage": json.dumps(told["coverage"]),
        "bars": json.dumps(told["bars"]),
        "evidence": json.dumps(told["evidence"]),
        **made_by(MODULES),
    }


def dataset(told: dict[str, Any], found: Sequence[Case], summary: Summary) -> xr.Dataset:
    """The file's content but for its certificate."""
    constants = Constants(**told["constants"])
    with ProcessPoolExecutor(PROCESSES) as pool:
        values = np.array(list(pool.map(functools.partial(_row, constants), HURST)))
    edges = np.array(told["contact_edges"])
    bins = edges.size - 1
    known = others(found, summary)
    stated = {
        "calibrated": _cells(told["cross_validation"], bins),
        "calibrated_map": _cells(told["by_map"], bins),
        **{name: _cells(content, bins) for name, content in known.items()},
    }
    rows = {f"{name}, {form}": content for name, forms in told["errors"].items() for form, content in forms.items()}
    rows |= {f"self-affine, {name}": content for name, content in known.items()}
    scatter = np.array([_stated(cells) for cells in stated.values()])
    accuracy = np.array([_cells(content, bins) for content in rows.values()])
    spline = "ln F_G, F/(A0 E* g) of a surface without end: cardinal quintic B-splines"
    known_from = "statistics of ln(theory/simulation), and their number"
    data = xr.Dataset(
        {
            "spline": variable([f"{name}_knot" for name in AXES], coefficients(values, DEGREE, 3), spline),
            "stated_scatter": variable(
                ("theory", "quantity", "contact"), scatter, "root mean square of ln(theory/simulation)"
            ),
            "accuracy": variable(("set", "quantity", "contact", "statistic"), accuracy, known_from),
        },
        nodes_of(dict(zip(AXES, (HURST, LOG_ZETA, LOG_U), strict=True)), LONG_NAMES, COVERED)
        | bins_of(edges, np.sqrt(edges[1:] * edges[:-1])),
    )
    data.attrs = _attributes(told, constants, list(stated), list(rows))
    return data


def write(
    path: os.PathLike[str] | str, told: dict[str, Any], found: Sequence[Case], summary: Summary
) -> dict[str, float]:
    """Write the root of the file from what `generate calibrated` found, errors told by `summary`; the certificate."""
    data, target = dataset(told, found, summary), pathlib.Path(path)
    # single precision keeps the certificate: where ln F_G is large, force is nothing
    data.spline.encoding["dtype"] = "f4"
    data.attrs["largest_error_force"] = np.nan
    write_part(target, data)
    found_errors = certificate(target)
    data.attrs |= found_errors | {"certificate_points": CERTIFICATE[0] * CERTIFICATE[1]}
    write_part(target, data)
    return found_errors
