"""The offset of microphone and camera, where it is known."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter1d

from afferents.channels.offset import measure_offset
from afferents.core.errors import InputError

RATE_HZ = 8000


def touch(seed, offset_s, noise=0.0, seconds=3.0):
    """A skin of 30 pins that moves at random, softly, from 0.5 s on; its sound, so much later."""
    rng = np.random.default_rng(seed)
    fine = np.arange(round(RATE_HZ * (seconds + 0.4))) / RATE_HZ - 0.2
    course = gaussian_filter1d(rng.normal(size=(3, len(fine))), 0.012 * RATE_HZ, axis=1)
    course *= [[300], [200], [100]] * (1 / (1 + np.exp(-(fine - 0.5) / 0.02)))
    speed = np.gradient(course, 1 / RATE_HZ, axis=1)
    sound = rng.normal(size=3) @ speed
    frames = np.arange(round(90 * seconds)) / 90
    shapes = rng.normal(size=(3, 30, 2))
    at_frames = np.array([np.interp(frames, fine, c) for c in course])
    position = np.einsum("kt,kms->tms", at_frames, shapes) + noise * rng.normal(
        size=(len(frames), 30, 2)
    )
    audio = np.arange(round(RATE_HZ * seconds)) / RATE_HZ
    return frames, position, np.interp(audio - offset_s, fine, sound), RATE_HZ


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 1000), offset_ms=st.floats(-80, 80))
def test_a_known_offset_is_found(seed, offset_ms):
    found = measure_offset(*touch(seed, offset_ms / 1000, noise=0.02))
    assert 1000 * found.seconds == pytest.approx(offset_ms, abs=2)


def test_lost_markers_are_left_out():
    time_s, position, sound, rate = touch(3, 0.02)
    position[50:90, 4] = np.nan
    assert measure_offset(time_s, position, sound, rate).seconds == pytest.approx(0.02, abs=2e-3)


def test_sound_of_something_else_is_refused():
    time_s, position, sound, rate = touch(3, 0.02)
    other = touch(4, 0.02)[2]
    with pytest.raises(InputError, match="tap the fingertip with something smooth"):
        measure_offset(time_s, position, other, rate)
    with pytest.raises(InputError, match=r"at least 1 s of video and audio, found 0.13 s"):
        measure_offset(time_s[:13], position[:13], sound, rate)
    with pytest.raises(InputError, match=r"at least 1 s of video and audio, found 0.00 s"):
        measure_offset(time_s, position, sound[:10], rate)
    position[50, :, 0] = np.nan
    with pytest.raises(InputError, match="markers that are seen all the time, found none"):
        measure_offset(time_s, position, sound, rate)


def test_the_rig_s_offset_is_found(run, tmp_path):
    """Smooth drums, each run with an offset of its own, from mp4 and wav."""
    session = tmp_path / "session"
    assert run("simulate", session, "--textures", "a", "--speeds", "10,20,30", "--seconds", 2.5,
               "--seed", 5, "--quiet", "--workers", 1)[0] == 0  # fmt: skip
    true = json.loads((session / "session.json").read_text())["runs"]
    names = ["0/10", "0/20", "0/30"]
    code, out, _ = run("align", *(session / name for name in names), "--json")
    assert code == 0
    found = json.loads(out)["offsets_ms"]
    off = np.array(
        [f - 1000 * true[n]["clock_offset_s"] for f, n in zip(found, names, strict=True)]
    )
    assert np.abs(off).max() < 4
    assert abs(off.mean()) < 2
    code, out, _ = run("align", session / "0/10", "--quiet")
    assert "feel with --audio-offset-ms" in out.replace("\n", " ")
