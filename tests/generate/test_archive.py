"""The archive of simulations: every file of docs/data, with sums, and a description that agrees with the citation."""

import hashlib
import json
import pathlib
import zipfile

from click.testing import CliRunner

from generate.__main__ import main
from generate.archive import FILES
from generate.files import DATA
from mbma_tables import __version__


def test_every_file_of_data_is_named_and_packed(tmp_path):
    # the page of the data set stands beside its files, and at the top of the archive
    found = {path.name for path in DATA.iterdir() if path.is_file()}
    assert found == {*FILES, "README.md"}
    places = [tmp_path / name for name in ("one.zip", "two.zip")]
    for place in places:
        done = CliRunner().invoke(main, ["archive", str(place)])
        assert done.exit_code == 0, done.output
    assert places[0].read_bytes() == places[1].read_bytes()
    with zipfile.ZipFile(places[0]) as packed:
        sums = packed.read("SHA256SUMS").decode().splitlines()
        summed = dict(reversed(line.split("  ")) for line in sums)
        assert set(packed.namelist()) == {*summed, "SHA256SUMS"}
        for name, expected in summed.items():
            assert hashlib.sha256(packed.read(name)).hexdigest() == expected
        for name in FILES:
            assert packed.read(f"data/{name}") == pathlib.Path(DATA / name).read_bytes()
        described = json.loads(packed.read(".zenodo.json"))
    assert described["upload_type"] == "dataset"
    assert described["version"] == __version__
    assert described["license"] == "BSD-3-Clause"
