"""Flow factors against Reynolds' equation on simulated gaps: ``python -m generate.machined.film``.

Gaussian surfaces with lays up to 8:1; five mean gaps above contact, and five loads on which Tamaas deforms the faces.
No constant of `mbma_tables.laws.lay` was fitted to them; six minutes on one core.
"""

import click
import numpy as np

from generate.boundary_elements.tamaas_contact import Contact
from generate.machined.makers import GRADIENT, finished, rough
from mbma_tables import Surface, flow_factors
from mbma_tables.answers.leakage import shipped_flow
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.effective_medium import wide_gap
from mbma_tables.laws.lay import factors
from mbma_tables.laws.reynolds import flow_and_couette

POINTS, SHORTEST, LONGEST = 256, 8.0, 64.0
LAYS, HURSTS, SEEDS = (1.0, 1.5, 3.0, 4.0, 8.0), (0.5, 0.8), (41, 42)
LOADS = (0.0015, 0.008, 0.03, 0.08, 0.14)  # F/(A0 E* g): 0.4% to 30% contact
ABOVE = (1.02, 1.15, 1.5, 2.0, 3.0)  # mean gaps over the highest point
AREAS = ((0.0, 0.0), (1e-9, 0.01), (0.01, 0.03), (0.05, 0.1), (0.15, 0.22))


def rows() -> FloatArray:
    """Columns: lay, gamma, u/h_rms, A/A0, phi and phi_s along and across, phi by `flow_factors`; shape (10, n)."""
    found = []
    k = np.meshgrid(*2 * [np.fft.fftfreq(POINTS)], indexing="ij")
    squared = k[0] ** 2 + k[1] ** 2
    squared[0, 0] = 1.0
    for lay, hurst, seed in ((lay, hurst, seed) for lay in LAYS for hurst in HURSTS for seed in SEEDS):
        rng = np.random.default_rng(seed)
        z = finished(rough(rng, POINTS, min(LONGEST, POINTS / lay), SHORTEST, hurst, lay), SHORTEST)
        power, h_rms = np.abs(np.fft.fft2(z)) ** 2, z.std()
        gamma = np.sum(power * k[1] ** 2 / squared) / np.sum(power * k[0] ** 2 / squared)
        solved = Contact(z, (POINTS, POINTS), 1e-5)
        gaps = [(0.0, share * z.max() - z) for share in ABOVE]
        gaps += [(solved.press(load * GRADIENT)["area"], solved.gap) for load in LOADS]
        quick = flow_factors(Surface.from_map(z, 1.0, periodic=True), [gap.mean() for _, gap in gaps])
        for (area, gap), phi in zip(gaps, np.stack([quick.phi_x, quick.phi_y], axis=1), strict=True):
            u = gap.mean()
            K, couette = flow_and_couette(gap, (POINTS, POINTS))
            found.append((lay, gamma, u / h_rms, area, *K / u**3, *(u - couette) / h_rms, *phi))
    return np.array(found).T


if __name__ == "__main__":
    lay, gamma, u, area, *simulated = rows()
    whole = np.array(simulated[4:])
    ratio, shear = factors(u, area, gamma, shipped_flow().constants)
    plain = wide_gap(u)
    click.echo("ln(medium/simulation), root mean square and largest; of phi before contact, in contact its lay alone")
    for low, high in AREAS:
        for stretch in LAYS:
            mine = (lay == stretch) & (area >= low) & (area <= high)
            alike = np.exp(np.mean(np.log(simulated[0][mine] * simulated[1][mine] + 1e-300)) / 2)
            known = plain[mine] if high == 0 else np.sqrt(simulated[0][mine] * simulated[1][mine])
            own = ratio[:, mine] if high == 0 else ratio[:, mine] / np.sqrt(ratio[0, mine] * ratio[1, mine])
            with np.errstate(divide="ignore", invalid="ignore"):
                off = np.log(own * known / np.array(simulated[:2])[:, mine])
                total = np.log(whole[:, mine] / np.array(simulated[:2])[:, mine])
                slid = np.log(shear[:, mine] / np.array(simulated[2:4])[:, mine])
            off, total = off[np.isfinite(off)], total[np.isfinite(total)]
            click.echo(
                f"A {low:g} to {high:g}, lay {stretch:g}: phi {np.sqrt(np.mean(off**2)):.3f} {np.abs(off).max():.3f}, "
                f"whole phi of the map {np.sqrt(np.mean(total**2)):.3f} {np.abs(total).max():.3f}, "
                f"phi_s {np.sqrt(np.mean(slid**2)):.3f} {np.abs(slid).max():.3f}, u {u[mine].min():.2f} to "
                f"{u[mine].max():.2f}, phi near {alike:.2f}"
            )
