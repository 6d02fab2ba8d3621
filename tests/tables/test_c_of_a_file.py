"""The C of a table of one's own: its self-test passes, and a program's numbers are those of the table."""

import pathlib
import re
import shutil
import subprocess

import numpy as np
import pytest
import tabulated  # noqa: F401, by its name
from click.testing import CliRunner
from small_tables import small_table

from mbma_tables import Surface, contact, greenwood_tripp
from mbma_tables.cli import main
from mbma_tables.common.errors import InputError
from mbma_tables.export.model.c_code import read_report, write_code
from mbma_tables.tables.island4d import to_axes
from mbma_tables.tables.make_function import make, wanted_of
from mbma_tables.tables.open import open_table
from mbma_tables.tables.writer import write_table
from mbma_tables.theories import Mbma

ROOT = pathlib.Path(__file__).parents[2]
PROGRAM = r"""
#include <stdio.h>
#include "mbma_model.h"
int main(void)
{
    mbma_answer phi;
    int status = mbma_phi_of(2.0, 0.1, &phi);
    printf("%d %.17g %.17g\n", status, phi.phi_F, phi.phi_A);
    return 0;
}
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_c_of_a_table_of_ones_own(tmp_path):
    file = write_table(tmp_path / "mine.nc", small_table("universal"))
    folder = tmp_path / "c"
    asked = ["export", "c", "--table", str(file), "--out", str(folder), "--check"]
    result = CliRunner().invoke(main, asked)
    assert result.exit_code == 0, result.output
    assert "phi: 64 points" in result.stdout
    digest = open_table(file).content.attributes["values_sha256"]
    assert digest in (folder / "mbma_conformance.csv").read_text()
    (folder / "own.c").write_text(PROGRAM)
    page = (ROOT / "docs" / "tables.md").read_text()
    line, _ = re.findall(r"cc own\.c .* -o own", page)  # as the page has it
    subprocess.run(line.split(), cwd=folder, check=True)
    text = subprocess.run(["./own"], cwd=folder, check=True, capture_output=True).stdout
    status, *phi = map(float, text.split())
    expected = open_table(file).answer(2.0, 0.1)
    assert status == 0
    np.testing.assert_allclose(phi, expected[:2], rtol=1e-14)
    # and not those of the shipped table, to which it is a coarse one
    assert phi[0] != open_table("universal").answer(2.0, 0.1).phi_F


FOUR = r"""
#include <stdio.h>
#include "mbma_model.h"
/* islands, or surfaces with a separation, from stdin, one a line */
int main(int argc, char **argv)
{
    (void)argv;
    double v[6];
    for (;;) {
        if (argc > 1) {
            mbma_contact found;
            if (scanf("%lf %lf %lf %lf %lf %lf", v, v + 1, v + 2, v + 3, v + 4, v + 5) != 6)
                return 0;
            const mbma_surface surface = {v[0], v[1], v[2], v[3], v[4]};
            const int status = mbma_total_of(&surface, v[5], 1.0, 1e-8, &found);
            printf("%d %.17g %.17g %.17g\n", status, found.force, found.area, found.error);
        } else {
            mbma_lookup found;
            if (scanf("%lf %lf %lf %lf", v, v + 1, v + 2, v + 3) != 4)
                return 0;
            const int status = mbma_lookup_of(v[0], v[1], v[2], v[3], &found);
            printf("%d %.17g %.17g %.17g %s\n", status, found.F_hat, found.A_hat, found.error,
                   mbma_message(status));
        }
    }
}
"""
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Werror")


@pytest.fixture(scope="module")
def four(tmp_path_factory):
    """The file of a table of four numbers, and the folder of its C with a compiled program."""
    folder = tmp_path_factory.mktemp("four")
    file = write_table(folder / "mine.nc", small_table("island4d"))
    written = write_code(folder / "c", table=file)
    (folder / "own.c").write_text(FOUR)
    sources = [
        path for path in written if path.suffix == ".c" and "selftest" not in path.name
    ]
    command = [
        "cc",
        "-std=c11",
        "-O2",
        *WARNINGS,
        "-Ic",
        "own.c",
        *sources,
        "-lm",
        "-o",
        "own",
    ]
    done = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return file, folder


def answers(folder, rows, *arguments):
    """What the program prints for rows of numbers, in lines of words."""
    text = "\n".join(" ".join(map(repr, map(float, row))) for row in rows)
    done = subprocess.run(
        ["./own", *arguments],
        cwd=folder,
        input=text,
        capture_output=True,
        text=True,
        check=True,
    )
    return [line.split(maxsplit=4) for line in done.stdout.splitlines()]


def random_islands(table, count):
    """The four numbers of islands anywhere in the box of the axes, and their coordinates."""
    rng = np.random.default_rng(54)
    X, spread, sphere, hurst = (
        axis.coordinate(rng.uniform(0, axis.nodes - 1, count))
        for axis in table.content.axes
    )
    zeta_d = 1.25 * np.maximum(sphere, 1e-9) ** (-1 / (4 - 2 * hurst))
    zeta_u = zeta_d * (1 + spread)
    sigma = to_axes(np.ones(count), zeta_d, zeta_u, hurst, table.variant).sigma
    numbers = (1 + X * sigma) * zeta_d**-hurst, zeta_d, zeta_u, hurst
    place = to_axes(*numbers, table.variant)
    # rounding may leave the box at its ends
    inside = np.isfinite(table.lookup(*numbers, outside="nan").error)
    assert inside.mean() > 0.99
    place = [field[inside] for field in (place.X, place.mu, place.force, place.area)]
    return [number[inside] for number in numbers], place


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_islands_of_four_numbers_in_c(four):
    """As in Python, and within the bound that C states of the solver, where no node is."""
    file, folder = four
    table = open_table(file)
    numbers, (X, mu, of_force, of_area) = random_islands(table, 2000)
    found = np.array(
        [line[:4] for line in answers(folder, zip(*numbers, strict=True))], float
    )
    assert (found[:, 0] == 0).all()
    np.testing.assert_allclose(found[:, 1:].T, table.lookup(*numbers), rtol=1e-13)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-10)
    exact = np.array([of_force * solved.phi_F, of_area * solved.phi_A])
    error = np.abs(found[:, 1:3].T / exact - 1).max(axis=0)
    assert (error <= found[:, 3]).all()
    assert 1e-6 < error.max() < 5e-2  # of a table of this target


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_totals_by_four_numbers_in_c(four):
    """Within the bound that C states of exact islands, and as in Python by the same table."""
    file, folder = four
    surfaces = [(0.8, 1.0, 20.0, 1.0, 3.5), (0.5, 2e3, 2e4, 2e-5, 1e-4)]
    for numbers in surfaces:
        surface = Surface(*numbers)
        gaps = surface.h_max * np.array([0.9, 0.6, 0.3])
        lines = answers(folder, [(*numbers, gap) for gap in gaps], "total")
        found = np.array(lines, float)
        assert (found[:, 0] == 0).all()
        exact, table = (
            contact(surface, separation=gaps, theory=Mbma(island_model=model))
            for model in ("exact", str(file))
        )
        for row, name in ((1, "pressure"), (2, "area")):
            error = np.abs(found[:, row] / getattr(exact, name) - 1)
            assert (error <= found[:, 3]).all()
            by_table = np.abs(found[:, row] / getattr(table, name) - 1)
            assert (by_table < 1e-2 * found[:, 3]).all()
    # the table has no Hurst exponent of 0.2
    (line,) = answers(folder, [(0.2, 1.0, 20.0, 1.0, 3.5, 2.0)], "total")
    assert (line[0], set(line[1:])) == ("6", {"nan"})


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_what_a_table_of_four_numbers_does_not_hold_is_named_in_c(four):
    invalid = "an argument is not finite, or is outside what the model allows"
    cases = {
        (12.0, 3.0, 20.0, 0.8): "X is above the range",
        (0.42, 3.0, 20.0, 0.8): "X is below the range",
        (1.0, 3.0, 900.0, 0.8): "zeta_u/zeta_d - 1 is above the range",
        (1.0, 1.1, 20.0, 0.8): "zeta_d is outside the range at this Hurst exponent",
        (1.0, 3.0, 20.0, 0.2): "the Hurst exponent is outside the range",
        (1.0, 20.0, 3.0, 0.8): invalid,
        (np.nan, 3.0, 20.0, 0.8): invalid,
        (np.inf, 3.0, 20.0, 0.8): invalid,
    }
    found = answers(four[1], cases)
    assert [line[4] for line in found] == list(cases.values())
    for line in found:
        assert [word.lstrip("-") for word in line[1:4]] == ["nan"] * 3


@pytest.mark.parametrize(
    "command",
    [
        ("gcc", "-std=c11", "-Wpedantic", "-O1", *SANITIZERS),
        ("gcc", "-std=c11", "-Wpedantic", "-O3", "-march=native", "-ffp-contract=fast"),
        ("g++", "-x", "c++", "-std=c++11", "-O1"),
    ],
    ids=["sanitized", "fast", "c++"],
)
def test_the_self_test_of_a_table_of_four_numbers(command, four, tmp_path):
    if shutil.which(command[0]) is None:
        pytest.skip(f"no {command[0]}")
    folder = four[1] / "c"
    sources = [*folder.glob("*.c")]
    command = [*command, *WARNINGS, *sources, "-lm", "-o", "selftest"]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    done = subprocess.run(
        ["./selftest", folder / "mbma_conformance.csv"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == ""
    found = read_report(done.stdout)
    assert found.failed == 0
    assert found.points["lookup"] == 64
    assert found.points["status"] == 13
    assert found.points["total"] > 5
    assert found.points["formula"] > 5
    # a wrong point fails
    points = (folder / "mbma_conformance.csv").read_text().splitlines()
    line = next(line for line in points if line.startswith("lookup,"))
    (tmp_path / "wrong.csv").write_text(line.replace(",4,", ",4,1.001", 1))
    done = subprocess.run(["./selftest", "wrong.csv"], cwd=tmp_path, check=False)
    assert done.returncode == 1


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_command_exports_and_checks_a_table_of_four_numbers(four, tmp_path):
    asked = [
        "export",
        "c",
        "--table",
        str(four[0]),
        "--out",
        str(tmp_path / "c"),
        "--check",
    ]
    result = CliRunner().invoke(main, asked)
    assert result.exit_code == 0, result.output
    assert "lookup: 64 points" in result.stdout
    header = (tmp_path / "c" / "mbma_model.h").read_text()
    words = " ".join(header.replace("\n *", " ").split())
    assert f"mbma export c --table {four[0]} --variant reported --out ." in words
    assert "mbma_lookup_of" in header
    assert "mbma_phi_of" not in header


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_program_of_the_page(tmp_path):
    page = (ROOT / "docs" / "tables.md").read_text()
    _, program = re.findall(r"```c\n(.*?)```", page, re.DOTALL)
    _, line = re.findall(r"cc own\.c .* -o own", page)
    write_code(tmp_path, table="island4d")
    (tmp_path / "own.c").write_text(program)
    subprocess.run(line.split(), cwd=tmp_path, check=True)
    done = subprocess.run(
        ["./own"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    found = open_table("island4d").lookup(1.0, 3.0, 20.0, 0.8)
    assert f"F = {found.F_hat:g} E* s/q0, A = {found.A_hat:g} eta/q0^2" in done.stdout
    assert f"at most {found.error:.1e}" in done.stdout


def test_a_table_of_a_function_is_refused_with_what_exports_it(tmp_path):
    file = tmp_path / "mine.nc"
    axes = {name: {"low": 0.0, "high": 1.0} for name in "abcdef"}
    make(wanted_of({"axes": axes, "target": 1e-2}, "tabulated:six"), file)
    with pytest.raises(
        InputError, match=r"mine\.nc is a table of a function.*tables export"
    ):
        write_code(tmp_path / "c", table=file)


def test_a_table_of_another_variant_is_refused_by_name(four, tmp_path):
    message = "made for the variant 'reported', not for 'printed'"
    with pytest.raises(InputError, match=message):
        write_code(tmp_path / "c", "printed", table=four[0])
    assert not (tmp_path / "c").exists()
