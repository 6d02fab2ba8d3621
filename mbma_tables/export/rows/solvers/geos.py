"""Hydraulic apertures for GEOS: `TableFunction`, `HydraulicApertureTable` and `BartonBandis`."""

import math
import re

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.rows.formula_fit import nearest_formula
from mbma_tables.export.targets import SI, RowFormat
from mbma_tables.export.text import about, comment, number

# w = w0/(1 + 9 stress/reference)
BANDIS = 9.0
# slope of the last two rows for GEOS, which rejects 1 and more
STEEPEST = 0.999


def _geos(law: LawTable, name: str) -> str:
    """Hydraulic aperture against the jump u - h_max, and three tables against the normal stress.

    These are of the hydraulic aperture, the aperture, and the first one's derivative.
    """
    is_open = law.y > 0
    stress = law.columns["pressure"][0][is_open]
    aperture = law.columns["aperture"][0][is_open]
    derivative = law.columns["derivative"][0][is_open]
    stiffness = law.columns["stiffness"][0][is_open]
    hydraulic = law.y[is_open]
    jump, by_jump = _rising(law, aperture, hydraulic)
    tables = {
        "byJump": (jump, by_jump),
        "aperture": (stress, aperture),
        "hydraulicAperture": (stress, hydraulic),
        # by the stress: dw/du over the stiffness -dp/du
        "derivative": (stress[1:], -derivative[1:] / stiffness[1:]),
    }
    functions = ""
    for key, (x, values) in tables.items():
        functions += (
            f'    <TableFunction name="{name}_{key}" coordinates="{_listed(x)}"\n'
            f'      values="{_listed(values)}"/>\n'
        )
    reference_stress, reference_aperture, misfit = _barton_bandis(stress, hydraulic)
    note = (
        f"BartonBandis is fitted: ln(w/w of the table) is {about(misfit.std(), 2)} root mean "
        f"square, {about(np.abs(misfit).max(), 2)} at most. HydraulicApertureTable takes no "
        "stress; use one of both."
    )
    return (
        f"{comment([note], '<!--')}"
        "<Problem>\n"
        "  <Functions>\n"
        f"{functions}"
        "  </Functions>\n"
        "  <Constitutive>\n"
        f'    <HydraulicApertureTable name="{name}" '
        f'referenceAperture="{number(by_jump[-1])}" apertureTableName="{name}_byJump"/>\n'
        f'    <BartonBandis name="{name}_fitted" '
        f'referenceAperture="{number(reference_aperture)}" '
        f'referenceNormalStress="{number(reference_stress)}"/>\n'
        "  </Constitutive>\n"
        "</Problem>\n"
    )


def _rising(
    law: LawTable, aperture: FloatArray, hydraulic: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rows against the jump, which is 0 in the last one; a row more where they end too steeply."""
    jump = (aperture - aperture[0])[::-1] + 0.0
    by_jump = hydraulic[::-1]
    if by_jump[-1] - by_jump[-2] >= STEEPEST * (jump[-1] - jump[-2]):
        step = min(1e-3 * law.facts["h_rms"][0], -jump[-2] / 2)
        jump = np.insert(jump, -1, -step)
        by_jump = np.insert(by_jump, -1, by_jump[-1] - STEEPEST * step)
    return jump, by_jump


def _barton_bandis(
    stress: FloatArray, hydraulic: FloatArray
) -> tuple[float, float, FloatArray]:
    """Reference stress and aperture of the formula, and the differences of ln w from the rows'."""
    fitted = stress >= stress[1]

    def log_formula(reference: float) -> FloatArray:
        """Of a reference stress over the largest stress."""
        aperture = -np.log1p(BANDIS * stress[fitted] / (reference * stress[-1]))
        return np.asarray(aperture)

    reference, log_aperture, misfit = nearest_formula(
        log_formula, np.log(hydraulic[fitted])
    )
    return reference * stress[-1], math.exp(log_aperture), misfit


def _listed(values: FloatArray) -> str:
    return f"{{ {', '.join(map(number, values))} }}"


def _read(text: str) -> list[Curve]:
    """The tables of the aperture against the stress."""
    names = {"hydraulicAperture": "hydraulic_aperture", "aperture": "aperture"}
    curves = []
    for key, x, y in re.findall(
        r'name="\w+_(\w+)" coordinates="\{(.*)\}"\n +values="\{(.*)\}"', text
    ):
        if key in names:
            stress, values = np.array([x.split(","), y.split(",")], dtype=float)
            curves.append(Curve(names[key], stress, values))
    return curves


geos = RowFormat(
    name="geos",
    program="GEOS",
    output=(
        "`TableFunction`s of hydraulic aperture against jump and stress, its derivative, a "
        "fitted `BartonBandis`"
    ),
    outside="keeps the end values, but opens with the last slope",
    tested="GEOS's checks and interpolation, written again from its source",
    read=_read,
    mark="<!--",
    body={"hydraulic_aperture": _geos},
    beyond=(
        "The jump is u - h_max, zero at first contact; stress is positive in compression. "
        "GEOS keeps the end values outside the rows, and continues those of the jump beyond "
        "zero with the last slope, which has to be below 1."
    ),
    named="rough",
    units=SI,
)
