"""Conductances for Lethe: the numbers of its formula, in `particle_heat_transfer.cc`."""

import math

import numpy as np

from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import SI, Grammar
from mbma_tables.export.text import about, number, opening

# h = 1.25 k_s m/sigma (p/H)^0.96 (Yovanovich), of which Lethe has the mean over Hertz's
# pressure
YOVANOVICH = 1.25
EXPONENT = 0.96


def _lethe(law: LawTable) -> str:
    """Numbers of two faces that are alike.

    Lethe adds squares of roughness and slope, and averages hardness.
    """
    sigma, _ = law.facts["h_rms"]
    gradient, _ = law.facts["rms_gradient"]
    k_s, _ = law.facts["conductivity"]
    fitted = (law.x > 0) & (law.y >= law.floor)
    pressure = law.x[fitted]
    slope = gradient / math.sqrt(math.pi)
    # ln H of each row, and the one between the least and the largest
    of_slope = law.y[fitted] * sigma / (YOVANOVICH * k_s * slope)
    log_hardness = np.log(pressure) - np.log(of_slope) / EXPONENT
    middle = (log_hardness.max() + log_hardness.min()) / 2
    spread = EXPONENT * (log_hardness.max() - log_hardness.min()) / 2
    note = (
        f"Lethe's conductance 1.25 k m/sigma (p/H)^0.96 is within {about(math.expm1(spread), 2)} "
        f"of the law's from p = {about(pressure[0])} to {about(law.x[-1])} {law.x_unit} with "
        "this microhardness H, which is fitted to this surface slope m: both depend on the "
        "shortest wavelength of the surface. m is the mean of |dz/dx|."
    )
    numbers = {
        "microhardness": math.exp(middle),
        "surface slope": slope / math.sqrt(2),
        "surface roughness": sigma / math.sqrt(2),
    }
    particles = ""
    wall = ""
    for key, value in numbers.items():
        particles += f"    set {key} particles = {number(value)}\n"
        wall += f"  set {key} wall = {number(value)}\n"
    return (
        f"{opening([note], '#')}\n"
        "subsection lagrangian physical properties\n"
        "  subsection particle type 0\n"
        f"{particles}"
        "  end\n"
        f"{wall}"
        "end\n"
    )


lethe = Grammar(
    program="Lethe",
    mark="#",
    body={"solid_conductance": _lethe},
    beyond=(
        "For contacts pressed as hard as in this range. Lethe adds the gas in the gaps itself."
    ),
    units=SI,
)
