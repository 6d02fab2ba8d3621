"""Configurations: what is allowed, and that whatever is not ends in one line, exit code 2 and nothing written."""

import numpy as np
import pytest
from click.testing import CliRunner

from generate.__main__ import main
from generate.tables.commands import TABLES
from generate.tables.configuration import LIMITS, MIN_NODES, MIN_SHIPPED_POINTS, TARGETS, load
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.four_numbers import band_fields
from mbma_tables.surfaces.variants import VARIANTS


def refused(kind, folder, *arguments):
    """What a refusal says; it is one line and leaves the folder as it was."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    result = CliRunner().invoke(main, ["tables", kind, "--workers", "1", *arguments])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stdout == ""
    assert result.stderr.startswith("generate: ")
    assert len(result.stderr.splitlines()) == 1
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    return result.stderr


def refused_file(kind, folder, text):
    path = folder / "own.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    message = refused(kind, folder, "--config", str(path), "--out", str(folder / "sub" / "table.nc"))
    assert not (folder / "sub").exists()
    assert "own.toml" in message
    return message


UNIVERSAL = [
    ("zzz = 1", "unknown key 'zzz'; known are "),
    ("[axes.Y]\nlow = 1", "unknown key 'Y'; known are X, mu"),
    ("[axes.X]\nlwo = 1e-3", "[axes.X]: unknown key 'lwo'; known are low, high"),
    ("[axes]\nX = [1, 2]", "[axes.X] must be a table of low, high, got [1, 2]"),
    ("kind = 'island4d'", "kind must be 'universal', got 'island4d'"),
    ("target = 1e-12", "target must be a number in [1e-11, 0.0003], got 1e-12"),
    ("target = 1e-3", "target must be a number in [1e-11, 0.0003], got 0.001"),
    ("max_nodes = 1e5", "max_nodes must be a whole number in"),
    ("certificate_points = 99", "certificate_points must be a whole number in [100, "),
    ("variant = 'rubbed'", "variant must be one of ['fitted', 'printed', 'reported']"),
    ("[axes.mu]\nhigh = 1e11", "axes.mu.high must be a number in [0, 1e+10]"),
    ("[axes.X]\nlow = 5.0\nhigh = 2.0", "axes.X must have low < high"),
    (b"variant = '\xff'", "is not a TOML file"),
    ("#" * 100_000, "has more than 65536 bytes"),
]
ISLAND4D = [
    ("[axes.hurst]\nhigh = 1.1", "axes.hurst.high must be a number in [0.01, 1], got 1.1"),
    ("[axes.hurst]\noffset = 1.0", "axes.hurst takes no offset"),
    ("[axes.X]\noffset = -0.5", "axes.X is logarithmic and needs low + offset > 0, got 0.5 and -0.5"),
    ("[axes.X]\noffset = 1e12", "axes.X must have low < high, far enough apart for its nodes to differ"),
    ("[axes.X]\nnodes = 7", "axes.X.nodes must be a whole number in [8, "),
    ("[axes.X]\nnodes = 50000", "nodes to begin with, max_nodes allows"),
]


@pytest.mark.parametrize(
    ("kind", "text", "message"),
    [("universal", *row) for row in UNIVERSAL] + [("island4d", *row) for row in ISLAND4D],
)
def test_a_bad_configuration_is_refused(kind, text, message, tmp_path):
    assert message in refused_file(kind, tmp_path, text)


def test_misuse_of_the_command_line_is_refused(tmp_path):
    assert "--config and --target belong to one table" in refused("all", tmp_path, "--target", "1e-6")
    assert "'--workers'" in refused("universal", tmp_path, "--workers", "0")
    assert "'univresal'" in refused("univresal", tmp_path)
    message = refused("universal", tmp_path, "--target", "1e-4", "--out", str(tmp_path))
    assert "--out must name a file" in message


def test_few_certificate_points_are_for_tables_that_are_not_shipped(tmp_path):
    path = tmp_path / "few.toml"
    path.write_text(f"certificate_points = {MIN_SHIPPED_POINTS - 1}")
    for out in ((), ("--out", str(TABLES / "other.nc"))):
        message = refused("universal", tmp_path, "--config", str(path), *out)
        assert f"certificate_points must be at least {MIN_SHIPPED_POINTS} for a table in" in message
    assert not (TABLES / "other.nc").exists()
    for kind in LIMITS_OF:
        assert load(kind).certificate_points >= MIN_SHIPPED_POINTS


LIMITS_OF = {"universal": ("X", "mu"), "island4d": ("X", "spread", "sphere", "hurst")}


@pytest.mark.parametrize("kind", LIMITS_OF)
def test_a_target_alone_is_a_configuration(kind):
    shipped = load(kind)
    loose, tight = load(kind, target=TARGETS[kind][1]), load(kind, target=shipped.target / 3)
    assert loose.target == TARGETS[kind][1]
    assert {axis.start for axis in loose.axes.values()} == {MIN_NODES}
    assert tight.axes == shipped.axes
    assert load(kind, target=1e-6).target == 1e-6
    assert len({made.digest() for made in (shipped, loose, tight)}) == 3


def test_an_axis_of_another_range_starts_from_the_fewest_nodes(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text("[axes.spread]\nhigh = 10.0")
    found, shipped = load("island4d", path), load("island4d")
    assert (found.axes["spread"].high, found.axes["spread"].low) == (10.0, shipped.axes["spread"].low)
    assert found.axes["spread"].start == MIN_NODES
    assert found.axes["X"] == shipped.axes["X"]
    path.write_text("[axes.spread]\nhigh = 10.0\nstart = 17")
    assert load("island4d", path).axes["spread"].start == 17


def test_the_solver_works_on_every_corner_that_the_limits_allow():
    X, mu = np.array(LIMITS["X"]), np.array([1e-30, LIMITS["mu"][1]])
    pairs = np.stack(np.meshgrid(X, mu), axis=-1).reshape(-1, 2)
    for rtol in (greenwood_tripp.MIN_SOLVER_RTOL, 1e-6, 1e-3):
        solved = greenwood_tripp.solve(*pairs.T, rtol=rtol)
        ratio = np.stack([solved.phi_F, solved.phi_A]) / greenwood_tripp.rigid_sphere(*pairs.T)
        assert (solved.error <= rtol).all()
        assert np.isfinite(np.log(ratio)).all()


def test_the_limits_of_island4d_stay_within_those_of_mu():
    corners = np.meshgrid(*(LIMITS[name] for name in ("spread", "sphere", "hurst")))
    flat = [corner.ravel().astype(float) for corner in corners]
    for variant in VARIANTS.values():
        mu = band_fields(*flat, variant)[0]
        assert (mu >= 1e-30).all()
        assert (mu <= LIMITS["mu"][1]).all()
