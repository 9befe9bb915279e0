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
def test_statistics_may_be_kept_as_keras_does(recipe):
    usual, kept = (
        training_config("paper", recipe),
        training_config("paper", recipe, statistics="keras"),
    )
    assert usual.warm_up_statistics
    assert kept == usual.model_copy(update={"warm_up_statistics": False})


@pytest.mark.parametrize("recipe", RECIPES)
def test_quick_sees_fewer_samples_for_fewer_epochs(recipe):
    quick, paper = training_config("quick", recipe), training_config("paper", recipe)
    assert quick.training_samples is not None
    assert quick.max_epochs < paper.max_epochs
    assert quick.patience < quick.max_epochs


@pytest.mark.parametrize("recipe", RECIPES)
def test_fast_goes_one_cycle_over_fewer_samples(recipe):
    fast, paper = training_config("fast", recipe), training_config("paper", recipe)
    assert (fast.one_cycle, paper.one_cycle) == (True, False)
    assert fast.patience is None
    assert fast.max_epochs < paper.patience
    assert fast.training_samples is not None


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


def test_a_configuration_is_frozen():
    with pytest.raises(ValidationError):
        training_config("paper", "spatial-net").patience = 1
