"""Maps that yield: boundary elements with a hardness at loads between those of `theory="simulated"`, and answers."""

from typing import Any

import numpy as np

from generate.machined.makers import GRADIENT, Part
from generate.machined.solve import surface_of
from mbma_tables import contact
from mbma_tables.laws.boundary_elements import Contact
from mbma_tables.theories.own_map import law_loads
from mbma_tables.theories.saturated import of_map
from mbma_tables.theories.yielding import Yielding

ETA = (0.1, 0.4)  # p_m/(E* g)
AREAS = (0.025, 0.067, 0.14, 0.39, 0.58)  # that loads aim at
QUANTITIES = ("area", "mean_separation", "yielded", "unloading_stiffness")
WAYS = ("true", "simulated", "law")


def yielded(part: Part) -> dict[str, Any]:
    """Truth at a tolerance of 1e-6, the map simulated, and the law of hardness on its simulated elastic contact.

    Of each, `QUANTITIES` by hardness and load, and the slope of the pressure.
    """
    values, surface = surface_of(part)
    elastic, found = law_loads(surface, AREAS), np.empty((len(WAYS), len(QUANTITIES), len(ETA), len(AREAS)))
    force, slope = np.empty((2, len(ETA), len(AREAS)))
    for k, cap in enumerate(GRADIENT * eta for eta in ETA):
        force[k] = ((cap * np.array(AREAS)) ** -2 + elastic**-2) ** -0.5
        engine = Contact(values, values.shape, hardness=cap)
        for place, load in enumerate(force[k].tolist()):
            row = engine.press(load)
            share = row["area_yielded"] / row["area"]
            found[0, :, k, place] = row["area"], row["mean_separation"], share, engine.frozen_stiffness()
        answer = contact(surface, pressure=force[k], hardness=cap, theory="simulated")
        found[1, :, k] = [getattr(answer, name) for name in QUANTITIES]
        law = Yielding(of_map("simulated", surface), cap)
        u, lighter = law.pressed(surface, force[k])
        loaded = law.loaded(surface, u, lighter)
        found[2, :, k] = loaded.answer.area, u, loaded.yielded, loaded.unloading_stiffness
        slope[k] = answer.stiffness
    columns = zip(QUANTITIES, np.swapaxes(found, 0, 1), strict=True)
    return {f"hard_{name}": values for name, values in columns} | {"hard_pressure": force, "hard_stiffness": slope}
