"""Thermal contact conductance of a real joint, ground steel on milled aluminium, with its band of uncertainty.

Barber (2003), "Bounds on the electrical resistance between contacting elastic rough
bodies", Proc. R. Soc. A 459, 53-66: the conductance of a contact between two half-spaces
and its incremental stiffness solve the same potential problem. Per nominal area, with k_s =
2 k1 k2/(k1 + k2), p = F/A0 and the mean separation u,

    h = -(k_s/E*) dp/du.

The aluminium yields: pressures end at its hardness, and the stiffness that counts is that
of the contact area as it is, since yielded points unload elastically. The slope of the
loading curve would give too little. The band holds the range of hardnesses of the alloy,
whose temper is not known, and one standard deviation of boundary elements about the law.

Only what flows through the solid contact is counted, no gas, no radiation.
Run with ``python examples/conductance.py``. SI units: m, Pa, W/(m K).
"""

import dataclasses
import pathlib

import click
import numpy as np
from matplotlib.figure import Figure

from mbma_tables import Bodies, Surface, contact, materials
from mbma_tables.bodies.bodies import mean_conductivity
from mbma_tables.common.plots import to_picture
from mbma_tables.contacts.quantities.conductances import cooper_mikic_yovanovich

# both faces' roughness in one: wavelengths from 1 mm to 8 um
JOINT = Surface(
    hurst=0.8, q0=2 * np.pi / 1e-3, q1=2 * np.pi / 8e-6, h_rms=1.5e-6, h_max=5.5e-6
)
STEEL = materials.get("steel 4140")
ALUMINIUM = materials.get("aluminium 6061")
E_STAR = float(
    materials.effective_modulus(STEEL.E * 1e9, STEEL.nu, ALUMINIUM.E * 1e9, ALUMINIUM.nu)
)  # Pa
SOFT, HARD = (1e9 * hardness for hardness in ALUMINIUM.hardness)
K_STEEL = STEEL.conductivity[0]
K_ALUMINIUM = float(np.mean(ALUMINIUM.conductivity))
K_MEAN = float(mean_conductivity(K_STEEL, K_ALUMINIUM))
RANGE = (1e5, 5e7)  # Pa
PRESSURES = (1e5, 1e6, 1e7, 5e7)  # Pa


@dataclasses.dataclass(frozen=True)
class Curve:
    """Against pressure: conductance and its band, the elastic one, and two older correlations."""

    pressure: np.ndarray  # Pa
    stiffness: np.ndarray  # incremental, Pa/m
    conductance: np.ndarray  # W/(m^2 K), as all that follow
    low: np.ndarray
    high: np.ndarray
    elastic: np.ndarray
    loading_slope: np.ndarray
    plastic_correlation: np.ndarray
    elastic_correlation: np.ndarray


def conductance_curve(points: int = 200) -> Curve:
    """Along the pressures of RANGE, at the middle hardness and at both ends."""
    pressure = np.geomspace(*RANGE, points)
    middle = np.sqrt(SOFT * HARD)
    joints = {
        hardness: contact(
            JOINT,
            Bodies(E_STAR, hardness=hardness),
            pressure=pressure,
            theory="calibrated",
        )
        for hardness in (SOFT, middle, HARD, np.inf)
    }
    h = {
        p_m: K_MEAN / E_STAR * found.unloading_stiffness for p_m, found in joints.items()
    }
    # of the stiffness at a pressure, as h is: `scatter` is that of the force at a gap
    spread = np.exp(joints[middle].unloading_stiffness_scatter)
    slope = np.sqrt(2 * JOINT.m2 / np.pi)
    return Curve(
        pressure,
        joints[middle].unloading_stiffness,
        h[middle],
        h[HARD] / spread,
        h[SOFT] * spread,
        h[np.inf],
        K_MEAN / E_STAR * joints[middle].stiffness,
        cooper_mikic_yovanovich(JOINT, pressure, K_MEAN, E_STAR, middle),
        1.55
        * K_MEAN
        * slope
        / JOINT.h_rms
        * (np.sqrt(2) * pressure / (slope * E_STAR)) ** 0.94,
    )


def draw(curve: Curve) -> Figure:
    """Conductance over pressure: nearly in proportion, their ratio shows the differences."""
    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    p = curve.pressure / 1e6
    lines = {
        "calibrated law, the aluminium yields": (curve.conductance, "C0-"),
        "calibrated law, elastic": (curve.elastic, "C1--"),
        "slope of the loading curve in place of unloading": (curve.loading_slope, "C2:"),
        "Cooper, Mikic, Yovanovich 1969 (plastic)": (curve.plastic_correlation, "k-."),
        "Mikic 1974 (elastic)": (curve.elastic_correlation, "C7-."),
    }
    for label, (h, style) in lines.items():
        axes.semilogx(p, h / p, style, label=label)
    axes.fill_between(
        p,
        curve.low / p,
        curve.high / p,
        alpha=0.25,
        label="where it yields: tempers of the aluminium and model uncertainty",
    )
    axes.set(
        xlabel="nominal pressure p [MPa]",
        ylabel="conductance over pressure, h/p [W/(m² K MPa)]",
        ylim=(0, None),
    )
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8)
    return figure


def main(out: pathlib.Path | None = None, points: int = 200) -> Curve:
    """Compute, print and draw."""
    curve = conductance_curve(points)
    psi = E_STAR * float(JOINT.rms_gradient) / np.array([HARD, SOFT])
    click.echo(
        f"rms gradient {JOINT.rms_gradient:.3f}, E* = {E_STAR / 1e9:.1f} GPa, k_s = {K_MEAN:.1f} W/(m K)"
    )
    click.echo(
        f"aluminium of {SOFT / 1e9:g} to {HARD / 1e9:g} GPa: psi {psi[1]:.1f} to {psi[0]:.1f}, elastic below 1.1"
    )
    click.echo(
        "p [MPa]   h [W/(m^2 K)]   low        high       elastic    slope      CMY        Mikic"
    )
    columns = (
        "conductance",
        "low",
        "high",
        "elastic",
        "loading_slope",
        "plastic_correlation",
        "elastic_correlation",
    )
    for pressure in PRESSURES:
        at = np.argmin(np.abs(np.log(curve.pressure / pressure)))
        numbers = "   ".join(f"{getattr(curve, name)[at]:<8.3g}" for name in columns)
        click.echo(f"{curve.pressure[at] / 1e6:7.2f}   {numbers}".rstrip())
    if out is not None:
        out.write_bytes(to_picture(draw(curve), out.suffix[1:], outlines=True))
    return curve


@click.command()
@click.option(
    "--points",
    default=200,
    show_default=True,
    type=click.IntRange(min=20),
    help="Pressures.",
)
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(points: int, out: pathlib.Path | None) -> None:
    """Thermal contact conductance of ground steel on aluminium."""
    main(out, points)


if __name__ == "__main__":
    command()
