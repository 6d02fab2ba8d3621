"""Measured parts of docs/calibrated.md, docs/leakage.md and docs/yield.md: laws fitted to boundary elements."""

import functools
import itertools
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from generate.boundary_elements.evidence import Capped, capped
from generate.boundary_elements.surfaces import REFINEMENT, SPLITS, TRAINING
from generate.calibrated_file import binned
from generate.calibrated_hardness import BARS, blind
from generate.files import dataset
from generate.leakage_law import (
    CERTIFICATE,
    EDGES,
    LAWS,
    Flow,
    cases,
    errors,
    noise_floor,
    summary,
)
from generate.page import Measured, panels, spans, table
from mbma_tables import Bodies, Surface, contact, materials
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.common.files import shipped_file
from mbma_tables.quantities.leakage import GROUP, shipped_flow
from mbma_tables.theories.calibrated.formulas import CONSTANTS
from mbma_tables.theories.calibrated.table import shipped
from mbma_tables.theories.evidence import shipped_part

# rows of the accuracy of the calibrated law, as its file names them
SETS = (
    *(
        f"held_out_{held}, {waves} waves, spectrum"
        for waves in ("2-3", "4")
        for held in ("surface", "spectrum")
    ),
    *(
        "held_out_surface, 1 wave, spectrum",
        "held_out_surface, 4 waves, map",
        "held_out_spectrum, 4 waves, map",
    ),
    *(
        f"held_out_spectrum, {kind}, map"
        for kind in ("2-3 waves", "stretched", "transformed")
    ),
    *(
        f"self-affine, {name}"
        for name in (
            "mbma",
            "mbma_printed",
            "mbma_fitted",
            "persson",
            "greenwood_williamson",
        )
    ),
)
WORDS = {
    "held_out_": "new ",
    "4 wave": "4-8 wave",
    "wave": "wavelength",
    "stretched": "stretched 1:3 to 1:12",
}
GRIDS = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9)  # contacts at which grids are compared

BINS, HEADER = (0.004, 0.05, 0.15, 0.3, 0.4), "A {:.3g}-{:.3g}%"  # of leakage

YIELD_BINS = (
    0.002,
    0.01,
    0.03,
    0.1,
    0.3,
    0.6,
)  # A/A0 by which stiffness is compared, at these hardnesses
HARDNESSES = (0.05, 0.2, 0.8)
GRADIENT = 0.1  # rms gradient of a ground face
SURFACE = Surface(hurst=0.8, q0=1.0, q1=32.0, h_rms=1e-3, h_max=3.5e-3)
INDICES = np.geomspace(0.4, 40, 60)
HELD_OUT = {
    "held_out_surface": "new surfaces of known spectra",
    "held_out_spectrum": "new spectra",
    "three_waves": "of both, three longest wavelengths a side or more",
    "stretched": "stretched",
}
RATIOS = ("elastic area over true", "elastic force over true")


def calibrated() -> Measured:
    data = xr.load_dataset(shipped_file("calibrated.nc"))
    edges, sets = (
        (*data.contact_low.values, data.contact_high.values[-1]),
        data.attrs["sets"].split("; "),
    )
    words = [
        functools.reduce(lambda text, pair: text.replace(*pair), WORDS.items(), name)
        for name in SETS
    ]
    parts, header = {}, f"surfaces, and what is known of them | {spans(edges)}"
    for number, quantity in enumerate(data.attrs["quantities"].split()):
        own = 100 * data.accuracy.values[[sets.index(name) for name in SETS], number]
        rows = (
            [name, *map(tuple, row[:, :2])] for name, row in zip(words, own, strict=True)
        )
        parts[quantity] = table(header, rows, "{} | {:+.0f} ± {:.0f}")
    return parts | {
        "numbers": numbers(data.attrs),
        "bars": bars(data.attrs["bars"]),
        "refinement": refinement(),
    }, {}


def numbers(facts: dict[str, Any]) -> str:
    rows = [(f"`{name}`", f"{facts[f'law_{name}']:.4g}") for name in vars(CONSTANTS)]
    rows += [
        (f"`{name[4:]}` (map)", f"{value:.4g}")
        for name, value in facts.items()
        if name.startswith("map_")
    ]
    evidence = json.loads(facts["evidence"])
    rows += [
        (
            "surfaces simulated, of which in the training set",
            f"{evidence['surfaces']}, {evidence['training']}",
        )
    ]
    for what in ("force", "area", "stiffness"):
        largest, most = facts[f"largest_error_{what}"], facts[f"p99_error_{what}"]
        rows.append(
            (f"largest (99%) error of {what} by the table", f"{largest:.1e} ({most:.1e})")
        )
    for what, (one, two) in json.loads(facts["coverage"]).items():
        rows.append(
            (
                f"held-out errors of {what} within one and two of the stated",
                f"{one:.0%}, {two:.0%}",
            )
        )
    return table("quantity | value", rows)


def bars(stored: str) -> str:
    """Limits to nine errors in ten, what is reached, and the floor by surfaces of one spectrum."""
    rows = []
    for bar in json.loads(stored):
        over, large = 100 * (bar["found"] - bar["limit"]), f"({bar['surfaces_large']})"
        found = f"{100 * bar['found']:.1f}%: {'met' if over <= 0 else f'missed by {over:.1f}'}"
        large = (
            f"{100 * bar['large']:.1f}% {large}"
            if np.isfinite(bar["large"])
            else f"— {large}"
        )
        what = bar["what"].replace("wave", "wavelength") + " a side"
        rows.append(
            [
                what,
                100 * bar["limit"],
                found,
                100 * bar["mean"],
                bar["surfaces"],
                large,
                100 * bar["noise"],
            ]
        )
    header = "case | limit | 90% quantile | mean | surfaces | 90% quantile on 512 and 1024 points a side | lower bound"
    return table(header, rows, "{} | {:g}% | {} | {:+.1f}% | {} | {} | {:.1f}%")


def refinement() -> str:
    """Errors of raw and corrected areas on coarse grids against the finest, by points a shortest wave and contact."""
    data = dataset("elastic")
    one = data.isel(surface=data.split.values == SPLITS.index(REFINEMENT))
    finest, spacings = (
        one.points.values == one.points.values.max(),
        one.points / (one.zeta_1 * one.waves),
    )
    rows = []
    for spacing in np.unique(spacings.values[~finest]):
        own = one.isel(surface=~finest & (spacings.values == spacing))
        exact = np.array(
            [
                one.area.values[finest & (one.seed.values == seed)][0]
                for seed in own.seed.values
            ]
        )
        cells = []
        for area in (own.area_raw.values, own.area.values):
            # a grid may have no contact at a load
            error = np.where(area > 0, np.log(np.maximum(area, 1e-300) / exact), np.nan)
            cells.append(binned(exact.ravel(), 100 * error.ravel(), GRIDS))
        pairs = zip(*cells, strict=True)
        rows.append(
            [
                spacing,
                *((a.mean(), b.mean()) if a.size and b.size else "—" for a, b in pairs),
            ]
        )
    return table(
        f"grid points per shortest wavelength | {spans(GRIDS)}",
        rows,
        "{:g} | {:+.1f}, {:+.1f}",
    )


def leakage() -> Measured:
    seen = cases(dataset("leakage"))
    parts = {"accuracy": leakage_accuracy(), "cells": of_cells(seen), "floor": floor()}
    return parts, {"docs/figures/leakage.svg": draw_leakage(seen)}


def leakage_accuracy() -> str:
    """Every law on held-out surfaces, and the law on every set."""
    values, facts = shipped_part(GROUP)
    sets, laws = facts["sets"].split("; "), facts["laws"].split("; ")
    shown, lines = [(law, "held out") for law in laws], []
    for name in (name for name in sets if not name.startswith("held")):
        shown += [
            (law, name)
            for law in ("calibrated", "closed form")[: 2 if "zeta_1" in name else 1]
        ]
    for law, name in shown:
        cells: list[Any] = []
        for low, high in itertools.pairwise(BINS):
            # wider bins than those of the file
            inside = [low <= a and b <= high + 1e-9 for a, b in itertools.pairwise(EDGES)]
            bias, rms, number = np.nan_to_num(
                values["accuracy"][sets.index(name), laws.index(law), inside]
            ).T
            total = number.sum()
            cells.append(
                (bias @ number / total, np.sqrt(rms**2 @ number / total), total)
                if total
                else None
            )
        lines.append([f"{law}, {name}".replace("waves", "wavelengths a side"), *cells])
    return table(
        f"law, set | {spans(BINS, HEADER)}", lines, "{} | {:+.2f}, {:.2f} ({:.0f})"
    )


def floor() -> str:
    """Cell-to-cell scatter, stated scatter and share of directions that are blocked, by contact."""
    values, facts = shipped_part(GROUP)
    rows = {"cells of one spectrum differ by": values["noise"]}
    theories = [f"stated scatter, `{name}`" for name in facts["theories"].split()]
    rows |= dict(zip(theories, values["stated_scatter"], strict=True))
    rows["share of directions blocked"] = values["share_blocked"]
    lines = [
        [name, *(None if np.isnan(v) else v for v in row)] for name, row in rows.items()
    ]
    (one, two), far, flow = (
        facts["coverage"],
        facts["largest_error_log_factor"],
        shipped_flow().constants,
    )
    cells = table(f"A [%] | {spans(EDGES, '{:.3g}-{:.3g}')}", lines, "{} | {:.2f}")
    return (
        f"{cells}\n\nHeld-out errors up to 30% contact within one and two of the stated scatter: {one:.0%} and "
        f"{two:.0%}. Constants: Ac = {flow.threshold:g}, m = {flow.obstruction:g}; closed form {flow.prefactor:g} u^3 "
        f"(1 - A/Ac)^{flow.exponent:g}. On {CERTIFICATE} held-out surfaces the table differs from the medium in ln R "
        f"by at most {facts['largest_error_simulated']:.2g} up to zeta_1 = 64, and {far:.2g} beyond."
    )


def of_cells(seen: Sequence[Any]) -> str:
    """Held-out errors, and the spread of cells of one spectrum, with many and with few longest wavelengths a side."""
    constants, lines = shipped_flow().constants, list[list[Any]]()
    for name, many in (("eight", True), ("four or five", False)):
        own = [one for one in seen if one.plain and (one.waves >= 8) == many]
        flows = [Flow(one, shipped().constants) for one in own if one.split != TRAINING]
        for law in ("calibrated", "medium, simulated area and gap"):
            misses = [errors(flow, LAWS[law](flow, constants)) for flow in flows]
            cells = [f"{rms:.2f} ({n:.0f})" for _, rms, n in summary(misses, BINS)]
            lines.append([f"{law}, {name} wavelengths a side", *cells])
        of_one = [f"{value:.2f}" for value in noise_floor(own, BINS)]
        lines.append([f"cells of one spectrum, {name} wavelengths a side", *of_one])
    return table(f"rms of ln k | {spans(BINS, HEADER)}", lines)


def draw_leakage(seen: Sequence[Any]) -> Any:
    figure, axes_of = panels(1, 2, (10, 4.5), sharey=True)
    area, flow = np.linspace(0.004, 0.405, 200), shipped_flow().constants
    for axes, hurst in zip(axes_of, (0.4, 0.8), strict=True):
        alike = [
            one
            for one in seen
            if one.node[:2] == ("self_affine", hurst) and (one.plain or one.zeta_1 >= 64)
        ]
        for colour, sign, large in (("k", "<", False), ("r", ">=", True)):
            own = [
                (one.area, np.exp(one.log_k))
                for one in alike
                if (one.zeta_1 >= 64) == large
            ]
            dots: dict[str, Any] = {
                "ms": 4,
                "alpha": 0.6,
                "label": f"simulated, zeta_1 {sign} 64",
            }
            axes.plot(
                *np.concatenate([*own, np.empty((2, 0))], axis=1), f"{colour}.", **dots
            )
        for zeta, style in ((64.0, "--"), (1024.0, ":"), (16.0, "-")):
            answer = contact(
                Surface(hurst, 1.0, zeta, 1.0, 4.0), area=area, theory="calibrated"
            )
            k = np.where(answer.leakage.blocked, np.nan, answer.leakage.K)
            axes.plot(area, k, f"C0{style}", label=f"calibrated, zeta_1 {zeta:g}")
        # the last of these also by other laws
        spread, u = np.exp(answer.leakage.scatter), answer.mean_separation
        axes.fill_between(
            area, k / spread, k * spread, color="C0", alpha=0.2, lw=0, label="its scatter"
        )
        closed = flow.closed_form(u, area)
        axes.plot(
            area,
            np.where(closed > 0, closed, np.nan),
            "C1-",
            lw=1,
            label="closed form, zeta_1 16",
        )
        axes.plot(area, u**3, "C2-", lw=1, label="u^3, zeta_1 16")
        axes.set(
            xlabel="real contact area  A/A0",
            yscale="log",
            ylim=(1e-7, 20),
            title=f"H = {hurst:g}",
        )
        axes.grid(alpha=0.3)
    axes_of[0].set_ylabel("flow coefficient over h_rms^3,  k")
    axes_of[0].legend(fontsize="small")
    return figure


def yielding() -> Measured:
    seen, (_, attributes) = capped(dataset("hardness")), shipped_part("hardness")
    ratios = simulated(seen)
    rows = [
        [psi, *((v.mean(), v.std()) for v in ratios[1:, ratios[0] == psi])]
        for psi in np.unique(ratios[0])
    ]
    header = f"psi | {RATIOS[0]}, equal force | {RATIOS[1]}, equal u | yielded share"
    drift = [
        [z, *(100 * error for error in row)]
        for z, row in json.loads(attributes["drift"]).items()
    ]
    of_drift = "zeta_1 | area [%] | yielded share [%] | force [%] | frozen stiffness [%]"
    shares: dict[str, list[Any]] = {}
    for name, share in json.loads(attributes["coverage"]).items():
        shares.setdefault(name.split()[0], [f"`{name.split()[0]}`"]).append(tuple(share))
    covered = "theory | area at equal force | force at equal u | frozen stiffness"
    parts = {
        "when": table(header, rows, "{:.3g} | {:.2f} ± {:.2f}"),
        "held_out": held_out(),
        "frozen": frozen(seen),
    }
    parts |= {"coverage": table(covered, shares.values(), "{} | {:.0%} / {:.0%}")}
    parts |= {"drift": table(of_drift, drift, "{} | {:+.1f}"), "metals": metals()}
    return parts, {"docs/figures/yield.svg": draw_yield(ratios)}


def simulated(seen: list[Capped]) -> FloatArray:
    """By simulation psi, means from 1% to 10% contact of A_el/A at equal force and F_el/F at equal u, yielded share."""
    rows = []
    for one in seen:
        bare, light = one.bare, (one.area > 0.01) & (one.area < 0.1)
        # where the elastic contact was pressed as lightly
        kept = light & (one.u < bare["u"][0]) & (one.force > bare["force"][0])
        if one.kind != "stretched" and kept.any():
            elastic = np.exp(
                np.interp(np.log(one.force), np.log(bare["force"]), np.log(bare["area"]))
            )
            load = np.exp(np.interp(-one.u, -bare["u"], np.log(bare["force"])))
            ratios = (elastic / one.area, load / one.force, one.yielded / one.area)
            rows.append((1 / one.eta, *(float(ratio[kept].mean()) for ratio in ratios)))
    return np.array(rows).T


def held_out() -> str:
    variables, attributes = shipped_part("hardness")
    sets, rows = attributes["sets"].split(), list[list[Any]]()
    forms = enumerate(("`h_max`", "the map's heights"))
    for (name, words), (form, known) in itertools.product(HELD_OUT.items(), forms):
        found = variables["accuracy"][sets.index(name), form]
        rows.append([words, known, *(tuple(100 * row[:4]) for row in found)])
    errors = ((blind()[name], BARS[name]) for name in attributes["quantities"].split())
    cells = (
        (e.mean(), e.std(), np.mean(np.abs(e) < bar), np.abs(e).max())
        for e, bar in errors
    )
    rows.append(
        [
            "another code's (`docs/data/hardness.csv`)",
            "`h_max`",
            *(tuple(100 * np.array(c)) for c in cells),
        ]
    )
    names = "area at equal force [%] | yielded share [%] | force at equal u [%] | frozen stiffness at equal force [%]"
    return table(
        f"surfaces | law with | {names}",
        rows,
        "{} | {} | {:+.1f} ± {:.1f}; {:.1f}; {:.0f}",
    )


def frozen(seen: list[Capped]) -> str:
    """Frozen stiffness at equal force of theories against every self-affine simulation, by hardness and contact."""
    rows = []
    for theory, eta in itertools.product(("mbma", "calibrated"), HARDNESSES):
        parts = []  # area, deviation and stated scatter at each load
        for one in (one for one in seen if one.kind == "self_affine" and one.eta == eta):
            g, kept = float(one.surface.rms_gradient), one.area > YIELD_BINS[0]
            bodies = Bodies(hardness=eta * g)
            try:
                by = contact(
                    one.surface, bodies, pressure=one.force[kept] * g, theory=theory
                )
            except OutOfRangeError as fault:  # MBMA ends before
                kept[kept] = ~np.asarray(fault.mask)
                by = contact(
                    one.surface, bodies, pressure=one.force[kept] * g, theory=theory
                )
            error = np.log(by.unloading_stiffness / (one.frozen[kept] * g))
            parts.append(
                np.stack([one.area[kept], error, by.unloading_stiffness_scatter])
            )
        area, error, stated = np.concatenate(parts, axis=1)
        sizes = (np.abs(error) / stated)[np.isfinite(stated)]
        within = f"{np.mean(sizes < 1):.0%} / {np.mean(sizes < 2):.0%}"
        cells = ((own.mean(), own.std()) for own in binned(area, 100 * error, YIELD_BINS))
        rows.append([f"`{theory}`", f"{eta:g}", *cells, within])
    header = f"theory | eta | {spans(YIELD_BINS)} | within one / two of `unloading_stiffness_scatter`"
    return table(header, rows, "{} | {} | {:+.0f} ± {:.0f}")


def metals() -> str:
    """psi of metals pressed on themselves at `GRADIENT`, and the gradient up to which they stay elastic."""
    rows = []
    for metal in map(materials.get, materials.METALS):
        modulus = float(materials.effective_modulus(metal.E, metal.nu, metal.E, metal.nu))
        psi = [modulus * GRADIENT / hardness for hardness in metal.hardness]
        limit = [materials.ELASTIC_PSI * GRADIENT / p for p in psi]
        ends = (
            (metal.hardness, "g"),
            (metal.conductivity, "g"),
            (psi[::-1], ".1f"),
            (limit, ".3f"),
        )
        cells = (
            " to ".join(dict.fromkeys(format(number, form) for number in pair))
            for pair, form in ends
        )
        rows.append([f"`{metal.name}`", f"{metal.E:g}", *cells])
    header = f"metal | E [GPa] | hardness [GPa] | conductivity [W/(m K)] | psi at gradient {GRADIENT:g}"
    return table(f"{header} | elastic up to gradient", rows)


def draw_yield(ratios: FloatArray) -> Any:
    """Area and force of elastic answers over the simulated ones against psi."""
    found = contact(
        SURFACE,
        Bodies(hardness=float(SURFACE.rms_gradient) / INDICES),
        area=0.03,
        theory="calibrated",
    )
    elastic = contact(SURFACE, pressure=found.pressure, theory="calibrated")
    closer = contact(SURFACE, mean_separation=found.mean_separation, theory="calibrated")
    by_law = elastic.area / found.area, closer.pressure / found.pressure
    figure, axes = panels(2, 1, (7, 6), sharex=True)
    labels = (f"{RATIOS[0]},\nequal force", f"{RATIOS[1]},\nequal mean gap")
    for axis, dots, line, label in zip(axes, ratios[1:3], by_law, labels, strict=True):
        axis.axhspan(0.95, 1.05, color="tab:green", alpha=0.2, label="within 5%")
        axis.semilogx(
            ratios[0],
            dots,
            ".",
            color="grey",
            alpha=0.6,
            label="boundary elements, 1% to 10% contact",
        )
        axis.semilogx(INDICES, line, label="law at 3% contact")
        axis.axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
        axis.set_ylabel(label)
        axis.grid(True, alpha=0.3)
    axes[1].set(yscale="log", xlabel="psi = E* g/p_m")
    axes[0].legend(fontsize=8, loc="lower left")
    return figure
