"""Laws with a hardness as rows for other codes."""

import numpy as np
import pytest

from mbma_tables import Surface, contact
from mbma_tables.export.law_rows import describe_law
from mbma_tables.totals.conductance import conductance

SURFACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
OPTIONS = {"theory": "calibrated", "hardness": "1500 MPa", "pressures": ("1 MPa", "500 MPa"), "rtol": 1e-2}


def test_rows_of_a_law_with_a_hardness():
    law = describe_law(SURFACE, "100 GPa", stress_unit="MPa", **OPTIONS)
    # chords lie about the law by as much as they may miss it
    kept = law.y > 1.0
    u = 3.0 - law.x[kept]
    found = contact(SURFACE, mean_separation=u, E_star="100 GPa", theory="calibrated", hardness="1500 MPa")
    assert law.y[kept] == pytest.approx(1e3 * found.pressure, rel=1e-2)
    text = " ".join(law.comments)
    assert "hardness = 1500 MPa, plasticity index 3.61" in text
    elastic = describe_law(SURFACE, "100 GPa", stress_unit="MPa", theory="calibrated", rtol=1e-2)
    assert "elastic: within 5% in area for hardnesses from 4922 MPa on" in " ".join(elastic.comments)


def test_conductance_is_not_the_slope_of_loading():
    law = describe_law(
        SURFACE, "100 GPa", stress_unit="MPa", quantity="conductance", conductivity=20.0, conductivity_unit="mW/(mm K)",
        **OPTIONS,
    )  # fmt: skip
    some = law.x > 2.0
    found = contact(SURFACE, pressure=law.x[some], E_star=100e3, theory="calibrated", hardness=1500.0)
    assert law.y[some] == pytest.approx(conductance(found.unloading_stiffness, 20.0, 100e3), rel=1e-2)
    assert (np.asarray(found.unloading_stiffness) > 1.1 * found.stiffness).all()
