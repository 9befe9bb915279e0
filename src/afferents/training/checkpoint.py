"""Checkpoints: a training that was stopped goes on where it was, to the same weights."""

import json
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from afferents.core.documents import parse_json
from afferents.core.errors import InputError
from afferents.core.files import write_aside
from afferents.training.history import Epoch, History
from afferents.training.learner import Learner

EVERY_S = 300.0
"""A checkpoint is written this often, s; most trainings end before."""

_WHAT = "a checkpoint of a training"
_MODEL, _BEST, _ADAM, _RANDOM, _RANDOM_GPU = "model.", "best.", "adam.", "random", "random_gpu"


class Checkpoint:
    """The file that holds all that a training needs to go on.

    Parameters
    ----------
    path
        Safetensors: the network, the best weights, Adam's moments, and the random state; the
        rest stands in its metadata.
    of
        What tells the training from others of that path: of other data, say.
    every_s
        How often it is written, s.
    """

    def __init__(self, path: Path, of: str = "", every_s: float = EVERY_S) -> None:
        """Nothing is read or written yet."""
        self.path, self.of, self._every_s = path, of, every_s
        self._started_s = self._written_s = time.monotonic()

    def save(self, learner: Learner, history: History, about: Mapping[str, object]) -> None:
        """Write, if it is time, what is needed to go on after the epoch that has just ended."""
        if time.monotonic() - self._written_s < self._every_s:
            return
        tensors = {
            **_named(_MODEL, learner.model.state_dict()),
            **_named(_BEST, history.weights),
            **_moments(learner),
            _RANDOM: torch.get_rng_state(),
        }
        if learner.device.type == "cuda":
            tensors[_RANDOM_GPU] = torch.cuda.get_rng_state()
        rest = {
            "about": about,
            "epochs": [asdict(epoch) for epoch in history.epochs],
            "best_epoch": history.best_epoch,
            "seconds": history.seconds + time.monotonic() - self._started_s,
            "learner": learner.state(),
        }
        content = save(tensors, {name: json.dumps(value) for name, value in rest.items()})
        with write_aside(self.path) as partial:
            partial.write_bytes(content)
        self._written_s = time.monotonic()

    def resume(self, learner: Learner, about: Mapping[str, object]) -> History:
        """Put learner and random state where they were, and return the history up to there.

        A file that is damaged, or of another training than `about` says, is not heeded: the
        history is then empty.
        """
        self._started_s = time.monotonic()
        try:
            with safe_open(self.path, "pt", device=str(learner.device)) as file:
                stored = (file.metadata() or {}).items()
                rest = {name: parse_json(text, self.path, _WHAT) for name, text in stored}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except (OSError, SafetensorError, InputError):
            return History()
        if rest.get("about") != json.loads(json.dumps(about)):
            return History()
        learner.model.load_state_dict(_part(_MODEL, tensors))
        _set_moments(learner, tensors)
        learner.go_on(rest["learner"])
        torch.set_rng_state(tensors[_RANDOM].cpu())
        if _RANDOM_GPU in tensors:
            torch.cuda.set_rng_state(tensors[_RANDOM_GPU].cpu())
        epochs = [Epoch(**epoch) for epoch in rest["epochs"]]
        return History(epochs, rest["best_epoch"], _part(_BEST, tensors), rest["seconds"])


def _named(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {f"{prefix}{name}": value.contiguous() for name, value in tensors.items()}


def _part(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {n.removeprefix(prefix): t for n, t in tensors.items() if n.startswith(prefix)}


def _moments(learner: Learner) -> dict[str, Tensor]:
    """Return Adam's steps and moments, by number of the parameter."""
    state = learner.optimiser.state_dict()["state"]
    return {
        f"{_ADAM}{i}.{name}": value.contiguous()
        for i, moments in state.items()
        for name, value in moments.items()
    }


def _set_moments(learner: Learner, tensors: Mapping[str, Tensor]) -> None:
    """Put Adam's steps and moments back, in the layout of their parameters."""
    for name, value in _part(_ADAM, tensors).items():
        number, _, moment = name.partition(".")
        parameter = learner.optimiser.param_groups[0]["params"][int(number)]
        if value.shape == parameter.shape:
            value = torch.empty_like(parameter).copy_(value)
        learner.optimiser.state[parameter][moment] = value
