"""Time of values with derivatives by every number, over that of the values, of fresh surfaces and joints.

python benchmarks/derivatives.py
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables import Bodies, Joint, Surface, contact, sensitivity
from mbma_tables.theories import THEORIES

ROUNDS = 5
MANY = 500
FACE = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
OTHERS = {
    "one face": None,
    "two alike": FACE | {"Rq": "0.7 um"},
    "two bands": FACE | {"Rq": "0.7 um", "hurst": 0.7, "longest": "800 um"},
}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
PRESSURE = "10 MPa"


def surfaces(generator: np.random.Generator, shape: tuple[int, ...]) -> Surface:
    """Surfaces that no theory has seen."""

    def some(low: float, high: float) -> Any:
        return generator.uniform(low, high, shape)

    h_rms = some(0.8, 1.2)
    return Surface(
        hurst=some(0.5, 0.9),
        q0=some(0.05, 0.07),
        q1=some(2.5, 3.5),
        h_rms=h_rms,
        h_max=some(3.8, 4.2) * h_rms,
        unit="um",
    )


def seconds(make: Callable[[], Any], ask: Callable[[Any], Any]) -> float:
    """Median time of a question about fresh things."""
    times = []
    for _ in range(ROUNDS):
        fresh = make()
        start = time.perf_counter()
        ask(fresh)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def shown(name: str, values: float, both: float, count: int) -> None:
    """A line of the table."""
    print(
        f"{name:50}{1e3 * values:10.3g} ms{1e3 * both:10.3g} ms{both / values:8.1f}"
        f"{count:6}{1 + count / 2:8.1f}"
    )


def of_surfaces(theory: str, hardness: str | None, shape: tuple[int, ...]) -> None:
    """Surfaces by pressure: every quantity that tables show with its uncertainty."""
    generator = np.random.default_rng(1)
    bodies = Bodies("100 GPa", hardness=hardness, conductivity="45 W/(m K)", nu=0.3)

    def make() -> Surface:
        return surfaces(generator, shape)

    def derivatives(surface: Surface) -> Any:
        return sensitivity(surface, bodies, pressure=PRESSURE, theory=theory)

    known = derivatives(make())

    def values(surface: Surface) -> Any:
        pressed = contact(surface, bodies, pressure=PRESSURE, theory=theory)
        return [pressed.quantity(name) for name in known.answers]

    kind = "with a hardness" if hardness else "elastic"
    size = shape[0] if shape else 1
    line = f"{theory}, {kind}, {size} at once"
    count = len(known.parameters)
    shown(line, seconds(make, values), seconds(make, derivatives), count)


def of_joints(theory: str, which: str) -> None:
    """One joint of fresh faces, with its making."""
    generator = np.random.default_rng(1)

    def make() -> dict[str, Any]:
        return FACE | {"Rq": f"{generator.uniform(0.39, 0.41)!r} um"}

    def joint(face: dict[str, Any]) -> Joint:
        return Joint(
            face, OTHERS[which], bodies=METALS, nominal_area="4 cm^2", theory=theory
        )

    known = joint(make()).sensitivity(PRESSURE)

    def values(face: dict[str, Any]) -> Any:
        pressed = joint(face).at_pressure(PRESSURE)
        return [pressed.quantity(name) for name in known.answers]

    def derivatives(face: dict[str, Any]) -> Any:
        return joint(face).sensitivity(PRESSURE)

    line = f"joint by {theory}, {which}"
    count = len(known.parameters)
    shown(line, seconds(make, values), seconds(make, derivatives), count)


def main() -> None:
    """A line for each theory, hardness and number of surfaces, and each kind of joint."""
    print(f"{'':50}{'values':>13}{'with both':>13}{'ratio':>8}{'n':>6}{'1+n/2':>8}")
    for theory in THEORIES:
        for hardness in (None, "1.5 GPa"):
            for shape in ((), (MANY,)):
                of_surfaces(theory, hardness, shape)
    for theory in THEORIES:
        for which in OTHERS:
            of_joints(theory, which)


if __name__ == "__main__":
    main()
