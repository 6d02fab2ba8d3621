"""Measured parts of the calibrated law, of docs/leakage.md and of docs/yield.md.

They show laws that are fitted to boundary elements.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import xarray as xr

from generate import gas_flow, unloaded_flow
from generate.boundary_elements.evidence import Capped, capped
from generate.boundary_elements.surfaces import REFINEMENT, SPLITS, TRAINING
from generate.calibrated_file import binned
from generate.calibrated_hardness import BARS, blind
from generate.files import dataset
from generate.leakage_law import (
    CERTIFICATE,
    EDGES,
    LAWS,
    Case,
    Flow,
    cases,
    errors,
    noise_floor,
    summary,
)
from generate.page import Cell, Measured, Picture, panels, spans, table
from mbma_tables import (
    Bodies,
    Surface,
    contact,
    contact_law,
    materials,
    sealing_pressure,
)
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.common.files import shipped_file
from mbma_tables.common.plots import number_ticks
from mbma_tables.contacts.quantities.effective_medium import FlowConstants
from mbma_tables.contacts.quantities.leakage import GROUP, shipped_flow
from mbma_tables.theories.calibrated.formulas import CONSTANTS
from mbma_tables.theories.calibrated.table import shipped
from mbma_tables.theories.evidence import shipped_part

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# rows of the accuracy of the calibrated law, as its file names them
SETS = (
    "held_out_surface, 2-3 waves, spectrum",
    "held_out_spectrum, 2-3 waves, spectrum",
    "held_out_surface, 4 waves, spectrum",
    "held_out_spectrum, 4 waves, spectrum",
    "held_out_surface, 1 wave, spectrum",
    "held_out_surface, 4 waves, map",
    "held_out_spectrum, 4 waves, map",
    "held_out_spectrum, 2-3 waves, map",
    "held_out_spectrum, stretched, map",
    "held_out_spectrum, transformed, map",
    "self-affine, mbma",
    "self-affine, mbma_printed",
    "self-affine, mbma_fitted",
    "self-affine, persson",
    "self-affine, greenwood_williamson",
)
# what the page writes for parts of these names, replaced in this order
WORDS = {
    "held_out_": "new ",
    "4 wave": "4-8 wave",
    "wave": "wavelength",
    "stretched": "stretched 1:3 to 1:12",
}
GRIDS = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9)  # contacts at which grids are compared

# bins of contact of the leakage tables, wider than those of the file
BINS = (0.004, 0.05, 0.15, 0.3, 0.4)
HEADER = "A {:.3g}-{:.3g}%"

# A/A0 by which stiffness is compared, at these hardnesses
YIELD_BINS = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6)
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
# the seal of docs/leakage.md, its gas and the leak rate that is asked for
SEAL = Surface(hurst=0.8, q0=0.01, q1=0.4, h_rms=2.0, h_max=7.0, unit="um")
SEAL_PRESSURES = np.geomspace(0.02, 0.5, 60)  # MPa
RING: dict[str, Any] = {
    "inlet": "1 bar",
    "outlet": "0 bar",
    "width": "2 mm",
    "length": "0.3 m",
}
LEAK_UNIT = "mbar l/s"
WANTED_LEAK = 1e-2
RATIOS = ("elastic area over true", "elastic force over true")


def calibrated() -> Measured:
    data = xr.load_dataset(shipped_file("calibrated.nc"))
    edges = (*data.contact_low.values, data.contact_high.values[-1])
    header = f"surfaces, and what is known of them | {spans(edges)}"
    sets_of_file = data.attrs["sets"].split("; ")
    numbers_of_sets = [sets_of_file.index(name) for name in SETS]
    titles = [_in_words(name) for name in SETS]

    parts = {}
    for number, quantity in enumerate(data.attrs["quantities"].split()):
        percentages = 100 * data.accuracy.values[numbers_of_sets, number]
        rows: list[list[Cell]] = []
        for title, by_bin in zip(titles, percentages, strict=True):
            # mean and standard deviation in each bin
            rows.append([title, *map(tuple, by_bin[:, :2])])
        parts[quantity] = table(header, rows, "{} | {:+.0f} ± {:.0f}")
    parts["bars"] = bars(data.attrs["bars"])
    parts["refinement"] = refinement()
    return parts, {}


def constants() -> Measured:
    """The constants of the calibrated law, as docs/theories.md lists them."""
    return {"numbers": numbers(xr.load_dataset(shipped_file("calibrated.nc")).attrs)}, {}


def _in_words(name: str) -> str:
    """The name of a set as the page writes it."""
    for part, words in WORDS.items():
        name = name.replace(part, words)
    return name


def numbers(facts: dict[str, Any]) -> str:
    rows = [(f"`{name}`", f"{facts[f'law_{name}']:.4g}") for name in vars(CONSTANTS)]
    for name, value in facts.items():
        if name.startswith("map_"):
            rows.append((f"`{name[4:]}` (map)", f"{value:.4g}"))

    evidence = json.loads(facts["evidence"])
    counts = f"{evidence['surfaces']}, {evidence['training']}"
    rows.append(("surfaces simulated, of which in the training set", counts))

    for what in ("force", "area", "stiffness"):
        largest = facts[f"largest_error_{what}"]
        most = facts[f"p99_error_{what}"]
        label = f"largest (99%) error of {what} by the table"
        rows.append((label, f"{largest:.1e} ({most:.1e})"))
    for what, (one, two) in json.loads(facts["coverage"]).items():
        label = f"held-out errors of {what} within one and two of the stated"
        rows.append((label, f"{one:.0%}, {two:.0%}"))
    return table("quantity | value", rows)


def bars(stored: str) -> str:
    """Limits to nine errors in ten, what is reached, the floor by surfaces of one spectrum."""
    rows = []
    for bar in json.loads(stored):
        over = 100 * (bar["found"] - bar["limit"])
        verdict = "met" if over <= 0 else f"missed by {over:.1f}"
        reached = f"{100 * bar['found']:.1f}%: {verdict}"
        on_large_grids = f"({bar['surfaces_large']})"
        if np.isfinite(bar["large"]):
            on_large_grids = f"{100 * bar['large']:.1f}% {on_large_grids}"
        else:
            on_large_grids = f"— {on_large_grids}"
        row = [
            bar["what"].replace("wave", "wavelength") + " a side",
            100 * bar["limit"],
            reached,
            100 * bar["mean"],
            bar["surfaces"],
            on_large_grids,
            100 * bar["noise"],
        ]
        rows.append(row)
    header = (
        "case | limit | 90% quantile | mean | surfaces"
        " | 90% quantile on 512 and 1024 points a side | lower bound"
    )
    return table(header, rows, "{} | {:g}% | {} | {:+.1f}% | {} | {} | {:.1f}%")


def refinement() -> str:
    """Errors of areas on coarse grids, raw and corrected, against the finest grid.

    By grid points a shortest wavelength, and by contact.
    """
    data = dataset("elastic")
    refined = data.isel(surface=data.split.values == SPLITS.index(REFINEMENT))
    is_finest = refined.points.values == refined.points.values.max()
    spacings = refined.points / (refined.zeta_1 * refined.waves)
    rows = []
    for spacing in np.unique(spacings.values[~is_finest]):
        coarse = refined.isel(surface=~is_finest & (spacings.values == spacing))
        # the same surfaces on the finest grid
        exact_areas = []
        for seed in coarse.seed.values:
            is_same = is_finest & (refined.seed.values == seed)
            exact_areas.append(refined.area.values[is_same][0])
        exact = np.array(exact_areas)
        by_area = []
        for area in (coarse.area_raw.values, coarse.area.values):
            # a grid may have no contact at a load
            error = np.where(area > 0, np.log(np.maximum(area, 1e-300) / exact), np.nan)
            by_area.append(binned(exact.ravel(), 100 * error.ravel(), GRIDS))
        cells: list[Cell] = [spacing]
        for raw, corrected in zip(*by_area, strict=True):
            has_both = raw.size and corrected.size
            cells.append((raw.mean(), corrected.mean()) if has_both else "—")
        rows.append(cells)
    header = f"grid points per shortest wavelength | {spans(GRIDS)}"
    return table(header, rows, "{:g} | {:+.1f}, {:+.1f}")


def leakage() -> Measured:
    seen = cases(dataset("leakage"))
    parts = {
        "gas": gas_flow.accuracy(pd.read_csv(gas_flow.FILE)),
        "accuracy": leakage_accuracy(),
        "cells": of_cells(seen),
        "floor": floor(),
        "unloaded": unloaded_flow.accuracy(
            unloaded_flow.errors(pd.read_csv(unloaded_flow.FILE))
        ),
    }
    pictures: dict[str, Picture] = {
        "docs/figures/leakage.svg": draw_leakage(seen),
        "docs/figures/helium.svg": draw_gas_leak(),
    }
    return parts, pictures


def leakage_accuracy() -> str:
    """Every law on held-out surfaces, and the law on every set."""
    values, facts = shipped_part(GROUP)
    sets = facts["sets"].split("; ")
    laws = facts["laws"].split("; ")
    shown = [(law, "held out") for law in laws]
    for name in sets:
        if name.startswith("held"):
            continue
        shown.append(("calibrated", name))
        if "zeta_1" in name:
            shown.append(("closed form", name))

    rows = []
    for law, name in shown:
        statistics = values["accuracy"][sets.index(name), laws.index(law)]
        cells: list[Cell] = [f"{law}, {name}".replace("waves", "wavelengths a side")]
        for low, high in itertools.pairwise(BINS):
            cells.append(_merged(statistics, low, high))
        rows.append(cells)
    return table(
        f"law, set | {spans(BINS, HEADER)}", rows, "{} | {:+.2f}, {:.2f} ({:.0f})"
    )


def _merged(statistics: FloatArray, low: float, high: float) -> Cell:
    """Bias, rms and number of errors in a bin that holds several of the file's; None if empty."""
    inside = [low <= a and b <= high + 1e-9 for a, b in itertools.pairwise(EDGES)]
    bias, rms, number = np.nan_to_num(statistics[inside]).T
    total = number.sum()
    if not total:
        return None
    return bias @ number / total, np.sqrt(rms**2 @ number / total), total


def floor() -> str:
    """Cell-to-cell scatter, stated scatter and share of directions that are blocked, by contact."""
    values, facts = shipped_part(GROUP)
    by_bin = {"cells of one spectrum differ by": values["noise"]}
    names = [f"stated scatter, `{name}`" for name in facts["theories"].split()]
    by_bin |= dict(zip(names, values["stated_scatter"], strict=True))
    by_bin["share of directions blocked"] = values["share_blocked"]
    rows: list[list[Cell]] = []
    for name, numbers_of_bins in by_bin.items():
        empty_if_nan = (None if np.isnan(v) else v for v in numbers_of_bins)
        rows.append([name, *empty_if_nan])
    cells = table(f"A [%] | {spans(EDGES, '{:.3g}-{:.3g}')}", rows, "{} | {:.2f}")

    one, two = facts["coverage"]
    near = facts["largest_error_simulated"]
    far = facts["largest_error_log_factor"]
    flow = shipped_flow().constants
    return (
        f"{cells}\n\n"
        "Held-out errors up to 30% contact within one and two of the stated scatter: "
        f"{one:.0%} and {two:.0%}. "
        f"Constants: Ac = {flow.threshold:g}, m = {flow.obstruction:g}; "
        f"closed form {flow.prefactor:g} u^3 (1 - A/Ac)^{flow.exponent:g}. "
        f"On {CERTIFICATE} held-out surfaces the table differs from the medium in ln R "
        f"by at most {near:.2g} up to zeta_1 = 64, and {far:.2g} beyond."
    )


def of_cells(seen: Sequence[Case]) -> str:
    """Held-out errors, and the spread of cells of one spectrum.

    With many and with few longest wavelengths a side.
    """
    constants = shipped_flow().constants
    rows: list[list[str]] = []
    for name, many in (("eight", True), ("four or five", False)):
        alike = [one for one in seen if one.plain and (one.waves >= 8) == many]
        flows = [Flow(one, shipped().constants) for one in alike if one.split != TRAINING]
        for law in ("calibrated", "medium, simulated area and gap"):
            misses = [errors(flow, LAWS[law](flow, constants)) for flow in flows]
            cells = [f"{rms:.2f} ({n:.0f})" for _, rms, n in summary(misses, BINS)]
            rows.append([f"{law}, {name} wavelengths a side", *cells])
        spread = [f"{value:.2f}" for value in noise_floor(alike, BINS)]
        rows.append([f"cells of one spectrum, {name} wavelengths a side", *spread])
    return table(f"rms of ln k | {spans(BINS, HEADER)}", rows)


def draw_leakage(seen: Sequence[Case]) -> Figure:
    figure, panels_of_hurst = panels(1, 2, (10, 4.5), sharey=True)
    area = np.linspace(0.004, 0.405, 200)
    flow = shipped_flow().constants
    for axes, hurst in zip(panels_of_hurst, (0.4, 0.8), strict=True):
        _draw_simulated_flow(axes, seen, hurst)
        _draw_laws_of_flow(axes, area, hurst, flow)
        axes.set(
            xlabel="real contact area  A/A0",
            yscale="log",
            ylim=(1e-7, 20),
            title=f"H = {hurst:g}",
        )
        axes.grid(alpha=0.3)
    panels_of_hurst[0].set_ylabel("flow coefficient over h_rms^3,  k")
    panels_of_hurst[0].legend(fontsize="small")
    return figure


def draw_gas_leak() -> Figure:
    """Leak of two gases against the pressure of the seal of docs/leakage.md."""
    found = contact(SEAL, "20 MPa", pressure=SEAL_PRESSURES, theory="calibrated")
    leak = found.leakage
    figure, axes = panels(size=(6.0, 4.0))
    for number, gas in enumerate(("helium", "air")):
        # where it is blocked there is no rate, and no logarithm of it
        ring = {"gas": gas, **RING, "unit": LEAK_UNIT}
        rate = np.where(leak.blocked, np.nan, leak.gas(**ring))
        factor = np.exp(leak.scatter_of_rate(ring))
        colour = f"C{number}"
        axes.plot(SEAL_PRESSURES, rate, ":", color=colour)
        of_valid = np.where(leak.valid, rate, np.nan)
        axes.plot(SEAL_PRESSURES, of_valid, color=colour, label=gas)
        axes.fill_between(
            SEAL_PRESSURES, of_valid / factor, of_valid * factor, color=colour, alpha=0.2
        )
    law = contact_law(SEAL, "20 MPa", theory="calibrated")
    wanted = sealing_pressure(law, f"{WANTED_LEAK:g} {LEAK_UNIT}", gas="helium", **RING)
    spread = [[wanted.pressure - wanted.low], [wanted.high - wanted.pressure]]
    axes.errorbar(
        [wanted.pressure], [WANTED_LEAK], xerr=spread, fmt="ko", capsize=3,
        label=f"sealing_pressure, {WANTED_LEAK:g} {LEAK_UNIT}",
    )  # fmt: skip
    axes.set(xscale="log", yscale="log", ylim=(1e-6, 3))
    axes.set(xlabel="pressure F/A0 [MPa]", ylabel=f"leak rate [{LEAK_UNIT}]")
    number_ticks(axes)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", loc="lower left")
    return figure


def _draw_simulated_flow(axes: Axes, seen: Sequence[Case], hurst: float) -> None:
    """Dots of simulations, those of many scales in another colour."""
    alike = []
    for one in seen:
        is_of_hurst = one.node[:2] == ("self_affine", hurst)
        if is_of_hurst and (one.plain or one.zeta_1 >= 64):
            alike.append(one)
    for colour, sign, is_large in (("k", "<", False), ("r", ">=", True)):
        of_colour = [one for one in alike if (one.zeta_1 >= 64) == is_large]
        points = [np.stack([one.area, np.exp(one.log_k)]) for one in of_colour]
        # an empty part, for where no surface is so
        area, k = np.concatenate([*points, np.empty((2, 0))], axis=1)
        label = f"simulated, zeta_1 {sign} 64"
        axes.plot(area, k, f"{colour}.", ms=4, alpha=0.6, label=label)


def _draw_laws_of_flow(
    axes: Axes, area: FloatArray, hurst: float, flow: FlowConstants
) -> None:
    """Lines of the calibrated law at three zeta_1, and at the last of them of other laws."""
    for zeta, style in ((64.0, "--"), (1024.0, ":"), (16.0, "-")):
        surface = Surface(hurst, 1.0, zeta, 1.0, 4.0)
        answer = contact(surface, area=area, theory="calibrated")
        k = np.where(answer.leakage.blocked, np.nan, answer.leakage.K)
        axes.plot(area, k, f"C0{style}", label=f"calibrated, zeta_1 {zeta:g}")
    spread = np.exp(answer.leakage.scatter)
    axes.fill_between(
        area, k / spread, k * spread, color="C0", alpha=0.2, lw=0, label="its scatter"
    )
    u = answer.mean_separation
    closed = flow.closed_form(u, area)
    positive = np.where(closed > 0, closed, np.nan)
    axes.plot(area, positive, "C1-", lw=1, label="closed form, zeta_1 16")
    axes.plot(area, u**3, "C2-", lw=1, label="u^3, zeta_1 16")


def yielding() -> Measured:
    seen = capped(dataset("hardness"))
    _, facts = shipped_part("hardness")
    ratios = simulated(seen)
    parts = {
        "when": _when_yielding_matters(ratios),
        "held_out": held_out(),
        "frozen": frozen(seen),
        "coverage": _coverage_of_yielding(json.loads(facts["coverage"])),
        "drift": _drift_with_zeta(json.loads(facts["drift"])),
        "metals": metals(),
    }
    return parts, {"docs/figures/yield.svg": draw_yield(ratios)}


def _when_yielding_matters(ratios: FloatArray) -> str:
    """Ratios of `simulated`, mean and standard deviation at each psi."""
    psi_of_row = ratios[0]
    rows: list[list[Cell]] = []
    for psi in np.unique(psi_of_row):
        at_psi = ratios[1:, psi_of_row == psi]
        rows.append([psi, *((values.mean(), values.std()) for values in at_psi)])
    header = f"psi | {RATIOS[0]}, equal force | {RATIOS[1]}, equal u | yielded share"
    return table(header, rows, "{:.3g} | {:.2f} ± {:.2f}")


def _coverage_of_yielding(coverage: Mapping[str, Sequence[float]]) -> str:
    """Shares of errors within one and two stated scatters; keys begin with the theory's name."""
    rows: dict[str, list[Cell]] = {}
    for name, shares in coverage.items():
        theory = name.split()[0]
        rows.setdefault(theory, [f"`{theory}`"]).append(tuple(shares))
    header = "theory | area at equal force | force at equal u | frozen stiffness"
    return table(header, rows.values(), "{} | {:.0%} / {:.0%}")


def _drift_with_zeta(drift: Mapping[str, Iterable[float]]) -> str:
    """Mean errors by the ratio of wavenumbers."""
    rows: list[list[Cell]] = []
    for zeta_1, mean_errors in drift.items():
        rows.append([zeta_1, *(100 * error for error in mean_errors)])
    header = "zeta_1 | area [%] | yielded share [%] | force [%] | frozen stiffness [%]"
    return table(header, rows, "{} | {:+.1f}")


def simulated(seen: list[Capped]) -> FloatArray:
    """By simulation psi and means from 1% to 10% contact of three ratios.

    A_el/A at equal force, F_el/F at equal u, and the yielded share.
    """
    rows = []
    for one in seen:
        bare = one.bare
        is_light = (one.area > 0.01) & (one.area < 0.1)
        # where the elastic contact was pressed as lightly
        usable = is_light & (one.u < bare["u"][0]) & (one.force > bare["force"][0])
        if one.kind == "stretched" or not usable.any():
            continue
        log_force = np.log(bare["force"])
        elastic_area = np.exp(
            np.interp(np.log(one.force), log_force, np.log(bare["area"]))
        )
        elastic_force = np.exp(np.interp(-one.u, -bare["u"], log_force))
        ratios = (
            elastic_area / one.area,
            elastic_force / one.force,
            one.yielded / one.area,
        )
        means = [float(ratio[usable].mean()) for ratio in ratios]
        rows.append((1 / one.eta, *means))
    return np.array(rows).T


def held_out() -> str:
    variables, facts = shipped_part("hardness")
    sets = facts["sets"].split()
    rows: list[list[Cell]] = []
    # the law with h_max alone, and with the map's heights
    forms = tuple(enumerate(("`h_max`", "the map's heights")))
    for name, words in HELD_OUT.items():
        for form, knowledge in forms:
            statistics = variables["accuracy"][sets.index(name), form]
            percentages = (tuple(100 * row[:4]) for row in statistics)
            rows.append([words, knowledge, *percentages])

    other: list[Cell] = ["another code's (`docs/data/hardness.csv`)", "`h_max`"]
    for name in facts["quantities"].split():
        error = blind()[name]
        size = np.abs(error)
        share_within = np.mean(size < BARS[name])
        row = (error.mean(), error.std(), share_within, size.max())
        other.append(tuple(100 * np.array(row)))
    rows.append(other)
    header = (
        "surfaces | law with | area at equal force [%] | yielded share [%]"
        " | force at equal u [%] | frozen stiffness at equal force [%]"
    )
    return table(header, rows, "{} | {} | {:+.1f} ± {:.1f}; {:.1f}; {:.0f}")


def frozen(seen: list[Capped]) -> str:
    """Frozen stiffness at equal force of theories against every self-affine simulation.

    By hardness and contact.
    """
    rows: list[list[Cell]] = []
    for theory, eta in itertools.product(("mbma", "calibrated"), HARDNESSES):
        at_eta = [one for one in seen if one.kind == "self_affine" and one.eta == eta]
        parts = [_frozen_errors(one, theory) for one in at_eta]
        area, error, stated = np.concatenate(parts, axis=1)
        sizes = (np.abs(error) / stated)[np.isfinite(stated)]
        share_within = f"{np.mean(sizes < 1):.0%} / {np.mean(sizes < 2):.0%}"
        bins = binned(area, 100 * error, YIELD_BINS)
        cells = [(in_bin.mean(), in_bin.std()) for in_bin in bins]
        rows.append([f"`{theory}`", f"{eta:g}", *cells, share_within])
    header = (
        f"theory | eta | {spans(YIELD_BINS)}"
        " | within one / two of `unloading_stiffness_scatter`"
    )
    return table(header, rows, "{} | {} | {:+.0f} ± {:.0f}")


def _frozen_errors(one: Capped, theory: str) -> FloatArray:
    """Area, deviation of a theory's frozen stiffness and its stated scatter, (3, loads)."""
    g = float(one.surface.rms_gradient)
    hardness = one.eta * g
    in_range = one.area > YIELD_BINS[0]
    try:
        pressure = one.force[in_range] * g
        by = contact(
            one.surface, Bodies(hardness=hardness), pressure=pressure, theory=theory
        )
    except OutOfRangeError as fault:  # MBMA ends before
        in_range[in_range] = ~np.asarray(fault.mask)
        pressure = one.force[in_range] * g
        by = contact(
            one.surface, Bodies(hardness=hardness), pressure=pressure, theory=theory
        )
    error = np.log(by.unloading_stiffness / (one.frozen[in_range] * g))
    return np.stack([one.area[in_range], error, by.unloading_stiffness_scatter])


def metals() -> str:
    """psi of metals pressed on themselves at `GRADIENT`, and the gradient where it ends.

    Up to that gradient they stay elastic.
    """
    rows = []
    for metal in map(materials.get, materials.METALS):
        modulus = float(materials.effective_modulus(metal.E, metal.nu, metal.E, metal.nu))
        psi = [modulus * GRADIENT / hardness for hardness in metal.hardness]
        elastic_gradient = [materials.ELASTIC_PSI * GRADIENT / p for p in psi]
        row = [
            f"`{metal.name}`",
            f"{metal.E:g}",
            _range(metal.hardness, "g"),
            _range(metal.conductivity, "g"),
            # a hard metal has the lower psi
            _range(psi[::-1], ".1f"),
            _range(elastic_gradient, ".3f"),
        ]
        rows.append(row)
    header = (
        "metal | E [GPa] | hardness [GPa] | conductivity [W/(m K)]"
        f" | psi at gradient {GRADIENT:g} | elastic up to gradient"
    )
    return table(header, rows)


def _range(ends: Iterable[float], form: str) -> str:
    """Both ends of a range, or one number where they print alike."""
    distinct = dict.fromkeys(format(number, form) for number in ends)
    return " to ".join(distinct)


def draw_yield(ratios: FloatArray) -> Figure:
    """Area and force of elastic answers over the simulated ones against psi."""
    hardness = float(SURFACE.rms_gradient) / INDICES
    capped_contact = contact(
        SURFACE, Bodies(hardness=hardness), area=0.03, theory="calibrated"
    )
    at_equal_force = contact(
        SURFACE, pressure=capped_contact.pressure, theory="calibrated"
    )
    at_equal_gap = contact(
        SURFACE, mean_separation=capped_contact.mean_separation, theory="calibrated"
    )
    by_law = (
        at_equal_force.area / capped_contact.area,
        at_equal_gap.pressure / capped_contact.pressure,
    )
    figure, axes = panels(2, 1, (7, 6), sharex=True)
    labels = (f"{RATIOS[0]},\nequal force", f"{RATIOS[1]},\nequal mean gap")
    of_simulations: dict[str, Any] = {
        "color": "grey",
        "alpha": 0.6,
        "label": "boundary elements, 1% to 10% contact",
    }
    for axis, dots, line, label in zip(axes, ratios[1:3], by_law, labels, strict=True):
        axis.axhspan(0.95, 1.05, color="tab:green", alpha=0.2, label="within 5%")
        axis.semilogx(ratios[0], dots, ".", **of_simulations)
        axis.semilogx(INDICES, line, label="law at 3% contact")
        axis.axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
        axis.set_ylabel(label)
        axis.grid(True, alpha=0.3)
    axes[1].set(yscale="log", xlabel="psi = E* g/p_m")
    axes[0].legend(fontsize=8, loc="lower left")
    return figure
