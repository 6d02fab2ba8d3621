"""Configurations of tables: TOML files, the shipped ones beside this module."""

from __future__ import annotations

import dataclasses
import difflib
import pathlib
import tomllib
from typing import Any

from mbma_tables.errors import InputError
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.provenance import digest_json
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, Axis

FEWEST_NODES = 8  # a quintic spline without knots at its second nodes needs 7
HERE = pathlib.Path(__file__).parent
KEYS = {"kind", "target", "most_nodes", "reading", "certificate_points", "seed", "axes"}
AXIS_KEYS = {"low", "high", "offset", "start", "nodes"}


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
        Held-out points, at least 5,000 for a table to be shipped.
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


def _check_keys(given: dict[str, Any], known: set[str], where: str) -> None:
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else f"; known are {', '.join(sorted(known))}"
            raise InputError(f"{where}: unknown key {key!r}{hint}")


def _number(value: Any, name: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not value == value:
        raise InputError(f"{where}: {name} must be a number, got {value!r}")
    return float(value)


def load(kind: str, path: pathlib.Path | None = None, target: float | None = None) -> Configuration:
    """The configuration of a kind of table: the shipped one, changed by a TOML file and by `target`.

    Raises
    ------
    InputError
        For an unreadable file, unknown keys, or values that make no table.
    """
    given = tomllib.loads((HERE / f"{kind}.toml").read_text(encoding="utf-8"))
    where = f"{kind}.toml"
    if path is not None:
        where = str(path)
        try:
            own = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as fault:
            raise InputError(f"{path}: {fault}") from None
        _check_keys(own, KEYS, where)
        axes = own.pop("axes", {})
        _check_keys(axes, set(given["axes"]), f"{where}, [axes]")
        for name, changes in axes.items():
            _check_keys(changes, AXIS_KEYS, f"{where}, [axes.{name}]")
            given["axes"][name] |= changes
        given |= own
    if target is not None:
        given["target"] = target
    if given["kind"] != kind or kind not in KINDS:
        raise InputError(f"{where}: kind must be {kind!r}, got {given['kind']!r}")
    wanted = _number(given["target"], "target", where)
    if not 1e-11 <= wanted <= 0.1:
        raise InputError(f"{where}: target must lie in [1e-11, 0.1], got {wanted!r}")
    axes = {}
    for name, entry in given["axes"].items():
        low, high, offset = (
            _number(entry.get(key, 0.0), f"axes.{name}.{key}", where) for key in ("low", "high", "offset")
        )
        if not low < high:
            raise InputError(f"{where}: axes.{name} must have low < high, got {low!r} and {high!r}")
        counts = {key: entry.get(key) for key in ("start", "nodes")}
        for key, count in counts.items():
            if count is not None and not (isinstance(count, int) and count >= FEWEST_NODES):
                raise InputError(
                    f"{where}: axes.{name}.{key} must be a whole number of at least {FEWEST_NODES}, got {count!r}"
                )
        axes[name] = AxisRange(low, high, offset, counts["start"] or FEWEST_NODES, counts["nodes"])
    return Configuration(
        kind=kind,
        target=wanted,
        most_nodes=int(_number(given["most_nodes"], "most_nodes", where)),
        reading=get_reading(given["reading"]).name,
        certificate_points=int(_number(given["certificate_points"], "certificate_points", where)),
        seed=int(_number(given["seed"], "seed", where)),
        axes=axes,
    )


def make_axis(name: str, long_name: str, transform: str, given: AxisRange, nodes: int) -> Axis:
    """An axis over the configured range."""
    return Axis(name, long_name, transform, given.offset, given.low, given.high, nodes)  # type: ignore[arg-type]
