"""Several fingertips at once: every output carries a name, and all end together."""

import json
import shutil
import signal
import urllib.request
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from afferents import load_sensor, track
from afferents.errors import InputError
from afferents.lab.live.several import make_commands
from afferents.markers import sensor as sensors

FIRST = load_sensor("tip_b").rest_frame
TWO = ("a.avi", "b.avi"), (), ("left.toml", "right.toml")


def test_each_has_files_a_page_and_a_sensor_of_its_own():
    to = ["-", "lsl", "touch.jsonl", "mcap:out/touch.mcap"]
    commands = make_commands(*TWO, to, 8800, ["--signals", "sa1"])
    left, right = commands["left"], commands["right"]
    assert left[:5] == ["live", "--video", "a.avi", "--sensor", "left.toml"]
    assert [w for flag, w in pairwise(right) if flag == "--to"] == [
        "-", "lsl", "touch-right.jsonl", "mcap:out/touch-right.mcap",
    ]  # fmt: skip
    assert right[right.index("--port") + 1] == "8801"
    assert [w for flag, w in pairwise(left) if flag == "--beside"] == [
        "left=8800", "right=8801",
    ]  # fmt: skip
    assert left[-2:] == ["--signals", "sa1"]


@pytest.mark.parametrize(
    ("audio", "sensor", "sentence"),
    [
        ((), ("left.toml",), "--sensor: expected a sensor file for each of the 2 videos"),
        ((), (), "--sensor: expected a sensor file for each of the 2 videos, .* found 0"),
        (("mic",), ("l.toml", "r.toml"), "--audio: expected sound for each of the 2 videos"),
        ((), ("a/tip.toml", "b/tip.toml"), "expected files of different names"),
    ],
)
def test_what_does_not_go_together_is_refused(audio, sensor, sentence):
    with pytest.raises(InputError, match=sentence):
        make_commands(("a.avi", "b.avi"), audio, sensor, [], 8800, [])


@pytest.fixture
def two(make_video, tmp_path):
    """Two clips that move differently, and the options that name them."""
    words = []
    for name, most in (("left", 3.0), ("right", 2.0)):
        shift = most * np.sin(np.arange(60) / 4) * (np.arange(60) > 25)
        clip = make_video(tmp_path / f"{name}.mp4", shift)
        file = tmp_path / f"{name}.toml"
        shutil.copyfile(Path(sensors.__file__).parent / "sensors" / "tip_b.toml", file)
        words += ["--video", clip, "--sensor", file]
    return words


def test_lines_of_two_clips_are_theirs(launch, two, tmp_path):
    out = tmp_path / "out"
    asked = ("--signals", "sa1", "--to", "-", "--to", out / "touch.jsonl", "--speed", "max")
    running = launch(["live", *two, *asked])
    said, _ = running.communicate(timeout=120)
    assert running.returncode == 0
    lines = [json.loads(line) for line in said.splitlines()]
    for name, clip in (("left", two[1]), ("right", two[5])):
        header, *frames = [line for line in lines if line["fingertip"] == name]
        assert header["units"] == {"sa1": "px"}
        stored = track(clip).sa1.values[FIRST:]
        np.testing.assert_allclose([line["sa1"] for line in frames], stored, atol=6e-5)
        written = (out / f"touch-{name}.jsonl").read_text().splitlines()
        assert len(written) == len(frames) + 1


def test_one_that_fails_ends_all(launch, two):
    running = launch(["live", *two[:6], "--sensor", "none.toml", "--signals", "sa1"])
    _, said = running.communicate(timeout=120)
    assert running.returncode == 2
    assert said.count("none.toml") == 1


@pytest.mark.system
def test_pages_name_each_other_and_end_with_the_command(launch, two):
    running = launch(["live", *two, "--web", "--port", "8930"])
    urls = sorted(running.stderr.readline().split()[1] for _ in range(2))
    assert [url.rpartition(":")[2] for url in urls] == ["8930", "8931"]
    for url in urls:
        with urllib.request.urlopen(url, timeout=60) as page:
            assert b'id="beside"' in page.read()
    running.send_signal(signal.SIGINT)
    running.communicate(timeout=60)
    assert running.returncode == 128 + signal.SIGINT
