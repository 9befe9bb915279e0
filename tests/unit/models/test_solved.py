"""Models that are solved at once: known truth in, truth out, and nothing of the held-out speed."""

import numpy as np
import pytest
import torch
import xarray as xr
from sklearn.linear_model import Ridge as SklearnRidge

from afferents import dims
from afferents.encodings.samples import find_labels
from afferents.encodings.settings import ENCODINGS
from afferents.errors import InputError
from afferents.folds.protocol import PROTOCOLS, Fold
from afferents.models import solved
from afferents.models.base import FitData, Task, build_classifier
from afferents.models.calibrate import cross_entropy
from afferents.models.fit_solved import fit_solved, learn, pick_penalty, score
from afferents.models.fitted import Fitting, Part
from afferents.models.model import Model
from afferents.models.orders import OrderSearch

PER_OCTAVE = 24
FREQUENCIES = 2 * 2.0 ** (np.arange(7 * PER_OCTAVE) / PER_OCTAVE)
PER_MM = 0.1 * 2.0 ** (np.arange(4 * PER_OCTAVE) / PER_OCTAVE)
SPEEDS = (10.0, 20.0, 40.0, 80.0)


def spectra(curves, n_each, speeds, rng, noise=0.3):
    """Log power over frequency of textures that are curves over log2 of cycles per mm."""
    values, labels, speed = [], [], []
    for label, curve in enumerate(curves):
        for v in speeds:
            place = (np.log2(FREQUENCIES / v) - np.log2(PER_MM[0])) * PER_OCTAVE
            clean = np.interp(place, np.arange(len(curve)), curve, left=0, right=0)
            values.append(clean + rng.normal(0, noise, (n_each, len(FREQUENCIES))))
            labels += [label] * n_each
            speed += [v] * n_each
    values = np.concatenate(values)[:, None].astype(np.float32)
    return torch.from_numpy(values), torch.tensor(labels), torch.tensor(speed, dtype=torch.float64)


def unlike(n, rng):
    """Curves that have nothing to do with one another."""
    return [
        3 * np.convolve(rng.normal(size=4 * PER_OCTAVE), np.ones(3) / 3, "same") for _ in range(n)
    ]


def learnt(curves, speed_from, rng):
    values, labels, speed = spectra(curves, 10, SPEEDS, rng)
    model = OrderSearch(len(curves), 1, FREQUENCIES, PER_MM, speed_from)
    data = FitData(values, labels, solved.equal_weights(labels, speed), speed)
    model.solve(data, rng, 30.0)
    model.temperature = torch.tensor(0.1)
    return model


@pytest.mark.parametrize("steps", [33.0, 33.25, 33.5])
@pytest.mark.parametrize("speed_from", ["none", "given"])
def test_textures_are_named_at_a_speed_never_learnt(speed_from, steps):
    """Wherever it lies between those supposed, twelve to the octave: lines are a bin wide."""
    rng = np.random.default_rng(0)
    curves = [rng.normal(size=4 * PER_OCTAVE) for _ in range(5)]
    model = learnt(curves, speed_from, rng)
    speeds = tuple(SPEEDS[0] / 2.5 * 2 ** (n / 12) for n in (steps, steps + 12))
    values, labels, speed = spectra(curves, 20, speeds, rng)
    logs = model(values, speed if speed_from == "given" else None)
    np.testing.assert_allclose(logs.exp().sum(1), 1, rtol=1e-4)
    assert (logs.argmax(1) == labels).float().mean() > 0.95
    found = model.speed(values, labels)
    if speed_from == "given":
        assert found is None
    else:
        assert torch.log2(found.double() / speed).abs().median() < 1 / PER_OCTAVE


def test_one_pattern_at_other_scales_needs_the_speed():
    rng = np.random.default_rng(1)
    pattern = np.zeros(4 * PER_OCTAVE)
    pattern[PER_OCTAVE : 2 * PER_OCTAVE] = 3 * rng.normal(size=PER_OCTAVE)  # far from any end
    curves = [np.roll(pattern, shift) for shift in (0, 3, 6, 9, 12)]
    values, labels, speed = spectra(curves, 20, (28.3, 56.6), rng)
    told = learnt(curves, "given", rng)(values, speed).argmax(1)
    untold = learnt(curves, "none", rng)(values).argmax(1)
    assert (told == labels).float().mean() > 0.95
    assert (untold == labels).float().mean() < 0.6


def test_speed_is_measured_between_channels_whatever_the_texture():
    rng = np.random.default_rng(2)
    n, curves = 12, unlike(4, rng)

    def with_phases(speeds):
        power, labels, speed = spectra(curves, n, speeds, rng)
        phase = 2 * np.pi * 1.5 * FREQUENCIES / speed.numpy()[:, None]
        waves = np.stack([np.cos(phase), np.cos(phase), np.sin(phase), -np.sin(phase)], axis=1)
        waves += rng.normal(0, 0.3, waves.shape)
        both = np.concatenate([power, power, waves], axis=1).astype(np.float32)
        return torch.from_numpy(both), labels, speed

    values, labels, speed = with_phases(SPEEDS)
    model = OrderSearch(len(curves), 2, FREQUENCIES, PER_MM, "measured")
    data = FitData(values, labels, solved.equal_weights(labels, speed), speed)
    model.solve(data, rng, 30.0)
    values, labels, speed = with_phases((28.3,))
    assert torch.log2(model.measured(values).double() / speed).abs().median() < 1 / PER_OCTAVE
    assert (model(values).argmax(1) == labels).float().mean() > 0.9


def test_who_measures_or_must_be_told_the_speed_says_so():
    with pytest.raises(InputError, match="several vibration channels"):
        OrderSearch(3, 1, FREQUENCIES, PER_MM, "measured")
    model = OrderSearch(3, 1, FREQUENCIES, PER_MM, "given")
    with pytest.raises(InputError, match="the sliding speed, found none; use order-te"):
        model(torch.zeros(2, 1, len(FREQUENCIES)))


def test_ridge_is_what_scikit_learn_calls_ridge():
    rng = np.random.default_rng(3)
    values = rng.normal(size=(60, 7)).astype(np.float32)
    labels, weight = rng.integers(0, 3, 60), rng.uniform(0.5, 2, 60)
    model = solved.Ridge(3, (7,))
    speed, rng = np.full(60, 10.0), np.random.default_rng(0)
    given = (torch.from_numpy(a) for a in (values, labels, weight, speed))
    model.solve(model.gathered(FitData(*given)), rng, solved.PENALTY)
    standard = (values - values.mean(0)) / values.std(0)
    theirs = SklearnRidge(alpha=solved.PENALTY).fit(
        standard, np.eye(3)[labels], sample_weight=weight
    )
    np.testing.assert_allclose(
        model.scores(torch.from_numpy(values)), theirs.predict(standard), atol=1e-4
    )


def test_every_texture_at_every_speed_weighs_the_same():
    labels, speed = torch.tensor([0, 0, 0, 1, 1]), torch.tensor([10.0, 10, 20, 10, 10])
    weight = solved.equal_weights(labels, speed)
    sums = [weight[[0, 1]].sum(), weight[[2]].sum(), weight[[3, 4]].sum()]
    np.testing.assert_allclose(sums, sums[0])
    assert weight.mean() == pytest.approx(1)


def fitted(kind, values, labels, penalty, n_classes=3):
    task = Task(n_classes, values.shape[1:], (dims.FEATURE,))
    classifier = build_classifier(kind, task)
    ones = torch.ones(len(values))
    data = classifier.gathered(FitData(values, labels, ones, ones))
    classifier.solve(data, np.random.default_rng(0), penalty)
    return classifier


def clouds(means, n=4000, sd=1.0):
    torch.manual_seed(0)
    means = torch.tensor(means)
    labels = torch.arange(len(means)).repeat_interleave(n)
    return means[labels] + sd * torch.randn(len(labels), means.shape[1]), labels


def test_a_texture_between_two_others_is_named():
    """On one axis a ridge on indicators never names the middle one."""
    values, labels = clouds([[-2.0], [0.0], [2.0]], sd=0.5)
    middle = values[labels == 1]
    named = fitted(solved.Discriminant, values, labels, 0.01).scores(middle).argmax(1)
    assert (named == 1).float().mean() > 0.9
    assert (
        fitted(solved.Ridge, values, labels, 30.0).scores(middle).argmax(1) == 1
    ).float().mean() < 0.1


def test_scores_are_log_densities_of_gaussians():
    """Of unit covariance: log p(k) - log p(j) = x (m_k - m_j) - (m_k^2 - m_j^2) / 2."""
    means = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]]
    scores = fitted(solved.Discriminant, *clouds(means, 40000), 0.0).scores(
        torch.tensor([[0.5, 0.5]])
    )
    expected = torch.tensor([0.0, 0.5 - 0.5, 1.0 - 2.0])
    np.testing.assert_allclose(scores[0] - scores[0, 0], expected, atol=0.05)


def test_a_value_that_never_varies_and_a_texture_without_samples_do_no_harm():
    values, labels = clouds([[-1.0, 3.0], [1.0, 3.0]])
    values[:, 1] = 3.0
    scores = fitted(solved.Discriminant, values, labels, 0.1).scores(values)
    assert torch.isfinite(scores).all()
    assert (scores[:, :2].argmax(1) == labels).float().mean() > 0.8


def test_fewer_samples_than_features_are_solved_to_the_same_weights():
    torch.manual_seed(0)
    x, labels = 0.1 + torch.randn(30, 80), torch.arange(30) % 4
    x[:, 5], x[:, 6] = 2.0, 0.0  # features that never vary
    y, weight = torch.nn.functional.one_hot(labels, 5), 0.5 + torch.rand(30)
    gram = solved.Gram(80, 5)
    gram.add(x, y, weight)
    rows = solved.Rows(x[:12], y[:12], weight[:12]) + solved.Rows(x[12:], y[12:], weight[12:])
    strength = 0.5 + torch.rand(80)
    # Of the 2 that never varies, rounding of its mean is left, over the discriminant's penalty.
    rounding = 30 * 2.0 * torch.finfo(torch.float64).eps / (0.1 * solved._LEAST_SHARE * 2.0**2)
    bound = torch.full((81, 1), 1e-5)
    bound[5], bound[80] = rounding, 2.0 * rounding
    for ours, usual in (
        (rows.solve(0.3), gram.solve(0.3)),
        (rows.solve(strength), gram.solve(strength)),
        (rows.solve_as_discriminant(0.1), gram.solve_as_discriminant(0.1)),
    ):
        found, expected = (
            torch.cat([weights, constants[None]]) for weights, constants in (ours, usual)
        )
        assert ((found - expected).abs() <= bound + 1e-4 * expected.abs()).all()


def data(seed=0):
    rng = np.random.default_rng(seed)
    labels, groups = np.tile([0, 1, 2], 60), np.repeat([0, 1, 2], 60)
    values = np.eye(4, dtype=np.float32)[labels] * 3 + rng.normal(size=(180, 4)).astype(np.float32)
    return values, labels, groups


ONE = np.eye(3, dtype=bool)


def test_textures_are_named_by_the_features_that_tell_them():
    values, labels, groups = data()
    assert (solved.predict_left_out(values, labels, groups, ONE) == labels).mean() > 0.9
    assert (solved.predict_left_out(values[:, 3:], labels, groups, ONE) == labels).mean() < 0.5


def test_the_group_left_out_is_not_learnt_from():
    values, labels, groups = data()
    before = solved.predict_left_out(values, labels, groups, ONE)
    mislabelled = np.where(groups == 1, (labels + 1) % 3, labels)
    after = solved.predict_left_out(values, mislabelled, groups, ONE)
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


@pytest.mark.parametrize("kind", [solved.Discriminant, solved.Ridge])
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

    expected = solved.log_probabilities(torch.from_numpy(anew(found[0])).double(), found[1]).numpy()
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
    at = (solved.log_probabilities(scores, t).numpy() for t in np.geomspace(1e-2, 1e2, 400))
    return min(cross_entropy(logs, labels) for logs in at)
