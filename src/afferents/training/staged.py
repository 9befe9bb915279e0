"""A shorter road for the CNN-LSTM: images first, time after.

The image stack learns from single frames, as the spatial network, and is then kept; what it makes
of every frame is worked out once, and the LSTMs and dense layers learn from that. A frame costs a
tenth of a run, and the second stage next to nothing. Not the published recipe.
"""

import time
from dataclasses import replace
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents.models import CnnLstm, SpatialNet, build
from afferents.models.cnn_lstm import last_state
from afferents.models.spatial import image_features
from afferents.training.config import TrainingConfig
from afferents.training.hardware import autocast, choose_device
from afferents.training.learning_set import LearningSet
from afferents.training.loop import TrainedModel, train

_AT_ONCE = 64


class _Head(nn.Module):
    """The LSTMs and dense layers of a CNN-LSTM, for features (batch, frame, feature)."""

    def __init__(self, model: CnnLstm) -> None:
        super().__init__()
        self.lstm, self.dense = model.lstm, model.dense

    def forward(self, features: Tensor) -> Tensor:
        logits: Tensor = self.dense(last_state(self.lstm, features))
        return logits


def train_in_stages(
    model: CnnLstm, learnt: LearningSet, config: TrainingConfig, seed: int
) -> TrainedModel:
    """Train a CNN-LSTM in place, its image stack from single frames first.

    Of every training run one frame is taken, the first of the first run, the second of the
    second and so on; the image stage is trained for `config.image_epochs` epochs on as many
    frames as there are training runs times `config.frames_a_run`.

    Parameters
    ----------
    model, learnt, config, seed
        As for `train`; values are (n_runs, frame, row, column) and not scaled.
    """
    start = time.perf_counter()
    values, labels = learnt.values, learnt.labels
    n_frames = values.shape[1]
    stage = config.model_copy(
        update={"max_epochs": config.image_epochs, "learning_rate": config.image_rate}
    )
    n_classes = int(labels.max()) + 1
    spatial = cast("SpatialNet", build(SpatialNet, n_classes, tuple(values.shape[2:]), seed))
    spatial.image.load_state_dict(model.image.state_dict())
    frames = LearningSet(
        values.flatten(0, 1),
        labels.repeat_interleave(n_frames),
        _frames_of(learnt.train, n_frames, config.frames_a_run),
        _frames_of(learnt.validation, n_frames, 1),
    )
    of_images = train(spatial, frames, stage, seed)
    model.image.load_state_dict(spatial.image.state_dict())
    used = np.concatenate([learnt.train, learnt.validation])
    features = _features(model.image, values, used, config)
    n_train = len(learnt.train)
    after = LearningSet(
        features,
        labels[torch.from_numpy(used)],
        np.arange(n_train),
        np.arange(n_train, len(used)),
    )
    trained = train(_Head(model), after, config, seed)
    return replace(
        trained,
        model=model,
        passes=of_images.passes + trained.passes,
        seconds=time.perf_counter() - start,
    )


def _frames_of(runs: NDArray[np.int64], n_frames: int, a_run: int) -> NDArray[np.int64]:
    """Return `a_run` frames of each run, other places of other runs, as indices of frames."""
    place = (np.arange(len(runs))[:, None] + np.arange(a_run) * (n_frames // a_run)) % n_frames
    frames: NDArray[np.int64] = (runs[:, None] * n_frames + place).ravel()
    return frames


@torch.no_grad()
def _features(
    image: nn.Module, values: Tensor, runs: NDArray[np.int64], config: TrainingConfig
) -> Tensor:
    """Return what the image stack makes of every frame of some runs, (n_runs, frame, feature)."""
    device = choose_device(config)
    image.to(device).eval()
    n_frames, *size = values.shape[1:]
    features = torch.empty(len(runs), n_frames, image_features(*size))
    indices = torch.split(torch.from_numpy(runs), _AT_ONCE)
    for part, index in zip(torch.split(features, _AT_ONCE), indices, strict=True):
        batch = values.index_select(0, index).to(device)
        with autocast(config, device):
            found = image(batch.flatten(0, 1).unsqueeze(1))
        part.copy_(found.unflatten(0, batch.shape[:2]))
    return features
