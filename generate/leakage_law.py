"""The law of leakage and others: constants, errors, the table.

Constants are from the training set, errors are those on held-out surfaces.
"""

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
from generate.boundary_elements.surfaces import (
    HELD_OUT_SPECTRUM,
    HELD_OUT_SURFACE,
    TRAINING,
)
from generate.calibrated_file import (
    bins,
    by_bin,
    fitted,
    folds,
    law_table,
    rms,
    within,
    write_part,
)
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.workers import results
from mbma_tables.contacts.quantities import effective_medium as leakage
from mbma_tables.contacts.quantities.effective_medium import FlowConstants
from mbma_tables.contacts.quantities.leakage import GROUP
from mbma_tables.tables.splines import coefficients
from mbma_tables.theories import resolve
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
    force_at_area,
    light_factor,
)
from mbma_tables.theories.calibrated.table import load
from mbma_tables.theories.dataset import FILE
from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
from mbma_tables.theories.mbma.theory import Mbma
from mbma_tables.theories.persson import Persson
from mbma_tables.theories.yielding.theory import Yielding

MIN_WAVES = 4  # longest waves a side: below, the cell's own scatter rules
# contact fractions between which errors are stated
EDGES = (0.004, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
# errors of ln k that count as one: a + b (A/A0)^2, about what cells of one spectrum differ by
NOISE = (0.1, 6.0)
COVERED = {
    "hurst": (0.1, 1.0),
    "log_zeta_1": (np.log(3.0), np.log(1e5)),
    "log_odds": (-14.0, 5.5),
}
NODES = {
    "hurst": np.linspace(0.04, 1.06, 14),
    "log_zeta_1": np.linspace(np.log(2.0), np.log(2e5), 14),
    "log_odds": np.linspace(-14.6, 6.2, 53),  # ln A/(Ac - A)
}
CERTIFICATE = 600  # held-out surfaces, each at its own odds
BLOCKED = -20.0  # residual of what a law blocks and simulation does not
# contact fractions at which gaps of surfaces that yield are found
YIELDED_AREAS = np.concatenate(
    [np.geomspace(0.001, 0.1, 16), np.linspace(0.12, 0.418, 32)]
)
LARGEST_YIELDED = 0.4  # A/A0 up to which their constants are fitted
LARGE = 64.0  # zeta_1 from which surfaces decide between laws, and no constant
DEGREE = 5
PROCESSES = 2
TABLE = files.ROOT / "tables" / "calibrated.nc"


def log_odds(area: FloatArray, threshold: float) -> FloatArray:
    """The table's axis of contact, ln A/(Ac - A)."""
    return np.asarray(np.log(area / (threshold - area)))


@dataclasses.dataclass(frozen=True, eq=False)
class Case(Simulated):
    """One surface, and the flow through it.

    `log_k` is of the geometric mean of both axes, where neither is blocked.
    """

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

    def law(self, constants: CalibratedConstants) -> tuple[FloatArray, FloatArray]:
        """A/A0 and mean gap by the calibrated law, from the spectrum and h_max.

        And from a hardness where it yielded, the last of `node`.
        """
        if self.kind == "yielded":
            hardness = float(self.node[-1]) * self.spectrum.gradient
            curve = TheoryCurve(Yielding(resolve("calibrated"), hardness), self.surface)
            return curve.area(self.force), curve.separation(self.force)
        law = SpectrumLaw(self.spectrum, self.h_max, constants)
        return law.area(self.force), law.separation(self.force)

    @functools.cached_property
    def yielded(self) -> FloatArray:
        """Share of the contact at the hardness, by the calibrated law."""
        if self.kind != "yielded":
            return np.zeros(self.force.shape)
        hardness = float(self.node[-1]) * self.spectrum.gradient
        theory = Yielding(resolve("calibrated"), hardness)
        separation = self.law(CONSTANTS)[1]
        return np.asarray(theory.loaded(self.surface, separation).yielded)


def cases(data: xr.Dataset) -> list[Case]:
    """Surfaces of a file by `python -m generate boundary_elements --of leakage`."""
    surfaces = []
    for one, fields in simulated(data):
        solved = np.isfinite(one.force.values)
        force = one["force"].values[solved]
        area = one["area"].values[solved]
        u = one["mean_separation"].values[solved]
        flow = one["flow"].values[solved]
        # flow along each of both axes
        blocked = (flow == 0).mean(axis=1)
        is_open = blocked == 0
        surface = Case(
            **vars(fields),
            force=force[is_open],
            area=area[is_open],
            u=u[is_open],
            log_k=np.log(flow[is_open]).mean(axis=1),
            blocked=np.stack([area, blocked]),
        )
        surfaces.append(surface)
    return surfaces


class Flow:
    """Laws of flow on one surface, each as ln k at the surface's loads; -inf where blocked."""

    def __init__(self, one: Case, constants: CalibratedConstants) -> None:
        self.one = one
        self.area, self.u = one.law(constants)
        # gaps of contacts that yield are taken for those of elastic ones of equal area
        factor = light_factor(one.spectrum.alpha, constants)
        force_of_area = force_at_area(self.area, factor, constants)
        load = force_of_area if one.kind == "yielded" else one.force
        self._gaps = leakage.gaps(one.spectrum, load, constants)
        self._medium = self._gaps
        if one.kind == "yielded":
            # the medium's are those of smaller elastic contacts
            loads = force_at_area(YIELDED_AREAS, factor, constants)
            self._medium = leakage.gaps(one.spectrum, loads, constants)

    @functools.cache  # noqa: B019 - there are as many surfaces as the file has
    def log_factor(self, flow: FlowConstants) -> FloatArray:
        return leakage.log_factor(self._medium, flow)

    def medium(
        self,
        flow: FlowConstants,
        area: FloatArray | None = None,
        u: FloatArray | None = None,
    ) -> FloatArray:
        """The law; of another area and mean gap than the calibrated law's where there are any."""
        factor = self.log_factor(flow)
        gap = self.u if u is None else u
        if self.one.kind == "yielded":
            loaded = self.area if area is None else area
            area = flow.elastic_area(loaded, self.one.yielded)
        if area is not None:
            # by interpolation between the loads
            percolates = self._medium.area < flow.threshold - leakage.NEAREST
            odds = log_odds(self._medium.area[percolates], flow.threshold)
            # areas above the threshold have no odds
            below_threshold = np.minimum(area, flow.threshold * (1 - 1e-9))
            odds_of_area = log_odds(below_threshold, flow.threshold)
            interpolated = np.interp(odds_of_area, odds, factor[percolates])
            factor = np.where(area < flow.threshold, interpolated, -np.inf)
        return np.asarray(factor + 3 * np.log(gap) + np.log(leakage.wide_gap(gap)))

    def closed_form(self, flow: FlowConstants) -> FloatArray:
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(flow.closed_form(self.u, self.area)))

    def critical_junction(self, flow: FlowConstants) -> FloatArray:
        """Persson and Yang (2008): the cube of the gap u1 where contact percolates.

        That gap is the one at the magnification at which the contact fraction is the threshold.
        """
        share = self._gaps.share
        # contact at each magnification: what is left at the last one, and what leaves it after this
        cover = self.area[:, None] + np.cumsum(share[:, ::-1], axis=1)[:, ::-1]
        log_k = np.full(self.area.shape, -np.inf)
        for row in np.flatnonzero(self.area < flow.threshold):
            leaves = share[row] > 0
            rising_cover = cover[row][leaves][::-1]
            gap = np.interp(
                flow.threshold, rising_cover, self._gaps.mean[row][leaves][::-1]
            )
            log_k[row] = 3 * np.log(max(gap, 1e-300))
        return log_k

    def bruggeman(self, flow: FlowConstants, n: float) -> FloatArray:
        """Bruggeman's medium of n dimensions on the same gaps.

        sum w (h^3 - k)/(h^3 + (n - 1) k) = A/(n - 1).
        """
        share, log_cube = self._gaps.quadrature
        # with K = (n - 1) k: h^3 - k = (1 + 1/(n-1)) (h^3 - K)/2 + ..., so the same balance at
        # another right side
        total = share.sum(axis=1)
        ratio = 1 / (n - 1)
        blocked = (2 * ratio * self._gaps.area - (1 - ratio) * total) / (1 + ratio)
        with np.errstate(invalid="ignore"):
            log_k = leakage.effective_medium(share, log_cube, blocked) + np.log(ratio)
        return np.where(self._gaps.area < 1 - 1 / n, log_k, -np.inf)


Form = Callable[[Flow, FlowConstants], FloatArray]  # ln k by a law


def fit(training: Sequence[Flow], first: FlowConstants | None = None) -> FlowConstants:
    """Constants of the law and of the closed form, by robust least squares.

    Of contact fractions up to `leakage.LARGEST_AREA`.
    """
    seen = [flow for flow in training if flow.one.isotropic]
    largest_area = leakage.LARGEST_AREA

    def residuals(form: Form, constants: FlowConstants) -> list[FloatArray]:
        parts = []
        for flow in seen:
            noise = NOISE[0] + NOISE[1] * flow.one.area**2
            miss = (form(flow, constants) - flow.one.log_k) / noise
            # the law may block what was open
            parts.append(np.maximum(miss[flow.one.area < largest_area], BLOCKED))
        return parts

    def best(
        start: FlowConstants,
        names: tuple[str, ...],
        form: Form,
        **options: Any,
    ) -> FlowConstants:
        residuals_of_form = functools.partial(residuals, form)
        constants = fitted(start, names, residuals_of_form, diff_step=0.01, **options)
        rounded = {name: round(getattr(constants, name), 3) for name in names}
        return dataclasses.replace(constants, **rounded)

    start = first or FlowConstants()
    law = best(start, ("threshold", "obstruction"), Flow.medium, x_scale=[0.01, 0.1])
    found = best(law, ("prefactor", "exponent"), Flow.closed_form)
    seen = [flow for flow in training if flow.one.kind == "yielded"]
    if not seen:
        return found
    # up to where they block, which is at larger areas than for elastic contacts
    largest_area = LARGEST_YIELDED
    names = ("yielded_threshold", "yielded_exponent", "yielded_power")
    return best(found, names, Flow.medium, x_scale=[0.01, 0.1, 1.0])


def left_out(training: Sequence[Flow], constants: FlowConstants) -> FloatArray:
    """Bias, root mean square and number of errors on surfaces that the constants did not see.

    Surfaces of the training set, of which a fold is left out at a time.
    """
    flows = [flow for flow in training if SETS["training"](flow.one)]
    parts = []
    for others, unseen in folds(range(len(flows))):
        constants_of_others = fit([flows[k] for k in others], constants)
        parts += [errors(flows[k], flows[k].medium(constants_of_others)) for k in unseen]
    return summary(parts)


def medium_of_simulated(flow: Flow, constants: FlowConstants) -> FloatArray:
    """The law with the simulated area and mean gap."""
    return flow.medium(constants, flow.one.area, flow.one.u)


def bruggeman_of_threshold(flow: Flow, constants: FlowConstants) -> FloatArray:
    """Bruggeman's medium in as many dimensions as have a threshold of 0.42."""
    return flow.bruggeman(constants, 1 / (1 - 0.42))


def bruggeman_of_plane(flow: Flow, constants: FlowConstants) -> FloatArray:
    return flow.bruggeman(constants, 2.0)


def patir_and_cheng(flow: Flow, _: FlowConstants) -> FloatArray:
    """Their flow factor of 1978, for isotropic roughness."""
    return 3 * np.log(flow.u) + np.log(1 - 0.9 * np.exp(-0.56 * flow.u))


def parallel_plates(flow: Flow, _: FlowConstants) -> FloatArray:
    return 3 * np.log(flow.u)


LAWS: dict[str, Form] = {
    "calibrated": Flow.medium,
    "medium, simulated area and gap": medium_of_simulated,
    "closed form": Flow.closed_form,
    "Bruggeman, n = 1/(1 - 0.42)": bruggeman_of_threshold,
    "Bruggeman, n = 2": bruggeman_of_plane,
    "critical junction": Flow.critical_junction,
    "Patir and Cheng": patir_and_cheng,
    "parallel plates": parallel_plates,
}
SETS: dict[str, Callable[[Case], bool]] = {
    "training": lambda one: one.plain and one.split == TRAINING,
    "held-out surfaces": lambda one: one.plain and one.split == HELD_OUT_SURFACE,
    "held-out spectra": lambda one: one.plain and one.split == HELD_OUT_SPECTRUM,
    "held out": lambda one: one.plain and one.split != TRAINING,
    "plateaus": lambda one: one.kind == "plateau",
    "stretched": lambda one: one.kind == "stretched",
    "yielded, training": lambda one: one.kind == "yielded" and one.split == TRAINING,
    "yielded, held out": lambda one: one.kind == "yielded" and one.split != TRAINING,
    "zeta_1 32, two waves": lambda one: one.zeta_1 == 32 and one.waves < MIN_WAVES,
    "zeta_1 64 and 128": lambda one: one.zeta_1 >= LARGE,
}


def errors(flow: Flow, log_k: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A/A0 and ln(law/simulation), where both are open."""
    is_open = np.isfinite(log_k)
    return flow.one.area[is_open], log_k[is_open] - flow.one.log_k[is_open]


def summary(
    parts: Sequence[tuple[FloatArray, FloatArray]],
    edges: Sequence[float] = EDGES,
) -> FloatArray:
    """Bias, root mean square and number of errors between contact fractions."""
    area, miss = np.concatenate([*parts, np.empty((2, 0))], axis=1)
    return by_bin(area, miss, edges, np.mean, rms, np.size)


def noise_floor(surfaces: Sequence[Case], edges: Sequence[float] = EDGES) -> FloatArray:
    """Standard deviation of ln k between cells of one spectrum at equal load, by contact."""
    parts = []
    for node in {one.node for one in surfaces if one.isotropic}:
        cells = [one for one in surfaces if one.node == node]
        if len(cells) == 1:
            continue
        # loads that all cells have: those at which a cell is blocked are the last
        loads = min(one.log_k.size for one in cells)
        area = np.array([one.area[:loads] for one in cells])
        log_k = np.array([one.log_k[:loads] for one in cells])
        parts.append((area.mean(axis=0), log_k.var(axis=0, ddof=1)))
    area, variance = np.concatenate(parts, axis=1)
    return np.asarray(np.sqrt(by_bin(area, variance, edges, np.mean)[:, 0]))


def of_theories(flows: Sequence[Flow], constants: FlowConstants) -> dict[str, FloatArray]:
    """Errors by area and mean gap of other theories on self-affine surfaces.

    Nothing was fitted to these.
    """
    alike = [
        flow for flow in flows if flow.one.kind == "self_affine" and flow.one.isotropic
    ]
    errors_of_theories = {}
    for theory in (Mbma(outside="nan"), Persson(), GreenwoodWilliamson()):
        parts = []
        for flow in alike:
            curve = TheoryCurve(theory, flow.one.surface)
            area = curve.area(flow.one.force)
            u = curve.separation(flow.one.force)
            reached = np.isfinite(u)
            log_k = np.full(u.shape, -np.inf)
            log_k[reached] = flow.medium(constants, area[reached], u[reached])
            parts.append(errors(flow, log_k))
        errors_of_theories[theory.name] = summary(parts)
    return errors_of_theories


def _row(
    constants: FlowConstants, contact: CalibratedConstants, hurst: float
) -> FloatArray:
    area = constants.threshold / (1 + np.exp(-NODES["log_odds"]))
    factors = []
    for log_zeta in NODES["log_zeta_1"]:
        spectrum = Spectrum.self_affine(hurst, float(np.exp(log_zeta)))
        factors.append(leakage.contact_factor(spectrum, area, constants, contact))
    return np.array(factors)


def accuracy_by_set(
    flows: Sequence[Flow],
    constants: FlowConstants,
) -> tuple[list[str], FloatArray]:
    """Names of the sets that have surfaces; errors by set, law and contact fraction."""
    errors_of_laws = {}
    for label, law in LAWS.items():
        errors_of_laws[label] = [errors(flow, law(flow, constants)) for flow in flows]

    names = []
    rows = []
    for name, is_member in SETS.items():
        members = [number for number, flow in enumerate(flows) if is_member(flow.one)]
        if not members:
            continue
        row = []
        for misses in errors_of_laws.values():
            misses_of_set = [misses[number] for number in members]
            row.append(summary(misses_of_set))
        names.append(name)
        rows.append(row)
    return names, np.array(rows)


def dataset(surfaces: Sequence[Case], contact: CalibratedConstants) -> xr.Dataset:
    """The group `leakage` of the calibrated law's file, with that law's constants."""
    flows = [Flow(one, contact) for one in surfaces]
    constants = fit([flow for flow in flows if flow.one.split == TRAINING])
    jobs = [(constants, contact, hurst) for hurst in NODES["hurst"]]
    values = np.array([*results("table", _row, jobs, PROCESSES)])

    sets, accuracy = accuracy_by_set(flows, constants)
    stated = {"calibrated": left_out(flows, constants), **of_theories(flows, constants)}
    scatter = np.array([rows[:, 1] for rows in stated.values()])
    isotropic = [one.blocked for one in surfaces if one.isotropic]
    area, blocked = np.concatenate(isotropic, axis=1)
    arrays = {
        "spline": (
            [f"{name}_knot" for name in NODES],
            coefficients(values, DEGREE, 3).astype("f4"),
        ),
        "accuracy": (("set", "law", "contact", "statistic"), accuracy),
        "stated_scatter": (("theory", "contact"), scatter),
        "noise": ("contact", noise_floor(surfaces)),
        "share_blocked": ("contact", by_bin(area, blocked, EDGES, np.mean)[:, 0]),
        **bins(EDGES, np.add(EDGES[1:], EDGES[:-1]) / 2),
    }

    largest_simulated, largest = certificate(values, constants, contact)
    facts: dict[str, Any] = {
        "theories": " ".join(stated),
        "laws": "; ".join(LAWS),
        "sets": "; ".join(sets),
        "largest_error_simulated": largest_simulated,
        "largest_error_log_factor": largest,
        "coverage": np.array(coverage(flows, constants, stated["calibrated"])),
    }
    constants_of_laws = {"flow": constants, "law": contact}
    return law_table(
        "leakage", NODES, COVERED, arrays, constants=constants_of_laws, facts=facts
    )


def certificate(
    values: FloatArray,
    constants: FlowConstants,
    contact: CalibratedConstants,
) -> tuple[float, float]:
    """Largest errors of ln R at held-out surfaces up to `LARGE`, and of all.

    Below `leakage.LARGEST_AREA`.
    """
    table = RegularGridInterpolator(tuple(NODES.values()), values, method="quintic")
    rng = np.random.default_rng(21)
    last = log_odds(np.array(leakage.LARGEST_AREA), constants.threshold)
    odds = np.sort(rng.uniform(COVERED["log_odds"][0], last, 12))
    area = constants.threshold / (1 + np.exp(-odds))

    def drawn(low: float, high: float) -> float:
        # half of them at the ends of an axis, where bands of the medium hold few wavenumbers
        # and errors are largest
        place: float = np.clip(rng.uniform(-0.5, 1.5), 0, 1)
        return low + (high - low) * place

    largest_simulated = 0.0
    largest = 0.0
    for _ in range(CERTIFICATE):
        hurst = drawn(*COVERED["hurst"])
        log_zeta = drawn(*COVERED["log_zeta_1"])
        spectrum = Spectrum.self_affine(hurst, float(np.exp(log_zeta)))
        exact = leakage.contact_factor(spectrum, area, constants, contact)
        columns = [np.full(odds.size, hurst), np.full(odds.size, log_zeta), odds]
        points = np.stack(columns, axis=1)
        error = float(np.abs(table(points) - exact).max())
        largest = max(largest, error)
        if log_zeta <= np.log(LARGE):
            largest_simulated = max(largest_simulated, error)
    return largest_simulated, largest


def coverage(
    flows: Sequence[Flow],
    constants: FlowConstants,
    stated: FloatArray,
) -> list[float]:
    """Shares of held-out errors within one and two of the stated scatter.

    Of errors up to the largest area of a valid answer.
    """
    unseen = [flow for flow in flows if SETS["held out"](flow.one)]
    parts = [errors(flow, flow.medium(constants)) for flow in unseen]
    area, miss = np.concatenate(parts, axis=1)
    middle = (np.array(EDGES[1:]) + np.array(EDGES[:-1])) / 2
    sizes = miss / np.interp(area, middle, stated[:, 1])
    return within(sizes[area < leakage.LARGEST_AREA])


def write(path: pathlib.Path, evidence: pathlib.Path = FILE) -> xr.Dataset:
    """Fit, and write the group into the calibrated law's file; what it holds."""
    made = dataset(cases(files.dataset("leakage", evidence)), load(path).constants)
    write_part(path, made, GROUP)
    return made


@click.command()
@click.argument(
    "evidence", type=click.Path(path_type=pathlib.Path, exists=True), default=FILE
)
@click.option(
    "--table",
    type=click.Path(path_type=pathlib.Path),
    default=TABLE,
    help="The library's file.",
)
def leakage_law(evidence: pathlib.Path, table: pathlib.Path) -> None:
    """Fit the law of leakage to the training set of EVIDENCE.

    Write it beside the calibrated law.
    """
    made = write(table, evidence)
    names = dataclasses.asdict(FlowConstants())
    click.echo(", ".join(f"{name} {made.attrs[f'flow_{name}']:g}" for name in names))
    covered = made.attrs["coverage"]
    click.echo(f"held-out errors within one and two standard deviations: {covered}")
