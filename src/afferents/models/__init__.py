"""The networks, one file for each of the paper's; `build` picks one by encoding."""

from afferents.models.build import build
from afferents.models.cnn_lstm import CnnLstm
from afferents.models.deployed import Deployed, Stepping
from afferents.models.layers import (
    L2,
    ParameterCount,
    count_parameters,
    kernels_with_l2,
    l2_penalty,
)
from afferents.models.spatial import SpatialNet
from afferents.models.vibration import VibrationNet

__all__ = [
    "L2",
    "CnnLstm",
    "Deployed",
    "ParameterCount",
    "SpatialNet",
    "Stepping",
    "VibrationNet",
    "build",
    "count_parameters",
    "kernels_with_l2",
    "l2_penalty",
]
