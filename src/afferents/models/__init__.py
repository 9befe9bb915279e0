"""The networks, one file for each of the paper's; then models that are solved at once."""

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
from afferents.models.orders import OrderSearch
from afferents.models.ridge import (
    KERNEL_STRENGTHS,
    STRENGTH,
    Gram,
    Ridge,
    equal_weights,
    log_probabilities,
    sum_of,
)
from afferents.models.spatial import SpatialNet
from afferents.models.strangeness import KNOWN, Strangeness
from afferents.models.vibration import VibrationNet

__all__ = [
    "KERNEL_STRENGTHS",
    "KNOWN",
    "L2",
    "STRENGTH",
    "CnnLstm",
    "Deployed",
    "Gram",
    "OrderSearch",
    "ParameterCount",
    "Ridge",
    "SpatialNet",
    "Stepping",
    "Strangeness",
    "VibrationNet",
    "build",
    "count_parameters",
    "equal_weights",
    "kernels_with_l2",
    "l2_penalty",
    "log_probabilities",
    "sum_of",
]
