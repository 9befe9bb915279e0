"""Signals as JSON lines: what `track` says of a clip, for any reader, and files that end well."""

import errno
import json

import numpy as np
import pytest

from afferents import load_sensor, track
from afferents.live.fingertip import stream
from afferents.live.signals import UNITS, lines_of, write_lines

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
        "--sensor", "tip_b", "--signals", ",".join(UNITS),
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


def test_events_come_with_the_rest_that_holds_from_there(clip):
    with stream(clip, sensor="tip_b") as tip:
        lines = []
        for line in map(json.loads, lines_of(tip, ["sa1"])):
            lines.append(line)
            if len(lines) == 3:
                tip.set_rest()
    (told,) = [line for line in lines[1:] if "events" in line]
    assert told["events"] == ["rest was set: displacement counts from here"]
    assert len(told["rest_position"]) == 361


def test_a_full_disk_ends_the_file_with_a_whole_line(clip, tmp_path, monkeypatch):
    class Full:
        """A file that takes 1000 bytes more."""

        def __init__(self, file):
            self.file, self.room = file, 1000

        def __enter__(self):
            return self

        def __exit__(self, *_):
            self.file.close()

        def __getattr__(self, name):
            return getattr(self.file, name)

        def write(self, data):
            if not self.room:
                raise OSError(errno.ENOSPC, "No space left on device")
            data = bytes(data[: self.room])
            self.room -= len(data)
            return self.file.write(data)

    opened = type(tmp_path).open
    monkeypatch.setattr(type(tmp_path), "open", lambda *args, **how: Full(opened(*args, **how)))
    out = tmp_path / "full.jsonl"
    with pytest.raises(OSError, match="No space left"):
        write_lines(iter([json.dumps({"n": "x" * 300})] * 9), str(out))
    kept = out.read_bytes()
    assert kept.endswith(b"\n")
    assert len([json.loads(line) for line in kept.splitlines()]) == 3


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
        (("--signals", "sa1", "--to", "CLIP"), "found what the command reads"),
    ],
)
def test_signals_that_can_not_be_given(fails, clip, options, sentence):
    before = clip.read_bytes()
    assert sentence in fails(
        "live", "--video", clip, *(str(clip) if o == "CLIP" else o for o in options)
    )
    assert clip.read_bytes() == before
