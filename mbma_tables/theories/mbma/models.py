"""Island models by name, by a table's file, or as objects."""

from mbma_tables.common.arguments import number_in
from mbma_tables.common.errors import InputError
from mbma_tables.islands import island_models as models
from mbma_tables.islands.island_models import AnyModel
from mbma_tables.islands.variants import Variant
from mbma_tables.tables.open import open_table


def get_model(island_model: str | AnyModel, rtol: float, variant: Variant) -> AnyModel:
    """One of `ISLAND_MODELS`, or an object, which is checked, accurate enough for results at `rtol`.

    A model made for one variant has the attribute `variant`.
    """
    asked = number_in("rtol", rtol, models.MIN_RTOL, models.MAX_RTOL)
    model = island_model
    if isinstance(model, str) and model in models.ISLAND_MODELS:
        if model == "formula":
            from mbma_tables.theories.mbma.closed_forms import FormulaModel

            return FormulaModel()
        if model in ("exact", "rigid"):
            return models.RigidModel() if model == "rigid" else models.exact_model(asked)
        model = open_table(model)
    if isinstance(model, type) or not (
        isinstance(model, models.IslandModel | models.GeometryModel)
        and isinstance(getattr(model, "name", None), str)
    ):
        known = (
            f"one of {models.ISLAND_MODELS} or an object with a name and answer(X, mu)"
        )
        raise InputError(f"island_model must be {known}, got {island_model!r}")
    made_for = getattr(model, "variant", variant)
    if isinstance(made_for, Variant) and (
        made_for.density_divisor,
        made_for.summit_sigma,
    ) != (
        variant.density_divisor,
        variant.summit_sigma,
    ):
        raise InputError(
            f"the {model.name} table was made for the variant {made_for.name!r}, not for {variant.name!r}; "
            "island model 'universal' serves every variant"
        )
    return model
