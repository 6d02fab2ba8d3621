"""Constants of contacts with a hardness from capped boundary elements, and errors on surfaces that no fit saw."""

from __future__ import annotations

import dataclasses
import datetime
import functools
import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares
from scipy.special import erf, erfinv

from generate.boundary_elements.design import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, SPLITS, TRAINING
from generate.boundary_elements.evidence import GAUSSIAN
from generate.calibrated_file import write_part
from mbma_tables import hardness as cap
from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Law, Spectrum
from mbma_tables.calibrated_map import MapLaw
from mbma_tables.tablefiles.provenance import source_digest, versions
from mbma_tables.theories.calibrated_curves import Curve
from mbma_tables.theories.hardness_table import GROUP, QUANTITIES

LIGHTEST, HEAVIEST = 0.01, 0.97  # A/A0 that constants are fitted to
EDGES = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.95)  # contact fractions between which errors are told
BARS = {"area": 0.05, "yielded": 0.05, "force": np.log(1.25), "stiffness": np.log(1.25)}
STATISTICS = ("bias", "standard_deviation", "share_within_bar", "largest", "number")
NOISE = {"area": 0.015, "yielded": 0.03, "force": 0.03, "frozen": 0.05, "planes": 0.02}  # errors that count alike
DIGITS = 4
LEVELS = np.geomspace(1e-5, 1.0, 400)  # u/h_max of a law's curve
FORMS = {"calibrated": "h_max", "calibrated_map": "heights"}
MODULES = ("mbma_tables.hardness", "generate.calibrated_hardness")


@dataclasses.dataclass(frozen=True, eq=False)
class Capped:
    """One surface at one hardness: what was found, and the elastic contact of the same surface, simulated and by laws.

    Loads are in rows as simulated; `elastic` has the surface's forces, areas, mean gaps and stiffnesses if elastic.
    """

    kind: str
    split: str
    eta: float
    h_max: float
    law: Law
    map_curve: Curve
    heights: cap.BearingCurve
    force: FloatArray
    area: FloatArray
    yielded: FloatArray
    u: FloatArray
    planes: FloatArray
    frozen: FloatArray
    elastic: dict[str, FloatArray]

    def elastic_area(self) -> FloatArray:
        """Simulated, at these forces."""
        known = PchipInterpolator(np.log(self.elastic["force"]), np.log(erfinv(self.elastic["area"])))
        return np.asarray(erf(np.exp(known(np.log(self.force)))))

    def elastic_at_gap(self, name: str, beyond: FloatArray, end: float) -> FloatArray:
        """Simulated force or stiffness at these gaps; by the law, fitted at its end, where not pressed so far."""
        u = self.elastic["mean_separation"]
        known = PchipInterpolator(u[::-1], np.log(self.elastic[name][::-1]))
        inside = self.u > u[-1]
        return np.asarray(
            np.where(inside, np.exp(known(np.maximum(self.u, u[-1]))), beyond * self.elastic[name][-1] / end)
        )


def read(data: xr.Dataset) -> list[Capped]:
    """Surfaces of a file by `python -m generate boundary_elements --hardness`, refinements left out."""
    kinds, found = data.kind.attrs["flag_meanings"].split(), []
    names = ("force", "area", "area_yielded", "mean_separation", "plane_separation", "frozen_stiffness")
    for number in range(data.sizes["surface"]):
        one = data.isel(surface=number)
        if (split := SPLITS[int(one.split)]) not in (TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM):
            continue
        kind, h_max = kinds[int(one.kind)], float(one.h_max)
        curves: dict[str, Any] = {
            n: one[n].values.astype(float) for n in ("mean_height", "top_gradient", "tension_force", "tension")
        }
        share, x = one.band_variance.values, one.band_q.values
        held = share > 0
        own = Spectrum.from_shares(x[held], share[held])
        map_curve = Curve(MapLaw(own, **curves, anisotropy=float(one.anisotropy)), h_max)
        spectrum = Spectrum.self_affine(float(one.hurst), float(one.zeta_1)) if kind == "self_affine" else own
        heights = cap.BearingCurve(curves["mean_height"], h_max)
        rows = {name: one[name].values.astype(float) for name in names}
        elastic = {name: values[-1] for name, values in rows.items()}
        law = Law(spectrum, h_max)
        for row, eta in enumerate(data.eta.values[:-1]):
            loads = (rows[name][row] for name in names)
            parts: list[Any] = [kind, split, float(eta), h_max, law, map_curve, heights, *loads, elastic]
            found.append(Capped(*parts))
    return found


def fit(seen: Sequence[Capped]) -> cap.Constants:
    """Constants from the training set; the elastic contact is the simulated one, so that its law's errors stay out."""
    start = cap.CONSTANTS
    kept = [(one.area > LIGHTEST) & (one.area < HEAVIEST) for one in seen]
    elastic_areas = [one.elastic_area() for one in seen]
    forces, frozen, shares = [], [], []
    for one in seen:
        end = one.elastic["mean_separation"][-1:]
        values, ends = one.law.force_and_stiffness(one.u), one.law.force_and_stiffness(end)
        forces.append(one.elastic_at_gap("force", values[0], float(ends[0][0])))
        frozen.append(one.elastic_at_gap("frozen_stiffness", values[1], float(ends[1][0])))
        shares.append(one.heights(one.u)[0])

    def errors(what: str, constants: cap.Constants, k: int) -> FloatArray:
        one = seen[k]
        if what == "area":
            return np.log(cap.area(one.force, elastic_areas[k], one.eta, constants) / one.area)
        if what == "yielded":
            return (cap.yielded_area(one.force, elastic_areas[k], one.eta, constants) - one.yielded) / one.area
        if what == "force":
            return np.log(cap.force(forces[k], 0.0, shares[k], 0.0, one.eta, constants)[0] / one.force)
        if what == "frozen":
            return np.log(frozen[k] * cap.frozen_factor(one.eta, constants) / one.frozen)
        return cap.plane_separation(one.u, one.force / one.eta, one.eta, constants) - one.planes

    names = {
        "area": ("area_power", "area_scale"),
        "yielded": ("yield_power", "yield_scale"),
        "force": ("force_light", "force_eta", "force_share"),
        "frozen": ("frozen", "frozen_eta"),
        "planes": ("plane_eta", "plane_load"),
    }
    found: dict[str, float] = {}
    for what, own in names.items():

        def residuals(values: FloatArray, what: str = what, own: tuple[str, ...] = own) -> FloatArray:
            trial = dataclasses.replace(start, **dict(zip(own, map(float, values), strict=True)))
            return np.concatenate([errors(what, trial, k)[kept[k]] / NOISE[what] for k in range(len(seen))])

        best = least_squares(residuals, [getattr(start, name) for name in own], loss="soft_l1", x_scale="jac")
        found |= {name: float(f"{value:.{DIGITS}g}") for name, value in zip(own, best.x, strict=True)}
    return dataclasses.replace(start, **found)


@functools.cache
def errors_of_law(one: Capped, form: str, constants: cap.Constants) -> dict[str, FloatArray]:
    """Of the whole law: ln of area and stiffness at equal force, ln of force at equal mean gap, the yielded share."""
    by_map = form == "calibrated_map"

    def parts(u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force with the hardness, and the elastic stiffness."""
        if by_map:
            force, _, stiffness = one.map_curve.answer(u)
            share = one.heights(u)[0]
        else:
            force, stiffness = one.law.force_and_stiffness(u)
            share = cap.bearing_share(u, one.h_max)[0]
        return cap.force(force, 0.0, share, 0.0, one.eta, constants)[0], stiffness

    elastic = one.map_curve.area(one.force) if by_map else one.law.area(one.force)
    area = cap.area(one.force, elastic, one.eta, constants)
    yielded = cap.yielded_area(one.force, elastic, one.eta, constants)
    force = parts(one.u)[0]
    # from pressure to the gap to the stiffness, on the law's own curve
    endless, steep = parts(one.h_max * LEVELS[:-1])
    curve = np.log(np.maximum(endless, 1e-30))
    frozen = np.log(np.maximum(steep * cap.frozen_factor(one.eta, constants), 1e-30))
    at = np.interp(-np.log(one.force), -curve, frozen)
    return {
        "area": np.log(area / one.area),
        "yielded": yielded / area - one.yielded / one.area,
        "force": np.log(np.maximum(force, 1e-6 * one.force) / one.force),
        "stiffness": at - np.log(one.frozen),
    }


def accuracy(groups: dict[str, list[Capped]], constants: cap.Constants) -> FloatArray:
    """Statistics by set, form and quantity from 1% to 95% contact."""
    table = np.full((len(groups), len(FORMS), len(QUANTITIES), len(STATISTICS)), np.nan)
    for row, own in enumerate(groups.values()):
        for column, form in enumerate(FORMS):
            told = [errors_of_law(one, form, constants) for one in own]
            kept = [(one.area > LIGHTEST) & (one.area < EDGES[-1]) for one in own]
            for k, quantity in enumerate(QUANTITIES):
                e = np.concatenate([part[quantity][mask] for part, mask in zip(told, kept, strict=True)])
                size = np.abs(e)
                table[row, column, k] = e.mean(), e.std(), np.mean(size < BARS[quantity]), size.max(), e.size
    return table


def stated(seen: Sequence[Capped], constants: cap.Constants, etas: Sequence[float]) -> FloatArray:
    """Root mean squares by form, quantity, hardness and contact."""
    rms = np.full((len(FORMS), len(QUANTITIES), len(etas), len(EDGES) - 1), np.nan)
    for row, form in enumerate(FORMS):
        for column, eta in enumerate(etas):
            own = [one for one in seen if one.eta == eta]
            told = [errors_of_law(one, form, constants) for one in own]
            bins = np.digitize(np.concatenate([one.area for one in own]), EDGES) - 1
            for k, quantity in enumerate(QUANTITIES):
                e = np.concatenate([part[quantity] for part in told])
                rms[row, k, column] = [np.sqrt(np.mean(e[bins == b] ** 2)) for b in range(len(EDGES) - 1)]
    return rms


def write(evidence: xr.Dataset, path: os.PathLike[str] | str | None) -> tuple[cap.Constants, xr.Dataset]:
    """Fit, test, and write the group of the library's file."""
    found = read(evidence)
    plain = [one for one in found if one.kind in GAUSSIAN]
    training = [one for one in plain if one.split == TRAINING]
    constants = fit(training)
    groups = {split: [one for one in plain if one.split == split] for split in SPLITS[:3]}
    groups["stretched"] = [one for one in found if one.kind == "stretched"]
    groups = {name: own for name, own in groups.items() if own}
    etas = sorted({one.eta for one in found})
    unit = {"units": "1"}
    told = accuracy(groups, constants)
    data = xr.Dataset(
        {
            "accuracy": (
                ("set", "form", "quantity", "statistic"),
                told,
                {"long_name": "statistics of ln(law/simulation), of the difference for the yielded share", **unit},
            ),
            "stated_scatter": (
                ("form", "quantity", "hardness", "contact"),
                stated(training, constants, etas),
                {"long_name": "root mean square of ln(law/simulation) on the training set", **unit},
            ),
            "eta": ("hardness", etas, {"long_name": "p_m/(E* g)", **unit}),
            "contact": (
                "contact",
                np.sqrt(np.multiply(EDGES[1:], EDGES[:-1])),
                {"long_name": "A/A0, middle of a bin", **unit},
            ),
        },
        attrs={
            "title": "Contact with a hardness: constants of mbma_tables.hardness, and errors against boundary elements",
            "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate calibrated --hardness",
            "references": "docs/yield.md",
            "comment": f"accuracy: contacts from {LIGHTEST:g} to {EDGES[-1]:g}; bars {json.dumps(BARS)}. area, yielded "
            "and stiffness of the frozen contact at equal force, force at equal mean gap",
            "theories": " ".join(FORMS),
            "quantities": " ".join(QUANTITIES),
            "statistics": " ".join(STATISTICS),
            "sets": " ".join(groups),
            **{f"law_{name}": value for name, value in dataclasses.asdict(constants).items()},
            "evidence": json.dumps({"code_sha256": evidence.attrs.get("code_sha256", ""), "contacts": len(found)}),
            "versions": json.dumps(versions(), sort_keys=True),
            "source_sha256": source_digest(MODULES),
            "source_modules": " ".join(MODULES),
        },
    )
    if path is not None:
        write_part(path, data, GROUP)
    return constants, data


def lines(constants: cap.Constants, data: xr.Dataset) -> list[str]:
    """What was found, to print."""
    told: list[str] = [", ".join(f"{name} {value:.4g}" for name, value in dataclasses.asdict(constants).items())]
    numbers: Any = data.accuracy.values
    for row, name in enumerate(data.attrs["sets"].split()):
        for column, form in enumerate(FORMS.values()):
            for k, quantity in enumerate(QUANTITIES):
                bias, spread, share, largest, count = numbers[row, column, k]
                told.append(
                    f"  {name:18s} {form:8s} {quantity:9s} {bias:+.3f} ± {spread:.3f}, {share:.1%} of {count:.0f} "
                    f"within {BARS[quantity]:.2f}, largest {largest:.2f}"
                )
    return told
