"""Weights on disk as safetensors."""

from pathlib import Path

from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import nn

from afferents.core.errors import InputError, reason_of
from afferents.core.files import write_aside


def save_weights(model: nn.Module, path: Path) -> None:
    """Write a network's weights and running statistics, whole or not at all."""
    with write_aside(path) as partial:
        partial.write_bytes(weights_of(model))


def weights_of(model: nn.Module) -> bytes:
    """Return the content of a file of weights."""
    state = {name: value.cpu().contiguous() for name, value in model.state_dict().items()}
    return save(state)


def load_weights(model: nn.Module, path: Path) -> None:
    """Read weights into a network of the same layers, in place.

    Raises
    ------
    InputError
        If the file is missing, is no safetensors file, or belongs to another network.
    """
    try:
        model.load_state_dict(load(path.read_bytes()))
    except OSError as error:
        raise InputError(path, "weights that can be read", reason_of(error)) from error
    except SafetensorError as error:
        raise InputError(path, "weights as safetensors", str(error)) from error
    except RuntimeError as error:
        found = str(error).splitlines()[-1].strip()
        raise InputError(path, f"weights of {type(model).__name__}", found) from error
