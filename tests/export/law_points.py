"""Laws for the tests of exported laws, and points of them by the library."""

import dataclasses
import functools
import math

import numpy as np
from helpers import law_of_names
from helpers import needs as needs

from mbma_tables import ContactLaw, Surface
from mbma_tables.export.code.law_code import law_text
from mbma_tables.export.registry import targets
from mbma_tables.export.rows.solvers import FORMATS

# formats of rows of pressure
PLAIN = [name for name in FORMATS if targets()[name].takes_rows("pressure")]
POINTS = 10_000
# what agreement is asked of exported laws
VALUES = 1e-13
TANGENTS = 1e-11
CONDUCTIVITY = 3.0
KAPPA = 1.25
# h_max is a dyadic number, so that c = (h_max - d)/2 is exact
ROAD = Surface(0.8, 0.01, 2.0, 1.0, 3.0, unit="mm")
ASKED = {
    "mbma": (ROAD, {"theory": "mbma"}),
    "calibrated": (ROAD, {"theory": "calibrated"}),
    "hardened": (ROAD, {"theory": "calibrated", "hardness": 1.5}),
    "persson": (ROAD, {"theory": "persson"}),
    # its area turns down without blocking, and its slopes are flat where coefficients are rounded
    "flat": (Surface(0.23, 1.0, 1.5e4, 0.125, 0.1875, unit="mm"), {"theory": "mbma"}),
    "turning": (Surface(0.35, 1.0, 1e4, 0.125, 0.375, unit="mm"), {"theory": "mbma"}),
}


@dataclasses.dataclass(frozen=True)
class Points:
    """What a law answers at overclosures, by its own methods."""

    law: ContactLaw
    c: np.ndarray
    p: np.ndarray
    tangent: np.ndarray
    area: np.ndarray
    energy: np.ndarray
    leakage: np.ndarray
    c_turn: float

    def assert_equal(self, p, tangent, area, energy, leakage, close=VALUES):
        """Values as the law's, tangents as its slopes, of which those about a maximum are relative to p/c."""
        pairs = (
            (p, self.p),
            (area, self.area),
            (energy, self.energy),
            (leakage, self.leakage),
        )
        for found, known in pairs:
            np.testing.assert_allclose(found, known, rtol=close, atol=0)
        slope = np.maximum(np.abs(self.tangent), 1e-2 * self.p / np.abs(self.c))
        assert np.abs((np.asarray(tangent) - self.tangent) / slope).max() <= max(
            TANGENTS, close
        )

    def at(self, some):
        """Those of some overclosures."""
        names = ("c", "p", "tangent", "area", "energy", "leakage")
        return dataclasses.replace(
            self, **{name: getattr(self, name)[some] for name in names}
        )

    def pressures(self):
        """Pressures on the branch of first contact, but where pieces meet: they do so within the law's error alone."""
        return self.p[:POINTS][self.c[:POINTS] < self.c_turn]

    def assert_slopes(self, conductance, sheared):
        """Conductance and tangential stiffness by the unloading stiffness."""
        law, factor = self.law.unloading()
        slope = factor * np.asarray(law.stiffness(separation=self.law.h_max - 2 * self.c))
        allowed = 1e-11 * np.maximum(np.abs(slope), 1e-2 * self.p / np.abs(self.c))
        assert (np.abs(conductance * 13.3 / CONDUCTIVITY - slope) <= allowed).all()
        assert (np.abs(sheared * KAPPA - slope) <= allowed).all()

    def assert_inverse(self, c):
        """Overclosures at `pressures`: where the library has them, but for what pressure there leaves open."""
        wanted = self.pressures()
        d = self.law.h_max - 2 * np.asarray(c)
        back = self.law.separation(pressure=wanted)
        assert (
            np.abs(np.asarray(self.law.pressure(separation=d)) / wanted - 1).max()
            <= 1e-12
        )
        slope = np.asarray(self.law.stiffness(separation=back))
        known = (self.law.h_max - back) / 2
        assert (
            np.abs(c - known) <= 1e-12 * (np.abs(known) + np.abs(wanted / slope))
        ).all()


@functools.cache
def points(name):
    surface, options = ASKED[name]
    law = law_of_names(surface, "13.3 MPa", **options)
    h = law.h_max
    rng = np.random.default_rng(18)
    ends = math.isinf(law.highest)
    near = h - 2 * h * 10 ** rng.uniform(-12, -0.6, POINTS // 2)
    grid = 2.0**-30
    joints = h * np.array(
        [0.5, 0.25, 0.125, 0.75, 0.375, 0.5 + 2.0**-30, 0.5 - 2.0**-30, 1 - 2.0**-9]
    )
    rest = grid * np.floor(
        rng.uniform(law.lowest, h if ends else law.highest, POINTS // 2) / grid
    )
    c = (h - np.concatenate([near, rest, h - 2 * joints])) / 2
    d = h - 2 * c
    assert ((h - d) / 2 == c).all()
    turn = law.lowest if law.turning_point is None else law.turning_point
    found = law.values(separation=d)
    # NaN where the flow of a yielded contact is not known
    flow = np.asarray(law.leakage(separation=d))
    return Points(
        law,
        c,
        found.pressure,
        found.stiffness,
        found.area,
        found.energy,
        flow,
        (h - turn) / 2,
    )


def text(target, law, **options):
    surface, asked = ASKED[law]
    return law_text(target, surface, "13.3 MPa", **(asked | options))
