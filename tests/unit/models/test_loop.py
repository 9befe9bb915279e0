"""The loop: what it learns, when it stops, what it restores, and that it can be repeated."""

import copy

import numpy as np
import pytest
import torch
from torch import nn

from afferents.errors import AfferentsError, InputError
from afferents.models import hardware
from afferents.models.classifiers import build
from afferents.models.hardware import autocast, choose_device, has_bfloat16
from afferents.models.layers import batch_norm_units, l2_penalty
from afferents.models.learner import Learner, WarmUp
from afferents.models.learning_set import LearningSet, split
from afferents.models.loop import predict, train

EPS = float(np.finfo(np.float32).eps)
ROUNDING = 64 * EPS
"""Relative, of the small network's probabilities where kernels may have taken a sample in another
way, as in another batch. Its logits are sums of 8 products of sums of 6, 16 roundings with the
normalisation, each by half of eps of what is added up, at most 4; a probability is off by twice
what its logit is."""


@pytest.mark.parametrize(
    ("encoding", "shape"),
    [("spatial-net", (10, 10)), ("cnn-lstm", (4, 8, 8)), ("vibration-net", (2, 140))],
)
def test_every_network_learns_a_separable_problem(encoding, shape, make_problem, config):
    problem = make_problem(shape)
    model = build(encoding, 3, shape)
    config = config.model_copy(update={"batch_size": 16, "max_epochs": 12, "patience": 8})
    trained = train(model, LearningSet(*problem), config, seed=0)
    probabilities = predict(model, problem.values, problem.validation, 1.0, config)
    accuracy = (probabilities.argmax(1) == problem.labels.numpy()[problem.validation]).mean()
    assert accuracy > 0.9
    # Batches of another size may round otherwise, which decides between two textures for a few.
    validated, few = trained.epochs[trained.best_epoch - 1], 2 / len(problem.validation)
    assert accuracy == pytest.approx(validated.validation_accuracy, abs=few)


def test_data_are_copied_to_a_gpu_alone_and_gathered_there(make_problem):
    problem = make_problem((10, 10))
    data = LearningSet(*problem, 2.0)
    assert data.on(torch.device("cpu")).values.data_ptr() == problem.values.data_ptr()
    elsewhere = torch.device("meta")  # holds no numbers, but keeps account of what lies where
    samples, labels = data.on(elsewhere).batch(torch.zeros(3, dtype=torch.int64, device="meta"))
    assert samples.device == labels.device == elsewhere
    assert samples.shape == (3, 10, 10)


def test_in_one_cycle_the_rate_rises_and_falls(make_problem, config):
    problem = make_problem((10, 10))
    cycle = {"one_cycle": True, "max_epochs": 5, "patience": None, "learning_rate": 1e-2}
    config = config.model_copy(update={**cycle, "batch_size": 16})
    data = LearningSet(*problem)
    batches = split(torch.from_numpy(problem.train), 16)
    network, n_steps = build("spatial-net", 3, (10, 10)), 5 * len(batches)
    learner = Learner(network, config, torch.device("cpu"), n_steps)
    rates = []
    for _ in range(5):
        for batch in batches:
            rates.append(learner.optimiser.param_groups[0]["lr"])
            learner.learn(data, [batch])
    highest = int(np.argmax(rates))
    assert rates[highest] == pytest.approx(1e-2, rel=0.05)
    assert 0 < highest < len(rates) / 2
    assert (np.diff(rates[: highest + 1]) > 0).all()
    assert (np.diff(rates[highest:]) < 0).all()
    assert rates[-1] < 1e-4
    trained = train(build("spatial-net", 3, (10, 10)), LearningSet(*problem), config, seed=0)
    assert trained.passes == trained.facts()["passes"] == 5 * len(problem.train)
    assert trained.epochs[-1].validation_accuracy > 0.9


class Scripted(nn.Module):
    """Its only weight counts the epochs; its validation accuracy follows a script."""

    def __init__(self, script: list[float]) -> None:
        super().__init__()
        self.script = script
        self.register_buffer("epoch", torch.zeros((), dtype=torch.int64))
        self.weight = nn.Parameter(torch.zeros(2))

    def forward(self, values: torch.Tensor) -> torch.Tensor:
        if self.training:
            self.epoch += 1
            return values * 0 + self.weight
        right = torch.arange(len(values)) < self.script[int(self.epoch) - 1] * len(values)
        return torch.stack([right.float(), 1 - right.float()], dim=1)


@pytest.mark.parametrize(
    ("script", "best", "epochs", "patience"),
    [
        ([0.2, 0.5, 0.5, 0.4, 0.5, 0.9], 2, 5, 3),  # a tie is no improvement
        ([0.5, 0.2, 0.1, 0.3, 0.9, 0.9], 1, 4, 3),
        ([0.1, 0.2, 0.3, 0.4, 0.5, 0.6], 6, 6, 3),  # max_epochs
        ([0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1, 4, 3),
        ([0.9, 0.1, 0.1, 0.1, 0.1, 0.1], 1, 6, None),
    ],
)
def test_training_stops_after_patience_and_restores_the_best_epoch(
    script, best, epochs, patience, config
):
    model = Scripted(script)
    values, labels = torch.zeros(40, 2), torch.zeros(40, dtype=torch.int64)
    shares: list[float] = []
    learnt = LearningSet(values, labels, np.arange(30), np.arange(30, 40))
    config = config.model_copy(update={"patience": patience})
    trained = train(model, learnt, config, 0, shares.append)
    assert trained.best_epoch == best
    assert int(model.epoch) == best, "the weights of the best epoch"
    assert [e.validation_accuracy for e in trained.epochs] == pytest.approx(script[:epochs])
    assert [e.number for e in trained.epochs] == list(range(1, epochs + 1))
    assert shares == pytest.approx([number / 6 for number in range(1, epochs + 1)])
    assert trained.passes == 30 * epochs


def test_same_seed_same_weights_and_other_seed_other_weights(problem, small_net, config):
    nets = [copy.deepcopy(small_net) for _ in range(3)]
    for net, seed in zip(nets, (1, 1, 2), strict=True):
        torch.rand(seed)  # the caller's random state must not matter, and is left
        state = torch.get_rng_state()
        train(net, LearningSet(*problem), config, seed)
        assert torch.equal(torch.get_rng_state(), state)
    first, again, other = (net.state_dict() for net in nets)
    assert all(torch.equal(first[name], again[name]) for name in first)
    assert not torch.equal(first["0.weight"], other["0.weight"])


def test_scale_divides_the_samples(problem, small_net, config):
    """Samples times 4, divided by 4: the same weights and probabilities, as 4 is a power of 2."""
    twin = copy.deepcopy(small_net)
    enlarged = problem._replace(values=problem.values * 4)
    train(small_net, LearningSet(*problem), config, seed=0)
    train(twin, LearningSet(*enlarged, 4.0), config, seed=0)
    assert torch.equal(small_net[0].weight, twin[0].weight)
    expected = predict(small_net, problem.values, problem.validation, 1.0, config)
    np.testing.assert_array_equal(
        predict(twin, enlarged.values, problem.validation, 4.0, config), expected
    )
    unscaled = predict(twin, enlarged.values, problem.validation, 1.0, config)
    assert not np.allclose(unscaled, expected)


def test_only_the_folds_samples_are_used_and_none_is_changed(problem, small_net, config):
    """Samples outside the fold are NaN: one of them in a batch would end the training."""
    fold = np.concatenate([problem.train[:40], problem.validation[:20]])
    values = torch.full_like(problem.values, torch.nan)
    values[fold] = problem.values[fold]
    before = values.clone()
    learnt = LearningSet(values, problem.labels, fold[:40], fold[40:], 2.0)
    train(small_net, learnt, config, seed=0)
    assert torch.equal(values.nan_to_num(), before.nan_to_num())


def test_the_loss_is_cross_entropy_plus_the_l2_term_which_reaches_the_gradient(config):
    """All samples zero, so logits are the biases: ln 3 + L2, which alone can move the kernel."""
    model = build("vibration-net", 3, (1, 140))
    before, penalty = model.dense[1].weight.detach().clone(), l2_penalty(model).item()
    config = config.model_copy(update={"learning_rate": 1e-4, "max_epochs": 1})
    labels = torch.arange(6) % 3
    learnt = LearningSet(torch.zeros(6, 1, 140), labels, np.arange(6), np.arange(6))
    trained = train(model, learnt, config, seed=0)
    assert trained.epochs[0].loss == pytest.approx(np.log(3) + penalty, rel=1e-5)
    judged = np.log(3) + l2_penalty(model).item()
    assert trained.epochs[0].validation_loss == pytest.approx(judged, rel=1e-4)
    large = before.abs() > 1e-3
    assert (model.dense[1].weight.abs() < before.abs())[large].all()


@pytest.mark.parametrize(("n", "sizes"), [(65, [65]), (64, [64]), (66, [64, 2]), (129, [64, 65])])
def test_the_last_batch_keeps_the_rest_and_none_is_left_alone(n, sizes):
    batches = split(torch.arange(n), 64)
    assert [len(b) for b in batches] == sizes
    assert torch.equal(torch.cat(batches), torch.arange(n))


@pytest.mark.parametrize("part", ["train", "validation"])
def test_a_loss_that_is_no_number_stops_with_a_sentence(part, problem, small_net, config):
    problem.values[getattr(problem, part)[5]] = torch.nan
    with pytest.raises(AfferentsError, match="the loss is no longer a number in epoch 1"):
        train(small_net, LearningSet(*problem), config, seed=0)


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"train": np.arange(1)}, "at least 2 training samples, found 1"),
        ({"validation": np.arange(0)}, "at least 1 validation sample, found none"),
        *[({"scale": scale}, "a positive scale") for scale in (0.0, -1.0, np.nan, np.inf)],
    ],
)
def test_folds_that_can_not_be_learnt_from_are_refused(change, found, problem, small_net, config):
    with pytest.raises(InputError, match=found):
        train(small_net, LearningSet(**(problem._asdict() | change)), config, seed=0)


def test_probabilities_are_float32_and_sum_to_one_in_the_order_asked(problem, small_net, config):
    index = np.array([9, 2, 2, 40])
    probabilities = predict(small_net, problem.values, index, 1.0, config)
    assert probabilities.shape == (4, 3)
    assert probabilities.dtype == np.float32
    np.testing.assert_allclose(probabilities.sum(1), 1, rtol=8 * EPS)  # three roundings each
    np.testing.assert_allclose(probabilities[1], probabilities[2], rtol=ROUNDING)
    alone = predict(small_net, problem.values, index[:1], 1.0, config)
    np.testing.assert_allclose(probabilities[:1], alone, rtol=ROUNDING)
    values = torch.randn(600, 6)  # more than a batch
    expected = small_net.eval()(values).softmax(1).detach().numpy()
    found = predict(small_net, values, np.arange(600), 1.0, config)
    np.testing.assert_allclose(found, expected, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("encoding", "shape", "n_layers"),
    [("spatial-net", (10, 10), 6), ("cnn-lstm", (4, 8, 8), 9), ("vibration-net", (1, 140), 6)],
)
def test_bfloat16_gives_nearly_the_probabilities_of_float32(encoding, shape, n_layers, config):
    model = build(encoding, 3, shape)
    values, index = torch.randn(20, *shape), np.arange(20)
    exact = predict(model, values, index, 1.0, config)
    coarse_config = config.model_copy(update={"precision": "bfloat16"})
    coarse = predict(model, values, index, 1.0, coarse_config)
    assert coarse.dtype == np.float32
    assert not np.array_equal(exact, coarse)
    # Every layer rounds what it takes and gives; the logits are these logarithms and a constant.
    rounding = n_layers * torch.finfo(torch.bfloat16).eps * np.ptp(np.log(exact))
    np.testing.assert_allclose(coarse, exact, rtol=rounding)
    np.testing.assert_allclose(coarse.sum(1), 1, rtol=8 * EPS)


def test_training_in_bfloat16_keeps_float32_weights(make_problem, config):
    """On any processor, also where an LSTM is left in float32."""
    model = build("cnn-lstm", 3, (4, 8, 8))
    in_bfloat16 = config.model_copy(update={"precision": "bfloat16", "max_epochs": 1})
    train(model, LearningSet(*make_problem((4, 8, 8), n=48)), in_bfloat16, seed=0)
    assert {p.dtype for p in model.parameters()} == {torch.float32}


@pytest.mark.parametrize("allowed", [True, False])
@pytest.mark.parametrize("has_it", [True, False])
def test_auto_takes_bfloat16_only_where_the_processor_has_it(has_it, allowed, config, monkeypatch):
    """And where nothing keeps oneDNN from using it."""
    cpu = torch.device("cpu")
    auto = config.model_copy(update={"precision": "auto"})
    told = {"avx512_bf16": has_it}  # not every PyTorch has the function
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: told, raising=False)
    monkeypatch.setattr(hardware, "takes_bfloat16", lambda: allowed)
    assert has_bfloat16(cpu) is (has_it and allowed)
    assert isinstance(autocast(auto, cpu), torch.autocast) is (has_it and allowed)
    assert not isinstance(autocast(config, cpu), torch.autocast)


def test_a_missing_gpu_is_refused_only_when_asked_for(config, monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert choose_device(config.model_copy(update={"device": "auto"})).type == "cpu"
    with pytest.raises(InputError, match="expected a CUDA GPU, found none"):
        choose_device(config.model_copy(update={"device": "cuda"}))


def test_statistics_average_all_batches_so_far_or_as_keras_a_hundredth_of_each():
    """Means 1 and 3 of two batches: after each the running mean is 1, then 2, not 0.01, 0.04."""
    norm = nn.BatchNorm1d(1, momentum=0.01)
    warm_up = WarmUp(norm)
    for mean, running in ((1.0, 1.0), (3.0, 2.0)):
        warm_up.step()
        norm(torch.tensor([[mean - 1], [mean + 1]]))
        assert norm.running_mean.item() == pytest.approx(running)
    for _ in range(150):
        warm_up.step()
    assert norm.momentum == 0.01
    samples = torch.randn(64, 4, generator=torch.Generator().manual_seed(0)) + 5
    as_keras = batch_norm_units(4).train()
    as_keras(samples)
    assert torch.allclose(as_keras.running_mean, 0.01 * samples.mean(0))
    assert torch.allclose(as_keras.running_var, 0.99 + 0.01 * samples.var(0))
