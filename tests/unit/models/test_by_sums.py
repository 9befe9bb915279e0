"""What is named at a speed knows nothing of that speed."""

import numpy as np

from afferents.models.fit_solved import named_when_left_out


def data(seed=0):
    rng = np.random.default_rng(seed)
    labels, groups = np.tile([0, 1, 2], 60), np.repeat([0, 1, 2], 60)
    values = np.eye(4, dtype=np.float32)[labels] * 3 + rng.normal(size=(180, 4)).astype(np.float32)
    return values, labels, groups


ALL = [np.arange(4), np.array([3])]


def test_textures_are_named_by_the_features_that_tell_them():
    values, labels, groups = data()
    whole, last = named_when_left_out(values, labels, groups, ALL)
    assert (whole == labels).mean() > 0.9
    assert (last == labels).mean() < 0.5


def test_the_group_left_out_is_not_learnt_from():
    values, labels, groups = data()
    before = named_when_left_out(values, labels, groups, ALL)[0]
    mislabelled = np.where(groups == 1, (labels + 1) % 3, labels)
    after = named_when_left_out(values, mislabelled, groups, ALL)[0]
    np.testing.assert_array_equal(after[groups == 1], before[groups == 1])
    assert (after != before).any()
