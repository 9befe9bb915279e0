"""A trained model as one ONNX file, with its card in the metadata."""

import logging
import warnings
from pathlib import Path
from types import ModuleType

import numpy as np
import torch
from torch import nn

from afferents.core.card import METADATA, Card
from afferents.core.errors import AfferentsError, InputError
from afferents.core.files import write_aside
from afferents.models import CnnLstm, Deployed, Stepping
from afferents.pipeline.train_model import load_model

AGREES = 1e-4
"""The file's outputs must be the model's to this, on samples drawn at random: rounding alone."""
_TRIALS = 8


def export_model(folder: Path, out: Path) -> Card:
    """Write a model as ONNX, whole or not at all, once it is seen to say the same.

    Inputs are one sample as the encodings make it, not scaled: `image` (1, row, column) or
    `spectrum` (1, channel, frequency). Outputs are `probabilities` (1, texture) and
    `strangeness` (1,), above 1 for what nothing learnt fits. A spatio-temporal model goes frame
    by frame: it has the further input `past` (1, frames - 1, feature), zeros at first, and the
    output `next_past` to give back with the next image; before `frames` images it says nothing
    of worth.

    Raises
    ------
    InputError
        If the folder is no model's, or the packages that write ONNX are missing.
    AfferentsError
        If the file does not say what the model says.
    """
    onnx = _onnx()
    card, deployed = load_model(folder)
    module, sample, names = _exported(card, deployed)
    if out.is_dir():
        raise InputError(out, "a file to write, such as model.onnx", "a folder")
    with write_aside(out) as partial:
        _write(module, sample, names, partial)
        model = onnx.load(str(partial))
        onnx.helper.set_model_props(model, {METADATA: card.model_dump_json()})
        onnx.save(model, str(partial))
        _check(module, sample, names[0], card.scale, partial)
    return card


Names = tuple[list[str], list[str]]


def _exported(card: Card, deployed: Deployed) -> tuple[nn.Module, tuple[torch.Tensor, ...], Names]:
    """Return what is exported, a sample of its inputs, and the names of inputs and outputs."""
    outputs = ["probabilities", "strangeness"]
    if isinstance(deployed.network, CnnLstm):
        past = torch.zeros(1, card.frames - 1, deployed.network.lstm.input_size)
        sample = (torch.ones(1, *card.shape), past)
        return Stepping(deployed).eval(), sample, (["image", "past"], [*outputs, "next_past"])
    names = ["spectrum" if card.is_vibration else "image"]
    return deployed, (torch.ones(1, *card.shape),), (names, outputs)


def _write(module: nn.Module, sample: tuple[torch.Tensor, ...], names: Names, path: Path) -> None:
    inputs, outputs = names
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    with warnings.catch_warnings(action="ignore"):
        torch.onnx.export(
            module,
            sample,
            path,
            input_names=inputs,
            output_names=outputs,
            dynamo=True,
            external_data=False,
            verbose=False,
        )


@torch.inference_mode()
def _check(
    module: nn.Module,
    sample: tuple[torch.Tensor, ...],
    inputs: list[str],
    scale: float,
    path: Path,
) -> None:
    """Let file and model say something of the same random samples."""
    import onnxruntime

    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(0)
    for _ in range(_TRIALS):
        trial = [rng.exponential(0.2, part.shape).astype(np.float32) for part in sample]
        trial[0] *= scale
        expected = module(*map(torch.from_numpy, trial))
        found = session.run(None, dict(zip(inputs, trial, strict=True)))
        for a, b in zip(found, expected, strict=True):
            size = 1 + float(b.abs().max())
            if not np.allclose(a, b.numpy(), atol=AGREES * size):
                off = float(np.abs(a - b.numpy()).max())
                raise AfferentsError(f"export: the ONNX file says something else, by {off:g}")


def _onnx() -> ModuleType:
    try:
        import onnx
        import onnxruntime  # noqa: F401
        import onnxscript  # noqa: F401
    except ImportError as error:
        wanted, remedy = "the packages of the extra 'live'", "pip install 'afferents[live]'"
        raise InputError("export", wanted, str(error), remedy) from error
    return onnx
