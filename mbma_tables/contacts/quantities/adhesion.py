"""What attraction does to a contact: its mean, pull-off, and the contact at zero load; docs/adhesion.md."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.quantities.declaration import (
    DIMENSIONLESS,
    on_request,
    quantity,
)
from mbma_tables.contacts.quantities.pressures import STRESS
from mbma_tables.contacts.quantities.separations import LENGTH
from mbma_tables.contacts.quantities.state import Need, State
from mbma_tables.contacts.quantities.stiffnesses import ENERGY

ADHESION = Need(
    "adhesion",
    lambda contact: contact.bodies.adhesion is not None,
    "the attraction of the bodies, Bodies(..., adhesion=Adhesion(work=..., range=...)), of positive work",
)


def _of_theory(contact: State, ask: Callable[[Any, Any, Any, Any], Any]) -> Any:
    """What the adhesive theory knows of each entry, as ``ask(theory, surface, u, E_star)``."""

    def found(theory: Any, surface: Any, u: Any, E_star: Any) -> tuple[FloatArray]:
        value = np.asarray(ask(theory, surface, u, E_star))
        shape = np.broadcast_shapes(np.shape(u), np.shape(value))
        return (np.broadcast_to(value, shape).copy(),)

    return contact.evaluate(found)[0]


@quantity(
    STRESS,
    "mean attraction of the bodies, by which the contact is pressed beside the load",
    needs=(ADHESION,),
    is_column=False,
    is_listed=on_request,
)
def attraction(contact: State) -> Any:
    """Mean attraction that presses the contact beside the load [stress], effective less net pressure."""

    def pull(theory: Any, surface: Any, u: Any, E_star: Any) -> Any:
        area = theory.elastic.answer(surface, u).area
        return E_star * theory.pull(surface, u, area)

    return _of_theory(contact, pull)


@quantity(
    STRESS,
    "tension at which the bodies part",
    needs=(ADHESION,),
    is_column=False,
    is_listed=on_request,
)
def pull_off(contact: State) -> Any:
    """Largest tension F/A0 that the bodies bear, at least 0 [stress], of the surface and bodies."""
    return _of_theory(
        contact,
        lambda theory, surface, u, E_star: E_star * theory.pull_off(surface)[0],
    )


@quantity(
    LENGTH,
    "mean gap at zero load",
    needs=(ADHESION,),
    is_column=False,
    is_listed=on_request,
)
def zero_load_gap(contact: State) -> Any:
    """Mean gap of the bodies at zero load [length], after they were pressed together."""
    return _of_theory(
        contact, lambda theory, surface, u, E_star: theory.free_gap(surface)
    )


@quantity(
    DIMENSIONLESS,
    "real over nominal contact area at zero load",
    needs=(ADHESION,),
    is_column=False,
    is_listed=on_request,
)
def zero_load_area(contact: State) -> Any:
    """A/A0 at zero load, after the bodies were pressed together."""

    def area(theory: Any, surface: Any, u: Any, E_star: Any) -> Any:
        return theory.elastic.answer(surface, theory.free_gap(surface)).area

    return _of_theory(contact, area)


@quantity(
    ENERGY,
    "effective work of adhesion, of parting the bodies from zero load",
    needs=(ADHESION,),
    is_column=False,
    is_listed=on_request,
)
def effective_work(contact: State) -> Any:
    """Work per nominal area of parting the bodies from zero load [stress length], the integral of the tension over u."""
    return _of_theory(
        contact,
        lambda theory, surface, u, E_star: E_star * theory.parting_work(surface),
    )


@quantity(
    DIMENSIONLESS,
    "Tabor's number of a summit, up to 0.4 of which contacts were simulated",
    needs=(ADHESION,),
    is_column=False,
    is_listed=on_request,
)
def tabor_number(contact: State) -> Any:
    """Tabor's number of a summit, (2 w^2/(c E*^2 rho^3))^(1/3) with the rms Laplacian c of the heights."""
    return _of_theory(contact, lambda theory, surface, u, E_star: theory.tabor(surface))
