"""Constants of contacts with a hardness from capped boundary elements, and errors on surfaces that no fit saw."""

from __future__ import annotations

import dataclasses
import datetime
import functools
import json
import os
import pathlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from generate.boundary_elements.design import SPLITS, TRAINING
from generate.boundary_elements.evidence import GAUSSIAN, LEVELS, Capped, capped
from generate.calibrated_file import binned, fitted, made_by, variable, write_part
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws import hardness as cap
from mbma_tables.theories import calibrated_table, get_theory
from mbma_tables.theories.yielding import GROUP, Scatter, Yielding

LIGHTEST, HEAVIEST = 0.01, 0.97  # A/A0 that constants are fitted to
EDGES = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.95)  # contact fractions between which errors are told
BARS = {"area": 0.05, "yielded": 0.05, "force": np.log(1.25), "stiffness": np.log(1.25)}
QUANTITIES = ("area", "yielded", "force", "stiffness")  # as the file names them
LIBRARY = {"area": "area", "force": "pressure", "stiffness": "stiffness"}  # and as the library does
STATISTICS = ("bias", "standard_deviation", "share_within_bar", "largest", "number")
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
FOLDS = 5
REFERENCE = pathlib.Path(__file__).parents[1] / "docs" / "data" / "hardness.csv"  # another code's surfaces
WAVES = 3  # longest waves a side: with fewer h_max says little of the highest heights
MODULES = ("mbma_tables.laws.hardness", "generate.calibrated_file", "generate.calibrated_hardness")


def errors(one: Capped, part: str, constants: cap.Constants, share: int = 0) -> FloatArray:
    """Errors of a part where the elastic contact is the simulated one, so that its law's errors stay out."""
    if part == "area":
        return np.log(cap.area(one.force, one.elastic_area, one.eta, constants) / one.area)
    if part == "yielded":
        return (cap.yielded_area(one.force, one.elastic_area, one.eta, constants) - one.yielded) / one.area
    if part == "force":
        return np.log(cap.force(one.elastic[0], 0.0, one.shares[share], 0.0, one.eta, constants)[0] / one.force)
    if part == "stiffness":
        return np.log(one.elastic[1] * cap.frozen_factor(one.eta, constants) / one.frozen)
    return cap.plane_separation(one.u, one.force / one.eta, one.eta, constants) - one.planes


def between(one: Capped) -> Any:
    """Loads that constants are fitted to."""
    return (one.area > LIGHTEST) & (one.area < HEAVIEST)


def fit(seen: Sequence[Capped]) -> cap.Constants:
    """Constants from these surfaces, one part after the other."""

    def residuals(part: str, noise: float, trial: cap.Constants) -> list[FloatArray]:
        return [errors(one, part, trial)[between(one)] / noise for one in seen]

    found = cap.CONSTANTS
    for part, (own, noise) in PARTS.items():
        best = fitted(cap.CONSTANTS, own, functools.partial(residuals, part, noise), x_scale="jac")
        found = dataclasses.replace(found, **{name: float(f"{getattr(best, name):.{DIGITS}g}") for name in own})
    return found


def cross_validated(seen: Sequence[Capped]) -> list[cap.Constants]:
    """For each surface, constants from spectra other than its own."""
    order = sorted({one.node for one in seen})
    own: dict[tuple[float | str, ...], cap.Constants] = {}
    for fold in range(FOLDS):
        out = set(order[fold::FOLDS])
        own |= dict.fromkeys(out, fit([one for one in seen if one.node not in out]))
    return [own[one.node] for one in seen]


@functools.cache
def errors_of_law(one: Capped, form: str, constants: cap.Constants) -> dict[str, FloatArray]:
    """Of the whole law: ln of area and stiffness at equal force, ln of force at equal mean gap, the yielded share."""
    if form == ELASTIC:
        return {quantity: errors(one, quantity, constants, 1) for quantity in QUANTITIES}
    by_map = form == "calibrated_map"
    area = cap.area(one.force, one.elastic_areas[form], one.eta, constants)
    yielded = cap.yielded_area(one.force, one.elastic_areas[form], one.eta, constants)
    at_gap = one.map_curve.answer(one.u)[0] if by_map else one.by_law[0]
    force = cap.force(at_gap, 0.0, one.shares[0 if by_map else 1], 0.0, one.eta, constants)[0]
    return {
        "area": np.log(area / one.area),
        "yielded": yielded / area - one.yielded / one.area,
        "force": np.log(np.maximum(force, 1e-6 * one.force) / one.force),
        "stiffness": frozen_errors(one, one.curves[form], constants),
    }


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
def elastic_curve(node: tuple[float | str, ...], zeta_1: float, h_max: float, name: str) -> tuple[FloatArray, ...]:
    """Force, stiffness and Q of a theory at `LEVELS` of a self-affine surface."""
    surface, u = Surface(node[1], 1.0, zeta_1, 1.0, h_max), h_max * LEVELS[:-1]
    found, g = get_theory(name).answer(surface, u), float(surface.rms_gradient)
    return found.pressure / g, found.stiffness / g, get_theory(name).bearing_share(surface, u)[0]


def accuracy(groups: dict[str, list[Capped]], constants: cap.Constants) -> FloatArray:
    """Statistics by set, form and quantity from 1% to 95% contact."""
    table = np.full((len(groups), len(FORMS), len(QUANTITIES), len(STATISTICS)), np.nan)
    for row, own in enumerate(groups.values()):
        kept = np.concatenate([(one.area > LIGHTEST) & (one.area < EDGES[-1]) for one in own])
        for column, form in enumerate(FORMS):
            for k, quantity in enumerate(QUANTITIES):
                e = np.concatenate([errors_of_law(one, form, constants)[quantity] for one in own])[kept]
                size = np.abs(e)
                table[row, column, k] = e.mean(), e.std(), np.mean(size < BARS[quantity]), size.max(), e.size
    return table


def by_contact(
    seen: Sequence[Capped],
    values: Sequence[FloatArray],
    etas: Sequence[float],
    areas: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Root mean squares of values at simulated contacts, by hardness and contact fraction, the simulated if not given.

    NaN where there is none.
    """
    areas = [one.area for one in seen] if areas is None else areas
    rms = np.full((len(etas), len(EDGES) - 1), np.nan)
    for row, eta in enumerate(etas):
        own = [k for k, one in enumerate(seen) if one.eta == eta]
        parts = binned(np.concatenate([areas[k] for k in own]), np.concatenate([values[k] for k in own]), EDGES)
        rms[row] = [np.sqrt(np.mean(part**2)) if part.size else np.nan for part in parts]
    return rms


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
    told = {}
    for zeta_1 in sorted({one.zeta_1 for one in seen}):
        own = [one for one in seen if one.zeta_1 == zeta_1]
        means = [
            [
                np.concatenate([errors(one, q, constants)[between(one)] for one in own if one.eta == eta]).mean()
                for eta in sorted({one.eta for one in own})
            ]
            for q in QUANTITIES
        ]
        told[f"{zeta_1:g}"] = [float(max(row, key=abs)) for row in means]
    return told


def blind() -> dict[str, FloatArray]:
    """Errors of `contact` on surfaces of another code, which no fit or choice of a form saw."""
    with open(REFERENCE, encoding="utf-8") as stream:
        table = np.genfromtxt((line for line in stream if not line.startswith("#")), delimiter=",", names=True)
    own = table[np.isfinite(table["eta"]) & (table["area"] > LIGHTEST) & (table["area"] < EDGES[-1])]
    surface = Surface(own["hurst"], 1.0, own["zeta_1"], 1.0, own["h_max_over_h_rms"])
    g = surface.rms_gradient
    options: dict[str, Any] = {"theory": "calibrated", "hardness": own["eta"] * g}
    found = contact(surface, pressure=own["force"] * g, **options)
    closer = contact(surface, mean_separation=own["u_gap"], **options)
    return {
        "area": np.log(found.area / own["area"]),
        "yielded": np.asarray(found.yielded - own["area_yielded"] / own["area"]),
        "force": np.log(closer.pressure / (own["force"] * g)),
        "stiffness": np.log(found.incremental_stiffness / (own["kappa"] * g)),
    }


def told_errors(one: Capped, name: str, constants: cap.Constants) -> dict[str, FloatArray]:
    """Errors of a theory with a hardness on one surface, of force, area and frozen stiffness."""
    if name not in OTHERS:
        return errors_of_law(one, name, constants)
    surface = Surface(one.node[1], 1.0, one.zeta_1, 1.0, one.h_max)
    gradient, theory = float(surface.rms_gradient), get_theory(name)
    force, area = np.full(one.u.shape, np.nan), np.full(one.u.shape, np.nan)
    # what the theory reaches
    loads, low = one.force * gradient, np.asarray(theory.interval(surface)[0])
    held = (
        (one.u < one.h_max) & (one.area > EDGES[0]) & (loads < theory.answer(surface, np.maximum(low, LEAST)).pressure)
    )
    force[held] = Yielding(theory, one.eta * gradient).answer(surface, one.u[held]).pressure / gradient
    area[held] = cap.area(one.force[held], theory.area_at(surface, loads[held]), one.eta, constants)
    frozen = frozen_errors(one, elastic_curve(one.node, one.zeta_1, one.h_max, name), constants)
    return {"force": np.log(force / one.force), "area": np.log(area / one.area), "stiffness": frozen}


def coverage(seen: Sequence[Capped], constants: cap.Constants, scatter: Scatter) -> dict[str, list[float]]:
    """Shares of errors from 1% contact within one and two of the stated standard deviations, by theory and quantity."""
    told: dict[str, list[float]] = {}
    for name in (*FORMS, *OTHERS):
        own = [one for one in seen if name in FORMS or one.kind == "self_affine"]
        for quantity, named in LIBRARY.items():
            sizes = []
            for one in own:
                kept = (one.area > LIGHTEST) & (one.area < EDGES[-1])
                told_here = told_errors(one, name, constants)
                # of stiffness by the own area, as stated
                area = one.area * np.exp(told_here["area"]) if quantity == "stiffness" else one.area
                known = calibrated_table.shipped().standard_deviation(name, named, area)
                sigma = scatter.standard_deviation(name, named, np.array(one.eta), area, known)
                sizes.append((np.abs(told_here[quantity]) / sigma)[kept])
            size = np.concatenate(sizes)
            told[f"{name} {quantity}"] = [float(np.mean(size[np.isfinite(size)] < limit)) for limit in (1, 2)]
    return told


def stated(training: Sequence[Capped], constants: cap.Constants) -> Scatter:
    """Root mean squares of errors by constants from other spectra, and how much of an elastic error is passed on."""
    etas = sorted({one.eta for one in training})
    left_out = list(zip(training, cross_validated(training), strict=True))
    rms = {
        form: np.array(
            [
                by_contact(training, [errors_of_law(one, form, own)[q] for one, own in left_out], etas)
                for q in QUANTITIES
            ]
        )
        for form in (*FORMS, ELASTIC)
    }
    # what they lack is what the elastic theories' become
    alike = [pair for pair in left_out if pair[0].kind == "self_affine"]
    for name in OTHERS:
        found = [told_errors(one, name, own) for one, own in alike]
        # by the theory's own area, which is what a user has
        areas = [one.area * np.exp(e["area"]) for (one, _), e in zip(alike, found, strict=True)]
        rms[name] = np.full_like(rms[ELASTIC], np.nan)
        rms[name][QUANTITIES.index("stiffness")] = by_contact(
            [one for one, _ in alike], [e["stiffness"] for e in found], etas, areas
        )
    weights = {
        LIBRARY[q]: by_contact(training, [weight_of_elastic(one, q, constants) for one in training], etas)
        for q in ("area", "force")
    }
    return Scatter(np.array(etas), np.log(np.sqrt(np.multiply(EDGES[1:], EDGES[:-1]))), rms, weights)


def dataset(scatter: Scatter, told: FloatArray) -> xr.Dataset:
    """Variables of the library's file."""
    known = "statistics of ln(law/simulation), of the difference for the yielded share"
    stated = (
        "root mean square of ln(law/simulation) on the training set, by constants from other spectra; of the theory "
        "elastic with the simulated elastic contact; NaN: not measured"
    )
    passed_on = "root mean square of d ln(area, force) by d ln of the elastic one"
    rms, weights = np.array([*scatter.rms.values()]), np.array([*scatter.weight.values()])
    return xr.Dataset(
        {
            "accuracy": variable(("set", "form", "quantity", "statistic"), told, known),
            "stated_scatter": variable(("theory", "quantity", "hardness", "contact"), rms, stated),
            "elastic_weight": variable(("force_or_area", "hardness", "contact"), weights, passed_on),
            "eta": variable("hardness", scatter.eta, "p_m/(E* g)"),
            "contact": variable("contact", np.exp(scatter.log_area), "A/A0, middle of a bin"),
        }
    )


def write(evidence: xr.Dataset, path: os.PathLike[str] | str | None) -> tuple[cap.Constants, xr.Dataset]:
    """Fit, test, and write the group of the library's file."""
    found = capped(evidence)
    plain = [one for one in found if one.kind in GAUSSIAN]
    training = [one for one in plain if one.split == TRAINING]
    constants = fit(training)
    groups = {split: [one for one in plain if one.split == split] for split in SPLITS[:3]}
    groups["three_waves"] = [one for one in plain if one.split != TRAINING and one.waves >= WAVES]
    groups["stretched"] = [one for one in found if one.kind == "stretched"]
    groups = {name: own for name, own in groups.items() if own}
    scatter = stated(training, constants)
    covered = coverage([one for one in plain if one.split != TRAINING], constants, scatter)
    data = dataset(scatter, accuracy(groups, constants))
    data.attrs = {
        "title": "Contact with a hardness: constants of mbma_tables.laws.hardness, and errors against BEM",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate calibrated --hardness",
        "references": "docs/yield.md",
        "comment": f"accuracy: contacts from {LIGHTEST:g} to {EDGES[-1]:g}; bars {json.dumps(BARS)}. area, yielded "
        "and stiffness of the frozen contact at equal force, force at equal mean gap",
        "theories": " ".join(scatter.rms),
        "coverage": json.dumps(covered),
        "drift": json.dumps(by_magnification([one for one in plain if one.kind == "self_affine"], constants)),
        "quantities": " ".join(QUANTITIES),
        "statistics": " ".join(STATISTICS),
        "sets": " ".join(groups),
        **{f"law_{name}": value for name, value in dataclasses.asdict(constants).items()},
        "evidence": json.dumps({"code_sha256": evidence.attrs.get("code_sha256", ""), "contacts": len(found)}),
        **made_by(MODULES),
    }
    if path is not None:
        write_part(path, data, GROUP)
    return constants, data
