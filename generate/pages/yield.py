"""The measured parts of docs/yield.md: when a contact is elastic, how close the law is, what metals do."""

from __future__ import annotations

import itertools
import json
import time
from typing import Any

import numpy as np
import xarray as xr

from generate.boundary_elements.evidence import capped
from generate.calibrated_hardness import BARS, blind
from generate.pages.page import ROOT, pyplot, svg, table
from mbma_tables import Surface, contact, materials
from mbma_tables.arguments import FloatArray
from mbma_tables.errors import OutOfRangeError
from mbma_tables.theories.calibrated_table import shipped_part
from mbma_tables.totals.conductance import conductance

EVIDENCE = "docs/data/hardness.nc"
BINS = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6)  # A/A0 by which stiffness is compared, at these hardnesses
HARDNESSES = (0.05, 0.2, 0.8)
CONTACT = (0.01, 0.1)  # A/A0 at which elastic answers are compared
GRADIENT = 0.1  # rms gradient of a ground face
SHOWN = ("steel 1020", "steel 4140", "steel 52100", "stainless steel 304", "aluminium 6061", "copper C11000", "gold")
SURFACE = Surface(hurst=0.8, q0=1.0, q1=32.0, h_rms=1e-3, h_max=3.5e-3)
COUNTS, REPEATS = (1, 100, 10_000), 7
INDICES = np.geomspace(0.4, 40, 60)
SETS = {
    "held_out_surface": "new surfaces of known spectra",
    "held_out_spectrum": "new spectra",
    "three_waves": "of both, three longest waves a side or more",
    "stretched": "stretched",
}


def simulated() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """psi of every simulation, and means over contacts of A_el/A at equal force, F_el/F at equal gap, yielded share."""
    with xr.open_dataset(ROOT / EVIDENCE) as opened:
        data = opened.load()
    stretched = data.kind.attrs["flag_meanings"].split().index("stretched")
    rows = []
    for k in np.flatnonzero(data.kind.values != stretched):
        one = data.isel(surface=int(k))
        force, area, u, yielded = (
            one[name].values.astype(float) for name in ("force", "area", "mean_separation", "area_yielded")
        )
        for row, eta in enumerate(data.eta.values[:-1]):
            kept = (area[row] > CONTACT[0]) & (area[row] < CONTACT[1])
            # where the elastic contact was pressed as lightly
            kept &= (u[row] < u[-1, 0]) & (force[row] > force[-1, 0])
            if kept.any():
                elastic = np.exp(np.interp(np.log(force[row]), np.log(force[-1]), np.log(area[-1])))
                load = np.exp(np.interp(-u[row], -u[-1], np.log(force[-1])))
                ratios = (elastic / area[row], load / force[row], yielded[row] / area[row])
                rows.append((1 / eta, *(float(ratio[kept].mean()) for ratio in ratios)))
    return tuple(np.array(rows).T)


def by_law() -> tuple[FloatArray, FloatArray]:
    """The same of the law, on a surface of 32 magnifications, at 3% contact."""
    hardness = float(SURFACE.rms_gradient) / INDICES
    found = contact(SURFACE, area=0.03, theory="calibrated", hardness=hardness)
    elastic = contact(SURFACE, pressure=found.force, theory="calibrated")
    closer = contact(SURFACE, mean_separation=found.mean_separation, theory="calibrated")
    return np.asarray(elastic.area / found.area), np.asarray(closer.force / found.force)


def when() -> str:
    """Simulated ratios by psi."""
    psi, area, force, yielded = simulated()
    rows = []
    for index in np.unique(psi):
        own = psi == index
        rows.append(
            [
                f"{index:.3g}",
                *(f"{values[own].mean():.2f} ± {values[own].std():.2f}" for values in (area, force, yielded)),
            ]
        )
    return table(
        ["psi", "elastic area over true, equal force", "elastic force over true, equal u", "yielded share"], rows
    )


def _cell(bias: float, spread: float, share: float, largest: float) -> str:
    return f"{100 * bias:+.1f} ± {100 * spread:.1f}; {100 * share:.1f}; {100 * largest:.0f}"


def held_out() -> str:
    """Errors of the law on surfaces that no fit saw."""
    variables, attributes = shipped_part("hardness")
    sets, quantities = attributes["sets"].split(), attributes["quantities"].split()
    rows = []
    for name, words in SETS.items():
        for form, words_of_form in enumerate(("`h_max`", "the map's heights")):
            rows.append(
                [words, words_of_form, *(_cell(*row[:4]) for row in variables["accuracy"][sets.index(name), form])]
            )
    errors, cells = blind(), []
    for quantity in quantities:
        e = errors[quantity]
        size = np.abs(e)
        cells.append(_cell(e.mean(), e.std(), np.mean(size < BARS[quantity]), size.max()))
    rows.append(["another code's (`docs/data/hardness.csv`)", "`h_max`", *cells])
    names = ["area at equal force", "yielded share", "force at equal u", "frozen stiffness at equal force"]
    return table(["surfaces", "law with", *(f"{name} [%]" for name in names)], rows)


def frozen() -> str:
    """Frozen stiffness at equal force of theories against every self-affine simulation, by hardness and contact."""
    with xr.open_dataset(ROOT / EVIDENCE) as opened:
        seen = [one for one in capped(opened.load()) if one.kind == "self_affine"]
    rows = []
    for theory, eta in itertools.product(("mbma", "calibrated"), HARDNESSES):
        found = []
        for one in (one for one in seen if one.eta == eta):
            surface = Surface(one.node[1], 1.0, one.zeta_1, 1.0, one.h_max)
            g, touching = float(surface.rms_gradient), np.flatnonzero(one.area > BINS[0])
            for k in touching:
                try:
                    by = contact(surface, pressure=one.force[k] * g, theory=theory, hardness=eta * g)
                except OutOfRangeError:  # MBMA ends before
                    break
                found.append(
                    (one.area[k], np.log(by.incremental_stiffness / (one.frozen[k] * g)), by.stiffness_scatter)
                )
        area, error, stated = np.array(found).T
        bins = [error[(area > low) & (area < high)] for low, high in itertools.pairwise(BINS)]
        cells = [f"{100 * own.mean():+.0f} ± {100 * own.std():.0f}" for own in bins]
        sizes = (np.abs(error) / stated)[np.isfinite(stated)]
        within = [f"{np.mean(sizes < n):.0%}" for n in (1, 2)]
        rows.append([f"`{theory}`", f"{eta:g}", *cells, " / ".join(within)])
    header = [f"{100 * low:g}-{100 * high:g}%" for low, high in itertools.pairwise(BINS)]
    return table(["theory", "eta", *header, "within one / two of `stiffness_scatter`"], rows)


def coverage() -> str:
    """Shares of held-out errors within one and two stated standard deviations."""
    rows: dict[str, list[str]] = {}
    for name, shares in json.loads(shipped_part("hardness")[1]["coverage"]).items():
        theory = name.split()[0]
        rows.setdefault(theory, [f"`{theory}`"]).append(" / ".join(f"{share:.0%}" for share in shares))
    return table(["theory", "area at equal force", "force at equal u", "frozen stiffness"], list(rows.values()))


def drift() -> str:
    """Mean errors of the parts by zeta_1."""
    rows = [
        [zeta_1, *(f"{100 * e:+.1f}" for e in row)]
        for zeta_1, row in json.loads(shipped_part("hardness")[1]["drift"]).items()
    ]
    return table(["zeta_1", *(f"{name} [%]" for name in ("area", "yielded share", "force", "frozen stiffness"))], rows)


def metals() -> str:
    """psi of metals pressed on themselves, and the gradient up to which they stay elastic."""
    rows = []
    for name in materials.METALS:
        metal = materials.get(name)
        modulus = float(materials.effective_modulus(metal.E, metal.nu, metal.E, metal.nu))
        psi = [modulus * GRADIENT / hardness for hardness in metal.hardness]
        limit = [materials.ELASTIC_PSI * hardness / modulus for hardness in metal.hardness]
        spans = (metal.hardness, "g"), (metal.conductivity, "g"), (psi[::-1], ".1f"), (limit, ".3f")
        cells = (" to ".join(dict.fromkeys(format(number, form) for number in span)) for span, form in spans)
        rows.append([f"`{name}`", f"{metal.E:g}", *cells])
    header = ["metal", "E [GPa]", "hardness [GPa]", "conductivity [W/(m K)]", f"psi at gradient {GRADIENT:g}"]
    return table([*header, "elastic up to gradient"], rows)


def cost() -> str:
    """Times of pressure to gap, area and conductance, with a hardness over without."""
    rng = np.random.default_rng(5)
    rows = []
    for count in COUNTS:
        pressure = float(SURFACE.rms_gradient) * 0.3 * 10 ** rng.uniform(-3, -0.1, count)
        spent: dict[float, list[float]] = {np.inf: [], 0.3 * float(SURFACE.rms_gradient): []}
        for _ in range(REPEATS):
            for hardness, times in spent.items():
                start = time.thread_time()
                found = contact(SURFACE, pressure=pressure, theory="calibrated", hardness=hardness)
                _ = found.area, conductance(found.incremental_stiffness, 1.0, 1.0)
                times.append(time.thread_time() - start)
        elastic, capped = (min(times) for times in spent.values())
        rows.append([f"{count}", f"{capped / elastic:.1f}"])
    return table(["pressures in a call", "time with a hardness over elastic"], rows)


def draw() -> bytes:
    """Area and force of elastic answers over the truth against psi, with metals below."""
    psi, area, force, _ = simulated()
    line_area, line_force = by_law()
    figure, axes = pyplot().subplots(3, 1, figsize=(7, 8), sharex=True, height_ratios=(3, 3, 2), layout="constrained")
    drawn: list[tuple[Any, FloatArray, FloatArray, str]] = [
        (axes[0], area, line_area, "elastic area over true,\nequal force"),
        (axes[1], force, line_force, "elastic force over true,\nequal mean gap"),
    ]
    for axis, points, line, label in drawn:
        axis.axhspan(0.95, 1.05, color="tab:green", alpha=0.2, label="within 5%")
        axis.semilogx(psi, points, ".", color="grey", alpha=0.6, label="boundary elements, 1% to 10% contact")
        axis.semilogx(INDICES, line, label="law at 3% contact")
        axis.axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
        axis.set_ylabel(label)
        axis.grid(True, alpha=0.3)
    axes[1].set_yscale("log")
    axes[0].legend(fontsize=8, loc="lower left")
    for place, name in enumerate(SHOWN):
        metal = materials.get(name)
        modulus = float(materials.effective_modulus(metal.E, metal.nu, metal.E, metal.nu))
        axes[2].plot([modulus * GRADIENT / hardness for hardness in metal.hardness], [place, place], linewidth=6)
    axes[2].axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
    axes[2].set_yticks(range(len(SHOWN)), [f"{name} on itself" for name in SHOWN], fontsize=8)
    axes[2].set_xlabel(f"psi = E* g/p_m; metals at rms gradient {GRADIENT:g}, hard to soft")
    return svg(figure)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its figure."""
    parts = {
        "when": when(),
        "held_out": held_out(),
        "frozen": frozen(),
        "coverage": coverage(),
        "drift": drift(),
        "metals": metals(),
        "cost": cost(),
    }
    return parts, {"docs/figures/yield.svg": draw()}
