"""Corrupted recordings: every channel of them, and evaluations that test or learn from them."""

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import afferents
from afferents import dims
from afferents.channels import CHANNELS, ra1, sa1
from afferents.encodings.samples import make_samples
from afferents.errors import InputError
from afferents.folds.corruption import Corruption, corrupted
from afferents.folds.splits import join_variants
from afferents.models.fusion import mean_within
from afferents.store.integrity import sealed

N_FRAMES, N_MARKERS, REST = 400, 60, 10


@pytest.fixture
def recording():
    """Markers that stand still 20 px from rest, after ten frames at rest; and a tone."""
    rest = np.random.default_rng(0).uniform(100, 500, (N_MARKERS, 2)).astype(np.float32)
    position = np.repeat(rest[None], N_FRAMES, axis=0)
    position[REST + 1 :, :, 0] += 20
    of_markers = {
        dims.POSITION: ((dims.TIME, dims.MARKER, dims.SPACE), position),
        dims.DETECTED: ((dims.TIME, dims.MARKER), np.ones((N_FRAMES, N_MARKERS), bool)),
        dims.REST_POSITION: ((dims.MARKER, dims.SPACE), rest),
    }
    time = {dims.TIME: np.arange(N_FRAMES) / 90}
    labels = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0, "rest_frame": REST}
    found = xr.Dataset(of_markers, time, labels)
    slow = sa1(found[dims.POSITION], found[dims.REST_POSITION])
    tone = np.sin(np.arange(44100) / 50).astype(np.float32)[:, None]
    vibration = xr.DataArray(
        tone, dims=(dims.AUDIO_TIME, dims.CHANNEL), attrs={dims.SAMPLE_RATE: 44100.0}
    )
    return sealed(found.assign({dims.SA1: slow, dims.RA1: ra1(slow), dims.RA2: vibration}))


def test_noise_of_positions_reaches_every_channel(recording):
    noisy = corrupted(recording, False, Corruption(markers=0.1))
    after = slice(REST + 2, None)
    clean = {name: c.response(recording)[after] for name, c in CHANNELS.items() if name != "ra2"}
    error = {
        name: (CHANNELS[name].response(noisy)[after] - of).values for name, of in clean.items()
    }
    at_rest = error["sa1_vector"].mean(axis=0)  # the rest frame's own noise stays
    assert at_rest.std() == pytest.approx(0.1, rel=0.3)
    assert (error["sa1_vector"] - at_rest).std() == pytest.approx(0.1, rel=0.03)
    difference = 0.1 * np.sqrt(2)
    assert error["ra1_vector"].std() == pytest.approx(difference, rel=0.03)
    # RA-I is the size of that: the mean of a half-normal
    assert error["ra1"].mean() == pytest.approx(difference * np.sqrt(2 / np.pi), rel=0.03)
    xr.testing.assert_equal(noisy[dims.RA2], recording[dims.RA2])
    assert float(abs(CHANNELS["sa1"].response(noisy)[REST]).max()) < 1e-3, "at rest it is at rest"


def test_a_gap_in_the_frames_is_a_longer_step(recording):
    moving = recording[dims.POSITION].values.copy()
    moving[REST + 1 :] += np.arange(N_FRAMES - REST - 1)[:, None, None]
    attrs = {k: v for k, v in recording[dims.POSITION].attrs.items() if k != "sha256"}
    found = recording.assign({dims.POSITION: (recording[dims.POSITION].dims, moving, attrs)})
    gaps = corrupted(found, False, Corruption(frames=0.2))
    assert gaps.sizes[dims.TIME] == pytest.approx(0.8 * N_FRAMES, rel=0.1)
    np.testing.assert_array_equal(gaps[dims.TIME][: REST + 1], found[dims.TIME][: REST + 1])
    step = CHANNELS["ra1_vector"].response(gaps)[REST + 2 :]
    frames = np.diff(gaps[dims.TIME].values)[REST + 1 :] * 90
    np.testing.assert_allclose(step[:, 0, 1], frames, atol=1e-3)
    assert gaps[dims.RA1].sizes == gaps[dims.SA1].sizes == gaps[dims.DETECTED].sizes


def test_lost_markers_are_nan_and_not_detected(recording):
    dark = corrupted(recording, False, Corruption(lost=0.25))
    assert dark[dims.DETECTED][: REST + 1].all()
    assert float(dark[dims.DETECTED][REST + 1 :].mean()) == pytest.approx(0.75)
    np.testing.assert_array_equal(np.isnan(dark[dims.SA1]), ~dark[dims.DETECTED])


def test_vibration_is_corrupted_alone(recording):
    loud = corrupted(recording, True, Corruption(markers=1, sound=0.5))
    noise = (loud[dims.RA2] - recording[dims.RA2]).values
    assert noise.std() == pytest.approx(0.5 * np.sqrt(0.5), rel=0.02)
    xr.testing.assert_equal(loud[dims.POSITION], recording[dims.POSITION])
    assert corrupted(recording, True, Corruption(markers=1)) is recording
    with pytest.raises(InputError, match="expected recordings with the positions of markers"):
        corrupted(recording[[dims.RA2]], False, Corruption(markers=1))


def test_windows_are_paired_within_their_variant():
    attrs = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0}
    ends = np.arange(1, 5.0)
    window, frames = (
        make_samples(np.zeros((n, 1)), ("value",), ends[:n] - 1, ends[:n], attrs) for n in (2, 4)
    )
    lead, other = (join_variants(one, one) for one in (window, frames))
    values = np.arange(8.0)[:, None]
    found = mean_within(lead, np.arange(4), other, np.arange(8), values)
    assert found.ravel().tolist() == [0, 1, 4, 5]


OPTIONS = {"frames": 5, "window_s": 0.25, "stride_s": 0.05, "workers": 1, "quiet": True}


def test_corrupted_at_test_only_learns_the_same_and_says_so(stores, tmp_path):
    models = ["ra-wave-vector", "fusion"]
    clean = afferents.evaluate(stores["video"], tmp_path / "clean", models, **OPTIONS)
    noisy = afferents.evaluate(
        stores["video"], tmp_path / "noisy", models, **OPTIONS,
        disturb={"markers": 3, "sound": "20dB"},
    )  # fmt: skip
    for path in sorted((tmp_path / "clean").glob("folds/*/*/*/*/weights.safetensors")):
        same = tmp_path / "noisy" / path.relative_to(tmp_path / "clean")
        assert same.read_bytes() == path.read_bytes(), "learnt from the same"
    where = ["model", "recording", "start_s", "true_texture"]
    pd.testing.assert_frame_equal(noisy.predictions[where], clean.predictions[where])
    for model in models:
        tables = (r.predictions[r.predictions["model"] == model] for r in (clean, noisy))
        p = [table.filter(like="p_").values for table in tables]
        assert np.abs(p[0] - p[1]).max() > 0.01, model
    assert noisy.summary["disturb"] == noisy.config["disturb"] == {"markers": 3.0, "sound": 10.0}
    assert noisy.summary["options"]["disturb"] == {"markers": 3, "sound": 10}
    assert "disturb" not in clean.config


def test_learning_from_what_is_corrupted_is_another_switch(stores, tmp_path, run):
    code, out, err = run(
        "evaluate", stores["video"], "--out", tmp_path / "r", "--models", "ra-wave-vector",
        "--frames", 5, "--workers", 1, "--held-out", 40, "--json",
        "--disturb", "frames=0.2,lost=0.1", "--disturb-training", "markers=0.05",
    )  # fmt: skip
    assert code == 0, err
    summary = json.loads(out)
    assert summary["disturb"] == {"frames": 0.2, "lost": 0.1}
    assert summary["disturb_training"] == {"markers": 0.05}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--disturb", "sound=0.1"), "--disturb sound=0.1: expected models that it is for"),
        (("--disturb-training", "sound=1"), "--disturb-training sound=1: expected models"),
    ],
)
def test_corruptions_that_do_nothing_are_refused(options, said, stores, tmp_path, fails):
    asked = ("--out", tmp_path / "r", "--models", "ra-wave-vector", "--frames", 5)
    assert said in fails("evaluate", stores["video"], *asked, *options)
    assert not (tmp_path / "r").exists()
