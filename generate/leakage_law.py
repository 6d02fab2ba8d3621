"""The law of leakage and others: constants from the training set, errors on held-out surfaces, the table."""

import dataclasses
import functools
import pathlib
from collections.abc import Callable, Sequence
from typing import Any

import click
import numpy as np
import xarray as xr
from scipy.interpolate import RegularGridInterpolator

from generate import files
from generate.boundary_elements.evidence import Simulated, TheoryCurve, simulated
from generate.boundary_elements.surfaces import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, TRAINING
from generate.calibrated_file import FOLDS, bins, by_bin, fitted, law_table, rms, within, write_part
from generate.splines import coefficients
from generate.workers import results
from mbma_tables.answers.leakage import GROUP
from mbma_tables.common.arguments import FloatArray
from mbma_tables.data import FILE
from mbma_tables.laws import effective_medium as leakage
from mbma_tables.laws.calibrated import Constants, Law, Spectrum, force_at_area, light_factor
from mbma_tables.laws.effective_medium import FlowConstants
from mbma_tables.theories import get_theory
from mbma_tables.theories.calibrated_table import load
from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.persson import Persson
from mbma_tables.theories.yielding import Yielding

MIN_WAVES = 4  # longest waves a side: below, the cell's own scatter rules
EDGES = (0.004, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)  # contact fractions between which errors are told
NOISE = (0.1, 6.0)  # errors of ln k that count as one: a + b (A/A0)^2, about what cells of one spectrum differ by
COVERED = {"hurst": (0.1, 1.0), "log_zeta_1": (np.log(3.0), np.log(1e5)), "log_odds": (-14.0, 5.5)}
NODES = {
    "hurst": np.linspace(0.04, 1.06, 14),
    "log_zeta_1": np.linspace(np.log(2.0), np.log(2e5), 14),
    "log_odds": np.linspace(-14.6, 6.2, 53),  # ln A/(Ac - A)
}
CERTIFICATE = 600  # held-out surfaces, each at its own odds
BLOCKED = -20.0  # residual of what a law blocks and simulation does not
LARGE = 64.0  # zeta_1 from which surfaces decide between laws, and no constant
DEGREE = 5
PROCESSES = 2
TABLE = files.ROOT / "tables" / "calibrated.nc"


def log_odds(area: FloatArray, threshold: float) -> FloatArray:
    """The table's axis of contact, ln A/(Ac - A)."""
    return np.asarray(np.log(area / (threshold - area)))


@dataclasses.dataclass(frozen=True, eq=False)
class Case(Simulated):
    """One surface, and the flow through it: `log_k` of the geometric mean of both axes, where neither is blocked."""

    force: FloatArray
    area: FloatArray
    u: FloatArray
    log_k: FloatArray
    blocked: FloatArray

    @property
    def isotropic(self) -> bool:
        """Whether constants are fitted to surfaces like it."""
        return self.kind not in ("stretched", "yielded") and self.waves >= MIN_WAVES

    @property
    def plain(self) -> bool:
        """Whether its errors are those that are stated."""
        return self.isotropic and self.zeta_1 < LARGE

    def law(self, constants: Constants) -> tuple[FloatArray, FloatArray]:
        """A/A0 and mean gap by the calibrated law, from the spectrum and h_max, and a hardness, the last of `node`."""
        if self.kind == "yielded":
            gradient = self.spectrum.gradient
            curve = TheoryCurve(Yielding(get_theory("calibrated"), float(self.node[-1]) * gradient), self.surface)
            return curve.area(self.force), curve.separation(self.force)
        law = Law(self.spectrum, self.h_max, constants)
        return law.area(self.force), law.separation(self.force)


def cases(data: xr.Dataset) -> list[Case]:
    """Surfaces of a file by `python -m generate boundary_elements --of leakage`."""
    found = []
    for one, fields in simulated(data):
        known = np.isfinite(one.force.values)
        force, area, u, flow = (one[n].values[known] for n in ("force", "area", "mean_separation", "flow"))
        blocked = (flow == 0).mean(axis=1)
        kept = blocked == 0
        loads = {"force": force[kept], "area": area[kept], "u": u[kept], "log_k": np.log(flow[kept]).mean(axis=1)}
        found.append(Case(**vars(fields), **loads, blocked=np.stack([area, blocked])))
    return found


class Flow:
    """Laws of flow on one surface, each as ln k at the surface's loads; -inf where blocked."""

    def __init__(self, one: Case, constants: Constants) -> None:
        self.one = one
        self.area, self.u = one.law(constants)
        # gaps of contacts that yield are taken for those of elastic ones of equal area
        at_area = force_at_area(self.area, light_factor(one.spectrum.alpha, constants), constants)
        load = at_area if one.kind == "yielded" else one.force
        self._gaps = leakage.gaps(one.spectrum, load, constants)

    @functools.cache  # noqa: B019 - there are as many surfaces as the file has
    def log_factor(self, flow: FlowConstants) -> FloatArray:
        return leakage.log_factor(self._gaps, flow)

    def medium(self, flow: FlowConstants, area: FloatArray | None = None, u: FloatArray | None = None) -> FloatArray:
        """The law; of another area and mean gap than the calibrated law's where given."""
        factor, gap = self.log_factor(flow), self.u if u is None else u
        if area is not None:
            # by interpolation between the loads
            kept = self._gaps.area < flow.threshold - leakage.NEAREST
            odds = log_odds(self._gaps.area[kept], flow.threshold)
            inside = np.minimum(area, flow.threshold * (1 - 1e-9))
            found = np.interp(log_odds(inside, flow.threshold), odds, factor[kept])
            factor = np.where(area < flow.threshold, found, -np.inf)
        return np.asarray(factor + 3 * np.log(gap) + np.log(leakage.wide_gap(gap)))

    def closed_form(self, flow: FlowConstants) -> FloatArray:
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(flow.closed_form(self.u, self.area)))

    def critical_junction(self, flow: FlowConstants) -> FloatArray:
        """Persson and Yang (2008): the cube of the gap u1 at the magnification at which contact percolates."""
        share = self._gaps.share
        cover = self.area[:, None] + np.cumsum(share[:, ::-1], axis=1)[:, ::-1]
        found = np.full(self.area.shape, -np.inf)
        for k, row in enumerate(cover):
            held = share[k] > 0
            if self.area[k] < flow.threshold:
                gap = np.interp(flow.threshold, row[held][::-1], self._gaps.mean[k][held][::-1])
                found[k] = 3 * np.log(max(gap, 1e-300))
        return found

    def bruggeman(self, flow: FlowConstants, n: float) -> FloatArray:
        """Bruggeman's medium of n dimensions on the same gaps: sum w (h^3 - k)/(h^3 + (n - 1) k) = A/(n - 1)."""
        share, log_cube = self._gaps.quadrature
        # with K = (n - 1) k: h^3 - k = (1 + 1/(n-1)) (h^3 - K)/2 + ..., so the same balance at another right side
        total = share.sum(axis=1)
        ratio = 1 / (n - 1)
        blocked = (2 * ratio * self._gaps.area - (1 - ratio) * total) / (1 + ratio)
        with np.errstate(invalid="ignore"):
            found = leakage.effective_medium(share, log_cube, blocked) + np.log(ratio)
        return np.where(self._gaps.area < 1 - 1 / n, found, -np.inf)


def fit(training: Sequence[Flow], first: FlowConstants | None = None) -> FlowConstants:
    """Constants of the law and of the closed form, by robust least squares up to `leakage.LARGEST_AREA`."""
    seen = [(flow, flow.one.area < leakage.LARGEST_AREA) for flow in training if flow.one.isotropic]

    def residuals(form: Callable[[Flow, FlowConstants], FloatArray], constants: FlowConstants) -> list[FloatArray]:
        misses = ((form(f, constants) - f.one.log_k) / (NOISE[0] + NOISE[1] * f.one.area**2) for f, _ in seen)
        # the law may block what was open
        return [np.maximum(miss[kept], BLOCKED) for miss, (_, kept) in zip(misses, seen, strict=True)]

    def found(start: FlowConstants, names: tuple[str, ...], form: Any, **options: Any) -> FlowConstants:
        best = fitted(start, names, functools.partial(residuals, form), diff_step=0.01, **options)
        return dataclasses.replace(best, **{name: round(getattr(best, name), 3) for name in names})

    law = found(first or FlowConstants(), ("threshold", "obstruction"), Flow.medium, x_scale=[0.01, 0.1])
    return found(law, ("prefactor", "exponent"), Flow.closed_form)


def left_out(training: Sequence[Flow], constants: FlowConstants) -> FloatArray:
    """Bias, root mean square and number of errors on surfaces of the training set that constants did not see."""
    own = [flow for flow in training if SETS["training"](flow.one)]
    parts = []
    for fold in range(FOLDS):
        seen = fit([flow for k, flow in enumerate(own) if k % FOLDS != fold], constants)
        parts += [errors(flow, flow.medium(seen)) for flow in own[fold::FOLDS]]
    return summary(parts)


LAWS: dict[str, Callable[[Flow, FlowConstants], FloatArray]] = {
    "calibrated": Flow.medium,
    "medium, simulated area and gap": lambda flow, c: flow.medium(c, flow.one.area, flow.one.u),
    "closed form": Flow.closed_form,
    "Bruggeman, n = 1/(1 - 0.42)": lambda flow, c: flow.bruggeman(c, 1 / (1 - 0.42)),
    "Bruggeman, n = 2": lambda flow, c: flow.bruggeman(c, 2.0),
    "critical junction": Flow.critical_junction,
    # 1978, isotropic
    "Patir and Cheng": lambda flow, _: 3 * np.log(flow.u) + np.log(1 - 0.9 * np.exp(-0.56 * flow.u)),
    "parallel plates": lambda flow, _: 3 * np.log(flow.u),
}
SETS: dict[str, Callable[[Case], bool]] = {
    "training": lambda one: one.plain and one.split == TRAINING,
    "held-out surfaces": lambda one: one.plain and one.split == HELD_OUT_SURFACE,
    "held-out spectra": lambda one: one.plain and one.split == HELD_OUT_SPECTRUM,
    "held out": lambda one: one.plain and one.split != TRAINING,
    "plateaus": lambda one: one.kind == "plateau",
    "stretched": lambda one: one.kind == "stretched",
    "yielded": lambda one: one.kind == "yielded",
    "zeta_1 32, two waves": lambda one: one.zeta_1 == 32 and one.waves < MIN_WAVES,
    "zeta_1 64 and 128": lambda one: one.zeta_1 >= LARGE,
}


def errors(flow: Flow, log_k: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A/A0 and ln(law/simulation), where both are open."""
    kept = np.isfinite(log_k)
    return flow.one.area[kept], log_k[kept] - flow.one.log_k[kept]


def summary(parts: Sequence[tuple[FloatArray, FloatArray]], edges: Sequence[float] = EDGES) -> FloatArray:
    area, miss = np.concatenate([*parts, np.empty((2, 0))], axis=1)
    return by_bin(area, miss, edges, np.mean, rms, np.size)


def noise_floor(found: Sequence[Case], edges: Sequence[float] = EDGES) -> FloatArray:
    """Standard deviation of ln k between cells of one spectrum at equal load, between contact fractions."""
    parts = []
    for node in {one.node for one in found if one.isotropic}:
        own = [one for one in found if one.node == node]
        size = min(one.log_k.size for one in own)
        area, log_k = np.array([(one.area[:size], one.log_k[:size]) for one in own]).swapaxes(0, 1)
        if len(own) > 1:
            parts.append((area.mean(axis=0), log_k.var(axis=0, ddof=1)))
    area, variance = np.concatenate(parts, axis=1)
    return np.asarray(np.sqrt(by_bin(area, variance, edges, np.mean)[:, 0]))


def of_theories(flows: Sequence[Flow], constants: FlowConstants) -> dict[str, FloatArray]:
    """Errors by area and mean gap of other theories on self-affine surfaces; nothing was fitted to these."""
    told, seen = {}, [flow for flow in flows if flow.one.kind == "self_affine" and flow.one.isotropic]
    for theory in (Mbma(outside="nan"), Persson(), GreenwoodWilliamson()):
        parts = []
        for flow in seen:
            curve = TheoryCurve(theory, flow.one.surface)
            area, u = curve.area(flow.one.force), curve.separation(flow.one.force)
            kept = np.isfinite(u)
            log_k = np.full(u.shape, -np.inf)
            log_k[kept] = flow.medium(constants, area[kept], u[kept])
            parts.append(errors(flow, log_k))
        told[theory.name] = summary(parts)
    return told


def _row(constants: FlowConstants, contact: Constants, hurst: float) -> FloatArray:
    area = constants.threshold / (1 + np.exp(-NODES["log_odds"]))
    spectra = [Spectrum.self_affine(hurst, float(np.exp(z))) for z in NODES["log_zeta_1"]]
    return np.array([leakage.contact_factor(spectrum, area, constants, contact) for spectrum in spectra])


def dataset(found: Sequence[Case], contact: Constants) -> xr.Dataset:
    """The group `leakage` of the calibrated law's file, with that law's constants."""
    flows = [Flow(one, contact) for one in found]
    constants = fit([flow for flow in flows if flow.one.split == TRAINING])
    values = np.array([*results("table", _row, [(constants, contact, hurst) for hurst in NODES["hurst"]], PROCESSES)])
    misses = {label: [errors(f, law(f, constants)) for f in flows] for label, law in LAWS.items()}
    sets = {name: [k for k, f in enumerate(flows) if member(f.one)] for name, member in SETS.items()}
    sets = {name: own for name, own in sets.items() if own}
    accuracy = np.array([[summary([misses[label][k] for k in own]) for label in LAWS] for own in sets.values()])
    stated = {"calibrated": left_out(flows, constants), **of_theories(flows, constants)}
    area, blocked = np.concatenate([one.blocked for one in found if one.isotropic], axis=1)
    shares = by_bin(area, blocked, EDGES, np.mean)[:, 0]
    arrays = {
        "spline": ([f"{name}_knot" for name in NODES], coefficients(values, DEGREE, 3).astype("f4")),
        "accuracy": (("set", "law", "contact", "statistic"), accuracy),
        "stated_scatter": (("theory", "contact"), np.array([rows[:, 1] for rows in stated.values()])),
        "noise": ("contact", noise_floor(found)),
        "share_blocked": ("contact", shares),
        **bins(EDGES, np.add(EDGES[1:], EDGES[:-1]) / 2),
    }
    below, beyond = certificate(values, constants, contact)
    facts: dict[str, Any] = {"theories": " ".join(stated), "laws": "; ".join(LAWS), "sets": "; ".join(sets)}
    facts |= {"largest_error_simulated": below, "largest_error_log_factor": beyond}
    covered = np.array(coverage(flows, constants, stated["calibrated"]))
    own = {"flow": constants, "law": contact}
    return law_table("leakage", NODES, COVERED, arrays, constants=own, facts=facts | {"coverage": covered})


def certificate(values: FloatArray, constants: FlowConstants, contact: Constants) -> list[float]:
    """Largest errors of ln R at held-out surfaces to `LARGE` and beyond, below `leakage.LARGEST_AREA`."""
    table = RegularGridInterpolator(tuple(NODES.values()), values, method="quintic")
    rng, largest = np.random.default_rng(21), [0.0, 0.0]
    last = log_odds(np.array(leakage.LARGEST_AREA), constants.threshold)
    odds = np.sort(rng.uniform(COVERED["log_odds"][0], last, 12))
    area = constants.threshold / (1 + np.exp(-odds))
    for _ in range(CERTIFICATE):
        # half of them at the ends of an axis, where bands of the medium hold few wavenumbers and errors are largest
        ends = (COVERED[name] for name in ("hurst", "log_zeta_1"))
        hurst, log_zeta = (low + (high - low) * np.clip(rng.uniform(-0.5, 1.5), 0, 1) for low, high in ends)
        spectrum = Spectrum.self_affine(hurst, float(np.exp(log_zeta)))
        exact = leakage.contact_factor(spectrum, area, constants, contact)
        points = np.stack([np.full(odds.size, hurst), np.full(odds.size, log_zeta), odds], axis=1)
        error = float(np.abs(table(points) - exact).max())
        largest = [max(largest[0], error * (log_zeta <= np.log(LARGE))), max(largest[1], error)]
    return largest


def coverage(flows: Sequence[Flow], constants: FlowConstants, stated: FloatArray) -> list[float]:
    """Shares of held-out errors up to the largest area of a valid answer within one and two of the stated scatter."""
    middle = (np.array(EDGES[1:]) + np.array(EDGES[:-1])) / 2
    parts = [errors(f, f.medium(constants)) for f in flows if SETS["held out"](f.one)]
    area, miss = np.concatenate(parts, axis=1)
    return within((miss / np.interp(area, middle, stated[:, 1]))[area < leakage.LARGEST_AREA])


def write(path: pathlib.Path, evidence: pathlib.Path = FILE) -> xr.Dataset:
    """Fit, and write the group into the calibrated law's file; what it holds."""
    made = dataset(cases(files.dataset("leakage", evidence)), load(path).constants)
    write_part(path, made, GROUP)
    return made


@click.command()
@click.argument("evidence", type=click.Path(path_type=pathlib.Path, exists=True), default=FILE)
@click.option("--table", type=click.Path(path_type=pathlib.Path), default=TABLE, help="The library's file.")
def leakage_law(evidence: pathlib.Path, table: pathlib.Path) -> None:
    """Fit the law of leakage to the training set of EVIDENCE, write it beside the calibrated law."""
    made = write(table, evidence)
    click.echo(", ".join(f"{name} {made.attrs[f'flow_{name}']:g}" for name in dataclasses.asdict(FlowConstants())))
    click.echo(f"held-out errors within one and two standard deviations: {made.attrs['coverage']}")
