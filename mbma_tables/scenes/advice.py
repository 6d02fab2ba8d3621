"""Which theory is nearer to brute force than MBMA for what a scene asks, and at what price."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbma_tables.scenes.costs import shipped_costs
from mbma_tables.scenes.plan import duration, make_plan, seconds_by_theory
from mbma_tables.scenes.problem import INVERTED, Problem

MAX_AREA = 0.99
CANDIDATES = ("calibrated", "persson", "greenwood_williamson")
# what is asked: the quantity of tables/calibrated.nc whose distance from simulations decides
QUANTITIES = {"stiffness": "stiffness", "conductance": "stiffness", "force": "force", "energy": "force"}


def advice(problem: Problem) -> str:
    """One line about a gap, stiffness or conductance asked of MBMA; empty where there is nothing to say."""
    asked = {name: quantity for name, quantity in QUANTITIES.items() if name in problem.outputs}
    if problem.prescribed in INVERTED:
        asked = {"gap": "force"} | {name: quantity for name, quantity in asked.items() if quantity == "stiffness"}
    contacts = _contacts(problem) if problem.theory == "mbma" and asked else np.empty(0)
    if not contacts.size:
        return ""
    from mbma_tables.theories.calibrated_table import shipped
    from mbma_tables.theories.contact import contact
    from mbma_tables.theories.mbma import Mbma

    # stiffness first: it is the more telling where both are asked
    name, quantity = next((pair for pair in asked.items() if pair[1] == "stiffness"), next(iter(asked.items())))
    # distances at the contact that the calibrated law expects, in the middle of what is prescribed
    area = float(np.median(contacts))
    rows = {"mbma": Mbma(reading=problem.reading).scatter_name(problem.surface), **{row: row for row in CANDIDATES}}
    spread = {
        theory: float(shipped().standard_deviation(row, quantity, np.asarray(area))) for theory, row in rows.items()
    }
    # NaN: not compared, or no such contact is reached
    nearest = min(CANDIDATES, key=lambda theory: np.nan_to_num(spread[theory], nan=math.inf))
    if not spread[nearest] < np.nan_to_num(spread["mbma"], nan=math.inf):
        return ""
    measured = shipped_costs()
    price = seconds_by_theory(measured, nearest, problem.gaps.size, problem.prescribed in INVERTED)
    reasons = contact(problem.surface, area=min(area, MAX_AREA), theory=nearest).reasons
    return (
        f"  advice: for {name} theory {nearest!r} is nearer to boundary elements, {_size(spread[nearest])} instead of "
        f"{_size(spread['mbma'])} at {area:.2%} contact, in {duration(price)} instead of "
        f"{duration(make_plan(problem, measured).seconds)}{'; not tested there: ' if reasons else ''}"
        f"{', '.join(reasons)}\n"
    )


def _size(spread: float) -> str:
    """A standard deviation of a logarithm in words."""
    if math.isnan(spread):
        return "an unknown distance"
    return f"{spread:.1%}" if spread < 0.3 else f"a factor {math.exp(spread):.2g}"


def _contacts(problem: Problem) -> Any:
    """Contact fractions that the calibrated law expects where surfaces touch."""
    from mbma_tables.calibrated import area
    from mbma_tables.theories import get_theory

    surface, known = problem.surface, problem.gaps
    if problem.prescribed == "areas":
        found = known
    elif problem.prescribed == "pressures":
        found = area(known / problem.E_star / float(surface.rms_gradient), float(surface.alpha))
    else:
        h_max = float(surface.h_max)
        u = known if problem.prescribed == "mean_separations" else (h_max + known) / 2
        found = get_theory("calibrated").answer(surface, np.minimum(u, h_max)).area
    return found[found > 0]
