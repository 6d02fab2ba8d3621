"""Island models of `contact` compared, one's own, variants and covers, islands outside of tables, bad options."""

import csv
import dataclasses
import functools
import math
import pathlib
import runpy

import numpy as np
import pytest
from catalogue import LEVEL, OWN, random_gaps, random_surfaces
from helpers import contact_of, law_of_names, refusals

from mbma_tables import (
    InputError,
    OutOfRangeError,
    Scene,
    Surface,
    contact,
    contact_law,
    greenwood_tripp,
    island,
    open_table,
)
from mbma_tables.islands.variants import REPORTED, VARIANTS
from mbma_tables.theories import Mbma

SHALLOW = dataclasses.replace(REPORTED, name="shallow", beta=0.01, phi=0.001)
OPEN = dataclasses.replace(
    REPORTED, name="open", floor_d=1.3, floor_u=2.2, density_divisor=11.0
)


BOUND = open_table("universal").content.local_error.max()


@functools.cache
def solved(variant):
    surfaces = random_surfaces(80, seed=101, hurst=(0.3, 1.0), zeta_1=(3.01, 1e4))
    gaps = random_gaps(surfaces, seed=102)
    return (
        surfaces,
        gaps,
        contact(
            surfaces,
            separation=gaps,
            theory=Mbma(island_model="exact", variant=variant, rtol=1e-10),
        ),
    )


def apart(found, true):
    return np.maximum(
        np.abs(found.pressure / true.pressure - 1), np.abs(found.area / true.area - 1)
    )


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8, 1e-10])
def test_universal_within_its_tolerance_of_exact(variant, rtol):
    surfaces, gaps, true = solved(variant)
    found = contact(surfaces, separation=gaps, theory=Mbma(variant=variant, rtol=rtol))
    assert found.island_model == "universal"
    error = apart(found, true)
    assert (error <= found.error).all()
    # islands, panels and tails, none of which is closer than the table's bound
    assert found.error.max() <= rtol + 3 * BOUND
    assert true.error.max() <= 1e-10


def test_island4d_within_its_bound_of_exact():
    surfaces, gaps, true = solved("reported")
    found = contact(
        surfaces, separation=gaps, theory=Mbma(island_model="island4d", rtol=1e-6)
    )
    assert found.island_model == "island4d"
    assert (apart(found, true) <= found.error).all()
    assert found.error.max() <= 1e-6 + 3e-5
    # a coarser table than the other
    assert np.median(apart(found, true)) > 1e-8


@pytest.mark.parametrize("variant", [OWN, LEVEL, OPEN], ids=lambda variant: variant.name)
def test_a_variant_of_ones_own(variant):
    surfaces = random_surfaces(25, seed=102, hurst=(0.4, 1.0), zeta_1=(3.6, 1e4))
    gaps = random_gaps(surfaces, seed=103)
    true = contact(
        surfaces,
        separation=gaps,
        theory=Mbma(island_model="exact", variant=variant, rtol=1e-9),
    )
    found = contact(surfaces, separation=gaps, theory=Mbma(variant=variant, rtol=1e-9))
    assert (found.variant, true.variant) == (variant.name, variant.name)
    error = apart(found, true)
    assert (error <= found.error + true.error).all()
    assert found.error.max() <= 1e-7
    assert (np.abs(contact(surfaces, separation=gaps).area / found.area - 1) > 1e-3).any()


@pytest.mark.parametrize("island_model", ["universal", "exact", "rigid"])
def test_a_floor_above_the_largest_magnification_or_at_it(island_model):
    options = {"separation": 1.0, "island_model": island_model, "variant": OWN}
    with pytest.raises(
        OutOfRangeError, match=r"q1/q0 must be greater than 3\.5, the variant's floor"
    ) as caught:
        contact_of(Surface([0.5, 0.8, 0.8], 0.2, [0.68, 40.0, 0.7], 1.0, 3.0), **options)
    assert caught.value.mask.tolist() == [True, False, True]
    assert (
        contact_of(
            Surface(0.8, 1.0, math.nextafter(3.5, 4), 1.0, 3.0), **options
        ).pressure
        > 0
    )
    with pytest.raises(
        InputError, match=r"greater than 5\.14, the variant's floor of zeta_u"
    ):
        contact_law(
            Surface(0.8, 1.0, 5.0, 1.0, 3.0),
            theory=Mbma(island_model=island_model, variant="fitted"),
        )


@pytest.mark.parametrize(
    "variant",
    ["printed", LEVEL, dataclasses.replace(REPORTED, name="own", density_divisor=11.0)],
    ids=str,
)
def test_the_four_parameter_table_is_of_one_variant(variant):
    with pytest.raises(
        InputError,
        match=r"island4d table was made for the variant 'reported', not for .*'universal'",
    ):
        contact(
            Surface(0.8, 0.2, 40.0, 1.0, 3.0),
            separation=1.0,
            theory=Mbma(island_model="island4d", variant=variant),
        )


ROUGH = Surface(
    [[0.05], [0.8]], 0.2, 0.2 * 1e8, 1.0, 3.0
)  # the first row leaves the table where it is pressed
GAPS = np.array([2.9999, 0.0, -2.0, 3.5])
MISSING = np.array([[False, True, True, False], [False] * 4])


def test_outside_raises_with_a_mask_in_the_callers_shape():
    with pytest.raises(OutOfRangeError) as caught:
        contact(ROUGH, separation=GAPS, theory=Mbma(variant="reported"))
    np.testing.assert_array_equal(caught.value.mask, MISSING)
    facts = (
        "2 of 8 entries",
        "(-6.25 <= X <= 41, mu <= 1.1e+06)",
        "hurst = 0.05, zeta_1 = 1e+08",
    )
    assert all(fact in str(caught.value) for fact in (*facts, "outside='exact'"))
    one = Surface(0.05, 0.2, 0.2 * 1e8, 1.0, 3.0)
    with pytest.raises(OutOfRangeError) as caught:
        contact(one, separation=0.0)
    assert caught.value.mask.shape == ()
    assert caught.value.mask
    assert math.isnan(contact(one, separation=0.0, theory=Mbma(outside="nan")).pressure)


# of the second variant, with hardly any deformation, islands are deeper than the table at any gap
@pytest.mark.parametrize("variant", [REPORTED, SHALLOW], ids=lambda variant: variant.name)
def test_outside_answered_by_the_solver(variant):
    surface = ROUGH if variant is REPORTED else Surface(0.9, 0.2, 400.0, 1.0, 3.0)
    found, table = (
        contact(surface, separation=GAPS, theory=Mbma(variant=variant, outside=way))
        for way in ("exact", "nan")
    )
    true = contact(
        surface, separation=GAPS, theory=Mbma(island_model="exact", variant=variant)
    )
    missing = np.isnan(table.pressure)
    assert missing.any()
    for name in ("pressure", "area", "error"):
        expected = np.where(missing, getattr(true, name), getattr(table, name))
        np.testing.assert_array_equal(getattr(found, name), expected)
    assert found.islands > table.islands


def test_outside_as_nan():
    found = contact(ROUGH, separation=GAPS, theory=Mbma(outside="nan"))
    inside = contact(Surface(0.8, 0.2, 0.2 * 1e8, 1.0, 3.0), separation=GAPS)
    for name in ("pressure", "area", "error", "stiffness"):
        np.testing.assert_array_equal(np.isnan(getattr(found, name)), MISSING)
        np.testing.assert_array_equal(getattr(found, name)[1], getattr(inside, name))
        assert getattr(found, name)[0, 3] == 0


test_bad_options = refusals(
    lambda options: contact_of(
        Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=1.0, **options
    ),
    ({"outside": "clamp"}, "outside must be one of"),
    ({"variant": "guessed"}, "variant must be one of"),
    *(({"rtol": rtol}, "rtol") for rtol in (0.0, 1e-12, 0.5, math.nan, "tight")),
    *(({"E_star": modulus}, "E_star") for modulus in (0.0, -2.0)),
    ({"island_model": "formula4"}, "island_model must be one of"),
)


@pytest.mark.parametrize("island_model", ["exact", "universal"])
def test_what_is_nearly_nothing_ends_and_states_its_digits(island_model):
    """Heights of 32 standard deviations: totals below the normal numbers, whose digits no halving brings back."""
    surface = Surface(0.12887275768129156, 1.0, 7.092276972058787, 1.0, 32.0)
    gaps = np.array([31.9, 31.998, 31.999])
    found = contact(surface, separation=gaps, theory=Mbma(island_model=island_model))
    known = contact(
        surface, separation=gaps, theory=Mbma(island_model="exact", rtol=1e-10)
    )
    assert (
        np.abs(found.pressure - known.pressure)
        <= (found.error + known.error) * known.pressure
    ).all()
    assert found.error[2] > 1e-7


DATA = pathlib.Path(__file__).parents[2] / "docs" / "data" / "boundary_elements.csv"
COVER = dataclasses.replace(REPORTED, name="cover", addition="cover")
COVERED = Surface(0.8, 0.01, 2.0, 1.0, 3.0)
COVERED_GAPS = np.array([2.9, 2.0, 0.5, -1.0, -2.9])


def test_cover_is_what_islands_at_random_leave_uncovered():
    added, covered = (
        Mbma(variant=r).totals(COVERED, COVERED_GAPS, slopes=True)
        for r in (REPORTED, COVER)
    )
    assert covered.pressure == pytest.approx(added.pressure, rel=1e-15)
    assert covered.area == pytest.approx(-np.expm1(-added.area), rel=1e-15)
    assert covered.area_slope == pytest.approx(
        added.area_slope * np.exp(-added.area), rel=1e-14
    )
    law = contact_law(COVERED, theory=Mbma(variant=COVER))
    assert law.area(separation=COVERED_GAPS) == pytest.approx(covered.area, rel=2e-8)
    assert not any(
        "added" in reason
        for reason in contact(
            COVERED, separation=COVERED_GAPS, theory=Mbma(variant=COVER)
        ).reasons
    )
    with pytest.raises(InputError, match="addition must be"):
        dataclasses.replace(REPORTED, addition="integral")


def test_fitted_area_at_equal_force_follows_boundary_elements():
    """The surfaces of the fit; docs/fidelity.md has those that it did not see."""
    with DATA.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    errors = []
    keys = ("hurst", "L_over_lambda0", "zeta_1", "seed")
    for seed in sorted(
        {tuple(row[k] for k in keys) for row in rows if row["L_over_lambda0"] != "1"}
    ):
        own = [row for row in rows if tuple(row[k] for k in keys) == seed]
        surface = Surface(
            float(seed[0]), 1.0, float(seed[2]), 1.0, float(own[0]["h_max_over_h_rms"])
        )
        found = contact(
            surface,
            separation=np.linspace(-1, 0.99, 200) * surface.h_max,
            theory=Mbma(variant="fitted", rtol=1e-5),
        )
        branch = slice(int(np.argmax(found.pressure)), None)
        log_force, log_area = (
            np.log(x[branch][::-1])
            for x in (found.pressure / surface.rms_gradient, found.area)
        )
        for row in own:
            force = float(row["force"])
            area = float(row["area"])
            if 0.01 < area < 0.97 and np.log(force) < log_force[-1]:
                errors.append(
                    np.interp(np.log(force), log_force, log_area) - np.log(area)
                )
    assert len(errors) > 400
    assert np.quantile(np.abs(errors), 0.9) < 0.06
    assert abs(np.mean(errors)) < 0.02


ROOT = pathlib.Path(__file__).parents[2]
FLAT = Surface(0.8, 0.3, 60.0, 0.7, 2.1)
OWN_GAPS = np.array([2.09, 1.0, -1.5, 2.5])


class Own:
    name = "own"

    def __init__(self, change=lambda *answer: answer):
        self.change = change

    def answer(self, X, mu):
        return self.change(*greenwood_tripp.rigid_sphere(X, mu), np.full(X.shape, 1e-14))


def test_totals_laws_islands_and_scenes():
    for ask, given, load in (
        (contact_of, {"separation": OWN_GAPS}, "pressure"),
        (island, {"delta": [0.1, 1.0]}, "force"),
    ):
        found, known = (
            ask(FLAT, **given, island_model=island_model)
            for island_model in (Own(), "rigid")
        )
        assert found.island_model == "own"
        for name in (load, "area", "error"):
            np.testing.assert_allclose(
                getattr(found, name), getattr(known, name), rtol=1e-13
            )
    law, known = (
        contact_law(FLAT, rtol=1e-4, theory=Mbma(island_model=island_model))
        for island_model in (Own(), "rigid")
    )
    assert law.island_model == "own"
    np.testing.assert_allclose(
        law.pressure(separation=OWN_GAPS), known.pressure(separation=OWN_GAPS), rtol=1e-12
    )
    theory = Mbma(island_model=Own())
    scene = Scene(FLAT, separation=[1.0], rtol=1e-4, theory=theory).run()
    expected = contact(FLAT, separation=1.0, theory=Mbma(island_model="rigid")).pressure
    assert float(scene["pressure"][0]) == pytest.approx(expected, rel=1e-4, abs=0)


@pytest.mark.parametrize(
    "bad", [None, 3, Own, object(), "unknown", type("Nameless", (), {"answer": 1})()]
)
def test_what_is_no_island_model(bad):
    for ask, given in (
        (contact_of, {"separation": 1.0}),
        (law_of_names, {}),
        (island, {"delta": 1.0}),
    ):
        with pytest.raises(InputError, match="island_model must be one of"):
            ask(FLAT, **given, island_model=bad)


def test_answers_are_checked():
    with pytest.raises(
        InputError, match=r"'own' must answer Phi_F, Phi_A and error of shape"
    ):
        contact(
            FLAT,
            separation=1.0,
            theory=Mbma(island_model=Own(lambda F, A, error: (F[:3], A, error))),
        )
    with pytest.raises(InputError, match=r"'own' must answer"):
        contact(
            FLAT, separation=1.0, theory=Mbma(island_model=Own(lambda F, A, error: F))
        )
    silent = Own(lambda F, A, error: (np.where(F > 10, np.nan, F), A, error))
    with pytest.raises(
        OutOfRangeError, match="1 of 2 entries lie outside of island model 'own'"
    ) as caught:
        contact(FLAT, separation=[2.5, 1.0], theory=Mbma(island_model=silent))
    assert caught.value.mask.tolist() == [False, True]
    found = contact(
        FLAT, separation=[2.5, 1.0], theory=Mbma(island_model=silent, outside="nan")
    ).pressure
    assert np.isnan(found).tolist() == [False, True]
    one = contact(
        FLAT,
        separation=1.0,
        theory=Mbma(island_model=Own(lambda F, A, error: (F, A, 1e-3))),
    )
    assert 1e-3 <= one.error < 1.1e-3


@pytest.mark.slow
def test_the_example_prints_what_its_page_shows(capsys):
    example = runpy.run_path(str(ROOT / "examples" / "own_island_model.py"))
    example["main"]([], standalone_mode=False)
    shown = capsys.readouterr().out.splitlines()
    page = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
    assert len(shown) == 8
    # bounds in the last digit apart, as from one machine to another
    assert all(f"    {line}" in page for line in shown if "states" not in line)
