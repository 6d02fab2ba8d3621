"""Configurations of tables: TOML files, the shipped ones beside this module."""

from __future__ import annotations

import dataclasses
import json
import math
import pathlib
import tomllib
from typing import Any

from generate.tables.writing import TEXTS
from mbma_tables.common.arguments import number_in, whole_number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.netcdf import digest_json
from mbma_tables.tablefiles.schema import AXES, ISLAND4D, UNIVERSAL, Axis

HERE = pathlib.Path(__file__).parent
MAX_BYTES = 2**16  # of a configuration file
MIN_NODES = 8  # of an axis: a quintic spline without knots at its second nodes needs 7
MAX_NODES = 2_000_000  # of a table: four arrays of these fit a file
MIN_POINTS, MAX_POINTS = 100, 1_000_000  # of the certificate: the 99th percentile still is a point
MIN_SHIPPED_POINTS = 5000  # of a table in the shipped folder
# looser, the force of a universal table no longer increases in mu
TARGETS = {UNIVERSAL: (1e-11, 3e-4), ISLAND4D: (1e-11, 0.1)}
MIN_EXTENT = 1e-6  # of an axis, in its own transform: nodes must differ
# where the solver reaches its tightest tolerance, whatever the other axes
LIMITS = {
    "X": (-30.0, 200.0),
    "mu": (0.0, 1e10),
    "spread": (1e-12, 1e6),
    "sphere": (0.0, 1.0),
    "hurst": (0.01, 1.0),
}


@dataclasses.dataclass(frozen=True)
class AxisRange:
    """Range of an axis; `nodes` is None where the target decides, starting from `start`."""

    low: float
    high: float
    offset: float = 0.0
    start: int = MIN_NODES
    nodes: int | None = None


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What a table is to cover, and how well."""

    kind: str  # universal or island4d
    target: float  # largest relative error allowed on held-out points
    max_nodes: int  # of the whole table
    variant: str  # of an island4d table; a universal one serves all
    certificate_points: int  # held-out ones
    seed: int  # of the low-discrepancy sequences
    axes: dict[str, AxisRange]

    def digest(self) -> str:
        """SHA-256 of the configuration, the variant's numbers included."""
        numbers = get_variant(self.variant).recorded if self.kind == ISLAND4D else []
        return digest_json([dataclasses.asdict(self), numbers])

    def attributes(self) -> dict[str, Any]:
        """Attributes of a table's file on what was wanted."""
        text = json.dumps(dataclasses.asdict(self), sort_keys=True)
        return {"target": self.target, "configuration": text, "configuration_sha256": self.digest()}


def _checked(given: Any, known: Any, where: str) -> dict[str, Any]:
    """A table of a file that has no unknown keys."""
    if not isinstance(given, dict):
        raise InputError(f"{where} must be a table of {', '.join(known)}, got {given!r}")
    for key in given:
        if key not in known:
            raise InputError(f"{where}: unknown key {key!r}; known are {', '.join(known)}")
    return given


def _axis(kind: str, name: str, entry: dict[str, Any]) -> AxisRange:
    low, high = (number_in(f"axes.{name}.{end}", entry.get(end, 0.0), *LIMITS[name]) for end in ("low", "high"))
    offset = number_in(f"axes.{name}.offset", entry.get("offset", 0.0), -1e12, 1e12)
    first, last = low + offset, high + offset
    if offset and name != "X":
        raise InputError(f"axes.{name} takes no offset, only axes.X does")
    if dict(AXES[kind])[name] == "log":
        if first <= 0:
            raise InputError(f"axes.{name} is logarithmic and needs low + offset > 0, got {low!r} and {offset!r}")
        first, last = math.log(first), math.log(max(first, last))
    if not last - first >= MIN_EXTENT or high <= low:
        raise InputError(f"axes.{name} must have low < high, far enough apart for its nodes to differ")
    known = (key for key in ("start", "nodes") if key in entry)
    counts = {key: whole_number_in(f"axes.{name}.{key}", entry[key], MIN_NODES, MAX_NODES) for key in known}
    return AxisRange(low, high, offset, **counts)


def _configuration(kind: str, path: pathlib.Path | None, target: float | None) -> Configuration:
    given, own = tomllib.loads((HERE / f"{kind}.toml").read_text(encoding="utf-8")), dict[str, Any]()
    if path is not None:
        try:
            own = tomllib.loads(read_file(path, MAX_BYTES).decode("utf-8"))
        except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as fault:
            raise InputError(f"it is not a TOML file: {fault}") from None
    _checked(own, list(given), "the file")
    changed, shipped, axes = _checked(own.get("axes", {}), list(given["axes"]), "[axes]"), given["target"], {}
    wanted = number_in("target", own.get("target", shipped) if target is None else target, *TARGETS[kind])
    for name, entry in given["axes"].items():
        # cells are as small as they must be, where nodes are counted
        known = [*entry] if kind == UNIVERSAL else ["low", "high", "offset", "start", "nodes"]
        changes = _checked(changed.get(name, {}), known, f"[axes.{name}]")
        # where the target is looser or the range another one, the shipped start is too fine or means nothing
        if wanted > shipped or changes.keys() & {"low", "high", "offset"}:
            entry.pop("start", None)
        axes[name] = _axis(kind, name, entry | changes)
    given |= own
    if given["kind"] != kind:
        raise InputError(f"kind must be {kind!r}, got {given['kind']!r}")
    ranges = {"max_nodes": (1, MAX_NODES), "certificate_points": (MIN_POINTS, MAX_POINTS), "seed": (0, 2**63)}
    numbers = {name: whole_number_in(name, given[name], *ends) for name, ends in ranges.items()}
    first = math.prod(axis.nodes or axis.start for axis in axes.values())
    if first > numbers["max_nodes"]:
        raise InputError(f"the axes have {first} nodes to begin with, max_nodes allows {numbers['max_nodes']}")
    return Configuration(kind=kind, target=wanted, variant=get_variant(given["variant"]).name, axes=axes, **numbers)


def load(kind: str, path: pathlib.Path | None = None, target: float | None = None) -> Configuration:
    """The configuration of a kind of table: the shipped one, changed by a TOML file and by `target`."""
    try:
        return _configuration(kind, path, target)
    except ValueError as fault:
        where = "" if path is None or str(path) in str(fault) else f"{path}: "
        raise InputError(f"{where}{fault}") from None


def make_axis(kind: str, name: str, given: AxisRange, nodes: int) -> Axis:
    """An axis over the configured range."""
    return Axis(name, TEXTS["axes"][name], dict(AXES[kind])[name], given.offset, given.low, given.high, nodes)  # type: ignore[arg-type]
