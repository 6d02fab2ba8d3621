"""`python -m benchmarks.unloading`: times of laws of unloading beside those of loading, and of a simulated path."""

import os
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables import Bodies, Surface, contact, contact_law

FACE = Surface(hurst=0.8, q0=0.06, q1=2.0, h_rms=1.0, h_max=3.5, unit="um")
BODIES = Bodies("100 GPa", hardness="5 GPa", nu=0.3)
COUNT = 100_000
POINTS = 256
PATH = (
    *(("1 MPa", "1 MPa"), ("50 MPa", "50 MPa"), ("25 MPa", "50 MPa")),
    *(("10 MPa", "50 MPa"), ("60 MPa", "60 MPa"), ("30 MPa", "60 MPa")),
)  # pressures, and the largest so far


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


def path() -> str:
    """Seconds of a map of 256 x 256 points along a path of six loads, without files of earlier runs."""
    waves = np.fft.fftfreq(POINTS) * POINTS
    q = np.hypot(waves[:, None], waves)
    amplitude = np.where((q >= 2) & (q <= 32), np.maximum(q, 1.0) ** -1.8, 0.0)
    noise = np.random.default_rng(5).standard_normal(q.shape)
    heights = np.fft.ifft2(amplitude * np.fft.fft2(noise)).real
    face = Surface.from_map(0.5 * heights / heights.std(), 0.4, unit="um", periodic=True)
    start = time.perf_counter()
    for pressure, largest in PATH:
        bodies = Bodies("115 GPa", hardness="2 GPa", largest_pressure=largest)
        _ = contact(face, bodies, pressure=pressure, theory="simulated").stiffness
    seconds = time.perf_counter() - start
    return f"{POINTS} x {POINTS} points, {len(PATH)} loads: {seconds:.1f} s"


if __name__ == "__main__":
    os.environ["XDG_CACHE_HOME"] = tempfile.mkdtemp()
    for theory in ("calibrated", "persson", "mbma"):
        print(report(theory, None))
        print(report(theory, "50 MPa"))
    print(path())
