"""Files for other programs know of quantities what their declarations have."""

import ast
import pathlib

import numpy as np
import pytest

import mbma_tables
from mbma_tables import Surface, contact
from mbma_tables.contacts.quantities.registry import in_files
from mbma_tables.contacts.question import PRESCRIBED
from mbma_tables.export.registry import targets
from mbma_tables.export.rows.law_rows import describe_law

PACKAGE = pathlib.Path(mbma_tables.__file__).parent
SOURCES = [*PACKAGE.joinpath("export").rglob("*.py"), *PACKAGE.glob("design/*.py")]


def listed(path):
    """Lines of collections in a file that name several quantities, other than those that are asked by."""
    names = set(in_files()) - set(PRESCRIBED)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Dict):
            parts = node.keys
        elif isinstance(node, ast.Tuple | ast.List | ast.Set):
            parts = node.elts
        else:
            continue
        words = {part.value for part in parts if isinstance(part, ast.Constant)}
        if len(words & names) > 1:
            yield node.lineno


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_no_file_lists_quantities_beside_the_registry(path):
    assert list(listed(path)) == []


def test_lists_are_found(tmp_path):
    path = tmp_path / "lists.py"
    path.write_text(
        'AGAINST = {"leakage": 1, "stiffness": 2}\nBY = ("pressure", "area")\n'
    )
    assert list(listed(path)) == [1]


@pytest.mark.parametrize("target", ["lsdyna", "getdp"])
def test_rows_of_a_quantity_are_by_its_own_name_and_that_of_files(target):
    """`flow_coefficient` was interpolated from contacts, "leakage" from the law."""
    asked = {"theory": "calibrated", "rows": 20, "pressures": ("1 kPa", "1 MPa")}
    concrete = Surface.named("concrete")
    kind = targets()[target]
    for name in ("flow_coefficient", "leakage"):
        law = describe_law(concrete, "13.3 MPa", quantity=name, **asked)
        assert (law.y_unit, law.x_name) == ("mm^3", "pressure")
        (curve,) = kind.read(kind.files(law)[""])
        pressure = curve.x[1:-1]
        known = contact(
            concrete, "13.3 MPa", pressure=pressure, theory="calibrated"
        ).flow_coefficient
        np.testing.assert_allclose(curve.y[1:-1], known, rtol=1.1 * law.largest_error)


def test_an_option_is_refused_by_what_the_quantity_needs():
    """A conductivity was taken for every quantity without rows of the law's own, and did nothing."""
    concrete = Surface.named("concrete")
    given = {"conductivity": 1.0, "conductivity_unit": "W/(m K)"}
    with pytest.raises(mbma_tables.InputError, match="conductivity does not belong"):
        describe_law(concrete, "13.3 MPa", quantity="mean_pressure", **given)


def test_lsdyna_has_a_curve_for_each_column():
    law = describe_law(
        Surface.named("concrete"),
        "13.3 MPa",
        quantity="hydraulic_aperture",
        theory="calibrated",
        rows=20,
    )
    kind = targets()["lsdyna"]
    curves = kind.read(kind.files(law)[""])
    assert [curve.name for curve in curves] == list(law.columns)[1:]
    for curve in curves:
        np.testing.assert_allclose(curve.y, law.columns[curve.name][0], rtol=1e-11)
