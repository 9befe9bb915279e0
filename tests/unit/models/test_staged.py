"""The CNN-LSTM in stages: images first, time after."""

import copy

import numpy as np
import pytest
import torch

import afferents
from afferents.encodings.images import SpatialEncoding, SpatiotemporalEncoding
from afferents.models.classifiers import build
from afferents.models.fitting import choose_recipe
from afferents.models.learning_set import LearningSet
from afferents.models.loop import pick_frames, predict, train_in_stages
from afferents.models.model import Model


def staged(make_problem, config, seed=0, epochs=20, progress=lambda _: None):
    problem = make_problem((4, 8, 8))
    model = build("cnn-lstm", 3, (4, 8, 8))
    stages = {"batch_size": 16, "max_epochs": epochs, "patience": 19, "image_epochs": 6}
    trained = train_in_stages(
        model,
        LearningSet(*problem),
        config.model_copy(update={**stages, "frames_a_run": 2}),
        seed,
        progress,
    )
    return problem, model, trained


def test_what_share_is_done_is_told_of_both_stages(make_problem, config):
    told = []
    staged(make_problem, config, epochs=4, progress=told.append)
    np.testing.assert_allclose(told, [*np.arange(1, 7) / 12, 0.625, 0.75, 0.875, 1.0])


def test_it_learns_and_leaves_one_whole_network(make_problem, config):
    problem, model, trained = staged(make_problem, config)
    probabilities = predict(model, problem.values, problem.validation, 1.0, config)
    accuracy = (probabilities.argmax(1) == problem.labels.numpy()[problem.validation]).mean()
    second, first = np.sort(probabilities, axis=1)[:, -2:].T
    assert accuracy > 0.8
    n = len(problem.train)
    assert trained.passes == n * len(trained.epochs) + 2 * n * 6
    # What was judged on features is what the whole network says of the runs, but where rounding
    # decides between two textures: features are sums of up to 576 products.
    undecided = (first - second < 576 * np.finfo(np.float32).eps).mean()
    judged = trained.epochs[trained.best_epoch - 1].validation_accuracy
    assert accuracy == pytest.approx(judged, abs=undecided)


def test_only_training_runs_teach(make_problem, config):
    problem = make_problem((4, 8, 8))
    labels = problem.labels.clone()
    labels[torch.from_numpy(problem.validation)] = 0
    again = build("cnn-lstm", 3, (4, 8, 8))
    stages = {"batch_size": 16, "max_epochs": 20, "patience": 19, "image_epochs": 6}
    one_stage = config.model_copy(update={**stages, "frames_a_run": 2, "max_epochs": 1})
    first = copy.deepcopy(again)
    for network, truth in ((first, problem.labels), (again, labels)):
        train_in_stages(
            network,
            LearningSet(*problem._replace(labels=truth)),
            one_stage.model_copy(update={"image_epochs": 1}),
            0,
        )
    # With one epoch a stage there is nothing to choose by validation.
    for one, other in zip(first.parameters(), again.parameters(), strict=True):
        torch.testing.assert_close(one, other)


def test_of_runs_that_are_short_every_frame_is_taken_once():
    frames = pick_frames(np.array([0, 1, 2]), n_frames=3, a_run=5)
    np.testing.assert_array_equal(np.sort(frames), np.arange(9))


def test_an_own_network_for_runs_of_images_has_the_recipe_of_the_paper_s():
    mine = Model("mine", channel="sa1", encoding="spatiotemporal", classifier=lambda *_: None)
    assert choose_recipe(mine, SpatiotemporalEncoding()) == "cnn-lstm"
    assert choose_recipe(mine, SpatialEncoding()) == "spatial-net"


def test_networks_of_images_learn_from_copies_at_other_speeds(stores, tmp_path):
    tiny = {"max_epochs": 1, "image_epochs": 1, "training_samples": 12, "validation_samples": 6}
    found = afferents.evaluate(
        stores["video"], tmp_path / "r", ["ra-se-aug", "ra-ste-aug"], preset="quick", recipe=tiny,
        held_out=[40.0], workers=1, quiet=True,
    )  # fmt: skip
    assert set(found.summary["models"]) == {"ra-se-aug", "ra-ste-aug"}
