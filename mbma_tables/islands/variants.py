"""Variants of the paper: named choices where its text is ambiguous or misprinted.

`printed` is exactly the printed equations. `reported`, the default, takes every summit
density without its pi, and so gives the results that the paper reports. Nothing else is
adjusted in these two. `fitted` has its constants fitted to the contact area of boundary
elements, and adds areas as a cover: its area at a force is good to full contact, its
separation is no better than theirs.
"""

import dataclasses
import math
from typing import Literal

import numpy as np

from mbma_tables.common.arguments import FloatArray, answered
from mbma_tables.common.errors import InputError
from mbma_tables.core import core
from mbma_tables.surfaces.spectrum import NAYAK


@dataclasses.dataclass(frozen=True)
class Variant:
    """One variant of the paper's equations; make another with ``dataclasses.replace``.

    Raises
    ------
    InputError
        For numbers without meaning in the model.

    Examples
    --------
    >>> import dataclasses
    >>> from mbma_tables import Surface, contact
    >>> from mbma_tables.theories import Mbma
    >>> from mbma_tables.islands.variants import PRINTED
    >>> flat = dataclasses.replace(PRINTED, name="no offset", offset=False)
    >>> contact(Surface.named("concrete"), separation=0.6, theory=Mbma(variant=flat)).variant
    'no offset'
    """

    name: str  # of the variant in results
    # summit density is m4/(density_divisor m2), wherever one enters (2, 32, 39, 43a)
    density_divisor: float = NAYAK
    # K1 of (47): 1 - 4 beta/3, or "exact", 1 - (4 beta/3)/sqrt(1 - zeta_1^(-2H)) as (46)
    # with (27b) gives
    jacobian: Literal["printed", "exact"] = "printed"
    offset: bool = True  # whether islands are offset by h_d below z_max (35, 41)
    # whether sigma of islands and of their heights is the summits' (32, 43a), or sqrt(m0)
    summit_sigma: bool = True
    beta: float = 1 / 3  # share of the approach that deforms the sphere (B.6)
    phi: float = 0.05  # roughness over Hertz deformation below which roughness does not matter (28)
    floor_d: float = 1.5  # smallest zeta_d (27a)
    floor_u: float = 3.0  # and zeta_u (30a)
    # areas of islands: as printed (49), or as islands placed at random "cover", A/A0 = 1 -
    # exp(-sum)
    addition: Literal["sum", "cover"] = "sum"

    def __post_init__(self) -> None:
        allowed = {
            "density_divisor must be positive and finite": 0
            < self.density_divisor
            < math.inf,
            "jacobian must be 'printed' or 'exact'": self.jacobian
            in ("printed", "exact"),
            "beta must lie in (0, 3/4)": 0 < self.beta < 0.75,
            "phi must be positive, with phi/(1 + phi) < 4 beta/3": 0
            < self.phi / (1 + self.phi)
            < 4 * self.beta / 3,
            "addition must be 'sum' or 'cover'": self.addition in ("sum", "cover"),
            "floors must satisfy 1 < floor_d < floor_u": 1 < self.floor_d < self.floor_u,
        }
        for rule, kept in allowed.items():
            if not kept:
                raise InputError(f"variant {self.name!r}: {rule}")

    def area_of(self, area_sum: FloatArray) -> FloatArray:
        """A/A0 of the sum of islands' areas over A0; its relative error is at most the sum's."""
        if self.addition == "sum":
            return area_sum
        return answered(core.covered_areas, (area_sum,))[0]

    @property
    def recorded(self) -> list[float]:
        """The numbers recorded in table files."""
        numbers = self.density_divisor, self.beta, self.phi, self.floor_d, self.floor_u
        return [*map(float, numbers), bool(self.offset), bool(self.summit_sigma)]

    @property
    def numbers(self) -> FloatArray:
        """The numbers for the core, `mbma_variant` of mbma.h."""
        return np.array([*self.recorded, self.jacobian == "printed"], dtype=float)


PRINTED = Variant("printed")
REPORTED = Variant("reported", density_divisor=NAYAK / math.pi)
# fitted to the area at equal force of 105 surfaces by boundary elements (docs/fidelity.md);
# effective, not physical
FITTED = Variant(
    "fitted",
    density_divisor=4.10,
    beta=0.656,
    phi=0.0274,
    floor_d=1.036,
    floor_u=5.14,
    addition="cover",
)
VARIANTS = {variant.name: variant for variant in (REPORTED, PRINTED)}  # of the paper
NAMED = VARIANTS | {FITTED.name: FITTED}


def get_variant(variant: str | Variant) -> Variant:
    """The variant of that name, or the variant itself."""
    if isinstance(variant, Variant):
        return variant
    if not isinstance(variant, str) or variant not in NAMED:
        raise InputError(
            f"variant must be one of {sorted(NAMED)} or a Variant, got {variant!r}"
        )
    return NAMED[variant]
