"""Networks of three afferents together: late, and one network with three stems."""

import json

import numpy as np
import pytest
import torch

import afferents
from afferents.encodings.samples import concatenate, make_samples
from afferents.errors import InputError
from afferents.folds.protocol import Fold
from afferents.models.base import Task, build_for
from afferents.models.fitted import Fitted, Part
from afferents.models.fitting import mean_of
from afferents.models.learning_set import last_within
from afferents.models.model import MODELS
from afferents.models.networks import ThreeStems
from afferents.models.solved import MeanFusion

from .counted import count_parameters

FACTS = {"passes": 1, "seconds": 1.0, "job_seconds": 1.0, "best_epoch": 1, "epochs": 2}
SHAPES = ((1, 200), (10, 19, 19), (10, 19, 19))


def samples(starts, length, recording="1/20"):
    start = np.asarray(starts, dtype=float)
    attrs = {"texture": recording[0], "speed_mm_s": 20.0, "name": recording}
    values = np.zeros((len(start), 1), np.float32)
    return make_samples(values, ("feature",), start, start + length, attrs)


def part_of(found, test):
    none = np.array([], dtype=np.int64)
    return Part(found, Fold(20.0, 20.0, none, none, np.array(test)), None)


def fitted(probabilities):
    facts = {**FACTS, "validation_accuracy": 0.5}
    classifier = torch.nn.Linear(1, 2)
    return Fitted(classifier, np.array(probabilities, np.float32), None, facts)


def test_the_mean_of_log_probabilities_within_a_window():
    windows = concatenate([samples([0, 1], 1), samples([0], 1, "2/20")])
    images = concatenate([samples([0, 0.5, 1.2], 0.4), samples([3], 0.4, "2/20")])
    lead, other = part_of(windows, [0, 1, 2]), part_of(images, [0, 1, 2, 3])
    fused = mean_of(
        {
            "a": fitted([[0.5, 0.5], [0.8, 0.2], [0.3, 0.7]]),
            "b": fitted([[0.9, 0.1], [0.6, 0.4], [0.2, 0.8], [0.99, 0.01]]),
        },
        [lead, other],
    )
    odds = fused.probabilities[:, 0] / fused.probabilities[:, 1]
    first = (np.log(9) + np.log(1.5)) / 2  # two images end within the first window
    expected = [first / 2, (np.log(4) + np.log(0.25)) / 2, np.log(3 / 7) / 2]
    np.testing.assert_allclose(np.log(odds), expected, atol=1e-6)
    assert isinstance(fused.classifier, MeanFusion)
    assert (fused.facts["passes"], fused.facts["epochs"]) == (2, 4)
    assert "best_epoch" not in fused.facts
    assert set(fused.facts["parts"]) == {"a", "b"}


def test_the_run_that_ends_last_in_a_window_and_is_of_its_arc():
    windows = concatenate([samples([0, 1, 2], 1), samples([0], 1, "2/20")])
    runs = concatenate([samples([0.1, 0.5, 0.9, 1.3], 0.3), samples([5, 6], 0.3, "2/20")])
    # After the last run the one before stands for it; before the first, the first.
    assert list(last_within(windows, runs)) == [1, 3, 3, 4]
    windows = samples([0.0, 0.2, 2.0, 2.2], 0.2).assign_coords(group=("sample", list("1122")))
    runs = samples([-0.1, 0.1, 1.5, 2.1], 0.25).assign_coords(group=("sample", list("1112")))
    # None ends in the third window: the one before it is of the arc before, the next of its own.
    assert list(last_within(windows, runs)) == [0, 1, 3, 3]
    with pytest.raises(InputError, match=r"recording 1/20: expected samples of every.*in part 2"):
        last_within(windows, runs.isel(sample=[0, 1, 2]))


class Shapes:
    shapes = SHAPES


def test_every_stem_is_heard():
    length = sum(int(np.prod(shape)) for shape in SHAPES)
    network = build_for(ThreeStems, Task(13, (length,), ("feature",), Shapes())).eval()
    stems = 260_685 - 12_320 - 429 + 2 * (272_373 - 352 - 64 - 528 - 32 - 221)
    dense = 404 * 32 + 32 + 64 + 528 + 32 + 221
    assert count_parameters(network)[1] == stems + dense
    touch = torch.rand(2, length)
    with torch.no_grad():
        before = network(touch)
        for start in (0, 200, 200 + 3610):
            other = touch.clone()
            other[:, start : start + 200] += 1
            assert not torch.allclose(network(other), before)
    with pytest.raises(InputError, match="a spectrum and two runs of images"):
        build_for(ThreeStems, Task(13, (length,), ("feature",)))


def test_both_are_evaluated(stores, tmp_path):
    tiny = {"max_epochs": 1, "image_epochs": 1, "training_samples": 12, "validation_samples": 6}
    models = ["ra-se-aug", "ra-ste-aug", "fusion-networks", "three-stems"]
    results = afferents.evaluate(
        stores["video"], tmp_path / "r", models, preset="quick", recipe=tiny, held_out=[40.0],
        workers=1, window_s=0.2, stride_s=0.05, quiet=True,
    )  # fmt: skip
    assert set(results.summary["models"]) == set(models)
    counts = results.predictions.groupby("model").size()
    assert counts["fusion-networks"] == counts["three-stems"] == 9
    (path,) = (tmp_path / "r/folds/fusion-networks").rglob("fold.json")
    assert set(json.loads(path.read_text())["parts"]) == set(MODELS["fusion-networks"].parts)
