"""Tables and numbers for lubrication, fracture and heat codes; each target is a `Grammar` of rows.

Sources: MBDyn's `module-hydrodynamic_plain_bearing2.cc` (`GreenwoodTrippCM`, `LinFDMesh`, `LugreFriction`), its
input manual and the deck `mbdyn_post_ehd_load_output_13.tst` of mboct-mbdyn-pkg; GEOS's `TableFunction`,
`HydraulicApertureTable` and `BartonBandis`; MOOSE's `PiecewiseTabularBase`, `GapFluxModelConduction` and its base;
Lethe's manual (Lagrangian physical properties) and `particle_heat_transfer.cc`. GetDP 3.2 was run.
"""

import math
from collections.abc import Callable

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import AGAINST, SI, Grammar
from mbma_tables.export.text import comment, number, opening
from mbma_tables.materials import tangential_ratio

# p = 4.4086e-5 K E* (4 - (u - delta)/sigma)^6.804, K = 16 sqrt(2) pi/15 (eta beta sigma)^2 sqrt(sigma/beta)
GREENWOOD_TRIPP, POWER, END, OF_K = 4.4086e-5, 6.804, 4.0, 16 * math.sqrt(2) * math.pi / 15
CROWDING = 0.05  # eta beta sigma; the result depends on K only
HEAVY, FEWEST = 0.1, 3  # largest A/A0 of that fit, and its rows
NU = 0.3  # of the micro-slip stiffness
BANDIS = 9.0  # w = w0/(1 + 9 stress/reference)
OF_APERTURE = ("pressure", "aperture", "derivative", "stiffness")
STEEPEST = 0.999  # slope of the last two rows for GEOS, which rejects 1 and more
YOVANOVICH, EXPONENT = 1.25, 0.96  # h = 1.25 k_s m/sigma (p/H)^0.96, of which Lethe has the mean over Hertz's pressure
MBDYN = """\
# in the element "hydrodynamic plain bearing2", at their places:
#   mesh, linear finite difference,
#     flow factors, patir cheng, sigma, {0}_Rq, {0}_Rq, lambdax, {0}_lambdax, {0}_lambdax, lambdaz, 1., 1.,
#   contact model, greenwood tripp, E1, 2. * {0}_E, nu1, 0., E2, 2. * {0}_E, nu2, 0., unit system, consistent,
#     standard deviation, {0}_sigma, asperity density, {0}_eta, asperity curvature, {0}_beta,
#     asperity mean height, {0}_delta, linearize, {0}_H0,
#   friction model, lugre, method, implicit euler, coulomb friction coefficient, MU, micro slip stiffness, {0}_sigma0,
"""


def _nearest(shape: Callable[[float], FloatArray], log_y: FloatArray) -> tuple[float, float, FloatArray]:
    """t and f that minimise the mean square of shape(exp(t)) + f - log_y, and this difference."""
    from scipy.optimize import minimize_scalar

    t = math.exp(minimize_scalar(lambda t: np.var(shape(math.exp(t)) - log_y), bounds=(-9.0, 9.0), method="bounded").x)
    factor = float(np.mean(log_y - shape(t)))
    return t, factor, shape(t) + factor - log_y


def _mbdyn(law: LawTable, name: str) -> str:
    """Greenwood-Tripp numbers by the rows from the least pressure that counts to A/A0 = 0.1."""
    pressure, area, stiffness = (law.more[key][0] for key in ("pressure", "area", "stiffness"))
    sigma, E_star = law.facts["h_rms"][0], law.facts["E_star"][0]
    kept = (pressure >= law.floor) & (area <= HEAVY)
    if kept.sum() < FEWEST:
        raise InputError(
            f"the Greenwood-Tripp fit needs {FEWEST} rows at pressures with A/A0 <= {HEAVY:g}, got {kept.sum()}"
        )
    u, pressure, length = law.x[kept], pressure[kept], law.x_unit
    far = u / sigma
    last, factor, misfit = _nearest(lambda beyond: POWER * np.log(far[-1] + beyond - far), np.log(pressure))
    delta = far[-1] + last - END
    beta = sigma * (OF_K * CROWDING**2 * GREENWOOD_TRIPP * E_star / math.exp(factor)) ** 2
    numbers = {"sigma": sigma, "eta": CROWDING / (sigma * beta), "beta": beta, "delta": float(delta * sigma)}
    slip = stiffness[kept] / (pressure * tangential_ratio(NU))
    numbers |= {"H0": float(far[0] - delta), "E": E_star, "sigma0": math.exp(np.log(slip).mean())}
    numbers |= {"Rq": sigma / math.sqrt(2), "lambdax": law.facts["peklenik"][0]}
    said = (
        f"Greenwood-Tripp numbers fitted from p = {pressure[-1]:.4g} to {pressure[0]:.4g} {law.more['pressure'][1]}, u "
        f"= {u[-1]:.4g} to {u[0]:.4g} {length}: ln(p/p of the law) is {misfit.std():.2g} root mean square, "
        f"{np.abs(misfit).max():.2g} at most; below these gaps a tangent. MBDyn's h is u; eta beta sigma is "
        f"{CROWDING:g}, for K alone counts; its asperity curvature is a radius.",
        f"micro slip stiffness: tangential stiffness over p, from {slip.min():.4g} to {slip.max():.4g} per {length}, "
        f"of nu = {NU:g}; for another nu times {tangential_ratio(NU):.4g} (2 - 2 nu)/(2 - nu).",
        "Flow factors are those of Patir and Cheng in MBDyn, of two faces that share h_rms^2; x is around the bearing.",
    )
    sets = "".join(f"set: real {name}_{key} = {number(value)};\n" for key, value in numbers.items())
    return f"{opening(said, '#')}\n{sets}{MBDYN.format(name)}"


def _geos(law: LawTable, name: str) -> str:
    """Hydraulic aperture against the jump u - h_max; it, the aperture and its derivative against the normal stress."""
    open_ = law.y > 0
    stress, aperture, slope, stiffness = (law.columns[key][0][open_] for key in OF_APERTURE)
    jump, w = (aperture - aperture[0])[::-1] + 0.0, law.y[open_][::-1]
    if w[-1] - w[-2] >= STEEPEST * (jump[-1] - jump[-2]):
        step = min(1e-3 * law.facts["h_rms"][0], -jump[-2] / 2)
        jump, w = np.insert(jump, -1, -step), np.insert(w, -1, w[-1] - STEEPEST * step)
    kept = stress >= stress[1]
    t, factor, misfit = _nearest(
        lambda t: -np.log1p(BANDIS * stress[kept] / (t * stress[-1])), np.log(law.y[open_][kept])
    )
    tables = {"byJump": (jump, w), "aperture": (stress, aperture), "hydraulicAperture": (stress, law.y[open_])}
    tables["derivative"] = (stress[1:], -slope[1:] / stiffness[1:])
    functions = "".join(
        f'    <TableFunction name="{name}_{key}" coordinates="{{ {", ".join(map(number, x))} }}"\n'
        f'      values="{{ {", ".join(map(number, values))} }}"/>\n'
        for key, (x, values) in tables.items()
    )
    said = (
        f"BartonBandis is fitted: ln(w/w of the table) is {misfit.std():.2g} root mean square, "
        f"{np.abs(misfit).max():.2g} at most. HydraulicApertureTable takes no stress; use one of both."
    )
    bandis = f'referenceAperture="{number(math.exp(factor))}" referenceNormalStress="{number(t * stress[-1])}"'
    return comment([said], "<!--") + (
        f"<Problem>\n  <Functions>\n{functions}  </Functions>\n  <Constitutive>\n"
        f'    <HydraulicApertureTable name="{name}" referenceAperture="{number(w[-1])}" '
        f'apertureTableName="{name}_byJump"/>\n    <BartonBandis name="{name}_fitted" {bandis}/>\n'
        "  </Constitutive>\n</Problem>\n"
    )


def _moose(law: LawTable, name: str) -> str:
    x, *others = law.columns
    texts = {key: " ".join(map(number, values)) for key, (values, _) in law.columns.items()}
    blocks = (
        f"  [{name}_{key}]\n    type = PiecewiseLinear\n    x = '{texts[x]}'\n    y = '{texts[key]}'\n  []\n"
        for key in others
    )
    return f"[Functions]\n{''.join(blocks)}[]\n"


def _getdp(law: LawTable, name: str) -> str:
    x, *others = law.columns
    lines = [f"{name}_{key}() = {{{', '.join(map(number, values))}}};" for key, (values, _) in law.columns.items()]
    lines += [f"{name}_{key}[] = InterpolationLinear[$1]{{ListAlt[{name}_{x}(), {name}_{key}()]}};" for key in others]
    return "\n  ".join(["Function {", *lines]) + "\n}\n"


def _lethe(law: LawTable) -> str:
    """Numbers of two faces that are alike: Lethe adds squares of roughness and slope, and averages hardness."""
    kept = (law.x > 0) & (law.y >= law.floor)
    sigma, gradient, k_s = (law.facts[key][0] for key in ("h_rms", "rms_gradient", "conductivity"))
    slope = gradient / math.sqrt(math.pi)
    logs = np.log(law.x[kept]) - np.log(law.y[kept] * sigma / (YOVANOVICH * k_s * slope)) / EXPONENT
    middle, spread = (logs.max() + logs.min()) / 2, EXPONENT * (logs.max() - logs.min()) / 2
    said = (
        f"Lethe's conductance 1.25 k m/sigma (p/H)^0.96 is within {math.expm1(spread):.2g} of the law's from p = "
        f"{law.x[kept][0]:.4g} to {law.x[-1]:.4g} {law.x_unit} with this microhardness H, which is fitted to this "
        "surface slope m: both depend on the shortest wavelength of the surface. m is the mean of |dz/dx|.",
    )
    numbers = {"microhardness": math.exp(middle), "surface slope": slope / math.sqrt(2)}
    numbers |= {"surface roughness": sigma / math.sqrt(2)}
    particles, wall = (
        "".join(f"{indent}set {key} {of} = {number(value)}\n" for key, value in numbers.items())
        for of, indent in (("particles", "    "), ("wall", "  "))
    )
    return (
        f"{opening(said, '#')}\nsubsection lagrangian physical properties\n  subsection particle type 0\n"
        f"{particles}  end\n{wall}end\n"
    )


mbdyn = Grammar("MBDyn", "#", {"film": _mbdyn}, "Include this file above the element.", named="rough", units=SI)
geos = Grammar(
    "GEOS",
    "<!--",
    {"hydraulic_aperture": _geos},
    "The jump is u - h_max, zero at first contact; stress is positive in compression. GEOS keeps the end values "
    "outside the rows, and continues those of the jump beyond zero with the last slope, which has to be below 1.",
    named="rough",
    units=SI,
)
moose_function = Grammar(
    "MOOSE",
    "#",
    dict.fromkeys(AGAINST, _moose),
    "Constant outside the rows. Of a conductance: type = GapFluxModelConduction, gap_conductivity_function, with "
    "gap_conductivity_function_variable = the contact pressure, and gap_conductivity and min_gap the same length, "
    "above all closed gaps.",
    named="rough",
)
getdp = Grammar(
    "GetDP",
    "//",
    dict.fromkeys(AGAINST, _getdp),
    "GetDP 3.2 stops below the first row and continues the last chord beyond the last one.",
    named="rough",
)
lethe = Grammar("Lethe", "#", {"conductance": _lethe}, "For contacts pressed as hard as in this range.", units=SI)
_NAMED = {"mbdyn": mbdyn, "geos": geos, "moose-function": moose_function, "getdp": getdp, "lethe": lethe}
TARGETS = tuple(grammar.target(name) for name, grammar in _NAMED.items())
