"""Weights on disk."""

import pytest
import torch

from afferents.errors import InputError
from afferents.models.classifiers import build
from afferents.models.folder import load_weights, save_weights
from afferents.models.learning_set import LearningSet
from afferents.models.loop import predict, train


def test_a_trained_network_survives_the_disk(tmp_path, make_problem, config):
    problem = make_problem((2, 140), n=48)
    config = config.model_copy(update={"max_epochs": 2})
    model = train(build("vibration-net", 3, (2, 140)), LearningSet(*problem), config, seed=0).model
    save_weights(model, tmp_path / "weights.safetensors")
    again = build("vibration-net", 3, (2, 140), seed=9)
    load_weights(again, tmp_path / "weights.safetensors")
    for name, value in model.state_dict().items():
        assert torch.equal(again.state_dict()[name], value), name
    arguments = (problem.values, problem.validation, 1.0, config)
    torch.testing.assert_close(predict(model, *arguments), predict(again, *arguments))
    assert [path.name for path in tmp_path.iterdir()] == ["weights.safetensors"]


def test_weights_of_another_network_are_refused(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(build("vibration-net", 3, (1, 140)), path)
    with pytest.raises(InputError, match="expected weights of SpatialNet"):
        load_weights(build("spatial-net", 3, (8, 8)), path)
    with pytest.raises(InputError, match="expected weights of VibrationNet, found size mismatch"):
        load_weights(build("vibration-net", 4, (1, 140)), path)


def test_a_missing_or_broken_file_is_refused(tmp_path):
    model = build("vibration-net", 3, (1, 140))
    with pytest.raises(
        InputError,
        match=r"nothing\.safetensors: expected weights that can be read, found No such file",
    ):
        load_weights(model, tmp_path / "nothing.safetensors")
    broken = tmp_path / "broken.safetensors"
    broken.write_bytes(b"no weights")
    with pytest.raises(InputError, match=r"broken\.safetensors: expected weights as safetensors"):
        load_weights(model, broken)
