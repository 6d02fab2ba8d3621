"""`python -m benchmarks.memory`: memory of a process after many calls of each public route.

Each route runs in a process of its own, with different numbers in every call. The resident
memory is read after a tenth of the calls and after all of them; what grows between is a leak.
"""

import itertools
import json
import pathlib
import subprocess
import sys
from collections.abc import Callable, Iterator

from mbma_tables import Bodies, Joint, Surface, contact, contact_law, island, open_table

CALLS = 1_000_000
# calls that take longer are made less often
FEWER = {"joint by pressure": 10_000, "law made": 10_000, "table opened": 10_000}
STATUS = pathlib.Path("/proc/self/status")
FACE = Surface(hurst=0.8, q0=0.06, q1=2.0, h_rms=1.0, h_max=3.5, unit="um")
HARD = Bodies("100 GPa", hardness="5 GPa")
GROUND = {
    "Rq": "0.4 um",
    "longest": "100 um",
    "shortest": "2 um",
    "hurst": 0.8,
    "h_max": "1.6 um",
}


def _pressures() -> Iterator[float]:
    """Numbers between 0.5 and 1.5 that do not repeat."""
    return (0.5 + (number * 0.6180339887498949) % 1 for number in itertools.count())


def _of_law() -> Callable[[float], object]:
    law = contact_law(FACE, HARD)
    return lambda number: law.pressure(number)


ROUTES: dict[str, Callable[[], Callable[[float], object]]] = {
    "contact, calibrated": lambda: lambda x: contact(FACE, HARD, pressure=0.01 * x).area,
    "contact of new surfaces": lambda: (
        lambda x: (
            contact(Surface(0.8, 0.06, 2.0 + x, 1.0, 3.5), "1", pressure=0.01 * x).area
        )
    ),
    "contact, mbma": lambda: (
        lambda x: contact(FACE, 100.0, pressure=0.01 * x, theory="mbma").area
    ),
    "island": lambda: lambda x: island(FACE, 2.0 + x),
    "law": _of_law,
    "law made": lambda: lambda x: contact_law(FACE, Bodies(100.0 * x)),
    "table opened": lambda: lambda x: open_table("universal"),
    "joint by pressure": lambda: (
        lambda x: (
            Joint(GROUND, GROUND, bodies=("steel 4140 hard", "aluminium 6061 hard"))
            .at_pressure(f"{10 * x} MPa")
            .total_conductance
        )
    ),
}


def resident() -> float:
    """Resident memory of this process in MB."""
    text = STATUS.read_text("utf-8")
    line = next(line for line in text.splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


def run(name: str, calls: int) -> None:
    """The memory after a tenth of the calls and after all, as a line of JSON."""
    ask = ROUTES[name]()
    sizes = []
    numbers = _pressures()
    for share in (calls // 10, calls - calls // 10):
        for number in itertools.islice(numbers, share):
            ask(number)
        sizes.append(resident())
    print(json.dumps(sizes))


def main() -> None:
    """A line for each route."""
    scale = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
    print(
        f"{'route':26} {'calls':>9} {'MB at a tenth':>14} {'MB at the end':>14} bytes a call"
    )
    for name in ROUTES:
        calls = round(scale * FEWER.get(name, CALLS))
        command = [sys.executable, "-m", "benchmarks.memory", "--route", name, str(calls)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        first, last = json.loads(done.stdout.splitlines()[-1])
        grown = (last - first) * 2**20 / (0.9 * calls)
        print(
            f"{name:26} {calls:9,d} {first:14.1f} {last:14.1f} {grown:12.1f}", flush=True
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["--route"]:
        run(sys.argv[2], int(sys.argv[3]))
    else:
        main()
