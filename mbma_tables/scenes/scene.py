"""A scene: what is pressed, how far, which effects matter, how accurate, or how long it may take."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mbma_tables.errors import InputError
from mbma_tables.scenes.effects import THEORIES, chosen, nearest

if TYPE_CHECKING:
    import xarray

    from mbma_tables.scenes.plan import Plan
    from mbma_tables.surfaces.readings import Reading
    from mbma_tables.surfaces.surface import Surface

PRESCRIBED = ("separations", "mean_separations", "nominal_pressures")
LEAST_RTOL, LARGEST_RTOL = 1e-10, 0.1
DEFAULT_RTOL = 1e-6
LONGEST = 1e6  # seconds
Progress = Callable[[str, int, int], None]


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """What to simulate; made once, checked at once, run as often as wanted.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    effects : sequence of str
        Effects asked for, names of `mbma_tables.scenes.effects.EFFECTS`.
    without : sequence of str
        Refinements of the model switched off: "subscale_area", "sphere_deformation", "finite_height".
    separations, mean_separations, nominal_pressures : array_like, one of them
        d [length], u [length], or F/A0 in the unit of `E_star`; one number or a list.
    E_star : float
        Effective modulus; stresses come out in its unit. 1 gives them over E*.
    rtol : float, optional
        Relative error asked for, in [1e-10, 0.1]; 1e-6 where no `seconds` are given either.
    seconds : float, optional
        Instead of `rtol`: a time budget, spent on as much accuracy as its prediction allows.
    reading : str or Reading
        Which reading of the paper's equations.
    conductivities : pair of float, optional
        Of the two bodies, thermal or electrical, for "conductance".
    deltas : array_like, optional
        Approaches [length] of the islands of "pressure_profile".
    theories : sequence of str
        For "comparison": "greenwood_williamson", "persson", "persson_simplified".
    points : int
        Points of the distribution of "island_statistics", over the approach.
    length_unit, stress_unit, title : str, optional
        Texts for the result.

    Raises
    ------
    InputError, OutOfRangeError
        For anything without a meaning, or that contradicts something else; the message says what to write instead.
    """

    surface: Surface
    effects: Sequence[str] = ("force", "area")
    without: Sequence[str] = ()
    separations: Any = None
    mean_separations: Any = None
    nominal_pressures: Any = None
    E_star: float = 1.0
    rtol: float | None = None
    seconds: float | None = None
    reading: str | Reading = "reported"
    conductivities: tuple[float, float] | None = None
    deltas: Any = None
    theories: Sequence[str] = ()
    points: int = 64
    length_unit: str | None = None
    stress_unit: str | None = None
    title: str = "scene"
    outputs: frozenset[str] = dataclasses.field(init=False)
    dropped: frozenset[str] = dataclasses.field(init=False)
    gaps: Any = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        from mbma_tables.arguments import finite_array, number_in, whole_number_in
        from mbma_tables.surfaces.readings import get_reading

        for name in ("effects", "without", "theories"):
            if isinstance(getattr(self, name), str):
                raise InputError(f"{name} must be a list of names: write [{getattr(self, name)!r}]")
        outputs, dropped = chosen(self.effects, self.without)
        if self.surface.labelled or self.surface.shape != ():
            raise InputError("a scene is of one surface, not a batch: make a scene for each")
        if self.rtol is not None and self.seconds is not None:
            raise InputError("rtol and seconds are both given: give the accuracy or the time budget, one of them")
        number_in("E_star", self.E_star, 1e-300, 1e300)
        asked: float | None = DEFAULT_RTOL
        if self.rtol is not None:
            asked = number_in("rtol", self.rtol, LEAST_RTOL, LARGEST_RTOL)
        if self.seconds is not None:
            number_in("seconds", self.seconds, 1e-9, LONGEST)
            asked = None
        whole_number_in("points", self.points, 2, 10_000)
        set_ = {
            "rtol": asked,
            "reading": get_reading(self.reading),
            "outputs": outputs,
            "dropped": dropped,
            "theories": tuple(self.theories),
        }
        for name, value in set_.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "gaps", self._prescribed(outputs - {"pressure_profile"}))
        self._parts(finite_array)

    def _prescribed(self, at_gaps: frozenset[str]) -> Any:
        """The prescribed numbers, checked; None where nothing asks for gaps."""
        import numpy as np

        from mbma_tables.arguments import finite_array, require

        given = [name for name in PRESCRIBED if getattr(self, name) is not None]
        if len(given) > 1:
            raise InputError(f"{' and '.join(given)} are given: prescribe one of {', '.join(PRESCRIBED)}")
        if not at_gaps:
            if given:
                raise InputError(f"{given[0]} serve nothing that is asked for: leave them out, or ask for 'force'")
            return None
        if not given:
            raise InputError(f"nothing is prescribed: give one of {', '.join(PRESCRIBED)}")
        numbers = finite_array(given[0], getattr(self, given[0]))
        if numbers.ndim > 1:
            raise InputError(f"{given[0]} must be one number or a list, got shape {numbers.shape}")
        h_max = float(self.surface.h_max)
        if given[0] == "separations":
            require(given[0], numbers, numbers >= -h_max, f"at least -h_max = {-h_max:.6g}, where the model ends")
        elif given[0] == "mean_separations":
            require(given[0], numbers, numbers >= 0, "at least 0, where the model ends (d = -h_max)")
        else:
            require(given[0], numbers, numbers >= 0, "at least 0: there is no adhesion in the model")
            if "finite_height" in self.dropped:
                raise InputError(
                    "nominal_pressures need a law, which ends at h_max: leave finite_height on, or give separations"
                )
        return np.atleast_1d(numbers).astype(float)

    def _parts(self, finite_array: Callable[..., Any]) -> None:
        """Numbers that single effects need, and nobody else."""
        from mbma_tables.arguments import require

        needs = (
            ("conductance", "conductivities", self.conductivities is not None, "k1 and k2 of the two bodies"),
            ("pressure_profile", "deltas", self.deltas is not None, "the approaches of the islands"),
            ("comparison", "theories", bool(self.theories), f"one or more of {', '.join(THEORIES)}"),
        )
        for effect, name, there, what in needs:
            if effect in self.outputs and not there:
                raise InputError(f"effect {effect!r} needs {name}: {what}")
            if effect not in self.outputs and there:
                raise InputError(f"{name} are given and effect {effect!r} is off: add it to the effects, or leave them")
        if self.conductivities is not None:
            pair = finite_array("conductivities", self.conductivities)
            if pair.shape != (2,):
                raise InputError(f"conductivities are two numbers, k1 and k2, got shape {pair.shape}")
            require("conductivities", pair, pair > 0, "positive")
        if self.deltas is not None:
            deltas = finite_array("deltas", self.deltas)
            require("deltas", deltas, deltas > 0, "positive")
        for name in self.theories:
            if name not in THEORIES:
                raise InputError(f"no theory is named {name!r}; {nearest(str(name), THEORIES)}")

    @property
    def rule(self) -> Reading:
        """The reading, as the object of that name."""
        from mbma_tables.surfaces.readings import get_reading

        return get_reading(self.reading)

    @property
    def prescribed(self) -> str | None:
        """Which of `PRESCRIBED` was given."""
        return next((name for name in PRESCRIBED if getattr(self, name) is not None), None)

    @classmethod
    def from_toml(cls, path: os.PathLike[str] | str) -> Scene:
        """The scene of a TOML file, see docs/scenes.md and `scene.schema.json`.

        Raises
        ------
        InputError
            For mistakes in the file: one message that says what to write instead.
        """
        from mbma_tables.scenes.toml_file import read_scene

        return read_scene(path)

    @classmethod
    def from_mapping(cls, content: Mapping[str, Any]) -> Scene:
        """The scene of what a TOML file would hold; files in it are relative to the current folder."""
        from mbma_tables.scenes.toml_file import scene_of

        return scene_of(content)

    def plan(self) -> Plan:
        """How it will be computed: tiers, quadrature, laws, with predicted errors and times."""
        from mbma_tables.scenes.plan import make_plan

        return make_plan(self)

    def explain(self) -> str:
        """The plan as text, one line a step."""
        return self.plan().text()

    def run(self, progress: Progress | None = None) -> xarray.Dataset:
        """Compute what was asked for.

        Parameters
        ----------
        progress : callable, optional
            Called as ``progress(step, done, total)``.

        Returns
        -------
        xarray.Dataset
            Quantities with units; in its attributes the plan, the achieved error bound, the reading and the hashes
            of the tables that were used.

        Raises
        ------
        InputError, OutOfRangeError, ConvergenceError
        """
        from mbma_tables.scenes.run import run_scene

        return run_scene(self, self.plan(), progress)
