"""Default answers of raw maps, and artefacts planted in maps, against what the generator measured."""

import itertools

import numpy as np
import pandas as pd
import pytest

from generate.machined import artefacts, last_octave, raw_maps
from generate.machined.unseen import UNSEEN
from mbma_tables import Surface

DATA = pd.read_csv(raw_maps.FILE)
ASKED = DATA[(DATA.times > 0) & (DATA.valid == 1)]


def test_nearly_all_raw_maps_have_valid_answers():
    every = DATA.groupby(["kind", "number"]).times.max()
    assert set(DATA.kind) == set(raw_maps.KINDS)
    assert (every > 0).mean() > 0.95


@pytest.mark.parametrize("new", [False, True])
@pytest.mark.parametrize(
    ("quantity", "times"),
    # flow is not known at four times the points
    [
        *itertools.product(("area", "pressure", "stiffness"), (1, 2, 4)),
        ("flow", 1),
        ("flow", 2),
    ],
)
def test_scatter_covers_errors_against_accurate_and_finer_simulations(
    times, new, quantity
):
    rows = ASKED[(ASKED.times == times) & (ASKED.kind.isin(UNSEEN) == new)]
    error, scatter = raw_maps.errors(rows)[quantity]
    ratio = (error / scatter).abs()
    assert (ratio < 1).mean() > 0.68
    assert (ratio < 2).mean() > 0.9
    assert ratio.max() < 4


@pytest.mark.parametrize(
    ("quantity", "most"),
    [("area", 0.04), ("pressure", 0.01), ("stiffness", 0.04), ("flow", 0.05)],
)
def test_errors_on_the_same_points(quantity, most):
    error, _ = raw_maps.errors(ASKED[ASKED.times == 1])[quantity]
    assert error.abs().quantile(0.9) < most


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "number"), [("knurled", 500), ("worn", 501)])
def test_the_library_still_answers_so(kind, number):
    rows = ASKED[
        (ASKED.kind == kind) & (ASKED.number == number) & (ASKED.times == 1)
    ].copy()
    before = rows[list(raw_maps.ANSWERS)].to_numpy(float)
    again = raw_maps.asked_again(rows)[list(raw_maps.ANSWERS)].to_numpy(float)
    np.testing.assert_allclose(again, before, rtol=2e-3, atol=1e-12)
    # and the truth is what Tamaas finds
    heights, periodic = raw_maps.raw(kind, number)
    simulated = raw_maps.contact(
        Surface.from_map(heights, 1.0, periodic=periodic), area=0.1
    ).surface
    truth = raw_maps.pressed(
        simulated.map.heights, periodic, rows.pressure.to_numpy()[:1], 1
    )
    np.testing.assert_allclose(
        truth[0, :3], rows.iloc[0][list(raw_maps.QUANTITIES[:3])].astype(float), rtol=1e-4
    )


def test_no_planted_artefact_is_wrong_and_not_reported():
    table = pd.read_csv(artefacts.FILE)
    planted = table[table.group != "none"]
    assert set(planted.artefact) == {kind.name for kind in artefacts.KINDS}
    assert planted.maps.sum() >= 200
    assert planted.missed.sum() == 0
    clean = table[table.group == "none"]
    assert (clean.reported / clean.maps).item() < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("number", range(0, len(artefacts.KINDS), 8))
def test_the_table_of_artefacts_is_as_measured(number):
    kind = artefacts.KINDS[number]
    every = list(artefacts.parts())
    found = artefacts.planted(kind, every[number % 6 :: 6][:2])
    assert found["missed"] == 0
    row = pd.read_csv(artefacts.FILE).set_index("artefact").loc[kind.name]
    assert found["reported"] <= row.reported
    assert found["maps"] - found["reported"] <= row.maps - row.reported


def test_the_effect_of_the_last_octave_is_stated_as_accurate_simulations_have_it():
    table = pd.read_csv(last_octave.FILE)
    assert table.kind.nunique() >= 20
    error = (table.stated - table.simulated).abs()
    assert error.quantile(0.95) < 0.1
