"""Contact laws in the formats of other programs; each target is a `Grammar` of rows.

CalculiX 2.20 and GetDP 3.2 were run. The others follow manuals and sources: MBDyn's
`GreenwoodTrippCM`, `LinFDMesh` and `LugreFriction` of
`module-hydrodynamic_plain_bearing2.cc`; GEOS's `TableFunction`, `HydraulicApertureTable`
and `BartonBandis`; MOOSE's `PiecewiseTabularBase` and `GapFluxModelConduction`; Lethe's
`particle_heat_transfer.cc`.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import LawTable
from mbma_tables.export.targets import AGAINST, SI, Grammar
from mbma_tables.export.text import about, comment, number, opening
from mbma_tables.materials import tangential_ratio

# columns of a number: CalculiX reads no more of it, so that a longer one may lose its exponent
CARD_WIDTH = 20
LSDYNA_WIDTH, OPTISTRUCT_WIDTH = (
    20,
    16,
)  # columns of a field, of which OptiStruct's are its long ones
MIN_CALCULIX_STEP = 1e-10  # closer overclosures are moved apart by the reader
PAIR = "*CONTACT PAIR, INTERACTION={name}, TYPE="
CALCULIX_TABULAR = (
    f"Use this interaction with {PAIR}NODE TO SURFACE",
    "and no other type: with SURFACE TO SURFACE 2.20 reads TABULAR into arrays that are too short and has no force at "
    "up to 41 rows, without a message, and from 50 rows on it aborts (stack smashing detected); MORTAR reads 50 rows "
    "wrongly. Place the bodies so that their surfaces touch where the mean planes are h_max apart.",
)
CALCULIX_HEAT = (
    f"Use this interaction with {PAIR}SURFACE TO SURFACE",
    "and no other type: with NODE TO SURFACE 2.20 takes one conductance for all pressures, without a message. Use it "
    "in steps of *COUPLED TEMPERATURE-DISPLACEMENT: with UNCOUPLED an increment has the conductance of the pressure "
    "of the one before it, so that loads must be held for one more. Between the first two rows conductance is linear.",
    "2.20 takes no table of pressures beside one of conductances. The closure is exponential here, "
    "p = p0 exp(ln(100) c/c0) with c0 = {c0} {length}, over which the pressure falls to a hundredth, and "
    "p0 = {p0} {stress}, the pressure at c = 0: pressure at a given overclosure is within "
    "{by_p:.0%} of the law from p = {low} to {high} {stress}, overclosure at "
    "a given pressure within {by_c} {length}. Where forces are prescribed, this does not change the conductance.",
    "From an open gap press by displacements at first: by forces alone EXPONENTIAL does not converge. LINEAR does, "
    "with the line {slope} below *SURFACE BEHAVIOR, but its closure is the law's at the largest pressure alone.",
)


# p = 4.4086e-5 K E* (4 - (u - delta)/sigma)^6.804, K = 16 sqrt(2) pi/15 (eta beta sigma)^2
# sqrt(sigma/beta)
GREENWOOD_TRIPP, POWER, END, OF_K = (
    4.4086e-5,
    6.804,
    4.0,
    16 * math.sqrt(2) * math.pi / 15,
)
CROWDING = 0.05  # eta beta sigma; the result depends on K only
HEAVY, FEWEST = 0.1, 3  # largest A/A0 of that fit, and its rows
NU = 0.3  # of the micro-slip stiffness
BANDIS = 9.0  # w = w0/(1 + 9 stress/reference)
STEEPEST = 0.999  # slope of the last two rows for GEOS, which rejects 1 and more
YOVANOVICH, EXPONENT = (
    1.25,
    0.96,
)  # h = 1.25 k_s m/sigma (p/H)^0.96, of which Lethe has the mean over Hertz's pressure
MBDYN = """\
# in the element "hydrodynamic plain bearing2", at their places:
#   mesh, linear finite difference,
#     flow factors, patir cheng, sigma, {0}_Rq, {0}_Rq, lambdax, {0}_lambdax, {0}_lambdax, lambdaz, 1., 1.,
#   contact model, greenwood tripp, E1, 2. * {0}_E, nu1, 0., E2, 2. * {0}_E, nu2, 0., unit system, consistent,
#     standard deviation, {0}_sigma, asperity density, {0}_eta, asperity curvature, {0}_beta,
#     asperity mean height, {0}_delta, linearize, {0}_H0,
#   friction model, lugre, method, implicit euler, coulomb friction coefficient, MU, micro slip stiffness, {0}_sigma0,
"""


def _notes(lines: tuple[str, ...], **said: Any) -> str:
    return opening((line.format_map(said) for line in lines), "**") + "\n"


def _interaction(name: str, *cards: str) -> str:
    return f"*SURFACE INTERACTION, NAME={name}\n{''.join(cards)}"


def _card(head: str, law: LawTable) -> str:
    """A card with the columns swapped: pressure, overclosure, or conductance, pressure."""
    rows = zip(law.x, law.y, strict=True)
    return f"{head}\n" + "".join(f"{_field(y)}, {_field(x)}\n" for x, y in rows)


def _field(value: float) -> str:
    """A number of a card of CalculiX or Abaqus."""
    return number(value, width=CARD_WIDTH)


def _friction(law: LawTable) -> tuple[float, float, float]:
    """Coefficient, stick slope, and the displacement at which slip begins."""
    friction, slope, pressure = (
        law.facts[name][0] for name in ("friction", "stick", "stick_pressure")
    )
    return friction, slope, friction * pressure / slope


def _stick(law: LawTable) -> str:
    if "friction" not in law.facts:
        return ""
    friction, slope, _ = _friction(law)
    return f"*FRICTION\n{_field(friction)}, {_field(slope)}\n"


def _calculix(law: LawTable, name: str) -> str:
    if (np.diff(law.x) <= MIN_CALCULIX_STEP).any():
        raise InputError(
            f"rows are closer than {MIN_CALCULIX_STEP:g} {law.x_unit}, which CalculiX cannot tell apart: take fewer "
            "rows or a smaller unit of length"
        )
    behaviour = _card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law)
    return _notes(CALCULIX_TABULAR, name=name) + _interaction(
        name, behaviour, _stick(law)
    )


def _calculix_heat(law: LawTable, name: str) -> str:
    """Conductance beside the exponential closure that is nearest to the law, the only pair of the two in 2.20."""
    rows = law.behaviour
    assert rows is not None
    c = np.linspace(
        np.interp(max(rows.floor, law.x[1]), rows.y, rows.x), rows.x[-1], 1001
    )
    p = np.interp(c, rows.x, rows.y)
    # for concave ln p, the chord has the slope of the line with the least largest distance
    u0 = (c[-1] - c[0]) / math.log(p[-1] / p[0])
    off = np.log(p) - c / u0
    middle, spread = (off.max() + off.min()) / 2, (off.max() - off.min()) / 2
    # p = p0 exp(c/u0): CalculiX takes the distance c0 over which the pressure falls to a hundredth
    c0, p0 = u0 * math.log(100), math.exp(middle)
    words = {
        "name": name,
        "c0": _field(c0),
        "p0": _field(p0),
        "low": about(p[0]),
        "high": about(p[-1]),
        "by_p": math.expm1(spread),
        "by_c": about(spread * u0, 2),
        "slope": _field(p[-1] / c[-1]),
        "stress": rows.y_unit,
        "length": rows.x_unit,
    }
    closure = f"*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n{_field(c0)}, {_field(p0)}\n"
    cards = closure, _stick(law), _card("*GAP CONDUCTANCE", law)
    return _notes(CALCULIX_HEAT, **words) + _interaction(name, *cards)


def _abaqus(law: LawTable, name: str) -> str:
    cards = [
        _card("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR", law.behaviour or law)
    ]
    if "friction" in law.facts:
        friction, _, slip = _friction(law)
        cards.append(f"*FRICTION, ELASTIC SLIP={_field(slip)}\n{_field(friction)}\n")
    if law.behaviour is not None:
        cards.append(_card("*GAP CONDUCTANCE, PRESSURE", law))
    return _interaction(name, *cards)


def _lsdyna(law: LawTable, curve: int = 1) -> str:
    """A curve, for inclusion: without *END, which would end the including deck."""
    head = f"*DEFINE_CURVE\n{curve:10d}{0:10d}{1.0:10.1f}{1.0:10.1f}{0.0:10.1f}{0.0:10.1f}{0:10d}\n"
    rows = (
        "".join(number(value, width=LSDYNA_WIDTH).rjust(LSDYNA_WIDTH) for value in row)
        for row in zip(law.x, law.y, strict=True)
    )
    return head + "".join(f"{row}\n" for row in rows)


def _lsdyna_curves(laws: Sequence[LawTable]) -> str:
    titles = [
        f"$ curve {curve}: {law.y_name} against {law.x_name}\n"
        for curve, law in enumerate(laws, 1)
    ]
    return "".join(titles) + "".join(
        _lsdyna(law, curve) for curve, law in enumerate(laws, 1)
    )


def _optistruct(law: LawTable) -> str:
    """PCONT 1 and TABLES1 2, in long fields of 16 columns."""
    values = np.column_stack([law.x, law.y]).ravel()
    pairs = [
        number(value, width=OPTISTRUCT_WIDTH).ljust(OPTISTRUCT_WIDTH) for value in values
    ]
    # the keyword stands where a line begins: on the first one that field is the friction
    # coefficient
    lines = [
        "PCONT,1",
        "+,STFTAB,2",
        f"{'TABLES1*':<8}{2:<16d}{'':<16}{'':<16}{'':<16}*",
        f"{'*':<8}",
    ]
    fields = [*pairs, f"{'ENDT':<16}"]
    lines += [
        f"{'*':<8}{''.join(fields[start : start + 4])}".rstrip()
        for start in range(0, len(fields), 4)
    ]
    return "\n".join(lines) + "\n"


def _columns(law: LawTable) -> str:
    rows = zip(*(values for values, _ in law.columns.values()), strict=True)
    return "".join(" ".join(map(number, row)) + "\n" for row in rows)


def _matrix(law: LawTable, name: str) -> str:
    return f"double {name}({law.x.size},{len(law.columns)})\n{_columns(law)}"


def _nearest(
    shape: Callable[[float], FloatArray], log_y: FloatArray
) -> tuple[float, float, FloatArray]:
    """t and f that minimise the mean square of shape(exp(t)) + f - log_y, and this difference."""
    from scipy.optimize import minimize_scalar

    t = math.exp(
        minimize_scalar(
            lambda t: np.var(shape(math.exp(t)) - log_y),
            bounds=(-9.0, 9.0),
            method="bounded",
        ).x
    )
    factor = float(np.mean(log_y - shape(t)))
    return t, factor, shape(t) + factor - log_y


def _mbdyn(law: LawTable, name: str) -> str:
    """Greenwood-Tripp numbers by the rows from the least pressure that counts to A/A0 = 0.1."""
    pressure, area, stiffness = (
        law.more[key][0] for key in ("pressure", "area", "stiffness")
    )
    sigma, E_star = law.facts["h_rms"][0], law.facts["E_star"][0]
    kept = (pressure >= law.floor) & (area <= HEAVY)
    if kept.sum() < FEWEST:
        raise InputError(
            f"the Greenwood-Tripp fit needs {FEWEST} rows at pressures with A/A0 <= {HEAVY:g}, got {kept.sum()}"
        )
    u, pressure, length = law.x[kept], pressure[kept], law.x_unit
    far = u / sigma
    last, factor, misfit = _nearest(
        lambda beyond: POWER * np.log(far[-1] + beyond - far), np.log(pressure)
    )
    delta = far[-1] + last - END
    beta = sigma * (OF_K * CROWDING**2 * GREENWOOD_TRIPP * E_star / math.exp(factor)) ** 2
    numbers = {
        "sigma": sigma,
        "eta": CROWDING / (sigma * beta),
        "beta": beta,
        "delta": float(delta * sigma),
    }
    slip = stiffness[kept] / (pressure * tangential_ratio(NU))
    numbers |= {
        "H0": float(far[0] - delta),
        "E": E_star,
        "sigma0": math.exp(np.log(slip).mean()),
    }
    numbers |= {"Rq": sigma / math.sqrt(2), "lambdax": law.facts["peklenik"][0]}
    said = (
        f"Greenwood-Tripp numbers fitted from p = {about(pressure[-1])} to {about(pressure[0])} "
        f"{law.more['pressure'][1]}, u = {about(u[-1])} to {about(u[0])} {length}: ln(p/p of the law) is "
        f"{about(misfit.std(), 2)} root mean square, {about(np.abs(misfit).max(), 2)} at most; below these gaps a "
        f"tangent. MBDyn's h is u; eta beta sigma is {CROWDING:g}, for K alone counts; its asperity curvature is a "
        "radius.",
        f"micro slip stiffness: tangential stiffness over p, from {about(slip.min())} to {about(slip.max())} per "
        f"{length}, of nu = {NU:g}; for another nu times {about(tangential_ratio(NU))} (2 - 2 nu)/(2 - nu).",
        "Flow factors are those of Patir and Cheng in MBDyn, of two faces that share h_rms^2; x is around the bearing.",
    )
    sets = "".join(
        f"set: real {name}_{key} = {number(value)};\n" for key, value in numbers.items()
    )
    return f"{opening(said, '#')}\n{sets}{MBDYN.format(name)}"


def _geos(law: LawTable, name: str) -> str:
    """Hydraulic aperture against the jump u - h_max; it, the aperture and its derivative against the normal stress."""
    open_ = law.y > 0
    stress, aperture, slope, stiffness = (
        law.columns[key][0][open_]
        for key in ("pressure", "aperture", "derivative", "stiffness")
    )
    jump, w = (aperture - aperture[0])[::-1] + 0.0, law.y[open_][::-1]
    if w[-1] - w[-2] >= STEEPEST * (jump[-1] - jump[-2]):
        step = min(1e-3 * law.facts["h_rms"][0], -jump[-2] / 2)
        jump, w = np.insert(jump, -1, -step), np.insert(w, -1, w[-1] - STEEPEST * step)
    kept = stress >= stress[1]
    t, factor, misfit = _nearest(
        lambda t: -np.log1p(BANDIS * stress[kept] / (t * stress[-1])),
        np.log(law.y[open_][kept]),
    )
    tables = {
        "byJump": (jump, w),
        "aperture": (stress, aperture),
        "hydraulicAperture": (stress, law.y[open_]),
    }
    tables["derivative"] = (stress[1:], -slope[1:] / stiffness[1:])
    functions = "".join(
        f'    <TableFunction name="{name}_{key}" coordinates="{{ {", ".join(map(number, x))} }}"\n'
        f'      values="{{ {", ".join(map(number, values))} }}"/>\n'
        for key, (x, values) in tables.items()
    )
    said = (
        f"BartonBandis is fitted: ln(w/w of the table) is {about(misfit.std(), 2)} root mean square, "
        f"{about(np.abs(misfit).max(), 2)} at most. HydraulicApertureTable takes no stress; use one of both."
    )
    bandis = f'referenceAperture="{number(math.exp(factor))}" referenceNormalStress="{number(t * stress[-1])}"'
    return comment([said], "<!--") + (
        f"<Problem>\n  <Functions>\n{functions}  </Functions>\n  <Constitutive>\n"
        f'    <HydraulicApertureTable name="{name}" referenceAperture="{number(w[-1])}" '
        f'apertureTableName="{name}_byJump"/>\n    <BartonBandis name="{name}_fitted" {bandis}/>\n'
        "  </Constitutive>\n</Problem>\n"
    )


def _moose(law: LawTable, name: str) -> str:
    return f"[Functions]\n{_moose_blocks(law, name)}[]\n"


def _moose_several(laws: Sequence[LawTable], name: str) -> str:
    return f"[Functions]\n{''.join(_moose_blocks(law, name) for law in laws)}[]\n"


def _moose_blocks(law: LawTable, name: str) -> str:
    x, *others = law.columns
    texts = {
        key: " ".join(map(number, values)) for key, (values, _) in law.columns.items()
    }
    return "".join(
        f"  [{name}_{key}]\n    type = PiecewiseLinear\n    x = '{texts[x]}'\n    y = '{texts[key]}'\n  []\n"
        for key in others
    )


def _getdp(law: LawTable, name: str) -> str:
    return "\n  ".join(["Function {", *_getdp_lines(law, name, name)]) + "\n}\n"


def _getdp_several(laws: Sequence[LawTable], name: str) -> str:
    lines = []
    for law in laws:
        # each law has its own abscissas
        lines += _getdp_lines(law, name, f"{name}_rows_{law.y_name}")
    return "\n  ".join(["Function {", *lines]) + "\n}\n"


def _getdp_lines(law: LawTable, name: str, rows: str) -> list[str]:
    """Lists of columns, whose names begin with `rows`, and functions, whose names begin with `name`."""
    x, *others = law.columns
    lines = [
        f"{rows}_{key}() = {{{', '.join(map(number, values))}}};"
        for key, (values, _) in law.columns.items()
    ]
    lines += [
        f"{name}_{key}[] = InterpolationLinear[$1]{{ListAlt[{rows}_{x}(), {rows}_{key}()]}};"
        for key in others
    ]
    return lines


def _lethe(law: LawTable) -> str:
    """Numbers of two faces that are alike: Lethe adds squares of roughness and slope, and averages hardness."""
    kept = (law.x > 0) & (law.y >= law.floor)
    sigma, gradient, k_s = (
        law.facts[key][0] for key in ("h_rms", "rms_gradient", "conductivity")
    )
    slope = gradient / math.sqrt(math.pi)
    logs = (
        np.log(law.x[kept])
        - np.log(law.y[kept] * sigma / (YOVANOVICH * k_s * slope)) / EXPONENT
    )
    middle, spread = (
        (logs.max() + logs.min()) / 2,
        EXPONENT * (logs.max() - logs.min()) / 2,
    )
    said = (
        f"Lethe's conductance 1.25 k m/sigma (p/H)^0.96 is within {about(math.expm1(spread), 2)} of the law's from "
        f"p = {about(law.x[kept][0])} to {about(law.x[-1])} {law.x_unit} with this microhardness H, which is fitted "
        "to this surface slope m: both depend on the shortest wavelength of the surface. m is the mean of |dz/dx|.",
    )
    numbers = {"microhardness": math.exp(middle), "surface slope": slope / math.sqrt(2)}
    numbers |= {"surface roughness": sigma / math.sqrt(2)}
    particles, wall = (
        "".join(
            f"{indent}set {key} {of} = {number(value)}\n"
            for key, value in numbers.items()
        )
        for of, indent in (("particles", "    "), ("wall", "  "))
    )
    return (
        f"{opening(said, '#')}\nsubsection lagrangian physical properties\n  subsection particle type 0\n"
        f"{particles}  end\n{wall}end\n"
    )


calculix = Grammar(
    "CalculiX",
    "**",
    {"pressure": _calculix, "conductance": _calculix_heat},
    "CalculiX keeps the value of the last row beyond it.",
    # of more conductances, 2.20 keeps the last twenty, without a message
    {"pressure": 200, "conductance": 20},
    "ROUGH",
    friction="Its stick slope is that of one pressure.",
)
abaqus = Grammar(
    "Abaqus",
    "**",
    {"pressure": _abaqus, "conductance": _abaqus},
    "Abaqus continues the last slope beyond the last row: stay within the range.",
    named="ROUGH",
    closure=True,
    friction="Its stiffness before slip is proportional to pressure, the coefficient times that over the elastic slip.",
)
STAY = "Stay within the rows: the solver's behaviour beyond them was not tested."
LSDYNA_TAKES = ("pressure", "conductance", "tangential_stiffness", "leakage")
lsdyna = Grammar(
    "LS-DYNA", "$", dict.fromkeys(LSDYNA_TAKES, _lsdyna), STAY, several=_lsdyna_curves
)
optistruct = Grammar("OptiStruct", "$", {"pressure": _optistruct}, STAY)
comsol = Grammar(
    "COMSOL",
    "%",
    dict.fromkeys(AGAINST, _columns),
    "Data format: Spreadsheet; functions by position in file. Interpolation: linear; extrapolation: none.",
)
moose = Grammar(
    "MOOSE",
    "#",
    dict.fromkeys(AGAINST, _columns),
    "[Functions/law] type = PiecewiseLinear, data_file = THIS, format = columns; constant outside the rows. Of more "
    "than two columns: xy_in_file_only = false, y_index_in_file = 1, 2, ...",
)
# of Modelica's CombiTable1Ds
modelica = Grammar(
    "Modelica",
    "#",
    dict.fromkeys(AGAINST, _matrix),
    "smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments; no extrapolation",
    named="law",
    first="#1\n",
)
mbdyn = Grammar(
    "MBDyn",
    "#",
    {"film": _mbdyn},
    "Include this file above the element.",
    named="rough",
    units=SI,
)
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
    several=_moose_several,
)
getdp = Grammar(
    "GetDP",
    "//",
    dict.fromkeys(AGAINST, _getdp),
    "GetDP 3.2 stops below the first row and continues the last chord beyond the last one.",
    named="rough",
    several=_getdp_several,
)
lethe = Grammar(
    "Lethe",
    "#",
    {"conductance": _lethe},
    "For contacts pressed as hard as in this range. Lethe adds the gas in the gaps itself.",
    units=SI,
    conducts_gas=False,
)
SOLVERS = (
    calculix,
    abaqus,
    lsdyna,
    optistruct,
    comsol,
    moose,
    modelica,
    mbdyn,
    geos,
    moose_function,
    getdp,
    lethe,
)
TARGETS = tuple(
    grammar.target(
        "moose-function"
        if grammar is moose_function
        else grammar.program.lower().replace("-", "")
    )
    for grammar in SOLVERS
)
