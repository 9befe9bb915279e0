"""A trained model as one ONNX file, with its card in the metadata."""

import logging
import warnings
from pathlib import Path

import numpy as np
import torch
from torch import nn

from afferents import files, plugins
from afferents.errors import AfferentsError, InputError, raised
from afferents.models.card import METADATA, Card, tensor_names
from afferents.models.deployed import Stepping
from afferents.models.folder import load_model
from afferents.models.networks import CnnLstm

AGREES = 1e-4
"""The file's outputs must be the model's to this, on samples drawn at random: rounding alone."""
_TRIALS = 8

Tensors = tuple[torch.Tensor, ...]


def export(model: files.Place, out: files.Place, force: bool = False) -> Path:
    """Write a trained model, with its card, as one ONNX file: what 'live' takes.

    It is written whole or not at all, once it is seen to give the same. The input is `sample`, one
    as the encoding makes it, not scaled, of shape `(1, *shape)`. Outputs are `probabilities` (1,
    texture) and `novelty` (1,), above 1 for what nothing learnt fits. A CNN-LSTM goes frame by
    frame: its inputs are `image` (1, row, column) and `past` (1, frames - 1, feature), zeros at
    first, and it has the further output `next_past` to give back with the next image; before the
    first run is full its outputs mean nothing.

    Parameters
    ----------
    model
        Folder of a model that 'train' wrote.
    out
        File to write, such as model.onnx.
    force
        Overwrite what this command wrote there before (nothing else).

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputError
        If the folder is no model's, or that of a scikit-learn estimator, the packages that write
        ONNX are missing, or `out` is not free.
    AfferentsError
        If PyTorch can't export a module of the user's own, or the file does not give what the model
        gives.

    Examples
    --------
    >>> export("model", "model.onnx")
    PosixPath('model.onnx')
    """
    onnx = plugins.import_extra("train", "export", "onnx", "onnxscript", "onnxruntime")
    folder, out = Path(model), Path(out)
    files.require_free(out, is_exported, force=force, reads=[folder])
    card, deployed = load_model(folder)
    if not deployed.network.exportable:
        expected = "a model whose classifier is a torch module, or one of this package"
        raise InputError(
            f"{folder}: expected {expected}, found the estimator {deployed.network.name}"
        )
    sample: Tensors = (torch.ones(1, *card.shape),)
    module: nn.Module = deployed
    if isinstance(deployed.network, CnnLstm):  # it takes one frame, and what came of those before
        past = torch.zeros(1, card.shape[0] - 1, deployed.network.lstm.input_size)
        module, sample = Stepping(deployed).eval(), (sample[0][:, 0], past)
    with files.write_aside(out) as partial:
        write_onnx(module, sample, partial)
        written = onnx.load(str(partial))
        onnx.helper.set_model_props(written, {METADATA: card.to_json()})
        onnx.save(written, str(partial))
        _require_same_outputs(module, sample, card, partial)
    return out


def is_exported(path: Path) -> bool:
    """Return whether a file is a model that `export` wrote: its card stands in it as text."""
    return path.is_file() and b'"format":"afferents model"' in path.read_bytes()


def write_onnx(module: nn.Module, sample: Tensors, path: Path) -> None:
    """Write a module as ONNX, by a sample of its inputs."""
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)
    inputs, outputs = tensor_names(stepping=len(sample) > 1)
    try:
        with warnings.catch_warnings(action="ignore"):
            torch.onnx.export(
                module,
                sample,
                path,
                input_names=list(inputs),
                output_names=list(outputs),
                dynamo=True,
                external_data=False,
                verbose=False,
            )
    except torch.onnx.OnnxExporterError as error:
        found = raised(error.__cause__ or error)
        raise AfferentsError(
            f"export: expected a module that PyTorch can export, found {found}"
        ) from error


@torch.inference_mode()
def _require_same_outputs(module: nn.Module, sample: Tensors, card: Card, path: Path) -> None:
    """Require that file and model give the same for random samples."""
    import onnxruntime

    session = onnxruntime.InferenceSession(path.read_bytes(), providers=["CPUExecutionProvider"])
    inputs, _ = tensor_names(stepping=len(sample) > 1)
    rng = np.random.default_rng(0)
    for _ in range(_TRIALS):
        trial = [rng.exponential(0.2, part.shape).astype(np.float32) for part in sample]
        trial[0] *= card.scale
        expected = module(*map(torch.from_numpy, trial))
        found = session.run(None, dict(zip(inputs, trial, strict=True)))
        for a, b in zip(found, expected, strict=True):
            size = 1 + float(b.abs().max())
            if not np.allclose(a, b.numpy(), atol=AGREES * size):
                off = float(np.abs(a - b.numpy()).max())
                raise AfferentsError(f"export: the ONNX file gives something else, by {off:g}")
