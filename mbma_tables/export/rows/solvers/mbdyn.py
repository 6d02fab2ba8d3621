"""Films for MBDyn, by `GreenwoodTrippCM`, `LinFDMesh` and `LugreFriction`.

These are in its `module-hydrodynamic_plain_bearing2.cc`.
"""

import math
import re

import numpy as np

from mbma_tables.bodies.materials import tangential_ratio
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.rows.formula_fit import nearest_formula
from mbma_tables.export.targets import SI, RowFormat
from mbma_tables.export.text import about, number, opening

# p = 4.4086e-5 K E* (4 - (u - delta)/sigma)^6.804,
# K = 16 sqrt(2) pi/15 (eta beta sigma)^2 sqrt(sigma/beta)
GREENWOOD_TRIPP = 4.4086e-5
POWER = 6.804
END = 4.0
OF_K = 16 * math.sqrt(2) * math.pi / 15
# eta beta sigma; the result depends on K only
CROWDING = 0.05
# largest A/A0 of that fit, and its fewest rows
HEAVY = 0.1
# points of a formula that is read back
FITTED = 200
FEWEST = 3
# Poisson's ratio of the micro-slip stiffness
NU = 0.3
KEYWORDS = """\
# in the element "hydrodynamic plain bearing2", at their places:
#   mesh, linear finite difference,
#     flow factors, patir cheng, sigma, {0}_Rq, {0}_Rq, lambdax, {0}_lambdax, {0}_lambdax, \
lambdaz, 1., 1.,
#   contact model, greenwood tripp, E1, 2. * {0}_E, nu1, 0., E2, 2. * {0}_E, nu2, 0., \
unit system, consistent,
#     standard deviation, {0}_sigma, asperity density, {0}_eta, asperity curvature, {0}_beta,
#     asperity mean height, {0}_delta, linearize, {0}_H0,
#   friction model, lugre, method, implicit euler, coulomb friction coefficient, MU, \
micro slip stiffness, {0}_sigma0,
"""


def _mbdyn(law: LawTable, name: str) -> str:
    """Greenwood-Tripp numbers by the rows from the least pressure that counts to A/A0 = 0.1."""
    pressure, stress = law.more["pressure"]
    area, _ = law.more["area"]
    stiffness, _ = law.more["stiffness"]
    fitted = (pressure >= law.floor) & (area <= HEAVY)
    if fitted.sum() < FEWEST:
        raise InputError(
            f"the Greenwood-Tripp fit needs {FEWEST} rows at pressures with A/A0 <= "
            f"{HEAVY:g}, got {fitted.sum()}"
        )
    u = law.x[fitted]
    pressure = pressure[fitted]
    numbers, misfit = _greenwood_tripp(law, u, pressure)
    # of the two faces, which share h_rms^2
    sigma = numbers["sigma"]
    slip = stiffness[fitted] / (pressure * tangential_ratio(NU))
    numbers["sigma0"] = math.exp(np.log(slip).mean())
    numbers["Rq"] = sigma / math.sqrt(2)
    numbers["lambdax"], _ = law.facts["peklenik"]
    length = law.x_unit
    notes = (
        f"Greenwood-Tripp numbers fitted from p = {about(pressure[-1])} to "
        f"{about(pressure[0])} {stress}, u = {about(u[-1])} to {about(u[0])} {length}: "
        f"ln(p/p of the law) is {about(misfit.std(), 2)} root mean square, "
        f"{about(np.abs(misfit).max(), 2)} at most; below these gaps a tangent. MBDyn's h is "
        f"u; eta beta sigma is {CROWDING:g}, for K alone counts; its asperity curvature is a "
        "radius.",
        "micro slip stiffness: tangential stiffness over p, from "
        f"{about(slip.min())} to {about(slip.max())} per {length}, of nu = {NU:g}; for "
        f"another nu times {about(tangential_ratio(NU))} (2 - 2 nu)/(2 - nu).",
        "Flow factors are those of Patir and Cheng in MBDyn, of two faces that share "
        "h_rms^2; x is around the bearing.",
    )
    settings = ""
    for key, value in numbers.items():
        settings += f"set: real {name}_{key} = {number(value)};\n"
    return f"{opening(notes, '#')}\n{settings}{KEYWORDS.format(name)}"


def _greenwood_tripp(
    law: LawTable, u: FloatArray, pressure: FloatArray
) -> tuple[dict[str, float], FloatArray]:
    """Numbers of the formula, and the differences of ln p from the law's."""
    sigma, _ = law.facts["h_rms"]
    E_star, _ = law.facts["E_star"]
    far = u / sigma

    def log_formula(beyond: float) -> FloatArray:
        """Of a formula that ends at this distance beyond the largest gap."""
        return np.asarray(POWER * np.log(far[-1] + beyond - far))

    beyond, log_factor, misfit = nearest_formula(log_formula, np.log(pressure))
    delta = far[-1] + beyond - END
    strength = OF_K * CROWDING**2 * GREENWOOD_TRIPP * E_star
    beta = sigma * (strength / math.exp(log_factor)) ** 2
    numbers = {
        "sigma": sigma,
        "eta": CROWDING / (sigma * beta),
        "beta": beta,
        "delta": float(delta * sigma),
        "H0": float(far[0] - delta),
        "E": E_star,
    }
    return numbers, misfit


def _read(text: str) -> list[Curve]:
    """The pressure of Greenwood and Tripp's formula in the stated range of gaps."""
    numbers = {}
    for key, value in re.findall(r"^set: real \w+_(\w+) = (\S+);$", text, re.M):
        numbers[key] = float(value)
    words = " ".join(text.replace("\n#", " ").split())
    stated = re.search(
        r"fitted from p = .*?, u = (\S+) to (\S+) \w+: .*? root mean square, (\S+) at most",
        words,
    )
    assert stated is not None
    low, high, misfit = map(float, stated.groups())
    u = np.linspace(low, high, FITTED)
    sigma = numbers["sigma"]
    beta = numbers["beta"]
    crowding = numbers["eta"] * beta * sigma
    modulus = OF_K * crowding**2 * math.sqrt(sigma / beta) * numbers["E"]
    distance = END - (u - numbers["delta"]) / sigma
    pressure = GREENWOOD_TRIPP * modulus * np.maximum(distance, 0.0) ** POWER
    # the misfit is one of the logarithm, and has two digits
    return [Curve("pressure", u, pressure, math.expm1(1.05 * misfit))]


mbdyn = RowFormat(
    name="mbdyn",
    program="MBDyn",
    output=(
        "a [film](leakage.md#tables-for-other-codes) as parameters: Greenwood-Tripp "
        "numbers, flow factors, micro-slip stiffness, with the keywords of the element"
    ),
    outside="goes on by its formula",
    tested="MBDyn's formulas, written again from its source: within the stated misfit",
    read=_read,
    mark="#",
    body={"film": _mbdyn},
    beyond="Include this file above the element.",
    named="rough",
    units=SI,
)
