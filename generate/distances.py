"""Deviations of theories from simulated contacts: every theory on every data set, and `python -m generate score`.

Deviations are ln(theory/simulation) of three quantities: area at equal force, force at
equal mean separation, stiffness at equal force. They are model errors: the theories are
solved to 1e-6 or better, except for the map's law.
"""

import dataclasses
import pathlib
import runpy
import types
from collections.abc import Callable, Sequence
from typing import Any

import click
import numpy as np
from scipy.special import erf

from generate.boundary_elements.evidence import (
    MAX_AREA,
    MIN_WAVES,
    Case,
    TheoryCurve,
    curves_of,
    evidence,
)
from generate.boundary_elements.surfaces import (
    HELD_OUT_SPECTRUM,
    HELD_OUT_SURFACE,
    TRAINING,
)
from generate.calibrated import errors
from generate.calibrated_file import QUANTITIES, rms
from generate.files import DATA, ROOT, dataset, read_csv
from generate.page import percent, table
from mbma_tables import theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.islands.variants import REPORTED, Variant
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    YANG_PERSSON,
    Spectrum,
    SpectrumLaw,
)
from mbma_tables.theories.calibrated.map_curves import MAP_CONSTANTS
from mbma_tables.theories.dataset import FILE

# A/A0 of the simulations between which distances are summed up
LOW = 0.01
DEEP = 0.1
HIGH = 0.97
RANGES = ((LOW, DEEP), (DEEP, HIGH))
OTHERS = ROOT / "generate" / "theories_of_others.py"
HEADER = "theory | area at given pressure | pressure at given gap | stiffness at given pressure | loads reached"
FUNCTIONS = ("answer", "at_pressure")
COVER = dataclasses.replace(REPORTED, name="reported, areas as a cover", addition="cover")
MEASURED = {"al3d-1": "measured: optical map", "di-1": "measured: AFM map"}
ROLLOFF = (0.041954782, 0.037331897)  # h_max of the maps
# file, zeta_1, rms gradient and h_max of sets that nothing was fitted to
OLDER = {
    "bem": ("bem_hurst0.8_zeta64.csv", 64.0, 1.0, 3.3973),
    "gfmd": ("gfmd_hurst0.8_zeta100.csv", 100.0, 0.2766, 3.4),
    "challenge": ("challenge.csv", 200.0, 1.0, 3.45),
}


def _theory(theory: Any) -> Callable[[Case], Any]:
    return lambda one: TheoryCurve(theory, one.surface)


def _mbma(
    variant: str | Variant, island_model: str = "universal"
) -> Callable[[Case], Any]:
    return _theory(
        theories.Mbma(
            island_model, variant, 1e-6, "nan" if island_model == "universal" else "raise"
        )
    )


def _map(one: Case) -> Any:
    if not one.curves:
        raise MbmaError("no map")
    return one.map_law(CONSTANTS, MAP_CONSTANTS)


THEORIES: dict[str, Callable[[Case], Any]] = {
    "MBMA reported": _mbma("reported"),
    "MBMA printed": _mbma("printed"),
    "MBMA fitted": _mbma("fitted"),
    "MBMA cover": _mbma(COVER),
    "calibrated": lambda one: one.law(CONSTANTS),
    "calibrated, map": _map,
    "Persson": lambda one: SpectrumLaw(one.spectrum, None, YANG_PERSSON),
    "Persson simplified": _theory(theories.Persson("simplified")),
    "G-W": _theory(theories.GreenwoodWilliamson()),
}
HUES = ("C0", "C1", "C9", "C4", "k", "0.5", "C3", "C6", "C2")  # of figures
ISLAND_MODELS = {name: _mbma("reported", name) for name in ("formula", "rigid")}


@dataclasses.dataclass(frozen=True)
class DataSet:
    """Simulated surfaces of one kind, and the theories that were fitted to them."""

    title: str
    seen: Sequence[Case]
    fitted: tuple[str, ...] = ()


def distances(
    seen: Sequence[Case], theory: Callable[[Case], Any]
) -> dict[str, FloatArray]:
    """ln(theory/simulation) at every load of every surface, NaN where the theory does not reach it."""
    parts = {
        name: [np.full(one.force.shape, np.nan) for one in seen] for name in QUANTITIES
    }
    for number, one in enumerate(seen):
        with np.errstate(all="ignore"):
            try:
                curve = theory(one)
                reached = np.isfinite(curve.separation(one.force))
            except (MbmaError, ValueError):
                continue
            for name, values in parts.items():
                known = np.isfinite(one.u) & (reached | (name == "force"))
                if known.sum() > (2 if name == "stiffness" else 0):
                    values[number][known] = errors(one.at(known), curve, name)
    return {name: np.concatenate(values) for name, values in parts.items()}


def held_out() -> list[Case]:
    """Self-affine surfaces of two or more longest waves a side that no fit saw."""
    return [
        one
        for one in evidence()
        if one.kind == "self_affine" and one.gaussian and one.split != TRAINING
    ]


def _simulated(
    kind: str, rows: Any, h_max: float, spectrum: Spectrum | None = None, **more: Any
) -> Case:
    """A surface of a file of numbers: rows of F/(A0 E* g), A/A0 and u/h_rms; of a self-affine one H and zeta_1."""
    hurst = more.pop("hurst", 0.8)
    zeta_1 = more.pop("zeta_1", 0.0)
    spectrum = spectrum or Spectrum.self_affine(hurst, zeta_1)
    force, area, u = (np.asarray(row, dtype=float) for row in rows)
    return Case(
        kind,
        "",
        (kind, hurst, zeta_1, 0, 0.0),
        MIN_WAVES,
        0,
        spectrum,
        spectrum,
        h_max,
        more,
        force,
        area,
        u,
    )


def earlier() -> list[Case]:
    """The 105 surfaces of docs/data/boundary_elements.csv, to which the variant `fitted` was fitted."""
    keys = ["hurst", "L_over_lambda0", "zeta_1", "seed", "n"]
    found = []
    for (hurst, _, zeta_1, *_), own in read_csv("boundary_elements.csv").groupby(keys):
        rows = [own[name] for name in ("force", "area", "u_over_h_rms")]
        h_max = float(own["h_max_over_h_rms"].iloc[0])
        found.append(
            _simulated(
                "self_affine", rows, h_max, hurst=float(hurst), zeta_1=float(zeta_1)
            )
        )
    return found


def older(name: str, top: float | None = None) -> Case:
    """One of `OLDER`, with another h_max/h_rms where it is given."""
    file, zeta_1, gradient, h_max = OLDER[name]
    h_max = top or h_max
    table = read_csv(file)
    rows = [table["force"] / gradient, table["area"], table["mean_separation_over_h_rms"]]
    if name != "challenge":
        return _simulated("self_affine", rows, h_max, zeta_1=zeta_1)
    # a plateau from a fifth of the roll-off wavenumber
    edges = np.geomspace(0.2, zeta_1, 4001)
    middle = np.sqrt(edges[1:] * edges[:-1])
    shares = np.minimum(middle**2, middle**-1.6) * np.diff(np.log(edges))
    return _simulated("plateau", rows, h_max, Spectrum.from_shares(middle, shares))


def rolloff(number: int) -> Case:
    force, area, _, u = np.loadtxt(DATA / f"rolloff_{number}.csv", delimiter=",").T[:4]
    own = read_csv("rolloff_spectra.csv").query("map == @number")
    spectrum = Spectrum.from_shares(*own[["q", "variance"]].to_numpy().T)
    h_rms = np.sqrt(own["variance"].sum())
    # wavenumbers over h_rms: their unit cancels
    rows = [force / (spectrum.gradient * h_rms), area, u / h_rms]
    return _simulated("plateau", rows, ROLLOFF[number] / h_rms, spectrum)


def measured(name: str, path: pathlib.Path = FILE) -> Case:
    one = dataset("measured", path).sel(surface=name)
    seen = (one.area.values > 0) & (one.area.values < MAX_AREA)
    spectrum = Spectrum.from_shares(one.band_q.values, one.band_variance.values)
    rows = [one[key].values[seen] for key in ("force", "area", "mean_separation")]
    return _simulated("measured", rows, float(one.h_max), spectrum, **curves_of(one))


def data_sets() -> dict[str, DataSet]:

    def chosen(
        kinds: Sequence[str], splits: Sequence[str], low: int = MIN_WAVES, high: int = 99
    ) -> list[Case]:
        return [
            one
            for one in evidence()
            if one.kind in kinds and one.split in splits and low <= one.waves <= high
        ]

    tested = (HELD_OUT_SURFACE, HELD_OUT_SPECTRUM)
    plain = ("self_affine",)
    transformed = ("peaks", "valleys", "worn", "patchy")
    return {
        "spectra": DataSet("new spectra", chosen(plain, (HELD_OUT_SPECTRUM,))),
        "surfaces": DataSet(
            "new surfaces of fitted spectra", chosen(plain, (HELD_OUT_SURFACE,))
        ),
        "training": DataSet(
            "the training set",
            chosen(plain, (TRAINING,)),
            ("calibrated", "calibrated, map"),
        ),
        "one": DataSet(
            "one longest wave a side", chosen(plain, (TRAINING, *tested), 1, 1)
        ),
        "plateau": DataSet(
            "with plateau or instrument's filter", chosen(("plateau", "filtered"), tested)
        ),
        "stretched": DataSet("stretched", chosen(("stretched",), tested)),
        "transformed": DataSet("heights transformed", chosen(transformed, tested)),
        "earlier": DataSet("105 earlier surfaces", earlier(), ("MBMA fitted",)),
        "bem": DataSet("an older set, mean of 4", [older("bem")]),
        "gfmd": DataSet("molecular dynamics", [older("gfmd")]),
        **{
            f"gfmd {top}": DataSet(f"the same, h_max {top} h_rms", [older("gfmd", top)])
            for top in (3, 4)
        },
        "challenge": DataSet("contact challenge", [older("challenge")]),
        "rolloff": DataSet("two with plateau, by spectrum", [rolloff(0), rolloff(1)]),
        **{name: DataSet(title, [measured(name)]) for name, title in MEASURED.items()},
    }


def summed_up(
    seen: Sequence[Case], found: FloatArray, low: float = LOW, high: float = HIGH
) -> tuple[float, float]:
    """Root mean square of distances at contacts from `low` to `high`, and the share of these that is reached."""
    area = np.concatenate([one.area for one in seen])
    values = found[(area >= low) & (area <= high)]
    known = values[np.isfinite(values)]
    return (rms(known), known.size / values.size) if known.size else (np.nan, 0.0)


def pocket_area(pressure: FloatArray, alpha: float) -> FloatArray:
    """A/A0 at p/(E* g): the area law of docs/model.md."""
    t = pressure / 0.33
    s = (0.51 + 0.033 * np.log(alpha / 10) + t) / (1 + t)
    return np.asarray(erf(pressure * np.sqrt(2 / s)))


def pocket_pressure(u: FloatArray, nu: float) -> FloatArray:
    """p/(E* q0 h_rms) at u/h_rms: the law of separation of docs/model.md, by the spectrum's narrowness."""
    return np.asarray(u**-0.26 * np.exp(-1.91 * u - 2.8 * (nu - 0.63)))


def pocket_errors() -> list[list[Any]]:
    """Of both laws: name, median, 90% quantile and largest error [%] on held-out surfaces, number of surfaces."""
    seen = held_out()
    found: dict[str, list[FloatArray]] = {
        "area at given pressure": [],
        "pressure at given separation": [],
    }
    for one in seen:
        inside = (one.area >= LOW) & (one.area <= HIGH)
        spectrum = one.spectrum
        force = one.force[inside]
        g = float(spectrum.gradient)
        pressure = pocket_pressure(one.u[inside], float(spectrum.narrowness)) / g
        laws = (
            pocket_area(force, float(spectrum.alpha)) / one.area[inside],
            pressure / force,
        )
        for misses, law in zip(found.values(), laws, strict=True):
            misses.append(100 * np.abs(law - 1))
    return [
        [what, *np.quantile(np.concatenate(e), (0.5, 0.9, 1.0)), len(seen)]
        for what, e in found.items()
    ]


def theories_of(path: pathlib.Path) -> dict[str, Any]:
    """Theories of a Python file by name: objects that have a name, or the file's own function, named as the file.

    A theory has ``answer(surface, mean_separation)``, which returns F/(A0 E*) and A/A0, or
    ``at_pressure(surface, pressure)``, which returns A/A0 and the mean separation.
    """
    content = runpy.run_path(str(path))
    found = {
        one.name: one
        for one in content.values()
        if any(hasattr(one, function) for function in FUNCTIONS)
        and not isinstance(one, type | types.ModuleType)
    }
    if own := {name: content[name] for name in FUNCTIONS if callable(content.get(name))}:
        found[content.get("name", path.stem)] = types.SimpleNamespace(**own)
    if not found:
        raise InputError(
            f"{path} must have a function answer(surface, mean_separation) or at_pressure(surface, pressure), "
            f"or objects with a name and one of these; it has {sorted(name for name in content if name[0] != '_')}"
        )
    return found


def scores(theories: dict[str, Any]) -> str:
    """A table of theories, as objects or as functions of a `Case`, on all held-out self-affine surfaces."""
    seen = held_out()
    rows = []
    for name, one in theories.items():
        found = distances(
            seen, one if isinstance(one, types.FunctionType) else _theory(one)
        )
        sums = [
            [summed_up(seen, values, *ends) for ends in RANGES]
            for values in found.values()
        ]
        cells = [[rms for rms, _ in own] for own in sums] + [
            [reached for _, reached in sums[0]]
        ]
        rows.append([name, *(" / ".join(map(percent, values)) for values in cells)])
    return table(HEADER, rows)


@click.command()
@click.argument(
    "path", type=click.Path(path_type=pathlib.Path, exists=True, dir_okay=False)
)
def score(path: pathlib.Path) -> None:
    """Print how far the theories of the Python file PATH are from boundary elements.

    Root mean squares of ln(theory/simulation) in percent, at 1-10% / 10-97% contact, on the
    surfaces of which none was used in a fit; docs/data/README.md describes PATH.
    """
    click.echo(scores(theories_of(path)))
