"""Fitting a model on a fold: one training loop for all networks, and what is solved at once."""

from afferents.core.choices import Preset
from afferents.training.by_sums import named_when_left_out
from afferents.training.calibrate import Calibration, best_evidence, calibrate_model
from afferents.training.checkpoint import Checkpoint
from afferents.training.config import (
    RECIPES,
    Compute,
    TrainingConfig,
    training_config,
)
from afferents.training.estimator_file import own_types
from afferents.training.fitted import Fitted, Part, require_buildable
from afferents.training.fitting import fit, fit_once, learns_in_a_loop, recipe_of, recipes_of
from afferents.training.hardware import computed_with, is_out_of_memory
from afferents.training.history import Epoch
from afferents.training.hyperparameters import Hyperparameters
from afferents.training.keras_file import load_keras_weights
from afferents.training.learning_set import LearningSet, learning_set
from afferents.training.loop import TrainedModel, predict, train
from afferents.training.model_folder import is_model_folder, load_model, save_model
from afferents.training.staged import train_in_stages
from afferents.training.weights import load_weights, save_weights, weights_of

__all__ = [
    "RECIPES",
    "Calibration",
    "Checkpoint",
    "Compute",
    "Epoch",
    "Fitted",
    "Hyperparameters",
    "LearningSet",
    "Part",
    "Preset",
    "TrainedModel",
    "TrainingConfig",
    "best_evidence",
    "calibrate_model",
    "computed_with",
    "fit",
    "fit_once",
    "is_model_folder",
    "is_out_of_memory",
    "learning_set",
    "learns_in_a_loop",
    "load_keras_weights",
    "load_model",
    "load_weights",
    "named_when_left_out",
    "own_types",
    "predict",
    "recipe_of",
    "recipes_of",
    "require_buildable",
    "save_model",
    "save_weights",
    "train",
    "train_in_stages",
    "training_config",
    "weights_of",
]
