"""Variants that add areas of islands as a cover, and the one that is fitted to boundary elements."""

import csv
import dataclasses
import pathlib

import numpy as np
import pytest

from mbma_tables import InputError, Surface, contact, contact_law
from mbma_tables.export.code import write_code
from mbma_tables.surfaces.variants import FITTED, REPORTED

DATA = pathlib.Path(__file__).parents[2] / "docs" / "data" / "boundary_elements.csv"
COVER = dataclasses.replace(REPORTED, name="cover", addition="cover")
SURFACE = Surface(0.8, 0.01, 2.0, 1.0, 3.0)
GAPS = np.array([2.9, 2.0, 0.5, -1.0, -2.9])


def test_cover_is_what_islands_at_random_leave_uncovered():
    added, covered = (contact(SURFACE, separation=GAPS, variant=r, derivatives=True) for r in (REPORTED, COVER))
    assert covered.pressure == pytest.approx(added.pressure, rel=1e-15)
    assert covered.area == pytest.approx(-np.expm1(-added.area), rel=1e-15)
    for name, slope in added.area_by.items():
        assert covered.area_by[name] == pytest.approx(slope * np.exp(-added.area), rel=1e-14)
    law = contact_law(SURFACE, variant=COVER)
    assert law.area(separation=GAPS) == pytest.approx(covered.area, rel=2e-8)
    assert not any("added" in reason for reason in covered.reasons)


def test_exported_code_takes_no_cover(tmp_path):
    with pytest.raises(InputError, match="takes their cover"):
        write_code("c", tmp_path, variant=FITTED)


def test_addition_is_one_of_two():
    with pytest.raises(InputError, match="addition must be"):
        dataclasses.replace(REPORTED, addition="integral")


def test_fitted_area_at_equal_force_follows_boundary_elements():
    """The surfaces of the fit; docs/fidelity.md has those that it did not see."""
    with DATA.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    errors = []
    keys = ("hurst", "L_over_lambda0", "zeta_1", "seed")
    for seed in sorted({tuple(row[k] for k in keys) for row in rows if row["L_over_lambda0"] != "1"}):
        own = [row for row in rows if tuple(row[k] for k in keys) == seed]
        surface = Surface(float(seed[0]), 1.0, float(seed[2]), 1.0, float(own[0]["h_max_over_h_rms"]))
        found = contact(surface, separation=np.linspace(-1, 0.99, 200) * surface.h_max, variant="fitted", rtol=1e-5)
        branch = slice(int(np.argmax(found.pressure)), None)
        log_force, log_area = (np.log(x[branch][::-1]) for x in (found.pressure / surface.rms_gradient, found.area))
        for row in own:
            force, area = float(row["force"]), float(row["area"])
            if 0.01 < area < 0.97 and np.log(force) < log_force[-1]:
                errors.append(np.interp(np.log(force), log_force, log_area) - np.log(area))
    assert len(errors) > 400
    assert np.quantile(np.abs(errors), 0.9) < 0.06
    assert abs(np.mean(errors)) < 0.02


def test_a_surface_below_the_floors_is_refused():
    for answer in (contact_law, lambda *given, **options: contact(*given, separation=1.0, **options)):
        with pytest.raises(InputError, match=r"greater than 5\.14, the variant's floor of zeta_u"):
            answer(Surface(0.8, 1.0, 5.0, 1.0, 3.0), variant="fitted")
