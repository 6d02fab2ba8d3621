"""Stiffnesses of a contact, normal and tangential, and its energy."""

from typing import Any

from mbma_tables.common.arguments import answered
from mbma_tables.common.units import Dimension
from mbma_tables.contacts.quantities.declaration import (
    LawFunction,
    of_elastic_contacts,
    of_yielding_contacts,
    quantity,
)
from mbma_tables.contacts.quantities.state import Need, State
from mbma_tables.contacts.quantities.tangential import tangential_ratio_of
from mbma_tables.core import core

STIFFNESS = Dimension(stress=1, length=-1)
ENERGY = Dimension(stress=1, length=1)

# of laws
ENERGY_OF_YIELDED = (
    "the integral of the pressure of a law with a hardness is the work of loading, of which "
    "yielded points give back a part: at(...).energy has what a contact gives back"
)

NO_ADHESION = Need(
    "bodies without adhesion",
    lambda contact: contact.bodies.adhesion is None,
    "effective_work is the work of parting bodies that attract each other; the energy of "
    "their deformation alone is that of the same bodies without adhesion at the same gap",
)

POISSONS_RATIO = Need(
    "nu",
    lambda contact: contact.bodies.bodies.nu is not None,
    "Poisson's ratio of the bodies, Bodies(..., nu=0.3), or named metals",
    options=("kappa",),
)


@quantity(
    STIFFNESS,
    "-dF/du per nominal area, of first loading",
    uncertainty="stiffness_scatter",
    law_function=LawFunction(
        "tangent", "MBMA_STIFFNESS", "derivative of pressure by overclosure"
    ),
    similarity=(-1, 0),
)
def stiffness(contact: State) -> Any:
    """-d(F/A0)/du [stress/length] of first loading, against the mean separation."""
    return (contact.E_star * contact.answer.stiffness)[()]


@quantity(
    STIFFNESS,
    "-dF/du per nominal area, of a small unloading",
    uncertainty="unloading_stiffness_scatter",
    is_listed=of_yielding_contacts,
    similarity=(-1, 0),
)
def unloading_stiffness(contact: State) -> Any:
    """-d(F/A0)/du [stress/length] of a small unloading at constant contact area; `stiffness` if nothing yields.

    Of bodies that attract each other it is the elastic one at this gap, without the change of the attraction.
    """
    if contact.bodies.adhesion is not None:
        return contact.evaluate(
            lambda theory, surface, u, E_star: (
                E_star * theory.elastic.answer(surface, u).stiffness,
            )
        )[0]
    if not contact.yields:
        return contact.stiffness
    return (contact.E_star * contact.of_loading("unloading_stiffness"))[()]


@quantity(
    STIFFNESS,
    "shear stress over displacement before slip",
    needs=(POISSONS_RATIO,),
    uncertainty="unloading_stiffness_scatter",
    made_of=("unloading_stiffness",),
    follows="unloading_stiffness",
    similarity=(-1, 0),
)
def tangential_stiffness(contact: State) -> Any:
    """Tangential stiffness of full stick [stress/length], `unloading_stiffness`/kappa (Mindlin 1949)."""
    given = {
        "unloading_stiffness": contact.unloading_stiffness,
        "kappa": tangential_ratio_of(contact),
    }
    return contact.evaluate(
        lambda theory, surface, u, E_star, stiffness, kappa: tuple(
            answered(core.tangential_stiffnesses, (stiffness, kappa))
        ),
        1,
        given,
    )[0]


@quantity(
    ENERGY,
    "elastic energy per nominal area, which unloading gives back",
    uncertainty="energy_scatter",
    error_sign=0,
    needs=(NO_ADHESION,),
    is_column=False,
    is_listed=of_elastic_contacts,
    law_function=LawFunction(
        "energy", "MBMA_ENERGY", "integral of pressure over overclosure"
    ),
    similarity=(1, 0),
)
def energy(contact: State) -> Any:
    """Elastic energy per nominal area [stress length] that unloading gives back, the integral of F/A0 over u."""
    unloading = contact.unloading()
    return unloading.energy_at(unloading.mean_separation)
