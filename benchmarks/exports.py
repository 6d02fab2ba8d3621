"""Exported C beside the library: islands and totals, both in this process and on the same arrays."""

import ctypes
import pathlib
import subprocess
import tempfile
from typing import Any

import click
import numpy as np

from benchmarks.kernels import held_out
from benchmarks.rows import microseconds, report, rounds, times_faster
from mbma_tables import contact, open_table
from mbma_tables.export.model.c_code import FLAGS, SOURCES, write_code
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.sums import QUADRATURE_SHARE

POINTS = 20_000
SURFACES = 2000
RTOL = 1e-8
COMPILER = ("cc", *FLAGS, "-march=native", "-shared", "-fPIC")


def exported(rng: np.random.Generator) -> None:
    """Islands at random (X, mu), and totals of as many surfaces as gaps."""
    model = open_table("universal")
    X = rng.uniform(-5.0, 40.0, POINTS)
    mu = np.exp(rng.uniform(np.log(1e-7), np.log(1e6), POINTS))
    surfaces, apart = held_out(SURFACES, rng)
    heights = (surfaces.h_max - apart) / surfaces.h_rms, surfaces.h_max / surfaces.h_rms
    islands = np.empty((POINTS, 3))
    sums = np.empty((SURFACES, 4))
    bound = np.empty(SURFACES)
    status = np.empty(SURFACES, np.uint8)

    def at(array: Any) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    with tempfile.TemporaryDirectory() as work:
        folder = pathlib.Path(work)
        write_code(folder)
        sources = [str(folder / name) for name in SOURCES if name != "mbma_selftest.c"]
        subprocess.run(
            [*COMPILER, *sources, "-lm", "-o", str(folder / "model.so")], check=True
        )
        library: Any = ctypes.CDLL(str(folder / "model.so"))
    for function in (library.mbma_table, library.mbma_model_variant):
        function.restype = ctypes.c_void_p
    table, variant = (
        ctypes.c_void_p(function())
        for function in (library.mbma_table, library.mbma_model_variant)
    )
    size = ctypes.c_size_t(POINTS)
    many = ctypes.c_size_t(SURFACES)
    share = ctypes.c_double(QUADRATURE_SHARE * RTOL)
    known = [
        np.ascontiguousarray(column, dtype=float)
        for column in (surfaces.hurst, surfaces.zeta_1, *heights)
    ]
    seen = ctypes.c_int64()
    taken = rounds(
        {
            "islands": lambda: model.answer(X, mu),
            "C islands": lambda: library.mbma_phi(
                size, at(X), at(mu), table, at(islands), None
            ),
            "totals": lambda: contact(surfaces, separation=apart, theory=Mbma(rtol=RTOL)),
            "C totals": lambda: library.mbma_totals(
                many,
                *map(at, known),
                share,
                variant,
                table,
                at(sums),
                at(bound),
                at(status),
                ctypes.byref(seen),
            ),
        }
    )
    phi = model.answer(X, mu)
    total = contact(surfaces, separation=apart, theory=Mbma(rtol=RTOL))
    unit = surfaces.q0 * surfaces.s
    click.echo(f"\nExported C, {' '.join(FLAGS[1:])} -march=native")
    for name, entries, found, right in (
        ("islands", POINTS, islands.T[:2], (phi.phi_F, phi.phi_A)),
        (
            "totals",
            SURFACES,
            (unit * sums[:, 0], sums[:, 2]),
            (total.pressure, total.area),
        ),
    ):
        report(
            f"C, one of {entries} {name}",
            1e3 * microseconds(taken[f"C {name}"], entries),
            "ns",
        )
        most = 1.1 if name == "totals" else None
        report(
            "  time over the library's",
            1 / times_faster(taken, name, f"C {name}"),
            "x",
            at_most=most,
        )
        report(
            "  largest relative difference",
            np.abs(np.stack(found) / np.stack(right) - 1).max(),
            "",
        )
