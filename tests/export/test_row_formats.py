"""Every format of rows that is declared: its text is read back, has points in all numbers, and holds no text as code."""

import dataclasses
import functools
import re

import numpy as np
import pytest
from helpers import skip_without_package
from test_code import HOSTILE

from benchmarks.programs import column_of
from mbma_tables import InputError, Surface
from mbma_tables.export.registry import targets
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.export.rows.solvers import FORMATS
from mbma_tables.export.targets import follows, names_of_rows

OF_ROWS = targets("SOLVERS", "DATA")
OF_REGISTRY = "mean_pressure"
LAWS = 20  # a program; benchmarks exports has a thousand
SURFACES = 4  # of which the laws are made, each in many units
HEAT = {"conductivity": 1.0, "conductivity_unit": "W/(m K)"}
OPTIONS = {
    "solid_conductance": HEAT,
    "total_conductance": HEAT,
    "tangential_stiffness": {"kappa": 1.2},
    "film": {"peklenik": 3.0, "rows": 80},
}
# lengths and stresses in the units of columns; a conductivity of 1 stays
POWERS = {
    "m": (1, 0),
    "m^3": (3, 0),
    "1": (0, 0),
    "Pa": (0, 1),
    "Pa/m": (-1, 1),
    "W/(m K)/m": (-1, 0),
    "W/(m K)": (0, 0),
}
NUMBER = re.compile(r"(?<![\w.#])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![\w.])")
LARGEST_COUNT = 999  # of rows, columns and cards; a larger whole number is one of a law


@functools.cache
def law_of(quantity, seed):
    """Rows of a surface, in m and Pa."""
    rng = np.random.default_rng(seed)
    q0, zeta_1, height = rng.uniform([0.02, 20, 2.8], [0.2, 60, 4.0])
    h_rms = rng.uniform(0.2, 1.0)
    surface = Surface(
        rng.uniform(0.6, 0.9), q0, q0 * zeta_1, h_rms, height * h_rms, unit="um"
    )
    name = "solid_conductance" if quantity == "total_conductance" else quantity
    asked = {"rows": 20, "theory": "calibrated", "pressures": ("1 MPa", "300 MPa")}
    law = describe_law(
        surface,
        "110 GPa",
        length_unit="m",
        stress_unit="Pa",
        quantity=name,
        **(asked | OPTIONS.get(quantity, {})),
    )
    if name != quantity:
        # only a joint has a gas; the rows have the same form
        what = law.comments[1].replace(name, quantity)
        comments = (law.comments[0], what, *law.comments[2:])
        law = dataclasses.replace(law, y_name=quantity, comments=comments)
    return law


def scaled(law, length, stress):
    """The same law of a body that is larger by the one factor and stiffer by the other."""

    def times(value, unit):
        of_length, of_stress = POWERS[unit]
        return value * length**of_length * stress**of_stress

    of = functools.partial(scaled, length=length, stress=stress)
    return dataclasses.replace(
        law,
        x=times(law.x, law.x_unit),
        y=times(law.y, law.y_unit),
        floor=times(law.floor, law.y_unit if law.quantity != "film" else "Pa"),
        more={name: (times(*column), column[1]) for name, column in law.more.items()},
        facts={name: (times(*fact), fact[1]) for name, fact in law.facts.items()},
        behaviour=None if law.behaviour is None else of(law.behaviour),
    )


def written(kind, law, **named):
    return kind.files(law, **({"name": "law"} if kind.end else named))[""]


def assert_reads(kind, law, curves):
    """The rows are there, or a formula within the stated error of them."""
    for curve in curves:
        rows, name = column_of(law, curve.name)
        y = rows.columns[name][0]
        if curve.x.size == rows.x.size:
            np.testing.assert_allclose(curve.x, rows.x, rtol=curve.rtol, atol=0)
            np.testing.assert_allclose(curve.y, y, rtol=curve.rtol, atol=0)
            continue
        # rows of gaps that are open, or points of a formula
        error = curve.rtol + (rows.largest_error if curve.rtol else 1e-12)
        expected = np.interp(curve.x, rows.x, y)
        np.testing.assert_allclose(curve.y, expected, rtol=error)
    columns = {column_of(law, curve.name)[1] for curve in curves}
    assert len(columns) == len(curves) > 0
    takes_all = kind.name not in FORMATS or FORMATS[kind.name].of_any is not None
    if takes_all:
        assert len(curves) == len(law.columns) - 1


def quantities_of(kind):
    """Names of rows that a program takes: of any those that follow from a law, a film, and one of contacts."""
    taken = [name for name in names_of_rows() if kind.takes_rows(name)]
    return [
        name for name in taken if name == "film" or follows(name) or name == OF_REGISTRY
    ]


@pytest.mark.parametrize("name", OF_ROWS)
def test_a_program_reads_the_rows_of_random_laws(name):
    skip_without_package(name)
    kind = OF_ROWS[name]
    quantities = quantities_of(kind)
    rng = np.random.default_rng(56)
    for count in range(LAWS):
        quantity = quantities[count % len(quantities)]
        base = law_of(quantity, int(rng.integers(SURFACES)))
        # rows of smaller lengths are too close for CalculiX
        law = scaled(base, *10 ** rng.uniform([0, -3], [4, 4]))
        assert_reads(kind, law, kind.read(written(kind, law)))


@pytest.mark.parametrize("name", [key for key, kind in OF_ROWS.items() if kind.several])
def test_several_laws_in_a_file_are_read_back(name):
    kind = OF_ROWS[name]
    wanted = [each for each in ("pressure", "leakage", "film") if kind.takes_rows(each)]
    laws = [law_of(each, 0) for each in wanted]
    curves = kind.read(written(kind, laws))
    for law in laws:
        count = len(law.columns) - 1
        assert_reads(kind, law, curves[:count])
        curves = curves[count:]
    assert curves == []


@pytest.mark.parametrize("name", FORMATS)
def test_every_number_below_the_comments_has_a_point(name):
    """Programs that read whole numbers as integers of 32 bits turn 3240000000 into -1054967296."""
    row_format = FORMATS[name]
    kind = OF_ROWS[name]
    for quantity in quantities_of(kind):
        law = law_of(quantity, 0)
        whole = dataclasses.replace(
            law,
            x=np.round(law.x * 2.0**40) * 1024.0,
            y=np.round(law.y / law.floor * 1e4) * 65536.0,
            behaviour=None,
        )
        takes_any = row_format.units is None and "conductance" not in quantity
        for one in (law, whole) if takes_any else (law,):
            text = written(kind, one).decode()
            lines = text.removeprefix(row_format.first).splitlines()
            body = "\n".join(x for x in lines if not x.startswith(row_format.mark))
            tokens = NUMBER.findall(body)
            whole_numbers = [each for each in tokens if re.fullmatch(r"[-+]?\d+", each)]
            assert len(tokens) > len(whole_numbers)
            assert all(int(each) <= LARGEST_COUNT for each in whole_numbers)


@pytest.mark.parametrize("name", FORMATS)
def test_no_text_of_a_user_is_code(name):
    row_format = FORMATS[name]
    law = law_of(quantities_of(OF_ROWS[name])[0], 0)
    words = {"comments": (HOSTILE, *law.comments[1:], HOSTILE)}
    if row_format.units is None:
        words |= {"x_unit": HOSTILE, "y_unit": HOSTILE}
    live = []
    for one in (law, dataclasses.replace(law, **words)):
        lines = row_format(one).splitlines()
        live.append([line for line in lines if not line.startswith(row_format.mark)])
    assert live[0] == live[1]


@pytest.mark.parametrize("name", [key for key, each in FORMATS.items() if each.named])
def test_a_name_is_a_word_within_the_length(name):
    row_format = FORMATS[name]
    law = law_of(quantities_of(OF_ROWS[name])[0], 0)
    longest = "A" * row_format.longest_name
    assert longest in row_format(law, longest)
    for bad in ("A\n*INCLUDE, INPUT=evil", "A, B", "", "1", "é", f"{longest}A", 3):
        with pytest.raises(InputError, match="a name must be a letter"):
            row_format(law, bad)
