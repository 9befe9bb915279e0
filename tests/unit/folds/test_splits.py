import numpy as np
import pytest
from sklearn.dummy import DummyClassifier
from sklearn.linear_model import RidgeClassifier
from sklearn.model_selection import cross_val_score

from afferents import LeaveOneGroupOut
from afferents.errors import InputError
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneSpeedOut, number_in_recording

NESTED, PUBLISHED = PROTOCOLS["nested"], PROTOCOLS["published"]


def test_nested_keeps_three_sets_of_whole_speeds(samples):
    data = samples((10, 20, 30, 40, 50))
    speed = data["speed_mm_s"].values
    for fold in LeaveOneSpeedOut(NESTED).folds(data):
        assert set(speed[fold.test]) == {fold.held_out}
        assert set(speed[fold.validation]) == {fold.validated_by}
        assert set(speed[fold.train]) == {10, 20, 30, 40, 50} - {
            fold.held_out,
            fold.validated_by,
        }
        everything = np.concatenate([fold.train, fold.validation, fold.test])
        assert sorted(everything) == list(range(len(data)))


def test_published_tests_odd_frames_and_validates_even_ones(samples):
    data = samples((10, 20), n=5)
    fold = next(LeaveOneSpeedOut(PUBLISHED).folds(data))
    number = number_in_recording(data["recording"].values)
    assert set(number[fold.test]) == {1, 3}
    assert set(number[fold.validation]) == {0, 2, 4}
    assert set(data["speed_mm_s"].values[fold.train]) == {20}


def test_published_counts_are_the_papers(samples):
    data = samples(range(10, 101, 10), textures="abcdefghijklm", n=119)
    fold = next(LeaveOneSpeedOut(PUBLISHED, random_halves=True).folds(data))
    assert (len(fold.train), len(fold.validation), len(fold.test)) == (13923, 767, 780)


def test_random_halves_are_the_same_windows_for_all_textures_and_fixed_by_the_seed(samples):
    data = samples((10, 20), n=9)
    number = number_in_recording(data["recording"].values)
    texture = data["texture"].values

    def halves(seed):
        splitter = LeaveOneSpeedOut(PUBLISHED, random_halves=True, seed=seed)
        fold = next(splitter.folds(data))
        return [set(number[fold.validation][texture[fold.validation] == t]) for t in "ab"]

    assert halves(3)[0] == halves(3)[1] == halves(3)[0]
    assert len(halves(3)[0]) == 4
    assert any(halves(3)[0] != halves(seed)[0] for seed in range(4, 8))


def test_it_is_a_scikit_learn_splitter(samples):
    data = samples((10, 20, 30))
    scores = cross_val_score(
        DummyClassifier(), data.values, data["texture"].values,
        groups=data["speed_mm_s"].values, cv=LeaveOneSpeedOut(),
    )  # fmt: skip
    assert scores.shape == (3,)
    assert LeaveOneSpeedOut().get_n_splits(groups=data["speed_mm_s"].values) == 3
    with pytest.raises(InputError, match="at least 2 speeds"):
        next(LeaveOneSpeedOut(PUBLISHED).folds(samples((10,))))


def test_single_windows_are_halved_by_recording(samples):
    """Two textures at 10 mm/s, six recordings of one window each: three validate, three test."""
    one = samples((10, 20), n=6)
    one = one.assign_coords(recording=("sample", [f"r{i}" for i in range(len(one))]))
    fold = next(LeaveOneSpeedOut(PUBLISHED, random_halves=True).folds(one))
    texture = one["texture"].values
    for part in (fold.validation, fold.test):
        assert sorted(texture[part]) == ["a"] * 3 + ["b"] * 3


@pytest.mark.parametrize("splitter", [LeaveOneSpeedOut(), LeaveOneGroupOut()])
@pytest.mark.parametrize("kind", [int, float, str])
def test_for_scikit_learn_all_other_groups_train(splitter, kind):
    speed = np.repeat([10, 20, 40, 80], 6)
    y = np.tile([0, 1], 12)
    groups = speed.astype(kind)
    scores = cross_val_score(RidgeClassifier(), y[:, None], y, groups=groups, cv=splitter)
    assert scores.tolist() == [1.0] * splitter.get_n_splits(groups=groups) == [1.0] * 4
    for held_out, (train, test) in zip(
        (10, 20, 40, 80), splitter.split(y, groups=groups), strict=True
    ):
        assert set(speed[test]) == {held_out}
        assert sorted([*train, *test]) == list(range(len(y)))
    with pytest.raises(InputError, match="at least 2"):
        next(splitter.split(y, groups=["a"] * len(y)))
