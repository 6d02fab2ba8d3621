"""What the calibrated law is held to on surfaces that no fit saw, and what two surfaces of one spectrum differ by."""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from generate.boundary_elements.design import TRAINING
from generate.boundary_elements.evidence import Case
from mbma_tables.common.arguments import FloatArray

LARGE = 512  # points a side from which on surfaces are told apart
MIN_SURFACES = 2  # of a spectrum, for what its surfaces differ by
NINE_IN_TEN = 0.9


@dataclasses.dataclass(frozen=True)
class Bar:
    """A limit to nine errors in ten of a quantity over a range of contact, on some surfaces."""

    form: str
    quantity: str
    contact: tuple[float, float]
    limit: float
    kinds: tuple[str, ...] = ("self_affine",)
    waves: tuple[int, int] = (2, 99)

    @property
    def text(self) -> str:
        """The bar in words."""
        low, high = self.waves
        waves = f"{low} or more waves" if high == 99 else f"{low} to {high} waves" if high > low else f"{low} waves"
        span = "-".join(f"{100 * a:g}" for a in self.contact)
        return f"{self.quantity} by {self.form}, {span}% contact, {' '.join(self.kinds).replace('_', '-')}, {waves}"

    def holds(self, one: Case) -> bool:
        """Whether a surface is of those that it speaks of."""
        return one.kind in self.kinds and self.waves[0] <= one.waves <= self.waves[1]

    def inside(self, area: FloatArray) -> Any:
        """Which contacts it speaks of."""
        return (area >= self.contact[0]) & (area <= self.contact[1])


BARS = (
    Bar("spectrum", "area", (0.01, 0.03), 0.10, waves=(2, 2)),
    Bar("spectrum", "area", (0.01, 0.03), 0.05, waves=(3, 99)),
    Bar("spectrum", "area", (0.03, 0.97), 0.05),
    Bar("spectrum", "force", (0.01, 0.10), 0.20),
    Bar("spectrum", "force", (0.10, 0.97), 0.08),
    Bar("spectrum", "stiffness", (0.01, 0.10), 0.12),
    Bar("spectrum", "stiffness", (0.10, 0.90), 0.12),
    Bar("spectrum", "stiffness", (0.90, 0.98), 0.12),
    Bar("spectrum", "area", (0.002, 0.97), 0.12, ("plateau", "filtered")),
    Bar("spectrum", "force", (0.002, 0.03), 0.15, ("plateau", "filtered")),
    Bar("spectrum", "force", (0.03, 0.97), 0.10, ("plateau", "filtered")),
    Bar("map", "area", (0.002, 0.97), 0.10, ("self_affine", "plateau", "filtered"), (1, 99)),
    Bar("map", "force", (0.01, 0.10), 0.10),
    Bar("map", "force", (0.002, 0.01), 0.15, ("self_affine", "plateau", "filtered"), (4, 99)),
    Bar("map", "force", (0.002, 0.01), 0.25, ("self_affine", "plateau", "filtered"), (1, 2)),
    Bar("map", "area", (0.002, 0.97), 0.10, ("stretched",)),
    Bar("map", "force", (0.002, 0.01), 0.15, ("stretched",)),
    Bar("map", "force", (0.01, 0.10), 0.10, ("stretched",)),
)


def _nine_in_ten(values: Sequence[FloatArray]) -> float:
    flat = np.concatenate([*values, np.empty(0)])
    return float(np.quantile(np.abs(flat), NINE_IN_TEN)) if flat.size else float("nan")


def measure(
    found: Sequence[Case],
    forms: dict[str, Callable[[Case], Any]],
    errors: Callable[[Case, Any, str], FloatArray],
) -> list[dict[str, Any]]:
    """Of each bar: nine errors in ten, also of large grids alone, and nine in ten of a spectrum's own differences.

    These are the errors' distances from the mean of their spectrum and load on all surfaces, widened for the mean's own
    scatter: no law of the same knowledge that is right in the mean does better.
    """
    laws = {name: {id(one): make(one) for one in found} for name, make in forms.items()}
    told = []
    for bar in BARS:
        own: dict[str, list[FloatArray]] = {"found": [], "large": []}
        groups = collections.defaultdict(list)
        number = 0
        for one in found:
            if not bar.holds(one):
                continue
            error = errors(one, laws[bar.form][id(one)], bar.quantity)
            groups[one.node].append((one, error))
            if one.split == TRAINING:
                continue
            kept = np.expm1(error[bar.inside(one.area) & np.isfinite(error)])
            own["found"].append(kept)
            number += 1
            if one.points >= LARGE:
                own["large"].append(kept)
        spread = [part for group in groups.values() if len(group) >= MIN_SURFACES for part in _spread(group, bar)]
        told.append(
            {"what": bar.text, "limit": bar.limit, "surfaces": number, "surfaces_large": len(own["large"])}
            | {name: _nine_in_ten(values) for name, values in own.items()}
            | {"mean": float(np.mean(np.concatenate(own["found"]))) if number else float("nan")}
            | {"noise": _nine_in_ten(spread)}
        )
    return told


def _spread(group: Sequence[tuple[Case, FloatArray]], bar: Bar) -> list[FloatArray]:
    """Distances from the mean at each load of a spectrum's surfaces."""
    loads = min(len(error) for _, error in group)
    errors = np.array([error[:loads] for _, error in group])
    area = np.mean([one.area[:loads] for one, _ in group], axis=0)
    apart = (errors - errors.mean(axis=0)) * np.sqrt(len(group) / (len(group) - 1))
    apart = apart[:, bar.inside(area)]
    return [apart[np.isfinite(apart)]]
