"""Training configurations: the published recipe, and what is refused."""

import pytest
from pydantic import ValidationError

from afferents.errors import InputError
from afferents.models.config import TrainingConfig, training_config

RECIPES = ["spatial-net", "cnn-lstm", "vibration-net"]


@pytest.mark.parametrize(
    ("recipe", "rate", "patience"),
    [("spatial-net", 1e-3, 20), ("cnn-lstm", 1e-4, 20), ("vibration-net", 1e-4, 10)],
)
def test_paper_is_the_published_recipe(recipe, rate, patience):
    config = training_config("paper", recipe)
    assert (config.learning_rate, config.patience) == (rate, patience)
    assert (config.batch_size, config.max_epochs) == (64, 150)
    assert config.training_samples is None


@pytest.mark.parametrize("recipe", RECIPES)
def test_presets_differ_from_the_paper_as_they_say(recipe):
    quick, fast, paper = (training_config(name, recipe) for name in ("quick", "fast", "paper"))
    assert quick.training_samples is not None
    assert quick.patience < quick.max_epochs < paper.max_epochs
    assert (fast.one_cycle, paper.one_cycle, fast.patience) == (True, False, None)
    assert fast.max_epochs < paper.patience
    assert fast.training_samples is not None
    kept = training_config("paper", recipe, statistics="keras")
    assert paper.warm_up_statistics
    assert kept == paper.model_copy(update={"warm_up_statistics": False})


def test_an_unknown_preset_is_refused():
    with pytest.raises(InputError, match="--preset: expected quick, fast or paper, found 'slow'"):
        training_config("slow", "spatial-net")


@pytest.mark.parametrize(
    "wrong",
    [
        {"learning_rate": 0},
        {"patience": 0},
        {"max_epochs": 0},
        {"batch_size": 1},
        {"training_samples": 0},
        {"precision": "float16"},
        {"device": "tpu"},
        {"epochs": 3},
        {"one_cycle": True},
    ],
)
def test_contradictions_are_refused_when_built(wrong):
    with pytest.raises(ValidationError):
        TrainingConfig(**{"learning_rate": 1e-3, "patience": 3, **wrong})
