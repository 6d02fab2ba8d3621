"""Further commands on maps with a lay: `tangential` and `film`."""

from collections.abc import Iterable, Iterator
from typing import Any

import click
import numpy as np
from scipy.optimize import least_squares
from scipy.sparse.linalg import LinearOperator, cg

from generate.boundary_elements.run import of_contacts
from generate.boundary_elements.solve import Contact
from generate.calibrated_file import rms, write_part
from generate.machined.makers import GRADIENT, finished, rough
from mbma_tables import Surface, flow_factors
from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.leakage import shipped_flow
from mbma_tables.data import FILE
from mbma_tables.quantities.effective_medium import wide_gap
from mbma_tables.quantities.lay import CONSTANTS, factors, stress_shares
from mbma_tables.surfaces.bearing_curve import bearing
from mbma_tables.theories.simulated.reynolds import flow_and_couette

POINTS, SHORTEST, LONGEST = 256, 8.0, 64.0
# F/(A0 E* g) at 2% to 40% contact; surfaces by lay, Hurst exponent and seed
LOADS, NUS = (0.008, 0.02, 0.05, 0.11, 0.2), (0.3, 0.5)
SETS = {
    "fitted": [(lay, hurst, seed) for lay in (1.0, 2.0, 4.0, 8.0) for hurst in (0.5, 0.8) for seed in (1, 2)],
    "held out": [(lay, hurst, 10 + n) for n, lay in enumerate((1.0, 1.5, 3.0, 6.0, 8.0)) for hurst in (0.4, 0.65, 0.9)],
}
LAYS, FILM_HURSTS, FILM_SEEDS = (1.0, 1.5, 3.0, 4.0, 8.0), (0.5, 0.8), (41, 42)
FILM_LOADS = (0.0015, 0.008, 0.03, 0.08, 0.14)  # 0.4% to 30% contact
ABOVE = (1.02, 1.15, 1.5, 2.0, 3.0)  # mean gaps over the highest point
FILM_AREAS = ((0.0, 0.0), (1e-9, 0.01), (0.01, 0.03), (0.05, 0.1), (0.15, 0.22))


def pressed(recipes: Iterable[tuple[float, float, int]]) -> Iterator[tuple[Any, FloatArray, Contact]]:
    """Gaussian maps by lay, Hurst exponent and seed, and the contact of each."""
    for lay, hurst, seed in recipes:
        rng = np.random.default_rng(seed)
        z = finished(rough(rng, POINTS, min(LONGEST, POINTS / lay), SHORTEST, hurst, lay), SHORTEST)
        yield lay, z, Contact(z, (POINTS, POINTS), 1e-5)


def mean_traction(kernel: FloatArray, inverse: FloatArray, mask: FloatArray, direction: int) -> float:
    """Mean traction along an axis that moves the masked points by 1 along it and by 0 along others.

    `kernel` and its `inverse` have shape (n, n, points, points): compliances of n components in Fourier space.
    """
    shape = (len(kernel), *mask.shape)

    def applied(matrix: FloatArray) -> LinearOperator:
        def product(x: FloatArray) -> FloatArray:
            moved = np.einsum("ij...,j...->i...", matrix, np.fft.fft2(x.reshape(shape)))
            return np.asarray(mask * np.fft.ifft2(moved).real).ravel()

        return LinearOperator((np.prod(shape),) * 2, matvec=product, dtype=float)

    wanted = np.zeros(shape)
    wanted[direction] = mask
    found, failed = cg(applied(kernel), wanted.ravel(), rtol=1e-6, maxiter=2000, M=applied(inverse))
    if failed:
        raise RuntimeError("conjugate gradients have not reached 1e-6 in 2000 steps")
    return float(found.reshape(shape)[direction].mean())


def shares(mask: FloatArray) -> dict[float, tuple[float, float]]:
    """c of `quantities.lay` along axis 0 and along axis 1 for each of `NUS`, from (1 - nu)/(1 - nu c) = k_t/k_n.

    Both stiffnesses are of one contact area, kept fixed. In Fourier space the compliances are (1 - nu)/(G q) and
    (1/(G q)) (1 - nu k k^T), k the direction of the wavevector; normal and tangential displacements are not coupled.
    """
    k = np.stack(np.meshgrid(*2 * [2 * np.pi * np.fft.fftfreq(POINTS)], indexing="ij"))
    q = np.hypot(*k)
    q[0, 0] = 1.0
    held = np.hypot(*k) > 0
    both, twice = np.eye(2)[..., None, None], (k / q)[:, None] * (k / q)[None]
    found = {}
    for nu in NUS:
        normal = mean_traction(((1 - nu) * held / q)[None, None], (held * q / (1 - nu))[None, None], mask, 0)
        sheared = held / q * (both - nu * twice), held * q * (both + nu / (1 - nu) * twice)
        ratios = [mean_traction(*sheared, mask, axis) / normal for axis in (0, 1)]
        along, across = ((1 - (1 - nu) / ratio) / nu for ratio in ratios)
        found[nu] = along, across
    return found


def tangential_rows(kind: str) -> FloatArray:
    """Columns for each surface, load and nu: anisotropy, contact, nu, shares c along and across; shape (5, n)."""
    found = []
    for _, surface, solved in pressed(SETS[kind]):
        anisotropy = bearing(surface, (1.0, 1.0)).anisotropy
        for load in LOADS:
            area = solved.press(load * GRADIENT)["area"]
            each = shares((solved.traction > 0).astype(float))
            found += [(anisotropy, area, nu, *both) for nu, both in each.items()]
    return np.array(found).T


def tangential_errors(constants: FloatArray, known: FloatArray) -> FloatArray:
    """ln(law/simulation) of k_t/k_n along and across, one after the other."""
    anisotropy, area, nu, *simulated = known
    law = stress_shares(anisotropy, area, nu, constants)
    both = [np.log((1 - nu * other) / (1 - nu * own)) for own, other in zip(law, simulated, strict=True)]
    return np.concatenate(both)


@click.command()
def tangential() -> None:
    """Stiffness ratios of stuck contacts by boundary elements, for docs/joints.md: two minutes a set of surfaces.

    The constants of `mbma_tables.quantities.lay` are fitted to the first set; the second has other seeds, Hurst
    exponents and lays.
    """
    known = {kind: tangential_rows(kind) for kind in SETS}
    recipes = [(*one, load, kind == "fitted") for kind in SETS for one in SETS[kind] for load in LOADS for _ in NUS]
    anisotropy, area, nu, *stresses = np.concatenate([*known.values()], axis=1)
    columns = [*np.transpose(recipes), anisotropy, area, nu, *((1 - nu) / (1 - nu * c) for c in stresses)]
    write_part(FILE, of_contacts("tangential", columns), "tangential")
    fitted = least_squares(tangential_errors, CONSTANTS, args=(known["fitted"],)).x
    click.echo(f"constants {' '.join(f'{value:.3f}' for value in fitted)}; kept {CONSTANTS}")
    for kind, each in known.items():
        off = np.abs(tangential_errors(np.array(CONSTANTS), each))
        largest = ", ".join(f"{off[np.tile(each[2], 2) == nu].max():.3f} at nu = {nu}" for nu in NUS)
        within = f"within 3%: {np.mean(off < 0.03):.3f}"
        click.echo(f"{kind}: {off.size} numbers, rms {rms(off):.4f}, largest {largest}, {within}")


def film_rows() -> FloatArray:
    """Columns: lay, gamma, u/h_rms, A/A0, phi and phi_s along and across, phi by `flow_factors`; shape (10, n)."""
    found = []
    k = np.meshgrid(*2 * [np.fft.fftfreq(POINTS)], indexing="ij")
    squared = k[0] ** 2 + k[1] ** 2
    squared[0, 0] = 1.0
    recipes = ((lay, hurst, seed) for lay in LAYS for hurst in FILM_HURSTS for seed in FILM_SEEDS)
    for lay, z, solved in pressed(recipes):
        power, h_rms = np.abs(np.fft.fft2(z)) ** 2, z.std()
        gamma = np.sum(power * k[1] ** 2 / squared) / np.sum(power * k[0] ** 2 / squared)
        gaps = [(0.0, share * z.max() - z) for share in ABOVE]
        gaps += [(solved.press(load * GRADIENT)["area"], solved.gap) for load in FILM_LOADS]
        quick = flow_factors(Surface.from_map(z, 1.0, periodic=True), [gap.mean() for _, gap in gaps])
        for (area, gap), phi in zip(gaps, np.stack([quick.phi_x, quick.phi_y], axis=1), strict=True):
            u = gap.mean()
            K, couette = flow_and_couette(gap, (POINTS, POINTS))
            found.append((lay, gamma, u / h_rms, area, *K / u**3, *(u - couette) / h_rms, *phi))
    return np.array(found).T


@click.command()
def film() -> None:
    """Flow factors against Reynolds' equation on simulated gaps, for docs/lubrication.md: six minutes.

    No constant of `mbma_tables.quantities.lay` was fitted to these surfaces.
    """
    lay, gamma, u, area, *columns = film_rows()
    flow, sheared, whole = np.reshape(columns, (3, 2, -1))
    ratio, shear = factors(u, area, gamma, shipped_flow().constants)
    click.echo("ln(medium/simulation), root mean square and largest; of phi before contact, in contact its lay alone")
    for (low, high), stretch in ((ends, stretch) for ends in FILM_AREAS for stretch in LAYS):
        mine = (lay == stretch) & (area >= low) & (area <= high)
        with np.errstate(divide="ignore", invalid="ignore"):
            alike = np.sqrt(flow[0, mine] * flow[1, mine])
            medium = ratio[:, mine] * wide_gap(u)[mine]
            if high > 0:
                medium = ratio[:, mine] * alike / np.sqrt(ratio[0, mine] * ratio[1, mine])
            off = {"phi": np.log(medium / flow[:, mine]), "whole phi of the map": np.log(whole / flow)[:, mine]}
            off["phi_s"] = np.log(shear / sheared)[:, mine]
        known = {name: each[np.isfinite(each)] for name, each in off.items()}
        told = ", ".join(f"{name} {rms(each):.3f} {np.abs(each).max():.3f}" for name, each in known.items())
        near = f"u {u[mine].min():.2f} to {u[mine].max():.2f}, phi near {np.exp(np.mean(np.log(alike + 1e-300))):.2f}"
        click.echo(f"A {low:g} to {high:g}, lay {stretch:g}: {told}, {near}")
