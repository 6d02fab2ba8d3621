"""How the contact of a map depends on its short cut-off, by simulations at several of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array, positive_array, require
from mbma_tables.common.display import Displayed, Variable, quantity, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import Line, draw_panels
from mbma_tables.common.progress import shown as progress
from mbma_tables.common.shared import shared_property
from mbma_tables.contacts.contact import contact, contact_of
from mbma_tables.surfaces.map_simulation import MIN_POINTS, ROUNDING
from mbma_tables.surfaces.maps import without_shorter
from mbma_tables.surfaces.spectral import NO_POWER
from mbma_tables.theories.simulated.own_map import map_of
from mbma_tables.theories.simulated.theory import Simulated

if TYPE_CHECKING:
    from mbma_tables.bodies.bodies import Bodies
    from mbma_tables.contacts.result import Contact
    from mbma_tables.surfaces.any_surface import AnySurface

# cut-offs over the shortest wavelength
FACTORS = (1.0, 2**0.5, 2.0, 2**1.5, 4.0)
INDEPENDENT = 0.05  # largest change of ln of a quantity per octave that counts as none
WHY = "chosen for a study of resolution"
STUDIED = ("area", "mean_separation", "stiffness")


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ResolutionStudy(Displayed):
    """Contact of a map simulated at several short cut-offs, made by `resolution_study`.

    Arrays have shape (cut-offs, pressures), but for the cut-offs and the pressures themselves.
    """

    contacts: tuple[Contact, ...]  #: at all pressures, one for each cut-off
    units: dict[str, str]
    cutoff: FloatArray = quantity("shortest wavelength that is simulated [length]")
    pressure: FloatArray = quantity("nominal pressure F/A0 [stress]")
    area: FloatArray = quantity("real over nominal contact area")
    mean_separation: FloatArray = quantity("mean gap u [length]")
    stiffness: FloatArray = quantity("-dF/du over A0 [stress/length]")
    area_scatter: FloatArray = quantity("model uncertainty (1 sd) of ln of the area")
    valid: Any = quantity("whether the contact at this cut-off is valid")
    _dims = ("cutoff", "pressure")

    @shared_property
    def flow(self) -> FloatArray:
        """Flow coefficient K of the gaps [length^3], zero where blocked; solved when it is first read."""
        return np.array([each.leakage.K for each in self.contacts])

    def change(self, name: str) -> FloatArray:
        """Change of ln of a quantity with the last octave of wavelengths, at each pressure.

        Parameters
        ----------
        name : {"area", "mean_separation", "stiffness", "flow"}
            For the area -0.3, for instance, where it is exp(-0.3) times as large with them.
            NaN where flow is blocked.

        Raises
        ------
        InputError
            For another name.
        """
        if name not in (*STUDIED, "flow"):
            raise InputError(
                f"a study has {', '.join(STUDIED)} and flow, and no {name!r}"
            )
        values = getattr(self, name)
        octaves = np.log2(self.cutoff / self.cutoff[0])
        # the cut-off next to twice the shortest
        other = 1 + int(np.argmin(np.abs(octaves[1:] - 1)))
        with np.errstate(divide="ignore", invalid="ignore"):
            change = np.log(values[0] / values[other]) / octaves[other]
        return np.where(np.isfinite(change), change, np.nan)

    def independent(self, name: str) -> Any:
        """Whether a quantity hardly depends on the cut-off, at each pressure.

        It then changes by less than 5% with the last octave of wavelengths.
        """
        return np.abs(self.change(name)) < INDEPENDENT

    def statement(self) -> str:
        """A line on what the last octave of wavelengths does, by these simulations."""
        parts = []
        for name in STUDIED:
            factors = np.exp(-self.change(name))
            # where nothing touches, nothing changes
            factors = factors[np.isfinite(factors)]
            if not factors.size:
                continue
            ends = dict.fromkeys(f"{end:.3g}" for end in (factors.min(), factors.max()))
            own = " (independent of it)" if self.independent(name).all() else ""
            parts.append(f"{name} {' to '.join(ends)} times{own}")
        unit = f" {self.units['cutoff']}".replace(" length", "")
        return (
            f"without wavelengths below {2 * self.cutoff[0]:.4g}{unit}, twice the shortest, "
            f"at equal pressure by simulation: {', '.join(parts)}"
        )

    def _facts(self) -> dict[str, str]:
        held = ("cutoff", "pressure", *STUDIED)
        facts = {
            name: shown(getattr(self, name), self.units.get(name, "1")) for name in held
        }
        return facts | {"resolution": self.statement(), "valid": shown(self.valid)}

    def _variables(self) -> dict[str, Variable]:
        found = dict(super()._variables())
        for name in self._dims:
            found[name] = found[name]._replace(dims=(name,))
        return found

    def _figure(self) -> Any:
        panels = {}
        for name, label in {
            "area": "real contact area  A/A0",
            "mean_separation": f"mean gap u [{self.units['mean_separation']}]",
            "stiffness": f"stiffness [{self.units['stiffness']}]",
            "flow": f"flow coefficient [{self.units['flow']}]",
        }.items():
            lines = []
            for k, pressure in enumerate(self.pressure):
                scatter = self.area_scatter[:, k] if name == "area" else None
                text = f"{pressure:.3g} {self.units['pressure']}"
                lines.append(Line(text, getattr(self, name)[:, k], scatter))
            panels[label] = lines
        return draw_panels(self.cutoff, panels, f"short cut-off [{self.units['cutoff']}]")


def resolution_study(
    surface: AnySurface,
    pressures: ArrayLike | str | Sequence[str],
    bodies: float | str | Bodies = 1.0,
    *,
    cutoffs: ArrayLike | None = None,
) -> ResolutionStudy:
    """Area, gap, stiffness and flow of a map by its short cut-off, at equal pressures.

    The map is simulated at each cut-off (`theory="simulated"`).

    Parameters
    ----------
    surface : Surface
        From `Surface.from_map`.
    pressures : array_like or str
        Nominal pressures, as for `contact`.
    bodies : float, str or Bodies, optional
        As for `contact`.
    cutoffs : array_like, optional
        Two short cut-offs or more [length of the surface], of at least four sampling steps.
        By default the shortest wavelength that the simulation of the map resolves, and 1.4,
        2, 2.8 and 4 times it.

    Returns
    -------
    ResolutionStudy

    Raises
    ------
    InputError
        For a surface without a map, and for cut-offs that its sampling does not resolve or
        beyond which no roughness is left.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface, resolution_study
    >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
    >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
    >>> q[0, 0] = np.inf
    >>> heights = np.fft.irfft2(np.where((q > 0.03) & (q < 0.2), noise * q**-1.8, 0))
    >>> surface = Surface.from_map(heights, dx=1.0, periodic=True)
    >>> study = resolution_study(surface, [0.1, 1.0], cutoffs=[5.0, 10.0])
    >>> study.area.shape, study.change("area") < 0
    ((2, 2), array([ True,  True]))
    """
    with progress("resolution"):
        simulated = Simulated("quick").of(surface).surface
        map_of(simulated)
        faces = _faces(simulated, cutoffs)
        found = [
            contact(face, bodies, pressure=pressures, theory="simulated")
            for face in faces.values()
        ]
    return _study(list(faces), found)


def last_octave(found: Contact) -> ResolutionStudy:
    """What the shortest wavelengths of a map do to a contact, by simulation without the last octave.

    Parameters
    ----------
    found : Contact
        Simulated on its map.

    Returns
    -------
    ResolutionStudy
        At the pressures of this contact, with all wavelengths and without the last octave of
        them: `statement()` is a line on it, `change("area")` that of ln A.

    Raises
    ------
    InputError
        For a contact that is not simulated on its map.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface, contact, last_octave
    >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
    >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
    >>> q[0, 0] = np.inf
    >>> heights = np.fft.irfft2(np.where((q > 0.03) & (q < 0.2), noise * q**-1.8, 0))
    >>> surface = Surface.from_map(heights, dx=1.0, periodic=True)
    >>> last_octave(contact(surface, area=0.1)).change("area") < 0
    array([ True])
    """
    surface: Any = found.surface
    map_of(surface)
    if found.theory_of(found.bodies).gaps() is None:
        raise InputError(f"a contact by {found.theory!r} has no simulated gaps")
    shortest = surface.shortest(NO_POWER)
    longer = without_shorter(surface, 2 * shortest, WHY, chosen=False)
    asked = {"pressure": found.pressure}
    pressed = contact_of(longer, found.bodies, asked, "simulated")
    return _study([shortest, 2 * shortest], [found, pressed])


def _study(cutoffs: list[float], found: list[Contact]) -> ResolutionStudy:
    """The arrays of contacts at cut-offs."""
    first = found[0]
    rows: dict[str, Any] = {
        name: np.array([np.atleast_1d(getattr(each, name)) for each in found])
        for name in (*STUDIED, "area_scatter", "valid")
    }
    length = first.units["mean_separation"]
    units = {name: first.units[name] for name in ("pressure", *STUDIED)}
    units |= {"cutoff": length, "flow": "1" if length == "1" else f"{length}^3"}
    return ResolutionStudy(
        contacts=tuple(found),
        units=units,
        cutoff=np.array(cutoffs),
        pressure=np.atleast_1d(np.asarray(first.pressure, float)),
        **rows,
    )


def _faces(surface: Any, cutoffs: ArrayLike | None) -> dict[float, Any]:
    """The surface of a map at cut-offs, rising; itself at the first where none are given."""
    if cutoffs is None:
        shortest = surface.shortest(NO_POWER)
        longer = [factor * shortest for factor in FACTORS[1:]]
        faces = {shortest: surface}
    else:
        given = positive_array("cutoffs", finite_array("cutoffs", cutoffs))
        if given.ndim != 1 or np.unique(given).size < 2:
            raise InputError("cutoffs must be two different lengths or more")
        least = MIN_POINTS * max(surface.map.steps) * (1 - ROUNDING)
        require(
            "cutoffs", given, given >= least, f"at least {least:.6g}, four sampling steps"
        )
        longer = np.unique(given).tolist()
        faces = {}
    return faces | {
        cutoff: without_shorter(surface, cutoff, WHY, chosen=False) for cutoff in longer
    }
