"""Python calls of single requests: how many, how often they move from one file of the library to another, and files.

python benchmarks/request.py
"""

import itertools
import os
import sys
from collections import Counter
from collections.abc import Callable
from types import FrameType
from typing import Any

import mbma_tables
from mbma_tables import Bodies, Surface, contact, contact_law

# with the separator at its end; the folder around it, or an environment in that, may have
# the library's name too
PACKAGE = os.path.join(os.path.dirname(os.path.abspath(mbma_tables.__file__)), "")


def traced(request: Callable[[], Any]) -> tuple[int, int, Counter[str]]:
    """Calls of the library's Python functions, moves between its files, and calls by place."""
    places: list[str] = []

    def note(frame: FrameType, event: str, _: object) -> None:
        name = frame.f_code.co_filename
        if event == "call" and name.startswith(PACKAGE):
            places.append(f"{name.removeprefix(PACKAGE)}:{frame.f_code.co_qualname}")

    request()
    request()
    sys.setprofile(note)
    try:
        request()
    finally:
        sys.setprofile(None)
    files = [place.partition(":")[0] for place in places]
    return len(places), sum(a != b for a, b in itertools.pairwise(files)), Counter(places)


def main() -> None:
    """A line for each request; with `-v` the functions that are called most."""
    joint = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
    law = contact_law(joint, "100 GPa", theory="mbma")
    requests: dict[str, Callable[[], Any]] = {
        "mbma by pressure": lambda: contact(
            joint, "100 GPa", pressure="10 MPa", theory="mbma"
        ),
        "mbma by gap": lambda: contact(joint, 1e5, mean_separation=1.9, theory="mbma"),
        "calibrated with hardness": lambda: contact(
            joint,
            Bodies("100 GPa", hardness="1.5 GPa"),
            pressure="10 MPa",
            theory="calibrated",
        ),
        "law.at_pressure": lambda: law.at_pressure(0.01),
    }
    for name, request in requests.items():
        calls, moves, places = traced(request)
        files = {place.partition(":")[0] for place in places}
        print(f"{name:26} {calls:5} calls {moves:5} moves {len(files):3} files")
        for place, count in places.most_common(40) if "-v" in sys.argv else []:
            print(f"    {count:4} {place}")


if __name__ == "__main__":
    main()
