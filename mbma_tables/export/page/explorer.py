"""One page to explore a surface in a browser: the exported C as WebAssembly, its tables and the drawing, in one file.

The module is compiled once, by `python -m generate explorer`, from C whose constants are
variables: a page sets them from the current tables, so that writing one needs no compiler.
"""

import base64
import dataclasses
import html
import json
import re
import zlib
from typing import Any

import numpy as np

from mbma_tables import __version__
from mbma_tables.bodies.materials import ISOTROPIC_SHARE, hardness_in
from mbma_tables.common.arguments import number_in, positive_array
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, factor
from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.contacts.quantities.validity import MAX_GRADIENT
from mbma_tables.export.model import c_code
from mbma_tables.export.text import page_file
from mbma_tables.islands.variants import FITTED, PRINTED, REPORTED, get_variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.tables.open import universal_model
from mbma_tables.theories import default_name, tested
from mbma_tables.theories.calibrated.theory import WIDE_SCATTER
from mbma_tables.theories.evidence import COMPARED, QUANTITIES, shipped_deviations
from mbma_tables.theories.mbma import theory as mbma
from mbma_tables.theories.named import OF_MAPS, options_of
from mbma_tables.theories.yielding import formulas as hardness_law

MODULE = "explorer.wasm"
THEORIES = ("mbma", "calibrated", "persson")
SHOWN_VARIANTS = (REPORTED, PRINTED, FITTED)
SCRIPTS = (
    "model.js",
    "state.js",
    "yielding.js",
    "curves.js",
    "downloads.js",
    "charts.js",
    "main.js",
)
MAP_NOTE = "By the map's spectrum and h_max alone: in Python the calibrated law goes by its heights, too, and is nearer."
# first conductivity [W/(m K)] and Poisson's ratio
K_S = 50.0
NU = 0.3
MAX_SAMPLES = 500  # samples of a spectrum, so that a step of a slider stays fast


def packed(values: Any) -> dict[str, Any]:
    """Numbers as text: their bytes by planes, deflated; bits of single precision differenced twice before."""
    flat = np.ravel(values)
    differences = 2 * (values.dtype == np.float32)
    for _ in range(differences):
        flat = np.diff(flat.view(np.int32), prepend=np.int32(0))
    planes = np.ascontiguousarray(flat.view(np.uint8).reshape(flat.size, -1).T)
    text = base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")
    return {
        "count": flat.size,
        "bytes": flat.itemsize,
        "differences": differences,
        "text": text,
    }


def _limits() -> dict[str, Any]:
    """Tested ranges of theories, with the texts of `Contact.reasons`, and their scatter."""
    deviations = shipped_deviations()
    ranges = tested.elastic_ranges()
    return {
        "log_area": deviations.log_area.tolist(),
        "scatter": {
            name: dict(
                zip(
                    QUANTITIES,
                    np.where(np.isfinite(rows), rows, np.array(None)).tolist(),
                    strict=True,
                )
            )
            for name, rows in deviations.log_rms.items()
        },
        "gradient": MAX_GRADIENT,
        "mbma_area": mbma.MAX_AREA,
        "hurst": ranges["hurst"][0],
        "zeta_1": {
            name: tested.elastic_ranges(name)["bandwidth"] for name in deviations.log_rms
        },
        "wide_scatter": {"calibrated": WIDE_SCATTER},
        "broadest": tested.BROADEST,
        "heights": ranges["heights"],
        "compared": COMPARED,
        "area": ranges["area"],
        "max_samples": MAX_SAMPLES,
        "isotropic_share": ISOTROPIC_SHARE,
        "hardness": dataclasses.astuple(hardness_law.CONSTANTS),
    }


def _declarations() -> dict[str, dict[str, str | None]]:
    """What the page says of quantities, of which it shows those that it computes."""
    without_names = Units(None, None)
    return {
        name: {
            "meaning": declared.meaning,
            "unit": declared.unit_in(without_names),
            "uncertainty": declared.uncertainty,
        }
        for name, declared in registry().items()
    }


def _start(surface: AnySurface) -> dict[str, Any]:
    """The first state's surface."""
    if isinstance(surface, Surface) and surface.shape == ():
        return {name: float(getattr(surface, name)) for name in surface.parameters}
    if not isinstance(surface, MeasuredSurface):
        raise InputError("the page shows one surface: take one of the batch")
    if surface.q.size > MAX_SAMPLES:
        raise InputError(
            f"the page takes at most {MAX_SAMPLES} samples of a spectrum, and this one has {surface.q.size}: "
            "thin them out, or take surface.fit()"
        )
    pairs = zip(surface.q.tolist(), surface.C.tolist(), strict=True)
    spectrum = "\n".join(f"{q!r} {C!r}" for q, C in pairs)
    # the nearest five numbers, for use without the spectrum
    q0, q1, h_rms = (float(getattr(surface, name)) for name in ("q0", "q1", "h_rms"))
    return {
        "hurst": 0.8,
        "q0": q0,
        "q1": q1,
        "h_rms": h_rms,
        "h_max": float(surface.h_max),
        "spectrum": spectrum,
    }


def explorer_page(
    surface: AnySurface,
    E_star: float | None = None,
    stress_unit: str | None = None,
    theory: str | None = None,
    variant: str = "reported",
    title: str = "",
    hardness: float | str | None = None,
) -> str:
    """A page of HTML that shows how a surface touches, with sliders; it needs neither a server nor a network.

    Of a measured surface it uses the spectrum, of at most 500 samples, and h_max; heights
    and maps, which the calibrated law uses in Python, are not included. Without a modulus
    stresses are over E*. Theory, variant and `hardness` are the initial ones; the default
    theory is that of `contact_law`, but the calibrated law for a map, which the page does
    not simulate.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> page = explorer_page(Surface.named("concrete"), 13.3, "MPa", title="a road")
    >>> page.startswith("<!doctype html>"), "<title>a road</title>" in page, len(page) < 4e6
    (True, True, True)
    """
    if isinstance(surface, BandedSurface) and surface.shape == ():
        surface = surface.sampled()
    measured = isinstance(surface, MeasuredSurface)
    chosen = get_variant(variant)
    if theory is None:
        options = () if chosen == get_variant("reported") else ("variant",)
        theory = default_name(surface, options=options)
    # a page has no simulation of a map
    theory = "calibrated" if theory in OF_MAPS else theory
    if theory not in THEORIES:
        raise InputError(
            f"the page has the theories {THEORIES}, with the shipped table of islands, "
            f"got {theory!r}"
        )
    if measured and "island_model" in options_of(theory):
        raise InputError(
            f"islands in the page, of theory {theory!r}, are of surfaces of five numbers: "
            "take another theory, or surface.fit()"
        )
    modulus = (
        1.0
        if E_star is None
        else number_in("E_star", float(positive_array("E_star", E_star)), 1e-300, 1e300)
    )
    units = Units(surface.unit, "1" if E_star is None else stress_unit)
    cap = np.inf if hardness is None else float(hardness_in(units, hardness))
    start = _start(surface) | {
        "E_star": modulus,
        "k_s": K_S if surface.unit else 1.0,
        "theory": theory,
        "variant": chosen.name,
        "nu": NU,
        "hardness": number_in("hardness", cap, 1e-300, 1e300) if cap < np.inf else None,
    }
    data = {
        "version": __version__,
        "title": title,
        "start": start,
        "units": {
            "length": units.length,
            "stress": units.stress,
            "metre": surface.unit and factor(surface.unit, "m"),
        },
        "departures": list(surface.departures()),
        "note": MAP_NOTE
        if isinstance(surface, MeasuredSurface) and surface.bearing is not None
        else "",
        "quantities": _declarations(),
        "limits": _limits(),
        "model": {
            "module": base64.b64encode(page_file(MODULE)).decode("ascii"),
            "tables": {
                name: packed(value)
                for name, value in c_code.tables(universal_model()).items()
            },
            "variants": {
                one.name: {
                    "numbers": one.numbers.tolist(),
                    "cover": one.addition == "cover",
                }
                for one in SHOWN_VARIANTS
            },
        },
    }
    # a script element with data ends only at its closing tag
    text = json.dumps(data).replace("<", "\\u003c")
    scripts = "\n".join(page_file(name).decode() for name in SCRIPTS)
    parts = {
        "TITLE": html.escape(title or "contact of a rough surface"),
        "STYLE": page_file("uPlot.min.css").decode() + page_file("page.css").decode(),
        "LICENCE": html.escape(page_file("uPlot.LICENSE").decode()),
        "UPLOT": page_file("uPlot.iife.min.js").decode(),
        "SCRIPT": f'(async () => {{\n"use strict";\n{scripts}\n}})()',
        "DATA": text,
    }
    return re.sub(
        "@([A-Z]+)@", lambda place: parts[place[1]], page_file("page.html").decode()
    )
