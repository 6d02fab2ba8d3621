"""Whether rough bodies stick: the contact's own answer beside published criteria, in one table."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import hinted
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.contact import contact
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.adhesion import LAPLACIAN
from mbma_tables.theories.base import Theory, UserTheory

# of Pastewka and Robbins: E* g over the mean pressure of contact spots, and the threshold
REPULSIVE = 2.0
THRESHOLD = float(np.pi * (3 / 16) ** (2 / 3))
# of Fuller and Tabor: rms height of summits over their elongation at pull-off, from which
# hardly anything sticks
WEAK = 3.0


@dataclasses.dataclass(frozen=True)
class Criterion:
    """One criterion: its number, and up to where bodies stick by it."""

    name: str
    number: float
    sticks_below: float
    reference: str

    @property
    def sticks(self) -> bool:
        """Whether bodies stick by it."""
        return bool(self.number < self.sticks_below)


@dataclasses.dataclass(frozen=True, eq=False)
class Sticking:
    """What a contact with an attraction bears in tension, and what published criteria say."""

    pull_off: float  #: largest tension [stress]
    zero_load_area: float  #: A/A0 at zero load
    zero_load_gap: float  #: mean gap at zero load [length]
    effective_work: float  #: of parting from zero load [stress length]
    valid: bool  #: whether contacts at zero load are of a kind that was simulated
    criteria: tuple[Criterion, ...]
    units: dict[str, str]

    def __str__(self) -> str:
        own = ("pull_off", "zero_load_area", "zero_load_gap", "effective_work")
        lines = [f"{name} {getattr(self, name):.4g} {self.units[name]}" for name in own]
        lines += [f"valid {self.valid}"]
        for one in self.criteria:
            verdict = "sticks" if one.sticks else "does not stick"
            lines.append(
                f"{one.name}: {one.number:.3g}, below {one.sticks_below:.3g} for "
                f"sticking: {verdict} ({one.reference})"
            )
        return "\n".join(lines)


@hinted
def sticking(
    surface: AnySurface,
    bodies: Bodies,
    theory: str | Theory | UserTheory | None = None,
) -> Sticking:
    """Whether a rough surface sticks to a flat: pull-off, the contact at zero load, and published criteria.

    Parameters
    ----------
    surface : Surface
        One surface.
    bodies : Bodies
        With an adhesion.
    theory : str or theory, optional
        As for `contact` at a pressure.

    Raises
    ------
    InputError
        For bodies without adhesion, batches, and attractions that close all gaps.

    Notes
    -----
    The criteria are numbers of which sticking bodies have small ones. With the rms gradient g, the rms
    Laplacian c, the work w, the range r (work over strength), and E*::

        Pastewka, Robbins   (g r E*/(2 w)) (g d/(4 r))^(2/3), d = 8 g/c      < pi (3/16)^(2/3)
        Persson, Tosatti    elastic energy of full contact over w              < 1
        Fuller, Tabor       (4 s/3) (E*/(pi R^(1/2) w))^(2/3), s and R of summits  < 3

    The criterion of Violano and others is left out, since its constant could not be checked
    in a public source.

    Examples
    --------
    >>> from mbma_tables import Adhesion, Bodies, Surface
    >>> from mbma_tables.contacts.sticking import sticking
    >>> wafer = Surface(hurst=0.8, q0=0.01, q1=0.2, h_rms=0.2, h_max=0.7, unit="nm")
    >>> silicon = Bodies("80 GPa", adhesion=Adhesion("20 mJ/m^2", "0.3 nm"))
    >>> [f"{one.name}: {one.sticks}" for one in sticking(wafer, silicon).criteria]
    ['Pastewka, Robbins: False', 'Persson, Tosatti: True', 'Fuller, Tabor: True']
    """
    in_units = Bodies.of(bodies).in_units(surface)
    attraction = in_units.adhesion
    if attraction is None:
        raise InputError(
            "sticking needs bodies with an adhesion of positive work: "
            "Bodies(..., adhesion=Adhesion(work=..., range=...))"
        )
    if surface.shape != () or np.ndim(in_units.E_star):
        raise InputError("sticking is of one surface and one modulus")
    free = contact(surface, bodies, pressure=0.0, theory=theory)
    own = ("pull_off", "zero_load_area", "zero_load_gap", "effective_work")
    numbers = {name: float(free.quantity(name)) for name in own}
    E_star = float(in_units.E_star)
    return Sticking(
        **numbers,
        valid=bool(free.valid),
        criteria=_criteria(surface, attraction, E_star),
        units={name: free.units[name] for name in own},
    )


def _criteria(surface: Any, attraction: Any, E_star: float) -> tuple[Criterion, ...]:
    gradient = float(surface.rms_gradient)
    curvature = float(np.sqrt(LAPLACIAN * surface.m4))
    length = attraction.work / E_star
    width = attraction.width
    # their rms curvature is half the rms Laplacian
    diameter = 4 * gradient / (curvature / 2)
    of_spots = gradient * width / (REPULSIVE * length)
    of_spots *= (gradient * diameter / (4 * width)) ** (2 / 3)
    full = _energy_of_full_contact(surface) / length
    radius = float(surface.summit_radius)
    height = float(surface.summit_sigma)
    of_summits = 4 / 3 * height * (1 / (np.pi * np.sqrt(radius) * length)) ** (2 / 3)
    return (
        Criterion("Pastewka, Robbins", of_spots, THRESHOLD, "PNAS 111 (2014) 3298"),
        Criterion("Persson, Tosatti", full, 1.0, "J. Chem. Phys. 115 (2001) 5597"),
        Criterion("Fuller, Tabor", of_summits, WEAK, "Proc. R. Soc. A 345 (1975) 327"),
    )


def _energy_of_full_contact(surface: Any) -> float:
    """Elastic energy over A0 E* [length] of a surface pressed flat, pi/2 times the integral of q^2 C."""
    q = np.geomspace(float(surface.q0), float(surface.q1), 4001)
    C = np.asarray(surface.power_spectrum(q))
    return float(np.pi / 2 * np.trapezoid(q**3 * C, np.log(q)))
