"""The paper's networks: their size, shapes, first weights and L2 term."""

import pytest
import torch
from torch import nn

from afferents.errors import InputError
from afferents.models import networks
from afferents.models.classifiers import build
from afferents.models.layers import count_parameters, kernels_with_l2, l2_penalty
from afferents.models.networks import CnnLstm, SpatialNet, VibrationNet

NETWORKS = [
    ("spatial-net", (19, 19), SpatialNet, 261_709, 260_717),
    ("cnn-lstm", (10, 19, 19), CnnLstm, 273_365, 272_373),
    ("vibration-net", (1, 200), VibrationNet, 261_709, 260_685),
    ("vibration-net", (16, 200), VibrationNet, 271_309, 270_285),
]


@pytest.mark.parametrize(("encoding", "shape", "network", "total", "trainable"), NETWORKS)
def test_parameter_counts_are_those_of_the_paper(encoding, shape, network, total, trainable):
    model = build(encoding, 13, shape)
    assert isinstance(model, network)
    assert count_parameters(model) == (total, trainable)


def test_pytorch_adds_120_lstm_biases_that_stay_zero_and_untrained():
    model = CnnLstm(13)
    everything = sum(p.numel() for p in model.parameters())
    assert everything == count_parameters(model).trainable + 120
    frozen = {name: p for name, p in model.named_parameters() if not p.requires_grad}
    assert sorted(frozen) == ["lstm.bias_hh_l0", "lstm.bias_hh_l1", "lstm.bias_hh_l2"]
    assert all((p == 0).all() for p in frozen.values())


@pytest.mark.parametrize(
    ("encoding", "shape"),
    [
        ("spatial-net", (19, 19)),
        ("spatial-net", (8, 8)),
        ("spatial-net", (11, 24)),
        ("cnn-lstm", (10, 19, 19)),
        ("cnn-lstm", (4, 8, 9)),
        ("vibration-net", (1, 200)),
        ("vibration-net", (16, 135)),
        ("vibration-net", (2, 512)),
    ],
)
def test_logits_have_one_value_a_class_whatever_the_size_of_a_sample(encoding, shape):
    model = build(encoding, 5, shape)
    assert model(torch.randn(3, *shape)).shape == (3, 5)


@pytest.mark.parametrize(
    ("encoding", "shape", "found"),
    [
        ("spatial-net", (7, 19), "7 x 19"),
        ("cnn-lstm", (10, 19, 7), "19 x 7"),
        ("vibration-net", (1, 134), "134"),
        ("spatial-net", (10, 19, 19), r"\(10, 19, 19\)"),
        ("vibration-net", (200,), r"\(200,\)"),
    ],
)
def test_samples_that_do_not_fit_are_refused(encoding, shape, found):
    with pytest.raises(InputError, match=f"expected .*found {found}"):
        build(encoding, 13, shape)


def test_one_texture_is_refused():
    with pytest.raises(InputError, match="at least 2 textures"):
        build("spatial-net", 1, (19, 19))


def test_the_published_feature_maps_reach_the_dense_layers():
    image = SpatialNet(13).image(torch.randn(2, 1, 19, 19))
    spectrum = VibrationNet(13).spectrum(torch.randn(2, 1, 1, 200))
    assert image.shape == (2, 3 * 3 * 128)
    assert spectrum.shape == (2, 3 * 128)


def test_dropout_rates_in_order_are_those_of_the_code():
    def rates(model):
        return [m.p for m in model.modules() if isinstance(m, nn.Dropout)]

    assert rates(SpatialNet(13)) == [0.4, 0.4, 0.2]
    assert rates(CnnLstm(13)) == [0.4, 0.2, 0.2]
    assert rates(VibrationNet(13)) == [0.4]


@pytest.mark.parametrize(("encoding", "shape"), [case[:2] for case in NETWORKS])
def test_batch_normalisation_has_keras_defaults(encoding, shape):
    norms = [
        m
        for m in build(encoding, 13, shape).modules()
        if isinstance(m, nn.BatchNorm1d | nn.BatchNorm2d)
    ]
    assert len(norms) == (4 if encoding == "vibration-net" else 6)
    assert all((m.momentum, m.eps) == (0.01, 1e-3) for m in norms)


def test_running_mean_keeps_99_percent_of_the_old_value():
    model = VibrationNet(13).train()
    norm = model.spectrum[3]
    before_norm = model.spectrum[:3](torch.ones(4, 1, 1, 200))
    expected = 0.01 * before_norm.mean(dim=(0, 2, 3))
    model(torch.ones(4, 1, 200))
    torch.testing.assert_close(norm.running_mean, expected)


@pytest.mark.parametrize(
    ("model", "shapes"),
    [
        (SpatialNet(13), [(32, 1152), (16, 32), (13, 16)]),
        (CnnLstm(13), [(32, 10), (16, 32), (13, 16)]),
        (VibrationNet(13), [(32, 384)]),
    ],
)
def test_l2_is_on_the_published_kernels(model, shapes):
    assert [tuple(k.shape) for k in kernels_with_l2(model)] == shapes


def test_l2_penalty_by_hand():
    """VibrationNet marks one kernel, 32 x 384: filled with 0.5 its squares sum to 3072."""
    model = VibrationNet(13)
    (kernel,) = kernels_with_l2(model)
    nn.init.constant_(kernel, 0.5)
    penalty = l2_penalty(model)
    penalty.backward()
    assert penalty.item() == pytest.approx(0.005 * 3072)
    torch.testing.assert_close(kernel.grad, torch.full((32, 384), 2 * 0.005 * 0.5))


def test_l2_penalty_of_a_network_without_marked_kernels_is_zero():
    assert l2_penalty(nn.Linear(2, 2)).item() == 0


def test_lstm_starts_as_in_keras():
    lstm = CnnLstm(13).lstm
    for layer in range(3):
        recurrent = getattr(lstm, f"weight_hh_l{layer}")
        bias = getattr(lstm, f"bias_ih_l{layer}").unflatten(0, (4, 10))
        torch.testing.assert_close(recurrent.T @ recurrent, torch.eye(10))
        assert (bias[1] == 1).all(), "forget gate"
        assert (bias[[0, 2, 3]] == 0).all()
    kernel = lstm.weight_ih_l0
    limit = (6 / (1152 + 40)) ** 0.5
    assert 0.98 * limit < kernel.abs().max() <= limit


def test_kernels_start_glorot_uniform_and_biases_at_zero():
    model = SpatialNet(13)
    convolution = model.image[4]
    limit = (6 / (9 * 64 + 9 * 128)) ** 0.5
    assert 0.98 * limit < convolution.weight.abs().max() <= limit
    assert convolution.weight.std().item() == pytest.approx(limit / 3**0.5, rel=0.02)
    assert all((p == 0).all() for n, p in model.dense.named_parameters() if n == "1.bias")
    assert (convolution.bias == 0).all()


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


def test_pooling_before_relu_is_the_published_order_in_value():
    """To the last bit: both only choose among numbers."""
    x = torch.randn(2, 3, 9, 9)
    pool, relu = nn.MaxPool2d(2), nn.ReLU()
    assert torch.equal(relu(pool(x)), pool(relu(x)))


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
    expected = model.after(of_frames)
    monkeypatch.setattr(networks, "takes_bfloat16", lambda: False)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        found = model.after(of_frames.bfloat16())
        torch.testing.assert_close(model.after(of_frames), expected)
    assert found.dtype == torch.float32
