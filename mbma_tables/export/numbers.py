"""Every number that the model needs in another language, by name, and the comment block that each file opens with."""

from __future__ import annotations

import dataclasses
import math
import textwrap

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.formulas.file import Form, get_form, shipped_formulas
from mbma_tables.islands import height_integrals as heights
from mbma_tables.models import universal_kernel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.moments import MAX_ZETA_1, MIN_ZETA_1
from mbma_tables.surfaces.readings import Reading
from mbma_tables.tablefiles.schema import TableContent
from mbma_tables.totals import gauss_kronrod as quadrature
from mbma_tables.totals import intervals
from mbma_tables.totals import kernel as lookup
from mbma_tables.totals import universal_sum as looked_up

WIDTH = 108  # of the comment block's text
FORM = "standard"  # that of tier "formula"
LEAST_RTOL, LARGEST_RTOL = 1e-11, 0.1  # as `contact` allows
LICENCE = (
    "SPDX-License-Identifier: BSD-3-Clause",
    "Copyright (c) 2026, mbma_tables contributors",
    "Redistribution and use in source and binary forms, with or without modification, are permitted as long as this "
    "notice is kept. The software is provided as is, without any warranty.",
)
CONVENTIONS = (
    "Conventions: force is per nominal area, F/A0, in the unit of E_star (F/(A0 E*) where that is 1), with 1/E* = "
    "(1 - nu1^2)/E1 + (1 - nu2^2)/E2; area is A/A0. Any consistent unit of length. The gap is the separation d from "
    "the mid-plane of the rough surface to the rigid plane, -h_max <= d; contact starts at d = h_max. The mean "
    "separation is u = (h_max + d)/2. Geometry and X, mu are as the table's documentation has them: heights in "
    "units of s = h_rms/sqrt(1 - zeta_1^(-2 H)), lengths in 1/q0, zeta_1 = q1/q0.",
    "Outside the table there is no answer, only a status: nothing is clamped or extrapolated. Below the smallest mu "
    "the logarithm of the ratio to a rigid sphere is proportional to mu, within the stated error.",
)


@dataclasses.dataclass(frozen=True)
class Numbers:
    """What the model needs: flags and counts, single numbers, arrays, and the closed form."""

    whole: dict[str, int]
    scalars: dict[str, float]
    arrays: dict[str, FloatArray]
    form: Form


def collect(model: UniversalModel, reading: Reading) -> Numbers:
    """The model's numbers, from the modules that use them here."""
    coefficients, errors, axes = model.kernel
    divisor, beta, phi, floor_d, floor_u, offset, summits = reading.numbers
    form = get_form(FORM)
    X_low, X_high, X_offset, X_start, X_rate, mu_low, mu_high, mu_start, mu_rate, cells_X, cells_mu = axes
    return Numbers(
        whole={
            "ROWS": coefficients.shape[0],
            "COLUMNS": coefficients.shape[1],
            "ERROR_ROWS": errors.shape[0],
            "ERROR_COLUMNS": errors.shape[1],
            "OFFSET": int(offset),
            "SUMMITS": int(summits),
            "PRINTED_JACOBIAN": int(reading.jacobian == "printed"),
            "MOST_INTERVALS": intervals.MOST_INTERVALS,
        },
        scalars={
            "PI": math.pi,
            "X_LOW": X_low,
            "X_HIGH": X_high,
            "X_OFFSET": X_offset,
            "X_START": X_start,
            "X_RATE": X_rate,
            "MU_LOW": mu_low,
            "MU_HIGH": mu_high,
            "MU_START": mu_start,
            "MU_RATE": mu_rate,
            "ERROR_CELLS_X": cells_X,
            "ERROR_CELLS_MU": cells_mu,
            "SECOND_ORDER": universal_kernel.SECOND_ORDER,
            "RADIUS": spectrum.RADIUS,
            "BROADENING": spectrum.BROADENING,
            "DIVISOR": divisor,
            "BETA": beta,
            "PHI": phi,
            "FLOOR_D": floor_d,
            "FLOOR_U": floor_u,
            "LEAST_ZETA_1": max(MIN_ZETA_1, floor_u),
            "LARGEST_ZETA_1": MAX_ZETA_1,
            "STRETCH": intervals.STRETCH,
            "SMALL_ANGLE": intervals.SMALL_ANGLE,
            "NARROW": intervals.NARROW,
            "SAFETY": intervals.SAFETY,
            "SMALL_POWER": lookup.SMALL_POWER,
            "SMALL_WIDTH": lookup.SMALL_WIDTH,
            "QUADRATURE_SHARE": looked_up.QUADRATURE_SHARE,
            "FORMULA_X_LOW": form.range["X"][0],
            "FORMULA_X_HIGH": form.range["X"][1],
            "FORMULA_MU_HIGH": form.range["mu"][1],
            "FORMULA_ERROR": max(form.largest_error(name) for name in form.outputs),
            "LEAST_RTOL": LEAST_RTOL,
            "LARGEST_RTOL": LARGEST_RTOL,
        },
        arrays={
            "NODES_21": quadrature.NODES,
            "KRONROD_21": quadrature.KRONROD,
            "GAUSS_21": quadrature.GAUSS,
            "NODES_31": intervals.NODES_31,
            "KRONROD_31": intervals.KRONROD_31,
            "GAUSS_31": intervals.GAUSS_31,
            # F_1, F_3/2, F_2, F_5/2: rows are the pieces of `locate`, columns the powers
            "HEIGHT_INTEGRALS": np.stack([heights._ONE, heights._THREE_HALVES, heights._TWO, heights._FIVE_HALVES]),
            "ERRORS": errors,
            # F and A side by side, mu before X
            "COEFFICIENTS": coefficients.ravel(),
        },
        form=form,
    )


def describe(content: TableContent, reading: Reading, title: str, usage: str) -> list[str]:
    """Lines of the comment block: what the file is and what made it, range, error, conventions, licence."""
    from mbma_tables import __version__

    found = content.attributes
    X, mu = content.axes
    worst, seen = (
        max(float(found[f"{which}largest_error_{name}"]) for name in ("F", "A")) for which in ("", "visited_")
    )
    divisor, beta, phi, floor_d, floor_u, offset, summits = reading.numbers
    form = get_form(FORM)
    paragraphs = (
        title,
        f"Written by mbma_tables {__version__}. {usage}",
        "MBMA model of rough contact (Guo, Ma and Zhu): Phi_F and Phi_A of a contact island over (X, mu) by a quintic "
        "spline or a closed form, islands of a self-affine surface, and the surface's force and area at a gap.",
        f"Reading: {reading.name} (density divisor {divisor:.17g}, beta {beta:.17g}, phi {phi:g}, floors {floor_d:g} "
        f"and {floor_u:g}, Jacobian {reading.jacobian}, offset {'on' if offset else 'off'}, sigma of "
        f"{'summits' if summits else 'all heights'}).",
        f"Table: data {found['values_sha256']}",
        f"physics {found['physics_sha256']}",
        f"Range: {X.low:g} <= X <= {X.high:g}, 0 <= mu <= {mu.high:g}; H in (0, 1], zeta_1 up to {MAX_ZETA_1:g}.",
        f"Largest relative error of the table against the solved model: {worst:.2g} on {found['certificate_points']} "
        f"held-out points, {seen:.2g} at islands of random surfaces; each answer carries its own bound.",
        f"Closed form: {form.title}, data {shipped_formulas().data_hash}",
        f"for {form.range['X'][0]:g} <= X <= {form.range['X'][1]:g} and mu <= {form.range['mu'][1]:g}; largest "
        f"relative error {form.largest_error('phi_F'):.2g} of Phi_F, {form.largest_error('phi_A'):.2g} of Phi_A.",
        *CONVENTIONS,
        *LICENCE,
    )
    return [line for text in paragraphs for line in textwrap.wrap(text, WIDTH, break_long_words=False)]
