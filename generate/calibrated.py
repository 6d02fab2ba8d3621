"""``python -m generate calibrated``: the calibrated law's constants, from the training set and no other surface."""

from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import click
import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from generate import calibrated_hardness
from generate.boundary_elements.design import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, TRAINING
from generate.boundary_elements.evidence import GAUSSIAN, MAX_AREA, MIN_WAVES, Case, cases
from generate.calibrated_bars import measure
from generate.calibrated_file import QUANTITIES, binned, fitted
from generate.calibrated_table import write as write_table
from generate.leakage_law import write as write_leakage
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.calibrated import CONSTANTS, Constants, Law, Spectrum
from mbma_tables.laws.map_curves import MAP_CONSTANTS, MapConstants, MapLaw

EDGES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9, MAX_AREA)  # contact fractions between which errors are told
FOLDS = 5
DIGITS = 4  # of constants
GRID = np.linspace(-21.0, 1.6, 227)[::-1]  # ln F of curves while they are fitted
LEAST = 1e-6  # ratio of forces that a law above its h_max counts as
# errors that count alike: model noise plus the scatter of surfaces at light contact
NOISE = {"area": (0.015, 0.15), "force": (0.02, 0.25), "map": (0.03, 0.1)}
LIGHT = 0.01
CLOSE = 1e-4  # relative changes of cost or constants that end a fit
STEP = 0.01  # relative, of numerical derivatives: laws of maps are interpolated


OPTIONS = {"x_scale": "jac", "diff_step": STEP, "ftol": CLOSE, "xtol": CLOSE}


def _rounded(constants: Any) -> Any:
    """Constants of so many digits as the library carries."""
    return type(constants)(*(float(f"{value:.{DIGITS}g}") for value in dataclasses.astuple(constants)))


def noise(one: Case, name: str) -> FloatArray:
    """Errors of ln F or ln A that count as one."""
    floor, scatter = NOISE[name]
    return np.asarray(floor + scatter * np.exp(-one.area / LIGHT))


@dataclasses.dataclass(frozen=True, eq=False)
class Parts:
    """u_P of a spectrum, which is linear in the coefficients of W, on a grid of ln F."""

    spectrum: Spectrum
    plain: FloatArray
    first: FloatArray
    cubic: FloatArray

    @classmethod
    def of(cls, spectrum: Spectrum) -> Parts:
        """The parts of P^16, and what P and P^3 add in its place."""
        plain, first, cubic = (
            Law(spectrum, None, dataclasses.replace(CONSTANTS, weight=a, cubic=b, weight_slope=0.0)).separation_persson(
                np.exp(GRID)
            )[0]
            for a, b in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
        )
        return cls(spectrum, plain, first - plain, cubic - plain)

    def errors(self, one: Case, trial: Constants) -> FloatArray:
        """Errors of ln F at equal u, as `errors` has them, without the law's own quadrature for every trial."""
        law = Law(self.spectrum, None, trial)
        a, b, _ = law.coefficients
        u = self.plain + a * self.first + b * self.cubic
        curve = CubicSpline(np.log(u), GRID - law.tail * u**3)
        found, end = curve(np.log(one.u)), float(curve(np.log(one.h_max)))
        return np.asarray(found + np.log(np.maximum(-np.expm1(end - found), LEAST)) - np.log(one.force))


def fit(training: Sequence[Case]) -> Constants:
    """The spectrum's law: area at equal force, then force at equal u."""
    seen = [one for one in training if one.gaussian]
    parts = [Parts.of(one.spectrum) for one in seen]

    def areas(trial: Constants) -> list[FloatArray]:
        return [errors(one, one.law(trial), "area") / noise(one, "area") for one in seen]

    def forces(trial: Constants) -> list[FloatArray]:
        return [part.errors(one, trial) / noise(one, "force") for one, part in zip(seen, parts, strict=True)]

    constants = fitted(CONSTANTS, ("area_s0", "area_slope", "area_t0"), areas, **OPTIONS)
    return fitted(constants, ("weight", "weight_slope", "cubic", "tail"), forces, **OPTIONS)


def fit_map(training: Sequence[Case], constants: Constants) -> MapConstants:
    """The map's law: area of stretched surfaces, then force at equal u of all kinds."""

    def areas(trial: MapConstants) -> list[FloatArray]:
        seen = [one for one in training if one.kind == "stretched"]
        return [errors(one, one.map_law(constants, trial), "area") / noise(one, "map") for one in seen]

    def forces(trial: MapConstants) -> list[FloatArray]:
        seen = [one for one in training if one.waves >= MIN_WAVES]
        return [errors(one, one.map_law(constants, trial), "force") / noise(one, "map") for one in seen]

    names = [name for name in dataclasses.asdict(MAP_CONSTANTS) if name not in ("elliptic", "tension_area")]
    return fitted(fitted(MAP_CONSTANTS, ("elliptic",), areas, **OPTIONS), names, forces, **OPTIONS)


def errors(one: Case, law: Law | MapLaw, quantity: str) -> FloatArray:
    """ln of law over simulation: "area" at equal force, "force" at equal u, "stiffness" at equal force."""
    log_force = np.log(one.force)
    if quantity == "area":
        return np.asarray(np.log(law.area(one.force) / one.area))
    if quantity == "force":
        return np.asarray(np.log(np.maximum(law.force(one.u), LEAST * one.force)) - log_force)
    # both by one spline through the simulated loads, so that its error cancels
    gaps: list[FloatArray] = [law.separation(one.force), one.u]
    slopes: list[FloatArray] = [gap * CubicSpline(log_force, np.log(gap)).derivative()(log_force) for gap in gaps]
    with np.errstate(invalid="ignore"):
        return np.asarray(np.log(slopes[1] / slopes[0]))


def summary(seen: Sequence[Case], make: Callable[[Case], Law | MapLaw]) -> dict[str, list[list[float]]]:
    """By contact fraction: mean, standard deviation, 90% quantile of the magnitude and number of errors."""
    area = np.concatenate([one.area for one in seen])
    told, laws = {}, [make(one) for one in seen]
    for quantity in QUANTITIES:
        values = np.concatenate([errors(one, law, quantity) for one, law in zip(seen, laws, strict=True)])
        told[quantity] = [
            [float(p.mean()), float(p.std()), float(np.quantile(np.abs(p), 0.9)), len(p)] if len(p) else []
            for p in binned(area, values, EDGES)
        ]
    return told


def cross_validate(training: Sequence[Case]) -> dict[str, list[list[float]]]:
    """Errors on spectra that were left out, a fifth of them at a time."""
    seen = [one for one in training if one.gaussian]
    order = sorted({one.node for one in seen})
    own: dict[tuple[float | str, ...], Constants] = {}
    for fold in range(FOLDS):
        out = set(order[fold::FOLDS])
        own |= dict.fromkeys(out, fit([one for one in seen if one.node not in out]))
    return summary(seen, lambda one: one.law(own[one.node]))


def coverage(
    seen: Sequence[Case], make: Callable[[Case], Law | MapLaw], stated: dict[str, Any]
) -> dict[str, list[float]]:
    """Shares of held-out errors within one and two of the stated root mean squares."""
    middles = np.log(np.sqrt(np.multiply(EDGES[1:], EDGES[:-1])))
    told, laws = {}, [make(one) for one in seen]
    for quantity in QUANTITIES:
        log_sigma = np.log([np.hypot(*part[:2]) for part in stated[quantity]])
        sizes = np.concatenate(
            [
                np.abs(errors(one, law, quantity)) / np.exp(np.interp(np.log(one.area), middles, log_sigma))
                for one, law in zip(seen, laws, strict=True)
            ]
        )
        told[quantity] = [float(np.mean(sizes < limit)) for limit in (1, 2)]
    return told


def report(evidence: Sequence[Case], forms: dict[str, Callable[[Case], Law | MapLaw]]) -> dict[str, Any]:
    """Errors by set of surfaces and by form of the law."""
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
@click.option("--table", type=click.Path(path_type=pathlib.Path), help="The library's file: table and errors.")
@click.option("--hardness", is_flag=True, help="EVIDENCE has capped pressures: fit what a hardness adds.")
def calibrated(evidence: pathlib.Path, table: pathlib.Path | None, hardness: bool) -> None:
    """Fit the calibrated law to the training set of EVIDENCE; its errors there and elsewhere go into the table."""
    if hardness:
        with xr.open_dataset(evidence) as data:
            of_hardness, written = calibrated_hardness.write(data.load(), table)
        click.echo(
            f"{of_hardness}\nheld-out errors within one and two standard deviations: {written.attrs['coverage']}"
        )
        return
    with xr.open_dataset(evidence) as data:
        found = cases(data.load())
        source = data.attrs.get("code_sha256", "")
    training = [one for one in found if one.split == TRAINING]
    constants = _rounded(fit(training))
    map_constants = _rounded(fit_map(training, constants))
    checked = cross_validate(training)
    forms: dict[str, Callable[[Case], Law | MapLaw]] = {
        "spectrum": lambda one: one.law(constants),
        "map": lambda one: one.map_law(constants, map_constants),
    }
    by_map = summary([one for one in training if one.gaussian], forms["map"])
    held_out = [one for one in found if one.split != TRAINING and one.gaussian]
    told: dict[str, Any] = {
        "constants": dataclasses.asdict(constants),
        "map_constants": dataclasses.asdict(map_constants),
        "cross_validation": checked,
        "by_map": by_map,
        "coverage": coverage(held_out, forms["spectrum"], checked)
        | {f"{name} (map)": shares for name, shares in coverage(held_out, forms["map"], by_map).items()},
        "contact_edges": EDGES,
        "errors": report(found, forms),
        "bars": measure(found, forms, errors),
        "evidence": {"code_sha256": source, "training": len(training), "surfaces": len(found)},
    }
    for name in ("constants", "map_constants"):
        click.echo(f"{name}: " + ", ".join(f"{k} {v:.4g}" for k, v in told[name].items()))
    click.echo(f"held-out errors within one and two standard deviations: {told['coverage']}")
    if table is not None:
        click.echo(f"{table}: {write_table(table, told, found, summary)}")
        # its gaps have changed with the constants
        click.echo(f"leakage: {write_leakage(table).attrs['coverage']}")
