"""A training that was stopped goes on from its checkpoint, to the same weights."""

import copy

import pytest
import torch

from afferents.models.classifiers import build
from afferents.models.learner import Checkpoint
from afferents.models.learning_set import LearningSet
from afferents.models.loop import train


class StoppedHereError(Exception):
    pass


def stop_after(n):
    def progress(share):
        if round(6 * share) == n:
            raise StoppedHereError

    return progress


def fates(trained):
    return [(e.number, e.loss, e.accuracy, e.validation_accuracy) for e in trained.epochs]


@pytest.mark.parametrize(("stops", "one_cycle"), [((2,), False), ((3, 5), True)])
@pytest.mark.parametrize(
    ("encoding", "shape"), [("spatial-net", (10, 10)), ("cnn-lstm", (4, 8, 8))]
)
def test_who_is_stopped_ends_where_others_end(
    encoding, shape, stops, one_cycle, make_problem, config, tmp_path
):
    problem = make_problem(shape, n=96, noise=3.0)
    config = config.model_copy(
        update={"one_cycle": one_cycle, "max_epochs": 6, "patience": None, "batch_size": 16}
    )
    checkpoint, learnt = Checkpoint(tmp_path / "fold.checkpoint", every_s=0), LearningSet(*problem)
    first, resumed = build(encoding, 3, shape, 1), build(encoding, 3, shape, 1)
    whole = train(first, learnt, config, 5)
    for stop in stops:
        with pytest.raises(StoppedHereError):
            train(build(encoding, 3, shape, 1), learnt, config, 5, stop_after(stop), checkpoint)
    seen = []
    see = lambda share: seen.append(round(6 * share))  # noqa: E731
    again = train(resumed, learnt, config, 5, see, checkpoint)
    # To the last bit: a checkpoint holds all bits, and the same steps follow in the same thread.
    assert seen == list(range(stops[-1], 7))  # the epoch that was stopped in is done again
    assert fates(again) == fates(whole)
    assert again.best_epoch == whole.best_epoch
    assert again.passes == whole.passes
    for (name, a), b in zip(resumed.state_dict().items(), first.state_dict().values(), strict=True):
        assert torch.equal(a, b), name


def test_what_is_damaged_or_of_another_training_is_ignored(problem, small_net, config, tmp_path):
    checkpoint = Checkpoint(tmp_path / "fold.checkpoint", every_s=0)
    with pytest.raises(StoppedHereError):
        train(copy.deepcopy(small_net), LearningSet(*problem), config, 0, stop_after(3), checkpoint)
    assert checkpoint.path.is_file()

    def first_epoch():
        seen = []
        see = lambda share: seen.append(round(6 * share))  # noqa: E731
        train(copy.deepcopy(small_net), LearningSet(*problem), config, 1, see, checkpoint)
        return seen[0]

    elsewhere = Checkpoint(checkpoint.path, of="other data", every_s=0)
    with pytest.raises(StoppedHereError):
        train(copy.deepcopy(small_net), LearningSet(*problem), config, 0, stop_after(1), elsewhere)
    assert first_epoch() == 1
    checkpoint.path.write_bytes(checkpoint.path.read_bytes()[:1000])
    assert first_epoch() == 1
