"""Controls of any model on anybody's arrays, and that they are those of `evaluate`."""

import datetime

import numpy as np
import pandas as pd
import pytest
import soundfile
from hypothesis import given, settings, strategies as st
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.linear_model import RidgeClassifier
from sklearn.model_selection import cross_val_score
from sklearn.naive_bayes import GaussianNB
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline

import afferents
from afferents import (
    LeaveOneSpeedOut,
    LogSpectra,
    controls,
)
from afferents.errors import InputError
from afferents.evaluation.controls import AS_IT_IS
from afferents.models.solved import predict_left_out

from ..folds.test_controls import Sounds as OverlappingSounds

TEXTURES, SPEEDS = list("abc"), (10, 20, 40, 80)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def made(rng, n=6, rows=64, offset=0.0, line=0.0):
    """Windows of two channels at four speeds; a texture has an offset or a line."""
    y = np.tile(np.repeat(TEXTURES, n), len(SPEEDS))
    number, speed = np.searchsorted(TEXTURES, y), np.repeat(SPEEDS, 3 * n)
    time = np.arange(rows)[:, None]
    waves = np.sin(2 * np.pi * time * np.array([0.1, 0.2, 0.3]) + rng.uniform(0, 6))[:, number].T
    x = rng.normal(size=(len(y), rows, 2)) + line * waves[:, :, None]
    return x + offset * number[:, None, None], y, speed


def means(trained, named, tested):
    return LinearDiscriminantAnalysis().fit(trained.mean(1), named).predict(tested.mean(1))


def test_offsets_that_tell_the_texture_are_found_and_said(rng):
    x, y, speed = made(rng, offset=2.0)
    found = controls(means, x, y, groups=speed)
    accuracy = found.table["accuracy"]
    assert min(accuracy[AS_IT_IS], accuracy["offsets"], accuracy["shuffled"]) > 95
    assert max(accuracy["permuted"], accuracy["amplitudes"]) < 60
    assert found.chance == pytest.approx(100 / 3)
    said = " ".join(found.warnings)
    assert (
        "offsets alone: 100% right, where the model has 100% and chance 33%: the sensor's" in said
    )
    assert "amplitudes" not in said
    assert list(found.table) == ["accuracy", "ci95_low", "ci95_high", "10", "20", "40", "80"]
    assert len(str(found).splitlines()) <= 20


def test_spectra_that_tell_the_texture_leave_nothing_to_offsets(rng):
    x, y, speed = made(rng, n=20, line=2.0)
    model = make_pipeline(LogSpectra(), RidgeClassifier())
    found = controls(model, x, y, groups=speed)
    accuracy = found.table["accuracy"]
    assert accuracy[AS_IT_IS] > 95
    assert max(accuracy["offsets"], accuracy["shuffled"], accuracy["amplitudes"]) < 60
    assert found.warnings == ()
    plain = cross_val_score(model, x, y, groups=speed, cv=LeaveOneSpeedOut())
    assert accuracy[AS_IT_IS] == pytest.approx(100 * plain.mean())


def test_loudness_that_tells_the_texture_is_said(rng):
    x, y, speed = made(rng)
    x *= (1 + np.searchsorted(TEXTURES, y))[:, None, None]
    found = controls(make_pipeline(LogSpectra(), RidgeClassifier()), x, y, groups=speed)
    assert "amplitudes alone" in " ".join(found.warnings)
    assert "offsets alone" not in " ".join(found.warnings)


def test_a_model_that_knows_the_labels_is_said_to(rng):
    x, y, speed = made(rng)
    x[:, 0, 0] = np.searchsorted(TEXTURES, y)

    def knowing(trained, named, tested):
        return np.array(TEXTURES)[tested[:, 0, 0].astype(int)]

    found = controls(knowing, x, y, groups=np.where(speed > 20, "fast", "slow"))
    assert "labels permuted: 50% right" in found.warnings[0]


RATE_HZ, WINDOW = 2000, 1000


class Sounds(OverlappingSounds):
    """The same in windows that don't overlap, which `controls` is given as arrays."""

    encodings = {  # noqa: RUF012
        "orders": {"window_s": 0.5, "stride_s": 0.5, "lowest_hz": 10.0, "highest_hz": 500.0},
    }


def discriminant(trained, named, tested):
    """Name textures as `evaluate` does for its controls."""
    values = np.concatenate([trained, tested])
    textures, number = np.unique(named, return_inverse=True)
    labels = np.concatenate([number, np.arange(len(tested)) % len(textures)])
    is_tested = np.repeat([0, 1], [len(trained), len(tested)])
    found = predict_left_out(values, labels, is_tested, np.eye(2, dtype=bool))
    return textures[found[len(trained) :]]


def test_they_are_those_of_evaluate_on_the_same_recordings(rng, tmp_path):
    """Windows that cover recordings without overlap; louder, higher textures with an offset."""
    (tmp_path / "data").mkdir()
    windows, y, speed, names = [], [], [], []
    for number, texture in enumerate(TEXTURES):
        for v in SPEEDS:
            noise = rng.normal(size=4 * WINDOW) * (1 + 0.3 * number)
            line = np.sin(2 * np.pi * (40 + 3 * number) * v / 20 * np.arange(4 * WINDOW) / RATE_HZ)
            sound = (0.05 * noise + 0.02 * line + 0.01 * number).astype(np.float32)
            path = tmp_path / "data" / f"{texture}_{v}.wav"
            soundfile.write(path, sound, RATE_HZ, subtype="FLOAT")
            windows.append(soundfile.read(path, dtype="float32")[0].reshape(4, WINDOW, 1))
            y, speed, names = y + [texture] * 4, speed + [v] * 4, names + [path.stem] * 4
    results = afferents.evaluate(
        Sounds(tmp_path / "data"), tmp_path / "r", "ridge-te", quiet=True, workers=1
    )
    assert "time shuffled" in afferents.report(tmp_path / "r", quiet=True).read_text()
    x = np.concatenate(windows)
    spectra = LogSpectra(RATE_HZ, 10.0, 500.0, bins_per_octave=24)

    def model(trained, named, tested):
        return discriminant(spectra.transform(trained), named, spectra.transform(tested))

    ours = controls(model, x, y, groups=speed, recordings=names)
    theirs = results.found.controls
    assert len({found.mean_accuracy for found in theirs.values()}) > 2
    assert results.found.chance == pytest.approx(ours.chance / 100)
    for name, found in theirs.items():
        row = ours.table.loc[AS_IT_IS if name == "none" else name]
        np.testing.assert_allclose(
            row[["ci95_low", "ci95_high"]], 100 * np.array(found.ci95), err_msg=name
        )
        assert row["accuracy"] == pytest.approx(100 * found.mean_accuracy), name
        assert row[list(found.by)].to_dict() == pytest.approx(
            {group: 100 * share for group, share in found.by.items()}
        )


@settings(max_examples=15, derandomize=True, deadline=None)
@given(seed=st.integers(0, 2**20), n_textures=st.integers(2, 6), n_groups=st.integers(2, 6))
def test_random_labels_are_recognised_by_chance_as_they_are_and_permuted(
    seed, n_textures, n_groups
):
    rng = np.random.default_rng(seed)
    groups = np.repeat(np.arange(n_groups), 60)
    y = np.concatenate([np.arange(60) % n_textures for _ in range(n_groups)])
    found = controls(GaussianNB(), rng.normal(size=(len(y), 3)), y, groups=groups)
    chance = 100 / n_textures
    by_chance = 100 * np.sqrt(chance / 100 * (1 - chance / 100) / len(y))
    for row in found.table.itertuples():
        assert row.ci95_low - 4 * by_chance <= chance <= row.ci95_high + 4 * by_chance
        assert 0 <= row.ci95_low <= row.accuracy <= row.ci95_high <= 100


class Learner:
    """Like a network of skorch: fit and predict, float32 alone, nothing of scikit-learn's."""

    def __init__(self):
        self.seen = None

    def fit(self, x, y):
        assert self.seen is None, "fitted before"
        assert x.dtype == np.float32
        self.seen = np.unique(y)
        self.centres = np.stack([x[y == one].mean((0, 1)) for one in self.seen])

    def predict(self, x):
        near = np.abs(x.mean(1)[:, None] - self.centres).sum(-1).argmin(1)
        return self.seen[near][:, None]


@pytest.mark.parametrize(
    "groups",
    [
        lambda speed: np.array(["low", "middle", "high", "top"])[np.searchsorted(SPEEDS, speed)],
        lambda speed: [datetime.date(2024, 1, int(v)) for v in speed % 31 + 1],
        lambda speed: pd.to_datetime("2024-01-01") + pd.to_timedelta(speed, unit="D"),
        lambda speed: 20240100 + speed,
        lambda speed: pd.Series(speed).astype("category"),
    ],
    ids=["texts", "dates", "datetimes", "numbers of eight digits", "categories"],
)
def test_whatever_has_fit_and_predict_is_taken_with_groups_of_any_kind(rng, groups):
    x, y, speed = made(rng, offset=2.0)
    model = Learner()
    found = controls(model, x.astype(np.float32), y, groups=groups(speed))
    assert model.seen is None
    assert found.table["accuracy"][AS_IT_IS] > 95
    assert len(found.table.columns) == 3 + len(SPEEDS)


def test_channels_first_shuffle_the_same_axis(rng):
    x, y, speed = made(rng, line=2.0)
    model = make_pipeline(LogSpectra(), RidgeClassifier())

    def channels_first(trained, named, tested):
        return model.fit(trained.swapaxes(1, 2), named).predict(tested.swapaxes(1, 2))

    one = controls(model, x, y, groups=speed)
    other = controls(channels_first, x.swapaxes(1, 2), y, groups=speed, time_axis=2)
    pd.testing.assert_frame_equal(one.table, other.table)


def test_features_without_time_leave_controls_out_and_say_so(rng):
    x, y, speed = made(rng, offset=2.0)
    table = pd.DataFrame(x.mean(1), columns=["left", "right"])
    found = controls(RidgeClassifier(), table, pd.Series(y), groups=speed)
    assert list(found.table.index) == [AS_IT_IS, "permuted"]
    assert "since X of shape (72, 2) has no time axis" in str(found)
    same = controls(KNeighborsClassifier(), x.mean(1), y, groups=speed)
    assert same.table["accuracy"][AS_IT_IS] > 95


def test_recordings_on_both_sides_and_groups_of_one_texture_are_said(rng):
    x, y, speed = made(rng, offset=2.0)
    both = [f"{texture}{n % 6}" for n, texture in enumerate(y)]
    assert (
        "18 of 18, such as a0, so that"
        in controls(means, x, y, groups=speed, recordings=both).warnings[-1]
    )
    kept = (speed != 10) | (y == "a")
    said = " ".join(controls(means, x[kept], y[kept], groups=speed[kept]).warnings)
    assert "groups with one texture only: 1 of 4, such as 10," in said
    kept = (speed == 10) | (y != "c")
    said = " ".join(controls(means, x[kept], y[kept], groups=speed[kept]).warnings)
    assert "textures in one group only: 1 of 3, such as c" in said


def test_one_texture_left_to_learn_is_what_is_answered(rng):
    x, y = rng.normal(size=(8, 3)), list("aaaaaabb")
    found = controls(LinearDiscriminantAnalysis(), x, y, groups=[1, 1, 1, 1, 2, 2, 2, 2])
    assert found.table.loc[AS_IT_IS, "2"] == 50


def refusals(x, y, speed):
    def nan(at):
        bad = x.copy()
        bad[at, 3] = np.nan
        return bad

    short, names = speed[:-1], np.arange(len(y)).astype(str)
    features = x.mean(1)
    yield "X: .* NaN or infinity in 1 of 72 samples, the first at 5; fill", {"X": nan(5)}
    yield (
        "X, y, groups, recordings: expected as many samples in each, found 72, 71, 72, 72",
        {"y": y[:-1]},
    )
    yield "found 72, 72, 71, 72", {"groups": short}
    yield "found 72, 72, 72, 71", {"recordings": names[:-1]}
    yield "X: .*windows of different lengths; cut", {"X": [one[n % 2 :] for n, one in enumerate(x)]}
    yield "X: .*object values", {"X": np.array([*x, None], dtype=object)[:-1]}
    yield r"X: .*found shape \(72,\); one feature", {"X": features[:, 0]}
    yield "groups: expected at least 2, .*found 1", {"groups": ["a"] * len(y)}
    yield "groups: expected at least 2, .*found 0", {"X": x[:0], "y": [], "groups": []}
    yield "groups: .*found each in one alone", {"groups": y}
    yield (
        "groups: .*found none for 1 of 72, the first at 2",
        {"groups": [None if n == 2 else v for n, v in enumerate(speed)]},
    )
    yield "groups: expected the group of every sample", {"groups": None}
    yield r"groups: expected a list, .*\(72, 1\)", {"groups": speed[:, None]}
    yield "time_axis: expected .*1 to 2, found 3", {"time_axis": 3}
    yield "the model: expected an object .*found <class", {"model": RidgeClassifier}
    yield "the model: expected an object .*found None", {"model": None}
    yield "y: .*found 0.5; regression is not meant", {"y": np.arange(len(y)) / 2}
    yield "y: .*found none for 1 of 72", {"y": [None, *y[1:]]}
    yield r"y: expected a texture of each sample, .*\(72, 2\)", {"y": np.eye(len(y))[:, :2]}
    yield "recordings: expected one texture in each, found 3", {"recordings": speed}
    yield "the model: expected 18 predictions, .*found 17", {"model": lambda a, b, c: b[:17]}
    yield (
        "the model: expected labels of y, such as a, found 0",
        {"model": lambda a, b, c: np.zeros(len(c))},
    )
    yield r"the model: expected one that learns from X of shape \(n, 64, 2\).*found .*dim 3.*put "
    yield (
        r"LogSpectra: .*found an array of shape \(54, 2\)",
        {
            "X": features,
            "model": make_pipeline(LogSpectra(), RidgeClassifier()),
        },
    )


def test_what_can_not_be_is_refused_in_a_sentence(rng):
    x, y, speed = made(rng, offset=1.0)
    for one in refusals(x, y, speed):
        said, changed = one if isinstance(one, tuple) else (one, {"model": RidgeClassifier()})
        given = {"model": means, "X": x, "y": y, "groups": speed} | changed
        with pytest.raises(InputError, match=said):
            controls(**given)


def test_whole_numbers_that_are_floats_are_labels(rng):
    x, y, speed = made(rng, offset=2.0)
    number = np.searchsorted(TEXTURES, y).astype(float)
    assert controls(means, x, number, groups=speed).table["accuracy"][AS_IT_IS] > 95


def test_how_windows_were_read_is_said_where_it_seems_wrong():
    rng = np.random.default_rng(0)
    y, speed = np.tile([0, 1], 20), np.repeat([10, 20], 20)
    x = rng.normal(size=(40, 4, 16))

    def guess(X_train, y_train, X_test):  # noqa: N803
        return np.resize(y_train, len(X_test))

    (said,) = (w for w in controls(guess, x, y, groups=speed).warnings if "moments" in w)
    assert "4 moments of 16 channels" in said
    assert "time_axis=2" in said
    right = controls(guess, x, y, groups=speed, time_axis=2)
    assert not any("moments" in one for one in right.warnings)
    assert "no recordings are named" in str(right)
    named = controls(guess, x, y, groups=speed, recordings=np.arange(40), time_axis=2)
    assert named.left_out == ""
