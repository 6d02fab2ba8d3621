"""Random surfaces, each made anew from a few numbers and a seed, and the campaigns of `campaign.toml` that press them.

Wavevectors are drawn in the order of their length, so one seed gives the same surface on
every grid, and a larger cut-off adds waves without moving those that were there.

Nodes of a campaign are spectra (with a transform where there is one). Those marked held out
are never fitted, nor is the second surface of every other node; so a law is tested on new
surfaces of known spectra and on spectra of its own.
"""

import dataclasses
import itertools
import pathlib
import tomllib
import zlib

import numpy as np

from mbma_tables.common.arguments import FloatArray

CAMPAIGNS = tomllib.loads(
    pathlib.Path(__file__).with_name("campaign.toml").read_text(encoding="utf-8")
)
SPLITS = ("training", "held_out_surface", "held_out_spectrum", "refine")
TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM, REFINEMENT = SPLITS
FINER = (64, 128, 256, 512)  # grids of refined surfaces: 2 to 32 points a shortest wave
# a patchy surface's amplitude varies over waves down to 1/PATCH_WAVES of its longest
PATCH_WAVES = 2
WORN_WIDTH = (
    0.3  # heights over which a worn surface's slope turns from 1 to WORN_SLOPE [h_rms]
)
WORN_SLOPE = 0.2


@dataclasses.dataclass(frozen=True)
class Recipe:
    """What a surface is made of.

    Its kind is "self_affine"; "plateau": flat spectrum below q0 down to one wave a side;
    "filtered": Gaussian filters (ISO 16610-21) of half transmission at q0 and q1, cut at
    twice q1; "stretched" along x, `shape` times; heights z in h_rms transformed: "peaks"
    (exp(shape z) - 1)/shape, "valleys" the same upside down, "worn" above the level
    `shape`, "patchy": times exp(shape y), y a smooth Gaussian field; or "yielded":
    "self_affine", to be pressed with a hardness of `shape` E* g.
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
        shape = f"_{self.shape:g}" if self.shape else ""
        return f"{self.kind}{shape}_H{self.hurst:g}_z{self.zeta_1:g}_w{self.waves}_s{self.seed}_n{self.points}"

    @property
    def sizes(self) -> tuple[float, float]:
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
    kx, ky = (
        k.ravel()
        for k in np.meshgrid(
            np.arange(-reach, reach + 1), np.arange(reach + 1), indexing="ij"
        )
    )
    squared = kx**2 + ky**2
    kept = (
        ((ky > 0) | (kx > 0)) & (squared >= low**2 - 1e-9) & (squared <= high**2 + 1e-9)
    )
    kx = kx[kept]
    ky = ky[kept]
    squared = squared[kept]
    order = np.lexsort((ky, kx, squared))
    return kx[order], ky[order]


def _field(
    kx: np.ndarray, ky: np.ndarray, amplitude: FloatArray, seed: int, points: int
) -> FloatArray:
    if 2 * max(np.abs(kx).max(), ky.max()) >= points:
        raise ValueError(f"{points} points a side are too few for {ky.max()} waves")
    phases = 2 * np.pi * np.random.default_rng(seed).random(len(kx))
    modes = np.zeros((points, points // 2 + 1), complex)
    modes[kx, ky] = amplitude * np.exp(1j * phases)
    edge = ky == 0
    modes[-kx[edge], 0] = np.conj(modes[kx[edge], 0])
    field: FloatArray = np.fft.irfft2(modes, s=(points, points)) * points**2
    return field


def heights(recipe: Recipe) -> FloatArray:
    """The surface: heights of mean zero and root mean square 1, shape (points, points)."""
    kx, ky = _half_plane(*recipe.band)
    k = np.hypot(kx, ky)
    amplitude = (np.maximum(k, recipe.waves) if recipe.kind == "plateau" else k) ** -(
        1 + recipe.hurst
    )
    if recipe.kind == "filtered":
        cut = recipe.zeta_1 * recipe.waves
        amplitude = (
            amplitude
            * 2.0 ** -((k / cut) ** 2)
            * -np.expm1(-np.log(2) * (k / recipe.waves) ** 2)
        )
    z = _field(kx, ky, amplitude, recipe.seed, recipe.points)
    z /= z.std()
    if recipe.kind == "peaks":
        z = np.expm1(recipe.shape * z) / recipe.shape
    if recipe.kind == "valleys":
        z = -np.expm1(-recipe.shape * z) / recipe.shape
    if recipe.kind == "worn":
        z = (
            z
            - (1 - WORN_SLOPE)
            * np.logaddexp(0, (z - recipe.shape) / WORN_WIDTH)
            * WORN_WIDTH
        )
    if recipe.kind == "patchy":
        kx, ky = _half_plane(recipe.waves, PATCH_WAVES * recipe.waves)
        smooth = _field(kx, ky, np.ones(len(kx)), recipe.seed + 10_000_000, recipe.points)
        z = z * np.exp(recipe.shape * smooth / smooth.std())
    z -= z.mean()
    z /= z.std()
    return z


@dataclasses.dataclass(frozen=True)
class Task:
    recipe: Recipe
    split: str  # the set that it belongs to


def cost(recipe: Recipe) -> float:
    """Grid points a side, more where stretching makes the equations ill-conditioned."""
    return recipe.points * (
        max(1.0, recipe.shape / 4) if recipe.kind == "stretched" else 1.0
    )


def campaign(kind: str = "elastic") -> list[Task]:
    """Every surface to solve, cheap ones first and kinds in turn, so that stopping early leaves a balanced set.

    `kind` is elastic, hardness (pressures are capped), leakage (gaps are solved for flow) or
    bandwidth, whose surfaces are all large and come as they are listed.
    """
    recipes = [Recipe(*row) for row in CAMPAIGNS["refined"][kind]]
    fixed = [recipe for recipe in recipes if recipe.points]
    refined = [
        Task(dataclasses.replace(recipe, points=points), REFINEMENT)
        for points, recipe in itertools.product(
            FINER, (recipe for recipe in recipes if not recipe.points)
        )
        if points > 2 * recipe.band[1]
    ]
    refined += [
        Task(dataclasses.replace(recipe, points=points), REFINEMENT)
        for recipe in fixed
        for points in (recipe.points // 2, recipe.points)
    ]
    tasks = []
    for family, hursts, bands, points, surfaces, shapes, held_out in CAMPAIGNS[kind]:
        for hurst, band, shape in itertools.product(
            hursts.split(), bands.split(), shapes.split()
        ):
            zeta_1, waves = band.split("x")
            node = Recipe(
                family, float(hurst), float(zeta_1), int(waves), 0, points, float(shape)
            )
            for turn in range(surfaces):
                split = (
                    HELD_OUT_SPECTRUM
                    if held_out
                    else HELD_OUT_SURFACE
                    if turn == 1
                    else TRAINING
                )
                # of the spectrum alone, so that a longer list moves no seed; its order
                # mixes the kinds
                seed = zlib.crc32(node.name.encode()) % 10_000_000 * 100 + turn
                tasks.append(
                    (
                        cost(node),
                        turn,
                        seed,
                        Task(dataclasses.replace(node, seed=seed), split),
                    )
                )
    if kind == "bandwidth":
        return [*(entry[3] for entry in tasks), *refined]
    tasks.sort(key=lambda entry: entry[:3])
    return sorted(
        refined + [entry[3] for entry in tasks], key=lambda task: cost(task.recipe)
    )
