"""Further commands on maps with a lay: `tangential` and `film`."""

import itertools
from collections.abc import Iterable, Iterator

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
from mbma_tables.contacts.quantities.effective_medium import wide_gap
from mbma_tables.contacts.quantities.lay import CONSTANTS, factors, stress_shares
from mbma_tables.contacts.quantities.leakage import shipped_flow
from mbma_tables.surfaces.bearing_curve import bearing
from mbma_tables.theories.dataset import FILE
from mbma_tables.theories.simulated.reynolds import flow_and_couette

Recipe = tuple[float, float, int]  # lay, Hurst exponent and seed

POINTS = 256
SHORTEST = 8.0
LONGEST = 64.0
LOADS = (0.008, 0.02, 0.05, 0.11, 0.2)  # F/(A0 E* g) at 2% to 40% contact
NUS = (0.3, 0.5)
# surfaces by lay, Hurst exponent and seed
SETS = {
    "fitted": list(itertools.product((1.0, 2.0, 4.0, 8.0), (0.5, 0.8), (1, 2))),
    "held out": [
        (lay, hurst, seed)
        for lay, seed in ((1.0, 10), (1.5, 11), (3.0, 12), (6.0, 13), (8.0, 14))
        for hurst in (0.4, 0.65, 0.9)
    ],
}
LAYS = (1.0, 1.5, 3.0, 4.0, 8.0)
FILM_HURSTS = (0.5, 0.8)
FILM_SEEDS = (41, 42)
FILM_LOADS = (0.0015, 0.008, 0.03, 0.08, 0.14)  # 0.4% to 30% contact
ABOVE = (1.02, 1.15, 1.5, 2.0, 3.0)  # mean gaps over the highest point
FILM_AREAS = ((0.0, 0.0), (1e-9, 0.01), (0.01, 0.03), (0.05, 0.1), (0.15, 0.22))


def pressed(recipes: Iterable[Recipe]) -> Iterator[tuple[float, FloatArray, Contact]]:
    """Gaussian maps by lay, Hurst exponent and seed, and the contact of each."""
    for lay, hurst, seed in recipes:
        rng = np.random.default_rng(seed)
        # no wave is longer than the side after it is stretched
        unfinished = rough(rng, POINTS, min(LONGEST, POINTS / lay), SHORTEST, hurst, lay)
        z = finished(unfinished, SHORTEST)
        yield lay, z, Contact(z, (POINTS, POINTS), 1e-5)


def mean_traction(
    kernel: FloatArray,
    inverse: FloatArray,
    mask: FloatArray,
    direction: int,
) -> float:
    """Mean traction along an axis that moves the masked points by 1 along it and by 0 along others.

    `kernel` and its `inverse` have shape (n, n, points, points): compliances of n components in
    Fourier space.
    """
    shape = (len(kernel), *mask.shape)

    def applied(matrix: FloatArray) -> LinearOperator:
        def product(x: FloatArray) -> FloatArray:
            moved = np.einsum("ij...,j...->i...", matrix, np.fft.fft2(x.reshape(shape)))
            return np.asarray(mask * np.fft.ifft2(moved).real).ravel()

        return LinearOperator((np.prod(shape),) * 2, matvec=product, dtype=float)

    displacement = np.zeros(shape)
    displacement[direction] = mask
    # the inverse for the whole face is near enough, on the mask, to precondition
    traction, failed = cg(
        applied(kernel),
        displacement.ravel(),
        rtol=1e-6,
        maxiter=2000,
        M=applied(inverse),
    )
    if failed:
        raise RuntimeError("conjugate gradients have not reached 1e-6 in 2000 steps")
    return float(traction.reshape(shape)[direction].mean())


def shares(mask: FloatArray) -> dict[float, tuple[float, float]]:
    """c of `quantities.lay` along axis 0 and along axis 1 for each of `NUS`.

    From (1 - nu)/(1 - nu c) = k_t/k_n, both stiffnesses of one contact area that does not change.
    In Fourier space the compliances are (1 - nu)/(G q) and (1/(G q)) (1 - nu k k^T), k the
    direction of the wavevector; normal and tangential displacements are not coupled.
    """
    wavenumbers = 2 * np.pi * np.fft.fftfreq(POINTS)
    k = np.stack(np.meshgrid(wavenumbers, wavenumbers, indexing="ij"))
    q = np.hypot(*k)
    # the mean has no compliance
    has_compliance = q > 0
    q[0, 0] = 1.0
    identity = np.eye(2)[..., None, None]
    direction = (k / q)[:, None] * (k / q)[None]  # k k^T
    by_nu = {}
    for nu in NUS:
        normal_kernel = ((1 - nu) * has_compliance / q)[None, None]
        normal_inverse = (has_compliance * q / (1 - nu))[None, None]
        normal = mean_traction(normal_kernel, normal_inverse, mask, 0)
        kernel = has_compliance / q * (identity - nu * direction)
        inverse = has_compliance * q * (identity + nu / (1 - nu) * direction)
        c_of_axes = []
        for axis in (0, 1):
            ratio = mean_traction(kernel, inverse, mask, axis) / normal
            c_of_axes.append((1 - (1 - nu) / ratio) / nu)
        by_nu[nu] = (c_of_axes[0], c_of_axes[1])
    return by_nu


def tangential_rows(kind: str) -> FloatArray:
    """Columns for each surface, load and nu, shape (5, n).

    They are anisotropy, contact, nu, shares c along and across.
    """
    rows = []
    for _, surface, engine in pressed(SETS[kind]):
        anisotropy = bearing(surface, (1.0, 1.0)).anisotropy
        for load in LOADS:
            area = engine.press(load * GRADIENT)["area"]
            touching = (engine.traction > 0).astype(float)
            for nu, (along, across) in shares(touching).items():
                rows.append((anisotropy, area, nu, along, across))
    return np.array(rows).T


def tangential_errors(constants: FloatArray, rows: FloatArray) -> FloatArray:
    """ln(law/simulation) of k_t/k_n along and across, one after the other.

    `rows` as of `tangential_rows`.
    """
    anisotropy, area, nu, *simulated = rows
    law = stress_shares(anisotropy, area, nu, constants)
    of_axes = []
    for c_of_law, c_simulated in zip(law, simulated, strict=True):
        of_axes.append(np.log((1 - nu * c_simulated) / (1 - nu * c_of_law)))
    return np.concatenate(of_axes)


def recipes_of_rows() -> list[tuple[float | bool, ...]]:
    """Lay, Hurst exponent, seed, load and whether fitted, of each row of all sets."""
    recipes: list[tuple[float | bool, ...]] = []
    for kind, surfaces in SETS.items():
        for surface, load in itertools.product(surfaces, LOADS):
            recipes += [(*surface, load, kind == "fitted")] * len(NUS)
    return recipes


@click.command()
def tangential() -> None:
    """Stiffness ratios of stuck contacts by boundary elements, for docs/joints.md: two minutes a set of surfaces.

    The constants of `mbma_tables.contacts.quantities.lay` are fitted to the first set; the second
    has other seeds, Hurst exponents and lays.
    """
    rows_of_sets = {kind: tangential_rows(kind) for kind in SETS}
    anisotropy, area, nu, *shares_c = np.concatenate([*rows_of_sets.values()], axis=1)
    stiffness_ratios = [(1 - nu) / (1 - nu * c) for c in shares_c]
    columns = [*np.transpose(recipes_of_rows()), anisotropy, area, nu, *stiffness_ratios]
    write_part(FILE, of_contacts("tangential", columns), "tangential")
    fitted = least_squares(tangential_errors, CONSTANTS, args=(rows_of_sets["fitted"],)).x
    click.echo(
        f"constants {' '.join(f'{value:.3f}' for value in fitted)}; kept {CONSTANTS}"
    )
    for kind, rows in rows_of_sets.items():
        off = np.abs(tangential_errors(np.array(CONSTANTS), rows))
        # errors are those along, then those across
        nu_of_errors = np.tile(rows[2], 2)
        by_nu = [f"{off[nu_of_errors == nu].max():.3f} at nu = {nu}" for nu in NUS]
        within = f"within 3%: {np.mean(off < 0.03):.3f}"
        largest = f"largest {', '.join(by_nu)}"
        click.echo(f"{kind}: {off.size} numbers, rms {rms(off):.4f}, {largest}, {within}")


def length_ratio(z: FloatArray) -> float:
    """How much longer waves of a map are along the first axis than across it."""
    k = np.meshgrid(np.fft.fftfreq(POINTS), np.fft.fftfreq(POINTS), indexing="ij")
    squared = k[0] ** 2 + k[1] ** 2
    squared[0, 0] = 1.0
    power = np.abs(np.fft.fft2(z)) ** 2
    along = np.sum(power * k[0] ** 2 / squared)
    return float(np.sum(power * k[1] ** 2 / squared) / along)


def film_gaps(
    z: FloatArray, engine: Contact, loads: Iterable[float]
) -> list[tuple[float, FloatArray]]:
    """Contact fractions and gaps of a map: above its highest point, then pressed."""
    gaps = [(0.0, share * z.max() - z) for share in ABOVE]
    for load in loads:
        area = engine.press(load * GRADIENT)["area"]
        gaps.append((area, engine.gap))
    return gaps


def film_rows() -> FloatArray:
    """Columns of every surface and gap, shape (10, n).

    They are lay, gamma, u/h_rms, A/A0, phi and phi_s along and across, and phi by `flow_factors`.
    """
    rows = []
    for lay, z, engine in pressed(itertools.product(LAYS, FILM_HURSTS, FILM_SEEDS)):
        h_rms = z.std()
        gamma = length_ratio(z)
        gaps = film_gaps(z, engine, FILM_LOADS)
        face = Surface.from_map(z, 1.0, periodic=True)
        quick = flow_factors(face, [gap.mean() for _, gap in gaps])
        phi_of_map = np.stack([quick.phi_x, quick.phi_y], axis=1)
        for (area, gap), phi in zip(gaps, phi_of_map, strict=True):
            u = gap.mean()
            K, couette = flow_and_couette(gap, (POINTS, POINTS))
            rows.append(
                (lay, gamma, u / h_rms, area, *K / u**3, *(u - couette) / h_rms, *phi)
            )
    return np.array(rows).T


@click.command()
def film() -> None:
    """Flow factors against Reynolds' equation on simulated gaps, for docs/leakage.md: six minutes.

    No constant of `mbma_tables.contacts.quantities.lay` was fitted to these surfaces.
    """
    lay, gamma, u, area, *columns = film_rows()
    flow, sheared, whole = np.reshape(columns, (3, 2, -1))
    ratio, shear = factors(u, area, gamma, shipped_flow().constants)
    click.echo(
        "ln(medium/simulation), root mean square and largest; of phi before contact, in contact its lay alone",
    )
    for (low, high), stretch in itertools.product(FILM_AREAS, LAYS):
        chosen = (lay == stretch) & (area >= low) & (area <= high)
        with np.errstate(divide="ignore", invalid="ignore"):
            isotropic = np.sqrt(flow[0, chosen] * flow[1, chosen])
            medium = ratio[:, chosen] * wide_gap(u)[chosen]
            if high > 0:
                # in contact: the medium's ratio of both axes at the simulated mean of both
                medium = (
                    ratio[:, chosen]
                    * isotropic
                    / np.sqrt(ratio[0, chosen] * ratio[1, chosen])
                )
            errors = {
                "phi": np.log(medium / flow[:, chosen]),
                "whole phi of the map": np.log(whole / flow)[:, chosen],
                "phi_s": np.log(shear / sheared)[:, chosen],
            }
        texts = []
        for name, error in errors.items():
            finite = error[np.isfinite(error)]
            texts.append(f"{name} {rms(finite):.3f} {np.abs(finite).max():.3f}")
        # blocked surfaces have phi = 0
        phi = np.exp(np.mean(np.log(isotropic + 1e-300)))
        near = f"u {u[chosen].min():.2f} to {u[chosen].max():.2f}, phi near {phi:.2f}"
        click.echo(f"A {low:g} to {high:g}, lay {stretch:g}: {', '.join(texts)}, {near}")
