"""``python -m generate calibrated``: the calibrated law's constants, from the training set and no other surface."""

import dataclasses
import itertools
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import click
import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline

from generate import calibrated_hardness
from generate.boundary_elements.evidence import GAUSSIAN, MAX_AREA, MIN_WAVES, Case, TheoryCurve, cases
from generate.boundary_elements.surfaces import SPLITS, TRAINING
from generate.calibrated_file import QUANTITIES, TEXTS, by_bin, cross_validated, fitted, within
from generate.calibrated_file import write as write_table
from generate.files import dataset
from generate.leakage_law import write as write_leakage
from mbma_tables.common.arguments import FloatArray
from mbma_tables.data import FILE
from mbma_tables.laws.calibrated import CONSTANTS, Constants, Law, Spectrum
from mbma_tables.laws.map_curves import MAP_CONSTANTS, MapConstants
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.persson import Persson

EDGES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9, MAX_AREA)  # contact fractions between which errors are told
DIGITS = 4  # of constants
GRID = np.linspace(-21.0, 1.6, 227)[::-1]  # ln F of curves while they are fitted
LEAST = 1e-6  # ratio of forces that a law above its h_max counts as
# errors that count alike: model noise plus the scatter of surfaces at light contact
NOISE = {"area": (0.015, 0.15), "force": (0.02, 0.25), "map": (0.03, 0.1)}
LIGHT = 0.01
# a relative step of 1%, since laws of maps are interpolated
OPTIONS = {"x_scale": "jac", "diff_step": 0.01, "ftol": 1e-4, "xtol": 1e-4}
LABELS = ("1 wave", "2-3 waves", "4 waves", "stretched", "transformed")
LARGE = 512  # points a side from which on surfaces are told apart
Make = Callable[[Case], Any]


def _rounded(constants: Any) -> Any:
    return type(constants)(*(float(f"{value:.{DIGITS}g}") for value in dataclasses.astuple(constants)))


def noise(one: Case, name: str) -> FloatArray:
    """Errors of ln F or ln A that count as one."""
    floor, scatter = NOISE[name]
    return np.asarray(floor + scatter * np.exp(-one.area / LIGHT))


class Parts:
    """u_P of a spectrum on a grid of ln F, linear in the coefficients of W: of P^16, and what P and P^3 add."""

    def __init__(self, spectrum: Spectrum) -> None:
        flat, parts = dataclasses.replace(CONSTANTS, weight_slope=0.0), ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
        laws = (Law(spectrum, None, dataclasses.replace(flat, weight=a, cubic=b)) for a, b in parts)
        plain, first, cubic = (law.separation_persson(np.exp(GRID))[0] for law in laws)
        self.spectrum, self.plain, self.first, self.cubic = spectrum, plain, first - plain, cubic - plain

    def errors(self, one: Case, trial: Constants) -> FloatArray:
        """Errors of ln F at equal u, as `errors` has them, without the law's own quadrature for every trial."""
        law = Law(self.spectrum, None, trial)
        a, b, _ = law.coefficients
        u = self.plain + a * self.first + b * self.cubic
        curve = CubicSpline(np.log(u), GRID - law.tail * u**3)
        found, end = curve(np.log(one.u)), float(curve(np.log(one.h_max)))
        left = np.maximum(-np.expm1(end - found), LEAST)
        return np.asarray(found + 1.5 * np.log(left) - np.log(2 - left) - np.log(one.force))


def fit(training: Sequence[Case], tail: bool = False) -> Constants:
    """The spectrum's law: area at equal force, then force at equal u; or the tail alone."""
    seen = [one for one in training if one.gaussian]
    pairs = [(one, Parts(one.spectrum)) for one in seen]

    def areas(trial: Constants) -> list[FloatArray]:
        return [errors(one, one.law(trial), "area") / noise(one, "area") for one in seen]

    def forces(trial: Constants) -> list[FloatArray]:
        return [part.errors(one, trial) / noise(one, "force") for one, part in pairs]

    constants = CONSTANTS
    if not tail:
        constants = fitted(constants, ("area_s0", "area_slope", "area_t0"), areas, **OPTIONS)
    names = ("tail",) if tail else ("weight", "weight_slope", "cubic", "tail")
    return fitted(constants, names, forces, **OPTIONS)


def fit_map(training: Sequence[Case], constants: Constants) -> MapConstants:
    """The map's law: area of stretched surfaces, then force at equal u of all kinds."""

    def residuals(seen: list[Case], quantity: str) -> Callable[[MapConstants], list[FloatArray]]:
        return lambda trial: [errors(o, o.map_law(constants, trial), quantity) / noise(o, "map") for o in seen]

    areas = residuals([one for one in training if one.kind == "stretched"], "area")
    forces = residuals([one for one in training if one.waves >= MIN_WAVES], "force")
    names = [name for name in dataclasses.asdict(MAP_CONSTANTS) if name not in ("elliptic", "tension_area")]
    return fitted(fitted(MAP_CONSTANTS, ("elliptic",), areas, **OPTIONS), names, forces, **OPTIONS)


def errors(one: Case, law: Any, quantity: str) -> FloatArray:
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


def told(seen: Sequence[Case], make: Make) -> pd.DataFrame:
    """Errors of a law on surfaces: a row a load, with contact fractions and what the surface is."""
    parts = []
    for one in seen:
        label = one.kind if one.kind == "stretched" else "transformed"
        if one.kind in GAUSSIAN:
            label = "1 wave" if one.waves < MIN_WAVES else "2-3 waves" if one.waves < 4 else "4 waves"
        known = {name: getattr(one, name) for name in ("kind", "split", "waves", "points", "gaussian")}
        known |= {"contact": one.area, "load": np.arange(one.area.size), "node": str(one.node)}
        law, known = make(one), known | {"label": label, "surface": id(one)}
        parts.append(pd.DataFrame(known | {quantity: errors(one, law, quantity) for quantity in QUANTITIES}))
    return pd.concat(parts, ignore_index=True)


def summary(frame: pd.DataFrame) -> FloatArray:
    """By quantity and contact: mean, standard deviation, 90% quantile of the magnitude and number of errors."""
    of = (np.mean, np.std, lambda part: np.quantile(np.abs(part), 0.9), np.size)
    return np.array([by_bin(frame["contact"], frame[quantity], EDGES, *of) for quantity in QUANTITIES])


def cross_validate(training: Sequence[Case]) -> FloatArray:
    """Errors on spectra that were left out, a fifth of them at a time."""
    seen = [one for one in training if one.gaussian]
    own = cross_validated(seen, fit)
    return summary(told(seen, lambda one: one.law(own[one.node])))


def coverage(frame: pd.DataFrame, stated: FloatArray) -> dict[str, list[float]]:
    """Shares of held-out errors within one and two of the stated root mean squares."""
    middles = np.log(np.sqrt(np.multiply(EDGES[1:], EDGES[:-1])))
    log_sigma = np.log(np.hypot(stated[..., 0], stated[..., 1]))
    return {
        quantity: within(frame[quantity] / np.exp(np.interp(np.log(frame["contact"]), middles, row)))
        for quantity, row in zip(QUANTITIES, log_sigma, strict=True)
    }


def _nine_in_ten(values: Any) -> float:
    return float(np.quantile(np.abs(values), 0.9)) if len(values) else float("nan")


def measure(forms: dict[str, pd.DataFrame]) -> list[dict[str, Any]]:
    """Of each bar: nine errors in ten, also of large grids alone, and nine in ten of a spectrum's own differences.

    These are the errors' distances from the mean of their spectrum and load on all surfaces, widened for the mean's own
    scatter: no law of the same knowledge that is right in the mean does better. `forms` has errors by form of the law.
    """
    told = []
    for form, quantity, contact, limit, kinds, (low, high) in TEXTS["bars"]["rows"]:
        frame = forms[form]
        own = frame[frame["kind"].isin(kinds) & frame["waves"].between(low, high)]
        seen = own[own["split"] != TRAINING]
        inside = seen[seen["contact"].between(*contact) & np.isfinite(seen[quantity])]
        errors = np.expm1(inside[quantity])
        # loads that all surfaces of a spectrum have, where there are several
        loads = own.groupby(["node", "surface"])["load"].transform("size").groupby(own["node"]).transform("min")
        several = own[(own.groupby("node")["surface"].transform("nunique") > 1) & (own["load"] < loads)]
        groups = several.groupby(["node", "load"])
        apart = several[quantity] - groups[quantity].transform(lambda e: e.mean(skipna=False))
        count = groups[quantity].transform("size")
        spread = (apart * np.sqrt(count / (count - 1)))[groups["contact"].transform("mean").between(*contact)]
        waves = f"{low} or more waves" if high == 99 else f"{low} to {high} waves" if high > low else f"{low} waves"
        span = "-".join(f"{100 * a:g}" for a in contact)
        what = f"{quantity} by {form}, {span}% contact, {' '.join(kinds).replace('_', '-')}, {waves}"
        large = seen["points"] >= LARGE
        told.append(
            {"what": what, "limit": limit, "surfaces": seen["surface"].nunique()}
            | {"surfaces_large": seen["surface"][large].nunique(), "found": _nine_in_ten(errors)}
            | {"large": _nine_in_ten(errors[inside["points"] >= LARGE]), "mean": float(errors.mean())}
            | {"noise": _nine_in_ten(spread[np.isfinite(spread)])}
        )
    return told


def others(found: Sequence[Case]) -> dict[str, FloatArray]:
    """Errors of theories that nothing was fitted for, on all self-affine surfaces of two or more waves a side."""
    plain, summed = [one for one in found if one.kind == "self_affine" and one.gaussian], {}
    variants = [Mbma(variant=name, outside="nan") for name in ("reported", "printed", "fitted")]
    for theory in (*variants, Persson(), Persson("simplified"), GreenwoodWilliamson()):
        curves = dict[Case, TheoryCurve]()
        for one in plain:
            curve = TheoryCurve(theory, one.surface)
            kept = np.isfinite(curve.separation(one.force))
            if kept.sum() > 3:
                curves[one.at(kept)] = curve
        # theories' scatter has one name on all surfaces of this kind
        name = theory.scatter_name(Surface(0.8, 1.0, 100.0, 1.0, 3.0))
        summed[name] = summary(told([*curves], curves.__getitem__))
    return summed


@click.command()
@click.argument("evidence", type=click.Path(path_type=pathlib.Path, exists=True), default=FILE)
@click.option("--table", type=click.Path(path_type=pathlib.Path), help="The library's file: table and errors.")
@click.option("--tail", is_flag=True, help="Fit the tail of light loads alone: other constants are the library's.")
@click.option("--hardness", is_flag=True, help="Fit what a hardness adds, to the group of that name.")
def calibrated(evidence: pathlib.Path, table: pathlib.Path | None, tail: bool, hardness: bool) -> None:
    """Fit the calibrated law to the training set of EVIDENCE; its errors there and elsewhere go into the table."""
    data = dataset("hardness" if hardness else "elastic", evidence)
    said = "held-out errors within one and two standard deviations:"
    if hardness:
        of_hardness, written = calibrated_hardness.write(data, table)
        click.echo(f"{of_hardness}\n{said} {written.attrs['coverage']}")
        return
    found = cases(data)
    training = [one for one in found if one.split == TRAINING]
    constants = _rounded(fit(training, tail))
    map_constants = MAP_CONSTANTS if tail else _rounded(fit_map(training, constants))
    forms = {"spectrum": told(found, lambda one: one.law(constants))}
    forms["map"] = told(found, lambda one: one.map_law(constants, map_constants))
    by_map = forms["map"][forms["map"]["gaussian"]]
    of_map = summary(by_map[by_map["split"] == TRAINING])
    stated = {"calibrated": cross_validate(training), "calibrated_map": of_map}
    covered = dict[str, list[float]]()
    for frame, scatter, suffix in zip(forms.values(), stated.values(), ("", " (map)"), strict=True):
        held_out = frame[frame["gaussian"] & (frame["split"] != TRAINING)]
        covered |= {f"{name}{suffix}": shares for name, shares in coverage(held_out, scatter).items()}
    for name, values in {"constants": constants, "map_constants": map_constants}.items():
        click.echo(f"{name}: " + ", ".join(f"{k} {v:.4g}" for k, v in dataclasses.asdict(values).items()))
    click.echo(f"{said} {covered}")
    if table is not None:
        facts = {"code_sha256": data.attrs.get("code_sha256", ""), "training": len(training), "surfaces": len(found)}
        attributes = {"coverage": covered, "bars": measure(forms), "evidence": facts}
        sets = {
            f"{split}, {label}, {form}": summary(own)
            for split, label in itertools.product(SPLITS[:3], LABELS)
            for form, frame in forms.items()
            if len(own := frame[(frame["split"] == split) & (frame["label"] == label)])
        }
        known = others(found)
        sets |= {f"self-affine, {name}": values for name, values in known.items()}
        certified = write_table(table, constants, map_constants, EDGES, stated | known, sets, attributes)
        click.echo(f"{table}: {certified}")
        # its gaps have changed with the constants
        click.echo(f"leakage: {write_leakage(table).attrs['coverage']}")
