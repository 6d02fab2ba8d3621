"""Small tables, made in a second without the generator, and ways to spoil the files that they are written to."""

import functools
import hashlib

import netCDF4
import numpy as np
from scipy.ndimage import maximum_filter

from mbma_tables import greenwood_tripp
from mbma_tables.islands.four_numbers import band_fields, from_axes, hat_scales, to_axes
from mbma_tables.surfaces.readings import REPORTED
from mbma_tables.tablefiles.interpolate import fill_2d, fill_4d
from mbma_tables.tablefiles.netcdf import SEAL, SEAL_LENGTH
from mbma_tables.tablefiles.schema import DEGREES, FUNCTIONS, ISLAND4D, UNIVERSAL, Axis, TableContent, grid_labels
from mbma_tables.tablefiles.splines import coefficients

RTOL = 1e-10
POINTS = 12
AXES = {
    UNIVERSAL: (
        Axis("X", "approach over sigma", "log", 10.0, -2.0, 6.0, 12),
        Axis("mu", "stiffness of the roughness", "log", 0.0, 1e-6, 1e2, 10),
    ),
    ISLAND4D: (
        Axis("X", "approach over sigma", "log", 3.0, 0.5, 26.0, 9),
        Axis("spread", "zeta_u/zeta_d - 1", "log", 0.0, 1e-6, 100.0, 10),
        Axis("sphere", "(1.25/zeta_d)^(4 - 2 hurst)", "linear", 0.0, 0.0, 1.0, 6),
        Axis("hurst", "Hurst exponent", "linear", 0.0, 0.3, 1.0, 7),
    ),
}


def arguments(kind, coordinates):
    """(X, mu) at coordinates of the axes."""
    if kind == UNIVERSAL:
        return coordinates
    X, *rest = coordinates
    return X, band_fields(*rest, REPORTED)[0]


def log_ratio(kind, coordinates):
    X, mu = arguments(kind, coordinates)
    solved = greenwood_tripp.solve(X, mu, rtol=RTOL)
    return np.log(np.stack([solved.phi_F, solved.phi_A]) / greenwood_tripp.rigid_sphere(X, mu))


def at_positions(coefs, positions):
    """The spline at positions in node units, flat, shape (2, entries)."""
    out = np.empty((2, positions[0].size))
    if len(positions) == 2:
        fill_2d(coefs, *positions, out)
    else:
        fill_4d(coefs, np.ascontiguousarray(positions), out)
    return out


def _conformance(kind, axes, coefs):
    rng = np.random.default_rng(3)
    places = [axis.coordinate(rng.uniform(0, axis.nodes - 1, POINTS)) for axis in axes]
    if kind == UNIVERSAL:
        given = dict(zip(("X", "mu"), places, strict=True))
        (X, mu), scales, tolerance = places, np.ones((2, POINTS)), np.full(POINTS, 1e-11)
    else:
        X, spread, sphere, hurst = places
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
        places, X, mu = list(found.axes), found.X, found.mu
        scales = np.stack(hat_scales(found.spread, zeta_d, hurst, found.sigma, REPORTED))
        tolerance = 1e-11 + 1e-15 * (1 + X) / found.sigma
    positions = [axis.position(x) for axis, x in zip(axes, places, strict=True)]
    exact = greenwood_tripp.solve(X, mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    own = scales * np.exp(at_positions(coefs, positions)) * greenwood_tripp.rigid_sphere(X, mu)
    given |= dict(zip([f"table_{f}" for f in FUNCTIONS], own, strict=True))
    given |= dict(zip([f"exact_{f}" for f in FUNCTIONS], scales * [exact.phi_F, exact.phi_A], strict=True))
    return given | {"tolerance": tolerance}


@functools.cache
def small_table(kind):
    """A table of few nodes; its local error is three times the largest at the middles of the cells nearby."""
    axes = AXES[kind]
    degree = DEGREES[kind]
    grid = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    values = np.moveaxis(log_ratio(kind, grid), 0, -1)
    coefs = coefficients(values, degree, len(axes))
    middles = np.meshgrid(*(np.arange(axis.nodes - 1) + 0.5 for axis in axes), indexing="ij")
    flat = [m.ravel() for m in middles]
    truth = log_ratio(kind, [axis.coordinate(p) for axis, p in zip(axes, flat, strict=True)])
    error = np.abs(np.expm1(at_positions(coefs, flat) - truth)).T.reshape(*middles[0].shape, 2)
    auxiliary = grid_labels(axes, degree)
    if kind == ISLAND4D:
        fields = band_fields(*np.meshgrid(*(axis.values for axis in axes[1:]), indexing="ij"), REPORTED)
        for name, field in zip(("mu", "sigma"), fields[:2], strict=True):
            auxiliary[name] = (("spread", "sphere", "hurst"), field, {"long_name": name, "units": "1"})
    return TableContent(
        kind=kind,
        axes=axes,
        log_ratio=values,
        coefficients=coefs,
        local_error=3 * maximum_filter(error, size=(*(3 for _ in axes), 1), mode="nearest") + RTOL,
        auxiliary=auxiliary,
        conformance=_conformance(kind, axes, coefs),
        attributes={
            "title": f"a small table of kind {kind}",
            "source": "tests",
            "references": "none",
            "comment": "for tests",
            "reading": "any" if kind == UNIVERSAL else "reported",
            "certificate_points": 1,
            "largest_error_F": float(error[..., 0].max()),
            "largest_error_A": float(error[..., 1].max()),
        },
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
