"""Configurations of tables: TOML files, the shipped ones beside this module."""

from __future__ import annotations

import dataclasses
import difflib
import math
import pathlib
from typing import Any

from mbma_tables.arguments import whole_number_in
from mbma_tables.errors import InputError
from mbma_tables.scenes.toml_file import read_toml
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.provenance import digest_json
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, Axis

FEWEST_NODES = 8  # a quintic spline without knots at its second nodes needs 7
HERE = pathlib.Path(__file__).parent
KEYS = {"kind", "target", "most_nodes", "reading", "certificate_points", "seed", "axes"}
AXIS_KEYS = {"low", "high", "offset", "start", "nodes"}
FEWEST_SHIPPED = 5000  # certificate points of a table in the folder that is shipped
FEWEST_POINTS = 100  # of any other: the 99th percentile still is a point
MOST_POINTS = 1_000_000
MOST_NODES = 2_000_000  # four arrays of these fit a table file
LEAST_EXTENT = 1e-6  # of an axis, in its own transform: nodes must differ
# where the solver reaches the tightest accuracy, whatever the other axes
LIMITS = {
    "X": (-30.0, 200.0),
    "mu": (1e-30, 1e10),
    "spread": (1e-12, 1e6),
    "sphere": (0.0, 1.0),
    "hurst": (0.01, 1.0),
}
LOGARITHMIC = {"X", "mu", "spread"}


@dataclasses.dataclass(frozen=True)
class AxisRange:
    """Range of an axis; `nodes` is None where the target decides, starting from `start`."""

    low: float
    high: float
    offset: float
    start: int
    nodes: int | None


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What a table is to cover, and how well.

    Attributes
    ----------
    kind : str
        "universal" or "island4d".
    target : float
        Largest relative error allowed on held-out points.
    most_nodes : int
        Size limit: nodes of the whole table.
    reading : str
        Reading of an island4d table; a universal one serves all.
    certificate_points : int
        Held-out points, at least 100; 5,000 for a table that goes into the folder that is shipped.
    seed : int
        Of the low-discrepancy sequences.
    axes : dict of AxisRange
    """

    kind: str
    target: float
    most_nodes: int
    reading: str
    certificate_points: int
    seed: int
    axes: dict[str, AxisRange]

    def content(self) -> dict[str, Any]:
        """The configuration as plain values."""
        return dataclasses.asdict(self)

    def digest(self) -> str:
        """SHA-256 of the configuration, the reading's numbers included."""
        numbers = list(get_reading(self.reading).numbers) if self.kind == ISLAND4D else []
        return digest_json([self.content(), numbers])


def _check_keys(given: Any, known: set[str], where: str) -> None:
    if not isinstance(given, dict):
        raise InputError(f"{where}: must be a table of {', '.join(sorted(known))}, got {given!r}")
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else f"; known are {', '.join(sorted(known))}"
            raise InputError(f"{where}: unknown key {key!r}{hint}")


def _number(value: Any, name: str, where: str) -> float:
    # not isfinite: it overflows on a whole number of 400 digits
    if isinstance(value, bool) or not isinstance(value, int | float) or not -1e300 < value < 1e300:
        raise InputError(f"{where}: {name} must be a finite number, got {value!r}")
    return float(value)


def _merge(given: dict[str, Any], own: dict[str, Any], where: str) -> None:
    """Change the shipped configuration; axes that it no longer fits start from the fewest nodes."""
    _check_keys(own, KEYS, where)
    changed = own.pop("axes", {})
    _check_keys(changed, set(given["axes"]), f"{where}, [axes]")
    for name, changes in changed.items():
        _check_keys(changes, AXIS_KEYS, f"{where}, [axes.{name}]")
        if "offset" in changes and name != "X":
            raise InputError(f"{where}: axes.{name} takes no offset, only axes.X does")
        if changes.keys() & {"low", "high", "offset"}:
            given["axes"][name].pop("start")
        given["axes"][name] |= changes
    given |= own


def _axis(name: str, entry: dict[str, Any], where: str) -> AxisRange:
    low, high, offset = (_number(entry.get(key, 0.0), f"axes.{name}.{key}", where) for key in ("low", "high", "offset"))
    least, most = LIMITS[name]
    if not least <= low < high <= most:
        raise InputError(
            f"{where}: axes.{name} must have {least:g} <= low < high <= {most:g}, got low {low!r} and high {high!r}"
        )
    extent = high - low
    if name in LOGARITHMIC:
        if not low + offset > 0:
            raise InputError(
                f"{where}: axes.{name} is logarithmic and needs low + offset > 0, got {low!r} and {offset!r}"
            )
        extent = math.log(high + offset) - math.log(low + offset)
    if extent < LEAST_EXTENT:
        raise InputError(f"{where}: axes.{name} is too narrow for its nodes to differ, extent {extent:.1e}")
    start, nodes = (
        None
        if key not in entry
        else whole_number_in(f"{where}: axes.{name}.{key}", entry[key], FEWEST_NODES, MOST_NODES)
        for key in ("start", "nodes")
    )
    return AxisRange(low, high, offset, start or FEWEST_NODES, nodes)


def load(kind: str, path: pathlib.Path | None = None, target: float | None = None) -> Configuration:
    """The configuration of a kind of table: the shipped one, changed by a TOML file and by `target`.

    Where the target is looser than the shipped one, or the range of an axis another, the shipped `start` is too fine
    or means nothing; such axes start from the fewest nodes, unless the file says otherwise.

    Raises
    ------
    InputError
        For an unreadable file, unknown keys, or values that make no table.
    """
    if kind not in KINDS:
        raise InputError(f"kind must be one of {KINDS}, got {kind!r}")
    given = read_toml(HERE / f"{kind}.toml", "configuration")
    shipped = given["target"]
    where = f"{kind}.toml"
    own = {} if path is None else read_toml(path, "configuration")
    if path is not None:
        where = str(path)
    wanted = _number(own.get("target", shipped), "target", where)
    if target is not None:
        wanted = _number(target, "target", "--target")
    if not 1e-11 <= wanted <= 0.1:
        raise InputError(f"{where if target is None else '--target'}: target must lie in [1e-11, 0.1], got {wanted!r}")
    if wanted > shipped:
        for entry in given["axes"].values():
            entry["start"] = FEWEST_NODES
    _merge(given, own, where)
    if given["kind"] != kind:
        raise InputError(f"{where}: kind must be {kind!r}, got {given['kind']!r}")
    axes = {name: _axis(name, entry, where) for name, entry in given["axes"].items()}
    most_nodes = whole_number_in(f"{where}: most_nodes", given["most_nodes"], 1, MOST_NODES)
    first = math.prod(axis.nodes or axis.start for axis in axes.values())
    if first > most_nodes:
        raise InputError(f"{where}: the axes have {first} nodes to begin with, most_nodes allows {most_nodes}")
    try:
        reading = get_reading(given["reading"]).name
    except InputError as fault:
        raise InputError(f"{where}: {fault}") from None
    return Configuration(
        kind=kind,
        target=wanted,
        most_nodes=most_nodes,
        reading=reading,
        certificate_points=whole_number_in(
            f"{where}: certificate_points", given["certificate_points"], FEWEST_POINTS, MOST_POINTS
        ),
        seed=whole_number_in(f"{where}: seed", given["seed"], 0, 2**63),
        axes=axes,
    )


def make_axis(name: str, long_name: str, transform: str, given: AxisRange, nodes: int) -> Axis:
    """An axis over the configured range."""
    return Axis(name, long_name, transform, given.offset, given.low, given.high, nodes)  # type: ignore[arg-type]
