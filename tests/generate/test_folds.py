"""Folds of cross-validation: each group is left out once, whole, and folds span the range of the groups."""

import types

from hypothesis import given
from hypothesis import strategies as st

from generate.calibrated_file import FOLDS, cross_validated, folds


@given(st.lists(st.integers(0, 30), min_size=2 * FOLDS, max_size=60))
def test_each_group_is_left_out_once_and_whole(groups):
    left = []
    for others, left_out in folds(groups):
        assert not {groups[k] for k in others} & {groups[k] for k in left_out}
        assert sorted([*others, *left_out]) == [*range(len(groups))]
        left += left_out
    assert sorted(left) == [*range(len(groups))]


def test_constants_come_from_every_fifth_node_left_out():
    seen = [types.SimpleNamespace(node=number % 13) for number in range(40)]
    fits = cross_validated(seen, lambda others: frozenset(one.node for one in others))
    expected = {
        node: {*range(13)} - {*range(node % FOLDS, 13, FOLDS)} for node in range(13)
    }
    assert fits == expected
