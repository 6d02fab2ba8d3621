"""Measured maps pressed flat, from a file made here to what docs/fidelity.md reads."""

import numpy as np
import pytest
from click.testing import CliRunner

from generate import distances
from generate.boundary_elements.studies import LARGEST, measured_maps, middle
from mbma_tables import Surface, contact
from mbma_tables.surfaces.maps import prepared
from mbma_tables.surfaces.surface import MeasuredSurface


def test_the_middle_of_a_map_is_kept():
    heights = np.random.default_rng(0).standard_normal((40, LARGEST + 10))
    kept = middle(prepared(heights, {"dx": 1.0, "periodic": False, "detrend": "mean"})).heights
    assert kept.shape == (40, LARGEST)
    assert kept - kept[0, 0] == pytest.approx(heights[:, 5:-5] - heights[0, 5], abs=1e-12)


def test_a_file_of_heights_becomes_a_case(tmp_path):
    pytest.importorskip("tamaas")
    pytest.importorskip("SurfaceTopography")
    x = np.linspace(0, 2 * np.pi, 33)[:-1]
    noise = np.random.default_rng(1).standard_normal((32, 32))
    smooth = np.fft.irfft2(np.fft.rfft2(noise) * (np.arange(17) < 5) * (abs(np.fft.fftfreq(32, 1 / 32)) < 5)[:, None])
    grid = smooth + np.sin(x)[:, None]
    np.savetxt(tmp_path / "own.asc", grid)
    text = (tmp_path / "own.asc").read_text()
    (tmp_path / "own.asc").write_text("# Width: 1 m\n# Height: 1 m\n# Value units: m\n" + text)
    done = CliRunner().invoke(measured_maps, [str(tmp_path / "own.asc"), "--data", str(tmp_path / "own.nc")])
    assert done.exit_code == 0, done.output
    one = distances.measured("own", tmp_path / "own.nc")
    # what is kept gives the law that the map itself gives
    surface = Surface.from_map(grid, 1 / 32, periodic=False, model="measured")
    force = one.force[one.area > 0.02] * surface.bearing.gradient
    mine = distances.THEORIES["calibrated, map"](one).area(one.force[one.area > 0.02])
    assert mine == pytest.approx(contact(surface, pressure=force, theory="calibrated").area, rel=0.02)
    assert isinstance(one.surface, MeasuredSurface)  # no self-affine surface stands in for it
