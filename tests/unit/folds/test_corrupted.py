"""What spoils recordings: as much as is asked for, in every channel, at test or in training."""

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


def test_text_names_and_objects_say_the_same():
    text = Corruption.of("markers=0.1, sound=-20dB,frames=0.05,lost=0.2,seed=3", "--disturb")
    named = {"markers": 0.1, "sound": 0.1, "frames": 0.05, "lost": 0.2, "seed": 3}
    assert text == Corruption.of(named, "") == Corruption(**named)
    assert Corruption.of(str(text), "") == text
    assert text.describe() == named
    assert Corruption.of(None, "") == Corruption()
    assert Corruption.of("markers=0,seed=4", "").describe() == {}, "a seed alone changes nothing"


@pytest.mark.parametrize(
    "given",
    ["markers", "marker=1", "markers=a", "markers=-20dB", "frames=1", "sound=nan", "seed=-1"],
)
def test_what_makes_no_sense_is_refused_in_a_sentence(given):
    with pytest.raises(InputError, match=r"--disturb: expected .*, found "):
        Corruption.of(given, "--disturb")


def test_noise_is_as_strong_as_asked_and_the_same_twice_as_large():
    once, twice = (Corruption(markers=px).noise((200, 50, 2), "3/50") for px in (0.1, 0.2))
    assert once.std() == pytest.approx(0.1, rel=0.02)
    np.testing.assert_allclose(twice, 2 * once)
    assert abs(np.corrcoef(once[1:].ravel(), once[:-1].ravel())[0, 1]) < 0.02
    other = Corruption(markers=0.1).noise((200, 50, 2), "3/60")
    assert abs(np.corrcoef(once.ravel(), other.ravel())[0, 1]) < 0.02
    reseeded = Corruption(markers=0.1, seed=1).noise((200, 50, 2), "3/50")
    assert abs(np.corrcoef(once.ravel(), reseeded.ravel())[0, 1]) < 0.02


def test_neighbours_are_lost_together_and_others_in_the_next_second():
    places = np.stack(np.divmod(np.arange(100), 10), axis=1) * 20.0
    unseen = Corruption(lost=0.1).unseen(np.arange(270) / 90, places, "3/50")
    assert (unseen.sum(axis=1) == 10).all()
    for second in (0, 1, 2):
        spell = unseen[90 * second : 90 * (second + 1)]
        assert (spell == spell[0]).all()
        assert np.ptp(places[spell[0]], axis=0).max() <= 80
    assert len({frame.tobytes() for frame in unseen}) == 3


def test_sound_is_spoilt_by_a_share_of_its_own_level_and_so_many_frames_are_left():
    time_s = np.arange(44100) / 44100
    waves = np.stack([np.sin(2 * np.pi * 80 * time_s), 5 + np.sin(2 * np.pi * 90 * time_s)], 1)
    noise = Corruption.of("sound=-20dB", "").with_noise(waves, "3/50") - waves
    np.testing.assert_allclose(noise.std(axis=0), 0.1 * np.sqrt(0.5), rtol=0.02)
    left = Corruption(frames=0.3).left(5000, "3/50")
    assert len(left) == pytest.approx(3500, rel=0.05)
    assert (np.diff(left) > 0).all()
