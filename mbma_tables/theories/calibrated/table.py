"""The calibrated law's table: ln F_G over Hurst exponent, zeta_1 and separation, with its certified error."""

import dataclasses
import functools
import pathlib
from collections.abc import Callable

import numpy as np

from mbma_tables.common.arguments import FloatArray, filled
from mbma_tables.common.shared import shared
from mbma_tables.core import core
from mbma_tables.theories.calibrated.formulas import CalibratedConstants
from mbma_tables.theories.evidence import (
    Part,
    SurfaceSpline,
    nodes_of,
    read_parts,
    shipped_parts,
)

AXES = ("hurst", "log_zeta_1", "log_separation")


@dataclasses.dataclass(frozen=True, eq=False)
class CalibratedTable(SurfaceSpline):
    """The shipped table: ln of the force on a surface without end; the core applies the end at h_max and the area."""

    constants: CalibratedConstants  # of the law
    # largest relative error of force against the law's own quadrature, at held-out points
    error: float

    def prepared(
        self, surfaces: FloatArray, entries: int
    ) -> list[Callable[..., FloatArray]]:
        """Force, area, -dF/du by (owners, u/h_rms), and u/h_rms by (owners, force > 0), NaN beyond the table."""
        ends = np.empty((surfaces.shape[1], 2))
        core.calibrated_ends(*self.core_table, *surfaces, None, None, ends)
        given = *self.core_table, *surfaces, ends, self.shared(surfaces, entries)
        loops = (core.calibrated_contact, 3), (core.calibrated_separation, 1)
        return [
            functools.partial(filled, functools.partial(loop, *given), outputs=rows)
            for loop, rows in loops
        ]


def load(path: pathlib.Path) -> CalibratedTable:
    """Read a table file; one that is damaged, or is another file, is a TableFileError."""
    return _table_of(read_parts(path)[""])


def _table_of(part: Part) -> CalibratedTable:
    """The table of a file's variables and attributes."""
    values, facts, covered = part
    constants = CalibratedConstants(
        *(
            float(facts[f"law_{field.name}"])
            for field in dataclasses.fields(CalibratedConstants)
        )
    )
    return CalibratedTable(
        *nodes_of([values[name] for name in AXES]),
        np.array([covered[name] for name in AXES]),
        values["spline"],
        (constants.area_s0, constants.area_slope, constants.area_t0),
        constants,
        float(facts["largest_error_force"]),
    )


@shared()
def shipped() -> CalibratedTable:
    """The shipped table, read once."""
    return _table_of(shipped_parts()[""])
