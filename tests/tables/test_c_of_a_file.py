"""The C of a table of one's own: its self-test passes, and a program's numbers are those of the table."""

import pathlib
import re
import shutil
import subprocess

import numpy as np
import pytest
from click.testing import CliRunner
from small_tables import small_table

from mbma_tables.cli import main
from mbma_tables.common.errors import InputError
from mbma_tables.export.model.c_code import write_code
from mbma_tables.tables.open import open_table
from mbma_tables.tables.writer import write_table

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
    (line,) = re.findall(r"cc own\.c .* -o own", page)  # as the page has it
    subprocess.run(line.split(), cwd=folder, check=True)
    text = subprocess.run(["./own"], cwd=folder, check=True, capture_output=True).stdout
    status, *phi = map(float, text.split())
    expected = open_table(file).answer(2.0, 0.1)
    assert status == 0
    np.testing.assert_allclose(phi, expected[:2], rtol=1e-14)
    # and not those of the shipped table, to which it is a coarse one
    assert phi[0] != open_table("universal").answer(2.0, 0.1).phi_F


def test_a_table_of_four_numbers_is_refused_by_name(tmp_path):
    file = write_table(tmp_path / "mine.nc", small_table("island4d"))
    with pytest.raises(InputError, match=r"mine\.nc is a table of the paper's four"):
        write_code(tmp_path / "c", table=file)
    assert not (tmp_path / "c").exists()
