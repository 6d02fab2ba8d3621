"""Island models by name, by a table's file, or as objects."""

import os
import pathlib

from mbma_tables.common.arguments import number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_once
from mbma_tables.islands import island_models as models
from mbma_tables.islands.island_models import AnyModel
from mbma_tables.islands.variants import Variant
from mbma_tables.tables.open import open_islands


def with_table(island_model: str | os.PathLike[str] | AnyModel) -> str | AnyModel:
    """The model of a table's file; a name or an object is returned as it is.

    Raises
    ------
    TableFileError
        If the file is not there, damaged, or no table.
    """
    if isinstance(island_model, os.PathLike):
        return read_once(island_model, open_islands)
    if not isinstance(island_model, str) or island_model in models.ISLAND_MODELS:
        return island_model
    path = pathlib.Path(island_model)
    is_file = path.suffix == ".nc" or path.is_file()
    return read_once(path, open_islands) if is_file else island_model


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
        model = open_islands(model)
    if isinstance(model, type) or not (
        isinstance(model, models.IslandModel | models.GeometryModel)
        and isinstance(getattr(model, "name", None), str)
    ):
        known = f"one of {models.ISLAND_MODELS}, the file of a table, or an object with a name and answer(X, mu)"
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
            f"the {model.name} table was made for the variant {made_for.name!r}, not for {variant.name!r}: "
            "give its variant, or island model 'universal', which serves every variant"
        )
    return model
