"""Layers as Keras makes them, and what Keras would count and regularise.

The paper's networks were written for Keras (2.3-style, TensorFlow 1.x). Where its defaults
differ from PyTorch's, this file holds the translation, so that the networks read like the
published tables.
"""

from functools import partial
from typing import Literal

import torch
from torch import Tensor, nn

from afferents.errors import InputError
from afferents.models.config import L2

batch_norm_maps = partial(nn.BatchNorm2d, eps=1e-3, momentum=0.01)
batch_norm_units = partial(nn.BatchNorm1d, eps=1e-3, momentum=0.01)
"""Batch normalisation with Keras' defaults, of feature maps and of dense units.

Keras' momentum, 0.99, is the share of the old value, PyTorch's that of the new one.
"""


class RegularisedLinear(nn.Linear):
    """A dense layer whose kernel (not its bias) carries the L2 term."""


class FlattenChannelsLast(nn.Module):
    """Flatten `(batch, channel, height, width)` in Keras' order, channel running fastest.

    Costs nothing where the tensor lies in memory as channels_last.
    """

    def forward(self, x: Tensor) -> Tensor:
        """Return shape (batch, height * width * channel)."""
        return x.permute(0, 2, 3, 1).flatten(1)


@torch.no_grad()
def initialise_like_keras(model: nn.Module) -> None:
    """Draw all weights anew as Keras does by default, in place.

    Kernels Glorot-uniform, recurrent kernels orthogonal, biases zero, forget-gate biases 1.
    Of PyTorch's two LSTM biases, which only ever act as their sum, the recurrent one is zero
    and frozen: Keras has one, and two would learn at twice the rate.
    """
    for module in model.modules():
        if isinstance(module, nn.Conv2d | nn.Linear):
            nn.init.xavier_uniform_(module.weight)
            if module.bias is not None:
                nn.init.zeros_(module.bias)
        elif isinstance(module, nn.LSTM):
            units = module.hidden_size
            for name, parameter in module.named_parameters():
                if name.startswith("weight_ih"):
                    nn.init.xavier_uniform_(parameter)
                elif name.startswith("weight_hh"):
                    nn.init.orthogonal_(parameter)
                else:
                    nn.init.zeros_(parameter)
                if name.startswith("bias_ih"):  # gates lie as input, forget, cell, output
                    parameter[units : 2 * units] = 1.0
                if name.startswith("bias_hh"):
                    parameter.requires_grad_(False)


def kernels_with_l2(model: nn.Module) -> list[nn.Parameter]:
    """Return the kernels that the published network regularises, in order of the layers."""
    marked = (module for module in model.modules() if isinstance(module, RegularisedLinear))
    return [module.get_parameter("weight") for module in marked]


def l2_penalty(model: nn.Module, factor: float = L2) -> Tensor:
    """Return a factor times the sum of squares of the regularised kernels, a scalar.

    It is a term of the loss, as in Keras, so Adam rescales its gradient with the rest;
    decoupled weight decay would not.
    """
    squares = [kernel.square().sum() for kernel in kernels_with_l2(model)]
    return factor * torch.stack(squares).sum() if squares else torch.zeros(())


def set_dropout(
    network: nn.Module, dropout: float | tuple[float, ...] | Literal["light"] | None
) -> None:
    """Set the shares that a network's dropout layers drop; None to leave them.

    ``light`` sets its `light_dropout`, of as many layers, if it has it.

    Raises
    ------
    InputError
        If there is another number of layers.
    """
    layers = [module for module in network.modules() if isinstance(module, nn.Dropout)]
    if dropout == "light":
        light = getattr(network, "light_dropout", ())
        dropout = light if len(light) == len(layers) else None
    if dropout is None:
        return
    shares = dropout if isinstance(dropout, tuple) else (dropout,) * len(layers)
    if len(shares) != len(layers):
        found = f"{len(shares)} shares"
        raise InputError(
            f"dropout: expected one for each of {len(layers)} dropout layers, found {found}"
        )
    for layer, share in zip(layers, shares, strict=True):
        layer.p = share
