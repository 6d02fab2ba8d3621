"""Conformance points beside exported code, which its self-test replays.

A row of the points' file contains: kind, tolerance, number of arguments, the arguments, and
each result with the scale of its difference. Lines that begin with # describe the kinds.
"""

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.contact import contact
from mbma_tables.export.text import comment, number
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.surface import Surface
from mbma_tables.tables.open import universal_model
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories.mbma.closed_forms import FormulaModel
from mbma_tables.theories.mbma.sums import Sums, by_table
from mbma_tables.theories.mbma.theory import Mbma

Rows = Iterator[str]
FORM = "standard"  # the form of island model "formula"
POINTS_FILE = "mbma_conformance.csv"
KINDS = {
    "phi": "X, mu; phi_F, phi_A, the bound on their error",
    "geometry": f"approach, hurst, zeta_1; {', '.join(FIELDS)}",
    "total": "hurst, q0, q1, h_rms, h_max, separation, E_star, rtol; force, area, stiffness, error",
    "status": "X, mu; the status",
    "formula": "X, mu; phi_F, phi_A by the closed form, its error",
    "calibrated": "hurst, q0, q1, h_rms, h_max, mean separation, E_star; force, area, stiffness, error",
    "separation": "hurst, q0, q1, h_rms, h_max, force, E_star; mean separation by the calibrated law",
}
TOLERANCE = 1e-11
ANY = 1e300  # what the difference of a number that may be any is relative to
# of mbma.h
OK = 0
X_BELOW = 1
X_ABOVE = 2
MU_ABOVE = 3
INVALID = 5
SURFACES = (
    # hurst, q0, q1, h_rms, h_max
    (0.8, 1.0, 1e2, 1.0, 3.5),
    (0.3, 2e3, 5e7, 2e-5, 1e-4),
    (1.0, 0.01, 3.0, 4.0, 12.0),
)
DEPTHS = (0.05, 0.3, 0.8, 1.4)  # (h_max - d)/h_max
SHARES = (0.02, 0.3, 0.7, 0.99)  # u/h_max
RTOL = 1e-8


def rows(
    kind: str,
    arguments: Iterable[Any],
    answers: Any,
    scales: Any = None,
    tolerance: Any = TOLERANCE,
) -> Rows:
    """Lines of the points' file; columns of arguments, answers and scales of their differences broadcast."""
    given = np.broadcast_arrays(*arguments, tolerance)
    expected = np.array([np.broadcast_to(answer, given[0].shape) for answer in answers])
    units = (
        np.abs(expected)
        if scales is None
        else np.array([np.broadcast_to(unit, given[0].shape) for unit in scales])
    )
    # results that are exactly 0 must be exactly 0
    pairs = np.stack([expected, np.where(units == 0, 1.0, units)], axis=1).reshape(
        -1, given[0].size
    )
    for *own, most, numbers in zip(
        *(column.ravel().tolist() for column in given), pairs.T.tolist(), strict=True
    ):
        cells = [
            number(value, infinity="inf", missing="nan") for value in (*own, *numbers)
        ]
        yield ",".join((kind, number(most), str(len(own)), *cells))


def formula_rows(X: FloatArray, mu: FloatArray) -> Rows:
    """The closed form at flat (X, mu), where they lie in its range."""
    found = np.array(FormulaModel(FORM).answer(X, mu, outside="nan"))
    inside = np.isfinite(found[2])
    yield from rows("formula", np.array([X, mu])[:, inside], found[:, inside])


def covered(
    model: UniversalModel, surface: Surface, variant: Variant, gaps: FloatArray
) -> Any:
    """Whether a table covers all islands of a surface, at each of its gaps."""
    theory = Mbma(model, variant, RTOL, outside="nan")
    return np.isfinite(contact(surface, separation=gaps, theory=theory).pressure)


def surface_rows(
    surface: tuple[float, ...],
    variant: Variant,
    approach: Any,
    depths: Any,
    shares: Any,
    E_star: float = 1.0,
    table: UniversalModel | None = None,
) -> Rows:
    """Islands and totals of one surface, gap by gap, and the calibrated law at shares of h_max, by the library."""
    own = Surface(*surface)
    model = table or universal_model()
    fields = geometry(approach, own.hurst, own.zeta_1, variant)
    yield from rows(
        "geometry", (approach, own.hurst, own.zeta_1), [fields[name] for name in FIELDS]
    )
    gaps = own.h_max * (1 - np.asarray(depths))
    gaps = gaps[covered(model, own, variant, gaps)]
    sums = np.zeros((5, gaps.size))
    compression = (own.h_max - gaps) / own.h_rms
    by_table(
        own, compression, np.arange(gaps.size), model, Sums(model, variant, RTOL), sums
    )
    stress = own.q0 * own.s
    pressure = stress * sums[0]
    area = sums[1]
    stiffness = 2 * stress / own.h_rms * sums[2]
    # at a maximum of force, stiffness is 0
    least = np.maximum(
        np.abs(stiffness), np.where(pressure == 0, 1.0, pressure) / own.h_max
    )
    yield from rows(
        "total",
        (*surface, gaps, 1.0, RTOL),
        (pressure, area, stiffness, 0.0),
        (pressure, area, least, ANY),
    )
    if len(shares):
        u = own.h_max * np.asarray(shares)
        found = contact(own, E_star, mean_separation=u, theory="calibrated")
        values = found.pressure, found.area, found.stiffness
        yield from rows(
            "calibrated", (*surface, u, E_star), (*values, 0.0), (*values, ANY)
        )
        yield from rows("separation", (*surface, found.pressure, E_star), (u,))


def points_text(model: UniversalModel, variant: Variant) -> str:
    """The points' file: the table's own, and the runtime's islands, totals, refusals and calibrated law."""
    points, (X, mu) = model.content.conformance, model.content.axes
    places = points["X"], points["mu"]
    head = [
        f"conformance points of the MBMA model, variant {variant.name}",
        f"data {model.content.attributes['values_sha256']}",
        "a row: kind, tolerance, how many arguments, these; each answer and what its difference is taken relative to",
        *(f"{kind}: {meaning}" for kind, meaning in KINDS.items()),
    ]
    # with the results and tolerances that are stored in the table
    known = points["table_F"], points["table_A"], model.answer(*places).error
    lines = [*rows("phi", places, known, None, points["tolerance"])]
    middle = 0.5 * (X.low + X.high)
    some = min(1.0, mu.high)
    statuses = {
        (X.low, some): OK,
        (X.high, some): OK,
        (middle, mu.high): OK,
        (middle, 0.0): OK,
    }
    statuses |= {
        (np.nextafter(X.low, -np.inf), some): X_BELOW,
        (np.nextafter(X.high, np.inf), some): X_ABOVE,
    }
    statuses |= {(middle, np.nextafter(mu.high, np.inf)): MU_ABOVE}
    statuses |= dict.fromkeys(
        [(math.nan, 1.0), (middle, math.nan), (middle, -1e-300)], INVALID
    )
    lines += [
        *rows("status", np.array([*statuses]).T, [[*statuses.values()]]),
        *formula_rows(*places),
    ]
    for surface in SURFACES:
        if surface[2] / surface[1] > max(3.0, variant.floor_u):
            approach = np.geomspace(1e-3, 2 * surface[4] / surface[3], 8)
            lines += surface_rows(surface, variant, approach, DEPTHS, SHARES, table=model)
    return comment(head, "#") + "\n".join(lines) + "\n"
