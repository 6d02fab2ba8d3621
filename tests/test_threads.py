"""Sixteen threads on one model, one law and one surface: the bits of one thread."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import numpy as np
import pytest

from mbma_tables import Surface, contact, contact_law
from mbma_tables.tables.open import universal_model
from mbma_tables.theories import Mbma

THREADS = 16
ENTRIES = 2000
ROUNDS = 4  # of every question by every thread: about a million lookups in all


@pytest.fixture(scope="module")
def questions():
    model = universal_model()
    law = contact_law(Surface(0.7, 0.2, 60.0, 1.0, 3.0), theory="mbma")
    X_axis, mu_axis = model.content.axes

    def phi(seed):
        rng = np.random.default_rng(seed)
        X = rng.uniform(X_axis.low, X_axis.high, ENTRIES)
        mu = 10 ** rng.uniform(-12, np.log10(mu_axis.high), ENTRIES)
        return list(model.answer(X, mu))

    def laws(seed):
        d = np.random.default_rng(seed).uniform(-3, 3, ENTRIES)
        p, area, slope = (
            value(separation=d) for value in (law.pressure, law.area, law.stiffness)
        )
        return [
            p,
            area,
            slope,
            law.pressure(separation=float(d[0])),
            law.separation(pressure=p[:200]),
        ]

    def totals(seed):
        # 31 islands or more a gap
        rng = np.random.default_rng(seed)
        many = Surface(
            rng.uniform(0.3, 1, 60), 0.2, 0.2 * 10 ** rng.uniform(0.5, 4, 60), 1.0, 3.0
        )
        found = contact(many, separation=rng.uniform(-3, 3, 60), theory=Mbma(rtol=1e-6))
        return [found.pressure, found.area, found.stiffness, found.error]

    return [phi, laws, totals]


def test_sixteen_threads_give_the_bits_of_one(questions):
    alone = {
        (question, seed): question(seed)
        for question in questions
        for seed in range(ROUNDS)
    }
    barrier = Barrier(THREADS)
    keys = list(alone)

    def work(thread):
        barrier.wait()
        # every thread in an order of its own, so that unlike questions meet
        order = [
            keys[place]
            for place in np.random.default_rng(1000 + thread).permutation(len(keys))
        ]
        return [
            (question.__name__, seed)
            for question, seed in order
            if not all(
                np.array_equal(a, b)
                for a, b in zip(question(seed), alone[question, seed], strict=True)
            )
        ]

    with ThreadPoolExecutor(THREADS) as pool:
        assert list(pool.map(work, range(THREADS))) == [[]] * THREADS


def test_laws_made_by_many_threads_are_one_law():
    surfaces = [Surface(hurst, 0.2, 60.0, 1.0, 3.0) for hurst in (0.35, 0.6, 0.8, 1.0)]
    alone = [contact_law(surface, theory="mbma", rtol=1e-7) for surface in surfaces]
    barrier = Barrier(THREADS)

    def make(thread):
        barrier.wait()
        return contact_law(surfaces[thread % 4], theory="mbma", rtol=1e-7)

    with ThreadPoolExecutor(THREADS) as pool:
        made = list(pool.map(make, range(THREADS)))
    for thread, law in enumerate(made):
        np.testing.assert_array_equal(law.block, alone[thread % 4].block)
        np.testing.assert_array_equal(law.errors, alone[thread % 4].errors)
