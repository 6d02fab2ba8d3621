"""docs/yield.md: when a contact is elastic, how accurate the law with a hardness is, metals."""

from __future__ import annotations

import itertools
import json
from typing import Any

import numpy as np

from generate.boundary_elements.evidence import Capped, capped
from generate.calibrated_file import binned
from generate.calibrated_hardness import BARS, blind
from generate.files import dataset
from generate.pages.page import Measured, panels, spans, table
from mbma_tables import Surface, contact, materials
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.theories.calibrated_table import shipped_part

BINS = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6)  # A/A0 by which stiffness is compared, at these hardnesses
HARDNESSES = (0.05, 0.2, 0.8)
CONTACT = (0.01, 0.1)  # A/A0 at which elastic answers are compared
GRADIENT = 0.1  # rms gradient of a ground face
METALS = ("steel 1020", "steel 4140", "steel 52100", "stainless steel 304", "aluminium 6061", "copper C11000", "gold")
SURFACE = Surface(hurst=0.8, q0=1.0, q1=32.0, h_rms=1e-3, h_max=3.5e-3)
INDICES = np.geomspace(0.4, 40, 60)
HELD_OUT = {
    "held_out_surface": "new surfaces of known spectra",
    "held_out_spectrum": "new spectra",
    "three_waves": "of both, three longest wavelengths a side or more",
    "stretched": "stretched",
}
RATIOS = ("elastic area over true", "elastic force over true")


def measure() -> Measured:
    """When a contact is elastic, how accurate the law with a hardness is, metals."""
    seen, (_, attributes) = capped(dataset("hardness")), shipped_part("hardness")
    ratios = simulated(seen)
    rows = [[psi, *((v.mean(), v.std()) for v in ratios[1:, ratios[0] == psi])] for psi in np.unique(ratios[0])]
    header = f"psi | {RATIOS[0]}, equal force | {RATIOS[1]}, equal u | yielded share"
    drift = [[z, *(100 * error for error in row)] for z, row in json.loads(attributes["drift"]).items()]
    of_drift = "zeta_1 | area [%] | yielded share [%] | force [%] | frozen stiffness [%]"
    shares: dict[str, list[Any]] = {}
    for name, share in json.loads(attributes["coverage"]).items():
        shares.setdefault(name.split()[0], [f"`{name.split()[0]}`"]).append(tuple(share))
    covered = "theory | area at equal force | force at equal u | frozen stiffness"
    parts = {"when": table(header, rows, "{:.3g} | {:.2f} ± {:.2f}"), "held_out": held_out(), "frozen": frozen(seen)}
    parts |= {"coverage": table(covered, shares.values(), "{} | {:.0%} / {:.0%}")}
    parts |= {"drift": table(of_drift, drift, "{} | {:+.1f}"), "metals": metals()}
    return parts, {"docs/figures/yield.svg": draw(ratios)}


def simulated(seen: list[Capped]) -> FloatArray:
    """psi of every simulation, and means over contacts of A_el/A at equal force, F_el/F at equal gap, yielded share."""
    rows = []
    for one in seen:
        bare = one.bare
        # where the elastic contact was pressed as lightly
        kept = (
            (one.area > CONTACT[0]) & (one.area < CONTACT[1]) & (one.u < bare["u"][0]) & (one.force > bare["force"][0])
        )
        if one.kind != "stretched" and kept.any():
            elastic = np.exp(np.interp(np.log(one.force), np.log(bare["force"]), np.log(bare["area"])))
            load = np.exp(np.interp(-one.u, -bare["u"], np.log(bare["force"])))
            ratios = (elastic / one.area, load / one.force, one.yielded / one.area)
            rows.append((1 / one.eta, *(float(ratio[kept].mean()) for ratio in ratios)))
    return np.array(rows).T


def held_out() -> str:
    """Errors of the law with a hardness on held-out surfaces."""
    variables, attributes = shipped_part("hardness")
    sets, rows = attributes["sets"].split(), list[list[Any]]()
    forms = enumerate(("`h_max`", "the map's heights"))
    for (name, words), (form, known) in itertools.product(HELD_OUT.items(), forms):
        found = variables["accuracy"][sets.index(name), form]
        rows.append([words, known, *(tuple(100 * row[:4]) for row in found)])
    errors = ((blind()[name], BARS[name]) for name in attributes["quantities"].split())
    cells = ((e.mean(), e.std(), np.mean(np.abs(e) < bar), np.abs(e).max()) for e, bar in errors)
    rows.append(["another code's (`docs/data/hardness.csv`)", "`h_max`", *(tuple(100 * np.array(c)) for c in cells)])
    names = "area at equal force [%] | yielded share [%] | force at equal u [%] | frozen stiffness at equal force [%]"
    return table(f"surfaces | law with | {names}", rows, "{} | {} | {:+.1f} ± {:.1f}; {:.1f}; {:.0f}")


def frozen(seen: list[Capped]) -> str:
    """Frozen stiffness at equal force of theories against every self-affine simulation, by hardness and contact."""
    rows = []
    for theory, eta in itertools.product(("mbma", "calibrated"), HARDNESSES):
        parts = []  # area, deviation and stated scatter at each load
        for one in (one for one in seen if one.kind == "self_affine" and one.eta == eta):
            g, kept = float(one.surface.rms_gradient), one.area > BINS[0]
            options: dict[str, Any] = {"theory": theory, "hardness": eta * g}
            try:
                by = contact(one.surface, pressure=one.force[kept] * g, **options)
            except OutOfRangeError as fault:  # MBMA ends before
                kept[kept] = ~np.asarray(fault.mask)
                by = contact(one.surface, pressure=one.force[kept] * g, **options)
            error = np.log(by.unloading_stiffness / (one.frozen[kept] * g))
            parts.append(np.stack([one.area[kept], error, by.stiffness_scatter]))
        area, error, stated = np.concatenate(parts, axis=1)
        sizes = (np.abs(error) / stated)[np.isfinite(stated)]
        within = f"{np.mean(sizes < 1):.0%} / {np.mean(sizes < 2):.0%}"
        cells = ((own.mean(), own.std()) for own in binned(area, 100 * error, BINS))
        rows.append([f"`{theory}`", f"{eta:g}", *cells, within])
    header = f"theory | eta | {spans(BINS)} | within one / two of `stiffness_scatter`"
    return table(header, rows, "{} | {} | {:+.0f} ± {:.0f}")


def psi_of(metal: Any) -> list[float]:
    """psi of a metal pressed on itself at `GRADIENT`, from its softest state."""
    modulus = float(materials.effective_modulus(metal.E, metal.nu, metal.E, metal.nu))
    return [modulus * GRADIENT / hardness for hardness in metal.hardness]


def metals() -> str:
    """psi of metals pressed on themselves, and the gradient up to which they stay elastic."""
    rows = []
    for metal in map(materials.get, materials.METALS):
        psi = psi_of(metal)
        limit = [materials.ELASTIC_PSI * GRADIENT / p for p in psi]
        ends = (metal.hardness, "g"), (metal.conductivity, "g"), (psi[::-1], ".1f"), (limit, ".3f")
        cells = (" to ".join(dict.fromkeys(format(number, form) for number in pair)) for pair, form in ends)
        rows.append([f"`{metal.name}`", f"{metal.E:g}", *cells])
    header = f"metal | E [GPa] | hardness [GPa] | conductivity [W/(m K)] | psi at gradient {GRADIENT:g}"
    return table(f"{header} | elastic up to gradient", rows)


def draw(ratios: FloatArray) -> Any:
    """Area and force of elastic answers over the simulated ones against psi, with metals below."""
    found = contact(SURFACE, area=0.03, theory="calibrated", hardness=float(SURFACE.rms_gradient) / INDICES)
    elastic = contact(SURFACE, pressure=found.pressure, theory="calibrated")
    closer = contact(SURFACE, mean_separation=found.mean_separation, theory="calibrated")
    by_law = elastic.area / found.area, closer.pressure / found.pressure
    psi, *points, _ = ratios
    figure, axes = panels(3, 1, (7, 8), sharex=True, height_ratios=(3, 3, 2))
    labels = (f"{RATIOS[0]},\nequal force", f"{RATIOS[1]},\nequal mean gap")
    for axis, dots, line, label in zip(axes, points, by_law, labels, strict=False):
        axis.axhspan(0.95, 1.05, color="tab:green", alpha=0.2, label="within 5%")
        axis.semilogx(psi, dots, ".", color="grey", alpha=0.6, label="boundary elements, 1% to 10% contact")
        axis.semilogx(INDICES, line, label="law at 3% contact")
        axis.set_ylabel(label)
        axis.grid(True, alpha=0.3)
    axes[1].set_yscale("log")
    axes[0].legend(fontsize=8, loc="lower left")
    for place, metal in enumerate(map(materials.get, METALS)):
        axes[2].plot(psi_of(metal), [place, place], linewidth=6)
    for axis in axes:
        axis.axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
    axes[2].set_yticks(range(len(METALS)), [f"{name} on itself" for name in METALS], fontsize=8)
    axes[2].set_xlabel(f"psi = E* g/p_m; metals at rms gradient {GRADIENT:g}, hard to soft")
    return figure
