"""docs/fidelity.md: what the paper quotes, and simulations, beside what the library computes."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from generate.calibrated_file import QUANTITIES, by_bin
from generate.pages import distances
from generate.pages.page import Measured, panels, percent, table
from mbma_tables import Surface, contact, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.wrapped import answer_where_finite

THEORIES: dict[str, theories.Theory] = {
    "MBMA reported": theories.Mbma(),
    "MBMA printed": theories.Mbma(variant="printed"),
    "G-W": theories.GreenwoodWilliamson(),
    "Persson full": theories.Persson("full"),
    "Persson simplified": theories.Persson("simplified"),
}
VARIANTS, PERSSON = ("MBMA reported", "MBMA printed"), ("Persson full", "Persson simplified")
COLOURS = {name: f"C{k}" for k, name in enumerate(THEORIES)}
# u/h_max, closer at first and at full contact; G-W's heights have no end
DEPTHS = np.concatenate(
    [
        *(np.linspace(1.5, 1.005, 30), 1 - np.geomspace(0.002, 0.1, 30)[:-1]),
        *(np.linspace(0.9, 0.0015, 60)[:-1], np.geomspace(0.0015, 1e-5, 10)),
    ]
)
BANDED = ("MBMA reported", "calibrated")
BINS = (0.0005, 0.002, 0.005, 0.01, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9, 0.98)
ROADS = ("concrete", "asphalt")
RESOLUTIONS = (125, 250, 500, 1000)
Figures = Iterator[tuple[str, Any]]
STEEL = 200e3  # MPa, the E* at which the paper's 3.5e-4 E* is its 70 MPa
HEIGHTS = (3.0, 3.4, 4.0)  # h_max/h_rms
Values = dict[str, Any]
Quoted = tuple[str, str, float | str, Iterable[str], Values]  # case, what, the paper's, theories it is about, values


@functools.cache
def curve(surface: Surface, theory: str) -> tuple[FloatArray, FloatArray]:
    """Force and area at `DEPTHS`."""
    found = answer_where_finite(THEORIES[theory], surface, DEPTHS * surface.h_max)
    return found.pressure, found.area


def force_at(surface: Surface, theory: str, ratio: Any) -> FloatArray:
    """F/(A0 E*) at mean separations u = ratio * h_rms; NaN where the theory has none, as Persson's at u = 0."""
    return answer_where_finite(THEORIES[theory], surface, np.atleast_1d(ratio) * surface.h_rms).pressure


@functools.cache
def forces(name: str, ratio: float, unit: float = 1.0) -> Values:
    """F/(A0 E*) of every theory at u = ratio * h_rms of a named surface, in a unit."""
    return {t: float(force_at(Surface.named(name), t, ratio)[0]) / unit for t in THEORIES}


def kappa(surface: Surface, area: float) -> Values:
    """A/F sqrt(2 m2) E*, Eq. (51), at A/A0 = `area`, of every theory; (18) is Persson's in full and simplified."""
    asked = THEORIES | dict.fromkeys(PERSSON, THEORIES["Persson full"])
    found = {name: contact(surface, area=area, theory=theory).pressure for name, theory in asked.items()}
    return {name: float(area / force * surface.rms_gradient) for name, force in found.items()}


def quoted_numbers() -> Iterable[Quoted]:
    """Numbers that the paper quotes, beside every theory's."""
    case = "yang-persson"
    for ratio, name, quoted in (
        (2.5, "MBMA", 2.2e-4),
        (2.0, "MBMA", 2.9e-3),
        (3.0, "Persson", 3.5e-4),
        (2.5, "Persson", 1e-3),
    ):
        subject = VARIANTS if name == "MBMA" else PERSSON
        yield case, f"F/(A0 E*), u = {ratio:g} h_rms: {name}", quoted, subject, forces(case, ratio)
    yield case, "F/A0 in MPa, steel, u = 3 h_rms: Persson", 70.0, PERSSON, forces(case, 3.0, 1 / STEEL)
    meets = forces(case, 0.0, forces(case, 0.0)["Persson simplified"])
    yield case, "F over Persson simplified, u = 0: MBMA meets it", 1.0, VARIANTS, meets
    yield case, "the same: G-W", "orders of magnitude", (), meets

    case, bem = "papangelo", distances.older("bem")
    for u, force in zip(bem.u, bem.force, strict=True):
        if 0.01 < u < 0.05:
            what, unit = f"F over boundary elements, u = {u:.4g} h_rms: MBMA", float(Surface.named(case).rms_gradient)
            yield case, what, "within 2x", (), forces(case, u, force * unit)

    for name, top, slope in (("concrete", 4.1, 1.98), ("asphalt", 4.5, 1.75)):
        road = Surface.named(name)
        yield name, "u/h_rms at first contact", top, VARIANTS, dict.fromkeys(VARIANTS, road.h_max / road.h_rms)
        yield name, "kappa, here at A/A0 = 1%: MBMA", slope, VARIANTS, kappa(road, 0.01)
        light, what = kappa(road, 1e-4), "kappa at light load, here at A/A0 = 0.01%"
        yield name, what + ": G-W", math.sqrt(2 * math.pi), ["G-W"], light
        yield name, what + ": Persson", math.sqrt(8 / math.pi), PERSSON, light

    case, what = "challenge", "F over Persson full, u = 0.01 h_rms: MBMA"
    yield case, what, "within 4x", (), forces(case, 0.01, forces(case, 0.01)["Persson full"])
    for ratio, expected in ((2.5, "sensitive: MBMA, G-W"), (0.2, "1, except for G-W")):
        below, above = (forces(f"resolution-{z}", ratio) for z in (RESOLUTIONS[0], RESOLUTIONS[-1]))
        what = f"F at zeta_1 = {RESOLUTIONS[-1]} over {RESOLUTIONS[0]}, u = {ratio:g} h_rms"
        yield "resolution", what, expected, (), {t: above[t] / below[t] for t in THEORIES}


def quoted_table() -> str:
    """What the paper quotes beside what every theory gives, in brackets their ratio."""
    rows = []
    for case, what, quoted, subject, values in quoted_numbers():
        known = [values.get(t, np.nan) for t in THEORIES]
        cells = [f"{v:.3g}" if np.isfinite(v) else "—" for v in known]
        if isinstance(quoted, float):
            pairs = zip(cells, known, THEORIES, strict=True)
            cells = [f"{c} ({v / quoted:.2g})" if t in subject and c != "—" else c for c, v, t in pairs]
        rows.append([case, what, quoted if isinstance(quoted, str) else f"{quoted:.3g}", *cells])
    return table(f"case | quantity | paper | {' | '.join(THEORIES)}", rows)


def summary_table(sets: Iterable[distances.DataSet]) -> str:
    """Root mean square deviations of every theory from data sets: area, force and stiffness."""
    rows = []
    for one in sets:
        cells = []
        for name, theory in distances.THEORIES.items():
            found = distances.distances(one.seen, theory)
            sums = [distances.summed_up(one.seen, values) for values in found.values()]
            text = " / ".join(percent(rms) for rms, _ in sums)
            # stiffness may be missing at a last load by itself
            short = " †" if 0 < sums[0][1] < 0.995 else ""
            cells.append("—" if text == "— / — / —" else f"{text}{'*' if name in one.fitted else ''}{short}")
        rows.append([f"{one.title} ({len(one.seen)})", *cells])
    return table(f"simulated surfaces (number) | {' | '.join(distances.THEORIES)}", rows)


def challenge_table() -> str:
    """Theory over simulation at each load of the contact challenge."""
    one = distances.older("challenge")
    found = {name: distances.distances([one], theory) for name, theory in distances.THEORIES.items()}
    known = [name for name, values in found.items() if np.isfinite(values["area"]).any()]
    rows = [
        [area, quantity, *(np.exp(found[name][quantity][k]) for name in known)]
        for k, area in enumerate(one.area)
        for quantity in QUANTITIES
    ]
    return table(f"A/A0 | theory over simulation | {' | '.join(known)}", rows, "{:.2g} | {} | {:.3g}")


def heights_table() -> str:
    """The deviation of force at equal separation for other values of h_max."""
    names, rows = ("MBMA reported", "MBMA fitted", "calibrated"), []
    for key, title in (("bem", "older set"), ("gfmd", "molecular dynamics")):
        for h_max in HEIGHTS:
            one = dataclasses.replace(distances.older(key), h_max=h_max)
            found = [distances.distances([one], distances.THEORIES[name])["force"] for name in names]
            rows.append([title, h_max, *(percent(distances.summed_up([one], part)[0]) for part in found)])
    return table(f"data | h_max/h_rms | {' | '.join(names)}", rows, "{} | {:g}")


def by_gap(ax: Any, surface: Surface, low: float, names: Iterable[str] = tuple(THEORIES), **style: Any) -> None:
    """Force against mean separation."""
    top = surface.h_max / surface.h_rms
    for name in names:
        ax.semilogy(top * DEPTHS, curve(surface, name)[0], color=COLOURS[name], **{"label": name, **style})
    ax.set(xlabel=r"$u/h_{rms}$", ylabel=r"$F/(A_0 E^*)$", ylim=(low, None), xlim=(0, 1.1 * top))


def by_force(ax: Any, surface: Surface, gradient: Any = None, **style: Any) -> None:
    """Area, or kappa where the rms gradient is given, against force; (18) is Persson's area in full and simplified."""
    for name in (*VARIANTS, "G-W", "Persson full"):
        force, area = curve(surface, name)
        shown = (area > 1e-5) & (area < 1.2)
        force, area = force[shown], area[shown]
        values = area if gradient is None else area / force * gradient
        ax.plot(force, values, color=COLOURS[name], **{"label": name.removesuffix(" full"), **style})
    ax.set(xscale="log", xlabel=r"$F/(A_0 E^*)$")
    if gradient is None:
        ax.set(yscale="log", ylabel=r"$A/A_0$")


def simulations() -> Figures:
    """Figures 11, 12 and 15."""
    figure, axes = panels(1, 2)
    by_gap(axes[0], Surface.named("yang-persson"), 1e-7)
    by_gap(axes[1], Surface.named("yang-persson"), 1e-6)
    axes[1].set(xlim=(1.8, 3.1), ylim=(1e-6, 1e-2))
    for ax in axes:
        ax.plot([2.0, 2.5], [2.9e-3, 2.2e-4], "kx", label="quoted: MBMA")
        ax.plot([2.5, 3.0], [1e-3, 3.5e-4], "k+", label="quoted: Persson")
    axes[0].legend(fontsize="small")
    yield "fig11", figure
    for name, key, title in (("papangelo", "bem", "fig12"), ("challenge", "challenge", "fig15")):
        surface, data = Surface.named(name), distances.older(key)
        figure, axes = panels(1, 2 if key == "challenge" else 1, squeeze=False)
        scaled = data.force * surface.rms_gradient
        by_gap(axes[0, 0], surface, 1e-6)
        axes[0, 0].plot(data.u, scaled, "k.", label="boundary elements")
        axes[0, 0].legend(fontsize="small")
        for ax in axes[0, 1:]:
            by_force(ax, surface)
            ax.plot(scaled, data.area, "k.")
        yield title, figure


def by_surface() -> Figures:
    """Figures 13 and 14 of two roads, 16 and 17 of resolutions."""
    pairs = [panels(1, 2), panels(1, 2)]
    for gap_ax, ax, name in zip(pairs[0][1], pairs[1][1], ROADS, strict=True):
        surface = Surface.named(name)
        by_gap(gap_ax, surface, 1e-6)
        by_force(ax, surface)
        force = np.geomspace(1e-5, 0.3, 2) * surface.rms_gradient
        ax.plot(force, 2 * force / surface.rms_gradient, "k:", label="kappa = 2")
        for each in (gap_ax, ax):
            each.set_title(name)
    (gap_figure, ax), (area_figure, pair) = panels(), panels(1, 2)
    for zeta_1, dashes in zip(RESOLUTIONS, ("-", "--", "-.", ":"), strict=True):
        surface = Surface.named(f"resolution-{zeta_1}")
        style: dict[str, Any] = {"ls": dashes, "lw": 1} | ({} if zeta_1 == RESOLUTIONS[0] else {"label": "_"})
        by_gap(ax, surface, 1e-7, (*VARIANTS, "G-W", "Persson simplified"), **style)
        by_force(pair[0], surface, **style)
        by_force(pair[1], surface, surface.rms_gradient, **style)
        for panel in (ax, pair[0]):
            panel.plot([], [], "k", ls=dashes, label=f"zeta_1 = {zeta_1}")
    pair[1].set(ylabel=r"$\kappa = A\sqrt{2 m_2} E^*/F$", ylim=(0, 3))
    drawn = (*((figure, axes[0]) for figure, axes in pairs), (gap_figure, ax), (area_figure, pair[0]))
    for title, (figure, panel) in zip(("fig13", "fig14", "fig16", "fig17"), drawn, strict=True):
        panel.legend(fontsize="small")
        yield title, figure


def by_data_set() -> Figures:
    """Ratios to the data of others and to measured maps, and means with a standard deviation on held-out surfaces."""
    sets, seen = distances.data_sets(), distances.held_out()
    area, title = np.concatenate([one.area for one in seen]), f"{len(seen)} held-out self-affine surfaces"
    groups = {
        "fidelity": [title],
        "reference": ["bem", "gfmd", "challenge", "rolloff"],
        "maps": list(distances.MEASURED),
    }
    for name, keys in groups.items():
        figure, axes = panels(
            3, len(keys), (9, 9 if name == "fidelity" else 7.5), sharex=True, sharey="row", squeeze=False
        )
        for (theory, make), (column, key) in itertools.product(
            distances.THEORIES.items(), zip(axes.T, keys, strict=True)
        ):
            style: dict[str, Any] = {"color": distances.HUES[theory], "label": theory}
            if key == title:
                for ax, values in zip(column, distances.distances(seen, make).values(), strict=True):
                    known = by_bin(area, values, BINS, np.mean, np.std, np.size)
                    kept = known[:, 2] > 4
                    x, (mean, spread, _) = np.sqrt(np.multiply(BINS[1:], BINS[:-1]))[kept], known[kept].T
                    ax.plot(x, np.exp(mean), ".-", **style)
                    if theory in BANDED:
                        band = np.exp(mean - spread), np.exp(mean + spread)
                        ax.fill_between(x, *band, color=distances.HUES[theory], alpha=0.15, lw=0)
            for k, one in enumerate(sets[key].seen if key in sets else ()):
                for ax, values in zip(column, distances.distances([one], make).values(), strict=True):
                    ax.plot(one.area, np.exp(values), ".-", **style | {"label": "_" if k else theory, "lw": 1, "ms": 4})
        for line, quantity in zip(axes, QUANTITIES, strict=True):
            for ax in line:
                ax.axhline(1, color="k", lw=0.5)
                ax.set(xscale="log", xlim=(2e-4, 1.1), yscale="linear" if quantity == "area" else "log")
                ax.set_ylim((0.4, 1.6) if quantity == "area" else (0.1, 10))
                ax.grid(alpha=0.3)
                if len(keys) > 1:
                    ax.minorticks_off()
            line[0].set_ylabel(f"{quantity}, theory / simulation")
        for (top, *_, bottom), key in zip(axes.T, keys, strict=True):
            top.set_title(sets[key].title if key in sets else key, fontsize="small")
            bottom.set_xlabel(r"$A/A_0$ simulated")
        # below, where it hides no curve
        figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
        yield name, figure


def drawn() -> Figures:
    """All figures by name."""
    for part in (by_data_set, simulations, by_surface):
        yield from part()


def measure() -> Measured:
    """The measured blocks of the page, and its figures."""
    parts = {
        "summary": summary_table(distances.data_sets().values()),
        "challenge": challenge_table(),
        "heights": heights_table(),
        "quoted": quoted_table(),
    }
    return parts, {f"docs/figures/{name}.svg": figure for name, figure in drawn()}
