"""docs/joints.md: stiffness at light loads against boundary elements, conductance against a usual correlation."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from generate.boundary_elements.collect import surfaces
from generate.boundary_elements.light import BINS, LOADS, compared, summary
from generate.files import dataset
from generate.pages.page import Measured, panels, table
from mbma_tables import Joint
from mbma_tables.common.arguments import FloatArray
from mbma_tables.totals.conductance import cooper_mikic_yovanovich, mean_conductivity

PAIRS = {"steel on aluminium": ("steel 4140 hard", "aluminium 6061 hard"), "copper on copper": "copper C11000 hard"}
SHORTEST, PRESSURES = ("8 um", "2 um"), (1.0, 10.0, 100.0)  # MPa


def joint(materials: Any, shortest: str) -> Joint:
    """A joint of machined faces."""
    face = {"hurst": 0.8, "longest": "250 um", "shortest": shortest}
    return Joint(face | {"Rq": "1.6 um"}, face | {"Rq": "0.8 um"}, materials=materials, nominal_area="4 cm^2")


def both(one: Joint, pressure: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Conductance of the solid [W/(m^2 K)] at pressures [MPa], by the law and by the correlation."""
    k = mean_conductivity(*(float(text.split()[0]) for text in one.pair.conductivities))
    assert one.pair.hardness is not None
    hardness = 1e3 * float(one.pair.hardness.split()[0])
    law = one.at_pressure([f"{p} MPa" for p in pressure]).conductance()
    return np.asarray(law), 1e6 * np.asarray(cooper_mikic_yovanovich(one.surface, pressure, k, 1.0, hardness))


def measure() -> Measured:
    """Both tables and a figure."""
    found = dataset("light_loads")
    contacts = " | ".join(f"{low:.2%} to {high:.2%}" for low, high in itertools.pairwise(BINS))
    parts = {"light": table(f"longest wavelengths a side | {contacts}", summary(found))}
    rows, (figure, (left, right)) = [], panels(1, 2, (10, 3.8))
    pressure = np.geomspace(0.1, 300, 40)
    for (name, materials), shortest in itertools.product(PAIRS.items(), SHORTEST):
        one = joint(materials, shortest)
        law, usual = both(one, np.array(PRESSURES))
        rows.append([name, shortest, *(f"{a:.3g}, {b / a:.2f}" for a, b in zip(law, usual, strict=True))])
        law, usual = both(one, pressure)
        (line,) = left.loglog(pressure, law, label=f"{name}, {shortest}")
        left.loglog(pressure, usual, "--", color=line.get_color())
    parts["usual"] = table(f"joint | shortest wavelength | {' | '.join(f'{p:g} MPa' for p in PRESSURES)}", rows)
    left.set(xlabel="pressure [MPa]", ylabel="conductance [W/(m² K)]", title="law; dashed: Cooper-Mikic-Yovanovich")
    left.legend(fontsize=7)
    for own in surfaces(found):
        area, stiffness, _ = compared(own)
        style: dict[str, Any] = {"markersize": 2, "color": f"C{int(np.log2(own.waves))}", "rasterized": True}
        right.semilogx(area, np.exp(stiffness), ".", **style)
    right.set(xlabel="contact A/A0", ylabel="simulated stiffness over law", ylim=(0, 2), xlim=(LOADS[0], 0.03))
    right.set_title("light loads, by longest wavelengths a side")
    for waves in np.unique(found.waves):
        right.plot([], [], ".", color=f"C{int(np.log2(waves))}", label=str(waves))
    right.legend(fontsize=7)
    return parts, {"docs/figures/joints.svg": figure}
