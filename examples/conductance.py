"""Contact stiffness and thermal contact conductance of a machined joint against its nominal pressure.

Barber (2003), "Bounds on the electrical resistance between contacting elastic rough bodies", Proc. R. Soc. A 459,
53-66: the conductance of a contact between two half-spaces and its incremental stiffness solve the same potential
problem. With F the normal force, delta the approach of the two bodies, E* the effective modulus and rho1, rho2 the
resistivities (for heat 1/k1 and 1/k2, inverse conductivities),

    1/R = 2/((rho1 + rho2) E*) dF/d(delta),

whatever the shape of the contact. A circular spot of radius a shows the constant: dF/d(delta) = 2 a E* and
1/R = 4 a/(rho1 + rho2). Per nominal area, with k_s = 2 k1 k2/(k1 + k2), p = F/A0 and the bodies' distance measured
by the mean separation u, whose change is the approach,

    h = -(k_s/E*) dp/du,      -dp/du = 2 (-dp/dd), as u = (h_max + d)/2 (50).

Only what flows through the solid contact is counted, no gas, no radiation.
Run with ``python examples/conductance.py``. SI units: m, Pa, W/(m K).
"""

from __future__ import annotations

import dataclasses
import pathlib

import click
import numpy as np
from matplotlib.figure import Figure

from mbma_tables import Surface, contact_law
from mbma_tables.materials import effective_modulus
from mbma_tables.totals.conductance import conductance, mean_conductivity

PICTURE = pathlib.Path(__file__).parents[1] / "docs" / "figures" / "example_conductance.png"
# both faces' roughness in one, a ground steel face on aluminium
JOINT = Surface(hurst=0.8, q0=2 * np.pi / 1e-3, q1=2 * np.pi / 2e-6, h_rms=1e-6, h_max=3.5e-6)
E_STAR = float(effective_modulus(210e9, 0.3, 70e9, 0.33))  # Pa
K_STEEL, K_ALUMINIUM = 16.0, 167.0  # W/(m K)
K_MEAN = float(mean_conductivity(K_STEEL, K_ALUMINIUM))
RANGE = (1e4, 5e7)  # Pa
PRESSURES = (1e4, 1e5, 1e6, 1e7, 5e7)  # Pa


@dataclasses.dataclass(frozen=True)
class Curve:
    """Stiffness, conductance and their slope in logarithms against pressure."""

    pressure: np.ndarray  # Pa
    stiffness: np.ndarray  # -dp/du, Pa/m
    conductance: np.ndarray  # W/(m^2 K)
    slope: np.ndarray  # d log(h)/d log(p)


def conductance_curve(points: int = 200) -> Curve:
    """Along the pressures of RANGE."""
    law = contact_law(JOINT, E_star=E_STAR)
    pressure = np.geomspace(*RANGE, points)
    stiffness = law.stiffness_mean(law.separation(force=pressure))
    h = conductance(stiffness, K_MEAN, E_STAR)
    slope = np.gradient(np.log(h), np.log(pressure))
    return Curve(pressure, stiffness, h, slope)


def draw(curve: Curve) -> Figure:
    """Conductance against pressure, logarithmic, and its slope below."""
    figure = Figure(figsize=(7, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    upper.loglog(curve.pressure / 1e6, curve.conductance, label="thermal contact conductance h")
    upper.set_ylabel("h [W/(m^2 K)]")
    # the same curve in another unit
    factor = K_MEAN / E_STAR * 1e15
    right = upper.secondary_yaxis("right", functions=(lambda h: h / factor, lambda k: k * factor))
    right.set_ylabel("stiffness -dp/du [GPa/um]")
    upper.grid(True, alpha=0.3)
    lower.semilogx(curve.pressure / 1e6, curve.slope)
    lower.axhline(1, color="grey", linestyle="--", label="proportional")
    lower.set(xlabel="nominal pressure p [MPa]", ylabel="d log h/d log p")
    lower.legend()
    return figure


def main(out: pathlib.Path = PICTURE, points: int = 200) -> Curve:
    """Compute, print and draw."""
    curve = conductance_curve(points)
    click.echo(f"E* = {E_STAR / 1e9:.2f} GPa, k_s = {K_MEAN:.2f} W/(m K), h = -(k_s/E*) dp/du")
    click.echo("p [MPa]   -dp/du [GPa/um]   h [W/(m^2 K)]   d log h/d log p")
    for p in PRESSURES:
        at = np.argmin(np.abs(np.log(curve.pressure / p)))
        row = (curve.pressure[at] / 1e6, curve.stiffness[at] / 1e15, curve.conductance[at], curve.slope[at])
        click.echo("{:7.2f}   {:15.4g}   {:13.5g}   {:15.3f}".format(*row))
    exponent = np.polyfit(np.log(curve.pressure), np.log(curve.conductance), 1)[0]
    click.echo(f"h ~ p^{exponent:.3f} over the whole range")
    draw(curve).savefig(out, dpi=120)
    return curve


if __name__ == "__main__":
    main()
