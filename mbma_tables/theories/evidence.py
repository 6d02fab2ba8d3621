"""The shipped file of laws calibrated on simulations: reader, splines over surfaces, and deviations of theories."""

import dataclasses
import pathlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import TableFileError
from mbma_tables.common.files import shipped_file
from mbma_tables.common.netcdf import HDF5_LOCK, read_sealed
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.core import core

NAME = "calibrated.nc"
QUANTITIES = ("area", "pressure", "stiffness")
COMPARED = (
    5e-4,
    0.98,
)  # A/A0 of the lightest and the heaviest contacts whose errors were averaged
# most surfaces, and least entries per surface, for which polynomials are made
FEW = 64
MIN_SHARED = 40

Owners = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class SurfaceSpline:
    """Quintic B-splines over Hurst exponent, ln zeta_1 and a last axis, for the compiled core."""

    first: FloatArray  # of the equally spaced nodes along the axes,
    step: FloatArray  # and their distance, shape (3,)
    covered: FloatArray  # first and last that are answered, shape (3, 2) or (2, 2)
    coefficients: FloatArray  # float32
    law_constants: tuple[
        float, float, float
    ]  # constants of the law other than the spline, for the core

    @shared_property
    def cells(self) -> Any:
        """Their number along each axis."""
        return np.array(self.coefficients.shape, np.int64) - 5

    @property
    def last(self) -> float:
        """End of the last axis."""
        return float(self.first[2] + self.cells[2] * self.step[2])

    @shared_property
    def core_table(self) -> tuple[Any, FloatArray, Any]:
        """Coefficients, numbers and cells in the core's format."""
        numbers = [
            *self.first,
            *(1 / self.step),
            *self.covered[:2].ravel(),
            *self.law_constants,
        ]
        return np.pad(self.coefficients.ravel(), (0, 2)), np.array(numbers), self.cells

    def covers(self, hurst: FloatArray, log_zeta_1: FloatArray) -> Any:
        """Mask of surfaces inside the table."""
        (low, high), (start, stop) = self.covered[:2]
        return (
            (low <= hurst)
            & (hurst <= high)
            & (start <= log_zeta_1)
            & (log_zeta_1 <= stop)
        )

    def shared(self, surfaces: FloatArray, entries: int) -> FloatArray | None:
        """Polynomials of surfaces whose first rows are H and ln zeta_1, where these are worth making."""
        count = surfaces.shape[1]
        if count > FEW or entries < MIN_SHARED * count:
            return None
        pieces = np.empty((count, int(self.cells[2]), 6))
        core.spline_pieces(
            *self.core_table, surfaces[0], surfaces[1], None, None, None, pieces
        )
        return pieces


def known_at(places: FloatArray, row: FloatArray, x: FloatArray) -> FloatArray:
    """Numbers at some places, NaN where not known, interpolated; NaN above the last one that is known."""
    known = np.isfinite(row)
    return np.interp(x, places[known], row[known], right=None if known[-1] else np.nan)


def nodes_of(axes: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """First node and step of axes."""
    return np.array([axis[0] for axis in axes]), np.array(
        [(axis[-1] - axis[0]) / (axis.size - 1) for axis in axes]
    )


# variables, attributes, and what the axes cover, of a file or of a group of it
Part = tuple[dict[str, FloatArray], dict[str, Any], dict[str, Any]]


def read_parts(path: pathlib.Path) -> dict[str, Part]:
    """A file of the calibrated law, by "", and its groups by name, in one opening."""
    import netCDF4

    body = read_sealed(path)
    with HDF5_LOCK, netCDF4.Dataset(path.name, memory=body) as data:
        if getattr(data, "mbma_kind", None) != "calibrated":
            raise TableFileError(f"{path}: is no table of the calibrated law")
        data.set_auto_mask(False)
        return {name: _part(part) for name, part in {"": data, **data.groups}.items()}


def _part(part: Any) -> Part:
    """Variables, attributes and covered intervals of an open file or group."""
    covered = {
        name: x.getncattr("covered")
        for name, x in part.variables.items()
        if "covered" in x.ncattrs()
    }
    values = {name: np.array(x[...]) for name, x in part.variables.items()}
    return values, part.__dict__, covered


@shared()
def shipped_parts() -> dict[str, Part]:
    """The shipped file, read once: by its law and by whatever states a scatter."""
    return read_parts(shipped_file(NAME))


def shipped_part(group: str) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Variables and attributes of a group of the shipped file."""
    return shipped_parts()[group][:2]


def shipped_checksum() -> str:
    """The first digits of the SHA-256 in the last line of the shipped file."""
    return shipped_file(NAME).read_bytes()[-65:-49].decode()


@dataclasses.dataclass(frozen=True, eq=False)
class Deviations:
    """Distances of theories from simulations, as measured on surfaces that no fit saw."""

    log_area: FloatArray  # ln of contact fractions
    log_rms: dict[
        str, FloatArray
    ]  # by theory: ln of rms of ln(theory/simulation), rows `QUANTITIES`, by `log_area`

    def standard_deviation(
        self, theory: str, quantity: str, area: FloatArray
    ) -> FloatArray:
        """Root mean square of ln(theory/simulation) at contact fractions; NaN where not known."""
        if theory not in self.log_rms:
            return np.full(np.shape(area), np.nan)
        row = self.log_rms[theory][QUANTITIES.index(quantity)]
        with np.errstate(divide="ignore"):
            scatter = np.exp(known_at(self.log_area, row, np.log(area)))
        lightest, heaviest = COMPARED
        compared = (np.asarray(area) >= lightest) & (np.asarray(area) <= heaviest)
        return np.where(compared, scatter, np.nan)


@shared()
def shipped_deviations() -> Deviations:
    """Those in the shipped file, read once."""
    values, facts = shipped_part("")
    log_rms = dict(
        zip(facts["theories"].split(), np.log(values["stated_scatter"]), strict=True)
    )
    return Deviations(np.log(values["contact"]), log_rms)
