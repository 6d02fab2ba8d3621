"""Flow factors, asperity pressure and contact area of a rough gap, before contact and in it, for lubrication codes."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import FloatArray, hinted, number_in, require
from mbma_tables.common.display import Displayed, Variable, quantity, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import Line, draw_panels
from mbma_tables.contacts.contact import contact
from mbma_tables.contacts.quantities.lay import LAY, OPEN, SHEAR, WIDEST_LAY, factors
from mbma_tables.contacts.quantities.leakage import shipped_flow
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.treatment import mirrored
from mbma_tables.theories.base import Theory
from mbma_tables.theories.simulated.own_map import map_of
from mbma_tables.theories.simulated.reynolds import flow_and_couette
from mbma_tables.theories.tested import elastic_ranges, untested_areas

RANGE = (0.2, 50.0)  # u/h_rms
# simulated: A/A0 of the lightest contact, knots of curves in contact and before it, the
# first gap before it over the highest point, and standard deviations of ln phi before
# contact and of ln phi_s, of the grid and between the knots
LIGHTEST = 0.002
KNOTS = 7
CLEAR = 1.001
OWN = 0.01
OWN_SHEAR = 0.02
USEFUL = 0.5  # standard deviation of ln phi above which a flow factor is not valid


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FlowFactors(Displayed):
    """Patir and Cheng's factors of a rough gap, made by `flow_factors`; arrays of the shape of the gaps."""

    reasons: dict[str, Any]  #: reasons why not `valid`, each with a mask
    peklenik: float  #: length of the roughness along x over that along y
    surface: AnySurface
    units: dict[str, str]
    mean_separation: FloatArray = quantity("mean gap u [length]")
    phi_x: FloatArray = quantity(
        "pressure flow factor along x; flow is -phi u^3/(12 viscosity) dp/dx"
    )
    phi_y: FloatArray = quantity("pressure flow factor along y")
    # of two rough faces they add, weighted by their shares of h_rms^2 and signed (Patir and
    # Cheng 1979)
    shear_x: FloatArray = quantity(
        "shear flow factor phi_s along x; due to the roughness of the sliding face"
    )
    shear_y: FloatArray = quantity("shear flow factor phi_s along y")
    pressure: FloatArray = quantity("asperity pressure F/A0 [stress]")
    area: FloatArray = quantity("real over nominal contact area")
    scatter: FloatArray = quantity("model uncertainty (1 sd) of ln phi")
    shear_scatter: FloatArray = quantity("model uncertainty (1 sd) of ln phi_s")
    valid: Any = quantity(
        "whether flow through such gaps was simulated; of the factors, not of the pressure"
    )
    pressure_scatter: FloatArray = quantity(
        "model uncertainty (1 sd) of ln of the asperity pressure"
    )
    pressure_valid: Any = quantity(
        "whether asperity pressures at such gaps were simulated; as `contact(...).valid`"
    )
    _dims = ("gap",)

    K_x = property(
        lambda self: self.phi_x * self.mean_separation**3,
        doc="Flow coefficient phi_x u^3 [length^3].",
    )
    K_y = property(
        lambda self: self.phi_y * self.mean_separation**3,
        doc="Flow coefficient phi_y u^3 [length^3].",
    )

    def _facts(self) -> dict[str, str]:
        held = (
            "mean_separation",
            "phi_x",
            "phi_y",
            "pressure",
            "area",
            "valid",
            "pressure_valid",
        )
        numbers = {
            name: shown(getattr(self, name), self.units.get(name, "1")) for name in held
        }
        return numbers | {
            "peklenik": f"{self.peklenik:.3g}",
            "surface": repr(self.surface),
        }

    def _variables(self) -> dict[str, Variable]:
        flows = {"K_x": self.K_x, "K_y": self.K_y}
        more = {
            n: Variable(v, self.units[n], "flow coefficient phi u^3", self._dims)
            for n, v in flows.items()
        }
        return {**super()._variables(), **more}

    def _figure(self) -> Any:
        order = np.argsort(self.mean_separation)
        at = {
            name: np.asarray(values[order], float)
            for name, (values, *_) in self._variables().items()
        }
        panels = {
            "pressure flow factor": [
                Line(name, at[name], at["scatter"]) for name in ("phi_x", "phi_y")
            ],
            "shear flow factor": [
                Line(name, at[name], at["shear_scatter"])
                for name in ("shear_x", "shear_y")
            ],
            f"asperity pressure [{self.units['pressure']}]": [
                Line("pressure", at["pressure"], at["pressure_scatter"])
            ],
            "real contact area  A/A0": [Line("area", at["area"])],
        }
        return draw_panels(
            at["mean_separation"], panels, f"mean gap u [{self.units['mean_separation']}]"
        )


@hinted
def flow_factors(
    surface: AnySurface,
    mean_separation: ArrayLike,
    bodies: Bodies | float | str = 1.0,
    *,
    peklenik: float | None = None,
    theory: str | Theory | None = None,
) -> FlowFactors:
    """Pressure and shear flow factors and asperity pressure at mean gaps, for average Reynolds equations.

    Before contact the factors are those of an effective medium of Gaussian gaps, in contact
    those of the leakage law (`mbma_tables.contacts.quantities.lay`). The mean gap u is that of the
    deformed faces: Patir and Cheng's h_T, not their h.

    With "simulated", the default of a map, they are those of the surface's own map: Reynolds' equation is solved on its gaps, in contact those of a BEM simulation,
    at several mean gaps (half a minute for 256 x 256 points; ``theory="calibrated"`` takes
    none of it).

    Parameters
    ----------
    surface : Surface
        One surface, of both faces together (`combined`).
    mean_separation : array_like or str
        u [length], from 0.2 to 50 h_rms; above h_max there is no contact.
    bodies : Bodies or float or str
        As for `contact`.
    peklenik : float, optional
        Length of the roughness along x over that along y, from 1/8.5 to 8.5. Default: that
        of the map, x being its first axis, or of the spectrum, x being along the lay, else
        1 (isotropic). Not accepted for a simulated map.
    theory : str or theory, optional
        As for `contact`.

    Returns
    -------
    FlowFactors

    Raises
    ------
    InputError, OutOfRangeError
        For negative mean gaps, a Peklenik number outside its range, a batch of surfaces, and
        surfaces without the map that `theory` needs.

    Examples
    --------
    >>> from mbma_tables import Surface, flow_factors
    >>> bearing = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")
    >>> film = flow_factors(bearing, ["1 um", "1.5 um", "3 um"], "110 GPa", peklenik=3)
    >>> print(film.phi_x.round(2), film.phi_y.round(2), film.shear_y.round(2))
    [1.05 1.06 1.02] [0.5 0.7 0.9] [0.84 0.68 0.37]
    """
    found = contact(surface, bodies, mean_separation=mean_separation, theory=theory)
    if surface.labelled or surface.shape != ():
        raise InputError("flow factors need one surface, not a batch")
    u = np.ravel(found.mean_separation)
    h_rms = float(surface.h_rms)
    # a surface opened from the table of its simulation has no map for gaps before contact
    of_one_map = found.elastic_theory.gaps() is not None
    own = of_one_map and getattr(surface, "map", None) is not None
    low, high = RANGE
    require(
        "mean_separation",
        u,
        (u >= low * h_rms) & (u <= high * h_rms),
        f"from {low:g} to {high:g} h_rms",
    )
    gamma = (
        _peklenik(surface)
        if peklenik is None
        else number_in("peklenik", peklenik, 1 / WIDEST_LAY, WIDEST_LAY)
    )
    area = np.ravel(found.area)
    leak = found.leakage
    if own:
        if peklenik is not None:
            raise InputError(
                "peklenik is not of a map that is simulated: leave it out, or give theory='calibrated'"
            )
        (phi_x, phi_y), shear = _simulated(found, u)
        of_lay = 0.0
        far = False
    else:
        ratio, shear = factors(u / h_rms, area, gamma, shipped_flow().constants)
        phi_x, phi_y = np.ravel(leak.K) / u**3 * ratio
        of_lay = LAY[0] * area ** LAY[1] * np.log(gamma)
        far = gamma > WIDEST_LAY or gamma < 1 / WIDEST_LAY
    of_contact = np.where(
        area > 0, np.nan_to_num(np.ravel(leak.scatter), nan=np.inf), 0.0
    )
    scatter = np.sqrt((OWN if own else OPEN) ** 2 + of_contact**2 + of_lay**2)
    reasons = {text: np.ravel(mask) for text, mask in leak.reasons.items()}
    # the lightest contacts were not simulated, but their flow is nearly that before contact
    light, _ = untested_areas(area, elastic_ranges()["area"])
    reasons.pop(light, None)
    reasons |= {
        f"the lay is longer than {WIDEST_LAY:g} to 1, beyond simulated flow": np.full(
            u.shape, far
        )
    }
    reasons |= {f"the model uncertainty of ln phi is above {USEFUL:g}": scatter > USEFUL}
    units = {name: found.units[name] for name in ("mean_separation", "pressure")}
    units |= dict.fromkeys(("K_x", "K_y"), found.units["flow_coefficient"])
    kept = {text: mask for text, mask in reasons.items() if np.any(mask)}
    shear_scatter = np.full(u.shape, OWN_SHEAR if own else SHEAR)
    valid = ~np.logical_or.reduce(list(reasons.values()))
    flows = (u, phi_x, phi_y, shear[0], shear[1])
    asperities = (np.ravel(found.pressure), area)
    # the lightest contacts count here: their pressure depends on the highest points alone
    of_pressure = np.ravel(found.scatter), np.ravel(found.valid)
    uncertain = scatter, shear_scatter, valid, *of_pressure
    return FlowFactors(
        kept, float(gamma), surface, units, *flows, *asperities, *uncertain
    )


def _simulated(found: Any, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """phi and phi_s along both axes, shape (2, n), of the gaps of a map: simulated ones, and wider ones undeformed."""
    surface: Any = found.surface
    whole = map_of(surface)
    theory = found.elastic_theory
    h_rms = float(surface.h_rms)
    heights = whole.heights - whole.heights.mean()

    def flow(gap: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        cell = gap if whole.periodic else mirrored(gap)
        sides = cell.shape[0] * whole.steps[0], cell.shape[1] * whole.steps[1]
        K, carried = flow_and_couette(cell, sides)
        return float(cell.mean()), K / cell.mean() ** 3, (cell.mean() - carried) / h_rms

    lightest = float(contact(surface, area=LIGHTEST, theory=theory).mean_separation)
    knots = (
        np.geomspace(u.min(), lightest, KNOTS)[:-1] if u.min() < lightest else np.empty(0)
    )
    pressed = (
        contact(surface, mean_separation=gap, theory=theory)
        for gap in (*knots.tolist(), lightest)
    )
    rows = [flow(one.map().gap) for one in pressed]
    top = float(heights.max())
    rows += [
        flow(known - heights)
        for known in np.geomspace(top * CLEAR, max(u.max(), 2 * top), KNOTS)
    ]
    at, phi, shear = (np.array(part) for part in zip(*rows, strict=True))
    # at their own knots, whose flow is far from blocked
    leak = found.leakage
    wide = slice(knots.size, None)
    curve = PchipInterpolator(np.log(at[wide]), np.log(phi[wide]))
    beyond = np.exp(curve(np.log(np.maximum(u, at[knots.size])))).T
    own = np.where(
        u > at[knots.size], beyond, np.stack([np.ravel(leak.x), np.ravel(leak.y)]) / u**3
    )
    return own, PchipInterpolator(np.log(at), shear)(np.log(np.maximum(u, at[0]))).T


def _peklenik(surface: Any) -> float:
    """gamma of the directions in which the height variance lies: (1 - c)/c, c the mean of cos^2 to the first axis."""
    treated = getattr(surface, "map", None)
    if treated is None:
        return float(getattr(surface, "anisotropy", None) or 1.0)
    power = np.abs(np.fft.fft2(treated.heights - treated.heights.mean())) ** 2
    q = np.meshgrid(
        *map(np.fft.fftfreq, treated.heights.shape, treated.steps), indexing="ij"
    )
    squared = q[0] ** 2 + q[1] ** 2
    squared[0, 0] = 1.0
    c = float(np.sum(power * q[0] ** 2 / squared) / power.sum())
    return (1 - c) / max(c, 1e-9)
