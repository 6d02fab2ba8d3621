"""Conformance points beside exported code, which its self-test replays.

A row of the points' file contains: kind, tolerance, number of arguments, the arguments, and
each result with the scale of its difference. Lines that begin with # describe the kinds.
"""

import math
import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.contact import contact
from mbma_tables.export.text import comment, number, template
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.surface import Surface
from mbma_tables.tables.island4d import SPHERE_FLOOR, Island4dModel, to_axes
from mbma_tables.tables.open import universal_model
from mbma_tables.tables.schema import ARGUMENTS, ISLAND4D
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories.mbma.closed_forms import FormulaModel
from mbma_tables.theories.mbma.sums import Sums, by_table
from mbma_tables.theories.mbma.theory import Mbma

Rows = Iterator[str]
IslandTable = UniversalModel | Island4dModel
FORM = "standard"  # the form of island model "formula"
POINTS_FILE = "mbma_conformance.csv"
# fields of `mbma_joint`; the second is of the file, the others of a contact
_JOINT = template("model/mbma_model.h").partition("} mbma_joint;")[0].rpartition("{")[2]
JOINT = re.findall(r"\w+(?=[,;])", _JOINT)
KINDS = {
    "geometry": f"approach, hurst, zeta_1; {', '.join(FIELDS)}",
    "total": "hurst, q0, q1, h_rms, h_max, separation, E_star, rtol; force, area, stiffness, error",
    "status": "the same arguments; the status",
    "formula": "X, mu; phi_F, phi_A by the closed form, its error",
    "calibrated": "hurst, q0, q1, h_rms, h_max, mean separation, E_star; force, area, stiffness, error",
    "separation": "hurst, q0, q1, h_rms, h_max, force, E_star; mean separation by the calibrated law",
    "joint": (
        "hurst, q0, q1, h_rms, h_max, E_star, hardness, nu, conductivity, mean separation; "
        f"{', '.join(JOINT)}"
    ),
    "joint_separation": (
        "hurst, q0, q1, h_rms, h_max, E_star, hardness, nu, conductivity, force; mean separation"
    ),
    "unloaded": (
        "hurst, q0, q1, h_rms, h_max, E_star, hardness, nu, conductivity, largest force, mean separation; "
        f"{', '.join(JOINT)}"
    ),
    "unloaded_separation": (
        "hurst, q0, q1, h_rms, h_max, E_star, hardness, nu, conductivity, largest force, force; mean separation"
    ),
}
# of the first kind, "phi" or of a table of four numbers "lookup"
PHI = "X, mu; phi_F, phi_A, the bound on their error"
LOOKUP = "delta/h_rms, zeta_d, zeta_u, hurst; F_hat, A_hat, the bound on their error"
TOLERANCE = 1e-11
SMALLEST = 1e-300
ANY = 1e300  # what the difference of a number that may be any is relative to
# of mbma.h
OK = 0
X_BELOW = 1
X_ABOVE = 2
MU_ABOVE = 3
INVALID = 5
SPREAD_ABOVE = 7
ZETA_D_OUTSIDE = 8
HURST_OUTSIDE = 9
SURFACES = (
    # hurst, q0, q1, h_rms, h_max
    (0.8, 1.0, 1e2, 1.0, 3.5),
    (0.3, 2e3, 5e7, 2e-5, 1e-4),
    (1.0, 0.01, 3.0, 4.0, 12.0),
)
DEPTHS = (0.05, 0.3, 0.8, 1.4)  # (h_max - d)/h_max
SHARES = (0.02, 0.3, 0.7, 0.99)  # u/h_max
# places on the way from the contact under the largest force to last contact; one is of first loading
LIFTED = (-0.2, 0.02, 0.3, 0.9, 1 - 1e-9, 1.01)
# hardness over E* times the rms gradient, Poisson's ratio and mean conductivity
BODIES = ((0.03, 0.3, 45.0), (0.4, 0.0, 0.2), (math.inf, 0.5, 400.0))
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


def lookup_kind(model: IslandTable) -> str:
    """The kind of points of a table's own lookups."""
    return "lookup" if isinstance(model, Island4dModel) else "phi"


def covered(
    model: IslandTable, surface: Surface, variant: Variant, gaps: FloatArray
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
    table: IslandTable | None = None,
    bodies: Iterable[tuple[float, ...]] = BODIES,
) -> Rows:
    """Islands and totals of one surface, gap by gap, and the calibrated law at shares of h_max, by the library.

    The law also of `bodies`, each with a hardness over E* times the rms gradient, Poisson's
    ratio and mean conductivity.
    """
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
        for eta, *others in bodies:
            hardness = eta * E_star * float(own.rms_gradient)
            yield from joint_rows(surface, (E_star, hardness, *others), u)


def joint_rows(
    surface: tuple[float, ...], numbers: tuple[float, ...], u: FloatArray
) -> Rows:
    """Contacts with a hardness at mean separations and the separations at their forces, and so after one of them."""
    E_star, hardness, nu, conductivity = numbers
    bodies = Bodies(E_star, hardness=hardness, nu=nu, conductivity=conductivity)
    found: Any = contact(
        Surface(*surface), bodies, mean_separation=u, theory="calibrated"
    )
    values, scales = joint_values(found)
    yield from rows("joint", (*surface, *numbers, u), values, scales)
    # which rounding of the force moves by as much of this
    least = np.maximum(u, found.pressure / found.stiffness)
    given = (*surface, *numbers, found.pressure)
    yield from rows("joint_separation", given, (u,), (least,))
    middle = u.size // 2
    yield from unloaded_rows(surface, numbers, found.pressure[middle], u[middle])


def unloaded_rows(
    surface: tuple[float, ...], numbers: tuple[float, ...], largest: float, deepest: float
) -> Rows:
    """Contacts after a largest force and the mean separation under it, and the separations at their forces."""
    E_star, hardness, nu, conductivity = numbers
    bodies = Bodies(
        E_star,
        hardness=hardness,
        nu=nu,
        conductivity=conductivity,
        largest_pressure=largest,
    )
    face = Surface(*surface)
    end: Any = contact(face, bodies, pressure=0.0, theory="calibrated")
    last = end.mean_separation
    u = deepest + (last - deepest) * np.array(LIFTED)
    found: Any = contact(face, bodies, mean_separation=u, theory="calibrated")
    values, scales = joint_values(found)
    # rounding of the distance to last contact counts where a number ends there
    amplification = np.maximum(1.0, u / np.maximum(last - u, SMALLEST))
    scales = [
        np.minimum(scale, ANY / amplification) * amplification
        if number_at_end == 0
        else scale
        for scale, number_at_end in zip(scales, joint_values(end)[0], strict=True)
    ]
    given = (*surface, *numbers, largest)
    yield from rows("unloaded", (*given, u), values, scales)
    touching = found.pressure > 0
    force, moved = found.pressure[touching], u[touching]
    least = np.maximum(moved, force / found.stiffness[touching])
    yield from rows("unloaded_separation", (*given, force), (moved,), (least,))


def joint_values(found: Any) -> tuple[list[Any], list[Any]]:
    """Results of a contact in the order of `JOINT`, and the scales of their differences."""
    values = [
        np.zeros(np.shape(found.pressure))
        if name == "error"
        else getattr(found, "pressure" if name == "force" else name)
        for name in JOINT
    ]
    scales = [
        ANY if name == "error" else np.abs(value)
        for name, value in zip(JOINT, values, strict=True)
    ]
    return values, scales


def universal_rows(model: UniversalModel) -> Rows:
    """Lookups, statuses and closed forms of a table of X and mu."""
    points, (X, mu) = model.content.conformance, model.content.axes
    places = points["X"], points["mu"]
    # with the results and tolerances that are stored in the table
    known = points["table_F"], points["table_A"], model.answer(*places).error
    yield from rows("phi", places, known, None, points["tolerance"])
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
    yield from rows("status", np.array([*statuses]).T, [[*statuses.values()]])
    yield from formula_rows(*places)


def four_rows(model: Island4dModel) -> Rows:
    """Lookups, statuses and closed forms of a table of the paper's four numbers."""
    points = model.content.conformance
    delta, zeta_d, zeta_u, hurst = (points[name] for name in ARGUMENTS[ISLAND4D])
    places = delta, zeta_d, zeta_u, hurst
    error = model.lookup(delta, zeta_d, zeta_u, hurst).error
    known = points["table_F"], points["table_A"], error
    yield from rows("lookup", places, known, None, points["tolerance"])
    statuses = _statuses_of_four(model)
    yield from rows("status", np.array([*statuses]).T, [[*statuses.values()]])
    place = to_axes(delta, zeta_d, zeta_u, hurst, model.variant)
    yield from formula_rows(place.X, place.mu)


def _statuses_of_four(model: Island4dModel) -> dict[tuple[float, ...], int]:
    """An island of a table and others beyond each of its axes, with what a lookup says of them."""
    X, spread, sphere, hurst = model.content.axes
    points = model.content.conformance
    delta, zeta_d, zeta_u, H = (float(points[name][0]) for name in ARGUMENTS[ISLAND4D])
    island = np.array([delta, zeta_d, zeta_u, H])
    approach, low, high, exponent = island[:, None]
    sigma = float(to_axes(approach, low, high, exponent, model.variant).sigma[0])
    below, above = (
        (1 + depth * sigma) * zeta_d**-H for depth in (X.low - 0.01, X.high + 0.01)
    )
    wide = zeta_d * (1 + 1.01 * spread.high)
    nearest = SPHERE_FLOOR * (1.01 * sphere.high) ** (-1 / (4 - 2 * H))
    statuses: dict[tuple[float, ...], int] = {
        (delta, zeta_d, zeta_u, H): OK,
        (below, zeta_d, zeta_u, H): X_BELOW,
        (above, zeta_d, zeta_u, H): X_ABOVE,
        (delta, zeta_d, wide, H): SPREAD_ABOVE,
        (delta, nearest, 2 * nearest, H): ZETA_D_OUTSIDE,
        (delta, zeta_d, zeta_u, 0.99 * hurst.low): HURST_OUTSIDE,
        (delta, zeta_d, zeta_d, H): INVALID,
        (delta, 0.9, zeta_u, H): INVALID,
        (math.inf, zeta_d, zeta_u, H): INVALID,
    }
    for missing in range(4):
        wrong = island.copy()
        wrong[missing] = math.nan
        statuses[tuple(wrong.tolist())] = INVALID
    return statuses


def table_rows(model: IslandTable) -> Rows:
    """Lookups, statuses and closed forms of a table."""
    if isinstance(model, UniversalModel):
        return universal_rows(model)
    return four_rows(model)


def points_text(model: IslandTable, variant: Variant) -> str:
    """The points' file: the table's own, and the runtime's islands, totals, refusals and calibrated law."""
    kind = lookup_kind(model)
    kinds = {kind: LOOKUP if kind == "lookup" else PHI} | KINDS
    head = [
        f"conformance points of the MBMA model, variant {variant.name}",
        f"data {model.content.attributes['values_sha256']}",
        "a row: kind, tolerance, how many arguments, these; each answer and what its difference is taken relative to",
        *(f"{kind}: {meaning}" for kind, meaning in kinds.items()),
    ]
    lines = [*table_rows(model)]
    for surface in SURFACES:
        if surface[2] / surface[1] > max(3.0, variant.floor_u):
            approach = np.geomspace(1e-3, 2 * surface[4] / surface[3], 8)
            lines += surface_rows(surface, variant, approach, DEPTHS, SHARES, table=model)
    return comment(head, "#") + "\n".join(lines) + "\n"
