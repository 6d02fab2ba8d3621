"""Faces by the process that made them: valid only where maps of such faces were."""

import csv
import json

import netCDF4
import numpy as np
import pytest
import xarray as xr
from helpers import run

from mbma_tables import Bodies, InputError, Joint, Surface, contact, contact_law
from mbma_tables.common.files import shipped_file
from mbma_tables.design.sensitivity import sensitivity

DRAWING = {"Ra": "1.6 um", "hurst": 0.8, "longest": "250 um", "shortest": "4 um"}
AREA = "4 cm^2"
BODIES = Bodies("115 GPa", hardness="1 GPa")


def face(**more):
    return Surface.from_roughness(**DRAWING | more, nominal_area=AREA)


def by_every_route(**more):
    """(valid, scatter, reasons) of one contact, by route."""
    one = face(**more)
    joint = Joint(DRAWING | more, bodies=BODIES, nominal_area=AREA)
    pressed = {
        "contact": contact(one, BODIES, pressure="10 MPa"),
        "law": contact_law(one, BODIES).at(pressure="10 MPa"),
        "joint": joint.at_pressure("10 MPa"),
        "samples": contact(one.sampled(), BODIES, pressure="10 MPa"),
        "other unit": contact(one.to("mm"), BODIES, pressure="10 MPa"),
        "both faces": contact(one.combined(one), BODIES, pressure="10 MPa"),
        "one face": contact(one.combined(face()), BODIES, pressure="10 MPa"),
        "batch": contact(face(**more | {"Ra": ["1.6 um"]}), BODIES, pressure="10 MPa"),
    }
    return {
        route: (bool(np.all(found.valid)), found.scatter, list(found.reasons))
        for route, found in pressed.items()
    }


@pytest.mark.parametrize("more", [{}, {"process": "gaussian"}])
def test_gaussian_faces_are_valid_by_every_route(more):
    for route, (valid, scatter, reasons) in by_every_route(**more).items():
        assert valid, (route, reasons)
        assert np.isfinite(scatter).all(), route


@pytest.mark.parametrize("process", ["milled", "turned", "ground", "blasted"])
def test_faces_of_other_processes_are_not_valid_by_any_route(process):
    (reason,) = contact(face(process=process), BODIES, pressure="10 MPa").reasons
    assert process in reason
    assert "theory='simulated'" in reason
    for route, (valid, scatter, reasons) in by_every_route(process=process).items():
        assert not valid, route
        assert np.isnan(scatter).all(), route
        assert reasons == [reason], route


def test_a_labelled_batch_keeps_its_process():
    one = face(process="milled")
    heights = xr.DataArray([2.0, 2.2], dims="face")
    records = {"unit": "um", "provenance": one.provenance}
    both = Surface(0.8, one.q0, one.q1, heights, 10.0, **records)
    found = contact(both, BODIES, pressure=0.01)
    assert not found.valid.any()
    assert any("milled" in reason for reason in found.reasons)


def test_a_process_changes_no_number():
    plain, milled = face(), face(process="milled")
    one, other = (contact(each, BODIES, pressure="10 MPa") for each in (plain, milled))
    assert repr(plain) == repr(milled)
    assert (one.area, one.mean_separation) == (other.area, other.mean_separation)
    slopes = [sensitivity(each, BODIES, pressure="10 MPa") for each in (plain, milled)]
    assert repr(slopes[0]) == repr(slopes[1])


def test_unknown_processes_are_refused_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'milled'"):
        face(process="miled")
    with pytest.raises(InputError, match="no process is named 3; known are gaussian"):
        face(process=3)


def test_commands_and_files_take_a_process(tmp_path):
    numbers = ["--Ra", "1.6um", "--hurst", "0.8", "--longest", "250um", "--shortest"]
    bodies = ["--E-star", "115GPa", "--hardness", "1GPa", "--pressure", "10MPa"]
    drawing = [*numbers, "4um", "--nominal-area", "4cm^2", *bodies, "--json"]
    for more, valid in (([], True), (["--process", "milled"], False)):
        answer = json.loads(run("contact", *drawing, *more))
        assert ("milled" in json.dumps(answer["reasons"])) is not valid
    path = tmp_path / "joint.toml"
    rows = "".join(f"{name} = {json.dumps(value)}\n" for name, value in DRAWING.items())
    head = 'bodies = "115 GPa"\nnominal_area = "4 cm^2"\n[part_a]\n'
    for more, reason in (("", None), ('process = "turned"\n', "turned")):
        path.write_text(head + rows + more)
        reasons = Joint.from_toml(path).at_pressure("100 MPa").reasons
        assert any("turned" in text for text in reasons) is (reason is not None)
    surface = tmp_path / "face.toml"
    surface.write_text(f'[surface]\nnominal_area = "4 cm^2"\n{rows}process = "milled"\n')
    answer = json.loads(run("contact", "--file", surface, *bodies, "--json"))
    assert "milled" in json.dumps(answer["reasons"])


def test_shipped_processes_are_those_of_the_simulated_maps():
    with open(shipped_file("processes.csv"), encoding="utf-8", newline="") as file:
        lines = [line for line in file if not line.startswith("#")]
    rows = {row["process"]: row for row in csv.DictReader(lines)}
    with netCDF4.Dataset("docs/data/boundary_elements.nc") as data:
        maps = data["machined"]
        family = maps["family"][:].astype(str)
        names = ("area", "stiffness", "calibrated_stiffness", "calibrated_valid")
        area, stiffness, by_law, valid = (
            np.ma.filled(maps[name][:].astype(float), np.nan) for name in names
        )
    compared = (area >= 0.01) & (area <= 0.6)
    assert set(family) == {name for name, row in rows.items() if int(row["maps"])}
    for process in dict.fromkeys(family):
        mine = (family == process)[:, None] & compared
        row = rows[process]
        error = np.abs(np.log(by_law / stiffness))[mine]
        assert int(row["maps"]) == np.count_nonzero(family == process)
        assert float(row["valid"]) == pytest.approx(valid[mine].mean(), abs=0.005)
        quantile = np.nanquantile(error, 0.9)
        assert float(row["stiffness_error"]) == pytest.approx(quantile, abs=0.0006)


def test_what_a_contact_assumes_is_an_attribute_of_its_dataset():
    found = contact(face(), BODIES, pressure="10 MPa").to_dataset()
    for line in face().provenance[0]["assumed"]:
        assert line in found.attrs["assumed"]
