"""What a network is made of: its layers in order, what leaves each, and their parameters."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from afferents import dims
from afferents.models.base import Classifier
from afferents.models.layers import FlattenChannelsLast, RegularisedLinear, count_parameters


class LayerShape(NamedTuple):
    """A layer of a network.

    Attributes
    ----------
    title
        What it is, such as `Conv 64, 3 x 3`.
    shape
        What leaves it, of one sample, channels last as Keras writes them: `9 x 9 x 64`; of a
        network that goes through frames with the same weights, `10 of 9 x 9 x 64`.
    n_parameters
        As Keras counts them; see `count_parameters`.
    """

    title: str
    shape: str
    n_parameters: int


@torch.no_grad()
def layer_shapes(network: Classifier, sample_shape: tuple[int, ...]) -> list[LayerShape]:
    """Return the layers of a network in the order in which a sample passes them.

    Parameters
    ----------
    network
        That the samples fit. It is asked once, about a sample of zeros, and left as it was.
    sample_shape
        Of one sample, such as (19, 19).
    """
    found: list[LayerShape] = []
    layers = [module for module in network.modules() if not list(module.children())]
    frames = sample_shape[0] if network.takes[:1] == (dims.FRAME,) else 1

    def note(module: nn.Module, given: Any, output: Any) -> None:
        found.extend(_described(module, output, frames))

    hooks = [layer.register_forward_hook(note) for layer in layers]
    training = network.training
    try:
        network.eval()(torch.zeros(1, *sample_shape))
    finally:
        network.train(training)
        for hook in hooks:
            hook.remove()
    return found


def _described(module: nn.Module, output: Any, frames: int) -> Iterator[LayerShape]:
    if isinstance(module, nn.LSTM):
        yield from _lstm_layers(module, output[0])
        return
    values: Tensor = output
    each = values.shape[0]
    shape = written_shape(tuple(values.shape[1:]))
    shape = f"{frames} of {shape}" if each == frames > 1 else shape
    yield LayerShape(_title(module), shape, count_parameters(module).total)


def _lstm_layers(lstm: nn.LSTM, sequence: Tensor) -> Iterator[LayerShape]:
    """Return the layers of a stack of LSTMs, of which the last state alone goes on."""
    frames, units = sequence.shape[1], lstm.hidden_size
    for layer in range(lstm.num_layers):
        count = sum(
            parameter.numel()
            for name, parameter in lstm.named_parameters()
            if name.endswith(f"_l{layer}") and parameter.requires_grad
        )
        last = layer == lstm.num_layers - 1
        yield LayerShape(
            f"LSTM {units}, {'last state' if last else 'sequence'}",
            f"{units}" if last else f"{frames} x {units}",
            count,
        )


def written_shape(shape: tuple[int, ...]) -> str:
    """Return (channel, row, column) as `row x column x channel`, without a height of 1."""
    if len(shape) == 3:
        channels, height, width = shape
        shape = (width, channels) if height == 1 else (height, width, channels)
    return " x ".join(map(str, shape))


def _title(module: nn.Module) -> str:
    """Return what a layer is, in the words of the published tables."""
    match module:
        case nn.Conv2d():
            same = "same" if any(_pair(module.padding)) else "valid"
            return f"Conv {module.out_channels}, {_kernel(module.kernel_size)}, {same}"
        case nn.MaxPool2d():
            return f"MaxPool {max(_pair(module.kernel_size))}"
        case nn.BatchNorm2d() | nn.BatchNorm1d():
            return "BatchNorm"
        case nn.Dropout():
            return f"Dropout {module.p:g}"
        case nn.Linear():
            penalty = ", L2" if isinstance(module, RegularisedLinear) else ""
            return f"Dense {module.out_features}{penalty}"
        case FlattenChannelsLast():
            return "Flatten"
        case _:
            return type(module).__name__


def _kernel(size: Any) -> str:
    height, width = _pair(size)
    return f"{width}" if height == 1 else f"{height} x {width}"


def _pair(size: Any) -> tuple[int, int]:
    return size if isinstance(size, tuple) else (size, size)
