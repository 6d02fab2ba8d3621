"""docs/export.md: sizes and accuracy of laws as code, rows chosen by their error, and the figure."""

from __future__ import annotations

import ctypes
import itertools
import pathlib
import subprocess
import tempfile
from typing import Any

import numpy as np

from generate.pages.page import Measured, panels, table
from mbma_tables import Surface, contact_law
from mbma_tables.export import LAWS
from mbma_tables.export.law_code import law_text
from mbma_tables.export.law_rows import describe_law
from mbma_tables.export.law_table import LawTable

NAMES = ("concrete", "asphalt", "yang-persson", "challenge")
E_STAR = 13.3
THEORIES = ("mbma", "calibrated", "persson")
# sums pressure and tangent at random overclosures, in nanoseconds a value; the differences of single ones follow
LOOP = """
#include <time.h>
double law_loop(const double *c, int count, int times, double *sum) {
    clock_t start = clock();
    double total = 0, tangent;
    for (int n = 0; n < times; ++n)
        for (int k = 0; k < count; ++k) {
            total += law_with_tangent(c[k], &tangent);
            total += tangent;
        }
    *sum = total;
    return 1e9 * (double)(clock() - start) / CLOCKS_PER_SEC / count / times;
}
"""


def law(name: str, rows: int, evenly: bool = False) -> LawTable:
    """Rows of a named surface."""
    return describe_law(Surface.named(name), E_STAR, stress_unit="MPa", rows=rows, evenly=evenly)


def compiled() -> str:
    """Laws in C, by gcc -O2: largest differences from the library's law, and the time of a value with its tangent."""
    lines, pairs = [], {name: name for name in ("pressure", "area", "energy")} | {"tangent": "stiffness"}
    road = Surface.named(NAMES[0])
    for theory in THEORIES:
        own, rng = contact_law(road, E_star=E_STAR, theory=theory), np.random.default_rng(18)
        d = own.h_max * np.concatenate([1 - 10 ** rng.uniform(-12, -0.3, 5000), rng.uniform(-0.99, 1, 5000)])
        c = (own.h_max - d) / 2
        with tempfile.TemporaryDirectory() as folder:
            source = law_text("c-law", road, E_STAR, theory=theory, stress_unit="MPa") + LOOP
            pathlib.Path(folder, "law.c").write_text(source, encoding="utf-8")
            command = ["gcc", "-std=c99", "-O2", "-shared", "-fPIC", "law.c", "-lm", "-o", "law.so"]
            subprocess.run(command, cwd=folder, check=True)
            library = ctypes.CDLL(f"{folder}/law.so")
        known, cells = own.values(separation=d), []
        for name, field in pairs.items():
            function = getattr(library, f"law_{name}")
            function.restype, function.argtypes = ctypes.c_double, [ctypes.c_double]
            cells.append(np.abs(np.array([*map(function, c)]) / getattr(known, field) - 1).max())
        library.law_loop.restype = ctypes.c_double
        even = c[5000:].copy()
        address, total = even.ctypes.data_as(ctypes.c_void_p), ctypes.byref(ctypes.c_double())
        time = min(library.law_loop(address, even.size, 200, total) for _ in range(5))
        lines.append([theory, *cells, time])
    header = f"theory | {' | '.join(pairs)} | a value with its tangent"
    return table(header, lines, f"{{}} | {'{:.1e} | ' * len(pairs)}{{:.0f}} ns")


def measure() -> Measured:
    """The measured blocks, and rows of the concrete road, chosen by error and equally spaced, on the curve."""
    errors = []
    for name, rows in itertools.product(NAMES, (20, 50, 200)):
        chosen, even = (law(name, rows, evenly).largest_error for evenly in (False, True))
        errors.append([name, rows, chosen, even, even / chosen])
    heat: dict[str, Any] = {"conductivity": 1.0, "conductivity_unit": "W/(m K)", "stress_unit": "MPa"}
    road = Surface.named(NAMES[0])
    sizes = [[to, *(len(law_text(to, road, E_STAR, theory=t, **heat)) / 1e3 for t in THEORIES)] for to in LAWS]
    header = "surface | rows | chosen | equally spaced | ratio"
    parts = {"errors": table(header, errors, "{} | {} | {:.1e} | {:.1e} | {:.1f}"), "compiled": compiled()}
    parts["sizes"] = table(f"target | {' [kB] | '.join(THEORIES)} [kB]", sizes, "{} | {:.1f}")
    figure, axes = panels(size=(6, 4))
    fine = law("concrete", 500)
    axes.semilogy(fine.x[1:], fine.y[1:], "k-", lw=0.8, label="model")
    for evenly, mark, label in ((False, "o", "chosen"), (True, "x", "equally spaced")):
        own = law("concrete", 20, evenly)
        axes.semilogy(own.x[1:], own.y[1:], mark, label=f"20 rows, {label}: error {own.largest_error:.1%}")
    axes.set(xlabel="overclosure [mm]", ylabel="pressure [MPa]", ylim=(1e-4, 5))
    axes.grid(True, alpha=0.3)
    axes.legend()
    return parts, {"docs/figures/export.svg": figure}
