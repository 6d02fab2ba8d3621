"""Island models: force, area and error of an island at (X, mu), by name or as an object."""

import dataclasses
import pathlib
from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.islands import greenwood_tripp

ISLAND_MODELS = ("exact", "universal", "island4d", "formula", "rigid")
OUTSIDE = ("raise", "exact", "nan")  # options for islands that a table does not cover
QUANTITIES = ("pressure", "area")
# that may be requested of totals and islands
MIN_RTOL = 1e-11
MAX_RTOL = 0.1
CLOSED_FORM_ERROR = 1e-14


def check_outside(outside: str) -> None:
    """Reject values that are not in `OUTSIDE`."""
    if outside not in OUTSIDE:
        raise InputError(f"outside must be one of {OUTSIDE}, got {outside!r}")


def beside(island_model: Any, folder: pathlib.Path) -> str | pathlib.Path:
    """An island model that a file in `folder` names: a table's path is relative to the folder."""
    if not isinstance(island_model, str):
        raise InputError(
            f"island_model must be one of {', '.join(ISLAND_MODELS)}, or the file of a table, "
            f"got {island_model!r}"
        )
    return island_model if island_model in ISLAND_MODELS else folder / island_model


class Certificate(NamedTuple):
    """Relative errors of one function at held-out points, and its number of fitted coefficients."""

    coefficients: int
    largest: float
    median: float
    points: int
    worst_at: dict[str, float]


class IslandAnswer(NamedTuple):
    """Phi_F and Phi_A of islands, with a bound on their relative error; arrays of one shape."""

    phi_F: FloatArray
    phi_A: FloatArray
    error: FloatArray


@runtime_checkable
class IslandModel(Protocol):
    """An island model: `contact`, `contact_law`, `island` and `Scene` take any such object as their `island_model`."""

    @property
    def name(self) -> str:
        """Name of the model in results."""

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F, Phi_A and a bound on their relative error at finite X and mu >= 0, arrays of one shape."""


@runtime_checkable
class GeometryModel(Protocol):
    """An island model that needs more of an island than X and mu."""

    @property
    def name(self) -> str:
        """Name of the model in results."""

    def of_islands(
        self, islands: Mapping[str, FloatArray], outside: str = "raise"
    ) -> IslandAnswer:
        """Phi_F and Phi_A of islands, given as `islands.geometry.FIELDS` and hurst, arrays of one shape.

        `outside` is one of `OUTSIDE`. Used in place of `answer` where both exist.
        """


AnyModel = IslandModel | GeometryModel


def answer_islands(
    model: AnyModel, islands: Mapping[str, FloatArray], outside: str = "raise"
) -> IslandAnswer:
    """Phi_F and Phi_A of islands by any model; results of models of X and mu are checked."""
    if isinstance(model, GeometryModel):
        return model.of_islands(islands, outside)
    shape = islands["X"].shape
    given: Any = model.answer(islands["X"], islands["mu"])
    try:
        phi_F, phi_A, error = (
            np.array(np.broadcast_to(part, shape), dtype=float) for part in given
        )
    except (TypeError, ValueError) as fault:
        wanted = f"must answer Phi_F, Phi_A and error of shape {shape}"
        raise InputError(f"island model {model.name!r} {wanted}: {fault}") from None
    bad = ~(np.isfinite(phi_F) & np.isfinite(phi_A) & (error >= 0))
    if outside == "exact" and bad.any():
        solved = SOLVER.answer(islands["X"][bad], islands["mu"][bad])
        for part, exact in zip((phi_F, phi_A, error), solved, strict=True):
            part[bad] = exact
    elif outside != "nan" and bad.any():
        raise OutOfRangeError(
            f"island model {model.name!r} has no result for {int(bad.sum())} islands", bad
        )
    return IslandAnswer(phi_F, phi_A, error)


@dataclasses.dataclass(frozen=True)
class ExactModel:
    """The island problem solved for each island (Newton's method), to a relative error of `rtol`."""

    rtol: float
    name: str = "exact"

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F and Phi_A by `greenwood_tripp.solve`."""
        solved = greenwood_tripp.solve(X, mu, rtol=self.rtol)
        return IslandAnswer(solved.phi_F, solved.phi_A, solved.error)


SOLVER = ExactModel(1e-10)  # for islands outside a table


@dataclasses.dataclass(frozen=True)
class RigidModel:
    """The sphere does not deform (w = 0 in Eq. 34): closed form, exact as mu goes to 0."""

    name: str = "rigid"

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F = (mu/2) pi F_{5/2}(-X)/(5/2), Phi_A = pi F_2(-X)/2."""
        force, area = greenwood_tripp.rigid_sphere(*np.broadcast_arrays(X, mu))
        return IslandAnswer(force, area, np.full(force.shape, CLOSED_FORM_ERROR))


def exact_model(rtol: float) -> ExactModel:
    """The exact solver, accurate enough for totals at `rtol`."""
    return ExactModel(max(0.1 * rtol, greenwood_tripp.MIN_SOLVER_RTOL))


def island_model_name(island_model: str | AnyModel) -> str:
    """The name of an island model in results."""
    return (
        island_model
        if isinstance(island_model, str)
        else getattr(island_model, "name", "")
    )
