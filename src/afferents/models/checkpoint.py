"""The file from which a training that was stopped resumes, to the same weights."""

import json
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from afferents.documents import parse_json
from afferents.errors import InputError
from afferents.files import write_aside
from afferents.models.learner import Epoch, History, Learner

EVERY_S = 300.0
"""A checkpoint is written this often, s; most trainings end before."""

_MODEL, _BEST, _ADAM, _RANDOM, _RANDOM_GPU = "model.", "best.", "adam.", "random", "random_gpu"


class Checkpoint:
    """The file that holds all that a training needs to resume.

    Parameters
    ----------
    path
        Safetensors: the network, the best weights, Adam's moments, and the random state; the
        rest stands in its metadata.
    of
        What distinguishes the training from others of that path: of other data, say.
    every_s
        How often it is written, s.
    """

    def __init__(self, path: Path, of: str = "", every_s: float = EVERY_S) -> None:
        """Nothing is read or written yet."""
        self.path, self.of, self._every_s = path, of, every_s
        self._started_s = self._written_s = time.monotonic()

    def save(self, learner: Learner, history: History, about: Mapping[str, object]) -> None:
        """Write, if it is time, what is needed to resume after the epoch that has just ended."""
        if time.monotonic() - self._written_s < self._every_s:
            return
        adam = learner.optimiser.state_dict()["state"]
        tensors = {
            **_prefix(_MODEL, learner.model.state_dict()),
            **_prefix(_BEST, history.weights),
            **_prefix(_ADAM, {f"{i}.{k}": v for i, its in adam.items() for k, v in its.items()}),
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

        A file that is damaged, or of another training than `about` describes, is ignored: the
        history is then empty.
        """
        self._started_s = time.monotonic()
        try:
            with safe_open(self.path, "pt", device=str(learner.device)) as file:
                stored = (file.metadata() or {}).items()
                what = "a checkpoint of a training"
                rest = {name: parse_json(text, self.path, what) for name, text in stored}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        except (OSError, SafetensorError, InputError):
            return History()
        if rest.get("about") != json.loads(json.dumps(about)):
            return History()
        learner.model.load_state_dict(_select(_MODEL, tensors))
        for name, value in _select(_ADAM, tensors).items():
            number, _, moment = name.partition(".")
            parameter = learner.optimiser.param_groups[0]["params"][int(number)]
            if value.shape == parameter.shape:  # in the layout of its parameter
                value = torch.empty_like(parameter).copy_(value)
            learner.optimiser.state[parameter][moment] = value
        learner.restore(rest["learner"])
        torch.set_rng_state(tensors[_RANDOM].cpu())
        if _RANDOM_GPU in tensors:
            torch.cuda.set_rng_state(tensors[_RANDOM_GPU].cpu())
        epochs = [Epoch(**epoch) for epoch in rest["epochs"]]
        return History(epochs, rest["best_epoch"], _select(_BEST, tensors), rest["seconds"])


def _prefix(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {f"{prefix}{name}": value.contiguous() for name, value in tensors.items()}


def _select(prefix: str, tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {n.removeprefix(prefix): t for n, t in tensors.items() if n.startswith(prefix)}
