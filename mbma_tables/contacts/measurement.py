"""Report on a measured map or line scan: text lines, a table of loads and one picture."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError, NotSelfAffineError, OutOfRangeError
from mbma_tables.common.plots import new_figure, theory_label
from mbma_tables.surfaces.heights import SHARES
from mbma_tables.surfaces.roughness import areal_parameters
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated
from mbma_tables.theories import resolve
from mbma_tables.theories.base import UserTheory
from mbma_tables.theories.users import answer_where_finite

DRAWN = ("calibrated", "mbma")
AREAS = np.array([0.002, 0.01, 0.03, 0.1, 0.3, 0.6])  # contact of a table of loads
REACHED = 0.05  # relative, of a contact that was asked for
GAPS = np.append(
    np.geomspace(2e-3, 0.1, 20)[:-1], np.linspace(0.1, 0.98, 60)
)  # u/h_max of curves


def described(surface: MeasuredSurface, departures: Iterable[str] = ()) -> list[str]:
    """Text lines on a measurement: its properties, its treatment, and a theory's departures.

    These are why no contact of the surface is valid by the theory.
    """
    unit = surface.unit or "length"
    h_rms = float(surface.h_rms)
    shortest = 2 * np.pi / float(surface.q1)
    longest = 2 * np.pi / float(surface.q0)
    top = float(surface.h_max)
    gradient = float(surface.rms_gradient)
    lines = [
        f"h_rms {h_rms:.4g} {unit}, highest point {top:.4g} {unit} ({top / h_rms:.3g} h_rms), rms gradient"
    ]
    lines = [
        f"{lines[0]} {gradient:.4g}",
        f"wavelengths from {shortest:.4g} to {longest:.4g} {unit}",
    ]
    if (found := areal(surface)) is not None:
        shown = {name: f"{name} {number:.4g}" for name, number in found.items()}
        lines.append(
            f"ISO 25178 [{unit}]: "
            + ", ".join(shown[name] for name in ("Sq", "Sa", "Sp", "Sv", "Sz"))
        )
        lines.append(
            ", ".join(shown[name] for name in ("Ssk", "Sku", "Sdq"))
            + f"; lay at {found['lay']:.0f} degrees"
        )
        heights = ", ".join(shown[name] for name in ("Sk", "Spk", "Svk"))
        lines.append(
            f"core [{unit}]: {heights}; Smr1 {found['Smr1']:.1%}, Smr2 {found['Smr2']:.1%}"
        )
    try:
        nearest = surface.fit()
        assert nearest.fit is not None
        lines.append(
            f"self-affine: H = {nearest.hurst:.2f}, q0 = {nearest.q0:.4g}, q1 = {nearest.q1:.4g} 1/{unit}, "
            f"with {nearest.fit.variance_share:.0%} of the variance"
        )
    except NotSelfAffineError as fault:
        lines.append(f"not self-affine: {fault}")
    if not surface.heights.is_gaussian:
        lines.append(
            f"heights: skewness {surface.skewness:.2g}, kurtosis {surface.kurtosis:.3g} (Gaussian: 0 and 3)"
        )
    if surface.bearing is not None:
        ratio = f"anisotropy {surface.bearing.anisotropy:.3g} (rms gradient along over across)"
        lines.append(
            f"slopes: {ratio}, kurtosis {surface.bearing.slope_kurtosis:.3g} (Gaussian: 3)"
        )
    lines += [f"not valid: {reason}" for reason in departures]
    return lines + [entry["told"] for entry in surface.provenance if "told" in entry]


def areal(surface: MeasuredSurface) -> dict[str, float] | None:
    """Parameters of ISO 25178 of a surface's map; None where it has none."""
    whole = surface.map
    if whole is None or whole.heights.ndim != 2:
        return None
    return areal_parameters(whole.heights, (whole.steps[0], whole.steps[1]))


def curves(
    surface: MeasuredSurface, E_star: float = 1.0
) -> dict[str, dict[str, FloatArray]]:
    """Force, area, mean separation and their scatter by the theories of the picture."""
    u = float(surface.h_max) * GAPS
    found = {}
    for name in DRAWN:
        theory = resolve(name, surface)
        try:
            answer = answer_where_finite(theory, surface, u)
        except MbmaError:
            # theories that fail are left out of the picture
            continue
        scatter, area_scatter = (
            theory.scatter(surface, what, answer.area) for what in ("pressure", "area")
        )
        lines = {
            "pressure": E_star * answer.pressure,
            "area": answer.area,
            "mean_separation": u,
        }
        slopes = np.gradient(np.log(np.maximum(answer.pressure, 1e-300)), u)
        # a factor of force at a separation is a step of separation at a force
        found[name] = lines | {
            "area_scatter": area_scatter,
            "separation_scatter": scatter / np.abs(slopes),
        }
    return found


def draw(
    treated: Treated, surface: MeasuredSurface, answers: Mapping[str, Any], title: str, pressure_label: str,
    simulated: Mapping[str, FloatArray] | None = None,
) -> Any:  # fmt: skip
    """One picture: heights, form removed, spectrum with fit and cut-offs, heights' distribution, area and separation.

    `answers` are those of `curves`; `simulated` has force, area and mean_separation of
    boundary elements, as points.
    """
    figure = new_figure(12, 7.5)
    unit = surface.unit or "length"
    parts: Any = figure.subfigures(2, 1)
    above, below = parts
    heights, *form, spectrum, distribution = above.subplots(
        1, 3 if treated.form is None else 4
    )
    _heights(above, heights, treated.heights, treated.steps, unit)
    if form:
        _heights(above, form[0], treated.form, treated.steps, unit)
        form[0].set_title("form removed")
    _spectrum(spectrum, surface, unit)
    _distribution(distribution, surface)
    areas, separations = below.subplots(1, 2)
    _by_pressure(areas, answers, simulated, "area", "area_scatter")
    areas.set(
        xscale="log",
        yscale="log",
        xlabel=pressure_label,
        ylabel="real contact area  A/A0",
    )
    areas.legend()
    _by_pressure(separations, answers, simulated, "mean_separation", "separation_scatter")
    separations.set(
        xscale="log", xlabel=pressure_label, ylabel=f"mean separation u [{unit}]"
    )
    separations.set_ylim(0, 1.05 * float(surface.h_max))
    figure.suptitle(title)
    return figure


def _heights(
    figure: Any, axes: Any, values: FloatArray, steps: tuple[float, ...], unit: str
) -> None:
    sides = [count * step for count, step in zip(values.shape, steps, strict=True)]
    axes.set(
        xlabel=f"x [{unit}]", ylabel=f"{'height' if values.ndim == 1 else 'y'} [{unit}]"
    )
    if values.ndim == 1:
        axes.plot(np.arange(values.size) * steps[0], values, lw=0.5)
        return
    low, high = np.quantile(values, [0.002, 0.998])
    ends = {"extent": (0, sides[0], 0, sides[1]), "vmin": low, "vmax": high}
    shown = axes.imshow(values.T, origin="lower", cmap="viridis", **ends)
    figure.colorbar(shown, ax=axes, label=f"height [{unit}]", shrink=0.8)


def _spectrum(axes: Any, surface: MeasuredSurface, unit: str) -> None:
    axes.loglog(
        surface.q,
        np.where(surface.C > 0, surface.C, np.nan),
        ".-",
        ms=3,
        lw=1,
        label="measured",
    )
    try:
        nearest = surface.fit()
        q = np.geomspace(float(nearest.q0), float(nearest.q1), 50)
        inside = np.clip(q, nearest.q0, nearest.q1)
        axes.loglog(
            q, nearest.power_spectrum(inside), "--", label=f"H = {nearest.hurst:.2f}"
        )
    except NotSelfAffineError:
        pass
    for entry in surface.provenance:
        if entry["step"] in ("short_cutoff", "long_cutoff"):
            axes.axvline(
                2 * np.pi / entry["wavelength"],
                color="grey",
                ls=":",
                label=entry["step"].replace("_", " "),
            )
        if entry["step"] == "extrapolated":
            first = next(
                e["shortest"] for e in surface.provenance if e["step"] == "resolution"
            )
            axes.axvspan(
                2 * np.pi / first,
                float(surface.q1),
                alpha=0.15,
                color="grey",
                label="not measured",
            )
    axes.set(xlabel=f"q [1/{unit}]", ylabel=f"C(q) [{unit}$^4$]")
    axes.legend()


def _distribution(axes: Any, surface: MeasuredSurface) -> None:
    # density of heights from their quantiles, smoothed over a few
    heights = np.asarray(surface.heights.quantiles)
    h_rms = float(surface.h_rms)
    grid = np.linspace(-4.5, 4.5, 61)
    below = np.interp(grid * h_rms, heights[::-1], 1 - np.asarray(SHARES)[::-1])
    axes.stairs(
        np.diff(below) / np.diff(grid), grid, label="heights", fill=True, alpha=0.4
    )
    axes.plot(
        grid, np.exp(-(grid**2) / 2) / np.sqrt(2 * np.pi), "k--", lw=1, label="Gaussian"
    )
    axes.axvline(float(surface.h_max) / h_rms, color="C3", lw=1, label="h_max")
    axes.set(xlabel="height/h_rms", ylabel="density")
    axes.legend()


def _by_pressure(
    axes: Any, answers: Mapping[str, Any], simulated: Any, what: str, scatter: str
) -> None:
    for name, found in answers.items():
        pressure = found["pressure"]
        value = found[what]
        width = found[scatter]
        # MBMA's sum of island areas may exceed 1
        held = (
            np.isfinite(pressure)
            & (found["area"] > 1e-4)
            & (found["area"] <= 1)
            & (pressure > 0)
        )
        (line,) = axes.plot(pressure[held], value[held], label=theory_label(name))
        band = held & np.isfinite(width)
        times = np.exp(width)
        low, high = (
            (value / times, value * times)
            if what == "area"
            else (value - width, value + width)
        )
        axes.fill_between(
            pressure[band], low[band], high[band], alpha=0.2, color=line.get_color(), lw=0
        )
    if simulated is not None:
        axes.plot(
            simulated["pressure"],
            simulated[what],
            "ko",
            ms=4,
            mfc="none",
            label="boundary elements, this map",
        )
    axes.grid(True, which="major", alpha=0.3)


def table_of_loads(
    surface: MeasuredSurface, E_star: float = 1.0, theory: str | UserTheory | None = None
) -> tuple[dict[str, Any], list[str]]:
    """Columns of a theory's results at a few contact areas, and text lines on those omitted or not valid."""
    from mbma_tables.contacts.contact import contact

    def contacts(some: FloatArray) -> str:
        return f"contact of {', '.join(f'{area:g}' for area in some)}"

    areas = AREAS
    told = []
    try:
        found = contact(surface, E_star, area=areas, theory=theory)
    except OutOfRangeError as fault:
        if fault.mask is None or np.all(fault.mask):
            raise
        areas = AREAS[~fault.mask]
        told = [f"{contacts(AREAS[fault.mask])} left out: {fault}"]
        found = contact(surface, E_star, area=areas, theory=theory)
    # curves of unusual maps skip some contact areas
    reached = np.abs(np.asarray(found.area) / areas - 1) < REACHED
    if not reached.all():
        told.append(
            f"{contacts(areas[~reached])} omitted: the map's curve does not reach it"
        )
    names = (
        "area",
        "pressure",
        "mean_separation",
        "stiffness",
        "area_scatter",
        "scatter",
    )
    columns: dict[str, Any] = {
        name: np.asarray(getattr(found, name))[reached] for name in names
    }
    reasons = found.reasons
    chosen = resolve(theory, surface, "area")
    everywhere = chosen.departures(surface)
    told += [
        f"table: {entry['told']}"
        for entry in chosen.surface_of(surface).provenance
        if entry.get("chosen")
    ]
    told += [
        f"not valid at {contacts(areas[m])}: {text}"
        for text, m in reasons.items()
        if text not in everywhere
    ]
    return columns | {
        "valid": ["yes" if valid else "no" for valid in np.asarray(found.valid)[reached]]
    }, told
