"""Flow through simulated contacts, and every law of it: what `generate.leakage_law` fits and compares."""

import dataclasses

import numpy as np
import xarray as xr

from generate.boundary_elements.evidence import Simulated, TheoryCurve, simulated
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws import effective_medium as leakage
from mbma_tables.laws.calibrated import Constants, Law, force_at_area, light_factor
from mbma_tables.laws.effective_medium import FlowConstants
from mbma_tables.theories import get_theory
from mbma_tables.theories.yielding import Yielding

MIN_WAVES = 4  # longest waves a side: below, the cell's own scatter rules


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

    def law(self, constants: Constants) -> tuple[FloatArray, FloatArray]:
        """A/A0 and mean gap by the calibrated law, from the spectrum and h_max, and a hardness, the last of `node`."""
        if self.kind == "yielded":
            gradient = self.spectrum.gradient
            curve = TheoryCurve(Yielding(get_theory("calibrated"), float(self.node[-1]) * gradient), self)
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
        self._known: dict[FlowConstants, FloatArray] = {}

    def medium(self, flow: FlowConstants, area: FloatArray | None = None, u: FloatArray | None = None) -> FloatArray:
        """The law; of another area and mean gap than the calibrated law's where given."""
        own, gap = (self.area, self.u) if area is None or u is None else (area, u)
        factor = self.factor(flow, own) if area is not None else self._log_factor(flow)
        return np.asarray(factor + 3 * np.log(gap) + np.log(leakage.wide_gap(gap)))

    def _log_factor(self, flow: FlowConstants) -> FloatArray:
        """ln R at the loads, found once for each set of constants."""
        if flow not in self._known:
            self._known[flow] = leakage.log_factor(self._gaps, flow)
        return self._known[flow]

    def factor(self, flow: FlowConstants, area: FloatArray) -> FloatArray:
        """ln R at any contact fractions, by interpolation between the loads."""
        kept = self._gaps.area < flow.threshold - leakage.NEAREST
        odds = log_odds(self._gaps.area[kept], flow.threshold)
        inside = np.minimum(area, flow.threshold * (1 - 1e-9))
        found = np.interp(log_odds(inside, flow.threshold), odds, self._log_factor(flow)[kept])
        return np.where(area < flow.threshold, found, -np.inf)

    def closed_form(self, flow: FlowConstants) -> FloatArray:
        """The closed form."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(flow.closed_form(self.u, self.area)))

    def parallel_plates(self, flow: FlowConstants) -> FloatArray:
        """u^3."""
        return 3 * np.log(self.u)

    def patir_cheng(self, flow: FlowConstants) -> FloatArray:
        """Patir and Cheng (1978), isotropic: 1 - 0.9 exp(-0.56 u) beside u^3."""
        return 3 * np.log(self.u) + np.log(1 - 0.9 * np.exp(-0.56 * self.u))

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
