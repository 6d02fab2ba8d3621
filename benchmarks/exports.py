"""Exported C beside the library: islands and totals, both in this process and on the same arrays."""

from __future__ import annotations

import ctypes
import pathlib
import subprocess
import tempfile
from typing import Any

import click
import numpy as np

from benchmarks.rows import microseconds, report, rounds, times_faster
from mbma_tables import Surface, contact, open_table
from mbma_tables.export.code import write_code

POINTS, GAPS = 20_000, 200
RTOL = 1e-8
COMPILER = ("cc", "-std=c99", "-O2", "-shared", "-fPIC")


def exported(rng: np.random.Generator) -> None:
    """Islands at random (X, mu), and totals of one surface at many gaps."""
    model, surface = open_table("universal"), Surface.named("yang-persson")
    X, mu = rng.uniform(-5.0, 40.0, POINTS), np.exp(rng.uniform(np.log(1e-7), np.log(1e6), POINTS))
    gaps = np.linspace(-0.5, 0.95, GAPS) * surface.h_max
    islands, totals = np.empty((POINTS, 3)), np.empty((GAPS, 4))
    numbers = (ctypes.c_double * 5)(surface.hurst, surface.q0, surface.q1, surface.h_rms, surface.h_max)

    def at(array: np.ndarray) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    with tempfile.TemporaryDirectory() as work:
        folder = pathlib.Path(work)
        write_code("c", folder)
        subprocess.run([*COMPILER, str(folder / "mbma.c"), "-lm", "-o", str(folder / "mbma.so")], check=True)
        library: Any = ctypes.CDLL(str(folder / "mbma.so"))
    size, count, one, rtol = ctypes.c_size_t(POINTS), ctypes.c_size_t(GAPS), ctypes.c_double(1.0), ctypes.c_double(RTOL)
    taken = rounds(
        {
            "islands": lambda: model.answer(X, mu),
            "C islands": lambda: library.mbma_phi_many(size, at(X), at(mu), at(islands), None),
            "totals": lambda: contact(surface, gaps, rtol=RTOL),
            "C totals": lambda: library.mbma_total_many(numbers, count, at(gaps), one, rtol, at(totals), None),
        }
    )
    phi, total = model.answer(X, mu), contact(surface, gaps, rtol=RTOL)
    click.echo("\nExported C, -O2")
    for name, entries, found, known in (
        ("islands", POINTS, islands, (phi.phi_F, phi.phi_A)),
        ("totals", GAPS, totals, (total.force, total.area)),
    ):
        report(f"C, one of {entries} {name}", 1e3 * microseconds(taken[f"C {name}"], entries), "ns")
        report("  as fast as the library", times_faster(taken, name, f"C {name}"), "x")
        report("  largest relative difference", np.abs(found[:, :2].T / np.stack(known) - 1).max(), "")
