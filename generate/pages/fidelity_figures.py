"""Figures of the fidelity page: the paper's Figures 11-17 and the ratios to brute force."""

from __future__ import annotations

import functools
import pathlib
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from generate.pages.fidelity import (
    AREA_THEORIES,
    COLOURS,
    GAPS,
    PERSSON,
    READINGS,
    REFERENCES,
    RESOLUTIONS,
    ROADS,
    THEORIES,
    area_ratios,
    force_at,
    force_ratios,
    sample,
)
from generate.pages.page import png
from mbma_tables import Surface, theories
from mbma_tables.files import write_file


def draw(folder: pathlib.Path) -> None:
    """All figures, as PNG files of 900 pixels' width."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    def new(rows: int = 1, columns: int = 2, **options: Any) -> tuple[Any, Any]:
        height = 3.4 if rows == 1 else 6.4
        return plt.subplots(rows, columns, figsize=(9, height), dpi=100, layout="constrained", **options)

    def save(figure: Any, name: str) -> None:
        write_file(folder / f"{name}.png", png(figure), make_folders=True)

    def by_gap(ax: Any, surface: Surface, low: float, names: Iterable[str] = THEORIES, **style: Any) -> None:
        top = surface.h_max / surface.h_rms
        for name in names:
            if name in PERSSON:
                ratio = np.linspace(0.005, 1.1 * top, GAPS)
                force = force_at(surface, name, ratio)
            else:
                gap, force, _ = sample(surface, name)
                ratio = theories.mean_separation(surface, gap) / surface.h_rms
            ax.semilogy(ratio, force, color=COLOURS[name], **{"label": name, **style})
        ax.set(xlabel=r"$u/h_{rms}$", ylabel=r"$F/(A_0 E^*)$", ylim=(low, None), xlim=(0, 1.1 * top))

    def by_force(ax: Any, surface: Surface, ordinate: Callable[[Any, Any], Any], **style: Any) -> None:
        for name in AREA_THEORIES:
            force, area = (
                (f := np.geomspace(1e-5, 3, GAPS) * np.sqrt(surface.m2), theories.persson_area(surface, f))
                if name == "Persson"
                else sample(surface, name)[1:]
            )
            shown = (area > 1e-5) & (area < 1.2)
            ax.plot(force[shown], ordinate(force, area)[shown], color=COLOURS[name], **{"label": name, **style})
        ax.set(xscale="log", xlabel=r"$F/(A_0 E^*)$")

    def area_only(force: Any, area: Any) -> Any:
        return area

    def slope(gradient: Any, force: Any, area: Any) -> Any:
        return area / force * gradient

    surface = Surface.named("yang-persson")
    figure, axes = new()
    by_gap(axes[0], surface, 1e-7)
    by_gap(axes[1], surface, 1e-6)
    axes[1].set(xlim=(1.8, 3.1), ylim=(1e-6, 1e-2))
    for ax in axes:
        ax.plot([2.0, 2.5], [2.9e-3, 2.2e-4], "kx")
        ax.plot([2.5, 3.0], [1e-3, 3.5e-4], "k+")
    axes[0].legend(fontsize="small")
    save(figure, "fig11")

    surface = Surface.named("papangelo")
    bem = REFERENCES["bem"]
    figure, ax = new(columns=1)
    by_gap(ax, surface, 1e-6)
    scaled = bem.column("force") * surface.rms_gradient / bem.gradient
    ax.plot(bem.column("mean_separation_over_h_rms"), scaled, "k.", label="boundary elements")
    ax.legend(fontsize="small")
    save(figure, "fig12")

    figure, axes = new()
    for ax, name in zip(axes, ROADS, strict=True):
        by_gap(ax, Surface.named(name), 1e-6)
        ax.set_title(name)
    axes[0].legend(fontsize="small")
    save(figure, "fig13")

    figure, axes = new()
    for ax, name in zip(axes, ROADS, strict=True):
        surface = Surface.named(name)
        by_force(ax, surface, area_only)
        force = np.geomspace(1e-5, 0.3, 2) * surface.rms_gradient
        ax.plot(force, 2 * force / surface.rms_gradient, "k:", label="kappa = 2")
        ax.set(yscale="log", ylabel=r"$A/A_0$", title=name)
    axes[0].legend(fontsize="small")
    save(figure, "fig14")

    surface = Surface.named("challenge")
    data = REFERENCES["challenge"]
    scaled = data.column("force") * surface.rms_gradient / data.gradient
    figure, axes = new()
    by_gap(axes[0], surface, 1e-6)
    axes[0].plot(data.column("mean_separation_over_h_rms"), scaled, "k.", label="boundary elements")
    by_force(axes[1], surface, area_only)
    axes[1].plot(scaled, data.column("area"), "k.")
    axes[1].set(yscale="log", ylabel=r"$A/A_0$")
    axes[0].legend(fontsize="small")
    save(figure, "fig15")

    gap_figure, ax = new(columns=1)
    area_figure, pair = new()
    for zeta_1, style in zip(RESOLUTIONS, ("-", "--", "-.", ":"), strict=True):
        surface = Surface.named(f"resolution-{zeta_1}")
        first = {} if zeta_1 == RESOLUTIONS[0] else {"label": "_"}
        by_gap(ax, surface, 1e-7, (*READINGS, "G-W", "Persson simplified"), ls=style, lw=1, **first)
        by_force(pair[0], surface, area_only, ls=style, lw=1, **first)
        by_force(pair[1], surface, functools.partial(slope, surface.rms_gradient), ls=style, lw=1, **first)
        for panel in (ax, pair[0]):
            panel.plot([], [], "k", ls=style, label=f"zeta_1 = {zeta_1}")
    pair[0].set(yscale="log", ylabel=r"$A/A_0$")
    pair[1].set(ylabel=r"$\kappa = A\sqrt{2 m_2} E^*/F$", ylim=(0, 3))
    for panel, figure, name in ((ax, gap_figure, "fig16"), (pair[0], area_figure, "fig17")):
        panel.legend(fontsize="small")
        save(figure, name)

    figure, axes = new(2, len(REFERENCES), sharey="row")
    for column, reference in zip(axes.T, REFERENCES.values(), strict=True):
        surface = reference.surface()
        for ax, ratios, abscissa in (
            (column[0], area_ratios(reference, surface), "area"),
            (column[1], force_ratios(reference, surface), "mean_separation_over_h_rms"),
        ):
            for name, values in ratios.items():
                ax.plot(reference.column(abscissa), values, ".-", color=COLOURS[name], label=name)
            ax.axhline(1, color="k", lw=0.5)
        column[0].set(xscale="log", xlabel=r"$A/A_0$ of the data", xlim=(1e-4, 1.5))
        column[0].set_title(reference.title.split(",")[0], fontsize="small")
        column[1].set(yscale="log", xlabel=r"$u/h_{rms}$", xlim=(0, 3.2))
    axes[0, 0].set_ylabel("area, model / data")
    axes[1, 0].set_ylabel("force, model / data")
    # below the panels, where it hides no curve
    figure.legend(*axes[1, 2].get_legend_handles_labels(), fontsize="small", loc="outside lower center", ncols=5)
    save(figure, "reference")
