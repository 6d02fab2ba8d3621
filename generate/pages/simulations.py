"""The library beside simulations and published fits.

Joints, lubrication, rough bodies, fidelity, and the data set.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib import colormaps
from matplotlib.colors import to_hex

from generate import distances
from generate.archive import FILES
from generate.boundary_elements.run import LIGHT_BINS, compared, surfaces
from generate.calibrated_file import QUANTITIES, binned, by_bin
from generate.files import ROOT, dataset
from generate.machined import studies
from generate.page import Cell, Measured, Picture, panels, percent, table
from generate.rough_spheres import RADIUS, heights
from mbma_tables import (
    Bodies,
    Contact,
    Joint,
    Surface,
    contact,
    flow_factors,
    rough_contact,
)
from mbma_tables.bodies.bodies import mean_conductivity
from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.quantities.conductances import cooper_mikic_yovanovich
from mbma_tables.effects.rough_contact import mean_wavelength
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.dataset import boundary_elements
from mbma_tables.theories.simulated.reynolds import flow_and_couette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE = ROOT / "docs/data/bandwidth.nc"
# A/A0 by which its loads are told apart
WIDE_LIGHT, WIDE_MIDDLE, WIDE_HEAVY = (0.001, 0.01), (0.01, 0.1), (0.1, 0.97)
PAIRS = {
    "steel on aluminium": ("steel 4140 hard", "aluminium 6061 hard"),
    "copper on copper": "copper C11000 hard",
}
SHORTEST = ("8 um", "2 um")
PRESSURES = (1.0, 10.0, 100.0)  # MPa
README_FACE = {"Rq": "0.4 um", "longest": "100 um", "shortest": "2 um", "hurst": 0.8}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
# of both faces in the figure over Ra [um]: wavelengths at the middle Ra
ROUGHNESSES = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2)
MIDDLE = 0.8
BAND_AT_MIDDLE = (800.0, 8.0)
CONDUCTANCE = "conductance [W/(m² K)]"
# C and r of phi_x = 1 - C exp(-r H), or 1 + C H^-r from gamma = 3 on: Patir and Cheng 1978,
# Table 1
PATIR_CHENG = {
    1 / 9: (1.48, 0.42),
    1 / 6: (1.38, 0.42),
    1 / 3: (1.18, 0.42),
    1.0: (0.90, 0.56),
    3.0: (0.225, 1.5),
    6.0: (0.520, 1.5),
    9.0: (0.870, 1.5),
}
# u/h_rms between which fits are compared: where there is no contact, and where they end
FIRST = 3.0
LAST = 6.0
SMOOTH = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=1.0, h_max=2.9)
GAPS = np.geomspace(0.5, 10, 120)  # u/h_rms
# of the study `film`: lay, Hurst exponent and seed; loads F/(A0 E* g) of 0.06% to 20% contact
FILM_MAPS = [(1.0, 0.8, 41), (3.0, 0.8, 41)]
LIGHT_LOADS = (0.0002, 0.0005, 0.0015, 0.004, 0.01, 0.03, 0.08)
WIDTHS = (1.0, 2.0, 3.0, 4.5, 7.0, 20.0)  # of the contact over the mean wavelength
FACE = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")


def conductances(
    one: Joint, pressure: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Conductance of the solid spots [W/(m^2 K)] at pressures [MPa].

    By the law, with the standard deviation of its logarithm, and by the correlation.
    """
    assert one.pair is not None
    conductivities = [float(text.split()[0]) for text in one.pair.conductivities]
    k = mean_conductivity(*conductivities)
    assert one.pair.hardness is not None
    hardness = 1e3 * float(one.pair.hardness.split()[0])
    pressed = one.at_pressure([f"{p} MPa" for p in pressure])
    # lengths in um, so that W/(m K) over um is 1e6 W/(m^2 K)
    correlation = cooper_mikic_yovanovich(one.surface, pressure, k, 1.0, hardness)
    return (
        np.asarray(pressed.solid_conductance),
        np.asarray(pressed.solid_conductance_scatter),
        1e6 * np.asarray(correlation),
    )


def joints() -> Measured:
    """Stiffness at light loads against boundary elements.

    And conductances: of one joint, against Ra, and against a usual correlation.
    """
    figure, axes = panels(1, 2, (9, 4.4))
    usual = _usual_conductances(axes)
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=2,
        fontsize="small",
    )
    of_joint, (left, right) = panels(1, 2, (10, 4.4))
    _draw_conductances(left)
    _draw_roughnesses(right)
    for ax in (left, right):
        ax.set_ylabel(CONDUCTANCE)
        ax.grid(alpha=0.3)
        ax.legend(fontsize="small")
    right.legend(fontsize="small", loc="lower left")
    pictures: dict[str, Picture] = {
        "docs/figures/joints.svg": figure,
        "docs/figures/joint_conductance.svg": of_joint,
    }
    return {"light": _light_loads(), "usual": usual}, pictures


def design() -> Measured:
    """The candidates of the tutorial on design and their front, by the blocks of the page itself."""
    text = (ROOT / "docs" / "tutorials" / "design.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```\{code-cell\}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    names: dict[str, Any] = {}
    # the first two: the candidates, and the front
    for block in blocks[:2]:
        exec(block, names)
    figure, axes = panels(1, 1, (7.5, 4.6))
    columns = names["columns"]
    for number, pair in enumerate(names["candidates"]):
        chosen = columns["valid"] & (names["names"] == pair)
        axes.plot(
            columns["stiffness"][chosen],
            columns["conductance"][chosen],
            ".",
            markersize=2,
            color=f"C{number}",
            label=pair,
            rasterized=True,
        )
    front = names["front"]
    axes.plot(
        columns["stiffness"][front],
        columns["conductance"][front],
        "k-",
        drawstyle="steps-post",
        label="front",
    )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="tangential stiffness [GPa/um]",
        ylabel="conductance [W/(m^2 K)]",
    )
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", markerscale=4)
    count = len(columns["valid"])
    time = (
        f"{count:,} candidates took {names['seconds']:.1f} s on the machine that drew the "
        "picture, two parts with a hardness each."
    )
    return {"time": time}, {"docs/figures/design_front.svg": figure}


def _draw_with_band(
    axes: Axes, x: FloatArray, y: FloatArray, scatter: FloatArray, **options: Any
) -> None:
    """A line with one standard deviation of its logarithm, where that is known."""
    (line,) = axes.plot(x, y, **options)
    low = y * np.exp(-scatter)
    high = y * np.exp(scatter)
    axes.fill_between(x, low, high, color=line.get_color(), alpha=0.25, lw=0)


def _draw_conductances(axes: Axes) -> None:
    """Conductances of README's joint over pressure; dotted where they are not valid."""
    milled = README_FACE | {"Rq": "0.7 um"}
    joint = Joint(README_FACE, milled, bodies=METALS, nominal_area="4 cm^2")
    pressure = np.geomspace(0.3, 200, 80)
    pressed = joint.at_pressure([f"{p} MPa" for p in pressure])
    titles = {"total": "total", "solid": "solid spots", "gas": "air in the gaps"}
    for number, (name, title) in enumerate(titles.items()):
        values = np.asarray(pressed.quantity(f"{name}_conductance"))
        scatter = np.asarray(pressed.quantity(f"{name}_conductance_scatter"))
        axes.plot(pressure, values, ":", color=f"C{number}")
        valid = np.where(pressed.valid, values, np.nan)
        _draw_with_band(axes, pressure, valid, scatter, color=f"C{number}", label=title)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="pressure [MPa]",
        title="steel on aluminium, Rq 0.4 and 0.7 um,\nwavelengths 100 um to 2 um",
    )


def _draw_roughnesses(axes: Axes) -> None:
    """Conductances over Ra at 10 MPa, of one band of wavelengths and of a scaled one."""
    titles = {
        "-": "{:g} um to {:g} um at each Ra".format(*BAND_AT_MIDDLE),
        "--": f"in proportion to Ra, the same at {MIDDLE:g} um",
    }
    for style, title in titles.items():
        pressed = [_of_roughness(Ra, style == "--") for Ra in ROUGHNESSES]
        for colour, name in (("C1", "solid"), ("C2", "gas")):
            value = [float(one.quantity(f"{name}_conductance")) for one in pressed]
            scatter = [
                float(one.quantity(f"{name}_conductance_scatter")) for one in pressed
            ]
            _draw_with_band(
                axes,
                np.array(ROUGHNESSES),
                np.array(value),
                np.array(scatter),
                color=colour,
                ls=style,
                label=f"{'solid spots' if name == 'solid' else 'air'}, {title}",
            )
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="Ra of each face [um]",
        xticks=ROUGHNESSES,
        ylim=(600, None),
        title="steel on aluminium at 10 MPa, by wavelengths",
    )
    axes.xaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()


def _of_roughness(Ra: float, scaled: bool) -> Contact:
    """Two faces of one Ra [um] at 10 MPa, and of a band in proportion to it or not."""
    scale = Ra / MIDDLE if scaled else 1.0
    longest, shortest = (f"{scale * wavelength} um" for wavelength in BAND_AT_MIDDLE)
    face = {"Ra": f"{Ra} um", "longest": longest, "shortest": shortest, "hurst": 0.8}
    joint = Joint(face, face, bodies=METALS, nominal_area="16 cm^2")
    return joint.at_pressure("10 MPa")


def _light_loads() -> str:
    """ln(simulated/law) of stiffness by contact and by longest wavelengths a side."""
    by_waves: dict[int, list[FloatArray]] = {}
    for one in surfaces(dataset("light_loads")):
        by_waves.setdefault(int(one.waves), []).append(compared(one))
    rows = []
    for waves, parts in by_waves.items():
        area, stiffness, _ = np.concatenate(parts, axis=1)
        cells = [str(waves)]
        for part in binned(area, stiffness, LIGHT_BINS):
            text = f"{part.mean():+.2f} ± {part.std():.2f}" if part.size else ""
            cells.append(text)
        rows.append(cells)
    ends = itertools.pairwise(LIGHT_BINS)
    contacts = " | ".join(f"{low:.2%} to {high:.2%}" for low, high in ends)
    return table(f"longest wavelengths a side | {contacts}", rows)


def _usual_conductances(panel_of_pair: Sequence[Axes]) -> str:
    """Conductances by law and correlation: lines, and a table at `PRESSURES`."""
    rows = []
    pressure = np.geomspace(0.1, 300, 40)
    for (name, materials), axes in zip(PAIRS.items(), panel_of_pair, strict=True):
        for number, shortest in enumerate(SHORTEST):
            face = {"hurst": 0.8, "longest": "250 um", "shortest": shortest}
            joint = Joint(
                face | {"Rq": "1.6 um"},
                face | {"Rq": "0.8 um"},
                bodies=materials,
                nominal_area="4 cm^2",
            )
            law, _, correlation = conductances(joint, np.array(PRESSURES))
            pairs = zip(law, correlation, strict=True)
            rows.append([name, shortest, *(f"{a:.3g}, {b / a:.2f}" for a, b in pairs)])

            law, scatter, correlation = conductances(joint, pressure)
            options: dict[str, Any] = {"color": f"C{number}"}
            options["label"] = f"law, 250 um to {shortest}"
            _draw_with_band(axes, pressure, law / pressure, scatter, **options)
            options["label"] = f"Cooper-Mikic-Yovanovich, 250 um to {shortest}"
            axes.plot(pressure, correlation / pressure, "--", **options)
        axes.set(
            xscale="log",
            xlabel="pressure [MPa]",
            ylabel="conductance over pressure [W/(m² K MPa)]",
            title=f"{name}: solid spots, no gas",
        )
        axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
    columns = " | ".join(f"{p:g} MPa" for p in PRESSURES)
    return table(f"joint | shortest wavelength | {columns}", rows)


def published(gamma: float, H: FloatArray) -> FloatArray:
    C, r = PATIR_CHENG[gamma]
    return 1 + C * H**-r if gamma > 1 else 1 - C * np.exp(-r * H)


def lubrication() -> Measured:
    H = np.linspace(FIRST, LAST, 61)
    rows = []
    figure, (left, right) = panels(1, 2, (10, 4))
    for number, gamma in enumerate(PATIR_CHENG):
        # within what the library takes; the fits' outermost are 1/9 and 9
        peklenik = min(max(gamma, 1 / 8.5), 8.5)
        by_fit = published(gamma, H)
        by_library = flow_factors(SMOOTH, H, peklenik=peklenik).phi_x
        name = f"{gamma:g}" if gamma >= 1 else f"1/{1 / gamma:g}"
        off = np.log(by_library / by_fit)
        rows.append([name, np.sqrt(np.mean(off**2)), off[np.abs(off).argmax()]])
        film = flow_factors(SMOOTH, GAPS, peklenik=peklenik)
        left.semilogx(GAPS, film.phi_x, color=f"C{number}", label=f"gamma {name}")
        left.semilogx(H, by_fit, "o", ms=2, markevery=5, color=f"C{number}")
    left.set(ylabel="phi_x", ylim=(0, 1.4), title="dots: fits of Patir and Cheng 1978")
    left.axvline(float(SMOOTH.h_max), color="0.6", lw=0.8, zorder=0)
    left.legend(fontsize="small", loc="lower right")
    _draw_shear(right)
    right.set(ylabel="phi_s", title="dots: Reynolds' equation on simulated gaps")
    right.legend(fontsize="small", loc="upper right")
    for axes in (left, right):
        axes.set(xlabel="mean gap u/h_rms", xscale="log", xticks=(0.5, 1, 2, 3, 5, 10))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter("")
        axes.grid(alpha=0.3)
    header = "gamma | root mean square of ln ratio | largest"
    text = table(header, rows, "{} | {:.3f} | {:+.3f}")
    return {"published": text}, {"docs/figures/lubrication.svg": figure}


def _draw_shear(axes: Axes) -> None:
    """Shear flow factors of two maps of the study `film`, with and without a lay.

    By the library with its band, first contact as a bar, and by simulation as dots.
    """
    number = itertools.count()
    for _, z, engine in studies.pressed(FILM_MAPS):
        h_rms = z.std()
        gamma = studies.length_ratio(z)
        top = z.max() / h_rms
        gaps = [gap for _, gap in studies.film_gaps(z, engine, LIGHT_LOADS)]
        simulated_u = np.array([gap.mean() / h_rms for gap in gaps])
        carried = [flow_and_couette(gap, gap.shape)[1] for gap in gaps]
        simulated = simulated_u[:, None] - np.array(carried) / h_rms
        alike = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=1.0, h_max=top)
        film = flow_factors(alike, GAPS, peklenik=gamma)
        at_contact = flow_factors(alike, [top], peklenik=gamma)
        # of an isotropic map both axes are the same but for chance: one is enough
        for axis, name in enumerate("xy" if gamma > 2 else "x"):
            colour = f"C{next(number)}"
            ratio = gamma if name == "x" else 1 / gamma
            shear = getattr(film, f"shear_{name}")
            options = {"color": colour, "label": f"gamma {ratio:.2g}"}
            _draw_with_band(axes, GAPS, shear, film.shear_scatter, **options)
            axes.plot(simulated_u, simulated[:, axis], "o", ms=4, color=colour)
            first = getattr(at_contact, f"shear_{name}")
            axes.plot([top], first, "|", ms=14, color=colour)


def spheres() -> dict[str, FloatArray]:
    """Every simulated contact, and the library's at the same approach and force."""
    contacts = dataset("rough_spheres").to_dataframe()
    of_face = ["hurst", "longest", "h_rms", "seed"]
    parts = []
    for (hurst, longest, h_rms, seed), rows in contacts.groupby(of_face):
        z = heights(hurst, longest, h_rms, int(seed))
        face = Surface.from_map(z, 1.0, periodic=True)
        parts.append(_sphere(face, h_rms, rows))
    together = {}
    for name in parts[0]:
        together[name] = np.concatenate([np.asarray(part[name]) for part in parts])
    return together


def _sphere(face: AnySurface, h_rms: float, rows: pd.DataFrame) -> dict[str, FloatArray]:
    """Contacts of one rough sphere, simulated and by the library."""
    force = rows["force"].to_numpy()
    approach = rows["approach"].to_numpy()
    at_force = rough_contact(face, RADIUS, force=force)
    at_approach = rough_contact(face, RADIUS, approach=approach)
    # the mean distance from the axis, weighted by pressure
    p = at_force.pressure
    r = at_force.position
    mean_radius = np.trapezoid(p * r**2, r) / np.trapezoid(p * r, r)
    return {
        "width": 2 * at_force.contact_radius / mean_wavelength(face),
        "off": (at_force.approach - approach) / h_rms,
        "force": np.log(at_approach.force / force),
        "area": np.log(at_force.area / rows["area"].to_numpy()),
        "mean_radius": np.log(mean_radius / rows["mean_radius"].to_numpy()),
        "scatter": at_approach.scatter,
        "valid": at_approach.valid,
    }


def rough_bodies() -> Measured:
    """Distances from boundary elements by the width of the contact, and the curves of one ball."""
    parts = {"spheres": _by_width(spheres())}
    return parts, {"docs/figures/rough_bodies.svg": _draw_ball()}


def _by_width(contacts: dict[str, FloatArray]) -> str:
    rows = []
    for low, high in itertools.pairwise(WIDTHS):
        inside = (contacts["width"] >= low) & (contacts["width"] < high)
        off = contacts["off"][inside]
        cells: list[Cell] = [f"{low:g} to {high:g}", int(inside.sum())]
        cells.append((off.mean(), off.std(), np.abs(off).max()))
        for name in ("force", "area", "mean_radius"):
            values = contacts[name][inside]
            cells.append((values.mean(), values.std()))

        valid = inside & (contacts["valid"] > 0)
        sizes = np.abs(contacts["force"] / contacts["scatter"])[valid]
        shares = f"{np.mean(sizes < 1):.0%}, {np.mean(sizes < 2):.0%}"
        rows.append([*cells, f"{shares} of {valid.sum()}"])
    header = (
        "width over mean wavelength | contacts | approach [h_rms]: mean, sd, largest"
        " | ln F at the approach | ln A at the force | ln mean radius"
        " | valid: within 1, 2 sd"
    )
    of_ratio = "{:+.2f} ± {:.2f}"
    of_approach = "{:+.2f}, {:.2f}, {:.2f}"
    forms = f"{{}} | {{}} | {of_approach} | {of_ratio} | {of_ratio} | {of_ratio}"
    return table(header, rows, forms)


def _draw_ball() -> Figure:
    """Pressure by distance and force by approach, of one ball on a flat."""
    figure, (left, right) = panels(1, 2, (9, 4))
    forces = [f"{10.0**k} N" for k in (-1, 0, 1, 2)]
    ball = rough_contact(FACE, "5 mm", "110 GPa", force=forces, theory="calibrated")
    by_force = zip(ball.position, ball.pressure, np.asarray(ball.force), strict=True)
    for r, p, force in by_force:
        left.semilogy(r, 1e3 * p, label=f"{force:.3g} N")
    left.set(
        xlabel="distance from the middle [um]",
        ylabel="mean pressure [MPa]",
        ylim=(1, None),
    )
    law = ball.law(1e-3)
    x = np.linspace(law.first, 4, 200)[1:]
    right.semilogy(x, law.force(x), label="rough")
    smooth = 4 / 3 * 110e-3 * np.sqrt(5e3) * x[x > 0] ** 1.5  # N, of um and GPa
    right.semilogy(x[x > 0], smooth, "--", label="smooth (Hertz)")
    right.set(xlabel="approach [um]", ylabel="force [N]", ylim=(1e-4, 200))
    for axes in (left, right):
        axes.legend(fontsize="small")
    return figure


# lines of `by_contact` for variants of a theory, thinner than the theory's
VARIANTS: dict[str, dict[str, Any]] = {
    "MBMA printed": {"ls": ":", "lw": 1.2},
    "MBMA fitted": {"ls": "--", "lw": 1.2},
    "MBMA cover": {"ls": "-.", "lw": 1.2},
    "calibrated, map": {"ls": "--", "lw": 1.2},
    "Persson simplified": {"ls": "--", "lw": 1.2},
}
BINS = (0.0005, 0.002, 0.005, 0.01, 0.03, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 0.9, 0.98)


def summary_table(sets: Iterable[distances.DataSet]) -> str:
    """Root mean square deviations of every theory from data sets: area, force and stiffness."""
    rows = []
    for one in sets:
        cells = [f"{one.title} ({len(one.seen)})"]
        for name, theory in distances.THEORIES.items():
            deviations = distances.distances(one.seen, theory).values()
            sums = [distances.summed_up(one.seen, values) for values in deviations]
            text = " / ".join(percent(rms) for rms, _ in sums)
            if text == "— / — / —":
                cells.append("—")
                continue
            star = "*" if name in one.fitted else ""
            # of the area: stiffness may be missing at a last load by itself
            _, share_reached = sums[0]
            dagger = " †" if 0 < share_reached < 0.995 else ""
            cells.append(f"{text}{star}{dagger}")
        rows.append(cells)
    return table(f"simulated surfaces (number) | {' | '.join(distances.THEORIES)}", rows)


def by_contact() -> Figure:
    """Theory over simulation against contact on held-out surfaces.

    Means, of two theories with a standard deviation.
    """
    figure, axes = panels(3, 1, (9, 9), sharex=True)
    seen = distances.held_out()
    area = np.concatenate([one.area for one in seen])
    theories = zip(distances.THEORIES.items(), distances.HUES, strict=True)
    for (name, theory), hue in theories:
        deviations = distances.distances(seen, theory).values()
        for ax, values in zip(axes, deviations, strict=True):
            _draw_deviation(ax, area, values, name, hue)
    for ax, quantity in zip(axes, QUANTITIES, strict=True):
        ax.axhline(1, color="k", lw=0.5)
        ax.set(
            xscale="log",
            xlim=(6e-4, 1.1),
            yscale="log",
            ylim=(0.04, 25),
            ylabel=f"{quantity}, theory / simulation",
        )
        ax.grid(alpha=0.3)
    axes[0].set(
        yscale="linear",
        ylim=(0.4, 1.6),
        title=f"{len(seen)} held-out self-affine surfaces",
    )
    axes[-1].set_xlabel(r"$A/A_0$ simulated")
    # below, where it hides no curve
    figure.legend(
        *axes[0].get_legend_handles_labels(),
        fontsize="small",
        loc="outside lower center",
        ncols=5,
    )
    return figure


def _draw_deviation(
    ax: Axes, area: FloatArray, values: FloatArray, theory: str, hue: str
) -> None:
    """One line of `by_contact`, over bins with enough contacts."""
    mean, spread, count = by_bin(area, values, BINS, np.mean, np.std, np.size).T
    has_enough = count > 4
    middle = np.sqrt(np.multiply(BINS[1:], BINS[:-1]))[has_enough]
    mean = mean[has_enough]
    spread = spread[has_enough]
    style: dict[str, Any] = {
        "marker": ".",
        "color": hue,
        **VARIANTS.get(theory, {"lw": 2.2}),
    }
    ax.plot(middle, np.exp(mean), label=theory, **style)
    if theory in ("MBMA reported", "calibrated"):
        lower = np.exp(mean - spread)
        upper = np.exp(mean + spread)
        ax.fill_between(middle, lower, upper, color=hue, alpha=0.15, lw=0)


class WideLoads(NamedTuple):
    """Loads of one surface of a wide band: errors of the calibrated law beside its scatter."""

    area: FloatArray  # A/A0 of the simulation
    of_area: FloatArray  # ln at given pressure
    of_pressure: FloatArray  # ln at given gap
    area_scatter: FloatArray
    scatter: FloatArray


def wide_loads(one: xr.Dataset) -> WideLoads:
    """The calibrated law beside the loads of one surface of docs/data/bandwidth.nc."""
    solved = np.isfinite(one.force.values)
    area = one.area.values[solved].astype(float)
    u = one.mean_separation.values[solved].astype(float)
    zeta_1 = float(one.zeta_1)
    # with q0 small enough that the gradient is below 1
    face = Surface(float(one.hurst), 1e-3, 1e-3 * zeta_1, 1.0, float(one.h_max))
    gradient = float(face.rms_gradient)
    pressure = one.force.values[solved] * gradient
    hardness = float(one["shape"]) * gradient or np.inf
    bodies = Bodies(1.0, hardness=hardness)
    pressed = contact(face, bodies, pressure=pressure, theory="calibrated")
    at_gap = contact(face, bodies, mean_separation=u, theory="calibrated")
    return WideLoads(
        area,
        np.log(pressed.area / area),
        np.log(at_gap.pressure / pressure),
        np.asarray(pressed.area_scatter),
        np.asarray(at_gap.scatter),
    )


def of_wide_surface(one: xr.Dataset) -> str:
    """Ratio of wavelengths, H, hardness, and which surface of its spectrum."""
    eta = float(one["shape"])
    return (
        f"{float(one.zeta_1):g} | {float(one.hurst):g} | "
        f"{f'{eta:g}' if eta else 'elastic'} | {int(one.seed) % 100 + 1}"
    )


def wide_bands(data: xr.Dataset) -> str:
    """A table of the calibrated law's errors at wavelengths beyond 1:128, a row a surface."""
    parts = (WIDE_LIGHT, WIDE_MIDDLE, WIDE_HEAVY)
    lines = [
        "| longest/shortest | H | hardness | surface | 0.1-1% | 1-10% | 10-97% |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in surfaces(data):
        loads = wide_loads(one)
        cells = []
        for low, high in parts:
            own = (loads.area >= low) & (loads.area < high)
            rms = [
                100 * np.sqrt(np.mean(error[own] ** 2)) if own.any() else np.nan
                for error in (loads.of_area, loads.of_pressure)
            ]
            cells.append(
                f"{rms[0]:.1f} / {rms[1]:.0f} ({own.sum()})" if own.any() else ""
            )
        lines.append(f"| {of_wide_surface(one)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def wide_score(data: xr.Dataset) -> str:
    """A table of how many loads beyond 1:128 are as accurate as those below, and how many the scatter covers."""
    lines = [
        "| surfaces | area within 2%, from 10% | p within 5%, from 10% | area within 15%, 1-10% | "
        "p within 15%, 1-10% | area within two scatters | p within two scatters |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    found: dict[str, list[WideLoads]] = {}
    for one in surfaces(data):
        kind = "with a hardness" if float(one["shape"]) else "elastic"
        second = "second" if int(one.seed) % 100 else "first"
        which = "" if float(one["shape"]) else f", {second} surfaces"
        key = f"{float(one.zeta_1):g}:1, {kind}{which}"
        found.setdefault(key, []).append(wide_loads(one))
    for key, alike in found.items():
        loads = WideLoads(*map(np.concatenate, zip(*alike, strict=True)))
        heavy, middle = (
            (loads.area >= low) & (loads.area < high)
            for low, high in (WIDE_HEAVY, WIDE_MIDDLE)
        )
        pairs = (
            (loads.of_area[heavy], 0.02),
            (loads.of_pressure[heavy], 0.05),
            (loads.of_area[middle], 0.15),
            (loads.of_pressure[middle], 0.15),
            (loads.of_area / loads.area_scatter, 2.0),
            (loads.of_pressure / loads.scatter, 2.0),
        )
        # beyond the widest tested band no scatter is stated
        stated = [(errors[np.isfinite(errors)], most) for errors, most in pairs]
        cells = [f"{np.sum(np.abs(e) <= most)} of {len(e)}" for e, most in stated]
        lines.append(f"| {key} ({len(alike)}) | {' | '.join(cells)} |")
    return "\n".join(lines)


def fidelity() -> Measured:
    of_others = distances.theories_of(distances.OTHERS)
    wide = xr.load_dataset(WIDE, group="bandwidth")
    parts = {
        "summary": summary_table(distances.data_sets().values()),
        "scores": distances.scores(distances.THEORIES | of_others),
        "bandwidth": wide_bands(wide),
        "wide": wide_score(wide),
    }
    return parts, {"docs/figures/fidelity.svg": by_contact()}


def draw_data(tree: xr.DataTree) -> Figure:
    figure, (left, middle, right) = panels(1, 3, (11, 3.6))
    hard = tree["hardness"].to_dataset()
    elastic = tree["elastic"].to_dataset()
    leaky = tree["leakage"].to_dataset()

    def dots(axes: Axes, x: xr.DataArray, y: xr.DataArray, colour: str) -> None:
        axes.plot(
            x.values.ravel(),
            y.values.ravel(),
            ".",
            color=colour,
            ms=2.5,
            alpha=0.5,
            rasterized=True,
        )

    left.set(xscale="log", yscale="log")
    hues = colormaps["viridis_r"](np.linspace(0.1, 1, hard.sizes["hardness"]))
    for row, hue in enumerate(hues):
        of_hardness = hard.isel(hardness=row)
        dots(left, of_hardness.force, of_hardness.area, to_hex(hue))
        value = float(of_hardness.eta)
        # a dot of a size that can be seen, for the legend
        name = f"{value:g}" if np.isfinite(value) else "elastic"
        left.plot([], [], "o", ms=4, color=hue, label=name)
    left.legend(title="hardness/(E* g)", fontsize="x-small", title_fontsize="x-small")
    middle.set(yscale="log")
    dots(middle, elastic.mean_separation, elastic.force, "C0")
    right.set(yscale="log")
    dots(right, leaky.area, leaky.flow.max("axis"), "C2")
    left.set(xlabel="pressure F/(A0 E* g)", ylabel="contact area A/A0")
    middle.set(xlabel="mean gap u/h_rms", ylabel="pressure F/(A0 E* g)", xlim=(0, 5))
    right.set(
        xlabel="contact area A/A0",
        ylabel="flow coefficient/h_rms³",
        ylim=(1e-6, 100),
        xlim=(0, 0.5),
    )
    return figure


def data() -> Measured:
    tree = boundary_elements()
    rows = []
    for name, node in tree.children.items():
        group = node.to_dataset()
        contacts = int(np.isfinite(group.area).sum())
        rows.append([f"`{name}`", group.attrs["title"], _surfaces_of(group), contacts])
    files = [
        [f"`{name}`", content, f"`{command}`" if command else "-"]
        for name, (content, command) in FILES.items()
    ]
    parts = {
        "groups": table("group | content | surfaces | contacts", rows),
        "files": table(
            "file of docs/data | content | made by `python -m generate`", files
        ),
    }
    return parts, {"docs/figures/data.svg": draw_data(tree)}


def _surfaces_of(group: xr.Dataset) -> int:
    """Their number; where a row is a contact, that of different columns before the force."""
    if "contact" not in group.dims:
        return group.sizes["surface"]
    frame = group.to_dataframe()
    of_surface = [*frame.columns[: frame.columns.get_loc("force")]]
    return int(frame.groupby(of_surface).ngroups)
