"""The simulations of docs/data as one archive, described for a repository of research data."""

import hashlib
import io
import json
import pathlib
import zipfile

import click
import yaml

from generate.files import DATA, ROOT
from mbma_tables.common.files import write_file

# every file of docs/data: what it contains, and the command that makes it
FILES = {
    "boundary_elements.nc": (
        "random, machined and measured surfaces pressed flat",
        "boundary_elements",
    ),
    "bandwidth.nc": (
        "wavelengths of 1:256 to 1:1024, some with a hardness",
        "boundary_elements --of bandwidth",
    ),
    "boundary_element_grids.csv": (
        "the same surfaces on 32 to 1024 points a side",
        "grids",
    ),
    "gaps.nc": ("distributions of gaps", "gaps"),
    "gas_flow.csv": ("flow of rarefied gas through gaps", "gas_flow"),
    "unloading.csv.gz": ("loading to a largest pressure and unloading", "unloading"),
    "unloading_cells.csv.gz": (
        "the same by cells of a factorial campaign, held out",
        "unloading",
    ),
    "unloaded_flow.csv": ("flow after unloading", "unloaded_flow"),
    "adhesion.csv": ("contacts with an attraction", "adhesion"),
    "profiles.csv.gz": ("errors of contacts that are computed from traces", "profiles"),
    "raw_maps.csv.gz": ("maps as an instrument gives them, on finer grids", "raw_maps"),
    "last_octave.csv": ("area with and without the shortest octave", "last_octave"),
    "artefacts.csv": ("maps with planted artefacts", "artefacts"),
    "exports.csv": ("largest errors of exported laws by target", ""),
    "boundary_elements.csv": ("an earlier campaign", ""),
    "hardness.csv": ("an earlier campaign with a hardness", ""),
    "leakage.csv": ("an earlier campaign of flow", ""),
    "bem_hurst0.8_zeta64.csv": ("a reference surface, mean of four", ""),
    "rolloff_0.csv": ("a surface with a plateau of its spectrum", ""),
    "rolloff_1.csv": ("a surface with a plateau of its spectrum", ""),
    "rolloff_spectra.csv": ("their spectra", ""),
    "challenge.csv": ("the contact-mechanics challenge, by others", ""),
    "gfmd_hurst0.8_zeta100.csv": ("molecular dynamics, by others", ""),
    "adhesive_held_out.csv": ("contacts with an attraction, by another program", ""),
    "unloading_other.csv": ("loading and unloading, by another program", ""),
}
BESIDE = ("CITATION.cff", "LICENSE", "docs/data/README.md")
DAY = (1980, 1, 1, 0, 0, 0)  # of every member, so that equal files give equal archives
TITLE = "Boundary-element simulations of the contact of rough surfaces"


def metadata() -> dict[str, object]:
    """The description that Zenodo reads from ``.zenodo.json``, of the citation file."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    paper = citation["references"][0]["url"]
    return {
        "title": TITLE,
        "description": citation["references"][1]["notes"],
        "version": citation["version"],
        "publication_date": str(citation["date-released"]),
        "creators": [{"name": author["name"]} for author in citation["authors"]],
        "license": citation["license"],
        "upload_type": "dataset",
        "related_identifiers": [{"identifier": paper, "relation": "isSupplementTo"}],
    }


def contents() -> dict[str, bytes]:
    """Members of the archive: data, their page, licence, citation, description and sums."""
    members = {f"data/{name}": (DATA / name).read_bytes() for name in FILES}
    members |= {pathlib.Path(name).name: (ROOT / name).read_bytes() for name in BESIDE}
    members[".zenodo.json"] = (json.dumps(metadata(), indent=2) + "\n").encode()
    sums = [
        f"{hashlib.sha256(body).hexdigest()}  {name}" for name, body in members.items()
    ]
    members["SHA256SUMS"] = ("\n".join(sums) + "\n").encode()
    return members


@click.command()
@click.argument("out", type=click.Path(path_type=pathlib.Path, dir_okay=False))
def archive(out: pathlib.Path) -> None:
    """Write the simulations of docs/data into one ZIP file, ready for an archive of research data."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        for name, body in contents().items():
            file.writestr(zipfile.ZipInfo(name, DAY), body, zipfile.ZIP_DEFLATED)
    write_file(out, packed.getvalue())
    click.echo(
        f"{out}: {len(FILES)} files of data, {len(packed.getvalue()) / 1e6:.1f} MB"
    )
