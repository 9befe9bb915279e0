"""What a network is made of, read off it: the published tables, and sums that must agree."""

import pytest

from afferents.models.classifiers import build
from afferents.models.layers import count_parameters
from afferents.models.shapes import layer_shapes, written_shape


@pytest.mark.parametrize(
    ("classifier", "shape", "total"),
    [
        ("spatial-net", (19, 19), 261_709),
        ("cnn-lstm", (10, 19, 19), 273_365),
        ("vibration-net", (1, 200), 261_709),
        ("vibration-net", (16, 200), 271_309),
    ],
)
def test_parameters_of_the_layers_are_those_of_the_network(classifier, shape, total):
    network = build(classifier, 13, shape)
    layers = layer_shapes(network, shape)
    assert sum(layer.n_parameters for layer in layers) == count_parameters(network).total == total
    assert network.training
    assert not any(module._forward_hooks for module in network.modules())


def test_layers_of_the_spatial_network():
    layers = layer_shapes(build("spatial-net", 13, (19, 19)), (19, 19))
    found = {(layer.title, layer.shape, layer.n_parameters) for layer in layers}
    assert ("Conv 64, 3 x 3, same", "19 x 19 x 64", 640) in found
    assert ("Conv 128, 3 x 3, valid", "7 x 7 x 128", 147_584) in found
    assert ("Flatten", "1152", 0) in found
    assert layers[-1][:2] == ("Dense 13, L2", "13")


def test_layers_that_frames_share_and_lstms():
    layers = layer_shapes(build("cnn-lstm", 5, (10, 19, 19)), (10, 19, 19))
    assert layers[0].shape == "10 of 19 x 19 x 64"
    lstms = [layer for layer in layers if layer.title.startswith("LSTM")]
    assert [(one.title, one.shape, one.n_parameters) for one in lstms] == [
        ("LSTM 10, sequence", "10 x 10", 46_520),
        ("LSTM 10, sequence", "10 x 10", 840),
        ("LSTM 10, last state", "10", 840),
    ]


def test_a_height_of_one_is_not_written():
    assert written_shape((128, 1, 66)) == "66 x 128"
    assert written_shape((64, 9, 8)) == "9 x 8 x 64"
    assert written_shape((1152,)) == "1152"
