"""What is named at a speed knows nothing of that speed."""

import numpy as np
import pytest
import torch
import xarray as xr

from afferents import dims
from afferents.encodings.samples import find_labels
from afferents.encodings.settings import ENCODINGS
from afferents.folds.protocol import PROTOCOLS, Fold
from afferents.models.calibrate import cross_entropy
from afferents.models.fit_solved import fit_solved, learn, pick_penalty, score
from afferents.models.fitted import Fitting, Part
from afferents.models.model import Model
from afferents.models.solved import Discriminant, Ridge, log_probabilities, predict_left_out


def data(seed=0):
    rng = np.random.default_rng(seed)
    labels, groups = np.tile([0, 1, 2], 60), np.repeat([0, 1, 2], 60)
    values = np.eye(4, dtype=np.float32)[labels] * 3 + rng.normal(size=(180, 4)).astype(np.float32)
    return values, labels, groups


ONE = np.eye(3, dtype=bool)


def test_textures_are_named_by_the_features_that_tell_them():
    values, labels, groups = data()
    assert (predict_left_out(values, labels, groups, ONE) == labels).mean() > 0.9
    assert (predict_left_out(values[:, 3:], labels, groups, ONE) == labels).mean() < 0.5


def test_the_group_left_out_is_not_learnt_from():
    values, labels, groups = data()
    before = predict_left_out(values, labels, groups, ONE)
    mislabelled = np.where(groups == 1, (labels + 1) % 3, labels)
    after = predict_left_out(values, mislabelled, groups, ONE)
    np.testing.assert_array_equal(after[groups == 1], before[groups == 1])
    assert (after != before).any()


def sampled(n_features, seed=0):
    """Samples of three textures at four speeds, unequally many; an offset stands in each value."""
    values, labels, groups = data(seed)
    rng = np.random.default_rng(seed)
    more = rng.normal(size=(180, n_features)).astype(np.float32)
    more[:, : values.shape[1]] += values
    kept = rng.random(180) < 0.8
    coords = {
        dims.TEXTURE: (dims.SAMPLE, np.array(["a", "b", "c"])[labels][kept]),
        dims.SPEED: (dims.SAMPLE, np.array([10.0, 20.0, 30.0])[groups][kept]),
    }
    return xr.DataArray((more + 5)[kept], coords, (dims.SAMPLE, dims.FEATURE))


@pytest.mark.parametrize("kind", [Discriminant, Ridge])
@pytest.mark.parametrize("n_features", [12, 400])
def test_a_group_taken_from_the_sums_is_as_one_never_learnt_from(kind, n_features):
    samples = sampled(n_features)
    everything, labels = np.arange(len(samples)), find_labels(samples)
    fold = Fold(10.0, 20.0, everything, everything[:0], everything[:0])
    part, penalties = Part(samples, fold, None), (0.1, 1.0, 10.0)
    found = pick_penalty(kind(3, (n_features,)), part, everything, 0, penalties)

    def anew(penalty):
        classifier, scores = kind(3, (n_features,)), np.empty((len(samples), 3), np.float32)
        for group in (10.0, 20.0, 30.0):
            its = samples[dims.SPEED].values == group
            learn(classifier, samples, labels, everything[~its], 0, penalty)
            scores[its] = score(classifier, samples, everything[its])
        return scores

    expected = log_probabilities(torch.from_numpy(anew(found[0])).double(), found[1]).numpy()
    np.testing.assert_allclose(found[2], expected, atol=1e-3)
    losses = {penalty: cross_entropy_of(anew(penalty), labels) for penalty in penalties}
    assert losses[found[0]] == pytest.approx(min(losses.values()), abs=1e-3)  # as above


@pytest.mark.parametrize("classifier", ["ridge", "discriminant"])
def test_nothing_of_the_held_out_is_learnt_from(classifier):
    """Neither weights nor the temperature know what is tested, whatever that is."""
    data, nested = sampled(12), PROTOCOLS["nested"]
    model = Model("mine", channel="sa1", encoding="markers", classifier=classifier)
    parts = [np.flatnonzero(data[dims.SPEED].values == v) for v in (10, 20, 30)]
    fold = Fold(30.0, 20.0, *parts)

    def fitted(samples):
        part = Part(samples, fold, ENCODINGS["markers"]())
        return fit_solved(Fitting(model, [part], nested, (None,), 0, 0, lambda *_: None))

    spoilt = data.copy()
    spoilt[fold.test] = np.random.default_rng(1).normal(0, 99, spoilt[fold.test].shape)
    before, after = fitted(data), fitted(spoilt)
    assert (before.probabilities != after.probabilities).any()
    for name, weights in before.classifier.state_dict().items():
        torch.testing.assert_close(after.classifier.state_dict()[name], weights, rtol=0, atol=0)


def cross_entropy_of(scores, labels):
    """The least that any temperature gives."""
    scores = torch.from_numpy(scores).double()
    at = (log_probabilities(scores, t).numpy() for t in np.geomspace(1e-2, 1e2, 400))
    return min(cross_entropy(logs, labels) for logs in at)
