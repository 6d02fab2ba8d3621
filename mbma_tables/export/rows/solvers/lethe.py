"""Conductances for Lethe: the numbers of its formula, in `particle_heat_transfer.cc`."""

import math
import re

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.targets import SI, RowFormat
from mbma_tables.export.text import about, number, opening

# h = 1.25 k_s m/sigma (p/H)^0.96 (Yovanovich), of which Lethe has the mean over Hertz's
# pressure
YOVANOVICH = 1.25
EXPONENT = 0.96
# points of a formula that is read back
FITTED = 200


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


def _read(text: str) -> list[Curve]:
    """The formula for two faces in the stated range, of a conductivity of 1 W/(m K).

    Squares of roughness and slope add up, and the hardness is the harmonic mean.
    """
    pairs = re.findall(r"^ *set ([\w ]+) (?:particles|wall) = (\S+)$", text, re.M)
    faces: dict[str, list[float]] = {}
    for key, value in pairs:
        faces.setdefault(key, []).append(float(value))
    sigma = math.hypot(*faces["surface roughness"])
    slope = math.hypot(*faces["surface slope"])
    hardness = 2 / sum(1 / value for value in faces["microhardness"])
    words = " ".join(text.replace("\n#", " ").split())
    stated = re.search(r"\^0.96 is within (\S+) of .*? from p = (\S+) to (\S+) ", words)
    assert stated is not None
    misfit, low, high = map(float, stated.groups())
    pressure = np.geomspace(low, high, FITTED)
    conductance = YOVANOVICH * slope / sigma * (pressure / hardness) ** EXPONENT
    # the misfit has two digits
    return [Curve("solid_conductance", pressure, conductance, 1.05 * misfit)]


lethe = RowFormat(
    name="lethe",
    program="Lethe",
    output="surface slope, roughness and microhardness",
    outside="goes on by its formula",
    tested="Lethe's formula, written again from its source: within the stated misfit",
    read=_read,
    mark="#",
    body={"solid_conductance": _lethe},
    beyond=(
        "For contacts pressed as hard as in this range. Lethe adds the gas in the gaps itself."
    ),
    units=SI,
)
