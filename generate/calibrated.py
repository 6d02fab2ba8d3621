"""``python -m generate calibrated``: the calibrated law's constants, from the training set and no other surface."""

from __future__ import annotations

import dataclasses
import functools
import json
import pathlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import click
import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from generate.boundary_elements.design import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, SPLITS, TRAINING
from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import CONSTANTS, MEAN_WAVE, Constants, Law, Spectrum, area
from mbma_tables.calibrated_map import MAP_CONSTANTS, MapConstants, MapLaw

GAUSSIAN = ("self_affine", "plateau", "filtered")
EDGES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9, 0.98)  # contact fractions between which errors are told
FOLDS = 5
MIN_WAVES = 2  # constants see no surface of one longest wave a side
WEIGHT_AREA = 0.03  # W is fitted above this contact, the tail below TAIL_AREA
TAIL_AREA = 0.1
# errors that count alike: model noise plus the scatter of surfaces at light contact
NOISE = {"area": (0.015, 0.15), "tail": (0.05, 0.25), "map": (0.03, 0.1)}
LIGHT = 0.01
STEP = 0.01  # relative, of numerical derivatives: laws of maps are interpolated


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """One simulated surface: what laws may know of it, and what was found."""

    kind: str
    split: str
    node: tuple[float | str, ...]
    waves: int
    spectrum: Spectrum
    own_spectrum: Spectrum
    h_max: float
    curves: dict[str, Any]
    force: FloatArray
    area: FloatArray
    u: FloatArray

    @property
    def gaussian(self) -> bool:
        """Whether constants of the spectrum's law are fitted to surfaces like it."""
        return self.kind in GAUSSIAN and self.waves >= MIN_WAVES

    def law(self, constants: Constants) -> Law:
        """The spectrum's law with h_max."""
        return Law(self.spectrum, self.h_max, constants)

    def map_law(self, constants: Constants, map_constants: MapConstants) -> MapLaw:
        """The map's law."""
        return MapLaw(self.own_spectrum, **self.curves, constants=constants, map_constants=map_constants)

    def noise(self, name: str) -> FloatArray:
        """Errors of ln F or ln A that count as one."""
        floor, scatter = NOISE[name]
        return floor + scatter * np.exp(-self.area / LIGHT)


def cases(data: xr.Dataset) -> list[Case]:
    """Surfaces of a file by `python -m generate boundary_elements`, refinements left out."""
    kinds = data.kind.attrs["flag_meanings"].split()
    found = []
    for number in range(data.sizes["surface"]):
        one = data.isel(surface=number)
        if (split := SPLITS[int(one.split)]) not in (TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM):
            continue
        kind, hurst, zeta_1 = kinds[int(one.kind)], float(one.hurst), float(one.zeta_1)
        share, x = one.band_variance.values, one.band_q.values
        plain = kind == "self_affine"
        seen = np.isfinite(one.force.values) & (one.area.values > 0) & (one.area.values < EDGES[-1])
        curves: dict[str, Any] = {
            name: one[name].values.astype(float) for name in ("mean_height", "top_gradient", "tension_force", "tension")
        }
        curves |= {
            "inverse_q2": float(np.nansum(share * one.band_inverse_q2.values)),
            "anisotropy": float(one.anisotropy),
        }
        own_spectrum = Spectrum.from_shares(x[share > 0], share[share > 0])
        found.append(
            Case(
                kind,
                split,
                (kind, hurst, zeta_1, int(one.waves), float(one["shape"])),
                int(one.waves),
                Spectrum.self_affine(hurst, zeta_1) if plain else own_spectrum,
                own_spectrum,
                float(one.h_max),
                curves,
                *(one[name].values[seen] for name in ("force", "area", "mean_separation")),
            )
        )
    return found


def _solve(residuals: Callable[[FloatArray], FloatArray], start: Iterable[float]) -> FloatArray:
    """Robust least squares."""
    return np.asarray(least_squares(residuals, list(start), loss="soft_l1", x_scale="jac", diff_step=STEP).x)


def fit_area(seen: Sequence[Case], constants: Constants) -> Constants:
    """s0, its slope and t0 of the area."""

    def trial(values: FloatArray) -> Constants:
        return dataclasses.replace(constants, area_s0=values[0], area_slope=values[1], area_t0=values[2])

    def residuals(values: FloatArray) -> FloatArray:
        c = trial(values)
        return np.concatenate(
            [np.log(area(one.force, one.spectrum.alpha, c) / one.area) / one.noise("area") for one in seen]
        )

    return trial(_solve(residuals, (constants.area_s0, constants.area_slope, constants.area_t0)))


def fit_weight(seen: Sequence[Case], constants: Constants) -> Constants:
    """a, its slope and b of W: u is linear in them; errors of u count as the errors of ln F that they are."""
    rows, aims = [], []
    for one in seen:
        kept = one.area > WEIGHT_AREA
        scale = -one.u * np.gradient(np.log(one.u), np.log(one.force))
        pure = [
            Law(
                one.spectrum, None, dataclasses.replace(constants, weight=a, cubic=b, weight_slope=0.0)
            ).separation_persson(one.force)[0]
            for a, b in ((1.0, 0.0), (0.0, 1.0), (0.0, 0.0))
        ]
        linear = pure[0] - pure[2]
        columns = [linear, pure[1] - pure[2], linear * (one.spectrum.mean_wave - MEAN_WAVE)]
        rows.append(np.stack([(column / scale)[kept] for column in columns], axis=1))
        aims.append(((one.u - pure[2]) / scale)[kept])
    a, b, slope = np.linalg.lstsq(np.concatenate(rows), np.concatenate(aims), rcond=None)[0]
    return dataclasses.replace(constants, weight=float(a), cubic=float(b), weight_slope=float(slope))


def fit_tail(seen: Sequence[Case], constants: Constants) -> Constants:
    """c, its slope and u0 of the Gaussian tail factor, with F = F_G(u) - F_G(h_max)."""
    endless = dataclasses.replace(constants, tail=0.0, tail_slope=0.0)
    known = []
    for one in seen:
        kept = one.area < TAIL_AREA
        law = Law(one.spectrum, None, endless)
        gaussian = law.gaussian(np.append(one.u[kept], one.h_max))[0]
        known.append((one, kept, gaussian[:-1], gaussian[-1], one.spectrum.mean_wave - MEAN_WAVE))

    def residuals(values: FloatArray) -> FloatArray:
        c, slope, onset = values
        parts = []
        for one, kept, at_u, at_end, wave in known:
            tail = c + slope * wave
            here = at_u - tail * np.maximum(one.u[kept] - onset, 0) ** 2
            end = at_end - tail * max(one.h_max - onset, 0) ** 2
            force = here + np.log(-np.expm1(np.minimum(end - here, -1e-9)))
            parts.append((force - np.log(one.force[kept])) / one.noise("tail")[kept])
        return np.concatenate(parts)

    c, slope, onset = map(float, _solve(residuals, (constants.tail, constants.tail_slope, constants.onset)))
    return dataclasses.replace(constants, tail=c, tail_slope=slope, onset=onset)


def fit(training: Sequence[Case]) -> Constants:
    """The spectrum's law."""
    seen = [one for one in training if one.gaussian]
    return fit_tail(seen, fit_weight(seen, fit_area(seen, CONSTANTS)))


def fit_map(training: Sequence[Case], constants: Constants) -> MapConstants:
    """The map's law: area of stretched surfaces, then force at equal u of all kinds."""
    stretched = [one for one in training if one.kind == "stretched"]

    def areas(values: FloatArray) -> FloatArray:
        own = dataclasses.replace(MAP_CONSTANTS, elliptic=values[0])
        found = [np.log(one.map_law(constants, own).area(one.force) / one.area) / one.noise("map") for one in stretched]
        return np.concatenate(found)

    (elliptic,) = _solve(areas, [MAP_CONSTANTS.elliptic])

    def trial(values: FloatArray) -> MapConstants:
        breadth, onset, gaussian_area, valley_area, merging_area = map(float, values)
        return MapConstants(breadth, onset, gaussian_area, valley_area, merging_area, float(elliptic))

    def forces(values: FloatArray) -> FloatArray:
        own = trial(values)
        return np.concatenate(
            [errors(one, one.map_law(constants, own))["force"] / one.noise("map") for one in training if one.waves > 1]
        )

    start = dataclasses.astuple(MAP_CONSTANTS)[:-1]
    return trial(_solve(forces, start))


def errors(one: Case, law: Law | MapLaw, stiffness: bool = False) -> dict[str, FloatArray]:
    """ln of law over simulation: area at equal force, force at equal u, stiffness at equal force."""
    log_force = np.log(one.force)
    found = {
        "area": np.log(law.area(one.force) / one.area),
        "force": np.log(np.maximum(law.force(one.u), 1e-6 * one.force)) - log_force,
    }
    if stiffness:
        # both by one spline through the simulated loads, so that its error cancels
        gaps: list[FloatArray] = [law.separation(one.force), one.u]
        slopes: list[FloatArray] = [gap * CubicSpline(log_force, np.log(gap)).derivative()(log_force) for gap in gaps]
        found["stiffness"] = np.log(slopes[1] / slopes[0])
    return found


def summary(seen: Sequence[Case], make: Callable[[Case], Law | MapLaw]) -> dict[str, list[list[float]]]:
    """By contact fraction: mean, standard deviation, 90% quantile of the magnitude and number of errors."""
    contact = np.concatenate([one.area for one in seen])
    each = [errors(one, make(one), stiffness=True) for one in seen]
    bins = np.digitize(contact, EDGES) - 1
    told = {}
    for name in each[0]:
        values = np.concatenate([one[name] for one in each])
        parts = [values[(bins == k) & np.isfinite(values)] for k in range(len(EDGES) - 1)]
        told[name] = [
            [float(p.mean()), float(p.std()), float(np.quantile(np.abs(p), 0.9)), len(p)] if len(p) else []
            for p in parts
        ]
    return told


def cross_validate(training: Sequence[Case]) -> dict[str, Any]:
    """Constants without a fifth of the spectra at a time, and the errors of the spectra left out."""
    seen = [one for one in training if one.gaussian]
    order = sorted({one.node for one in seen})
    fits, left = [], []
    for fold in range(FOLDS):
        out = set(order[fold::FOLDS])
        own = fit([one for one in seen if one.node not in out])
        fits.append(list(dataclasses.astuple(own)))
        left += [(one, own) for one in seen if one.node in out]
    constants = {id(one): own for one, own in left}
    told = summary([one for one, _ in left], lambda one: one.law(constants[id(one)]))
    names = [field.name for field in dataclasses.fields(Constants)]
    return {"spread": dict(zip(names, np.std(fits, axis=0).tolist(), strict=True)), "errors": told}


def report(evidence: Sequence[Case], constants: Constants, map_constants: MapConstants) -> dict[str, Any]:
    """Errors by set of surfaces and by form of the law."""
    forms: dict[str, Callable[[Case], Law | MapLaw]] = {
        "spectrum": lambda one: one.law(constants),
        "map": lambda one: one.map_law(constants, map_constants),
    }
    groups: dict[str, Callable[[Case], bool]] = {
        "1 wave": lambda one: one.kind in GAUSSIAN and one.waves < MIN_WAVES,
        "2-3 waves": lambda one: one.gaussian and one.waves < 4,
        "4 waves": lambda one: one.gaussian and one.waves >= 4,
        "stretched": lambda one: one.kind == "stretched",
        "transformed": lambda one: one.kind not in (*GAUSSIAN, "stretched"),
    }
    sets = {
        f"{split}, {label}": [one for one in evidence if one.split == split and member(one)]
        for split in (TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM)
        for label, member in groups.items()
    }
    return {name: {form: summary(own, make) for form, make in forms.items()} for name, own in sets.items() if own}


@click.command()
@click.argument("evidence", type=click.Path(path_type=pathlib.Path, exists=True))
@click.option("--out", type=click.Path(path_type=pathlib.Path), help="JSON file of constants and errors.")
@click.option("--maps/--no-maps", default=True, help="Whether to fit the map's law too: minutes.")
def calibrated(evidence: pathlib.Path, out: pathlib.Path | None, maps: bool) -> None:
    """Fit the calibrated law to the training set of EVIDENCE; tell its errors there and on held-out surfaces."""
    with xr.open_dataset(evidence) as data:
        found = cases(data.load())
        source = data.attrs.get("code_sha256", "")
    training = [one for one in found if one.split == TRAINING]
    constants = fit(training)
    map_constants = fit_map(training, constants) if maps else MAP_CONSTANTS
    told: dict[str, Any] = {
        "constants": dataclasses.asdict(constants),
        "map_constants": dataclasses.asdict(map_constants),
        "cross_validation": cross_validate(training),
        "contact_edges": EDGES,
        "errors": report(found, constants, map_constants),
        "evidence": {"code_sha256": source, "training": len(training), "surfaces": len(found)},
    }
    for name in ("constants", "map_constants"):
        click.echo(f"{name}: " + ", ".join(f"{k} {v:.4g}" for k, v in told[name].items()))
    show = functools.partial(_show, told["errors"])
    for quantity in ("area", "force", "stiffness"):
        show(quantity)
    if out is not None:
        out.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def _show(told: dict[str, Any], quantity: str) -> None:
    click.echo(f"{quantity}: mean and standard deviation of ln(law/simulation) [%] between contacts {EDGES}")
    for name, forms in told.items():
        for form, values in forms.items():
            cells = [f"{100 * p[0]:+4.0f}±{100 * p[1]:<3.0f}" if p else "    -   " for p in values[quantity]]
            click.echo(f"  {name:32s} {form:9s} " + " ".join(cells))
