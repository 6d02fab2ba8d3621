"""Island models, one protocol: totals take any of them and do not ask which."""

from __future__ import annotations

from mbma_tables.arguments import number_in
from mbma_tables.errors import InputError
from mbma_tables.islands.greenwood_tripp import TIGHTEST
from mbma_tables.models.protocol import IslandAnswer, IslandModel
from mbma_tables.models.solved import ExactModel, RigidModel

__all__ = ["TIERS", "ExactModel", "IslandAnswer", "IslandModel", "RigidModel", "get_model"]

TIERS = ("exact", "rigid")


LEAST_RTOL = 1e-11


def get_model(tier: str, rtol: float) -> IslandModel:
    """The island model of a tier, accurate enough for results at `rtol`.

    Raises
    ------
    InputError
        For an unknown tier, or an `rtol` outside [1e-11, 0.1].
    """
    asked = number_in("rtol", rtol, LEAST_RTOL, 0.1)
    if tier == "exact":
        return ExactModel(max(0.1 * asked, TIGHTEST))
    if tier == "rigid":
        return RigidModel()
    raise InputError(f"tier must be one of {TIERS}, got {tier!r}")
