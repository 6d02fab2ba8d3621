"""A theory by a table of its totals."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_once
from mbma_tables.common.shared import shared_property
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.tables.function_table import FunctionTable, read_function_table
from mbma_tables.theories.base import Theory, TheoryAnswer
from mbma_tables.theories.named import THEORIES, shipped

AXES = (
    ("hurst", "zeta_1", "h_max", "compression"),
    ("hurst", "zeta_1", "h_max", "gap"),
    ("hurst", "zeta_1", "gap"),
)
NODES, INTERVALS = 8, 16  # of the integral of the pressure
OUTPUTS = ("pressure", "area")
# module of the functions that shipped theories are tabulated by
TOTALS = "mbma_tables.theories.totals"
NO_SCATTER = "the scatter of the theory that this table stands for is not known: it is one of a user"


@dataclasses.dataclass(frozen=True, repr=False)
class Tabulated(Theory):
    """A theory by a table of its totals, made by ``mbma tables make mbma_tables.theories.totals:THEORY``.

    Parameters
    ----------
    table : path
        The file. `error` of contacts is the table's bound; the scatter, and the reasons for
        which a result is not valid, are those of the theory that the table stands for. A
        table of a user's theory is never valid.
    member : str, optional
        Of a table with members, such as variants or replicas: the one to use in place of the
        table's value.

    Raises
    ------
    TableFileError
        If the file is damaged or of another kind.
    InputError
        If its axes or outputs are not those of `mbma_tables.theories.totals`, or it lacks
        the member.
    OutOfRangeError
        For surfaces and gaps that the table does not cover.
    """

    table: str | os.PathLike[str]
    member: str | None = None

    name = "tabulated"

    def __post_init__(self) -> None:
        names = tuple(axis.name for axis in self.contents.axes)
        outputs = {output.name for output in self.contents.outputs}
        if names not in AXES or not outputs >= {*OUTPUTS}:
            raise InputError(
                f"{self.table} has axes {', '.join(names)} and outputs {', '.join(sorted(outputs))}; "
                "totals of a theory have (hurst, zeta_1, h_max, compression), (hurst, zeta_1, "
                "h_max, gap) or (hurst, zeta_1, gap), and pressure and area: "
                "mbma_tables.theories.totals makes such functions"
            )

    @shared_property
    def contents(self) -> FunctionTable:
        """The table."""
        whole = read_once(self.table, read_function_table)
        return whole if self.member is None else whole.member(self.member)

    @property
    def stands_for(self) -> Theory | None:
        """The shipped theory whose totals these are; None for one of a user, or a mean of several."""
        members = self.contents.members
        if members is not None and members.central_is_mean:
            return None
        module, _, name = self.contents.attributes["function"].partition(":")
        is_shipped = module == TOTALS and name in THEORIES
        theory: Theory | None = shipped(name) if is_shipped else None
        return theory

    @property
    def ends_at_h_max(self) -> bool:  # type: ignore[override]
        """Whether contact ends at h_max, as for tables over the compression."""
        return self.contents.axes[-1].name == "compression"

    @property
    def rtol(self) -> float:  # type: ignore[override]
        """Relative error that its laws aim at, above the steps between the table's cells."""
        return max(1e-8, 4 * float(self.contents.attributes["target"]))

    def _arguments(
        self, surface: AnySurface, mean_separation: FloatArray
    ) -> dict[str, FloatArray]:
        """Numbers on the table's axes."""
        if not isinstance(surface, Surface):
            raise InputError(
                "a table of totals needs a self-affine surface of five numbers: surface.fit()"
            )
        h_rms, h_max = np.asarray(surface.h_rms), np.asarray(surface.h_max)
        u = np.asarray(mean_separation, dtype=float)
        numbers = {
            "hurst": np.asarray(surface.hurst),
            "zeta_1": np.asarray(surface.zeta_1),
            "h_max": h_max / h_rms,
            "gap": u / h_rms,
            "compression": 1 - u / h_max,
        }
        chosen = {axis.name: numbers[axis.name] for axis in self.contents.axes}
        for axis in self.contents.axes:
            array = chosen[axis.name]
            # the ends of `interval` are these up to rounding
            near = np.clip(array, axis.low, axis.high)
            array = np.where(np.abs(array - near) <= 1e-12 * np.abs(near), near, array)
            inside = (array >= axis.low) & (array <= axis.high)
            allowed = f"in [{axis.low:g}, {axis.high:g}], the range of {self.table}"
            require(axis.name, array, inside, allowed)
            chosen[axis.name] = array
        return chosen

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force and area by the table, stiffness by its derivative."""
        numbers = self._arguments(surface, mean_separation)
        found = self.contents.lookup(*numbers.values(), derivatives=1)
        gradient = np.asarray(surface.rms_gradient)
        last = self.contents.axes[-1].name
        length = -np.asarray(surface.h_max) if self.ends_at_h_max else surface.h_rms
        by_gap = found.derivatives["pressure"][last] / np.asarray(length)
        relative = [found.error[name] / np.abs(found.values[name]) for name in OUTPUTS]
        return TheoryAnswer(
            found["pressure"] * gradient,
            found["area"],
            -by_gap * gradient,
            np.maximum(*relative),
        )

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] that the table covers."""
        axis = self.contents.axes[-1]
        if axis.name == "compression":
            h_max = np.asarray(surface.h_max, dtype=float)
            return h_max * (1 - axis.high), h_max * (1 - axis.low)
        h_rms = np.asarray(surface.h_rms, dtype=float)
        return h_rms * axis.low, h_rms * axis.high

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """Those of `interval`."""
        return self.interval(surface)

    def mean_separation_at(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        """Mean separation u [length] at a wanted "pressure" (over A0 E*) or "area", which the table must reach."""
        gradient = np.asarray(surface.rms_gradient) if quantity == "pressure" else 1.0
        ends = (self._arguments(surface, end) for end in self.interval(surface))
        largest, least = (
            self.contents.lookup(*end.values())[quantity] * gradient for end in ends
        )
        wanted = np.asarray(wanted, dtype=float)
        inside = (wanted >= least) & (wanted <= largest)
        limits = f"{np.min(least):.4g} to {np.max(largest):.4g}"
        unit = " of E*" if quantity == "pressure" else ""
        require(quantity, wanted, inside, f"within the table's {limits}{unit}")
        axis = self.contents.axes[-1]
        if not self.contents.has_inverse(quantity, axis.name):
            return super().mean_separation_at(surface, quantity, wanted)
        # only the last axis depends on the gap
        numbers = self._arguments(surface, self.interval(surface)[0])
        del numbers[axis.name]
        # the ends of the table, up to rounding
        low, high = (np.asarray(end) / gradient for end in (least, largest))
        numbers[quantity] = np.clip(wanted / gradient, low, high)
        place, _ = self.contents.inverse(axis.name, **numbers)
        if axis.name == "compression":
            return np.asarray(np.asarray(surface.h_max) * (1 - place))
        return np.asarray(np.asarray(surface.h_rms) * place)

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length]: the table's work up to its end, and beyond the theory's own.

        NaN for a theory of a user, whose work beyond the table is not known.
        """
        last = np.asarray(self.interval(surface)[1])
        u = np.asarray(mean_separation, dtype=float)
        shape = np.broadcast_shapes(u.shape, surface.shape, last.shape)
        if self.stands_for is None:
            return np.full(shape, np.nan)
        beyond = self.stands_for.energy(surface, np.maximum(u, last))
        return np.asarray(self._work(surface, np.broadcast_to(u, shape), last) + beyond)

    def _work(self, surface: AnySurface, u: FloatArray, last: FloatArray) -> FloatArray:
        """The integral of the pressure from u to `last`, by Gauss's rule on several intervals."""
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        edges = np.linspace(0.0, 1.0, INTERVALS + 1) ** 2  # finer at the compressed end
        places = edges[:-1, None] + np.diff(edges)[:, None] * 0.5 * (1 + nodes)
        factors = np.diff(edges)[:, None] * 0.5 * weights
        width = np.maximum(np.broadcast_to(last, u.shape) - u, 0.0)
        gaps = np.minimum(u, last) + width * places.reshape(-1, *(1,) * u.ndim)
        pressure = self.answer(surface, gaps).pressure
        return np.tensordot(factors.ravel(), pressure, 1) * width

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """Those of the theory that the table stands for."""
        original = self.stands_for
        return (
            super().departures(surface)
            if original is None
            else original.departures(surface)
        )

    def scatter_name(self, surface: AnySurface) -> str:
        """Name under which the scatter of the theory that it stands for is stored."""
        original = self.stands_for
        return self.name if original is None else original.scatter_name(surface)

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> Mapping[str, NDArray[np.bool_]]:
        """Those of the theory that the table stands for."""
        original = self.stands_for
        if original is not None:
            return original.reasons(surface, answer, mean_separation)
        everywhere = np.ones(np.shape(answer.area), dtype=bool)
        return {
            NO_SCATTER: everywhere,
            **super().reasons(surface, answer, mean_separation),
        }

    def evidence(self, surface: AnySurface) -> str:
        original = self.stands_for
        return (
            super().evidence(surface) if original is None else original.evidence(surface)
        )

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """That of the theory that the table stands for; NaN for one of a user."""
        original = self.stands_for
        if original is not None:
            return original.scatter(surface, quantity, area)
        return np.full(np.broadcast_shapes(np.shape(area), surface.shape), np.nan)

    def wide_scatter(self, surface: AnySurface, quantity: str) -> FloatArray:
        original = self.stands_for
        if original is not None:
            return original.wide_scatter(surface, quantity)
        return super().wide_scatter(surface, quantity)

    def provenance(self) -> tuple[str, ...]:
        """The table's function and file."""
        attributes = self.contents.attributes
        digest = attributes["values_sha256"][:12]
        member = "" if self.member is None else f", member {self.member}"
        return (
            f"table of {attributes['function']}, {self.table}, values {digest}{member}",
        )
