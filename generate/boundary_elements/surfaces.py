"""Random surfaces, each made anew from a few numbers and a seed.

Wavevectors are drawn in the order of their length, so one seed gives the same surface on every grid, and a larger
cut-off adds waves without moving those that were there.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from mbma_tables.common.arguments import FloatArray

PATCH_WAVES = 2  # a patchy surface's amplitude varies over waves down to 1/PATCH_WAVES of its longest
WORN_WIDTH = 0.3  # heights over which a worn surface's slope turns from 1 to WORN_SLOPE [h_rms]
WORN_SLOPE = 0.2


@dataclasses.dataclass(frozen=True)
class Recipe:
    """What a surface is made of.

    Its kind is "self_affine"; "plateau": flat spectrum below q0 down to one wave a side; "filtered": Gaussian filters
    (ISO 16610-21) of half transmission at q0 and q1, cut at twice q1; "stretched" along x, `shape` times; heights z in
    h_rms transformed: "peaks" (exp(shape z) - 1)/shape, "valleys" the same upside down, "worn" above the level `shape`,
    "patchy": times exp(shape y), y a smooth Gaussian field; or "yielded": "self_affine", to be pressed with a hardness
    of `shape` E* g.
    """

    kind: str
    hurst: float
    zeta_1: float  # q1/q0
    waves: int  # of wavenumber q0 along a side
    seed: int  # of the phases
    points: int  # along each side
    shape: float = 0.0

    @property
    def name(self) -> str:
        """Name of the surface's file."""
        shape = f"_{self.shape:g}" if self.shape else ""
        return f"{self.kind}{shape}_H{self.hurst:g}_z{self.zeta_1:g}_w{self.waves}_s{self.seed}_n{self.points}"

    @property
    def sizes(self) -> tuple[float, float]:
        """Sides of the periodic cell: the short one is 1."""
        return (self.shape, 1.0) if self.kind == "stretched" else (1.0, 1.0)

    @property
    def q0(self) -> float:
        """Wavenumber of the longest (at a plateau: roll-off) waves, across where stretched."""
        return 2 * np.pi * self.waves

    @property
    def band(self) -> tuple[float, float]:
        """Shortest and longest wavevector, in waves a side."""
        low = 1 if self.kind in ("plateau", "filtered") else self.waves
        return low, self.zeta_1 * self.waves * (2 if self.kind == "filtered" else 1)


def _half_plane(low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Lattice wavevectors of one half-plane with low <= |k| <= high, by their length."""
    reach = int(high + 1e-9)
    kx, ky = (k.ravel() for k in np.meshgrid(np.arange(-reach, reach + 1), np.arange(reach + 1), indexing="ij"))
    squared = kx**2 + ky**2
    kept = ((ky > 0) | (kx > 0)) & (squared >= low**2 - 1e-9) & (squared <= high**2 + 1e-9)
    kx, ky, squared = kx[kept], ky[kept], squared[kept]
    order = np.lexsort((ky, kx, squared))
    return kx[order], ky[order]


def _field(kx: np.ndarray, ky: np.ndarray, amplitude: FloatArray, seed: int, points: int) -> FloatArray:
    """Sum of cosines with these amplitudes and random phases."""
    if 2 * max(np.abs(kx).max(), ky.max()) >= points:
        raise ValueError(f"{points} points a side are too few for {ky.max()} waves")
    phases = 2 * np.pi * np.random.default_rng(seed).random(len(kx))
    modes = np.zeros((points, points // 2 + 1), complex)
    modes[kx, ky] = amplitude * np.exp(1j * phases)
    edge = ky == 0
    modes[-kx[edge], 0] = np.conj(modes[kx[edge], 0])
    field: FloatArray = np.fft.irfft2(modes, s=(points, points)) * points**2
    return field


def _amplitude(recipe: Recipe, k: FloatArray) -> FloatArray:
    plain: FloatArray = k ** -(1 + recipe.hurst)
    if recipe.kind == "plateau":
        plain = np.maximum(k, recipe.waves) ** -(1 + recipe.hurst)
    if recipe.kind == "filtered":
        cut = recipe.zeta_1 * recipe.waves
        plain = plain * 2.0 ** -((k / cut) ** 2) * -np.expm1(-np.log(2) * (k / recipe.waves) ** 2)
    return plain


def _transformed(recipe: Recipe, z: FloatArray) -> FloatArray:
    if recipe.kind == "peaks":
        z = np.expm1(recipe.shape * z) / recipe.shape
    if recipe.kind == "valleys":
        z = -np.expm1(-recipe.shape * z) / recipe.shape
    if recipe.kind == "worn":
        above = np.logaddexp(0, (z - recipe.shape) / WORN_WIDTH) * WORN_WIDTH
        z = z - (1 - WORN_SLOPE) * above
    if recipe.kind == "patchy":
        kx, ky = _half_plane(recipe.waves, PATCH_WAVES * recipe.waves)
        smooth = _field(kx, ky, np.ones(len(kx)), recipe.seed + 10_000_000, recipe.points)
        z = z * np.exp(recipe.shape * smooth / smooth.std())
    return z


def heights(recipe: Recipe) -> FloatArray:
    """The surface: heights of mean zero and root mean square 1, shape (points, points)."""
    kx, ky = _half_plane(*recipe.band)
    z = _field(kx, ky, _amplitude(recipe, np.hypot(kx, ky)), recipe.seed, recipe.points)
    z /= z.std()
    z = _transformed(recipe, z)
    z -= z.mean()
    z /= z.std()
    return z
