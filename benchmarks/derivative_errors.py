"""Errors of derivatives of random quantities by random numbers, against differences of eight points of contacts described anew.

python -m benchmarks.derivative_errors --count 500
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import click
import numpy as np

from mbma_tables import Bodies, Joint, Surface, contact, sensitivity
from mbma_tables.common.errors import MbmaError
from mbma_tables.design.derivatives import difference_weights
from mbma_tables.theories import THEORIES

OFFSETS = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
WEIGHTS = difference_weights(OFFSETS)
STEPS = (8e-4, 4e-4, 2e-4)  # of a number: two that agree are of a smooth function
AGREE = 2e-7
QUANTITIES = (
    "pressure",
    "area",
    "mean_separation",
    "plane_separation",
    "mean_pressure",
    "stiffness",
    "unloading_stiffness",
    "tangential_stiffness",
    "solid_conductance",
    "energy",
    "hydraulic_aperture",
    "yielded",
)
OF_GAS = ("total_conductance", "gas_conductance")
METALS = ("steel 4140 hard", "aluminium 6061 hard")
Ask = Callable[[Mapping[str, float]], Any]


class Case(NamedTuple):
    """A random description: its numbers, its contact, and its derivatives."""

    text: str
    numbers: dict[str, float]
    ask: Ask  # the contact of numbers, described anew
    found: Callable[[list[str]], Any]  # derivatives of quantities
    quantities: tuple[str, ...]


class Outcome(NamedTuple):
    """A quantity by a number of a case."""

    text: str
    error: float  # of the slope, over itself or 1
    smooth: bool  # whether differences over three steps agree, and no side is named
    side: int


def _bodies(rng: np.random.Generator) -> tuple[dict[str, float], Callable[..., Bodies]]:
    """Numbers of random bodies, and the bodies of others."""
    hard = {"hardness": rng.uniform(0.5, 4.0)} if rng.random() < 0.5 else {}
    if rng.random() < 0.5:
        one = {
            "E_star": rng.uniform(50, 200),
            "nu": rng.uniform(0.1, 0.4),
            "conductivity": rng.uniform(10, 200),
        }

        def alone(numbers: Mapping[str, float]) -> Bodies:
            return Bodies(
                f"{numbers['E_star']!r} GPa",
                nu=numbers["nu"],
                conductivity=f"{numbers['conductivity']!r} W/(m K)",
                hardness=numbers.get("hardness"),
            )

        return one | hard, alone
    two = {}
    for end in "ab":
        two[f"part_{end}.E"] = rng.uniform(60, 220)
        two[f"part_{end}.nu"] = rng.uniform(0.1, 0.4)
        two[f"part_{end}.conductivity"] = rng.uniform(10, 200)

    def pair(numbers: Mapping[str, float]) -> Bodies:
        def of(name: str, unit: str) -> tuple[str, str]:
            a, b = (f"{numbers[f'part_{end}.{name}']!r} {unit}" for end in "ab")
            return a, b

        return Bodies(
            E=of("E", "GPa"),
            nu=(numbers["part_a.nu"], numbers["part_b.nu"]),
            conductivity=of("conductivity", "W/(m K)"),
            hardness=numbers.get("hardness"),
        )

    return two | hard, pair


def of_surface(rng: np.random.Generator) -> Case:
    """One surface, of five numbers or of a drawing, at a pressure, a gap or an area."""
    theory = str(rng.choice([*THEORIES]))
    h_rms = rng.uniform(0.2, 2.0)
    drawn = bool(rng.random() < 0.5)
    if drawn:
        longest = 10 ** rng.uniform(1.5, 3.0)
        own = {
            "hurst": rng.uniform(0.4, 0.95),
            "Ra": h_rms * 0.8,
            "longest": longest,
            "shortest": longest / 10 ** rng.uniform(1.0, 2.0),
            "nominal_area": (longest * rng.uniform(8, 40)) ** 2,
        }
    else:
        q0 = 10 ** rng.uniform(-2, -1)
        own = {
            "hurst": rng.uniform(0.4, 0.95),
            "q0": q0,
            "q1": q0 * 10 ** rng.uniform(1.0, 2.0),
            "h_rms": h_rms,
            "h_max": h_rms * rng.uniform(3.0, 4.5),
        }
    make = Surface.from_roughness if drawn else Surface
    of_bodies, bodies = _bodies(rng)
    surface = make(**own, unit="um")
    by = str(rng.choice(["pressure", "mean_separation", "area"]))
    cap = of_bodies.get("hardness", 5.0)
    value = {
        "pressure": cap * 10 ** rng.uniform(-3, -1),
        "mean_separation": float(surface.h_rms) * rng.uniform(1.0, 2.2),
        "area": 10 ** rng.uniform(-2.5, -1),
    }[by]
    numbers = {**own, **of_bodies, by: value}
    asked = {"theory": theory}

    def ask(moved: Mapping[str, float]) -> Any:
        face = make(**{name: moved[name] for name in own}, unit="um")
        return contact(face, bodies(moved), **{by: moved[by]}, **asked)

    def found(names: list[str]) -> Any:
        return sensitivity(
            surface, bodies(numbers), **{by: value}, quantities=names, **asked
        )

    kind = "drawing" if drawn else "five numbers"
    hard = "hardness" if "hardness" in numbers else "elastic"
    quantities = tuple(name for name in QUANTITIES if name != by)
    return Case(f"{theory}, {kind}, {hard}, by {by}", numbers, ask, found, quantities)


def of_joint(rng: np.random.Generator) -> Case:
    """A joint of two faces in a gas, at a pressure."""
    theory = str(rng.choice(["calibrated", "calibrated", "persson"]))
    alike = bool(rng.random() < 0.5)
    numbers: dict[str, float] = {}
    band = {
        "hurst": rng.uniform(0.5, 0.9),
        "longest": rng.uniform(300, 800),
        "shortest": rng.uniform(6, 12),
    }
    for end in "ab":
        numbers[f"part_{end}.Ra"] = rng.uniform(0.2, 1.6)
        if not alike:
            band = {name: each * rng.uniform(0.9, 1.1) for name, each in band.items()}
        numbers |= {f"part_{end}.{name}": each for name, each in band.items()}
    numbers |= {"nominal_area": rng.uniform(2e8, 9e8), "hardness": rng.uniform(0.8, 2.0)}
    numbers["pressure"] = rng.uniform(0.005, 0.05)
    shape = np.ones(1)

    def joint(moved: Mapping[str, float], batch: Any = 1.0) -> Joint:
        # of one entry: in a batch spectra of two faces are added as they are, in one joint
        # in samples, whose values differ by 1e-6
        faces = []
        for end in "ab":
            part = {n: moved[f"part_{end}.{n}"] for n in ("hurst", "longest", "shortest")}
            part["Ra"] = moved[f"part_{end}.Ra"] * batch
            faces.append(part | {"unit": "um"})
        hard = f"{moved['hardness']!r} GPa"
        return Joint(
            *faces,
            bodies=Bodies(metals=METALS, hardness=hard),
            nominal_area=moved["nominal_area"],
            theory=theory,
        )

    def ask(moved: Mapping[str, float]) -> Any:
        return joint(moved, shape).at_pressure(moved["pressure"])

    def found(names: list[str]) -> Any:
        return joint(numbers, shape).sensitivity(numbers["pressure"], names)

    bands = "one band" if alike else "two bands"
    quantities = (*(name for name in QUANTITIES if name != "pressure"), *OF_GAS)
    return Case(f"joint, {theory}, {bands}", numbers, ask, found, quantities)


def reference(case: Case, number: str, quantity: str) -> tuple[float, bool]:
    """A slope by differences of eight points, and whether those of two steps agree."""
    here = float(np.ravel(case.ask(case.numbers).quantity(quantity))[0])
    slopes = []
    for step in STEPS:
        values = []
        for offset in OFFSETS:
            moved = case.numbers | {number: case.numbers[number] * (1 + step * offset)}
            values.append(float(np.ravel(case.ask(moved).quantity(quantity))[0]))
        slopes.append(float(WEIGHTS @ np.array(values)) / step / here)
    size = max(1.0, abs(slopes[1]))
    apart = [abs(slopes[1] - slopes[0]), abs(slopes[2] - slopes[1])]
    return slopes[1], max(apart) <= AGREE * size


def outcome(rng: np.random.Generator) -> Outcome | None:
    """A random quantity by a random number; None where the quantity or the contact does not exist."""
    case = of_joint(rng) if rng.random() < 0.3 else of_surface(rng)
    number = str(rng.choice([*case.numbers]))
    quantity = str(rng.choice(case.quantities))
    try:
        value = float(np.ravel(case.ask(case.numbers).quantity(quantity))[0])
        if not np.isfinite(value) or value == 0:
            return None
        found = case.found([quantity])
        # "nu" matters to the tangential stiffness alone
        row = found.slopes.get(number)
        slope = 0.0 if row is None else float(np.ravel(row[quantity])[0])
        expected, smooth = reference(case, number, quantity)
    except MbmaError:
        return None
    error = abs(slope - expected) / max(1.0, abs(expected))
    side = 0 if row is None else int(np.ravel(found.sides[number])[0])
    text = f"{case.text}: {quantity} by {number}"
    return Outcome(text, error, smooth and side == 0, side)


def outcomes(count: int, seed: int) -> list[Outcome]:
    """Random combinations that exist."""
    rng = np.random.default_rng(seed)
    made: list[Outcome] = []
    while len(made) < count:
        one = outcome(rng)
        if one is not None:
            made.append(one)
    return made


@click.command()
@click.option("--count", default=500, help="Combinations.")
@click.option("--seed", default=1, help="Of the random numbers.")
def main(count: int, seed: int) -> None:
    """The largest errors, and how many combinations are not smooth."""
    made = outcomes(count, seed)
    smooth = sorted((one for one in made if one.smooth), key=lambda one: -one.error)
    errors = np.array([one.error for one in smooth])
    above = int(np.sum(~(errors <= 1e-6)))
    print(f"{count} combinations, {len(smooth)} of them smooth to 2e-7")
    print(f"above 1e-6: {above}; median {np.median(errors):.1e}, largest {errors[0]:.1e}")
    for one in smooth[:8]:
        print(f"  {one.error:.1e}  {one.text}")
    for one in made:
        if not one.smooth:
            print(f"  not smooth: {one.text}; {one.error:.1e}, side {one.side}")


if __name__ == "__main__":
    main()
