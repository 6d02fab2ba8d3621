"""`python -m benchmarks.unloading`: times of laws of unloading beside those of loading, of one core."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables import Bodies, Surface, contact_law

FACE = Surface(hurst=0.8, q0=0.06, q1=2.0, h_rms=1.0, h_max=3.5, unit="um")
BODIES = Bodies("100 GPa", hardness="5 GPa", nu=0.3)
COUNT = 100_000


def milliseconds(work: Callable[[], Any]) -> float:
    """The shortest of five times of the processor."""
    times = []
    for _ in range(5):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return 1000 * min(times)


def report(theory: str, largest: str | None) -> str:
    """Times of a law: to make it, and to answer many gaps and pressures."""

    def make() -> Any:
        return contact_law(FACE, BODIES, theory, largest_pressure=largest)

    law = make()
    gaps = np.linspace(0.5, 3.0, COUNT)
    pressures = np.geomspace(1e-3, 0.049, COUNT)
    forward = milliseconds(lambda: law.pressure(separation=gaps))
    inverse = milliseconds(lambda: law.at_pressure(pressures))
    name = "first loading" if largest is None else f"after {largest}"
    return (
        f"{theory}, {name}: {milliseconds(make):.1f} ms to make; {COUNT} pressures "
        f"{forward:.2f} ms, inverses {inverse:.2f} ms"
    )


if __name__ == "__main__":
    for theory in ("calibrated", "persson", "mbma"):
        print(report(theory, None))
        print(report(theory, "50 MPa"))
