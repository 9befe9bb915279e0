"""One training loop and its configuration."""

from afferents.training.aside import PutAside
from afferents.training.config import (
    TRAINED,
    Compute,
    Preset,
    TrainingConfig,
    training_config,
)
from afferents.training.course import Epoch
from afferents.training.hardware import computed_with, is_out_of_memory
from afferents.training.loop import TrainedModel, predict, train
from afferents.training.staged import train_in_stages
from afferents.training.weights import load_weights, save_weights, weights_of

__all__ = [
    "TRAINED",
    "Compute",
    "Epoch",
    "Preset",
    "PutAside",
    "TrainedModel",
    "TrainingConfig",
    "computed_with",
    "is_out_of_memory",
    "load_weights",
    "predict",
    "save_weights",
    "train",
    "train_in_stages",
    "training_config",
    "weights_of",
]
