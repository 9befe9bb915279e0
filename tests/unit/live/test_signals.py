"""Signals as JSON lines: what `track` says of a clip, in files that end well."""

import json
import sys
from functools import partial

import numpy as np
import pytest

from afferents import load_sensor, track
from afferents.live.fingertip import stream
from afferents.live.places import JsonLines
from afferents.live.signals import UNITS, give_signals

from ...limits import files_no_larger_than

SA1 = ("--signals", "sa1")
SIGNALS = ("--signals", "position,sa1,ra1,speed", "--sensor", "tip_b")
FIRST = load_sensor("tip_b").rest_frame


@pytest.fixture
def clip(make_video, tmp_path):
    """Discs that move after a while; one hidden at the end."""
    shift = 3 * np.sin(np.arange(60) / 4) * (np.arange(60) > 25)
    covered = [[40] if i > 50 else [] for i in range(60)]
    return make_video(tmp_path / "clip.mp4", shift, covered)


def as_array(lines, name):
    return np.array([line[name] for line in lines], dtype=float)


def test_lines_are_what_track_says_of_a_clip(run, clip, session):
    code, out, _ = run(
        "live", "--video", clip, "--audio", session / "1/20", "--speed", "max",
        "--sensor", "tip_b", "--signals", ",".join(UNITS), "--to", "-",
    )  # fmt: skip
    assert code == 0
    header, *lines = map(json.loads, out.splitlines())
    stored = track(clip)
    for name in ("sa1", "ra1", "position"):
        np.testing.assert_allclose(as_array(lines, name), stored[name].values[FIRST:], atol=6e-5)
    np.testing.assert_allclose(header["rest_position"], stored.rest_position.values, atol=6e-5)
    assert header["units"] == UNITS
    assert (header["fps_hz"], header["unix_ahead_s"]) == (90, None)
    assert [line["touching"] for line in lines] == [i > 25 for i in range(FIRST, 60)]
    assert lines[-1]["lost"] == pytest.approx(1 / 361, abs=1e-4)
    assert None in lines[-1]["sa1"]
    assert all(len(line["shear"]) == 6 for line in lines)
    assert sum(len(line["ra2"]) for line in lines) == 4000  # half a second at 8000 Hz


def test_events_come_with_the_rest_that_holds_from_there(clip, tmp_path):
    class SetsRest(JsonLines):
        def write(self, touch, status):
            super().write(touch, status)
            if round(touch.time_s * 90) == FIRST + 2:
                tip.set_rest()

    tip, out = stream(clip, sensor="tip_b"), tmp_path / "touch.jsonl"
    give_signals(tip, ["sa1"], [partial(SetsRest, out)])
    lines = [*map(json.loads, out.read_text().splitlines())]
    (told,) = [line for line in lines[1:] if "events" in line]
    assert told["events"] == ["rest was set: displacement counts from here"]
    assert len(told["rest_position"]) == 361


def test_a_full_disk_ends_the_file_with_a_whole_line(clip, tmp_path, fails):
    out = tmp_path / "full.jsonl"
    with files_no_larger_than(60_000):
        said = fails("live", "--video", clip, "--speed", "max", *SIGNALS, "--to", out)
    assert f"{out}: expected room on the disk, found File too large" in said
    kept = out.read_bytes()
    assert kept.endswith(b"\n")
    assert 2 < len([json.loads(line) for line in kept.splitlines()]) < 41


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ("--signals", "sa3"),
            "--signals: expected of position, sa1, ra1, speed, shear, ra2, found",
        ),
        (("--signals", ""), "--signals: expected of position"),
        (("--signals", "ra2"), "--signals: expected a source of sound for ra2 (--audio)"),
        (("--signals", "sa1", "--web"), "--signals: expected none of --model, --web and --lsl"),
        ((*SA1, "--to", "CLIP"), "found what the command reads"),
        ((*SA1, "--to", "NEAR/there.jsonl"), "there.jsonl: expected a name that is free"),
        ((*SA1, "--to", "osc:127.0.0.1:9000"), "--to: expected -, lsl, or a file of"),
        ((*SA1, "--to", "lls"), "such as touch.jsonl, found 'lls'"),
        (
            (*SA1, "--to", "NEAR/a.jsonl", "--to", "NEAR/a.jsonl"),
            "--to: expected places that differ",
        ),
        ((*SA1, "--to", "-", "--to", "-"), "--to: expected places that differ, found -, -"),
    ],
)
def test_signals_that_can_not_be_given(fails, clip, options, sentence):
    near = clip.parent
    (near / "there.jsonl").write_text("kept")
    before = {path: path.read_bytes() for path in near.iterdir()}
    given = (one.replace("CLIP", str(clip)).replace("NEAR", str(near)) for one in options)
    assert sentence in fails("live", "--video", clip, *given)
    assert {path: path.read_bytes() for path in near.iterdir()} == before


@pytest.mark.parametrize(("place", "package", "extra"), [("lsl", "pylsl", "lsl")])
def test_a_package_that_is_missing_is_named(clip, fails, monkeypatch, place, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    said = fails("live", "--video", clip, *SA1, "--to", place)
    assert f"expected the packages of the extra '{extra}'" in said
    assert f"pip install -c constraints.txt '.[{extra}]'" in said
