"""Island models by name; closed forms and netCDF are imported when needed."""

from __future__ import annotations

from mbma_tables.common.arguments import number_in
from mbma_tables.common.errors import InputError
from mbma_tables.models import (
    ISLAND_MODELS,
    MAX_RTOL,
    MIN_RTOL,
    AnyModel,
    GeometryModel,
    IslandModel,
    RigidModel,
    exact_model,
)
from mbma_tables.surfaces.variants import Variant


def get_model(island_model: str | AnyModel, rtol: float, variant: Variant) -> AnyModel:
    """The island model by a name or an object, accurate enough for results at `rtol`.

    `island_model` is one of `ISLAND_MODELS`, or a model (`IslandModel`, `GeometryModel`), which is checked. A model
    made for one variant has the attribute `variant`.
    """
    asked = number_in("rtol", rtol, MIN_RTOL, MAX_RTOL)
    if isinstance(island_model, str) and island_model in ISLAND_MODELS:
        model = _named(island_model, asked)
    elif (
        isinstance(island_model, IslandModel | GeometryModel)
        and not isinstance(island_model, type)
        and isinstance(island_model.name, str)
    ):
        model = island_model
    else:
        raise InputError(
            f"island_model must be one of {ISLAND_MODELS} or an object with a name and answer(X, mu), "
            f"got {island_model!r}"
        )
    own = getattr(model, "variant", None)
    if isinstance(own, Variant) and (
        own.density_divisor != variant.density_divisor or own.summit_sigma != variant.summit_sigma
    ):
        raise InputError(
            f"the {model.name} table was made for the variant {own.name!r}, not for {variant.name!r}; "
            "island model 'universal' serves every variant"
        )
    return model


def _named(island_model: str, rtol: float) -> AnyModel:
    if island_model in ("exact", "rigid"):
        return exact_model(rtol) if island_model == "exact" else RigidModel()
    if island_model == "formula":
        from mbma_tables.models.closed_forms import FormulaModel

        return FormulaModel()
    from mbma_tables.models.tables import open_table

    return open_table(island_model)
