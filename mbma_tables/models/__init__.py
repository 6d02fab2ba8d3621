"""Island models, one protocol: totals take any of them and do not ask which."""

from __future__ import annotations

from mbma_tables.arguments import number_in
from mbma_tables.errors import InputError
from mbma_tables.islands.greenwood_tripp import TIGHTEST
from mbma_tables.models.exact import ExactModel, RigidModel
from mbma_tables.models.protocol import IslandAnswer, IslandModel
from mbma_tables.surfaces.readings import Reading

__all__ = ["TIERS", "ExactModel", "IslandAnswer", "IslandModel", "RigidModel", "get_model"]

TIERS = ("exact", "universal", "island4d", "formula", "rigid")
LEAST_RTOL = 1e-11


def get_model(tier: str, rtol: float, reading: Reading) -> IslandModel:
    """The island model of a tier, accurate enough for results at `rtol`; a table is what its certificate says.

    Raises
    ------
    InputError
        For an unknown tier, an `rtol` outside [1e-11, 0.1], or a reading that the tier's table was not made for.
    """
    asked = number_in("rtol", rtol, LEAST_RTOL, 0.1)
    if tier == "exact":
        return ExactModel(max(0.1 * asked, TIGHTEST))
    if tier == "rigid":
        return RigidModel()
    if tier not in TIERS:
        raise InputError(f"tier must be one of {TIERS}, got {tier!r}")
    if tier == "formula":
        from mbma_tables.models.closed_forms import FormulaModel

        return FormulaModel()
    # netCDF comes in where a table is asked for
    from mbma_tables.models.universal import island4d_model, universal_model

    if tier == "universal":
        return universal_model()
    model = island4d_model()
    if model.reading.numbers[0] != reading.density_divisor or model.reading.summit_sigma != reading.summit_sigma:
        raise InputError(
            f"the island4d table was made for the reading {model.reading.name!r}, not for {reading.name!r}; "
            "tier 'universal' serves every reading"
        )
    return model
