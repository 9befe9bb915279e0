"""The networks' convolutions on a CPU, with fewer multiplications and less memory to go through.

A convolution with a small kernel needs two to three times fewer multiplications if tiles of the
map and the kernel are both brought into a form in which it is a product, number by number:
Winograd, "Arithmetic Complexity of Computations" (1980); Lavin & Gray, "Fast Algorithms for
Convolutional Neural Networks" (CVPR 2016). Results differ from the plain convolution's by float32's
rounding, some 1e-5 of the largest value.

Maps are kept as planes, (row, column, sample, channel): what is done to them besides the matrix
products goes through long rows of numbers then.
"""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.autograd.function import once_differentiable

from afferents.models import kernel

FEWEST = 16
"""Samples from which the detour pays."""

_POINTS = (0.0, 1.0, -1.0, 2.0, -2.0, 0.5, -0.5)
"""Where the polynomials of tile and kernel are multiplied, besides infinity: as many as it takes,
in this order, for the rounding grows with their powers."""
_LARGEST = {3: 6, 5: 8}
"""Places of a tile at most, by the kernel's size."""

Pair = tuple[int, int]


class ImageOrSpectrumStack(nn.Sequential):
    """Convolution, pooling and ReLU, then any of convolution and ReLU, normalisation, pooling.

    A plain sequence of layers, and computed as planes where that is faster: batches of samples of
    one channel, on a CPU. In bfloat16, where the processor multiplies it natively, only the first
    layers are, in float32: the other convolutions are one matrix product there. Samples that are
    not finite go the plain way too: the kernels' comparisons would lose what is no number, and a
    training could not stop for it.
    """

    def forward(self, samples: Tensor) -> Tensor:
        """Return the features (n, n_features) of samples (n, channel, row, column)."""
        if not _computed_as_planes(samples):
            plain: Tensor = super().forward(samples)  # type: ignore[no-untyped-call]
            return plain
        layers = iter(self)
        planes = _first(samples, next(layers), next(layers), next(layers))
        if torch.is_autocast_enabled("cpu"):
            return self._go_on(planes, layers)
        for layer in layers:
            planes = _next(planes, layer, layers)
        return planes

    @staticmethod
    def _go_on(planes: Tensor, layers: Iterator[nn.Module]) -> Tensor:
        """Return what the other layers make of the first maps, the plain way in autocast's type."""
        maps = planes.permute(2, 3, 0, 1).to(
            torch.get_autocast_dtype("cpu"), memory_format=torch.channels_last
        )
        for layer in layers:
            maps = layer(maps)
        return maps


def _computed_as_planes(samples: Tensor) -> bool:
    plain = (
        samples.shape[1] > 1
        or samples.requires_grad  # of the samples themselves there is no gradient here
        or samples.device.type != "cpu"
        or samples.dtype != torch.float32
        or torch.compiler.is_compiling()
        or torch.jit.is_tracing()  # type: ignore[attr-defined, no-untyped-call]
    )
    return len(samples) >= FEWEST and not plain and bool(samples.sum().isfinite())


def _first(samples: Tensor, layer: nn.Module, pool: nn.Module, relu: nn.Module) -> Tensor:
    """Return the first layers' maps as planes."""
    if not isinstance(pool, nn.MaxPool2d) or not isinstance(relu, nn.ReLU):
        raise TypeError("a stack begins with a convolution, a pooling and a ReLU")
    arguments = (samples[:, 0], layer.weight, layer.bias, _pair(pool.kernel_size))
    return _apply(_FirstMaps, *arguments)


def _next(planes: Tensor, layer: nn.Module, following: Iterator[nn.Module]) -> Tensor:
    """Return what a layer makes of planes; a convolution takes the ReLU after it along."""
    if isinstance(layer, nn.Conv2d):
        next(following)
        arguments = (planes, layer.weight, layer.bias, _pair(layer.padding))
        return _apply(_ConvolveAndRectify, *arguments)
    if isinstance(layer, nn.MaxPool2d):
        return _apply(_Pool, planes, _pair(layer.kernel_size))
    if isinstance(layer, nn.BatchNorm2d):
        as_one_image = planes.view(1, -1, 1, planes.shape[3]).permute(0, 3, 1, 2)
        normalised: Tensor = layer(as_one_image)
        return normalised.permute(0, 2, 3, 1).view(planes.shape)
    return planes.permute(2, 0, 1, 3).flatten(1)


def _apply(function: type[torch.autograd.Function], *arguments: Any) -> Tensor:
    return cast("Tensor", function.apply(*arguments))  # type: ignore[no-untyped-call]


def _pair(size: Any) -> Pair:
    return (size, size) if isinstance(size, int) else (int(size[0]), int(size[1]))


class _Tiling(NamedTuple):
    """How a convolution is done in tiles."""

    tiles: Pair
    """Down and across."""
    step: Pair
    """From tile to tile, which is what each leaves of the output."""
    of_map: tuple[NDArray[np.float32], NDArray[np.float32]]
    """For rows and for columns: products x places of a tile."""
    of_output: tuple[NDArray[np.float32], NDArray[np.float32]]
    """Products x places that a tile leaves."""
    of_kernel: Tensor
    """Products x places of the kernel, both in two dimensions."""


@lru_cache
def _tiling(kernel_size: Pair, output: Pair) -> _Tiling:
    """Choose the tiles that need the fewest multiplications."""
    lines = [_line(size, length) for size, length in zip(kernel_size, output, strict=True)]
    (down, step_down, map_down, kernel_down, output_down) = lines[0]
    (across, step_across, map_across, kernel_across, output_across) = lines[1]
    of_kernel = torch.from_numpy(np.kron(kernel_down, kernel_across))
    return _Tiling(
        (down, across),
        (step_down, step_across),
        (map_down, map_across),
        (output_down, output_across),
        of_kernel,
    )


def _line(kernel_size: int, output: int) -> tuple[int, int, Any, Any, Any]:
    """Return tiles, step and the three matrices of a convolution along one line."""
    steps = range(1, _LARGEST.get(kernel_size, kernel_size) - kernel_size + 2)
    step = min(steps, key=lambda m: (m + kernel_size - 1) * -(-output // m))
    n = step + kernel_size - 1
    at_points = np.vander(_POINTS[: n - 1], n, increasing=True).reshape(n - 1, n)

    def values(n_coefficients: int) -> NDArray[np.float64]:
        """Of a polynomial at the points; at infinity its last coefficient."""
        at_infinity = np.eye(n_coefficients)[-1:]
        return np.concatenate([at_points[:, :n_coefficients], at_infinity])

    matrices = (np.linalg.inv(values(n)).T, values(kernel_size), values(step))
    of_map, of_kernel, of_output = (np.ascontiguousarray(m, np.float32) for m in matrices)
    return -(-output // step), step, of_map, of_kernel, of_output


class _ConvolveAndRectify(torch.autograd.Function):
    """ReLU of the convolution of planes (row, column, sample, channel)."""

    @staticmethod
    def forward(ctx: Any, planes: Tensor, weight: Tensor, bias: Tensor, edge: Pair) -> Tensor:
        n, n_out = planes.shape[2], len(weight)
        height, width = (
            side + 2 * e - k + 1
            for side, e, k in zip(planes.shape[:2], edge, weight.shape[2:], strict=True)
        )
        tiling = _tiling(_pair(weight.shape[2:]), (height, width))
        tiles = _to_tiles(planes, tiling.of_map, tiling.step, edge, tiling.tiles)
        kernels = tiling.of_kernel @ weight.permute(2, 3, 1, 0).flatten(2).flatten(0, 1)
        kernels = kernels.view(len(tiling.of_kernel), -1, n_out)
        products = torch.bmm(tiles, kernels)
        rectified = _from_tiles(
            products, tiling.of_output, tiling, (0, 0), (height, width, n, n_out)
        )
        rectified.view(-1, n_out).add_(bias).clamp_(min=0)
        ctx.save_for_backward(tiles, kernels, rectified)
        ctx.rest = (tiling, edge, planes.shape, weight.shape)
        return rectified

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, change: Tensor) -> Any:
        tiles, kernels, rectified = ctx.saved_tensors
        tiling, edge, planes, weight = ctx.rest
        change = torch.ops.aten.threshold_backward(change.contiguous(), rectified, 0)
        products = _to_tiles(change, tiling.of_output, tiling.step, (0, 0), tiling.tiles)
        of_kernels = torch.bmm(tiles.transpose(1, 2), products).flatten(1)
        of_weight = (tiling.of_kernel.T @ of_kernels).view(*weight[2:], weight[1], weight[0])
        of_planes = None
        if ctx.needs_input_grad[0]:
            of_tiles = torch.bmm(products, kernels.transpose(1, 2))
            of_planes = _from_tiles(of_tiles, tiling.of_map, tiling, edge, planes)
        return of_planes, of_weight.permute(3, 2, 0, 1), change.flatten(0, 2).sum(0), None


def _to_tiles(planes: Tensor, matrices: Any, step: Pair, edge: Pair, tiles: Pair) -> Tensor:
    """Return (product, tile and sample, channel) of planes (row, column, sample, channel)."""
    height, width, n, n_channels = planes.shape
    p, q = (len(matrix) for matrix in matrices)
    found = torch.empty(p * q, tiles[0] * tiles[1] * n, n_channels)
    arguments = ((height, width, n * n_channels), *matrices, step, edge, _flat(found), tiles)
    kernel.to_tiles(_flat(planes), *arguments)
    return found


def _from_tiles(
    tiles: Tensor, matrices: Any, tiling: _Tiling, edge: Pair, planes: tuple[int, ...]
) -> Tensor:
    """Return what the transpose of `_to_tiles` makes of tiles, of the shape `planes`."""
    found, shape = torch.empty(planes), (planes[0], planes[1], planes[2] * planes[3])
    arguments = (tiling.tiles, *matrices, tiling.step, edge, _flat(found), shape)
    kernel.from_tiles(_flat(tiles), *arguments)
    return found


class _FirstMaps(torch.autograd.Function):
    """Convolution of images (n, row, column) with their own size, pooled, after ReLU, as planes."""

    @staticmethod
    def forward(ctx: Any, images: Tensor, weight: Tensor, bias: Tensor, pool: Pair) -> Tensor:
        n, height, width = images.shape
        n_channels = len(weight)
        shape = (height // pool[0], width // pool[1], n, n_channels)
        maps, which = torch.empty(shape), torch.empty(shape, dtype=torch.uint8)
        kernels = weight.detach()[:, 0].flatten(1).T.contiguous()
        images = images.contiguous()
        first_maps, _ = kernel.first_layer(_pair(weight.shape[2:]), pool)
        arrays = (images, kernels, bias.detach(), maps.view(-1, n_channels))
        first_maps(*(a.numpy() for a in arrays), which.view(-1, n_channels).numpy())
        ctx.save_for_backward(images, which.view(-1, n_channels))
        ctx.rest = (pool, weight.shape)
        return maps

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, change: Tensor) -> Any:
        (images, which), (pool, weight) = ctx.saved_tensors, ctx.rest
        change = change.contiguous().view(which.shape)
        of_kernels = torch.zeros(weight[2] * weight[3] + 1, weight[0])
        _, gradient = kernel.first_layer(_pair(weight[2:]), pool)
        gradient(*(a.numpy() for a in (images, change, which, of_kernels)))
        return None, of_kernels[:-1].T.reshape(weight), of_kernels[-1], None


class _Pool(torch.autograd.Function):
    """The largest of every pool of planes; of equals the first, as PyTorch has it."""

    @staticmethod
    def forward(ctx: Any, planes: Tensor, pool: Pair) -> Tensor:
        height, width, n, n_channels = planes.shape
        shape = (height // pool[0], width // pool[1], n, n_channels)
        pooled, which = torch.empty(shape), torch.empty(shape, dtype=torch.uint8)
        sizes = (height, width, n * n_channels)
        kernel.pool_planes(_flat(planes), sizes, pool, _flat(pooled), _flat(which))
        ctx.save_for_backward(which)
        ctx.rest = (pool, planes.shape)
        return pooled

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, change: Tensor) -> Any:
        (which,), (pool, shape) = ctx.saved_tensors, ctx.rest
        of_planes, sizes = torch.zeros(shape), (shape[0], shape[1], shape[2] * shape[3])
        kernel.unpool_planes(
            _flat(change.contiguous()), _flat(which), pool, _flat(of_planes), sizes
        )
        return of_planes, None


def _flat(tensor: Tensor) -> NDArray[Any]:
    """Return the numbers of a tensor as they lie in memory, without a copy."""
    return tensor.detach().view(-1).numpy()
