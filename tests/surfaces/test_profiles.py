"""Line scans: traces of surfaces that are known."""

import dataclasses

import numpy as np
import pytest
from helpers import refusals, topographies

from generate.machined import profiles as measured
from mbma_tables import Surface, contact
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces import profiles
from mbma_tables.surfaces.surface import assumptions

POINTS = 8000
SHORTEST = 2 * np.pi / 6  # six sampling steps a wave


def plateau(hurst, roll_off, longest):
    """C(q) of a surface with a roll-off, zero outside [longest, SHORTEST]."""
    return lambda q: np.where(
        (q >= longest) & (q <= SHORTEST), np.maximum(q, roll_off) ** (-2 - 2 * hurst), 0.0
    )


def trace(C, longest, seed, points=POINTS, waves=3000):
    """A line across an isotropic surface that is a sum of plane waves in random directions."""
    rng = np.random.default_rng(seed)
    edges = np.geomspace(longest, SHORTEST, waves + 1)
    q = edges[:-1] * (edges[1:] / edges[:-1]) ** rng.random(waves)
    variance = 2 * np.pi * C(q) * q * np.diff(edges)
    along = q * np.cos(2 * np.pi * rng.random(waves))
    amplitude = np.sqrt(2 * variance * rng.exponential(size=waves)) * np.exp(
        2j * np.pi * rng.random(waves)
    )
    block = 100
    coarse = np.exp(1j * block * np.outer(np.arange(points // block), along)) * amplitude
    return (coarse @ np.exp(1j * np.outer(np.arange(block), along)).T).real.ravel()


ROLL_OFF = 2 * np.pi * 40 / POINTS


def rough_line(seed=5):
    return trace(plateau(0.6, ROLL_OFF, ROLL_OFF / 4), ROLL_OFF / 4, seed)


def moments(C, longest, *orders):
    """2 pi integral C q^(1 + order) dq."""
    edges = np.geomspace(longest, SHORTEST, 4001)
    q = np.sqrt(edges[1:] * edges[:-1])
    return [
        float(np.sum(2 * np.pi * C(q) * q ** (1 + order) * np.diff(edges)))
        for order in orders
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("hurst", "waves"), [(0.8, 20), (0.4, 40)])
def test_fifty_traces(hurst, waves):
    # roll-off at `waves` waves a trace
    roll_off = 2 * np.pi * waves / POINTS
    C = plateau(hurst, roll_off, roll_off / 8)
    m0, m2 = moments(C, roll_off / 8, 0, 2)
    found = [
        Surface.from_profile(trace(C, roll_off / 8, seed), 1.0) for seed in range(50)
    ]
    for name, truth, bar in (("h_rms", m0**0.5, 0.05), ("rms_gradient", m2**0.5, 0.10)):
        ratio = np.array([float(getattr(surface, name)) for surface in found]) / truth
        stated = np.array(
            [
                s[name]
                for surface in found
                for s in surface.provenance
                if s["step"] == "errors"
            ]
        )
        assert ratio.mean() == pytest.approx(1, abs=bar)
        # as wide as they scatter; 50 of them know their own scatter to 10%
        assert stated.mean() == pytest.approx(ratio.std(), rel=0.35)
        inside = np.abs(ratio - 1) < 2 * stated
        assert inside.mean() > 0.84
    # the spectrum between roll-off and end
    q = np.geomspace(1.5 * roll_off, SHORTEST / 1.5, 12)
    mean = np.mean([np.log(surface.power_spectrum(q)) for surface in found], axis=0)
    np.testing.assert_allclose(np.exp(mean) / C(q), 1, atol=0.25)


def test_height_variance_and_gradient_are_the_lines_own_in_any_unit():
    line = rough_line()
    surface = Surface.from_profile(line, 1.0)
    x = np.arange(POINTS)
    flat = line - np.polyval(np.polyfit(x, line, 1), x)
    assert surface.h_rms == pytest.approx(flat.std(), rel=1e-4)
    # finite differences see six points a wave a little flatter
    assert surface.m2 == pytest.approx(np.mean(np.gradient(flat)[1:-1] ** 2), rel=0.2)
    assert surface.h_max == pytest.approx(flat.max())
    other = Surface.from_profile(1e-9 * line, "1e3 nm", unit="m")
    assert other.h_rms == pytest.approx(1e-9 * surface.h_rms, rel=1e-9)
    assert other.rms_gradient == pytest.approx(1e-3 * surface.rms_gradient, rel=1e-4)
    assert other.unit == "m"


def test_what_one_trace_cannot_tell():
    line = np.cumsum(np.random.default_rng(2).standard_normal(4000))
    told = [entry.get("told", "") for entry in Surface.from_profile(line, 1.0).provenance]
    assert any("cannot tell anisotropy" in text for text in told)
    assert any("h_rms grows with its length" in text for text in told)


def test_files_and_scans(tmp_path):
    library = topographies()
    line = rough_line()
    plain = Surface.from_profile(line, 0.5)
    np.savetxt(tmp_path / "a.csv", np.c_[0.5 * np.arange(POINTS), line], delimiter=",")
    np.save(tmp_path / "a.npy", line)
    for found in (
        Surface.from_profile(tmp_path / "a.csv"),
        Surface.from_profile(tmp_path / "a.npy", 0.5),
        Surface.from_profile(library.UniformLineScan(line, 0.5 * POINTS)),
    ):
        assert found.h_rms == pytest.approx(plain.h_rms, rel=1e-9)
        assert found.rms_gradient == pytest.approx(plain.rms_gradient, rel=1e-4)
        assert "np." not in str(found.provenance)
    sides = rf"got shape \({POINTS},\) and \[{0.5 * POINTS}\]; .*from_profile takes line scans"
    with pytest.raises(InputError, match=sides):
        Surface.from_map(library.UniformLineScan(line, 0.5 * POINTS))
    with pytest.raises(InputError, match="from_map takes maps"):
        Surface.from_profile(library.Topography(np.eye(40), (1, 1)))


test_refused = refusals(
    lambda line: Surface.from_profile(line, 1.0),
    (np.eye(40), InputError, "one-dimensional"),
    (np.arange(20.0), InputError, "20 points have too few wavelengths"),
    (np.arange(200.0), InputError, "flat"),
)


@pytest.mark.parametrize("cut", [8.0, 20.0])
def test_a_cut_line_is_that_of_the_cut_surface(cut):
    # waves along the line that are longer than the cut-off are in part of oblique shorter ones
    C = plateau(0.6, ROLL_OFF, ROLL_OFF / 4)
    ratios = []
    for seed in range(4):
        found = Surface.from_profile(rough_line(seed), 1.0, short_cutoff=cut)
        m2, m4 = moments(
            lambda q: np.where(q <= 2 * np.pi / cut, C(q), 0.0), ROLL_OFF / 4, 2, 4
        )
        assert found.q1 == pytest.approx(2 * np.pi / cut)
        ratios.append((found.rms_gradient / np.sqrt(m2), found.m4 / (0.375 * m4)))
    gradient, curvature = np.mean(ratios, axis=0)
    assert gradient == pytest.approx(1, abs=0.03)
    assert curvature == pytest.approx(1, abs=0.08)


def test_points_of_a_line_go_forward(tmp_path):
    pytest.importorskip("SurfaceTopography")
    x = np.random.default_rng(1).random(100)
    z = np.random.default_rng(2).normal(size=100).cumsum()
    for places, message in (
        (x, "must be in the order of rising x"),
        (np.arange(100)[::-1], "x and y rising, got -100"),
    ):
        np.savetxt(tmp_path / "line.txt", np.c_[places, z])
        with pytest.raises(InputError, match=message):
            Surface.from_profile(tmp_path / "line.txt")


@pytest.mark.parametrize("wave", [np.sign, np.abs, lambda sine: sine + 0.1 * sine**9])
def test_a_line_of_few_waves_keeps_its_variance_and_gradient(wave):
    # most bins of its spectrum hold none
    line = wave(np.sin(2 * np.pi * (np.arange(512) + 0.5) / 64))
    slope = np.fft.irfft(2j * np.pi * np.fft.rfftfreq(512, 0.5) * np.fft.rfft(line))
    found = Surface.from_profile(line, 0.5, periodic=True)
    assert found.h_rms == pytest.approx(line.std(), rel=1e-3)
    assert found.rms_gradient == pytest.approx(np.sqrt(2) * slope.std(), rel=1e-3)


def test_sums_over_panels_do_not_depend_on_blocks(monkeypatch):
    q = np.arange(1.0, 500.0)
    fine = np.geomspace(0.5, 500.0, 81)
    width = np.random.default_rng(4).random(q.size)
    starts = np.array([0, 3, 40, 200])
    sides = 4 * np.pi * np.sqrt(np.maximum(fine**2 - q[:, None] ** 2, 0))
    each = width[:, None] * np.diff(sides, axis=1)
    expected = np.add.reduceat(each, starts, axis=0)
    for block in (7, 10_000):
        monkeypatch.setattr(profiles, "BLOCK", block)
        np.testing.assert_allclose(
            profiles._panel_sums(fine, q, width, starts), expected, rtol=1e-12
        )


def test_rows_of_the_data_are_still_those_that_are_computed():
    rows = [row for row in measured.read() if row["sides"] == "8"]
    for maps in (measured.machined(8, 4), measured.elastic(8, 4)):
        one = next(maps)
        of_map = [row for row in rows if row["map"] == one.name]
        again = list(measured.rows_of(one, ((8, 1),)))
        assert len(again) == len(of_map) > 0
        for before, now in zip(of_map, again, strict=True):
            for name in ("error", "scatter"):
                was, found = float(before[name]), float(now[name])
                assert found == pytest.approx(was, rel=0.02, abs=2e-3, nan_ok=True)
            for name in ("family", "way", "quantity", "area", "valid"):
                assert str(now[name]) == before[name]


class TestSeveral:
    """Several traces of one surface, along and across its lay."""

    def test_each_counts_by_its_length(self):
        short, long = rough_line(1)[:2000], rough_line(2)
        alone = [Surface.from_profile(line, 0.5) for line in (short, long)]
        both = Surface.from_profile([short, long], 0.5)
        for name in ("h_rms", "rms_gradient"):
            squares = [float(getattr(one, name)) ** 2 for one in alone]
            expected = np.average(squares, weights=[short.size, long.size]) ** 0.5
            # each spectrum ends where it has a thousandth of its squared gradient
            assert getattr(both, name) == pytest.approx(expected, rel=2e-3)
        assert both.h_max == max(one.h_max for one in alone)
        twice = Surface.from_profile([long, long], 0.5)
        assert twice.rms_gradient == pytest.approx(alone[1].rms_gradient, rel=1e-4)

    def test_replicas_differ_as_traces_do(self):
        lines = [rough_line(seed) for seed in range(12)]
        found = [Surface.from_profile(line, 1.0) for line in lines]
        for name in ("h_rms", "rms_gradient", "alpha"):
            of_traces = np.std([np.log(getattr(one, name)) for one in found], ddof=1)
            of_replicas = np.mean(
                [np.std(np.log([getattr(s, name) for s in one.scans])) for one in found]
            )
            # twelve traces know their standard deviation to 21%
            assert 1 / 1.6 < of_replicas / of_traces < 1.8
        # m4 of so few plane waves varies more than that of a Gaussian process, whose variance
        # is the integral of its squared spectrum, twice under a window
        q = np.linspace(0, SHORTEST, 1001)[1:-1]
        C = plateau(0.6, ROLL_OFF, ROLL_OFF / 4)
        # by the Abel transform of C over q' = q cosh t
        cosh = np.cosh(np.linspace(0, 8, 8001))
        powers = np.array([one**5 * np.sum(C(one * cosh) * cosh) for one in q])
        expected = np.sqrt(2 * 2 * np.pi / POINTS * np.sum(powers**2) / q[0])
        of_m4 = [np.std(np.log([s.m4 for s in one.scans])) for one in found]
        assert np.mean(of_m4) == pytest.approx(expected / np.sum(powers), rel=0.25)
        many = Surface.from_profile(lines[:9], 1.0)
        spread = np.std(np.log([scan.rms_gradient for scan in many.scans]))
        of_one = np.std(np.log([scan.rms_gradient for scan in found[0].scans]))
        assert spread == pytest.approx(of_one / 3, rel=0.45)

    def test_their_spread_adds_to_the_scatter(self):
        lines = [0.01 * rough_line(seed) for seed in range(3)]
        surface = Surface.from_profile(lines, 1.0, isotropic=True)
        clean = dataclasses.replace(surface, provenance=())
        found = [
            contact(one, area=[0.02, 0.2], theory="calibrated")
            for one in (clean, dataclasses.replace(clean, scans=()))
        ]
        pressures = found[0].pressure
        areas = [
            contact(
                dataclasses.replace(scan, provenance=()),
                pressure=pressures,
                theory="calibrated",
            ).area
            for scan in surface.scans
        ]
        spread = np.std(np.log(areas), axis=0, ddof=1)
        added = np.sqrt(found[0].area_scatter ** 2 - found[1].area_scatter ** 2)
        assert added == pytest.approx(spread, rel=1e-3)
        assert (spread > 0.005).all()
        # what is made of it has the spread, too
        other = clean.combined(Surface(0.8, 0.05, 1.0, 0.05, 0.2))
        assert len(other.scans) == len(clean.scans)

    def test_traces_across_tell_the_lay(self):
        along = [rough_line(seed) for seed in range(2)]
        across = [rough_line(seed)[::2] for seed in range(5, 7)]
        found = Surface.from_profile(along, 1.0, across=across)
        # the second ones are twice as steep
        assert found.anisotropy == pytest.approx(2.0, rel=0.06)
        m2 = [Surface.from_profile(lines, 1.0).m2 for lines in (along, across)]
        assert found.m2 == pytest.approx(np.mean(m2), rel=0.01)
        assert not any("isotropy is assumed" in doubt for doubt in found.doubts)

    def test_isotropy_is_assumed_or_stated(self):
        line = rough_line()
        found = Surface.from_profile(line, 1.0)
        assert any("isotropy is assumed" in doubt for doubt in found.doubts)
        stated = Surface.from_profile(line, 1.0, isotropic=True)
        assert not any("isotropy is assumed" in doubt for doubt in stated.doubts)
        assert any("the surface is isotropic" in each for each in assumptions(stated))

    def test_a_trace_across_a_lay_contradicts_isotropy(self):
        place = np.arange(POINTS)
        grooves = 3 * np.abs(np.sin(np.pi * place / 60))
        rough = 0.2 * rough_line() / np.std(rough_line())
        turned = Surface.from_profile(grooves + rough, 1.0, isotropic=True)
        assert any("the surface has a lay" in doubt for doubt in turned.doubts)
        # waves of one length in all directions are the nearest to it that is isotropic
        rings = [
            rough + trace(lambda q: q > 0, q, 1, waves=300)
            for q in (0.98 * SHORTEST, 0.5)
        ]
        for line in (*rings, rough_line()):
            found = Surface.from_profile(line, 1.0, isotropic=True)
            assert not any("the surface has a lay" in doubt for doubt in found.doubts)

    def test_long_traces_of_a_tested_kind_are_valid(self):
        lines = [0.005 * rough_line(seed) for seed in range(4)]
        found = Surface.from_profile(lines, 1.0, isotropic=True)
        pressed = contact(found, area=[0.02, 0.2], theory="calibrated")
        assert pressed.valid.all(), pressed.reasons
        assert "the surface is isotropic" in repr(pressed)
        for other in (
            Surface.from_profile(lines, 1.0),
            Surface.from_profile(lines[:1], 1.0, isotropic=True),
            Surface.from_profile([np.exp(8 * one) for one in lines], 1.0, isotropic=True),
        ):
            assert not contact(other, area=0.1, theory="calibrated").valid
        # what other theories state has no sampling error
        assert not contact(found, area=0.1, theory="persson").valid

    def test_refusals(self):
        line = rough_line()
        with pytest.raises(InputError, match="isotropic=True is of traces in one"):
            Surface.from_profile(line, 1.0, across=line, isotropic=True)
        with pytest.raises(InputError, match="isotropic"):
            Surface.from_profile(line, 1.0, isotropic="yes")
        library = topographies()
        named = library.UniformLineScan(line, 1.0 * POINTS, unit="um")
        plain = library.UniformLineScan(line, 1.0 * POINTS)
        with pytest.raises(InputError, match="some traces have a unit"):
            Surface.from_profile([named, plain])
        finer = library.UniformLineScan(1e3 * line, 1e3 * POINTS, unit="nm")
        both = Surface.from_profile([named, finer])
        assert both.unit == "um"
        assert both.h_rms == pytest.approx(Surface.from_profile(named).h_rms, rel=1e-4)
        with pytest.raises(InputError, match="finite"):
            Surface.from_profile([line, np.append(line, np.inf)], 1.0)
        with pytest.raises(InputError, match="too few wavelengths"):
            Surface.from_profile([line, line[:20]], 1.0)
