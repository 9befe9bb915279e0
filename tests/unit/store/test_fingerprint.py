"""Copies of recordings are found whatever was done to them; different runs are not."""

import io
import json

import numpy as np
import pytest
import scipy.signal
import soundfile
import xarray as xr

from afferents.store.fingerprint import find_copies, fingerprint, read, written

RATE, FPS, SECONDS = 8000, 90.0, 8.0


def sounding(samples, rate=RATE, **attrs):
    signal = (("audio_time", "channel"), samples if samples.ndim > 1 else samples[:, None])
    return xr.Dataset({"ra2": (*signal, {"sample_rate_hz": float(rate)})}, attrs=attrs)


def moving(position, time_s=None):
    time_s = np.arange(len(position)) / FPS if time_s is None else time_s
    return xr.Dataset({"position": (("time", "marker", "space"), position)}, {"time": time_s})


def sound_of(seed, tone_hz=30.0):
    """A texture's line, whose strength drifts, in the noise of a run."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(SECONDS * RATE)) / RATE
    drift = np.interp(time_s, np.arange(0, SECONDS + 0.2, 0.1), rng.uniform(0.3, 1, 82))
    noise = scipy.signal.sosfilt(
        scipy.signal.butter(2, (5, 150), "bandpass", fs=RATE, output="sos"),
        rng.normal(0, 0.3, len(time_s)),
    )
    return 0.1 * drift * np.sin(2 * np.pi * tone_hz * time_s + rng.uniform(0, 6)) + noise * 0.3


def steps_of(seed, tone_hz=11.0):
    """Markers that shake together by a texture, and by what is of this run alone."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(SECONDS * FPS)) / FPS
    common = np.sin(2 * np.pi * tone_hz * time_s + rng.uniform(0, 6))[:, None] * [1.0, 0.3]
    own = np.cumsum(rng.normal(0, 0.3, (len(time_s), 2)), axis=0)
    return (common + own)[:, None] + rng.normal(0, 0.05, (len(time_s), 50, 2))


def encoded(samples, subtype, form="WAV"):
    file = io.BytesIO()
    soundfile.write(file, samples, RATE, subtype=subtype, format=form)
    file.seek(0)
    return soundfile.read(file)[0]


def found(one, other, same_label=False):
    """Read both back from what would be stored."""
    responses = {"one": one, "other": other}
    both = {n: read(json.loads(json.dumps(written(fingerprint(r))))) for n, r in responses.items()}
    return find_copies(both, {"one": "x", "other": "x" if same_label else "y"})


@pytest.mark.parametrize(
    ("seen", "change"),
    [
        (sounding, lambda x, rng: encoded(x, "PCM_U8")),
        (sounding, lambda x, rng: encoded(x, "VORBIS", "OGG")),
        (sounding, lambda x, rng: 0.1 * x),
        (moving, lambda p, rng: p + rng.normal(0, 0.3, p.shape)),
        (moving, lambda p, rng: np.where(rng.random(p.shape[:2])[..., None] < 0.2, np.nan, p)),
    ],
    ids=["8 bit", "ogg", "gain", "codec noise", "markers lost"],
)
def test_a_copy_is_found_whatever_was_done_to_it(seen, change):
    """And one of sound, also under the same label."""
    original = sound_of(0) if seen is sounding else steps_of(0)
    copied = change(original, np.random.default_rng(9))
    (copy,) = found(seen(original), seen(copied), same_label=seen is sounding)
    assert (copy.one, copy.other) == ("one", "other")
    assert copy.kind == ("sound" if seen is sounding else "tracks")
    assert seen is moving or copy.alike > 0.95


def test_runs_of_one_texture_at_one_speed_are_no_copies():
    seeds = {str(seed): seed for seed in range(12)}
    for seen, made in ((sounding, sound_of), (moving, steps_of)):
        prints = {n: read(written(fingerprint(seen(made(seed))))) for n, seed in seeds.items()}
        assert find_copies(prints, seeds) == []


def test_what_swings_alike_is_no_copy():
    """Stick and slip: one tone, and hardly anything else."""
    calm = [moving(0.02 * (steps_of(seed) - steps_of(seed, 0.0)) * 50) for seed in (0, 1)]
    assert found(*calm) == []


def test_a_robot_may_slide_over_the_same_track_again():
    sound, rng = sound_of(0), np.random.default_rng(5)
    again = sound + rng.normal(0, 0.17 * sound.std() * np.sqrt(RATE / 2 / 145), len(sound))
    (copy,) = found(sounding(sound), sounding(again))
    assert copy.alike < 0.95
    assert found(sounding(sound), sounding(again), same_label=True) == []


def test_tables_that_have_equal_rows_are_copies():
    rng = np.random.default_rng(0)
    taxels = np.cumsum(rng.normal(size=(250, 16)), axis=0) + 1000
    renamed = taxels.copy()
    renamed[::10] += 1  # a tenth of the rows was changed
    for same_label in (False, True):
        (copy,) = found(sounding(taxels, 35.7), sounding(taxels, 35.7), same_label)
        assert copy.kind == "rows"
    (copy,) = found(sounding(taxels, 35.7), sounding(renamed, 35.7))
    assert copy.alike == pytest.approx(0.9, abs=0.06)


def test_tables_that_fluctuate_alike_in_other_rows_are_no_copies():
    """Two plates pressed and slid alike: nine taxels that all follow one force."""
    rng = np.random.default_rng(0)
    force = np.cumsum(rng.normal(size=400))[:, None] * np.linspace(0.5, 1.5, 9)
    one, other = (force + rng.normal(0, 0.1, (400, 9)) for _ in range(2))
    assert np.corrcoef(np.diff(one[:, 0]), np.diff(other[:, 0]))[0, 1] > 0.9
    assert found(sounding(one, 300.0), sounding(other, 300.0)) == []
    for table in (one, other):
        table[:300] = 0  # at rest for most of the time: rows that are equal in both
    assert found(sounding(one, 300.0), sounding(other, 300.0)) == []


@pytest.mark.parametrize(
    "responses",
    [
        *(sounding(np.full(RATE * 4, level)) for level in (0.0, 0.3, np.nan)),
        sounding(np.random.default_rng(0).normal(size=RATE)),
        sounding(np.zeros((0, 1))),
        *(moving(np.full((400, 5, 2), place)) for place in (0.0, np.nan)),
        moving(np.random.default_rng(0).normal(size=(50, 5, 2))),
    ],
    ids=["silent", "constant", "NaN", "short", "empty", "still", "lost", "few frames"],
)
def test_what_says_nothing_has_no_fingerprint(responses):
    assert fingerprint(responses) == {}


def test_a_fingerprint_is_short_and_comes_back():
    both = xr.merge([sounding(sound_of(0)), moving(steps_of(0))])
    stored = json.dumps(written(fingerprint(both)))
    assert len(stored) < 6000
    came_back = read(json.loads(stored))
    for kind, series in fingerprint(both).items():
        np.testing.assert_allclose(came_back[kind], series, atol=0.02)


def test_what_is_no_fingerprint_is_refused():
    with pytest.raises(ValueError, match=r"."):
        read({"tracks": ["AAA"]})
    assert read({"tracks": []}) == {}
