"""The paper's networks: their size, shapes, first weights and L2 term."""

import pytest
import torch
from torch import nn

from afferents.errors import InputError
from afferents.models import hardware
from afferents.models.classifiers import build
from afferents.models.layers import kernels_with_l2, l2_penalty
from afferents.models.networks import CnnLstm, SpatialNet, VibrationNet, last_state

NETWORKS = [
    ("spatial-net", (19, 19), SpatialNet, 261_709, 260_717),
    ("cnn-lstm", (10, 19, 19), CnnLstm, 273_365, 272_373),
    ("vibration-net", (1, 200), VibrationNet, 261_709, 260_685),
    ("vibration-net", (16, 200), VibrationNet, 271_309, 270_285),
]


def count_parameters(network):
    """Return how many Keras would count, with what batch normalisation keeps; and the trainable.

    The second bias of LSTMs is frozen and not counted: Keras has none.
    """
    trainable = sum(p.numel() for p in network.parameters() if p.requires_grad)
    kept = sum(b.numel() for b in network.buffers() if b.is_floating_point())
    return trainable + kept, trainable


@pytest.mark.parametrize(("encoding", "shape", "network", "total", "trainable"), NETWORKS)
def test_parameter_counts_are_those_of_the_paper(encoding, shape, network, total, trainable):
    model = build(encoding, 13, shape)
    assert isinstance(model, network)
    assert count_parameters(model) == (total, trainable)
    assert model.training


@pytest.mark.parametrize(
    ("encoding", "shape"),
    [
        ("spatial-net", (8, 8)),
        ("spatial-net", (11, 24)),
        ("cnn-lstm", (4, 8, 9)),
        ("vibration-net", (16, 135)),
        ("vibration-net", (2, 512)),
    ],
)
def test_logits_have_one_value_a_class_whatever_the_size_of_a_sample(encoding, shape):
    assert build(encoding, 5, shape)(torch.randn(3, *shape)).shape == (3, 5)


@pytest.mark.parametrize(
    ("encoding", "n_classes", "shape", "found"),
    [
        ("spatial-net", 13, (7, 19), "7 x 19"),
        ("cnn-lstm", 13, (10, 19, 7), "19 x 7"),
        ("vibration-net", 13, (1, 134), "134"),
        ("spatial-net", 13, (10, 19, 19), r"\(10, 19, 19\)"),
        ("vibration-net", 13, (200,), r"\(200,\)"),
        ("spatial-net", 1, (19, 19), ""),
    ],
)
def test_samples_that_do_not_fit_are_refused(encoding, n_classes, shape, found):
    with pytest.raises(InputError, match=f"expected .*found {found}"):
        build(encoding, n_classes, shape)


def test_l2_penalty_by_hand():
    """VibrationNet marks one kernel, 32 x 384: filled with 0.5 its squares sum to 3072."""
    model = VibrationNet(13)
    (kernel,) = kernels_with_l2(model)
    nn.init.constant_(kernel, 0.5)
    penalty = l2_penalty(model)
    penalty.backward()
    assert penalty.item() == pytest.approx(0.005 * 3072)
    torch.testing.assert_close(kernel.grad, torch.full((32, 384), 2 * 0.005 * 0.5))


def test_weights_start_as_in_keras():
    lstm = CnnLstm(13).lstm
    for layer in range(3):
        recurrent = getattr(lstm, f"weight_hh_l{layer}")
        bias = getattr(lstm, f"bias_ih_l{layer}").unflatten(0, (4, 10))
        torch.testing.assert_close(recurrent.T @ recurrent, torch.eye(10))
        assert (bias[1] == 1).all(), "forget gate"
        assert (bias[[0, 2, 3]] == 0).all()
    convolution = SpatialNet(13).image[4]
    for kernel, limit in (
        (lstm.weight_ih_l0, (6 / (1152 + 40)) ** 0.5),
        (convolution.weight, (6 / (9 * 64 + 9 * 128)) ** 0.5),
    ):
        assert 0.98 * limit < kernel.abs().max() <= limit
    assert (convolution.bias == 0).all()


@pytest.mark.parametrize(
    ("model", "rates", "with_l2"),
    [
        (SpatialNet(13), [0.4, 0.4, 0.2], [(32, 1152), (16, 32), (13, 16)]),
        (CnnLstm(13), [0.4, 0.2, 0.2], [(32, 10), (16, 32), (13, 16)]),
        (VibrationNet(13), [0.4], [(32, 384)]),
    ],
)
def test_dropout_and_l2_are_where_the_code_has_them(model, rates, with_l2):
    assert [m.p for m in model.modules() if isinstance(m, nn.Dropout)] == rates
    assert [tuple(k.shape) for k in kernels_with_l2(model)] == with_l2


def test_the_seed_fixes_the_weights_and_leaves_the_callers_random_state():
    torch.manual_seed(3)
    first = build("vibration-net", 13, (1, 200), seed=7).state_dict()
    drawn = torch.rand(2)
    torch.manual_seed(3)
    assert torch.equal(torch.rand(2), drawn)
    again = build("vibration-net", 13, (1, 200), seed=7).state_dict()
    other = build("vibration-net", 13, (1, 200), seed=8).state_dict()
    assert all(torch.equal(first[name], again[name]) for name in first)
    assert not torch.equal(first["spectrum.0.weight"], other["spectrum.0.weight"])


def test_frames_of_a_run_share_one_network_and_their_order_matters():
    model = CnnLstm(13).eval()
    run = torch.randn(1, 10, 19, 19)
    with torch.no_grad():
        one, same = model(run.repeat(2, 1, 1, 1))
        backwards = model(run.flip(1))[0]
    # A kernel may take the rows of a batch in different ways, so that they agree but for rounding.
    # A sum of n products is off by at most n * eps of its size; the longest here has 1152.
    rounding = 1152 * torch.finfo(torch.float32).eps * float(one.abs().max())
    torch.testing.assert_close(same, one, rtol=0, atol=rounding)
    assert float((backwards - one).abs().max()) > rounding


def test_where_no_lstm_is_in_bfloat16_it_is_in_float32(monkeypatch):
    model, of_frames = CnnLstm(13).eval(), torch.randn(3, 10, 1152)
    expected = last_state(model.lstm, of_frames)
    monkeypatch.setattr(hardware, "takes_bfloat16", lambda: False)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        found = last_state(model.lstm, of_frames.bfloat16())
        torch.testing.assert_close(last_state(model.lstm, of_frames), expected)
    assert found.dtype == torch.float32
