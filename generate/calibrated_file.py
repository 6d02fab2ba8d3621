"""What fits of laws share, and their file tables/calibrated.nc: the calibrated law, and groups of other laws."""

import dataclasses
import datetime
import hashlib
import itertools
import json
import os
import pathlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline
from scipy.optimize import least_squares

from generate.provenance import source_digest, versions
from generate.splines import coefficients
from generate.workers import results
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.data import read_groups
from mbma_tables.laws.calibrated import Constants, Law, Spectrum
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, SEAL
from mbma_tables.theories.calibrated_table import AXES, load

QUANTITIES = ("area", "force", "stiffness")  # as the file names them: the library's "pressure" is "force" there
FOLDS = 5
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
    *("mbma_tables.laws.calibrated", "mbma_tables.laws.map_curves"),
    *("generate.calibrated", "generate.calibrated_file"),
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
Fitted = TypeVar("Fitted", bound=Any)  # a dataclass of constants
Variable = tuple[Any, Any, dict[str, Any]]


def fitted(
    start: Fitted, names: Sequence[str], residuals: Callable[[Fitted], Iterable[FloatArray]], **options: Any
) -> Fitted:
    """Constants of which the named ones make the residuals small, by robust least squares with these options."""

    def trial(values: FloatArray) -> Fitted:
        return dataclasses.replace(start, **dict(zip(names, map(float, values), strict=True)))

    first = [getattr(start, name) for name in names]
    found = least_squares(lambda x: np.concatenate([*residuals(trial(x))]), first, loss="soft_l1", **options)
    return trial(found.x)


def cross_validated(seen: Sequence[Any], fit: Callable[[list[Any]], Fitted]) -> dict[Any, Fitted]:
    """For the node of each surface, constants from other nodes: a fifth of them is left out at a time."""
    order, own = sorted({one.node for one in seen}), dict[Any, Fitted]()
    for fold in range(FOLDS):
        out = set(order[fold::FOLDS])
        own |= dict.fromkeys(out, fit([one for one in seen if one.node not in out]))
    return own


def binned(area: FloatArray, values: FloatArray, edges: Sequence[float]) -> list[FloatArray]:
    """Finite values at contacts between edges, bin by bin."""
    known = np.isfinite(values)
    return [values[(area >= low) & (area < high) & known] for low, high in itertools.pairwise(edges)]


def by_bin(area: Any, values: Any, edges: Sequence[float], *statistics: Callable[[FloatArray], Any]) -> FloatArray:
    """Statistics of finite values at contacts between edges, (bins, statistics); NaN in an empty bin."""
    parts = binned(np.asarray(area), np.asarray(values), edges)
    return np.array([[f(part) if part.size else np.nan for f in statistics] for part in parts], float)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def within(sizes: FloatArray) -> list[float]:
    """Shares of errors, over their stated standard deviation, within one and two."""
    return [float(np.mean(np.abs(sizes) < limit)) for limit in (1, 2)]


def variable(dimensions: str | Sequence[str], values: Any, meaning: str, **attributes: Any) -> Variable:
    return dimensions, values, {"long_name": meaning, "units": "1", **attributes}


def coordinates(
    nodes: dict[str, FloatArray], meanings: dict[str, str], covered: dict[str, Any], edges: FloatArray, middles: Any
) -> dict[str, Variable]:
    """Coordinates of a table's nodes, with the range that is answered, and of bins of contact."""
    return {name: variable(name, values, meanings[name], covered=covered[name]) for name, values in nodes.items()} | {
        "contact": variable("contact", middles, "A/A0, middle of a bin"),
        "contact_low": variable("contact", edges[:-1], "A/A0, low end of a bin"),
        "contact_high": variable("contact", edges[1:], "A/A0, high end of a bin"),
    }


def made_by(modules: Sequence[str]) -> dict[str, str]:
    return {
        "versions": json.dumps(versions(), sort_keys=True),
        "source_sha256": source_digest(tuple(modules)),
        "source_modules": " ".join(modules),
    }


def write_part(path: os.PathLike[str] | str, data: xr.Dataset, group: str = "/") -> None:
    """Write the root, or one group, of a file, compressed and sealed; what else the file holds stays as it is."""
    path = pathlib.Path(path)
    parts = (read_groups(path) if path.exists() else {}) | {group: data}
    packed = {"zlib": True, "complevel": 9, "shuffle": True, "_FillValue": None}

    def store(name: str) -> None:
        with HDF5_LOCK:
            for k, (own, part) in enumerate(sorted(parts.items())):
                # of a variable's encoding, how its numbers are stored
                kinds = {
                    n: v.encoding.get("dtype", v.dtype) for n, v in part.variables.items() if v.dtype.kind in "fiu"
                }
                encoding = {n: packed | ({"dtype": kinds[n]} if n in kinds else {}) for n in part.variables}
                part.to_netcdf(name, "a" if k else "w", engine="netcdf4", group=own, encoding=encoding)

    body = written_bytes(path.name, store)
    write_file(path, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n", make_folders=True)


def log_force(law: Law) -> FloatArray:
    """ln F_G at the nodes in separation."""
    u, _ = law.separation_persson(np.exp(LOG_FORCE))
    x = make_interp_spline(np.log(u[::-1]), LOG_FORCE[::-1], k=5)(LOG_U)
    for _ in range(2):
        value, slope = law.separation_persson(np.exp(x))
        x = x - np.clip((np.log(value) - LOG_U) * value / slope, -0.5, 0.5)
    return np.asarray(x - law.tail * np.exp(3 * LOG_U))


def _row(constants: Constants, hurst: float) -> FloatArray:
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


def write(
    path: os.PathLike[str] | str,
    constants: Constants,
    map_constants: Any,
    edges: Sequence[float],
    stated: dict[str, FloatArray],
    sets: dict[str, FloatArray],
    facts: dict[str, Any],
) -> dict[str, float]:
    """Write the root of the file, with statistics of errors by theory and by set; the table's certificate."""
    values = np.array([*results("table", _row, [(constants, hurst) for hurst in HURST], PROCESSES)])
    bias, deviation, _, number = np.moveaxis(np.array(list(stated.values())), -1, 0)
    scatter = np.where(number >= MIN_ERRORS, np.hypot(bias, deviation), np.nan)
    spline = "ln F_G, F/(A0 E* g) of a surface without end: cardinal quintic B-splines"
    meaning = "statistics of ln(theory/simulation), and their number"
    ends, nodes = np.array(edges), dict(zip(AXES, (HURST, LOG_ZETA, LOG_U), strict=True))
    data = xr.Dataset(
        {
            "spline": variable([f"{name}_knot" for name in AXES], coefficients(values, DEGREE, 3), spline),
            "stated_scatter": variable(
                ("theory", "quantity", "contact"), scatter, "root mean square of ln(theory/simulation)"
            ),
            "accuracy": variable(("set", "quantity", "contact", "statistic"), np.array(list(sets.values())), meaning),
        },
        coordinates(nodes, LONG_NAMES, COVERED, ends, np.sqrt(ends[1:] * ends[:-1])),
    )
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
    # read again to be certified
    write_part(path, data)
    found = certificate(pathlib.Path(path))
    data.attrs |= found | {"certificate_points": CERTIFICATE[0] * CERTIFICATE[1]}
    write_part(path, data)
    return found
