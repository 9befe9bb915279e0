"""The classifiers: the paper's networks, one file each, then those that are solved at once."""

from afferents.models.base import Classifier, FitData, Network, Solved, Task, build_for
from afferents.models.calibration import best_weights, cross_entropy, fit_temperature, weighted
from afferents.models.cnn_lstm import CnnLstm
from afferents.models.deployed import Deployed, Stepping
from afferents.models.discriminant import Discriminant
from afferents.models.fusion import JointFusion, LateFusion, MeanFusion
from afferents.models.keras import KerasArray, put_keras_weights
from afferents.models.layers import (
    L2,
    ParameterCount,
    count_parameters,
    kernels_with_l2,
    l2_penalty,
)
from afferents.models.novelty import KNOWN, Novelty
from afferents.models.orders import OrderSearch
from afferents.models.ridge import (
    PENALTY,
    Gram,
    Ridge,
    SearchedRidge,
    equal_weights,
    log_probabilities,
    sum_of,
)
from afferents.models.shapes import LayerShape, layer_shapes, written_shape
from afferents.models.spatial import SpatialNet
from afferents.models.stems import ThreeStems
from afferents.models.table import CLASSIFIERS, build, classifier_of
from afferents.models.vibration import VibrationNet

__all__ = [
    "CLASSIFIERS",
    "KNOWN",
    "L2",
    "PENALTY",
    "Classifier",
    "CnnLstm",
    "Deployed",
    "Discriminant",
    "FitData",
    "Gram",
    "JointFusion",
    "KerasArray",
    "LateFusion",
    "LayerShape",
    "MeanFusion",
    "Network",
    "Novelty",
    "OrderSearch",
    "ParameterCount",
    "Ridge",
    "SearchedRidge",
    "Solved",
    "SpatialNet",
    "Stepping",
    "Task",
    "ThreeStems",
    "VibrationNet",
    "best_weights",
    "build",
    "build_for",
    "classifier_of",
    "count_parameters",
    "cross_entropy",
    "equal_weights",
    "fit_temperature",
    "kernels_with_l2",
    "l2_penalty",
    "layer_shapes",
    "log_probabilities",
    "put_keras_weights",
    "sum_of",
    "weighted",
    "written_shape",
]
