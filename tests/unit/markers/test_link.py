"""Which blob is which marker."""

from itertools import product

import numpy as np
from hypothesis import given, settings, strategies as st

from afferents.markers.detect import NO_BLOB, link_nearest, link_one_to_one


def cost(expected, blobs, index, gate):
    """Return the sum of squared distances, the gate squared for each marker without a blob."""
    return sum(
        gate**2 if b == NO_BLOB else ((expected[n] - blobs[b]) ** 2).sum()
        for n, b in enumerate(index)
    )


points = st.lists(
    st.tuples(st.floats(0, 30), st.floats(0, 30)), min_size=1, max_size=4, unique=True
).map(lambda pairs: np.array(pairs, dtype=float))


@settings(deadline=None)
@given(expected=points, blobs=points)
def test_one_to_one_is_the_best_of_all_assignments_and_shares_nothing(expected, blobs):
    gate = 10.0
    index = link_one_to_one(expected, blobs, gate)
    taken = index[index != NO_BLOB]
    assert len(set(taken.tolist())) == len(taken)
    for n, b in enumerate(index):
        assert b == NO_BLOB or np.hypot(*(expected[n] - blobs[b])) < gate
    choices = [NO_BLOB, *range(len(blobs))]
    possible = [
        c
        for c in product(choices, repeat=len(expected))
        if len({b for b in c if b != NO_BLOB}) == sum(b != NO_BLOB for b in c)
    ]
    best = min(cost(expected, blobs, c, gate) for c in possible)
    assert cost(expected, blobs, index, gate) <= best + 1e-6


def test_nothing_beyond_the_gate_which_is_inclusive_as_published_and_nothing_from_nothing():
    expected = np.array([[0.0, 0]])
    assert link_nearest(expected, np.array([[10.0, 0]]), 10).tolist() == [0]
    for link in (link_nearest, link_one_to_one):
        assert link(expected, np.array([[11.0, 0]]), 10).tolist() == [NO_BLOB]
        assert link(expected, np.zeros((0, 2)), 10).tolist() == [NO_BLOB]
