"""A rough sphere or cylinder on a flat: force, approach, profile of mean pressure."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    finite_array,
    hinted,
    nearest,
    number_in,
    require,
)
from mbma_tables.common.display import Displayed, Variable, quantity, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import new_figure
from mbma_tables.contacts.contact import contact
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.law.make import contact_law
from mbma_tables.contacts.question import name_of_the_given
from mbma_tables.effects.attracting_body import AttractingBody, resolved
from mbma_tables.effects.force_law import (
    RTOL,
    Body,
    ForceLaw,
    PressedBody,
    force_law,
    forces,
    units_of,
)
from mbma_tables.islands.half_space import basis
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import resolve
from mbma_tables.theories.adhesion import Adhesive
from mbma_tables.theories.base import Theory
from mbma_tables.theories.calibrated.formulas import Spectrum, spectrum_of

SHAPES = ("sphere", "cylinder")
JOHNSON = (
    2 / math.e
)  # reference over R: approaches are Johnson's (5.57) in Hertz's contact
LAYER_RTOL = 1e-8  # tolerance of the layer's law, as far as its theory allows
# share of h_max by which a law exceeds the largest approach, so that it has the largest
# force
ROUNDING = 1e-3
MOMENTS = 128  # nodes of the effective radius
POINTS = 101  # points of a profile
COUNTED = 0.1  # share of the force above which a reason against the layer's law applies
# c and p of c/n^p, the standard deviation of one sphere's approach over h_rms, with n the
# width of the contact over the mean wavelength, and the least n: of boundary elements of 24
# spheres, `python -m generate rough_spheres`
CELLS = (0.62, 0.8)
NARROWEST = 1.5
UNTESTED = "adhesion: no rough sphere or cylinder that attracts was simulated"
WIDEST = 0.1  # contact radius over R, beyond which bodies are no half-spaces


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class RoughContact(Displayed):
    """A rough sphere or cylinder on a flat, by `rough_contact`; arrays shaped as the loads.

    Forces and areas of a cylinder are per length; profiles have 101 places in their last dimension.
    """

    reasons: dict[str, Any]  #: reasons why not `valid`, each with a mask
    layer: ContactLaw  #: the law of the surface
    units: dict[str, str]
    _body: Body
    approach: Numbers = quantity(
        "approach beyond touching mean planes [length]; negative if only peaks are in contact"
    )
    force: Numbers = quantity("normal force; N where units are known, of a cylinder N/mm")
    stiffness: Numbers = quantity("derivative of force by approach")
    area: Numbers = quantity("real contact area [length^2]")
    contact_radius: Numbers = quantity(
        "effective contact radius [length]; 3 pi/4 times the mean of r weighted by p "
        "dr, Hertz's radius in his contact (Greenwood, Tripp 1967)"
    )
    position: FloatArray = quantity(
        "distance from the middle [length]; up to the last contact"
    )
    pressure: FloatArray = quantity("mean pressure [stress]")
    mean_separation: FloatArray = quantity(
        "mean separation of the deformed faces [length]"
    )
    error: Numbers = quantity(
        "estimate of the relative numerical error of force; including that of the layer's law"
    )
    scatter: Numbers = quantity(
        "standard deviation of ln F at the approach; from the model uncertainty of the "
        "layer's law, and from the mean plane below the contact, which depends on the "
        "place on the faces"
    )
    pull_off: Numbers = quantity(
        "tension at which the bodies part, in the unit of force; 0 of bodies without "
        "adhesion"
    )
    valid: Any = quantity(
        "whether the law was tested for such contacts; at the places that carry nine "
        "tenths of the force, for contacts wider than 1.5 mean wavelengths and narrower "
        "than R/10"
    )

    def law(self, rtol: float = 1e-5) -> ForceLaw:
        """Force against approach as polynomials, from first contact to the largest of these.

        Parameters
        ----------
        rtol : float
            Relative error of the polynomials, in [1e-6, 0.1]; at 1e-5 about 400 contacts
            are solved.

        Examples
        --------
        >>> from mbma_tables import Surface, rough_contact
        >>> face = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")
        >>> ball = rough_contact(face, "5 mm", "110 GPa", approach=["1.5 um"]).law(rtol=1e-3)
        >>> f"{ball.force('1 um'):.4g} N, {ball.stiffness('1 um'):.3g} N/um"
        '18.41 N, 17.1 N/um'
        >>> f"{ball.approach('10 N'):.4g} um"
        '0.4478 um'
        """
        if self._body.attracts:
            raise InputError(
                "a law of force is of bodies without adhesion: it begins at first contact, "
                "where attraction pulls; ask rough_contact for its approaches or forces"
            )
        top = float(np.max(self.approach)) + ROUNDING * self.layer.h_max
        return force_law(self._body, top, number_in("rtol", rtol, 1e-6, 0.1))

    def _facts(self) -> dict[str, str]:
        names = ["approach", "force", "stiffness", "area", "contact_radius", "valid"]
        if self._body.attracts:
            names.insert(-1, "pull_off")
        facts = {"body": self._body.name}
        facts |= {
            name: shown(getattr(self, name), self.units.get(name, "1")) for name in names
        }
        return facts | {"theory": self.layer.theory, "surface": repr(self._body.surface)}

    def _variables(self) -> dict[str, Variable]:
        loads = np.ndim(self.approach)
        variables = super()._variables()
        return {
            n: v._replace(dims=("load", "place")[1 - loads :][: np.ndim(v.values)])
            for n, v in variables.items()
        }

    def _figure(self) -> Any:
        figure = new_figure(10, 4)
        units = self.units
        profile, curve = figure.subplots(1, 2)
        rows = [np.reshape(part, (-1, POINTS)) for part in (self.position, self.pressure)]
        force = np.ravel(self.force)
        approach = np.ravel(self.approach)
        order = np.argsort(approach)
        for k in order[np.unique(np.linspace(0, len(order) - 1, 5).astype(int))]:
            profile.plot(rows[0][k], rows[1][k], label=f"{force[k]:.3g} {units['force']}")
        profile.set(
            xlabel=f"distance from the middle [{units['position']}]",
            ylabel=f"pressure [{units['pressure']}]",
        )
        curve.plot(approach[order], force[order], marker=".", label="rough")
        order = order[force[order] >= 0]
        smooth = self._body.smooth_approach(
            force[order] / (self.layer.E_star * self._body.newtons)
        )
        curve.plot(smooth, force[order], "--", label="smooth (Hertz)")
        curve.set(
            xlabel=f"approach [{units['approach']}]",
            ylabel=f"force [{units['force']}]",
            yscale="linear" if self._body.attracts else "log",
        )
        for axes in (profile, curve):
            axes.legend()
            axes.grid(True, alpha=0.3)
        return figure


@hinted
def rough_contact(
    surface: AnySurface,
    radius: float | str,
    bodies: Bodies | float | str = 1.0,
    *,
    shape: str = "sphere",
    approach: ArrayLike | None = None,
    force: Any = None,
    reference: float | str | None = None,
    theory: str | Theory | None = None,
) -> RoughContact:
    """Press a rough sphere or cylinder on a flat: a half-space behind a contact law's layer.

    Roughness is a layer whose mean pressure is that of the law at the local mean separation
    (Greenwood and Tripp 1967), so contacts must be wide compared with its longest
    wavelength. Without roughness the contact is Hertz's.

    Parameters
    ----------
    surface : Surface
        Roughness of both faces together (`combined`).
    radius : float or str
        R [length]; of two curved bodies 1/R = 1/R1 + 1/R2.
    bodies : Bodies or float or str
        As for `contact`. With a hardness, the roughness yields and the bodies do not;
        results are for loading only. Spheres with an adhesion are answered in retreat, after they were pressed
        together, and may be pulled.
    shape : {"sphere", "cylinder"}
        A cylinder is long, in plane strain.
    approach, force : array_like or str
        One of them, in one dimension at most: the approach [length], or F: numbers, "10 N",
        or "5 N/mm" of a cylinder.
    reference : float or str, optional
        For a cylinder, the distance along the face [length] with zero displacement; by
        default 2 R/e, so that Hertz's approach is that of a cylinder's axis (K. L. Johnson,
        Contact Mechanics, 1985, Eq. 5.57).
    theory : str or theory, optional
        As for `contact`.

    Returns
    -------
    RoughContact

    Raises
    ------
    InputError, OutOfRangeError
        For numbers that are not positive and finite, loads beyond the layer's law, tensions beyond
        pull-off, and cylinders with an adhesion.
    ConvergenceError
        If the equation of the half-space is not solved, as for large soft spheres whose attraction is short.

    Examples
    --------
    >>> from mbma_tables import Surface, rough_contact
    >>> face = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")
    >>> found = rough_contact(face, "5 mm", "110 GPa", force=["1 N", "100 N"], theory="calibrated")
    >>> print(found.approach.round(3), found.contact_radius.round(1), found.units["force"])
    [-0.601  4.211] [ 63.6 157.8] N
    >>> print((1000 * found.pressure[:, 0]).round(), "MPa in the middle")
    [ 134. 1974.] MPa in the middle
    """
    if shape not in SHAPES:
        raise InputError(
            f"shape must be one of {SHAPES}, got {shape!r}; {nearest(str(shape), SHAPES)}"
        )
    law = contact_law(surface, bodies, theory, rtol=LAYER_RTOL)
    units = law.units
    plane = shape == "cylinder"
    largest = 1e30 * law.h_max
    R = number_in("radius", units.number("radius", radius), law.h_max, largest)
    fixed = JOHNSON * R if reference is None else units.number("reference", reference)
    if not plane and reference is not None:
        raise InputError("reference is of a cylinder: leave it out")
    layer_theory = resolve(theory, surface)
    fixed = number_in("reference", fixed, 1e-30 * R, largest)
    body = Body(law, R, plane, fixed, surface, layer_theory, *units_of(units, plane))
    attraction = law.setup.bodies.adhesion
    if attraction is not None:
        if plane:
            raise InputError(
                "cylinders that attract each other are not answered: their contacts in retreat "
                "are not found at all sizes; shape='sphere' is covered"
            )
        net = Adhesive(layer_theory, attraction, law.E_star)
        body = resolved(AttractingBody(**vars(body), net=net))
    if name_of_the_given({"approach": approach, "force": force}) == "approach":
        wanted = finite_array("approach", units.number("approach", approach))
        apart = -body.ends[1]
        require(
            "approach",
            wanted,
            wanted > apart,
            f"above {apart:.6g}, below which bodies are apart",
        )
    else:
        given = finite_array("force", forces(force, body, units.length))
        if not body.attracts:
            require("force", given, given > 0, "positive")
        scale = law.E_star * body.newtons
        wanted = np.reshape(
            [body.approach_at(value / scale) for value in given.ravel()],
            given.shape,
        )
    if wanted.ndim > 1:
        raise InputError(
            f"approach or force must be one number or a list, got shape {wanted.shape}"
        )
    return pressed(body, wanted)


def pressed(body: Body, wanted: FloatArray) -> RoughContact:
    """The contacts at some approaches [length]."""
    rows = []
    profiles = []
    rule = basis(MOMENTS)
    reasons: dict[str, list[bool]] = {}
    scale = body.law.E_star * body.newtons
    for k, approach in enumerate(map(float, wanted.ravel())):
        solution = body.solved(approach, RTOL)
        force, stiffness, area = body.quantities(solution)
        compressive = body.between(solution, body.compressive(solution), rule.v)
        spread = rule.root_weights**2 * compressive
        a = float(
            0.75 * math.pi * solution.radius * np.sum(spread * rule.v) / np.sum(spread)
        )
        scatter, against = _trust(body, solution, force)
        width = 2 * a / mean_wavelength(body.surface)
        if not body.attracts:
            # the mean plane below the contact: that of a cell
            of_cell = CELLS[0] / width ** CELLS[1] * float(body.surface.h_rms)
            scatter = math.hypot(scatter, of_cell * stiffness / force)
        if width < NARROWEST:
            against.append(f"the contact is narrower than {NARROWEST:g} mean wavelengths")
        for text in against:
            reasons.setdefault(text, [False] * wanted.size)[k] = True
        t = np.linspace(0, 1, POINTS)
        p, u = (body.between(solution, values, t) for values in (solution.p, solution.u))
        rows.append((scale * force, scale * stiffness, area, a, solution.error, scatter))
        p = p if body.attracts else np.maximum(p, 0)
        profiles.append((solution.radius * t, p * body.law.E_star, u))
    F, stiffness, area, a, error, scatter = (
        part.reshape(wanted.shape)[()] for part in np.array(rows).T
    )
    position, pressure, u = (
        np.array(profiles).swapaxes(0, 1).reshape(3, *wanted.shape, POINTS)
    )
    masks = {text: np.reshape(mask, wanted.shape) for text, mask in reasons.items()}
    masks |= {"the contact is wider than a tenth of the radius": a > WIDEST * body.radius}
    masks = {text: mask for text, mask in masks.items() if np.any(mask)}
    valid = ~np.logical_or.reduce([np.zeros(wanted.shape, bool), *masks.values()])
    return RoughContact(
        masks, body.law, body.units, body, wanted[()], F, stiffness, area, a, position, pressure, u,
        error + (0.0 if body.attracts else body.law.error), scatter, np.float64(scale * body.pull_off), valid,
    )  # fmt: skip


def _trust(body: Body, solution: PressedBody, force: float) -> tuple[float, list[str]]:
    """Standard deviation of ln F by that of the law, and reasons against the law.

    The law's deviation is alike at all places.
    """
    if body.attracts:
        return math.nan, [UNTESTED]
    law = body.law
    ends = body.ends
    u = np.clip(solution.u, *ends)
    bodies = Bodies(law.E_star, hardness=law.hardness)
    layer = contact(body.surface, bodies, mean_separation=u, theory=body.theory)
    spread = np.nan_to_num(layer.scatter, nan=0.0)
    scatter = body.integral(solution, solution.raised(spread * solution.p)) / force
    if body.integral(solution, solution.p * np.isnan(layer.scatter)) > COUNTED * force:
        scatter = math.nan
    shares = {
        text: body.integral(solution, solution.p * mask) / force
        for text, mask in layer.reasons.items()
    }
    return scatter, [text for text, share in shares.items() if share > COUNTED]


def mean_wavelength(surface: Any) -> float:
    """2 pi over the mean wavenumber, weighted by height variance [length]."""
    has_spectrum = getattr(surface, "q", None) is not None
    spectrum = (
        spectrum_of(surface)
        if has_spectrum
        else Spectrum.self_affine(float(surface.hurst), float(surface.zeta_1))
    )
    steep = float(surface.rms_gradient) / float(surface.h_rms) / spectrum.gradient
    return 2 * math.pi / (steep * float(np.sum(spectrum.variance * spectrum.x)))
