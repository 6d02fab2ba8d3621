"""docs/yield.md: when a contact is elastic, how accurate the law is, metals."""

from __future__ import annotations

import itertools
import json
import time
from typing import Any

import numpy as np

from generate.boundary_elements.evidence import Capped, capped
from generate.calibrated_hardness import BARS, blind
from generate.pages.page import DATA, Measured, dataset, panels, spans, svg, table
from mbma_tables import Surface, contact, materials
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.theories.calibrated_table import shipped_part
from mbma_tables.totals.conductance import conductance

EVIDENCE = DATA / "hardness.nc"
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
    "three_waves": "of both, three longest wavelengths a side or more",
    "stretched": "stretched",
}
RATIOS = ("elastic area over true", "elastic force over true")


def simulated() -> FloatArray:
    """psi of every simulation, and means over contacts of A_el/A at equal force, F_el/F at equal gap, yielded share."""
    data, rows = dataset(EVIDENCE), []
    stretched = data.kind.attrs["flag_meanings"].split().index("stretched")
    names = ("force", "area", "mean_separation", "area_yielded")
    for k in np.flatnonzero(data.kind.values != stretched):
        force, area, u, yielded = (data[name].values[k].astype(float) for name in names)
        for row, eta in enumerate(data.eta.values[:-1]):
            kept = (area[row] > CONTACT[0]) & (area[row] < CONTACT[1])
            # where the elastic contact was pressed as lightly
            kept &= (u[row] < u[-1, 0]) & (force[row] > force[-1, 0])
            if kept.any():
                elastic = np.exp(np.interp(np.log(force[row]), np.log(force[-1]), np.log(area[-1])))
                load = np.exp(np.interp(-u[row], -u[-1], np.log(force[-1])))
                ratios = (elastic / area[row], load / force[row], yielded[row] / area[row])
                rows.append((1 / eta, *(float(ratio[kept].mean()) for ratio in ratios)))
    return np.array(rows).T


def by_law() -> tuple[FloatArray, FloatArray]:
    """The same ratios of area and force by the law, on a surface of 32 magnifications, at 3% contact."""
    hardness = float(SURFACE.rms_gradient) / INDICES
    found = contact(SURFACE, area=0.03, theory="calibrated", hardness=hardness)
    elastic = contact(SURFACE, pressure=found.pressure, theory="calibrated")
    closer = contact(SURFACE, mean_separation=found.mean_separation, theory="calibrated")
    return np.asarray(elastic.area / found.area), np.asarray(closer.pressure / found.pressure)


def when() -> str:
    """Simulated ratios by psi."""
    psi, *found = simulated()
    rows = []
    for index in np.unique(psi):
        own = [values[psi == index] for values in found]
        rows.append([f"{index:.3g}", *(f"{values.mean():.2f} ± {values.std():.2f}" for values in own)])
    return table(["psi", f"{RATIOS[0]}, equal force", f"{RATIOS[1]}, equal u", "yielded share"], rows)


def held_out() -> str:
    """Errors of the law on held-out surfaces."""

    def cell(bias: float, spread: float, share: float, largest: float) -> str:
        return f"{100 * bias:+.1f} ± {100 * spread:.1f}; {100 * share:.1f}; {100 * largest:.0f}"

    variables, attributes = shipped_part("hardness")
    sets, rows = attributes["sets"].split(), []
    for (name, words), (form, known) in itertools.product(SETS.items(), enumerate(("`h_max`", "the map's heights"))):
        found = variables["accuracy"][sets.index(name), form]
        rows.append([words, known, *(cell(*row[:4]) for row in found)])
    errors, cells = blind(), []
    for quantity in attributes["quantities"].split():
        e = errors[quantity]
        size = np.abs(e)
        cells.append(cell(e.mean(), e.std(), float(np.mean(size < BARS[quantity])), size.max()))
    rows.append(["another code's (`docs/data/hardness.csv`)", "`h_max`", *cells])
    names = ["area at equal force", "yielded share", "force at equal u", "frozen stiffness at equal force"]
    return table(["surfaces", "law with", *(f"{name} [%]" for name in names)], rows)


def frozen() -> str:
    """Frozen stiffness at equal force of theories against every self-affine simulation, by hardness and contact."""

    def deviations(theory: str, one: Capped) -> Any:
        """Area, deviation and stated scatter at each load."""
        surface = Surface(one.node[1], 1.0, one.zeta_1, 1.0, one.h_max)
        g = float(surface.rms_gradient)
        for k in np.flatnonzero(one.area > BINS[0]):
            try:
                by = contact(surface, pressure=one.force[k] * g, theory=theory, hardness=one.eta * g)
            except OutOfRangeError:  # MBMA ends before
                break
            yield one.area[k], np.log(by.incremental_stiffness / (one.frozen[k] * g)), by.stiffness_scatter

    seen, rows = [one for one in capped(dataset(EVIDENCE)) if one.kind == "self_affine"], []
    for theory, eta in itertools.product(("mbma", "calibrated"), HARDNESSES):
        area, error, stated = np.array([row for one in seen if one.eta == eta for row in deviations(theory, one)]).T
        bins = [error[(area > low) & (area < high)] for low, high in itertools.pairwise(BINS)]
        cells = [f"{100 * own.mean():+.0f} ± {100 * own.std():.0f}" for own in bins]
        sizes = (np.abs(error) / stated)[np.isfinite(stated)]
        within = [f"{np.mean(sizes < n):.0%}" for n in (1, 2)]
        rows.append([f"`{theory}`", f"{eta:g}", *cells, " / ".join(within)])
    header = [f"{ends}%" for ends in spans(BINS)]
    return table(["theory", "eta", *header, "within one / two of `stiffness_scatter`"], rows)


def stored(name: str) -> Any:
    """A summary that the fit stored with the law."""
    return json.loads(shipped_part("hardness")[1][name])


def coverage() -> str:
    """Shares of held-out errors within one and two stated standard deviations."""
    rows: dict[str, list[str]] = {}
    for name, shares in stored("coverage").items():
        theory = name.split()[0]
        rows.setdefault(theory, [f"`{theory}`"]).append(" / ".join(f"{share:.0%}" for share in shares))
    return table(["theory", "area at equal force", "force at equal u", "frozen stiffness"], list(rows.values()))


def drift() -> str:
    """Mean errors of the parts by zeta_1."""
    rows = [[zeta_1, *(f"{100 * e:+.1f}" for e in row)] for zeta_1, row in stored("drift").items()]
    return table(["zeta_1", *(f"{name} [%]" for name in ("area", "yielded share", "force", "frozen stiffness"))], rows)


def own_modulus(metal: Any) -> float:
    """E* of a metal pressed on itself."""
    return float(materials.effective_modulus(metal.E, metal.nu, metal.E, metal.nu))


def metals() -> str:
    """psi of metals pressed on themselves, and the gradient up to which they stay elastic."""
    rows = []
    for name in materials.METALS:
        metal = materials.get(name)
        modulus = own_modulus(metal)
        psi = [modulus * GRADIENT / hardness for hardness in metal.hardness]
        limit = [materials.ELASTIC_PSI * hardness / modulus for hardness in metal.hardness]
        ends = (metal.hardness, "g"), (metal.conductivity, "g"), (psi[::-1], ".1f"), (limit, ".3f")
        cells = (" to ".join(dict.fromkeys(format(number, form) for number in pair)) for pair, form in ends)
        rows.append([f"`{name}`", f"{metal.E:g}", *cells])
    header = ["metal", "E [GPa]", "hardness [GPa]", "conductivity [W/(m K)]", f"psi at gradient {GRADIENT:g}"]
    return table([*header, "elastic up to gradient"], rows)


def cost() -> str:
    """Times of pressure to gap, area and conductance, with a hardness over without."""
    rng, g, rows = np.random.default_rng(5), float(SURFACE.rms_gradient), []
    for count in COUNTS:
        pressure = g * 0.3 * 10 ** rng.uniform(-3, -0.1, count)
        spent: dict[float, list[float]] = {np.inf: [], 0.3 * g: []}
        for _, (hardness, times) in itertools.product(range(REPEATS), spent.items()):
            start = time.thread_time()
            found = contact(SURFACE, pressure=pressure, theory="calibrated", hardness=hardness)
            _ = found.area, conductance(found.incremental_stiffness, 1.0, 1.0)
            times.append(time.thread_time() - start)
        elastic, plastic = (min(times) for times in spent.values())
        rows.append([f"{count}", f"{plastic / elastic:.1f}"])
    return table(["pressures in a call", "time with a hardness over elastic"], rows)


def draw() -> bytes:
    """Area and force of elastic answers over the simulated ones against psi, with metals below."""
    psi, *points, _ = simulated()
    figure, axes = panels(3, 1, (7, 8), sharex=True, height_ratios=(3, 3, 2))
    labels = (f"{RATIOS[0]},\nequal force", f"{RATIOS[1]},\nequal mean gap")
    for axis, dots, line, label in zip(axes, points, by_law(), labels, strict=False):
        axis.axhspan(0.95, 1.05, color="tab:green", alpha=0.2, label="within 5%")
        axis.semilogx(psi, dots, ".", color="grey", alpha=0.6, label="boundary elements, 1% to 10% contact")
        axis.semilogx(INDICES, line, label="law at 3% contact")
        axis.axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
        axis.set_ylabel(label)
        axis.grid(True, alpha=0.3)
    axes[1].set_yscale("log")
    axes[0].legend(fontsize=8, loc="lower left")
    for place, metal in enumerate(map(materials.get, SHOWN)):
        ends = [own_modulus(metal) * GRADIENT / hardness for hardness in metal.hardness]
        axes[2].plot(ends, [place, place], linewidth=6)
    axes[2].axvline(materials.ELASTIC_PSI, color="black", linestyle=":")
    axes[2].set_yticks(range(len(SHOWN)), [f"{name} on itself" for name in SHOWN], fontsize=8)
    axes[2].set_xlabel(f"psi = E* g/p_m; metals at rms gradient {GRADIENT:g}, hard to soft")
    return svg(figure)


def measure() -> Measured:
    """The measured blocks of the page, and its figure."""
    parts = (when, held_out, frozen, coverage, drift, metals, cost)
    return {part.__name__: part() for part in parts}, {"docs/figures/yield.svg": draw()}
