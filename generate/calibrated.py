"""``python -m generate calibrated``: constants of the calibrated law, from its training set."""

import dataclasses
import itertools
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import click
import numpy as np
import pandas as pd
import xarray as xr
from scipy.interpolate import CubicSpline

from generate import calibrated_hardness
from generate.boundary_elements.evidence import (
    GAUSSIAN,
    MAX_AREA,
    MIN_WAVES,
    Case,
    TheoryCurve,
    cases,
)
from generate.boundary_elements.surfaces import SPLITS, TRAINING
from generate.calibrated_file import (
    QUANTITIES,
    TEXTS,
    Stated,
    by_bin,
    cross_validated,
    fitted,
    within,
)
from generate.calibrated_file import write as write_table
from generate.files import dataset
from generate.leakage_law import write as write_leakage
from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
)
from mbma_tables.theories.calibrated.map_curves import MAP_CONSTANTS, MapConstants
from mbma_tables.theories.dataset import FILE
from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
from mbma_tables.theories.mbma.theory import Mbma
from mbma_tables.theories.persson import Persson

# contact fractions between which errors are stated
EDGES = (0.0005, 0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9, MAX_AREA)
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
SHARES_HEAD = "held-out errors within one and two standard deviations:"


def _rounded(constants: Any) -> Any:
    values = dataclasses.astuple(constants)
    return type(constants)(*(float(f"{value:.{DIGITS}g}") for value in values))


def noise(one: Case, name: str) -> FloatArray:
    """Errors of ln F or ln A that count as one."""
    floor, scatter = NOISE[name]
    return np.asarray(floor + scatter * np.exp(-one.area / LIGHT))


class Parts:
    """u_P of a spectrum on a grid of ln F, linear in the coefficients of W.

    These are of P^16, and what P and P^3 add.
    """

    def __init__(self, spectrum: Spectrum) -> None:
        flat = dataclasses.replace(CONSTANTS, weight_slope=0.0)

        def separation(weight: float, cubic: float) -> FloatArray:
            law = SpectrumLaw(
                spectrum, None, dataclasses.replace(flat, weight=weight, cubic=cubic)
            )
            u, _ = law.separation_persson(np.exp(GRID))
            return u

        self.spectrum = spectrum
        self.plain = separation(0.0, 0.0)
        self.first = separation(1.0, 0.0) - self.plain
        self.cubic = separation(0.0, 1.0) - self.plain

    def errors(self, one: Case, trial: CalibratedConstants) -> FloatArray:
        """Errors of ln F at equal u, as `errors` has them, without a quadrature for every trial."""
        law = SpectrumLaw(self.spectrum, None, trial)
        a, b, _ = law.coefficients
        u = self.plain + a * self.first + b * self.cubic
        log_force_at = CubicSpline(np.log(u), GRID - law.tail * u**3)
        log_force = log_force_at(np.log(one.u))
        # force ends at the highest point
        log_force_at_end = float(log_force_at(np.log(one.h_max)))
        left = np.maximum(-np.expm1(log_force_at_end - log_force), LEAST)
        log_end_factor = 1.5 * np.log(left)
        return np.asarray(
            log_force + log_end_factor - np.log(2 - left) - np.log(one.force)
        )


def fit(training: Sequence[Case], tail: bool = False) -> CalibratedConstants:
    """The spectrum's law: area at equal force, then force at equal u; or the tail alone."""
    seen = [one for one in training if one.gaussian]
    pairs = [(one, Parts(one.spectrum)) for one in seen]

    def areas(trial: CalibratedConstants) -> list[FloatArray]:
        return [errors(one, one.law(trial), "area") / noise(one, "area") for one in seen]

    def forces(trial: CalibratedConstants) -> list[FloatArray]:
        return [parts.errors(one, trial) / noise(one, "force") for one, parts in pairs]

    if tail:
        return fitted(CONSTANTS, ("tail",), forces, **OPTIONS)
    with_area = fitted(CONSTANTS, ("area_s0", "area_slope", "area_t0"), areas, **OPTIONS)
    return fitted(
        with_area, ("weight", "weight_slope", "cubic", "tail"), forces, **OPTIONS
    )


def fit_map(training: Sequence[Case], constants: CalibratedConstants) -> MapConstants:
    """The map's law: area of stretched surfaces, then force at equal u of all kinds."""
    stretched = [one for one in training if one.kind == "stretched"]
    wide = [one for one in training if one.waves >= MIN_WAVES]

    def residual(one: Case, trial: MapConstants, quantity: str) -> FloatArray:
        law = one.map_law(constants, trial)
        return errors(one, law, quantity) / noise(one, "map")

    def areas(trial: MapConstants) -> list[FloatArray]:
        return [residual(one, trial, "area") for one in stretched]

    def forces(trial: MapConstants) -> list[FloatArray]:
        return [residual(one, trial, "force") for one in wide]

    with_area = fitted(MAP_CONSTANTS, ("elliptic",), areas, **OPTIONS)
    every_name = dataclasses.asdict(MAP_CONSTANTS)
    names = [name for name in every_name if name not in ("elliptic", "tension_area")]
    return fitted(with_area, names, forces, **OPTIONS)


def errors(one: Case, law: Any, quantity: str) -> FloatArray:
    """ln of law over simulation.

    "area" is that at equal force, "force" at equal u, "stiffness" at equal force.
    """
    log_force = np.log(one.force)
    if quantity == "area":
        return np.asarray(np.log(law.area(one.force) / one.area))
    if quantity == "force":
        force = np.maximum(law.force(one.u), LEAST * one.force)
        return np.asarray(np.log(force) - log_force)

    # both by one spline through the simulated loads, so that its error cancels
    def slope(gap: FloatArray) -> FloatArray:
        """du/d ln F."""
        log_slope = CubicSpline(log_force, np.log(gap)).derivative()(log_force)
        return np.asarray(gap * log_slope)

    slope_of_law = slope(law.separation(one.force))
    slope_simulated = slope(one.u)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.log(slope_simulated / slope_of_law))


def label_of(one: Case) -> str:
    """The group of surfaces, of `LABELS`, that a surface belongs to."""
    if one.kind == "stretched":
        return "stretched"
    if one.kind not in GAUSSIAN:
        return "transformed"
    if one.waves < MIN_WAVES:
        return "1 wave"
    return "2-3 waves" if one.waves < 4 else "4 waves"


def told(seen: Sequence[Case], make: Make) -> pd.DataFrame:
    """Errors of a law on surfaces: a row a load, with contact fractions and what the surface is."""
    parts = []
    for one in seen:
        fields = ("kind", "split", "waves", "points", "gaussian")
        columns: dict[str, Any] = {name: getattr(one, name) for name in fields}
        columns["contact"] = one.area
        columns["load"] = np.arange(one.area.size)
        columns["node"] = str(one.node)
        columns["label"] = label_of(one)
        columns["surface"] = id(one)
        law = make(one)
        for quantity in QUANTITIES:
            columns[quantity] = errors(one, law, quantity)
        parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True)


def _magnitude_of_nine_in_ten(misses: FloatArray) -> Any:
    return np.quantile(np.abs(misses), 0.9)


def summary(frame: pd.DataFrame) -> FloatArray:
    """Statistics of errors by quantity and contact.

    Mean, standard deviation, 90% quantile of the magnitude, and number.
    """
    statistics = (np.mean, np.std, _magnitude_of_nine_in_ten, np.size)
    contact = frame["contact"]
    rows = [
        by_bin(contact, frame[quantity], EDGES, *statistics) for quantity in QUANTITIES
    ]
    return np.array(rows)


def cross_validate(training: Sequence[Case]) -> FloatArray:
    """Errors on spectra that were left out, a fifth of them at a time."""
    seen = [one for one in training if one.gaussian]
    constants_of_others = cross_validated(seen, fit)
    return summary(told(seen, lambda one: one.law(constants_of_others[one.node])))


def coverage(frame: pd.DataFrame, stated: FloatArray) -> dict[str, list[float]]:
    """Shares of held-out errors within one and two of the stated root mean squares."""
    middles = np.log(np.sqrt(np.multiply(EDGES[1:], EDGES[:-1])))
    bias = stated[..., 0]
    deviation = stated[..., 1]
    log_sigma = np.log(np.hypot(bias, deviation))
    log_contact = np.log(frame["contact"])
    shares = {}
    for quantity, row in zip(QUANTITIES, log_sigma, strict=True):
        sigma = np.exp(np.interp(log_contact, middles, row))
        shares[quantity] = within(frame[quantity] / sigma)
    return shares


def _nine_in_ten(values: Any) -> float:
    return float(np.quantile(np.abs(values), 0.9)) if len(values) else float("nan")


def differences(rows: pd.DataFrame, quantity: str, contact: Sequence[float]) -> pd.Series:
    """Errors' distances from the mean of their spectrum and load, on all surfaces of it.

    Widened for the mean's own scatter; where that mean's contact fraction is in the range.
    """
    # loads that all surfaces of a spectrum have, where there are several
    loads_of_surface = rows.groupby(["node", "surface"])["load"].transform("size")
    loads = loads_of_surface.groupby(rows["node"]).transform("min")
    surfaces = rows.groupby("node")["surface"].transform("nunique")
    several = rows[(surfaces > 1) & (rows["load"] < loads)]
    groups = several.groupby(["node", "load"])
    apart = several[quantity] - groups[quantity].transform(lambda e: e.mean(skipna=False))
    count = groups[quantity].transform("size")
    widened = apart * np.sqrt(count / (count - 1))
    return widened[groups["contact"].transform("mean").between(*contact)]


def waves_text(low: int, high: int) -> str:
    """How many longest waves a side, 99 of them being any number."""
    if high == 99:
        return f"{low} or more waves"
    if high > low:
        return f"{low} to {high} waves"
    return f"{low} waves"


def measure(forms: dict[str, pd.DataFrame]) -> list[dict[str, Any]]:
    """Of each bar: nine errors in ten, also of large grids, and of a spectrum's own differences.

    These are the errors' distances from the mean of their spectrum and load on all surfaces: no law
    of the same knowledge that is right in the mean does better. `forms` has errors by form of the
    law.
    """
    bars = []
    for form, quantity, contact, limit, kinds, (low, high) in TEXTS["bars"]["rows"]:
        frame = forms[form]
        of_kind = frame[frame["kind"].isin(kinds) & frame["waves"].between(low, high)]
        unseen = of_kind[of_kind["split"] != TRAINING]
        inside = unseen[
            unseen["contact"].between(*contact) & np.isfinite(unseen[quantity])
        ]
        relative = np.expm1(inside[quantity])
        spread = differences(of_kind, quantity, contact)
        is_large = unseen["points"] >= LARGE
        span = "-".join(f"{100 * a:g}" for a in contact)
        kinds_text = " ".join(kinds).replace("_", "-")
        waves = waves_text(low, high)
        bar = {
            "what": f"{quantity} by {form}, {span}% contact, {kinds_text}, {waves}",
            "limit": limit,
            "surfaces": unseen["surface"].nunique(),
            "surfaces_large": unseen["surface"][is_large].nunique(),
            "found": _nine_in_ten(relative),
            "large": _nine_in_ten(relative[inside["points"] >= LARGE]),
            "mean": float(relative.mean()),
            "noise": _nine_in_ten(spread[np.isfinite(spread)]),
        }
        bars.append(bar)
    return bars


def others(surfaces: Sequence[Case]) -> dict[str, FloatArray]:
    """Errors of theories that nothing was fitted for.

    On all self-affine surfaces of two or more waves a side.
    """
    plain = [one for one in surfaces if one.kind == "self_affine" and one.gaussian]
    variants = [
        Mbma(variant=name, outside="nan") for name in ("reported", "printed", "fitted")
    ]
    # theories' scatter has one name on all surfaces of this kind
    self_affine = Surface(0.8, 1.0, 100.0, 1.0, 3.0)
    summed: dict[str, FloatArray] = {}
    for theory in (*variants, Persson(), Persson("simplified"), GreenwoodWilliamson()):
        curves = dict[Case, TheoryCurve]()
        for one in plain:
            curve = TheoryCurve(theory, one.surface)
            reached = np.isfinite(curve.separation(one.force))
            # a spline needs four loads
            if reached.sum() > 3:
                curves[one.at(reached)] = curve
        summed[theory.scatter_name(self_affine)] = summary(
            told([*curves], curves.__getitem__)
        )
    return summed


def by_split_and_label(forms: dict[str, pd.DataFrame]) -> Stated:
    """Statistics of errors of each form of the law, by split and label of surfaces."""
    sets = {}
    for split, label in itertools.product(SPLITS[:3], LABELS):
        for form, frame in forms.items():
            members = frame[(frame["split"] == split) & (frame["label"] == label)]
            if len(members):
                sets[f"{split}, {label}, {form}"] = summary(members)
    return sets


def coverage_of_forms(
    forms: dict[str, pd.DataFrame], stated: Stated
) -> dict[str, list[float]]:
    """Shares of held-out errors by quantity, "(map)" behind those of the map's law."""
    shares = {}
    theories = (("spectrum", "calibrated", ""), ("map", "calibrated_map", " (map)"))
    for form, theory, suffix in theories:
        frame = forms[form]
        held_out = frame[frame["gaussian"] & (frame["split"] != TRAINING)]
        for name, within_one_and_two in coverage(held_out, stated[theory]).items():
            shares[f"{name}{suffix}"] = within_one_and_two
    return shares


def fit_hardness(data: xr.Dataset, table: pathlib.Path | None) -> None:
    """Fit what a hardness adds, and write it into the file where there is one."""
    constants, written = calibrated_hardness.write(data, table)
    click.echo(f"{constants}\n{SHARES_HEAD} {written.attrs['coverage']}")


@click.command()
@click.argument(
    "evidence", type=click.Path(path_type=pathlib.Path, exists=True), default=FILE
)
@click.option(
    "--table",
    type=click.Path(path_type=pathlib.Path),
    help="The library's file: table and errors.",
)
@click.option(
    "--tail",
    is_flag=True,
    help="Fit the tail of light loads alone: other constants are the library's.",
)
@click.option(
    "--hardness",
    is_flag=True,
    help="Fit what a hardness adds, to the group of that name.",
)
def calibrated(
    evidence: pathlib.Path,
    table: pathlib.Path | None,
    tail: bool,
    hardness: bool,
) -> None:
    """Fit the calibrated law to the training set of EVIDENCE.

    Its errors there and elsewhere go into the table.
    """
    data = dataset("hardness" if hardness else "elastic", evidence)
    if hardness:
        fit_hardness(data, table)
        return

    surfaces = cases(data)
    training = [one for one in surfaces if one.split == TRAINING]
    constants = _rounded(fit(training, tail))
    map_constants = MAP_CONSTANTS if tail else _rounded(fit_map(training, constants))

    forms = {
        "spectrum": told(surfaces, lambda one: one.law(constants)),
        "map": told(surfaces, lambda one: one.map_law(constants, map_constants)),
    }
    by_map = forms["map"][forms["map"]["gaussian"]]
    stated = {
        "calibrated": cross_validate(training),
        "calibrated_map": summary(by_map[by_map["split"] == TRAINING]),
    }
    covered = coverage_of_forms(forms, stated)
    for name, values in {"constants": constants, "map_constants": map_constants}.items():
        shown = ", ".join(
            f"{key} {value:.4g}" for key, value in dataclasses.asdict(values).items()
        )
        click.echo(f"{name}: {shown}")
    click.echo(f"{SHARES_HEAD} {covered}")
    if table is None:
        return

    evidence_facts = {
        "code_sha256": data.attrs.get("code_sha256", ""),
        "training": len(training),
        "surfaces": len(surfaces),
    }
    attributes = {"coverage": covered, "bars": measure(forms), "evidence": evidence_facts}
    sets = by_split_and_label(forms)
    stated_of_others = others(surfaces)
    sets |= {f"self-affine, {name}": values for name, values in stated_of_others.items()}
    stated |= stated_of_others
    certified = write_table(
        table, constants, map_constants, EDGES, stated, sets, attributes
    )
    click.echo(f"{table}: {certified}")
    # its gaps have changed with the constants
    click.echo(f"leakage: {write_leakage(table).attrs['coverage']}")
