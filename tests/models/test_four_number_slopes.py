"""Derivatives of the four-number table where bands are narrow, and beside islands that it does not cover."""

import numpy as np
import pytest

from mbma_tables.islands.four_numbers import to_axes
from mbma_tables.models.tables import open_table, universal_model
from mbma_tables.surfaces.variants import REPORTED

ZETA_D, HURST, X = 3.7, 0.8, 3.0


def island(spread):
    """An island at X = 3 with that spread as rounded, and where it lies on the axes."""
    raw = [np.array([value]) for value in (1.0, ZETA_D, ZETA_D * (1 + spread), HURST)]
    raw[0] = ZETA_D**-HURST * (1 + X * to_axes(*raw, REPORTED).sigma)
    return raw, to_axes(*raw, REPORTED)


@pytest.mark.parametrize("power", range(-12, -1))
def test_narrow_bands(power):
    raw, place = island(10.0**power)
    found = open_table("island4d").lookup(*raw, derivatives=True)
    value, by_X, _ = universal_model().slopes(place.X, place.mu)
    for name in ("F", "A"):
        hat, own = getattr(found, f"{name}_hat"), getattr(found, f"{name}_by")
        # delta moves X alone
        wanted = ZETA_D**HURST / place.sigma * getattr(by_X, f"phi_{name}") / getattr(value, f"phi_{name}")
        assert own["delta_over_h_rms"] / hat == pytest.approx(wanted, rel=1e-4, abs=0)
        for number, end in ((1, "zeta_d"), (2, "zeta_u")):
            moved = []
            for sign in (1, -1):
                ends = [field.copy() for field in raw]
                ends[number] += sign * 0.01 * (raw[2] - raw[1])
                moved.append((ends[number], np.log(getattr(open_table("island4d").lookup(*ends), f"{name}_hat"))))
            (high, most), (low, least) = moved
            # a hundredth, squared
            assert own[end] / hat == pytest.approx((most - least) / (high - low), rel=3e-4, abs=0)


def test_islands_outside_warn_of_nothing():
    raw, _ = island(1e-3)
    deep = [np.concatenate([field, field]) for field in raw]
    # X = -9, which the axis cannot even place
    deep[0][1] = ZETA_D**-HURST - 3 * (raw[0][0] - ZETA_D**-HURST)
    found = open_table("island4d").lookup(*deep, outside="nan", derivatives=True)
    alone = open_table("island4d").lookup(*raw, derivatives=True)
    for name, values in found.F_by.items():
        assert values[0] == alone.F_by[name][0]
        assert np.isnan(values[1])
