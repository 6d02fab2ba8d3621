"""Small tables, made in a second, and ways to spoil the files that they are written to."""

import dataclasses
import functools
import hashlib
import itertools

import netCDF4
import numpy as np
from scipy.ndimage import maximum_filter

from generate.tables.universal import cells_of
from mbma_tables import greenwood_tripp
from mbma_tables.islands.four_numbers import band_fields, from_axes, hat_scales, to_axes
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.readings import REPORTED
from mbma_tables.tablefiles.interpolate import fill_4d
from mbma_tables.tablefiles.netcdf import SEAL, SEAL_LENGTH
from mbma_tables.tablefiles.schema import (
    DEGREE,
    FUNCTIONS,
    UNIVERSAL,
    Axis,
    TableContent,
    labels_of_cells,
    labels_of_nodes,
)
from mbma_tables.tablefiles.splines import coefficients

RTOL = 1e-10
POINTS = 12
STRIPS = (-2.0, 0.5, 3.0, 6.0)
AXES = (
    Axis("X", "approach over sigma", "log", 3.0, 0.5, 26.0, 9),
    Axis("spread", "zeta_u/zeta_d - 1", "log", 0.0, 1e-6, 100.0, 10),
    Axis("sphere", "(1.25/zeta_d)^(4 - 2 hurst)", "linear", 0.0, 0.0, 1.0, 6),
    Axis("hurst", "Hurst exponent", "linear", 0.0, 0.3, 1.0, 7),
)


def log_ratio(coordinates):
    X, *rest = coordinates
    mu = band_fields(*rest, REPORTED)[0]
    solved = greenwood_tripp.solve(X, mu, rtol=RTOL)
    return np.log(np.stack([solved.phi_F, solved.phi_A]) / greenwood_tripp.rigid_sphere(X, mu))


def at_positions(coefs, positions):
    """The spline at positions in node units, flat, shape (2, entries)."""
    out = np.empty((2, positions[0].size))
    fill_4d(coefs, np.ascontiguousarray(positions), out)
    return out


def _points(given, X, mu, scales, own, tolerance):
    exact = greenwood_tripp.solve(X, mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    given |= dict(zip([f"table_{f}" for f in FUNCTIONS], own, strict=True))
    given |= dict(zip([f"exact_{f}" for f in FUNCTIONS], scales * [exact.phi_F, exact.phi_A], strict=True))
    return given | {"tolerance": tolerance}


def _conformance(axes, coefs):
    rng = np.random.default_rng(3)
    X, spread, sphere, hurst = [axis.coordinate(rng.uniform(0, axis.nodes - 1, POINTS)) for axis in axes]
    sphere = np.maximum(sphere, 1e-6)
    zeta_d = from_axes(sphere, hurst)
    sigma = band_fields(spread, sphere, hurst, REPORTED)[1]
    given = {
        "delta_over_h_rms": (X * sigma + 1) * zeta_d**-hurst,
        "zeta_d": zeta_d,
        "zeta_u": zeta_d * (1 + spread),
        "hurst": hurst,
    }
    found = to_axes(given["delta_over_h_rms"], zeta_d, given["zeta_u"], hurst, REPORTED)
    scales = np.stack(hat_scales(found.spread, zeta_d, hurst, found.sigma, REPORTED))
    positions = [axis.position(x) for axis, x in zip(axes, found.axes, strict=True)]
    own = scales * np.exp(at_positions(coefs, positions)) * greenwood_tripp.rigid_sphere(found.X, found.mu)
    return _points(given, found.X, found.mu, scales, own, 1e-11 + 1e-15 * (1 + found.X) / found.sigma)


def _attributes(kind, error):
    return {
        "title": f"a small table of kind {kind}",
        "source": "tests",
        "references": "none",
        "comment": "for tests",
        "reading": "any" if kind == UNIVERSAL else "reported",
        "certificate_points": 1,
        "largest_error_F": float(error[..., 0].max()),
        "largest_error_A": float(error[..., 1].max()),
    }


def _small_universal():
    ends = list(itertools.pairwise(STRIPS))
    rows = np.concatenate([cells_of(*strip, 100.0, 1e-5, RTOL) for strip in ends])
    axes = Axis("X", "approach over sigma", "linear", 0.0, *STRIPS[:: len(ends)], 2)
    content = TableContent(
        kind=UNIVERSAL,
        axes=(axes, Axis("mu", "stiffness of the roughness", "linear", 0.0, 0.0, 100.0, 2)),
        coefficients=np.moveaxis(rows[:, 6:].reshape(-1, 2, 8, 8), 1, -1).copy(),
        local_error=3 * rows[:, 4:6] + RTOL,
        auxiliary=labels_of_cells(rows[:, :4].T),
        conformance={},
        attributes=_attributes(UNIVERSAL, rows[:, 4:6]),
    )
    rng = np.random.default_rng(3)
    X, mu = rng.uniform(-2, 6, POINTS), 10 ** rng.uniform(-6, 2, POINTS)
    own = np.stack(UniversalModel(content).answer(X, mu)[:2])
    points = _points({"X": X, "mu": mu}, X, mu, np.ones((2, POINTS)), own, np.full(POINTS, 1e-11))
    return dataclasses.replace(content, conformance=points)


@functools.cache
def small_table(kind):
    """A table of few nodes or cells; its local error is three times the largest that some points showed."""
    if kind == UNIVERSAL:
        return _small_universal()
    grid = np.meshgrid(*(axis.values for axis in AXES), indexing="ij")
    values = np.moveaxis(log_ratio(grid), 0, -1)
    coefs = coefficients(values, DEGREE, len(AXES))
    middles = np.meshgrid(*(np.arange(axis.nodes - 1) + 0.5 for axis in AXES), indexing="ij")
    flat = [m.ravel() for m in middles]
    truth = log_ratio([axis.coordinate(p) for axis, p in zip(AXES, flat, strict=True)])
    error = np.abs(np.expm1(at_positions(coefs, flat) - truth)).T.reshape(*middles[0].shape, 2)
    auxiliary = labels_of_nodes(AXES, values)
    fields = band_fields(*np.meshgrid(*(axis.values for axis in AXES[1:]), indexing="ij"), REPORTED)
    for name, field in zip(("mu", "sigma"), fields[:2], strict=True):
        auxiliary[name] = (("spread", "sphere", "hurst"), field, {"long_name": name, "units": "1"})
    return TableContent(
        kind=kind,
        axes=AXES,
        coefficients=coefs,
        local_error=3 * maximum_filter(error, size=(*(3 for _ in AXES), 1), mode="nearest") + RTOL,
        auxiliary=auxiliary,
        conformance=_conformance(AXES, coefs),
        attributes=_attributes(kind, error),
    )


def unseal(content):
    """The netCDF bytes of a table file."""
    return content[:-SEAL_LENGTH]


def seal(body):
    """A table file with a right checksum over any bytes."""
    return body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n"


def edited(path, source, edit):
    """At `path` the table file `source` after `edit(dataset)`, with a right checksum."""
    path.write_bytes(unseal(source))
    with netCDF4.Dataset(path, "r+") as dataset:
        edit(dataset)
    path.write_bytes(seal(path.read_bytes()))
    return path


def copied(path, source, leave_out="", change_type=()):
    """At `path` a copy of the netCDF file `source`, less one variable or with one in another type, sealed."""
    with netCDF4.Dataset("source", memory=unseal(source)) as old, netCDF4.Dataset(path, "w") as new:
        for name, dimension in old.dimensions.items():
            new.createDimension(name, dimension.size)
        for name, variable in old.variables.items():
            if name != leave_out:
                dtype = np.dtype(change_type[1] if change_type and change_type[0] == name else variable.dtype)
                order = "big" if dtype.byteorder == ">" else "little"
                made = new.createVariable(name, dtype, variable.dimensions, fill_value=False, endian=order)
                made.setncatts({n: variable.getncattr(n) for n in variable.ncattrs()})
                made[...] = variable[...]
        new.setncatts({n: old.getncattr(n) for n in old.ncattrs()})
    path.write_bytes(seal(path.read_bytes()))
    return path
