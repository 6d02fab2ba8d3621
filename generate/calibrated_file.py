"""What fits of laws share, and their file tables/calibrated.nc, with a group for each law."""

import dataclasses
import datetime
import hashlib
import itertools
import json
import os
import pathlib
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline
from scipy.optimize import least_squares
from sklearn.model_selection import PredefinedSplit

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.common.netcdf import HDF5_LOCK, SEAL
from mbma_tables.common.workers import results
from mbma_tables.tables.sources import source_digest, versions
from mbma_tables.tables.splines import coefficients
from mbma_tables.theories.calibrated.formulas import (
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
)
from mbma_tables.theories.calibrated.table import AXES, load
from mbma_tables.theories.dataset import read_groups

# as the file names them: the library's "pressure" is "force" there
QUANTITIES = ("area", "force", "stiffness")
FOLDS = 5
# answered inside; nodes reach further, since a spline is worst near its ends
# answered inside; nodes reach further, since a spline is worst near its ends
COVERED = {
    "hurst": (0.1, 1.0),
    "log_zeta_1": (np.log(3.0), np.log(1e5)),
    "log_separation": (np.log(1e-6), np.log(8.0)),
}
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
TEXTS = tomllib.loads(
    pathlib.Path(__file__).with_name("laws.toml").read_text(encoding="utf-8")
)
Fitted = TypeVar("Fitted", bound=Any)  # a dataclass of constants
Variable = tuple[str | Sequence[str], ArrayLike, dict[str, Any]]
Arrays = Mapping[
    str, tuple[str | Sequence[str], ArrayLike]
]  # dimensions and values by name
Stated = dict[str, FloatArray]  # statistics of errors by theory, or by set


def fitted(
    start: Fitted,
    names: Sequence[str],
    residuals: Callable[[Fitted], Iterable[FloatArray]],
    **options: Any,
) -> Fitted:
    """Constants of which the named ones make the residuals small.

    By robust least squares with these options.
    """

    def trial(values: FloatArray) -> Fitted:
        by_name = dict(zip(names, map(float, values), strict=True))
        return dataclasses.replace(start, **by_name)

    def residuals_at(values: FloatArray) -> FloatArray:
        return np.concatenate([*residuals(trial(values))])

    first = [getattr(start, name) for name in names]
    best = least_squares(residuals_at, first, loss="soft_l1", **options)
    return trial(best.x)


def folds(groups: Sequence[Any]) -> Iterator[tuple[Sequence[int], Sequence[int]]]:
    """Numbers of the entries of other groups, and of those of a fifth of the groups, by turns.

    A fold has every fifth group in their order, so that it spans their whole range.
    """
    rank = {group: number for number, group in enumerate(sorted(set(groups)))}
    split = PredefinedSplit([rank[group] % FOLDS for group in groups])
    for others, left_out in split.split():
        yield others.tolist(), left_out.tolist()


def cross_validated(
    seen: Sequence[Any],
    fit: Callable[[list[Any]], Fitted],
) -> dict[Any, Fitted]:
    """For the node of each surface, constants from other nodes.

    A fifth of the nodes is left out at a time.
    """
    constants_of_others = dict[Any, Fitted]()
    for others, left_out in folds([one.node for one in seen]):
        constants = fit([seen[k] for k in others])
        constants_of_others |= {seen[k].node: constants for k in left_out}
    return constants_of_others


def binned(
    area: FloatArray, values: FloatArray, edges: Sequence[float]
) -> list[FloatArray]:
    """Finite values at contacts between edges, bin by bin."""
    is_finite = np.isfinite(values)
    parts = []
    for low, high in itertools.pairwise(edges):
        inside = (area >= low) & (area < high)
        parts.append(values[inside & is_finite])
    return parts


def by_bin(
    area: ArrayLike,
    values: ArrayLike,
    edges: Sequence[float],
    *statistics: Callable[[FloatArray], Any],
) -> FloatArray:
    """Statistics of finite values at contacts between edges, (bins, statistics).

    NaN in an empty bin.
    """
    rows = []
    for part in binned(np.asarray(area), np.asarray(values), edges):
        if part.size:
            rows.append([statistic(part) for statistic in statistics])
        else:
            rows.append([np.nan] * len(statistics))
    return np.array(rows, float)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def within(sizes: FloatArray) -> list[float]:
    """Shares of errors, over their stated standard deviation, within one and two."""
    return [float(np.mean(np.abs(sizes) < limit)) for limit in (1, 2)]


def variable(
    dimensions: str | Sequence[str],
    values: ArrayLike,
    meaning: str,
    **attributes: Any,
) -> Variable:
    return dimensions, values, {"long_name": meaning, "units": "1", **attributes}


def attributes(texts: dict[str, Any], made_by: dict[str, str]) -> dict[str, Any]:
    """Attributes of a group, by its texts in a TOML file and the programs that made it."""
    today = datetime.datetime.now(datetime.UTC)
    required = {
        "Conventions": "CF-1.11",
        "title": texts["title"],
        "institution": "mbma_tables contributors",
        "source": texts["source"].format_map(made_by),
        "history": f"{today:%Y-%m-%d} python -m generate {texts['command']}",
        "versions": json.dumps(versions() | made_by),
        "code_sha256": source_digest(tuple(texts["modules"])),
    }
    optional = {name: texts[name] for name in ("comment", "references") if name in texts}
    return required | optional


def law_group(
    kind: str,
    arrays: Arrays,
    constants: dict[str, Any],
    facts: dict[str, Any],
) -> xr.Dataset:
    """A group of the file.

    Arrays with their dimensions, dataclasses of constants by prefix, and further attributes.
    """
    texts = TEXTS[kind]
    meanings = texts["variables"]
    variables = {}
    for name, (dimensions, values) in arrays.items():
        variables[name] = variable(dimensions, values, meanings[name])
    group = xr.Dataset(variables)
    group.attrs = attributes(texts, {}) | texts["facts"] | facts
    for prefix, constants_of_law in constants.items():
        for name, value in dataclasses.asdict(constants_of_law).items():
            group.attrs[f"{prefix}_{name}"] = value
    return group


def law_table(
    kind: str,
    nodes: dict[str, FloatArray],
    covered: dict[str, tuple[float, float]],
    arrays: Arrays,
    **more: Any,
) -> xr.Dataset:
    """A group with a table over these nodes, and statistics by bins of contact.

    The table answers within the covered range.
    """
    axes: Arrays = {name: (name, values) for name, values in nodes.items()}
    group = law_group(kind, {**axes, **arrays}, **more)
    for name, ends in covered.items():
        group[name].attrs["covered"] = ends
    return group.set_coords(["contact_low", "contact_high"])


def bins(edges: Sequence[float], middles: ArrayLike) -> Arrays:
    ends = np.array(edges)
    return {
        "contact": ("contact", middles),
        "contact_low": ("contact", ends[:-1]),
        "contact_high": ("contact", ends[1:]),
    }


def _encoding(part: xr.Dataset) -> dict[str, dict[str, Any]]:
    """How variables of a group are compressed, and their numbers stored."""
    compressed = {"zlib": True, "complevel": 9, "shuffle": True, "_FillValue": None}
    encoding = {}
    for name, values in part.variables.items():
        of_variable: dict[str, Any] = dict(compressed)
        # texts have no type that can be chosen
        if values.dtype.kind in "fiu":
            of_variable["dtype"] = values.encoding.get("dtype", values.dtype)
        encoding[str(name)] = of_variable
    return encoding


def write_part(path: os.PathLike[str] | str, data: xr.Dataset, group: str = "/") -> None:
    """Write the root, or one group, of a file, compressed and sealed.

    What else the file holds stays as it is.
    """
    path = pathlib.Path(path)
    parts = read_groups(path) if path.exists() else {}
    parts = parts | {group: data}

    def store(name: str) -> None:
        with HDF5_LOCK:
            for number, (part_name, part) in enumerate(sorted(parts.items())):
                # the first group makes the file
                mode: Literal["a", "w"] = "a" if number else "w"
                encoding = _encoding(part)
                part.to_netcdf(
                    name, mode, engine="netcdf4", group=part_name, encoding=encoding
                )

    body = written_bytes(path.name, store)
    seal = SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n"
    write_file(path, body + seal, make_folders=True)


def log_force(law: SpectrumLaw) -> FloatArray:
    """ln F_G at the nodes in separation."""
    log_u = NODES["log_separation"]
    u, _ = law.separation_persson(np.exp(LOG_FORCE))
    # rising separations
    first_guess = make_interp_spline(np.log(u[::-1]), LOG_FORCE[::-1], k=5)
    log_F = first_guess(log_u)
    # Newton's method for ln u(ln F) = log_u
    for _ in range(2):
        u_at, slope = law.separation_persson(np.exp(log_F))
        step = (np.log(u_at) - log_u) * u_at / slope
        log_F = log_F - np.clip(step, -0.5, 0.5)
    return np.asarray(log_F - law.tail * np.exp(3 * log_u))


def _row(constants: CalibratedConstants, hurst: float) -> FloatArray:
    rows = []
    for log_zeta in NODES["log_zeta_1"]:
        spectrum = Spectrum.self_affine(float(hurst), float(np.exp(log_zeta)))
        rows.append(log_force(SpectrumLaw(spectrum, None, constants)))
    return np.array(rows)


def _drawn(rng: np.random.Generator, low: float, high: float) -> float:
    # one in five on each edge
    place = low + (high - low) * rng.uniform(-0.3, 1.3)
    return float(np.clip(place, low, high))


def certificate(path: pathlib.Path) -> dict[str, float]:
    """Largest and 99% relative errors of the table in a file.

    Against the law's own quadrature at held-out points.
    """
    table = load(path)
    rng = np.random.default_rng(20)
    surfaces, points = CERTIFICATE
    misses = []
    for _ in range(surfaces):
        hurst = _drawn(rng, *COVERED["hurst"])
        log_zeta = _drawn(rng, *COVERED["log_zeta_1"])
        top = rng.uniform(*HIGHEST)
        # half of the separations evenly, half of them evenly in their logarithms
        lowest_log_u, _ = COVERED["log_separation"]
        farthest = NEAREST * top
        evenly = rng.uniform(0, farthest, points // 2)
        evenly_in_log = np.exp(rng.uniform(lowest_log_u, np.log(farthest), points // 2))
        u = np.concatenate([evenly, evenly_in_log])

        answer, *_ = table.prepared(np.array([[hurst], [log_zeta], [top]]), u.size)
        surface_of_point = np.zeros(u.size, np.int64)
        from_table = answer((surface_of_point, u))[[0, 2, 1]]

        law = SpectrumLaw(
            Spectrum.self_affine(hurst, float(np.exp(log_zeta))), top, table.constants
        )
        force, stiffness = law.contact(u)[::2]
        by_quadrature = np.stack([force, stiffness, law.area(force)])
        misses.append(np.abs(from_table / by_quadrature - 1))

    by_quantity = np.concatenate(misses, axis=1)
    named = dict(zip(("force", "stiffness", "area"), by_quantity, strict=True))
    largest = {f"largest_error_{name}": float(row.max()) for name, row in named.items()}
    nearly_all = {
        f"p99_error_{name}": float(np.quantile(row, 0.99)) for name, row in named.items()
    }
    return largest | nearly_all


def write(
    path: pathlib.Path,
    constants: CalibratedConstants,
    map_constants: Any,
    edges: Sequence[float],
    stated: Stated,
    sets: Stated,
    facts: dict[str, Any],
) -> dict[str, float]:
    """Write the root of the file, with statistics of errors by theory and by set.

    Returns the table's certificate.
    """
    jobs = [(constants, hurst) for hurst in NODES["hurst"]]
    values = np.array([*results("table", _row, jobs, PROCESSES)])
    bias, deviation, _, number = np.moveaxis(np.array(list(stated.values())), -1, 0)
    scatter = np.where(number >= MIN_ERRORS, np.hypot(bias, deviation), np.nan)
    accuracy = np.array(list(sets.values()))
    arrays: Arrays = {
        "spline": ([f"{name}_knot" for name in AXES], coefficients(values, DEGREE, 3)),
        "stated_scatter": (("theory", "quantity", "contact"), scatter),
        "accuracy": (("set", "quantity", "contact", "statistic"), accuracy),
        **bins(edges, np.sqrt(np.multiply(edges[1:], edges[:-1]))),
    }
    attributes_of_root: dict[str, Any] = {
        "theories": " ".join(stated),
        "quantities": " ".join(QUANTITIES),
        "sets": "; ".join(sets),
    }
    attributes_of_root |= {name: json.dumps(value) for name, value in facts.items()}
    # a reader wants one; the certificate comes below
    attributes_of_root["largest_error_force"] = np.nan
    data = law_table(
        "calibrated",
        NODES,
        COVERED,
        arrays,
        constants={"law": constants, "map": map_constants},
        facts=attributes_of_root,
    )
    # single precision keeps the certificate: where ln F_G is large, force is nothing
    data.spline.encoding["dtype"] = "f4"
    # read again to be certified
    write_part(path, data)
    certified = certificate(path)
    data.attrs |= certified | {"certificate_points": CERTIFICATE[0] * CERTIFICATE[1]}
    write_part(path, data)
    return certified
