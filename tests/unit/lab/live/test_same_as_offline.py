"""What runs live is what was evaluated: inputs bit by bit, and outputs to 1e-5.

Inputs are the same functions of the same numbers, one frame or window at a time or all at once.
Images are made by one compiled kernel, by copying, and by differences, products and roots, which
are rounded alike on any processor; the transform of a window takes the same steps alone and beside
others, as SciPy has no kernels for some processors only. Networks are computed by ONNX Runtime here
and by PyTorch there, which add up in different orders: n roundings at random come to some
sqrt(n) * eps of what is added up, 4e-6 for the 1152 products of the longest sums.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
import xarray as xr
from hypothesis import given, settings, strategies as st

import afferents
from afferents import dims
from afferents.channels import CHANNELS
from afferents.encodings.images import component_images
from afferents.encodings.settings import Encodings
from afferents.encodings.spectra import SpectralEncoding, spectral_samples
from afferents.evaluation.data import encode, find_sources
from afferents.extraction.extract import responses_of
from afferents.filling import fill
from afferents.lab.live import (
    Pace,
    ReplayedSound,
    ReplayedVideo,
    Sound,
    stream,
)
from afferents.lab.live.follower import Follower
from afferents.lab.live.touch import Filled, Filling
from afferents.markers.sensor import load_sensor
from afferents.models.folder import load_model
from afferents.models.model import MODELS
from afferents.recordings.audio import WavFile
from afferents.recordings.data_sets import read_session
from afferents.recordings.video import open_video
from afferents.store.zarr_store import open_responses

from .conftest import pipeline_of


def live_images(video, sensor):
    """All images by name and frame number."""
    follower = Follower(sensor, video.fps_hz)
    channels = [c for c in CHANNELS.values() if c.made_of != dims.RA2 and c.runs_live]
    names = [channel.name for channel in channels if not channel.parts]
    filling, seen = Filling(), {}
    for event in ReplayedVideo(video, Pace(math.inf)).events():
        for picture, touch in follower.feed(event):
            i = round(picture.time_s * video.fps_hz)
            seen[i] = Filled(touch, filling.feed(touch, channels))
    return {n: {i: f.image(n) for i, f in seen.items() if n in f.markers} for n in names}


@pytest.mark.parametrize("losing", [False, True])
def test_images_are_those_of_the_store(session, make_video, tmp_path, losing, rng):
    """Also where markers are lost now and then."""
    sensor = load_sensor("tip_b")
    recording = read_session(session).recordings[4]
    if losing:
        shift = 3 * np.sin(np.arange(60) / 4) * (np.arange(60) > 12)
        covered = [rng.choice(361, 12) if i > 14 else [] for i in range(60)]
        video = open_video(make_video(tmp_path / "lost.mp4", shift, covered))
        recording = replace(recording, video=video, audio=None)
    responses = responses_of(recording, sensor)
    assert bool(responses[dims.SA1][sensor.rest_frame :].isnull().any()) == losing
    of_doubles = {dims.SA1_LOCAL}  # offline it is of stored float32
    offline_by_name = {}
    for name in (dims.SA1, dims.RA1, dims.SA1_VECTOR, dims.RA1_VECTOR, *of_doubles):
        stored = name in responses
        response = responses[name] if stored else CHANNELS[name].response(responses)
        offline_by_name[name] = np.squeeze(component_images(fill(response)))
    for name, live in live_images(recording.video, sensor).items():
        offline = offline_by_name[name]
        assert set(live) == set(range(min(live), len(offline)))
        for i, image in live.items():
            close = 1e-5 if name in of_doubles else 0
            np.testing.assert_allclose(image, offline[i], rtol=0, atol=close)


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(900, 4000),
    sizes=st.lists(st.integers(1, 1500), min_size=1, max_size=8),
    window=st.sampled_from([600, 601, 750]),
    stride=st.integers(1, 900),
    points=st.sampled_from([None, 1024]),
    n_channels=st.integers(1, 3),
    remove_mean=st.booleans(),
)
def test_spectra_are_those_of_the_encoding_for_any_chunks(
    n, sizes, window, stride, points, n_channels, remove_mean
):
    rate = 1000.0
    signal = np.random.default_rng(n).normal(size=(n, n_channels)).astype(np.float32)
    encoding = SpectralEncoding(
        window_s=window / rate, stride_s=stride / rate, fft_points=points, remove_mean=remove_mean
    )
    labels = {dims.TEXTURE: "a", dims.SPEED: 1.0, "name": "a/1", dims.SAMPLE_RATE: rate}
    vibration = xr.DataArray(signal, dims=(dims.AUDIO_TIME, dims.CHANNEL), attrs=labels)
    offline = spectral_samples(vibration, slice(0, n), encoding)
    spectra = encoding.stream(rate, n_channels)
    found, done, turn = [], 0, 0
    while done < n:
        size = sizes[turn % len(sizes)]
        found += spectra.feed(done / rate, signal[done : done + size])
        done, turn = done + size, turn + 1
    live = np.array([spectrum.values for spectrum in found])
    np.testing.assert_array_equal(live, offline.values[..., : encoding.model_bins])
    ends = [spectrum.end_s for spectrum in found]
    np.testing.assert_allclose(ends, offline[dims.STOP].values, atol=1e-9)


def stored(store, recording):
    return next(r for r in open_responses(store) if r.attrs["name"] == recording.name)


def runs_live(predictions, model):
    """Probabilities and novelty by time in ms, of one model."""
    return {
        round(1000 * p.time_s): np.array([*p.probabilities.values(), p.novelty])
        for p in predictions
        if p.model == model and p.probabilities
    }


@torch.no_grad()
def felt_offline(path, responses, model, cut_s):
    """By the end of each sample, from the model's folder and PyTorch."""
    _, deployed = load_model(path.with_suffix(""))
    kept = responses.assign_attrs(steady_s=f"[{cut_s}, 1000]")
    source = find_sources(model, Encodings())[0]
    samples = encode(kept, source, "all")
    values = source.encoding.seen(samples.values)
    found = torch.column_stack(deployed(torch.from_numpy(np.ascontiguousarray(values)))).numpy()
    stop_ms = np.round(1000 * samples[dims.STOP].values).astype(int)
    return dict(zip(stop_ms.tolist(), found, strict=True))


@pytest.mark.parametrize("name", ["sa-se", "ra-ste", "sa-wave", "ra-wave-vector"])
def test_percepts_of_a_video_are_the_offline_ones(session, stores, models, name):
    recording = read_session(session).recordings[5]
    source = ReplayedVideo(recording.video, Pace(math.inf))
    live = runs_live(afferents.lab.live.stream([source], models[name]), name)
    offline = felt_offline(models[name], stored(stores["video"], recording), MODELS[name], cut_s=0)
    if name in ("sa-se", "sa-wave"):
        del offline[min(offline)]  # it holds the rest frame, where nothing touches the skin
    assert set(offline) <= set(live)
    assert len(offline) == {"sa-se": 34, "sa-wave": 2}.get(name, 3)
    require_alike(live, offline)


def test_percepts_of_sound_are_the_offline_ones(sounds, stores, models):
    name, recording = "vib-te-aug", read_session(sounds).recordings[7]
    source = ReplayedSound(WavFile(recording.audio.path), Pace(math.inf))
    live = runs_live(stream([source], [models[name]]), name)
    offline = felt_offline(models[name], stored(stores["audio"], recording), MODELS[name], cut_s=0)
    assert set(offline) == set(live)
    assert len(offline) == 5
    require_alike(live, offline)


def require_alike(live, offline):
    for stop, expected in offline.items():
        np.testing.assert_allclose(live[stop], expected, rtol=1e-5, atol=1e-5)


@settings(max_examples=15, deadline=None)
@given(sizes=st.lists(st.integers(1, 9000), min_size=1, max_size=6))
def test_percepts_do_not_depend_on_the_chunks(sounds, models, sizes):
    audio = read_session(sounds).recordings[3].audio
    signal = audio.read().values

    def felt(sizes):
        pipeline = pipeline_of(models, "vib-te-aug")
        done, turn, predictions = 0, 0, []
        while done < len(signal):
            part = signal[done : done + sizes[turn % len(sizes)]]
            predictions += pipeline.feed(Sound(done / audio.sample_rate_hz, part, 0.0))
            done, turn = done + len(part), turn + 1
        return predictions

    whole, chunked = felt([len(signal)]), felt(sizes)
    assert len(whole) == len(chunked) == 5
    for a, b in zip(whole, chunked, strict=True):
        assert (a.time_s, a.texture) == (pytest.approx(b.time_s), b.texture)
        assert a.probabilities == b.probabilities
        assert a.evidence == pytest.approx(b.evidence)
