"""Convolutions in planes are those of PyTorch: maps, gradients, normalisation, training."""

import copy

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import nn

from afferents.models import build, planes
from afferents.models.layers import FlattenChannelsLast, batch_norm_maps
from afferents.models.planes import FEWEST, ImageOrSpectrumStack

EPS = float(np.finfo(np.float32).eps)


def stack(kernel, edge, pool, channels=(4, 6), last_edge=(0, 0)):
    """Two convolutions with all that may stand between them, random biases too."""
    first, second = channels
    layers = ImageOrSpectrumStack(
        nn.Conv2d(1, first, kernel, padding=edge),
        nn.MaxPool2d(pool),
        nn.ReLU(),
        batch_norm_maps(first),
        nn.Conv2d(first, second, kernel, padding=last_edge),
        nn.ReLU(),
        batch_norm_maps(second),
        nn.MaxPool2d(pool),
        batch_norm_maps(second),
        FlattenChannelsLast(),
    )
    for parameter in layers.parameters():
        nn.init.normal_(parameter)
    return layers


def learnt(layers, samples, wanted):
    """Return features, gradients and running statistics after one backward pass."""
    layers.zero_grad()
    features = layers(samples)
    (features * wanted).sum().backward()
    gradients = [parameter.grad for parameter in layers.parameters()]
    return [features.detach(), *gradients, *(b.clone() for b in layers.buffers())]


def size(tensor):
    """Return the root mean square of its numbers."""
    return tensor.detach().double().square().mean().sqrt().item()


KINDS = {
    "image": ((3, 3), (1, 1), (2, 2), (0, 0)),
    "image, same size twice": ((3, 3), (1, 1), (2, 2), (1, 1)),
    "spectrum": ((1, 5), (0, 2), (1, 3), (0, 2)),
    "spectrum, cut": ((1, 5), (0, 2), (1, 3), (0, 0)),
}


@settings(max_examples=20, deadline=None)
@given(
    kind=st.sampled_from(list(KINDS)),
    n=st.integers(FEWEST, 40),
    height=st.integers(11, 24),
    width=st.integers(11, 24),
    seed=st.integers(0, 1000),
)
def test_maps_and_gradients_are_the_plain_ones(kind, n, height, width, seed):
    torch.manual_seed(seed)
    layers = stack(*KINDS[kind][:3], last_edge=KINDS[kind][3])
    shape = (n, 1, height, width) if "image" in kind else (n, 1, 1, 3 * height + width)
    samples = torch.randn(shape)
    plain = copy.deepcopy(layers).double()
    wanted = torch.randn_like(layers(samples))
    layers = copy.deepcopy(plain).float()  # whose running statistics have seen nothing yet
    assert planes._computed_as_planes(samples)
    expected = learnt(plain, samples.double(), wanted.double())
    strongest = max(size(b) for b in expected)
    for a, b in zip(learnt(layers, samples, wanted), expected, strict=True):
        assert a.shape == b.shape
        # What lies nearer to a ReLU's 0, or to another value of a pool, than rounding (1e-4 of the
        # size, see below) may tip over. That is 1e-4 of a gradient's terms, which changes it by
        # the root of that. A bias before a normalisation has no gradient but rounding.
        assert size(a - b) < 1e-2 * size(b) + 1e-3 * strongest
    layers.eval(), plain.eval()
    features = plain(samples.double())
    # The tiles' products cost some 1e-5 of the largest value a convolution, see `planes`.
    assert size(layers(samples) - features) < 1e-4 * size(features)


@pytest.mark.parametrize(
    ("encoding", "shape", "n"),
    [("spatial", (19, 19), 48), ("spatiotemporal", (10, 19, 19), 5), ("spectral", (1, 200), 48)],
)
def test_the_papers_networks_learn_the_same(encoding, shape, n, monkeypatch):
    torch.manual_seed(0)
    samples, texture = torch.randn(n, *shape), torch.arange(n) % 13
    outcomes = []
    for fewest in (FEWEST, 10**9):
        monkeypatch.setattr(planes, "FEWEST", fewest)
        network = build(encoding, 13, shape, seed=1)
        torch.manual_seed(2)
        loss = nn.functional.cross_entropy(network(samples), texture)
        loss.backward()
        outcomes.append((loss.item(), [p.grad for p in network.parameters() if p.requires_grad]))
    (loss, gradients), (plain_loss, plain_gradients) = outcomes
    # To normalise, PyTorch adds up a channel's numbers one after another, in float32 and in the
    # order in which they lie: of n numbers the sum is off by up to n * eps / 2, the standard
    # deviation by half of that, and so the logits, which are about as large as the loss.
    # Fifty images of 9 x 9 places after the first pool have the most numbers.
    rounding = 50 * 9 * 9 * EPS / 4
    assert loss == pytest.approx(plain_loss, rel=rounding)
    strongest = max(float(g.norm()) for g in plain_gradients)
    for gradient, plain in zip(gradients, plain_gradients, strict=True):
        # As above a share `rounding` of the terms may tip over, in each of up to six layers: the
        # root of all is 3e-2.
        assert float((gradient - plain).norm()) < 3e-2 * float(plain.norm()) + 1e-4 * strongest


@pytest.mark.parametrize("kind", ["image", "spectrum"])
def test_in_bfloat16_they_are_no_farther_from_float32_than_plain_layers(kind, monkeypatch):
    torch.manual_seed(0)
    layers = stack(*KINDS[kind][:3], last_edge=KINDS[kind][3])
    samples = torch.randn(64, 1, *((19, 19) if kind == "image" else (1, 200)))
    wanted = torch.randn_like(layers(samples))
    exact = learnt(copy.deepcopy(layers).double(), samples.double(), wanted.double())

    def off():
        with torch.autocast("cpu", dtype=torch.bfloat16):
            found = learnt(copy.deepcopy(layers), samples, wanted)
        return [size(a - b) / size(b) for a, b in zip(found, exact, strict=True)]

    rounded = off()
    monkeypatch.setattr(planes, "FEWEST", 10**9)
    plain = off()
    # Features have been rounded about eight times, by half of bfloat16's eps each: as maps of
    # either convolution and normalisation and in a pool, and as kernels.
    assert rounded[0] < 4 * torch.finfo(torch.bfloat16).eps
    # Biases before a normalisation have no gradient but rounding, in either way.
    assert np.median(rounded) < 1.1 * np.median(plain)


def test_products_of_the_tiles_are_a_convolution():
    """The matrices alone, in one dimension, against NumPy's correlation."""
    rng = np.random.default_rng(0)
    for kernel_size, output in ((3, 9), (3, 7), (5, 66), (5, 3), (1, 4)):
        tiles, step, of_map, of_kernel, of_output = planes._line(kernel_size, output)
        assert tiles * step >= output > (tiles - 1) * step
        line = rng.normal(size=len(of_map))
        taps = rng.normal(size=kernel_size)
        found = of_output.T @ ((of_kernel @ taps) * (of_map @ line))
        # Computed in double, but the matrix of the map holds fractions rounded to float32.
        off = EPS * abs(of_output.T) @ (abs(of_kernel @ taps) * (abs(of_map) @ abs(line)))
        assert (abs(found - np.correlate(line, taps, "valid")) <= off).all()
    assert planes._line(3, 9)[:2] == (3, 3)
    assert planes._line(3, 7)[:2] == (2, 4)


def test_of_equals_in_a_pool_the_first_learns():
    kernel, pool = planes._Pool, (2, 2)
    equal = torch.zeros(4, 4, 3, 2, requires_grad=True)
    kernel.apply(equal, pool).sum().backward()
    assert equal.grad[0::2, 0::2].eq(1).all()
    assert equal.grad.sum() == 4 * 3 * 2


def test_few_samples_other_types_and_their_own_gradients_go_the_plain_way():
    samples = torch.randn(FEWEST, 1, 19, 19)
    assert planes._computed_as_planes(samples)
    assert not planes._computed_as_planes(samples[1:])
    assert not planes._computed_as_planes(samples.double())
    assert not planes._computed_as_planes(samples.expand(-1, 2, -1, -1))
    assert not planes._computed_as_planes(samples.clone().requires_grad_())


def test_what_is_no_number_stays_none():
    """A sample that is NaN shows, and in its own features alone."""
    layers = stack(*KINDS["image"][:3]).eval()
    samples = torch.randn(FEWEST, 1, 12, 12)
    samples[3] = torch.nan
    lost = layers(samples).isnan()
    assert lost[3].all()
    assert lost.sum() == lost[3].sum()
