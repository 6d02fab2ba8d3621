"""docs/calibrated.md: accuracy and constants that `python -m generate calibrated` stored, and a figure."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from generate.boundary_elements.design import REFINEMENT, SPLITS
from generate.calibrated_file import binned
from generate.pages.page import DATA, Measured, dataset, panels, spans, table
from mbma_tables import Surface
from mbma_tables.common.files import shipped_file
from mbma_tables.laws.calibrated import CONSTANTS
from mbma_tables.theories import THEORIES, get_theory

SHOWN = {  # sets and forms of the accuracy table
    "held_out_surface, 2-3 waves, spectrum": "new surfaces, 2-3 wavelengths a side, spectrum",
    "held_out_spectrum, 2-3 waves, spectrum": "new spectra, 2-3 wavelengths, spectrum",
    "held_out_surface, 4 waves, spectrum": "new surfaces, 4-8 wavelengths, spectrum",
    "held_out_spectrum, 4 waves, spectrum": "new spectra, 4-8 wavelengths, spectrum",
    "held_out_surface, 1 wave, spectrum": "new surfaces, 1 wavelength, spectrum",
    "held_out_surface, 4 waves, map": "new surfaces, 4-8 wavelengths, map",
    "held_out_spectrum, 4 waves, map": "new spectra, 4-8 wavelengths, map",
    "held_out_spectrum, 2-3 waves, map": "new spectra, 2-3 wavelengths, map",
    "held_out_spectrum, stretched, map": "new spectra, stretched 1:3 to 1:12, map",
    "held_out_spectrum, transformed, map": "new spectra, transformed heights, map",
    "self-affine, mbma": "self-affine: MBMA `reported`",
    "self-affine, mbma_printed": "self-affine: MBMA `printed`",
    "self-affine, mbma_fitted": "self-affine: MBMA `fitted`",
    "self-affine, persson": "self-affine: Persson",
    "self-affine, greenwood_williamson": "self-affine: Greenwood-Williamson",
}
QUANTITIES = ("force", "area", "stiffness")
COLOURS = {"calibrated": "k", "calibrated_map": "0.5", "mbma": "C0", "mbma_printed": "C9", "mbma_fitted": "C1"}
COLOURS |= {"persson": "C3", "persson_simplified": "C6", "greenwood_williamson": "C2"}


def accuracy(data: Any, number: int) -> str:
    """Bias and standard deviation of a quantity in percent, by contact fraction."""
    edges = (*data.contact_low.values, data.contact_high.values[-1])
    sets, rows = data.attrs["sets"].split("; "), []
    for name in (name for name in SHOWN if name in sets):
        cells = data.accuracy.values[sets.index(name), number]
        rows.append([SHOWN[name], *((100 * bias, 100 * spread) for bias, spread, *_ in cells)])
    return table(f"surfaces, and what is known of them | {spans(edges)}", rows, "{} | {:+.0f} ± {:.0f}")


def numbers(data: Any) -> str:
    """Constants, the table's certificate, and the coverage of the stated scatter."""
    facts = data.attrs
    rows = [(f"`{name}`", f"{facts[f'law_{name}']:.4g}") for name in vars(CONSTANTS)]
    maps = {name.removeprefix("map_"): value for name, value in facts.items() if name.startswith("map_")}
    rows += [(f"`{name}` (map)", f"{value:.4g}") for name, value in maps.items()]
    evidence = json.loads(facts["evidence"])
    rows += [("surfaces simulated, of which in the training set", f"{evidence['surfaces']}, {evidence['training']}")]
    for what in QUANTITIES:
        largest, most = facts[f"largest_error_{what}"], facts[f"p99_error_{what}"]
        rows.append((f"largest (99%) error of {what} by the table", f"{largest:.1e} ({most:.1e})"))
    for what, (one, two) in json.loads(facts["coverage"]).items():
        rows.append((f"held-out errors of {what} within one and two of the stated", f"{one:.0%}, {two:.0%}"))
    return table("quantity | value", rows)


def bars(data: Any) -> str:
    """Limits to nine errors in ten, what is reached, and the floor by surfaces of one spectrum."""
    rows = []
    for bar in json.loads(data.attrs["bars"]):
        over = bar["found"] - bar["limit"]
        judged = "met" if over <= 0 else f"missed by {100 * over:.1f}" if over > 0 else "no load there"
        found = (100 * bar["found"], judged) if np.isfinite(bar["found"]) else f"—: {judged}"
        large = (
            (100 * bar["large"], bar["surfaces_large"]) if np.isfinite(bar["large"]) else f"— ({bar['surfaces_large']})"
        )
        what = bar["what"].replace("wave", "wavelength") + " a side"
        rows.append([what, 100 * bar["limit"], found, 100 * bar["mean"], bar["surfaces"], large, 100 * bar["noise"]])
    header = "case | limit | 90% quantile | mean | surfaces | 90% quantile on 512 and 1024 points a side | lower bound"
    return table(header, rows, "{} | {:g}% | {:.1f}%: {} | {:+.1f}% | {} | {:.1f}% ({}) | {:.1f}%")


def refinement(data: Any) -> str:
    """Errors of raw and corrected areas on coarse grids against the finest, by points a shortest wave and contact."""
    ends = (0.002, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9)
    one = data.isel(surface=data.split.values == SPLITS.index(REFINEMENT))
    finest = one.points.values == one.points.values.max()
    found: dict[float, list[Any]] = {}
    for number in np.flatnonzero(~finest):
        exact = one.area.values[np.flatnonzero(finest & (one.seed.values == one.seed.values[number]))[0]]
        spacing = float(one.points.values[number] / (one.zeta_1.values[number] * one.waves.values[number]))
        pair = np.stack([one.area_raw.values[number], one.area.values[number]])
        # a grid without any contact at a load says nothing of it
        known = np.where(pair > 0, np.log(np.maximum(pair, 1e-300) / exact), np.nan)
        found.setdefault(spacing, []).append(np.concatenate([exact[None], known]))
    rows = []
    for spacing, parts in sorted(found.items()):
        exact, *errors = np.concatenate(parts, axis=1)
        pairs = zip(*(binned(exact, 100 * e, ends) for e in errors), strict=True)
        rows.append([spacing, *((a.mean(), b.mean()) if a.size and b.size else "—" for a, b in pairs)])
    return table(f"grid points per shortest wavelength | {spans(ends)}", rows, "{:g} | {:+.1f}, {:+.1f}")


def draw(data: Any) -> Any:
    """One surface's curves with the stated scatter as a band, and every theory's scatter of force."""
    figure, (left, right) = panels(1, 2, (10, 3.6))
    force, _, _, u = np.loadtxt(DATA / "bem_hurst0.8_zeta64.csv", delimiter=",", skiprows=4).T[:4]
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3973)
    gap = np.linspace(0.01, 3.38, 200)
    g = float(surface.rms_gradient)
    for name in THEORIES:
        found = get_theory(name).answer(surface, gap)
        left.semilogy(gap, found.pressure / g, color=COLOURS[name], label=name)
        if name == "calibrated":
            spread = np.exp(get_theory(name).scatter(surface, "pressure", found.area))
            left.fill_between(
                gap, found.pressure / g / spread, found.pressure / g * spread, color="0.8", label="its scatter"
            )
    left.semilogy(u, force, "ko", mfc="none", label="boundary elements")
    left.set(xlabel="u/h_rms", ylabel="F/(A0 E* g)", ylim=(1e-5, 3), title="H 0.8, zeta_1 64, h_max 3.4 h_rms")
    left.legend(fontsize="small")
    number = data.attrs["quantities"].split().index("force")
    for k, name in enumerate(data.attrs["theories"].split()):
        right.loglog(data.contact, data.stated_scatter.values[k, number], "o-", color=COLOURS[name], label=name)
    right.set(xlabel="A/A0", ylabel="rms of ln(F/simulated) at equal u", title="Stated scatter of force")
    figure.legend(*right.get_legend_handles_labels(), fontsize="small", loc="outside right center")
    return figure


def measure() -> Measured:
    """The measured blocks of the page, and its figure."""
    data = dataset(shipped_file("calibrated.nc"))
    quantities = data.attrs["quantities"].split()
    parts = {name: accuracy(data, quantities.index(name)) for name in QUANTITIES}
    parts |= {"numbers": numbers(data), "bars": bars(data)}
    parts |= {"refinement": refinement(dataset(DATA / "boundary_elements.nc"))}
    return parts, {"docs/figures/calibrated.svg": draw(data)}
