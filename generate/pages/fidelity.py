"""docs/fidelity.md: theories beside simulations, and beside what the paper quotes."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from generate import distances
from generate.calibrated_file import QUANTITIES, by_bin
from generate.distances import HUES
from generate.pages.page import Measured, panels, percent, table
from mbma_tables import Surface, contact, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.wrapped import answer_where_finite

THEORIES: dict[str, theories.Theory] = {
    "MBMA reported": theories.Mbma(),
    "MBMA printed": theories.Mbma(variant="printed"),
    "G-W": theories.GreenwoodWilliamson(),
    "Persson": theories.Persson("full"),
    "Persson simplified": theories.Persson("simplified"),
}
VARIANTS, PERSSON = ("MBMA reported", "MBMA printed"), ("Persson", "Persson simplified")
# u/h_max, closer at first and at full contact; G-W's heights have no end
DEPTHS = np.concatenate(
    [
        *(np.linspace(1.5, 1.005, 16), 1 - np.geomspace(0.002, 0.1, 16)[:-1]),
        *(np.linspace(0.9, 0.0015, 40)[:-1], np.geomspace(0.0015, 1e-5, 8)),
    ]
)
BANDED = ("MBMA reported", "calibrated")
BINS = (0.0005, 0.002, 0.005, 0.01, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9, 0.98)
FINER = tuple(f"resolution-{zeta_1}" for zeta_1 in (125, 250, 500, 1000))
# figures of the paper: named surfaces, what is drawn against mean separation or force, and a simulation
PAPER: tuple[tuple[str, tuple[str, ...], str, str], ...] = (
    ("Fig. 11, Yang-Persson", ("yang-persson",), "force", ""),
    ("Fig. 12, Papangelo", ("papangelo",), "force", "bem"),
    *((f"Fig. 13, {road}", (road,), "force", "") for road in ("concrete", "asphalt")),
    *((f"Fig. 14, {road}", (road,), "area", "") for road in ("concrete", "asphalt")),
    ("Fig. 15, contact challenge", ("challenge",), "force", "challenge"),
    ("Fig. 15, contact challenge", ("challenge",), "area", "challenge"),
    ("Fig. 16, resolution study", FINER, "force", ""),
    ("Fig. 17, resolution study", FINER, "area", ""),
    ("Fig. 17, resolution study", FINER, "kappa", ""),
)
LABELS = {"force": r"$F/(A_0 E^*)$", "area": r"$A/A_0$", "kappa": r"$\kappa = A\sqrt{2 m_2} E^*/F$"}
STEEL = 200e3  # MPa, the E* at which the paper's 3.5e-4 E* is its 70 MPa
Values = dict[str, Any]
Quoted = tuple[str, str, float | str, Iterable[str], Values]  # case, what, the paper's, theories it is about, values


def force_at(surface: Surface, theory: str, ratio: Any) -> FloatArray:
    """F/(A0 E*) at mean separations u = ratio * h_rms; NaN where the theory has none, as Persson's at u = 0."""
    return answer_where_finite(THEORIES[theory], surface, np.atleast_1d(ratio) * surface.h_rms).pressure


@functools.cache
def forces(name: str, ratio: float, unit: float = 1.0) -> Values:
    """F/(A0 E*) of every theory at u = ratio * h_rms of a named surface, in a unit."""
    return {t: float(force_at(Surface.named(name), t, ratio)[0]) / unit for t in THEORIES}


def kappa(surface: Surface, area: float) -> Values:
    """A/F sqrt(2 m2) E*, Eq. (51), at A/A0 = `area`, of every theory; (18) is Persson's in full and simplified."""
    asked = THEORIES | dict.fromkeys(PERSSON, THEORIES["Persson"])
    found = {name: contact(surface, area=area, theory=theory).pressure for name, theory in asked.items()}
    return {name: float(area / force * surface.rms_gradient) for name, force in found.items()}


def quoted_numbers() -> Iterable[Quoted]:
    """Numbers that the paper quotes, beside every theory's."""
    case = "yang-persson"
    for ratio, name, quoted in (
        *((2.5, "MBMA", 2.2e-4), (2.0, "MBMA", 2.9e-3)),
        *((3.0, "Persson", 3.5e-4), (2.5, "Persson", 1e-3)),
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

    case, what = "challenge", "F over Persson, u = 0.01 h_rms: MBMA"
    yield case, what, "within 4x", (), forces(case, 0.01, forces(case, 0.01)["Persson"])
    for ratio, expected in ((2.5, "sensitive: MBMA, G-W"), (0.2, "1, except for G-W")):
        below, above = (forces(name, ratio) for name in (FINER[0], FINER[-1]))
        values = {t: above[t] / below[t] for t in THEORIES}
        yield "resolution", f"F at zeta_1 = 1000 over 125, u = {ratio:g} h_rms", expected, (), values


def quoted_table() -> str:
    """What the paper quotes beside what every theory gives, in brackets their ratio."""

    def cell(value: float, quoted: float | str, named: bool) -> str:
        ratio = f" ({value / quoted:.2g})" if named and not isinstance(quoted, str) else ""
        return f"{value:.3g}{ratio}" if np.isfinite(value) else "—"

    rows = []
    for case, what, quoted, subject, values in quoted_numbers():
        cells = [cell(values.get(t, np.nan), quoted, t in subject) for t in THEORIES]
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


def paper() -> Any:
    """Figures 11 to 17, their lines dashed shorter for larger zeta_1, beside simulations."""
    figure, axes = panels(4, 3, (11, 13))
    for ax, (title, names, kind, data) in zip(axes.flat, PAPER, strict=False):
        for name, dashes in zip(names, ("-", "--", "-.", ":"), strict=False):
            surface = Surface.named(name)
            g, top = float(surface.rms_gradient), float(surface.h_max / surface.h_rms)
            for theory, made in THEORIES.items():
                found = answer_where_finite(made, surface, DEPTHS * surface.h_max)
                force, area = np.where((found.area > 1e-5) & (found.area < 1.2), [found.pressure, found.area], np.nan)
                lines = {
                    "force": (top * DEPTHS, found.pressure),
                    "area": (force, area),
                    "kappa": (force, area / force * g),
                }
                ax.plot(*lines[kind], color=HUES[theory], ls=dashes, lw=1, label="_" if dashes != "-" else theory)
        if data:
            one = distances.older(data)
            pairs = {"force": (one.u, one.force * g), "area": (one.force * g, one.area)}
            ax.plot(*pairs[kind], "k.", label="boundary elements")
        if kind == "force":
            ax.set(xlabel=r"$u/h_{rms}$", xlim=(0, 1.1 * top), ylim=(1e-7, None), yscale="log")
        else:
            ax.set(xlabel=LABELS["force"], xscale="log", yscale="log" if kind == "area" else "linear")
        ax.set(ylabel=LABELS[kind], title=title)
        ax.minorticks_off()
        if kind == "kappa":
            ax.set_ylim(0, 3)
        if "14" in title:
            ax.plot([1e-5 * g, 0.3 * g], [2e-5, 0.6], "k:", label="kappa = 2")
    axes[0, 0].plot([2.0, 2.5], [2.9e-3, 2.2e-4], "kx", label="quoted: MBMA")
    axes[0, 0].plot([2.5, 3.0], [1e-3, 3.5e-4], "k+", label="quoted: Persson")
    handles = {label: h for ax in axes.flat for h, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    axes[-1, -1].legend(handles.values(), handles.keys(), loc="center")
    axes[-1, -1].set_axis_off()
    return figure


def by_contact(sets: dict[str, distances.DataSet], keys: list[str], height: float) -> Any:
    """Theory over simulation against contact, of each surface of data sets, or mean and standard deviation of many."""
    figure, axes = panels(3, len(keys), (9, height), sharex=True, sharey="row", squeeze=False)
    for column, key in zip(axes.T, keys, strict=True):
        seen = sets[key].seen
        for theory, make in distances.THEORIES.items():
            style: dict[str, Any] = {"color": HUES[theory], "label": theory}
            if len(seen) > 2:
                area = np.concatenate([one.area for one in seen])
                for ax, values in zip(column, distances.distances(seen, make).values(), strict=True):
                    known = by_bin(area, values, BINS, np.mean, np.std, np.size)
                    kept = known[:, 2] > 4
                    x, (mean, spread, _) = np.sqrt(np.multiply(BINS[1:], BINS[:-1]))[kept], known[kept].T
                    ax.plot(x, np.exp(mean), ".-", **style)
                    if theory in BANDED:
                        band = np.exp(mean - spread), np.exp(mean + spread)
                        ax.fill_between(x, *band, color=HUES[theory], alpha=0.15, lw=0)
                continue
            for k, one in enumerate(seen):
                for ax, values in zip(column, distances.distances([one], make).values(), strict=True):
                    ax.plot(one.area, np.exp(values), ".-", **style | {"label": "_" if k else theory, "lw": 1, "ms": 4})
        column[0].set_title(sets[key].title, fontsize="small")
        column[-1].set_xlabel(r"$A/A_0$ simulated")
    for line, quantity in zip(axes, QUANTITIES, strict=True):
        for ax in line:
            ax.axhline(1, color="k", lw=0.5)
            ax.set(xscale="log", xlim=(2e-4, 1.1), yscale="linear" if quantity == "area" else "log")
            ax.set_ylim((0.4, 1.6) if quantity == "area" else (0.1, 10))
            ax.grid(alpha=0.3)
            if len(keys) > 1:
                ax.minorticks_off()
        line[0].set_ylabel(f"{quantity}, theory / simulation")
    # below, where it hides no curve
    figure.legend(*axes[0, 0].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
    return figure


def drawn() -> dict[str, Any]:
    """Figures of deviations by name."""
    sets, seen = distances.data_sets(), distances.held_out()
    sets["held out"] = distances.DataSet(f"{len(seen)} held-out self-affine surfaces", seen)
    columns = {"fidelity": ["held out"], "reference": ["bem", "gfmd", "challenge", "rolloff"]}
    columns["maps"] = list(distances.MEASURED)
    return {name: by_contact(sets, keys, 9 if name == "fidelity" else 7.5) for name, keys in columns.items()}


def measure() -> Measured:
    """The measured blocks of the page, and its figures."""
    parts = {"summary": summary_table(distances.data_sets().values()), "quoted": quoted_table()}
    return parts, {f"docs/figures/{name}.svg": figure for name, figure in (drawn() | {"paper": paper()}).items()}
