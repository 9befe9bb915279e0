"""What is wrong with a recording is named alike for a file, a session, a store and a report."""

import json
import struct
from itertools import pairwise

import numpy as np
import pytest

from afferents.extraction.extract import extract
from afferents.inspection.inspect import inspect
from afferents.quality.frames import mean_motion
from afferents.quality.issues import QualityIssue, describe_issues
from afferents.quality.repeats import find_doubled_frames, find_time_issues
from afferents.quality.sound import find_sound_issues
from afferents.recordings.check import check_recording
from afferents.recordings.data_sets import read_session
from afferents.recordings.grid import require_rates_that_agree
from afferents.recordings.video import Footage, open_video

from ..films import make_images, write_film

FPS, RATE = 90, 8000
FINE = {"crf": "12", "preset": "ultrafast"}


@pytest.fixture(scope="module")
def faulty(make_video, tmp_path_factory):
    """Clips of one skin: sound, knocked by 9 px, with bursts of lost frames, slower in the end."""
    root = tmp_path_factory.mktemp("sessions") / "faulty"
    root.mkdir()
    shift = np.where(np.arange(200) > 30, np.abs(np.arange(200) % 32 - 16) / 4 - 0.5, 0)
    make_video(root / "felt_20.mp4", shift)
    images = make_images(root / "felt_20.mp4")
    knocked = images[:100] + [np.roll(image, 9, axis=1) for image in images[100:]]
    write_film(root / "wool_20.mp4", knocked, rate=FPS, options=FINE)
    for name, keep in {
        "jute_20": [n for n in range(200) if n % 60 < 52],
        "silk_20": [n for n in range(200) if n < 120 or n % 3 == 0],
    }.items():
        at_ms = [round(1000 * n / FPS) for n in keep]
        write_film(root / f"{name}.mp4", [images[n] for n in keep], at_ms=at_ms, options=FINE)
    (root / "session.toml").write_text('pattern = "{texture}_{speed}.mp4"\nsteady_s = [0.5, 2.2]\n')
    return root


FOUND = {
    "felt_20": "",
    "wool_20": "Knocked: expected a camera and a fingertip that stay where they are mounted",
    "jute_20": "Gaps: expected a frame every 11.0 ms, found 24 missing",
    "silk_20": "Uneven: expected a frame every 11.0 ms, found a variable frame rate",
}


@pytest.mark.parametrize("name", FOUND)
def test_a_file_a_session_and_a_store_name_the_same(faulty, tmp_path_factory, name):
    kind, _, what = FOUND[name].partition(": ")
    at_file = inspect(faulty / f"{name}.mp4", tmp_path_factory.mktemp("out"), quiet=True)
    of_file = [s for s in at_file.sentences if s.split(":")[0] in ("Knocked", "Gaps", "Uneven")]
    assert [s.startswith(FOUND[name]) for s in of_file] == ([True] if kind else [])
    of_session = inspect(faulty, tmp_path_factory.mktemp("out"), quiet=True)
    recording = name.replace("_", "/")
    assert kind.lower() in "".join(of_session.facts["issues"].get(recording, [""]))
    if kind:
        assert any(s.startswith(f"{kind}: {recording}: {what}") for s in of_session.sentences)


def test_a_store_keeps_and_names_what_is_wrong(faulty, tmp_path, run):
    store = tmp_path / "s.zarr"
    code, _, err = run("extract", faulty, store, "--workers", "1")
    assert code == 0
    for kind, recording in (("Knocked", "wool/20"), ("Gaps", "jute/20"), ("Uneven", "silk/20")):
        assert f"{kind}: {recording}: expected" in err.replace("\n", " ")
    conditions = {
        r.attrs["name"]: json.loads(r.attrs["conditions"]).get("issues")
        for r in extract(faulty, store, quiet=True)
    }
    assert conditions == {
        "felt/20": None, "wool/20": "knocked", "jute/20": "gaps", "silk/20": "uneven"
    }  # fmt: skip


def test_lost_frames_are_no_other_rate(faulty):
    session = read_session(faulty)
    silk = next(r for r in session.recordings if r.texture == "silk")
    assert silk.video.fps_hz < 75
    assert silk.video.usual_hz == pytest.approx(FPS, rel=0.05)
    require_rates_that_agree(session, session.declared)
    ninety = session.declared.model_copy(update={"fps_hz": 90.0})
    assert check_recording(silk, ninety) == []


def test_times_alone_tell_of_gaps():
    even = np.arange(300) / FPS
    assert find_time_issues(even, "v.mp4") == []
    assert find_time_issues(np.round(even, 3), "v.mkv") == []  # whole ms
    (gap,) = find_time_issues(np.delete(even, slice(200, 206)), "v.mp4")
    assert (gap.kind, gap.is_refused) == ("gaps", False)
    assert "6 missing by the times of the others, the longest gap 0.078 s at 2.21 s" in gap.found
    assert find_time_issues(even[:1], "v.mp4") == []


def test_a_lamp_that_flickers_repeats_no_frame():
    rng = np.random.default_rng(0)
    skin = rng.uniform(60, 200, (28, 80))
    light = 1 + 0.1 * np.sin(2 * np.pi * 100 * np.arange(300) / FPS)
    lit = [
        np.clip(skin * one + rng.normal(0, 1, skin.shape), 0, 255).astype(np.uint8) for one in light
    ]
    change = np.array([np.nan, *[mean_motion(b, a) for a, b in pairwise(lit)]])
    assert find_doubled_frames(change, "v.mp4") == []
    moving = [np.roll(skin, n, axis=1).astype(np.uint8) for n in np.arange(300) // 2]
    change = np.array([np.nan, *[mean_motion(b, a) for a, b in pairwise(moving)]])
    (issue,) = find_doubled_frames(change, "v.mp4")
    assert issue.kind == "doubled"


def test_silence_and_clipping_are_named():
    noise = np.random.default_rng(0).normal(0, 0.1, 6 * RATE)
    assert find_sound_issues(noise, "a.wav", RATE) == []
    quiet = noise.copy()
    quiet[3 * RATE :] = np.random.default_rng(1).integers(-1, 2, 3 * RATE) / 2**15
    (silent,) = find_sound_issues(quiet, "a.wav", RATE)
    assert (silent.kind, silent.found) == ("silent", "silence from 3.00 s to the end")
    (clipped,) = find_sound_issues(np.clip(5 * noise, -1, 1), "a.wav", RATE)
    assert clipped.kind == "clipped"
    assert find_sound_issues(np.zeros((6 * RATE, 2)), "a.wav", RATE)[0].kind == "silent"


def test_many_recordings_make_one_sentence_a_kind():
    gaps = QualityIssue("gaps", "v.mp4", "a frame every 11.1 ms", "3 missing", "RA-I is too large")
    many = {f"1/{n}": [str(gaps)] for n in range(9)}
    assert describe_issues(many) == [
        "Gaps: 1/0: expected a frame every 11.1 ms, found 3 missing; RA-I is too large; so are "
        "1/1, 1/2 and 6 more."
    ]
    assert describe_issues({"1/0": []}) == []


def test_a_flag_to_turn_the_picture_is_named(tmp_path):
    images = [np.full((120, 160), 40 + n, np.uint8) for n in range(12)]
    path = write_film(tmp_path / "v.mp4", images)
    content = bytearray(path.read_bytes())
    at = content.find(b"tkhd") + 4 + 4 + 20 + 8 + 8  # the matrix of a track's header
    content[at : at + 36] = struct.pack(">9i", 0, 65536, 0, -65536, 0, 0, 120 << 16, 0, 1 << 30)
    path.write_bytes(content)
    footage = Footage(open_video(path))
    assert len(list(footage.frames())) == 12
    (issue,) = [one for one in footage.find_issues() if one.kind == "turned"]
    assert "a flag to show them turned by" in issue.found
