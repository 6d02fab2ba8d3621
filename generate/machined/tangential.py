"""Stiffness ratios of stuck contacts by boundary elements: ``python -m generate.machined.tangential``.

Normal and tangential stiffness are of one contact area, kept fixed: a uniform displacement of the contact normal to it,
along and across the lay, by conjugate gradients. In Fourier space the compliances are (1 - nu)/(G q) and
(1/(G q)) (1 - nu k k^T), k the direction of the wavevector; normal and tangential displacements are not coupled.
The constants of `mbma_tables.laws.lay` were fitted to the first set of surfaces; the second has other seeds, Hurst
exponents and lays. Two minutes a set on one core.
"""

import click
import numpy as np
from scipy.optimize import least_squares

from generate.boundary_elements.run import of_contacts
from generate.boundary_elements.tamaas_contact import Contact
from generate.calibrated_file import write_part
from generate.machined.makers import GRADIENT, finished, rough
from mbma_tables.common.arguments import FloatArray
from mbma_tables.data import FILE
from mbma_tables.laws.bearing_curve import bearing
from mbma_tables.laws.lay import CONSTANTS, stress_shares

POINTS, SHORTEST, LONGEST = 256, 8.0, 64.0
LOADS = (0.008, 0.02, 0.05, 0.11, 0.2)  # F/(A0 E* g): 2% to 40% contact
NUS = (0.3, 0.5)
SETS = {
    "fitted": [(lay, hurst, seed) for lay in (1.0, 2.0, 4.0, 8.0) for hurst in (0.5, 0.8) for seed in (1, 2)],
    "held out": [(lay, hurst, 10 + n) for n, lay in enumerate((1.0, 1.5, 3.0, 6.0, 8.0)) for hurst in (0.4, 0.65, 0.9)],
}


def _solved(kernel: FloatArray, inverse: FloatArray, mask: FloatArray, direction: int) -> float:
    """Mean traction along an axis that moves the masked points by 1 along it and by 0 along others.

    `kernel` and its `inverse` have shape (n, n, points, points): compliances of n components in Fourier space.
    """

    def applied(matrix: FloatArray, x: FloatArray) -> FloatArray:
        return mask * np.fft.ifft2(np.einsum("ij...,j...->i...", matrix, np.fft.fft2(x))).real

    wanted = np.zeros((len(kernel), *mask.shape))
    wanted[direction] = mask
    x = np.zeros_like(wanted)
    residual = wanted.copy()
    z = applied(inverse, residual)
    step, product = z.copy(), np.sum(residual * z)
    for _ in range(2000):
        moved = applied(kernel, step)
        length = product / np.sum(step * moved)
        x += length * step
        residual -= length * moved
        if np.abs(residual).max() < 1e-5:
            return float(x[direction].mean())
        z = applied(inverse, residual)
        before, product = product, np.sum(residual * z)
        step = z + product / before * step
    raise RuntimeError("conjugate gradients have not reached 1e-5 in 2000 steps")


def shares(mask: FloatArray) -> dict[float, tuple[float, float]]:
    """c of `laws.lay` along axis 0 and along axis 1 for each of `NUS`, from (1 - nu)/(1 - nu c) = k_t/k_n."""
    k = np.stack(np.meshgrid(*2 * [2 * np.pi * np.fft.fftfreq(POINTS)], indexing="ij"))
    q = np.hypot(*k)
    q[0, 0] = 1.0
    held = np.hypot(*k) > 0
    unit = k / q
    both, twice = np.eye(2)[..., None, None], unit[:, None] * unit[None]
    found = {}
    for nu in NUS:
        normal = _solved(((1 - nu) * held / q)[None, None], (held * q / (1 - nu))[None, None], mask, 0)
        sheared = held / q * (both - nu * twice), held * q * (both + nu / (1 - nu) * twice)
        ratios = [_solved(*sheared, mask, axis) / normal for axis in (0, 1)]
        along, across = ((1 - (1 - nu) / ratio) / nu for ratio in ratios)
        found[nu] = along, across
    return found


def rows(kind: str) -> FloatArray:
    """Columns for each surface, load and nu: anisotropy, contact, nu, shares c along and across; shape (5, n)."""
    found = []
    for lay, hurst, seed in SETS[kind]:
        rng = np.random.default_rng(seed)
        surface = finished(rough(rng, POINTS, min(LONGEST, POINTS / lay), SHORTEST, hurst, lay), SHORTEST)
        anisotropy = bearing(surface, (1.0, 1.0)).anisotropy
        solved = Contact(surface, (POINTS, POINTS), 1e-5)
        for load in LOADS:
            area = solved.press(load * GRADIENT)["area"]
            mask = (np.asarray(solved.model.traction) > 0).astype(float)
            found += [(anisotropy, area, nu, *both) for nu, both in shares(mask).items()]
    return np.array(found).T


def errors(constants: FloatArray, known: FloatArray) -> FloatArray:
    """ln(law/simulation) of k_t/k_n along and across, one after the other."""
    anisotropy, area, nu, *simulated = known
    law = stress_shares(anisotropy, area, nu, constants)
    both = [np.log((1 - nu * other) / (1 - nu * own)) for own, other in zip(law, simulated, strict=True)]
    return np.concatenate(both)


if __name__ == "__main__":
    known = {kind: rows(kind) for kind in SETS}
    recipes = [(*one, load, kind == "fitted") for kind in SETS for one in SETS[kind] for load in LOADS for _ in NUS]
    anisotropy, area, nu, *stresses = np.concatenate([*known.values()], axis=1)
    columns = [*np.transpose(recipes), anisotropy, area, nu, *((1 - nu) / (1 - nu * c) for c in stresses)]
    write_part(FILE, of_contacts("tangential", columns), "tangential")
    fitted = least_squares(errors, CONSTANTS, args=(known["fitted"],)).x
    click.echo(f"constants {' '.join(f'{value:.3f}' for value in fitted)}; kept {CONSTANTS}")
    for kind, each in known.items():
        off = np.abs(errors(np.array(CONSTANTS), each))
        largest = ", ".join(f"{off[np.tile(each[2], 2) == nu].max():.3f} at nu = {nu}" for nu in NUS)
        rms = np.sqrt(np.mean(off**2))
        click.echo(
            f"{kind}: {off.size} numbers, rms {rms:.4f}, largest {largest}, within 3%: {(off < 0.03).mean():.3f}"
        )
