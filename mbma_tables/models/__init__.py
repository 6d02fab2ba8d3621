"""Island models, one protocol: totals take any of them, by name or as an object, and do not ask which."""

from __future__ import annotations

from mbma_tables.arguments import number_in
from mbma_tables.errors import InputError
from mbma_tables.islands.greenwood_tripp import MIN_SOLVER_RTOL
from mbma_tables.models.protocol import (
    MAX_RTOL,
    MIN_RTOL,
    AnyModel,
    ExactModel,
    GeometryModel,
    IslandAnswer,
    IslandModel,
    RigidModel,
    answer_islands,
)
from mbma_tables.surfaces.readings import Reading

__all__ = [
    "TIERS",
    "AnyModel",
    "ExactModel",
    "GeometryModel",
    "IslandAnswer",
    "IslandModel",
    "RigidModel",
    "answer_islands",
    "exact_model",
    "get_model",
    "tier_name",
]

TIERS = ("exact", "universal", "island4d", "formula", "rigid")


def exact_model(rtol: float) -> ExactModel:
    """The exact solver, accurate enough for totals at `rtol`."""
    return ExactModel(max(0.1 * rtol, MIN_SOLVER_RTOL))


def tier_name(tier: str | AnyModel) -> str:
    """What results call a tier: its name, or that of the model."""
    return tier if isinstance(tier, str) else tier.name


def get_model(tier: str | AnyModel, rtol: float, reading: Reading) -> AnyModel:
    """The island model of a tier, accurate enough for results at `rtol`; a table is what its certificate says.

    Parameters
    ----------
    tier : str or island model
        One of `TIERS`, or an object with a `name` and ``answer(X, mu)``, which is checked and returned: a table from
        `open_table`, or a model of one's own (`IslandModel`, `GeometryModel`).
    rtol : float
        Relative error asked of the results, in [1e-11, 0.1].
    reading : Reading
        A model that was made for one reading says so by its `reading`.

    Raises
    ------
    InputError
        For an unknown tier, an object that is no island model, an `rtol` out of range, or another reading.
    """
    asked = number_in("rtol", rtol, MIN_RTOL, MAX_RTOL)
    model = _named(tier, asked) if isinstance(tier, str) else _checked(tier)
    own = getattr(model, "reading", None)
    if isinstance(own, Reading) and (
        own.density_divisor != reading.density_divisor or own.summit_sigma != reading.summit_sigma
    ):
        raise InputError(
            f"the {model.name} table was made for the reading {own.name!r}, not for {reading.name!r}; "
            "tier 'universal' serves every reading"
        )
    return model


def _checked(model: AnyModel) -> AnyModel:
    known = isinstance(model, IslandModel | GeometryModel) and not isinstance(model, type)
    if not known or not isinstance(model.name, str):
        raise InputError(f"tier must be one of {TIERS} or an object with a name and answer(X, mu), got {model!r}")
    return model


def _named(tier: str, rtol: float) -> AnyModel:
    if tier == "exact":
        return exact_model(rtol)
    if tier == "rigid":
        return RigidModel()
    if tier == "formula":
        from mbma_tables.models.closed_forms import FormulaModel

        return FormulaModel()
    if tier not in TIERS:
        raise InputError(f"tier must be one of {TIERS} or an island model, got {tier!r}")
    # netCDF comes in where a table is asked for
    from mbma_tables.models.tables import open_table

    return open_table(tier)
