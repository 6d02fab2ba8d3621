"""Constants of contacts with a hardness from capped boundary elements, and errors on surfaces that no fit saw."""

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
from generate.calibrated_file import by_bin, cross_validated, fitted, law_group, rms, within, write_part
from generate.files import read_csv
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws import hardness as cap
from mbma_tables.theories import calibrated_table, get_theory
from mbma_tables.theories.yielding import GROUP, Scatter, Yielding

LIGHTEST, HEAVIEST = 0.01, 0.97  # A/A0 that constants are fitted to
EDGES = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.95)  # contact fractions between which errors are told
BARS = {"area": 0.05, "yielded": 0.05, "force": np.log(1.25), "stiffness": np.log(1.25)}
QUANTITIES = ("area", "yielded", "force", "stiffness")  # as the file names them
LIBRARY = {"area": "area", "force": "pressure", "stiffness": "unloading_stiffness"}  # and as the library does
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
ELASTIC = "elastic"  # the simulated elastic contact and h_max, for what a hardness adds to any theory
OTHERS = ("mbma", "persson")  # theories of which what is said of their errors is tested
LEAST = 1e-9  # mean separation at which theories end [h_rms]
TURN = 0.01  # of ln A_el, for derivatives
WAVES = 3  # longest waves a side: with fewer h_max says little of the highest heights


def errors(one: Capped, part: str, constants: cap.Constants, share: int = 0) -> FloatArray:
    """Errors of a part where the elastic contact is the simulated one, so that its law's errors stay out."""
    if part in ("area", "yielded"):
        found = cap.area(one.force, one.elastic_area, one.eta, constants, part == "yielded")
        return np.log(found / one.area) if part == "area" else (found - one.yielded) / one.area
    if part == "force":
        return np.log(cap.force(one.elastic[0], 0.0, one.shares[share], 0.0, one.eta, constants)[0] / one.force)
    if part == "stiffness":
        return np.log(one.elastic[1] * cap.frozen_factor(one.eta, constants) / one.frozen)
    return cap.plane_separation(one.u, one.force / one.eta, one.eta, constants) - one.planes


def fitted_to(one: Capped) -> Any:
    return (one.area > LIGHTEST) & (one.area < HEAVIEST)


def fit(seen: Sequence[Capped]) -> cap.Constants:

    def residuals(part: str, noise: float, trial: cap.Constants) -> list[FloatArray]:
        return [errors(one, part, trial)[fitted_to(one)] / noise for one in seen]

    found = cap.CONSTANTS
    for part, (own, noise) in PARTS.items():
        best = fitted(cap.CONSTANTS, own, functools.partial(residuals, part, noise), x_scale="jac")
        found = dataclasses.replace(found, **{name: float(f"{getattr(best, name):.{DIGITS}g}") for name in own})
    return found


def frozen_errors(one: Capped, elastic: tuple[FloatArray, ...], constants: cap.Constants) -> FloatArray:
    """ln of a theory's frozen stiffness over the simulated one at equal force, NaN where the theory ends before.

    From pressure to the gap to the stiffness, on its own curve: force, stiffness and Q of the elastic contact.
    """
    endless, steep, share = elastic
    curve = np.log(np.maximum(cap.force(endless, 0.0, share, 0.0, one.eta, constants)[0], 1e-30))
    frozen = np.log(np.maximum(steep * cap.frozen_factor(one.eta, constants), 1e-30))
    at = np.interp(-np.log(one.force), -curve, frozen, left=np.nan)
    return np.asarray(at - np.log(one.frozen))


@functools.cache
def errors_of(one: Capped, name: str, constants: cap.Constants) -> dict[str, FloatArray]:
    """Of a theory with a hardness: ln of area and stiffness at equal force, of force at equal u; the yielded share."""
    if name == ELASTIC:
        return {quantity: errors(one, quantity, constants, 1) for quantity in QUANTITIES}
    if name in OTHERS:
        return errors_of_other(one, name, constants)
    by_map = name == "calibrated_map"
    elastic = (one.map_curve if by_map else one.law).area(one.force)
    area, yielded = (cap.area(one.force, elastic, one.eta, constants, own) for own in (False, True))
    at_gap = one.map_curve.answer(one.u)[0] if by_map else one.by_law[0]
    force = cap.force(at_gap, 0.0, one.shares[0 if by_map else 1], 0.0, one.eta, constants)[0]
    return {
        "area": np.log(area / one.area),
        "yielded": yielded / area - one.yielded / one.area,
        "force": np.log(np.maximum(force, 1e-6 * one.force) / one.force),
        "stiffness": frozen_errors(one, one.curves[name], constants),
    }


def errors_of_other(one: Capped, name: str, constants: cap.Constants) -> dict[str, FloatArray]:
    """Errors of force, area and frozen stiffness of a theory that is not the calibrated one."""
    surface, theory = one.surface, get_theory(name)
    gradient, force, area = float(surface.rms_gradient), *np.full((2, one.u.size), np.nan)
    # what the theory reaches
    loads, low = one.force * gradient, np.asarray(theory.interval(surface)[0])
    most = theory.answer(surface, np.maximum(low, LEAST)).pressure
    held = (one.u < one.h_max) & (one.area > EDGES[0]) & (loads < most)
    force[held] = Yielding(theory, one.eta * gradient).answer(surface, one.u[held]).pressure / gradient
    area[held] = cap.area(one.force[held], theory.area_at(surface, loads[held]), one.eta, constants)
    u = one.h_max * LEVELS[:-1]
    curve, share = theory.answer(surface, u), cap.bearing_share(u, theory.heights(surface))[0]
    frozen = frozen_errors(one, (curve.pressure / gradient, curve.stiffness / gradient, share), constants)
    return {"force": np.log(force / one.force), "area": np.log(area / one.area), "stiffness": frozen}


def told(seen: Sequence[Capped], name: str, constants: Callable[[Capped], cap.Constants]) -> pd.DataFrame:
    """Errors of a theory on surfaces, a row a load, with what the surface is; `own` is the theory's own area."""
    parts = []
    for one in seen:
        found = errors_of(one, name, constants(one))
        known = {key: getattr(one, key) for key in ("kind", "split", "waves", "zeta_1", "eta")}
        parts.append(pd.DataFrame(known | {"contact": one.area} | found | {"own": one.area * np.exp(found["area"])}))
    return pd.concat(parts, ignore_index=True)


def between(contact: Any) -> Any:
    return (contact > LIGHTEST) & (contact < EDGES[-1])


def statistics(frame: pd.DataFrame) -> FloatArray:
    """Statistics, as `laws.toml` names them, of each quantity from 1% to 95% contact."""
    kept = frame[between(frame["contact"])]
    pairs = ((kept[quantity].to_numpy(), BARS[quantity]) for quantity in QUANTITIES)
    return np.array([(np.mean(e), np.std(e), np.mean(np.abs(e) < bar), np.abs(e).max(), e.size) for e, bar in pairs])


def by_contact(frame: pd.DataFrame, quantity: str, area: str = "contact") -> FloatArray:
    """Root mean squares by hardness and contact fraction, NaN where there are none."""
    return np.array([by_bin(own[area], own[quantity], EDGES, rms)[:, 0] for _, own in frame.groupby("eta")])


def weight_of_elastic(one: Capped, quantity: str, constants: cap.Constants) -> FloatArray:
    """d ln of the area or the force with a hardness by d ln of the elastic one."""
    if quantity == "area":
        turned = (np.minimum(one.elastic_area * np.exp(way * TURN), 1.0) for way in (1, -1))
        above, below = (cap.area(one.force, elastic, one.eta, constants) for elastic in turned)
        return np.log(above / below) / (2 * TURN)
    force, rate = cap.force(one.elastic[0], one.elastic[0], one.shares[1], 0.0, one.eta, constants)
    return rate / force


def by_magnification(seen: Sequence[Capped], constants: cap.Constants) -> dict[str, list[float]]:
    """Mean errors of the parts by zeta_1, the elastic contact simulated, at the hardness where they are largest."""
    parts = []
    for one in seen:
        kept = fitted_to(one)
        found = {quantity: errors(one, quantity, constants)[kept] for quantity in QUANTITIES}
        parts.append(pd.DataFrame({"zeta_1": one.zeta_1, "eta": one.eta} | found))
    means = pd.concat(parts).groupby(["zeta_1", "eta"]).mean().groupby("zeta_1")
    return {f"{zeta:g}": [float(max(own[quantity], key=abs)) for quantity in QUANTITIES] for zeta, own in means}


def blind() -> dict[str, FloatArray]:
    """Errors of `contact` on surfaces of another code, which no fit or choice of a form saw."""
    table = read_csv("hardness.csv")
    kept = table[np.isfinite(table["eta"]) & between(table["area"])]
    own = {name: column.to_numpy() for name, column in kept.items()}
    surface = Surface(own["hurst"], 1.0, own["zeta_1"], 1.0, own["h_max_over_h_rms"])
    g = surface.rms_gradient
    options: dict[str, Any] = {"theory": "calibrated", "hardness": own["eta"] * g}
    found = contact(surface, pressure=own["force"] * g, **options)
    closer = contact(surface, mean_separation=own["u_gap"], **options)
    return {
        "area": np.log(found.area / own["area"]),
        "yielded": np.asarray(found.yielded - own["area_yielded"] / own["area"]),
        "force": np.log(closer.pressure / (own["force"] * g)),
        "stiffness": np.log(found.unloading_stiffness / (own["kappa"] * g)),
    }


def coverage(seen: Sequence[Capped], constants: cap.Constants, scatter: Scatter) -> dict[str, list[float]]:
    """Shares of errors from 1% contact within one and two of the stated standard deviations, by theory and quantity."""
    shares: dict[str, list[float]] = {}
    for name in (*FORMS, *OTHERS):
        frame = told([one for one in seen if name in FORMS or one.kind == "self_affine"], name, lambda _: constants)
        frame = frame[between(frame["contact"])]
        for quantity, named in LIBRARY.items():
            # of stiffness by the own area, as stated
            area = frame["own" if quantity == "stiffness" else "contact"].to_numpy()
            elastic = "stiffness" if quantity == "stiffness" else named
            known = calibrated_table.shipped().standard_deviation(name, elastic, area)
            sizes = frame[quantity] / scatter.standard_deviation(name, named, frame["eta"].to_numpy(), area, known)
            shares[f"{name} {quantity}"] = within(sizes[np.isfinite(sizes)].to_numpy())
    return shares


def stated(training: Sequence[Capped], constants: cap.Constants) -> Scatter:
    """Root mean squares of errors by constants from other spectra, and how much of an elastic error is passed on."""
    others = cross_validated(training, fit)
    found = {}
    for name in (*FORMS, ELASTIC):
        frame = told(training, name, lambda one: others[one.node])
        found[name] = np.array([by_contact(frame, q) for q in QUANTITIES])
    alike = [one for one in training if one.kind == "self_affine"]
    for name in OTHERS:
        # what they lack is what the elastic theories' become; by the theory's own area, which is what a user has
        found[name] = np.full_like(found[ELASTIC], np.nan)
        frame = told(alike, name, lambda one: others[one.node])
        found[name][QUANTITIES.index("stiffness")] = by_contact(frame, "stiffness", "own")
    frames = []
    for one in training:
        weight = {q: weight_of_elastic(one, q, constants) for q in ("area", "force")}
        frames.append(pd.DataFrame({"eta": one.eta, "contact": one.area} | weight))
    weights = {LIBRARY[q]: by_contact(pd.concat(frames), q) for q in ("area", "force")}
    log_area = np.log(np.sqrt(np.multiply(EDGES[1:], EDGES[:-1])))
    return Scatter(np.array(sorted({one.eta for one in training})), log_area, found, weights)


def write(evidence: xr.Dataset, path: os.PathLike[str] | str | None) -> tuple[cap.Constants, xr.Dataset]:
    found = capped(evidence)
    plain = [one for one in found if one.kind in GAUSSIAN]
    training = [one for one in plain if one.split == TRAINING]
    constants = fit(training)
    scatter = stated(training, constants)
    covered = coverage([one for one in plain if one.split != TRAINING], constants, scatter)
    frames = [told(found, form, lambda _: constants) for form in FORMS]
    gaussian, late = frames[0]["kind"].isin(GAUSSIAN), frames[0]["split"] != TRAINING
    sets = {split: gaussian & (frames[0]["split"] == split) for split in SPLITS[:3]}
    sets |= {"three_waves": gaussian & late & (frames[0]["waves"] >= WAVES)}
    sets |= {"stretched": frames[0]["kind"] == "stretched"}
    accuracy = np.array([[statistics(frame[kept]) for frame in frames] for kept in sets.values()])
    arrays = {
        "accuracy": (("set", "form", "quantity", "statistic"), accuracy),
        "stated_scatter": (("theory", "quantity", "hardness", "contact"), np.array([*scatter.rms.values()])),
        "elastic_weight": (("force_or_area", "hardness", "contact"), np.array([*scatter.weight.values()])),
        "eta": ("hardness", scatter.eta),
        "contact": ("contact", np.exp(scatter.log_area)),
    }
    drift = by_magnification([one for one in plain if one.kind == "self_affine"], constants)
    made_of = {"code_sha256": evidence.attrs.get("code_sha256", ""), "contacts": len(found)}
    facts: dict[str, Any] = {"coverage": covered, "drift": drift, "evidence": made_of}
    facts = {name: json.dumps(value) for name, value in facts.items()}
    facts |= {"theories": " ".join(scatter.rms), "sets": " ".join(sets)}
    data = law_group(GROUP, arrays, {"law": constants}, facts)
    if path is not None:
        write_part(path, data, GROUP)
    return constants, data
