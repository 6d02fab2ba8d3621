"""Constants of contacts with a hardness from capped boundary elements; errors on other surfaces."""

import dataclasses
import functools
import json
import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from generate.boundary_elements.evidence import GAUSSIAN, LEVELS, Capped, capped
from generate.boundary_elements.surfaces import SPLITS, TRAINING
from generate.calibrated_file import (
    by_bin,
    cross_validated,
    fitted,
    law_group,
    rms,
    within,
    write_part,
)
from generate.files import read_csv
from mbma_tables import Bodies, Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories import resolve
from mbma_tables.theories.evidence import shipped_deviations
from mbma_tables.theories.yielding import formulas as cap
from mbma_tables.theories.yielding.theory import GROUP, Scatter, Yielding

# A/A0 that constants are fitted to
LIGHTEST = 0.01
HEAVIEST = 0.97
# contact fractions between which errors are stated
EDGES = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.95)
BARS = {
    "area": 0.05,
    "yielded": 0.05,
    "force": np.log(1.25),
    "stiffness": np.log(1.25),
}
QUANTITIES = ("area", "yielded", "force", "stiffness")  # as the file names them
# and as the library does
LIBRARY = {"area": "area", "force": "pressure", "stiffness": "unloading_stiffness"}
# constants of each part, and errors that count alike: "planes" is the gap between mean planes
PARTS: dict[str, tuple[tuple[str, ...], float]] = {
    "area": (("area_power", "area_scale"), 0.015),
    "yielded": (("yield_power", "yield_scale"), 0.03),
    "force": (("force_light", "force_eta", "force_share"), 0.03),
    "stiffness": (("frozen", "frozen_eta"), 0.05),
    "planes": (("plane_eta", "plane_load"), 0.02),
}
DIGITS = 4
FORMS = {"calibrated": "h_max", "calibrated_map": "heights"}
# the simulated elastic contact and h_max, for what a hardness adds to any theory
ELASTIC = "elastic"
OTHERS = ("mbma", "persson")  # theories of which what is said of their errors is tested
LEAST = 1e-9  # mean separation at which theories end [h_rms]
TURN = 0.01  # of ln A_el, for derivatives
WAVES = 3  # longest waves a side: with fewer h_max says little of the highest heights


def errors(
    one: Capped, part: str, constants: cap.YieldConstants, share: int = 0
) -> FloatArray:
    """Errors of a part where the elastic contact is the simulated one.

    Errors of the elastic law so stay out of them.
    """
    if part == "area":
        area = cap.area(one.force, one.elastic_area, one.eta, constants, False)
        return np.log(area / one.area)
    if part == "yielded":
        yielded = cap.area(one.force, one.elastic_area, one.eta, constants, True)
        return (yielded - one.yielded) / one.area
    if part == "force":
        elastic_force, _ = one.elastic
        bearing_share = one.shares[share]
        force, _ = cap.force(elastic_force, 0.0, bearing_share, 0.0, one.eta, constants)
        return np.log(force / one.force)
    if part == "stiffness":
        _, elastic_stiffness = one.elastic
        return np.log(
            elastic_stiffness * cap.frozen_factor(one.eta, constants) / one.frozen
        )
    return (
        cap.plane_separation(one.u, one.force / one.eta, one.eta, constants) - one.planes
    )


def fitted_to(one: Capped) -> Any:
    return (one.area > LIGHTEST) & (one.area < HEAVIEST)


def fit(seen: Sequence[Capped]) -> cap.YieldConstants:

    def residuals(part: str, noise: float, trial: cap.YieldConstants) -> list[FloatArray]:
        return [errors(one, part, trial)[fitted_to(one)] / noise for one in seen]

    constants = cap.CONSTANTS
    # each part depends on constants of its own, and is fitted alone
    for part, (names, noise) in PARTS.items():
        residuals_of_part = functools.partial(residuals, part, noise)
        best = fitted(cap.CONSTANTS, names, residuals_of_part, x_scale="jac")
        rounded = {name: float(f"{getattr(best, name):.{DIGITS}g}") for name in names}
        constants = dataclasses.replace(constants, **rounded)
    return constants


def frozen_errors(
    one: Capped,
    elastic: tuple[FloatArray, ...],
    constants: cap.YieldConstants,
) -> FloatArray:
    """ln of a theory's frozen stiffness over the simulated one at equal force.

    NaN where the theory ends before.

    From pressure to the gap to the stiffness, on its own curve: force, stiffness and Q of the
    elastic contact.
    """
    elastic_force, elastic_stiffness, share = elastic
    force, _ = cap.force(elastic_force, 0.0, share, 0.0, one.eta, constants)
    # nothing of a curve is zero, so that it has logarithms
    log_force = np.log(np.maximum(force, 1e-30))
    stiffness = elastic_stiffness * cap.frozen_factor(one.eta, constants)
    log_stiffness = np.log(np.maximum(stiffness, 1e-30))
    # forces fall with the gap, and interpolation wants them rising
    at_loads = np.interp(-np.log(one.force), -log_force, log_stiffness, left=np.nan)
    return np.asarray(at_loads - np.log(one.frozen))


@functools.cache
def errors_of(
    one: Capped, name: str, constants: cap.YieldConstants
) -> dict[str, FloatArray]:
    """Errors of a theory with a hardness.

    ln of area and stiffness at equal force, ln of force at equal u, and the yielded share.
    """
    if name == ELASTIC:
        return {quantity: errors(one, quantity, constants, 1) for quantity in QUANTITIES}
    if name in OTHERS:
        return errors_of_other(one, name, constants)

    # the map's law knows the surface's heights, the spectrum's law takes Gaussian ones
    by_map = name == "calibrated_map"
    elastic_law = one.map_curve if by_map else one.law
    elastic_area = elastic_law.area(one.force)
    area = cap.area(one.force, elastic_area, one.eta, constants, False)
    yielded = cap.area(one.force, elastic_area, one.eta, constants, True)

    elastic_force = one.map_curve.answer(one.u)[0] if by_map else one.by_law[0]
    share = one.shares[0 if by_map else 1]
    force, _ = cap.force(elastic_force, 0.0, share, 0.0, one.eta, constants)
    # a law that ends before a gap has no logarithm of its force there
    least_force = 1e-6 * one.force
    return {
        "area": np.log(area / one.area),
        "yielded": yielded / area - one.yielded / one.area,
        "force": np.log(np.maximum(force, least_force) / one.force),
        "stiffness": frozen_errors(one, one.curves[name], constants),
    }


def errors_of_other(
    one: Capped, name: str, constants: cap.YieldConstants
) -> dict[str, FloatArray]:
    """Errors of force, area and frozen stiffness of a theory that is not the calibrated one."""
    surface = one.surface
    theory = resolve(name)
    gradient = float(surface.rms_gradient)
    force = np.full(one.u.size, np.nan)
    area = np.full(one.u.size, np.nan)

    # what the theory reaches
    pressure = one.force * gradient
    lowest = np.asarray(theory.interval(surface)[0])
    highest_pressure = theory.answer(surface, np.maximum(lowest, LEAST)).pressure
    reached = (one.u < one.h_max) & (one.area > EDGES[0]) & (pressure < highest_pressure)

    yielding = Yielding(theory, one.eta * gradient)
    force[reached] = yielding.answer(surface, one.u[reached]).pressure / gradient
    elastic_area = theory.area_at(surface, pressure[reached])
    area[reached] = cap.area(one.force[reached], elastic_area, one.eta, constants)

    u = one.h_max * LEVELS[:-1]
    curve = theory.answer(surface, u)
    share, _ = cap.bearing_share(u, theory.heights(surface))
    elastic = (curve.pressure / gradient, curve.stiffness / gradient, share)
    return {
        "force": np.log(force / one.force),
        "area": np.log(area / one.area),
        "stiffness": frozen_errors(one, elastic, constants),
    }


def told(
    seen: Sequence[Capped],
    name: str,
    constants: Callable[[Capped], cap.YieldConstants],
) -> pd.DataFrame:
    """Errors of a theory on surfaces, a row a load, with what the surface is.

    The column `own` has the theory's own area.
    """
    parts = []
    for one in seen:
        misses = errors_of(one, name, constants(one))
        columns = {
            key: getattr(one, key) for key in ("kind", "split", "waves", "zeta_1", "eta")
        }
        columns |= {"contact": one.area}
        columns |= misses
        columns |= {"own": one.area * np.exp(misses["area"])}
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


def between(contact: Any) -> Any:
    return (contact > LIGHTEST) & (contact < EDGES[-1])


def statistics(frame: pd.DataFrame) -> FloatArray:
    """Statistics, as `laws.toml` names them, of each quantity from 1% to 95% contact."""
    inside = frame[between(frame["contact"])]
    rows = []
    for quantity in QUANTITIES:
        misses = inside[quantity].to_numpy()
        size = np.abs(misses)
        share_within = np.mean(size < BARS[quantity])
        rows.append(
            (np.mean(misses), np.std(misses), share_within, size.max(), misses.size)
        )
    return np.array(rows)


def by_contact(frame: pd.DataFrame, quantity: str, area: str = "contact") -> FloatArray:
    """Root mean squares by hardness and contact fraction, NaN where there are none."""
    rows = []
    for _, of_hardness in frame.groupby("eta"):
        rows.append(by_bin(of_hardness[area], of_hardness[quantity], EDGES, rms)[:, 0])
    return np.array(rows)


def weight_of_elastic(
    one: Capped, quantity: str, constants: cap.YieldConstants
) -> FloatArray:
    """d ln of the area or the force with a hardness by d ln of the elastic one."""
    if quantity == "area":
        more = np.minimum(one.elastic_area * np.exp(TURN), 1.0)
        less = np.minimum(one.elastic_area * np.exp(-TURN), 1.0)
        above = cap.area(one.force, more, one.eta, constants)
        below = cap.area(one.force, less, one.eta, constants)
        return np.log(above / below) / (2 * TURN)
    # the derivative by ln of the elastic force is that along a curve whose slope is the force
    # itself
    elastic = one.elastic[0]
    force, rate = cap.force(elastic, elastic, one.shares[1], 0.0, one.eta, constants)
    return rate / force


def by_magnification(
    seen: Sequence[Capped], constants: cap.YieldConstants
) -> dict[str, list[float]]:
    """Mean errors of the parts by zeta_1 at the hardness where they are largest.

    The elastic contact is the simulated one.
    """
    parts = []
    for one in seen:
        inside = fitted_to(one)
        columns: dict[str, Any] = {"zeta_1": one.zeta_1, "eta": one.eta}
        for quantity in QUANTITIES:
            columns[quantity] = errors(one, quantity, constants)[inside]
        parts.append(pd.DataFrame(columns))
    means = pd.concat(parts).groupby(["zeta_1", "eta"]).mean()
    largest = {}
    for zeta, by_hardness in means.groupby("zeta_1"):
        largest_of_each = [max(by_hardness[quantity], key=abs) for quantity in QUANTITIES]
        largest[f"{zeta:g}"] = [float(value) for value in largest_of_each]
    return largest


def blind() -> dict[str, FloatArray]:
    """Errors of `contact` on surfaces of another code, which no fit or choice of a form saw."""
    table = read_csv("hardness.csv")
    yielding = table[np.isfinite(table["eta"]) & between(table["area"])]
    simulated = {name: column.to_numpy() for name, column in yielding.items()}
    surface = Surface(
        simulated["hurst"],
        1.0,
        simulated["zeta_1"],
        1.0,
        simulated["h_max_over_h_rms"],
    )
    # forces and hardnesses of the file are over A0 E* g and E* g
    g = surface.rms_gradient
    pressure = simulated["force"] * g
    hardness = simulated["eta"] * g
    at_force = contact(
        surface, Bodies(hardness=hardness), pressure=pressure, theory="calibrated"
    )
    at_gap = contact(
        surface,
        Bodies(hardness=hardness),
        mean_separation=simulated["u_gap"],
        theory="calibrated",
    )
    yielded = at_force.yielded - simulated["area_yielded"] / simulated["area"]
    return {
        "area": np.log(at_force.area / simulated["area"]),
        "yielded": np.asarray(yielded),
        "force": np.log(at_gap.pressure / pressure),
        "stiffness": np.log(at_force.unloading_stiffness / (simulated["kappa"] * g)),
    }


def coverage(
    seen: Sequence[Capped],
    constants: cap.YieldConstants,
    scatter: Scatter,
) -> dict[str, list[float]]:
    """Shares of errors within one and two of the stated standard deviations.

    By theory and quantity, from 1% contact on.
    """
    shares: dict[str, list[float]] = {}
    for name in (*FORMS, *OTHERS):
        # other theories answer self-affine surfaces alone
        answered = [one for one in seen if name in FORMS or one.kind == "self_affine"]
        frame = told(answered, name, lambda _: constants)
        frame = frame[between(frame["contact"])]
        eta = frame["eta"].to_numpy()
        for quantity, in_library in LIBRARY.items():
            # of stiffness by the theory's own area, as stated
            area = frame["own" if quantity == "stiffness" else "contact"].to_numpy()
            of_elastic = "stiffness" if quantity == "stiffness" else in_library
            elastic = shipped_deviations().standard_deviation(name, of_elastic, area)
            deviation = scatter.standard_deviation(name, in_library, eta, area, elastic)
            sizes = frame[quantity] / deviation
            shares[f"{name} {quantity}"] = within(sizes[np.isfinite(sizes)].to_numpy())
    return shares


def stated(training: Sequence[Capped], constants: cap.YieldConstants) -> Scatter:
    """Root mean squares of errors by constants from other spectra.

    And how much of an elastic error is passed on.
    """
    constants_of_others = cross_validated(training, fit)

    def unseen(one: Capped) -> cap.YieldConstants:
        return constants_of_others[one.node]

    rms_of_theories = {}
    for name in (*FORMS, ELASTIC):
        frame = told(training, name, unseen)
        rms_of_theories[name] = np.array([by_contact(frame, q) for q in QUANTITIES])

    alike = [one for one in training if one.kind == "self_affine"]
    for name in OTHERS:
        # what they lack is what the elastic theories' become;
        # by the theory's own area, which is what a user has
        rms_of_theories[name] = np.full_like(rms_of_theories[ELASTIC], np.nan)
        frame = told(alike, name, unseen)
        row = QUANTITIES.index("stiffness")
        rms_of_theories[name][row] = by_contact(frame, "stiffness", "own")

    frames = []
    for one in training:
        columns: dict[str, Any] = {"eta": one.eta, "contact": one.area}
        for quantity in ("area", "force"):
            columns[quantity] = weight_of_elastic(one, quantity, constants)
        frames.append(pd.DataFrame(columns))
    passed_on = pd.concat(frames)
    weights = {LIBRARY[q]: by_contact(passed_on, q) for q in ("area", "force")}

    hardnesses = np.array(sorted({one.eta for one in training}))
    log_area = np.log(np.sqrt(np.multiply(EDGES[1:], EDGES[:-1])))
    return Scatter(hardnesses, log_area, rms_of_theories, weights)


def sets_of(frame: pd.DataFrame) -> dict[str, pd.Series]:
    """Rows of errors that belong to each set whose accuracy is stated."""
    is_gaussian = frame["kind"].isin(GAUSSIAN)
    is_held_out = frame["split"] != TRAINING
    sets = {split: is_gaussian & (frame["split"] == split) for split in SPLITS[:3]}
    sets["three_waves"] = is_gaussian & is_held_out & (frame["waves"] >= WAVES)
    sets["stretched"] = frame["kind"] == "stretched"
    return sets


def write(
    evidence: xr.Dataset,
    path: os.PathLike[str] | str | None,
) -> tuple[cap.YieldConstants, xr.Dataset]:
    contacts = capped(evidence)
    plain = [one for one in contacts if one.kind in GAUSSIAN]
    training = [one for one in plain if one.split == TRAINING]
    held_out = [one for one in plain if one.split != TRAINING]
    self_affine = [one for one in plain if one.kind == "self_affine"]
    constants = fit(training)
    scatter = stated(training, constants)
    covered = coverage(held_out, constants, scatter)

    frames = [told(contacts, form, lambda _: constants) for form in FORMS]
    sets = sets_of(frames[0])
    accuracy = []
    for members in sets.values():
        of_forms = [statistics(frame[members]) for frame in frames]
        accuracy.append(of_forms)

    rms_of_theories = np.array([*scatter.rms.values()])
    weights = np.array([*scatter.weight.values()])
    arrays = {
        "accuracy": (("set", "form", "quantity", "statistic"), np.array(accuracy)),
        "stated_scatter": (
            ("theory", "quantity", "hardness", "contact"),
            rms_of_theories,
        ),
        "elastic_weight": (("force_or_area", "hardness", "contact"), weights),
        "eta": ("hardness", scatter.eta),
        "contact": ("contact", np.exp(scatter.log_area)),
    }

    made_of = {
        "code_sha256": evidence.attrs.get("code_sha256", ""),
        "contacts": len(contacts),
    }
    facts = {
        "coverage": json.dumps(covered),
        "drift": json.dumps(by_magnification(self_affine, constants)),
        "evidence": json.dumps(made_of),
        "theories": " ".join(scatter.rms),
        "sets": " ".join(sets),
    }
    data = law_group(GROUP, arrays, {"law": constants}, facts)
    if path is not None:
        write_part(path, data, GROUP)
    return constants, data
