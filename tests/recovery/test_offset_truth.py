"""The offset of microphone and camera, where it is known: from touches, and from taps."""

import json

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, sosfilt

from afferents.errors import InputError
from afferents.extraction.align import measure_offset
from afferents.lab.recorder.plan import read_plan
from afferents.lab.recorder.record import Recorder
from afferents.lab.recorder.rehearsal import Bench
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress
from afferents.rig import AUDIO, VIDEO, Rig, project, tap
from afferents.rig.camera import Renderer
from afferents.rig.microphone import write_wav
from afferents.rig.record import write_film

from ..unit.lab.recorder.faulty import faulty_devices

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


@pytest.mark.parametrize("corner_hz", [2.0, 8.0, 25.0])
def test_what_the_microphone_loses_of_slow_motion_is_no_delay(corner_hz):
    time_s, position, sound, rate = touch(5, 0.02)
    lost = butter(1, corner_hz, "highpass", fs=rate, output="sos")
    found = measure_offset(time_s, position, sosfilt(lost, sound), rate)
    assert found.seconds == pytest.approx(0.02, abs=5e-4)
    assert found.explained > 0.99


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
    """Taps on the rig, filmed and recorded, each with an offset of its own."""
    rig, true = Rig(), [-30.0, 0.0, 45.0]
    folders = [tmp_path / name for name in ("one", "two", "three")]
    for seed, (folder, offset_ms) in enumerate(zip(folders, true, strict=True)):
        folder.mkdir()
        taps = tap(rig, "4", 60.0, 2.5, (0.7, 1.2, 1.7), seed)
        late = np.roll(taps.sensor, round(44.1 * offset_ms))  # nothing is heard at either end
        renderer = Renderer(rig.camera, seed)
        places = project(taps.position_mm, rig.camera)
        film = ((float(t), renderer.draw(at)) for t, at in zip(taps.time_s, places, strict=True))
        write_film(folder / VIDEO, film, rig.camera)
        write_wav(folder / AUDIO, taps.room, late / 2)
    code, out, _ = run("align", *folders, "--json")
    assert code == 0
    off = np.array(json.loads(out)["offsets_ms"]) - true
    np.testing.assert_allclose(off, 0, atol=2)
    (folders[2] / "session.json").write_text('{"sensor_channel": 0}')  # the room, which is still
    code, _, said = run("align", folders[2])
    assert code == 2
    assert "tap the fingertip with something smooth" in said.replace("\n", " ")
    code, out, _ = run("align", folders[0], "--quiet")
    assert "feel with --audio-offset-ms" in out.replace("\n", " ")


PLAN = """
textures = ["4"]
speeds_mm_s = [60]
seconds = 0.3
tap_s = 2.0
redo = 0
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Return what came of the run with a microphone of its own, and its session's file."""
    folder = tmp_path_factory.mktemp("taps")
    path = folder / "PLAN.toml"
    path.write_text(PLAN)
    plan = read_plan(path)
    bench = Bench(Rig(), plan, speed=4)

    def recorded(**faults):
        session = folder / str(faults)
        with Progress(quiet=True) as progress:
            devices = faulty_devices(bench, **faults)
            recorder = Recorder(plan, path, load_sensor("tip_b"), devices, bench=bench)
            outcome = recorder.record(session, progress)
        return outcome, json.loads((session / "session.json").read_text())

    return recorded


@pytest.mark.parametrize("offset_ms", [-30, 45])
def test_the_offset_of_a_run_is_found(recorded, offset_ms):
    outcome, said = recorded(offset_ms=offset_ms)
    assert outcome.recorded == ["4/60"]
    found = said["runs"]["4/60"]["audio_offset"]
    assert 1000 * found["seconds"] == pytest.approx(offset_ms, abs=2)
    assert 0 < found["error_s"] < 0.003
    assert said["steady_s"] == pytest.approx([3.5, 3.8])


def test_a_run_without_a_tap_that_both_show_is_refused(recorded):
    outcome, _ = recorded(silent=True)
    assert "sound against picture: no tap that both show" in outcome.kept_aside["4/60"]
