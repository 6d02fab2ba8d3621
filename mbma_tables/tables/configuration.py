"""Configurations of tables: TOML files, the shipped ones beside this module."""

import dataclasses
import json
import math
import pathlib
from typing import Any

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.common.netcdf import digest_json
from mbma_tables.common.toml_files import check, read_toml
from mbma_tables.islands.variants import get_variant
from mbma_tables.tables.schema import AXES, DEGREE, ISLAND4D, Axis
from mbma_tables.tables.writer import TEXTS

HERE = pathlib.Path(__file__).parent
# ranges within which the solver reaches its tightest tolerance, whatever the other axes
SCHEMAS = json.loads((HERE / "configuration.schema.json").read_text(encoding="utf-8"))
RANGE = {
    "low": 0.0,
    "high": 0.0,
    "offset": 0.0,
    "nodes": 2,
}  # of an axis; the universal table has cells, no nodes
MIN_NODES = 8  # of an axis
NEAREST = 1.001  # between two targets that are not told apart
MIN_SHIPPED_POINTS = 5000  # of the certificate of a table in the shipped folder


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What a table is to cover, and how accurately."""

    kind: str  # universal or island4d
    target: float  # largest relative error allowed on held-out points
    max_nodes: int  # of the whole table
    variant: str  # of an island4d table; a universal one serves all
    certificate_points: int  # held-out ones
    seed: int  # of the low-discrepancy sequences
    axes: dict[str, Axis]

    def attributes(self) -> dict[str, Any]:
        """Attributes of a table's file on what was wanted; the digest has the variant's numbers, too."""
        ranges = {
            name: {key: getattr(axis, key) for key in RANGE}
            for name, axis in self.axes.items()
        }
        own = vars(self) | {"axes": ranges}
        numbers = get_variant(self.variant).recorded if self.kind == ISLAND4D else []
        text = json.dumps(own, sort_keys=True)
        digest = digest_json([own, numbers])
        return {
            "target": self.target,
            "configuration": text,
            "configuration_sha256": digest,
        }


def _require_finite(entries: dict[str, Any], place: str = "") -> None:
    """Raise InputError for the first number that is infinite or NaN, with its key."""
    for name, value in entries.items():
        if isinstance(value, dict):
            _require_finite(value, f"{place}{name}.")
        elif isinstance(value, float) and not math.isfinite(value):
            raise InputError(f"{place}{name} must be a finite number, got {value}")


def _axes(given: dict[str, Any], own: dict[str, Any], target: float) -> dict[str, Axis]:
    """The axes of a shipped configuration `given`, changed by `own`, for a target."""
    kind = given["kind"]
    finer = (given["target"] / target) ** (1 / (DEGREE + 1))
    axes = dict[str, Axis]()
    for name, entry in given["axes"].items():
        chosen: dict[str, Any] = RANGE | entry
        if kind == ISLAND4D:
            chosen["nodes"] = max(MIN_NODES, math.ceil(finer * entry["nodes"]))
        chosen |= own.get("axes", {}).get(name, {})
        axes[name] = Axis(name, TEXTS["axes"][name], dict(AXES[kind])[name], **chosen)  # type: ignore[arg-type]
    return axes


def nodes_of(axes: dict[str, Axis]) -> int:
    """Nodes of a table with these axes."""
    return math.prod(axis.nodes for axis in axes.values())


def _nearest(
    given: dict[str, Any], own: dict[str, Any], wanted: Configuration, most: int
) -> str:
    """The least target that takes at most so many nodes, in words."""
    low = wanted.target
    high = SCHEMAS[wanted.kind]["properties"]["target"]["maximum"]
    if nodes_of(_axes(given, own, high)) > most:
        return "give the axes fewer nodes, which the file counts"
    while high / low > NEAREST:
        middle = math.sqrt(low * high)
        if nodes_of(_axes(given, own, middle)) > most:
            low = middle
        else:
            high = middle
    unit = 10.0 ** (math.floor(math.log10(high)) - 1)
    return f"the nearest on these axes is a target of {math.ceil(high / unit) * unit:.1e}"


def _too_many(given: dict[str, Any], own: dict[str, Any], wanted: Configuration) -> str:
    """What a configuration with too many nodes would take, and the nearest target within reach."""
    count = nodes_of(wanted.axes)
    most = SCHEMAS[wanted.kind]["properties"]["max_nodes"]["maximum"]
    takes = f"a target of {wanted.target:.1e} on these axes takes {count} nodes"
    if count <= most:
        return (
            f"{takes}, and max_nodes is {wanted.max_nodes}: set max_nodes = {count}; with "
            f"{wanted.max_nodes}, {_nearest(given, own, wanted, wanted.max_nodes)}"
        )
    return (
        f"{takes}, and a table has at most {most}: with max_nodes = {most}, {_nearest(given, own, wanted, most)}; a "
        "table of kind universal reaches 1e-11"
    )


def load(
    kind: str, path: pathlib.Path | None = None, target: float | None = None
) -> Configuration:
    """The configuration of a kind of table: the shipped one, changed by a TOML file and by `target`.

    Where the file does not count the nodes of an axis, they follow the target: the error of
    a spline of degree k is of order nodes^-(k + 1).
    """
    given = read_toml(HERE / f"{kind}.toml", "configuration")
    own = {} if path is None else read_toml(path, "configuration")
    own |= {} if target is None else {"target": target}
    try:
        _require_finite(own)
        check(own, SCHEMAS[kind])
        merged = given | own
        axes = _axes(given, own, merged["target"])
        found = Configuration(**merged | {"axes": axes})
        count = nodes_of(axes)
        if count > found.max_nodes:
            raise InputError(_too_many(given, own, found))
        for name, axis in axes.items():
            with np.errstate(all="ignore"):
                if not (np.diff(axis.values) > 0).all():
                    raise InputError(
                        f"axes.{name}: its nodes must increase from low to high, and low + offset be above 0 on a "
                        f"logarithmic axis, got {axis.low:g} to {axis.high:g}"
                    )
    except ValueError as fault:
        raise InputError(f"{kind if path is None else path}: {fault}") from None
    return found
