"""One netCDF file of all surfaces that are solved, with what made them."""

from __future__ import annotations

import dataclasses
import datetime
import json
import pathlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from generate.boundary_elements import capped
from generate.boundary_elements.design import SPLITS, Task
from generate.provenance import source_digest, versions
from mbma_tables.common.errors import InputError
from mbma_tables.laws import bearing_curve as bearing
from mbma_tables.laws.boundary_elements import TOLERANCE

MODULES = (
    "generate.boundary_elements.surfaces",
    "generate.boundary_elements.solve",
    "mbma_tables.laws.boundary_elements",
    "mbma_tables.laws.bearing_curve",
)

# name: (dimension beside the surface, what it is); all are numbers without a unit
NUMBERS = {
    "q0_h_rms": (None, "q0 h_rms at rms gradient 1: q0 h_rms/g of any scale"),
    "h_max": (None, "highest point above the mean, in h_rms"),
    "anisotropy": (None, "root of the ratio of the gradient tensor's eigenvalues"),
    "slope_kurtosis": (None, "3/8 <|w|^4> of the whitened gradient w: 3 if Gaussian"),
    "force": ("load", "F/(A0 E* g), g the rms gradient in two dimensions"),
    "area": ("load", "A/A0, area_raw less (pi - 1 + ln 2)/24 times the length of cell edges between contact and gap"),
    "area_raw": ("load", "A/A0, the share of grid points with pressure"),
    "mean_separation": ("load", "u, the mean gap, in h_rms"),
    "energy": ("load", "elastic energy over A0 E* g h_rms"),
    "pressure_weighted_height": ("load", "H_p = <p h>/<p>, in h_rms; equals u + 2 energy/force"),
    "residual": ("load", "the engine's complementarity error"),
    "seconds": ("load", "processor time of the load"),
    "quantiles": ("quantile", "heights below which shares of the surface lie, in h_rms"),
    "mean_height": ("top", "M(a), mean height of the highest share a of the surface, in h_rms"),
    "top_gradient": ("top", "(2/sqrt(pi)) <|w|>/sqrt(2) over the highest share a: 1 if Gaussian"),
    "tension_force": ("top", "F/(A0 E* g) at which full contact would pull on a share a of the surface"),
    "tension": ("top", "mean pull <max(-p, 0)> of full contact at that force, over E* g"),
    "band_q": ("band", "q/q0 of a band of wavenumbers, the variance-weighted root mean square"),
    "band_variance": ("band", "share of h_rms^2 in the band"),
    "band_inverse_q2": ("band", "mean (q0/q)^2 of the band, weighted by variance"),
    "band_gradient": ("band", "share of g^2 = 2 m2 in the band"),
    "band_curvature": ("band", "m4 h_rms^2/g^4 of the band: alpha = m0 m4/m2^2 is 4 times its sum"),
    "band_energy": ("band_or_end", "elastic energy of the pressure's waves by band, over A0 E* g h_rms"),
}
OF_LEAKAGE = {
    name: NUMBERS[name]
    for name in ("q0_h_rms", "h_max", "anisotropy", "force", "area", "area_raw", "mean_separation", "residual")
} | {
    "seconds": NUMBERS["seconds"],
    "flow": ("axis", "k along both axes of the cell: flow per width k h_rms^3 dp/(12 viscosity length); 0: blocked"),
    "band_q": NUMBERS["band_q"],
    "band_variance": NUMBERS["band_variance"],
}
# of surfaces pressed with capped pressures
OF_HARDNESS: dict[str, tuple[str | None, str]] = {
    name: NUMBERS[name] for name, (dimension, _) in NUMBERS.items() if dimension in (None, "quantile", "top", "band")
} | {
    name: ("hardness", meaning)
    for name, meaning in {
        "force": "F/(A0 E* g), g the rms gradient in two dimensions",
        "area": "A/A0: area_raw less (pi - 1 + ln 2)/24 times the cell edges between elastic contact and gap, those of "
        "points beside yielded ones counted 1.8 times; at least force/eta",
        "area_raw": "A/A0, the share of grid points with pressure",
        "area_yielded": "yielded A/A0: area_yielded_raw and (pi - 1 + ln 2)/24 times 0.65 of its edges; at most "
        "force/eta",
        "area_yielded_raw": "share of grid points at the hardness",
        "mean_separation": "u, the mean gap, yielded points flattened, in h_rms",
        "plane_separation": "gap between mean planes, interpenetration of yielded points counted, in h_rms",
        "energy": "elastic energy over A0 E* g h_rms",
        "frozen_stiffness": "-dF/du of the contact area as it is, over A0 E* g/h_rms",
        "residual": "mean complementarity error over force and h_rms",
        "iterations": "of the conjugate gradients",
        "seconds": "processor time of the load",
    }.items()
}
SINGLE = {"quantiles", "mean_height", "top_gradient", "tension_force", "tension", "band_energy"}  # kept to 7 digits
LOADED = {"band_energy", "flow"}


def _read(task: Task, folder: pathlib.Path) -> dict[str, Any] | None:
    try:
        with np.load(folder / f"{task.recipe.name}.npz", allow_pickle=False) as content:
            return dict(content)
    except FileNotFoundError:
        return None


def _stacked(
    name: str, found: Sequence[dict[str, Any]], loads: int, known: Mapping[str, tuple[str | None, str]]
) -> xr.Variable:
    """One number or curve of all surfaces; NaN where a surface has fewer loads."""
    dimension, meaning = known[name]
    own = [np.atleast_1d(content[name]) for content in found]
    if dimension is None:
        values, dims = np.array([v.item() for v in own]), ["surface"]
    elif dimension == "load" or name in LOADED:
        values = np.full((len(own), loads, *own[0].shape[1:]), np.nan)
        for row, v in zip(values, own, strict=True):
            row[: len(v)] = v
        dims = ["surface", "load", *([] if dimension == "load" else [str(dimension)])]
    else:
        values, dims = np.array(own), ["surface", dimension, *(["load"] if dimension == "hardness" else [])]
    kind = "f4" if name in SINGLE or dimension == "hardness" else "f8"
    unit = "s" if name == "seconds" else "1"
    return xr.Variable(dims, values.astype(kind), {"long_name": meaning, "units": unit})


def _described(
    tasks: Sequence[Task], found: Sequence[dict[str, Any]], names: Mapping[str, tuple[str | None, str]]
) -> xr.Dataset:
    """These numbers of solved surfaces, with what made each."""
    recipes = [task.recipe for task in tasks]
    kinds = sorted({recipe.kind for recipe in recipes})
    loads = max(len(content["force"]) for content in found)
    data = xr.Dataset({name: _stacked(name, found, loads, names) for name in names})
    data["kind"] = _flags([kinds.index(r.kind) for r in recipes], kinds, "family of surfaces")
    data["split"] = _flags(
        [SPLITS.index(task.split) for task in tasks], SPLITS, "what a fit may see: the training set and no other"
    )
    for name, meaning in {
        "hurst": "Hurst exponent",
        "zeta_1": "q1/q0",
        "waves": "longest (at a plateau: roll-off) waves along a side",
        "shape": "parameter of the kind; the ratio of the cell's sides where stretched",
        "seed": "of numpy.random.default_rng, which draws the phases",
        "points": "grid points along a side",
    }.items():
        values = np.array([getattr(recipe, name) for recipe in recipes])
        data[name] = ("surface", values, {"long_name": meaning, "units": "1"})
    return data


@dataclasses.dataclass(frozen=True)
class Kept:
    """What a campaign keeps of each surface, and what its file says of itself."""

    numbers: Mapping[str, tuple[str | None, str]]
    title: str
    comment: str
    modules: tuple[str, ...]


KEPT = {
    "elastic": Kept(
        NUMBERS,
        "Random rough surfaces pressed flat, by boundary elements",
        "; refine repeats surfaces on grids. "
        "band_energy has the waves longer than the surface's first and those shorter than its last at its ends.",
        MODULES,
    ),
    "hardness": Kept(
        OF_HARDNESS,
        "Random rough surfaces pressed flat with pressures capped at a hardness, by boundary elements",
        "; refine repeats surfaces on grids. Loading only.",
        (*MODULES, "generate.boundary_elements.capped"),
    ),
    "leakage": Kept(
        OF_LEAKAGE,
        "Flow through the gaps of random rough surfaces pressed flat, by boundary elements and Reynolds' equation",
        ". Loads end where both axes are blocked.",
        (*MODULES, "mbma_tables.laws.reynolds"),
    ),
}


def dataset(tasks: Sequence[Task], folder: pathlib.Path, kind: str = "elastic") -> xr.Dataset:
    """All solved surfaces of these tasks of a campaign."""
    kept = KEPT[kind]
    read = [(task, content) for task in tasks if (content := _read(task, folder)) is not None]
    if not read:
        raise InputError(f"no surface of this campaign is in {folder}")
    found = [content for _, content in read]
    data = _described([task for task, _ in read], found, kept.numbers)
    shares = {
        "quantile": (bearing.QUANTILES, "share of the surface below a height"),
        "top": (bearing.FRACTIONS, "share of the surface, from the highest point down"),
        "hardness": (
            capped.HARDNESSES,
            "p_m/(E* g), hardness over modulus and rms gradient; infinite: elastic",
        ),
    }
    for name, (values, meaning) in shares.items():
        if name in data.dims:
            attributes = {"long_name": meaning, "units": "1"}
            data["eta" if name == "hardness" else name] = (name, np.array(values), attributes)
    engine = ", ".join(sorted({str(content["engine"]) for content in found}))
    source = f"{engine}: conjugate gradients of Polonsky and Keer, force control, tolerance {TOLERANCE:g}"
    if kind == "hardness":
        source = (
            f"generate.boundary_elements.capped: projected conjugate gradients, force control, tolerance "
            f"{capped.TOLERANCE:g}"
        )
    made_by = {"engine": engine, "numpy": ", ".join(sorted({str(content["numpy"]) for content in found}))}
    data.attrs = {
        "Conventions": "CF-1.11",
        "title": kept.title,
        "institution": "mbma_tables contributors",
        "source": f"{source}; periodic, frictionless, without adhesion",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d} python -m generate boundary_elements --of {kind} "
        "--collect",
        "references": "area correction: Yastrebov, Anciaux, Molinari, arXiv:1701.02727",
        "comment": "A surface is made anew by generate.boundary_elements.surfaces.heights from kind, hurst, zeta_1, "
        f"waves, shape, seed and points. split: no fit sees anything but training{kept.comment}",
        "versions": json.dumps(versions() | made_by),
        "code_sha256": source_digest(kept.modules),
        "surfaces_planned": len(tasks),
        "surfaces_solved": len(found),
    }
    return data


def _flags(numbers: Sequence[int], meanings: Sequence[str], name: str) -> xr.Variable:
    attributes = {
        "long_name": name,
        "flag_values": np.arange(len(meanings), dtype="i1"),
        "flag_meanings": " ".join(meanings),
    }
    return xr.Variable("surface", np.array(numbers, "i1"), attributes)


def collect(data: xr.Dataset, target: pathlib.Path) -> int:
    """Write the file; the number of surfaces in it."""
    encoding: dict[str, dict[str, Any]] = {str(name): {"zlib": True, "complevel": 9} for name in data.data_vars}
    encoding |= {str(name): {"_FillValue": None} for name in data.coords}
    partial = target.with_suffix(".partial")
    data.to_netcdf(partial, engine="netcdf4", encoding=encoding)
    partial.replace(target)
    return int(data.sizes["surface"])
