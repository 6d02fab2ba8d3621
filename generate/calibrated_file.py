"""What fits of laws share, and their file tables/calibrated.nc: the calibrated law, and groups of other laws."""

import dataclasses
import datetime
import hashlib
import itertools
import json
import os
import pathlib
import tomllib
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline
from scipy.optimize import least_squares

from generate.files import source_digest, versions
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
NODES = {
    "hurst": np.linspace(0.01, 1.09, 42),
    "log_zeta_1": np.linspace(np.log(1.7), np.log(2.5e5), 46),
    "log_separation": np.linspace(np.log(5e-7), np.log(10.0), 150),
}
LOG_FORCE = np.linspace(-38.0, 1.3, 240)  # ln F^ between whose separations the nodes lie
DEGREE = 5
CERTIFICATE = (300, 40)  # held-out surfaces, separations of each
HIGHEST = (2.5, 6.0)  # their h_max/h_rms
NEAREST = 0.95  # of h_max: nearer to it force is a small difference
PROCESSES = 2
MIN_ERRORS = 5  # that state a scatter
TEXTS = tomllib.loads(pathlib.Path(__file__).with_name("laws.toml").read_text(encoding="utf-8"))
Fitted = TypeVar("Fitted", bound=Any)  # a dataclass of constants
Variable = tuple[Any, Any, dict[str, Any]]
Stated = dict[str, FloatArray]  # statistics of errors by theory, or by set


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


def attributes(texts: dict[str, Any], made_by: dict[str, str]) -> dict[str, Any]:
    """Attributes of a group, by its texts in a TOML file and the programs that made it."""
    return {
        "Conventions": "CF-1.11",
        "title": texts["title"],
        "institution": "mbma_tables contributors",
        "source": texts["source"].format_map(made_by),
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate {texts['command']}",
        "versions": json.dumps(versions() | made_by),
        "code_sha256": source_digest(tuple(texts["modules"])),
    } | {name: texts[name] for name in ("comment", "references") if name in texts}


def law_group(
    kind: str, arrays: dict[str, tuple[Any, Any]], constants: dict[str, Any], facts: dict[str, Any]
) -> xr.Dataset:
    """A group of the file: arrays with their dimensions, dataclasses of constants by prefix, and further attributes."""
    texts = TEXTS[kind]
    found = xr.Dataset({name: variable(*array, texts["variables"][name]) for name, array in arrays.items()})
    found.attrs = attributes(texts, {}) | texts["facts"] | facts
    for prefix, own in constants.items():
        found.attrs |= {f"{prefix}_{name}": value for name, value in dataclasses.asdict(own).items()}
    return found


def law_table(
    kind: str, nodes: dict[str, FloatArray], covered: dict[str, Any], arrays: dict[str, tuple[Any, Any]], **more: Any
) -> xr.Dataset:
    """A group with a table over these nodes, of which a range is answered, and statistics by bins of contact."""
    found = law_group(kind, {name: (name, values) for name, values in nodes.items()} | arrays, **more)
    for name, ends in covered.items():
        found[name].attrs["covered"] = ends
    return found.set_coords(["contact_low", "contact_high"])


def bins(edges: Sequence[float], middles: Any) -> dict[str, tuple[Any, Any]]:
    ends = np.array(edges)
    return {
        "contact": ("contact", middles),
        "contact_low": ("contact", ends[:-1]),
        "contact_high": ("contact", ends[1:]),
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
                kinds = {n: {"dtype": v.encoding.get("dtype", v.dtype)} for n, v in part.variables.items()}
                numbers = [n for n, v in part.variables.items() if v.dtype.kind in "fiu"]
                encoding = {n: packed | (kinds[n] if n in numbers else {}) for n in part.variables}
                part.to_netcdf(name, "a" if k else "w", engine="netcdf4", group=own, encoding=encoding)

    body = written_bytes(path.name, store)
    write_file(path, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n", make_folders=True)


def log_force(law: Law) -> FloatArray:
    """ln F_G at the nodes in separation."""
    log_u = NODES["log_separation"]
    u, _ = law.separation_persson(np.exp(LOG_FORCE))
    x = make_interp_spline(np.log(u[::-1]), LOG_FORCE[::-1], k=5)(log_u)
    for _ in range(2):
        value, slope = law.separation_persson(np.exp(x))
        x = x - np.clip((np.log(value) - log_u) * value / slope, -0.5, 0.5)
    return np.asarray(x - law.tail * np.exp(3 * log_u))


def _row(constants: Constants, hurst: float) -> FloatArray:
    spectra = (Spectrum.self_affine(float(hurst), float(np.exp(z))) for z in NODES["log_zeta_1"])
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
    path: pathlib.Path, constants: Constants, map_constants: Any, edges: Any, stated: Stated, sets: Stated, facts: Any
) -> dict[str, float]:
    """Write the root of the file, with statistics of errors by theory and by set; the table's certificate."""
    values = np.array([*results("table", _row, [(constants, hurst) for hurst in NODES["hurst"]], PROCESSES)])
    bias, deviation, _, number = np.moveaxis(np.array(list(stated.values())), -1, 0)
    scatter = np.where(number >= MIN_ERRORS, np.hypot(bias, deviation), np.nan)
    arrays = {
        "spline": ([f"{name}_knot" for name in AXES], coefficients(values, DEGREE, 3)),
        "stated_scatter": (("theory", "quantity", "contact"), scatter),
        "accuracy": (("set", "quantity", "contact", "statistic"), np.array(list(sets.values()))),
        **bins(edges, np.sqrt(np.multiply(edges[1:], edges[:-1]))),
    }
    known: dict[str, Any] = {"theories": " ".join(stated), "quantities": " ".join(QUANTITIES), "sets": "; ".join(sets)}
    known |= {name: json.dumps(value) for name, value in facts.items()} | {"largest_error_force": np.nan}
    own = {"law": constants, "map": map_constants}
    data = law_table("calibrated", NODES, COVERED, arrays, constants=own, facts=known)
    # single precision keeps the certificate: where ln F_G is large, force is nothing
    data.spline.encoding["dtype"] = "f4"
    # read again to be certified
    write_part(path, data)
    found = certificate(path)
    data.attrs |= found | {"certificate_points": CERTIFICATE[0] * CERTIFICATE[1]}
    write_part(path, data)
    return found
