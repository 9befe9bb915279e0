"""Signals as lines and in MCAP files: what `track` says of a clip, in files that end well."""

import json
import signal
import sys
import time
from collections import defaultdict
from functools import partial

import numpy as np
import pytest

from afferents import load_sensor, track
from afferents.errors import InputError
from afferents.lab.live import signals
from afferents.lab.live.fingertip import stream
from afferents.lab.live.signals import (
    UNITS,
    JsonLines,
    McapFile,
    give_signals,
    parse_signals,
    prepare_places,
)

from ....limits import files_no_larger_than
from .conftest import LIVE

pytest.importorskip("rosbags")

from rosbags.highlevel import AnyReader

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


def messages_in(path):
    """Return the messages of an MCAP file by topic, each its time, ns, and what it holds."""
    found = defaultdict(list)
    with AnyReader([path]) as reader:
        for one, at_ns, data in reader.messages():
            found[one.topic].append((at_ns, reader.deserialize(data, one.msgtype)))
    return found


def give_to(clip, *places, audio=None):
    names = parse_signals(UNITS if audio else [*UNITS][:-1], audio)
    opened = prepare_places(places, ())
    give_signals(stream(clip, audio, sensor="tip_b"), names, opened)


def test_an_mcap_file_holds_what_the_lines_say(clip, session, tmp_path):
    lines, bag = tmp_path / "touch.jsonl", tmp_path / "touch.mcap"
    give_to(clip, str(lines), f"mcap:{bag}", audio=session / "1/20")
    header, *expected = map(json.loads, lines.read_text().splitlines())
    found = messages_in(bag)
    (about,) = found["/touch/about"]
    assert json.loads(about[1].data) == header
    assert [json.loads(said.data) for _, said in found["/touch/status"]] == [
        {key: value for key, value in line.items() if key not in UNITS} for line in expected
    ]
    for name in (name for name in UNITS if name != "ra2"):
        arrays = found["/touch/positions" if name == "position" else f"/touch/{name}"]
        at_s = [at_ns / 1e9 for at_ns, _ in arrays]
        np.testing.assert_allclose(at_s, [line["time_s"] for line in expected], atol=1e-6)
        values = np.stack([array.data for _, array in arrays])
        listed = as_array(expected, name)
        np.testing.assert_allclose(values, listed.reshape(values.shape), atol=6e-5)
    assert [dim.label for dim in found["/touch/positions"][0][1].layout.dim] == ["marker", "space"]
    heard = np.concatenate([array.data for _, array in found["/touch/ra2"]])
    said = np.concatenate([line["ra2"] for line in expected if line["ra2"]])[:, 0]
    np.testing.assert_allclose(heard, said, atol=6e-5)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "clip.mp4", "touch.jsonl", "touch.mcap"
    ]  # fmt: skip


def test_the_reader_of_the_format_reads_it(clip, tmp_path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    bag = tmp_path / "touch.mcap"
    give_to(clip, f"mcap:{bag}")
    with bag.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        counts = reader.get_summary().statistics.channel_message_counts.values()
        read = reader.iter_decoded_messages(topics="/touch/sa1")
        values = np.stack([message.data for _, _, _, message in read])
    assert sorted(counts) == [1, *[60 - FIRST] * 6]
    np.testing.assert_array_equal(values, track(clip)["sa1"].values[FIRST:])


def test_a_disk_that_fills_ends_an_mcap_file_that_is_whole(clip, tmp_path, monkeypatch):
    class Fills(JsonLines):
        """Takes the room after a while."""

        def write(self, touch, status):
            super().write(touch, status)
            if round(touch.time_s * 90) == FIRST + 9:
                monkeypatch.setattr(signals, "ROOM_BYTES", 1 << 62)

    bag = tmp_path / "touch.mcap"
    opened = [partial(Fills, tmp_path / "touch.jsonl"), *prepare_places([f"mcap:{bag}"], ())]
    with pytest.raises(InputError, match="the file is whole up to"):
        give_signals(stream(clip, sensor="tip_b"), ["sa1"], opened)
    assert len(messages_in(bag)["/touch/sa1"]) == 9
    assert not (tmp_path / "touch.mcap.part").exists()


@pytest.mark.system
def test_who_stops_it_keeps_whole_files(launch, tmp_path):
    bag, lines = tmp_path / "touch.mcap", tmp_path / "touch.jsonl"
    where = ("--to", f"mcap:{bag}", "--to", lines)
    running = launch(["live", "--video", "rig:g/50", *SIGNALS, *where], imports=LIVE)
    while not lines.exists() or lines.read_bytes().count(b"\n") < 50:
        assert running.poll() is None, running.communicate()[1]
        time.sleep(0.1)
    running.send_signal(signal.SIGINT)
    assert running.wait() == 128 + signal.SIGINT
    kept = lines.read_bytes()
    assert kept.endswith(b"\n")
    assert len(messages_in(bag)["/touch/sa1"]) == kept.count(b"\n") - 1
    assert sorted(tmp_path.iterdir()) == [lines, bag]


@pytest.mark.parametrize("times", [1, 4])
def test_what_the_system_cuts_off_has_not_the_name_of_the_whole(clip, tmp_path, fails, times):
    """At its end, and in its midst."""

    class Often(McapFile):
        def write(self, touch, status):
            for _ in range(times):
                super().write(touch, status)

    bag = tmp_path / "touch.mcap"
    tip = stream(clip, sensor="tip_b")
    with files_no_larger_than(50_000), pytest.raises(InputError) as raised:
        give_signals(tip, [*UNITS][:4], [partial(Often, bag)])
    assert f"{bag}: expected room on the disk, found File too large" in str(raised.value)
    assert not bag.exists()
    left = bag.with_name("touch.mcap.part")
    assert f"lies in {left}, without its end" in str(raised.value)
    assert (left / "touch" / bag.name).stat().st_size == 50_000
    said = fails("live", "--video", clip, *SA1, "--to", f"mcap:{bag}")
    assert f"{left}: expected a name that is free, found a folder" in said


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ("--signals", "sa3"),
            "--signals: expected of position, sa1, ra1, speed, shear, ra2, found",
        ),
        (("--signals", ""), "--signals: expected of position"),
        (("--signals", "ra2"), "--signals: expected a source of sound for ra2 (--audio)"),
        (
            ("--signals", "sa1", "--web"),
            "--signals: expected none of --model, --web, --lsl and --learn",
        ),
        ((*SA1, "--to", "CLIP"), "found what the command reads"),
        ((*SA1, "--to", "mcap:CLIP"), "found what the command reads"),
        ((*SA1, "--to", "NEAR/there.jsonl"), "there.jsonl: expected a name that is free"),
        ((*SA1, "--to", "mcap:NEAR/there.jsonl"), "there.jsonl: expected a name that is free"),
        ((*SA1, "--to", "osc:127.0.0.1:9000"), "--to: expected -, lsl, mcap:FILE, or a file of"),
        ((*SA1, "--to", "lls"), "such as touch.jsonl, found 'lls'"),
        ((*SA1, "--to", "NEAR/touch.mcap"), "touch.mcap'"),
        ((*SA1, "--to", "mcap:"), "found 'mcap:'"),
        (
            (*SA1, "--to", "NEAR/a.jsonl", "--to", "mcap:NEAR/a.jsonl"),
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


@pytest.mark.parametrize(
    ("place", "package", "extra"), [("lsl", "pylsl", "lsl"), ("mcap:touch.mcap", "rosbags", "mcap")]
)
def test_a_package_that_is_missing_is_named(clip, fails, monkeypatch, place, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    said = fails("live", "--video", clip, *SA1, "--to", place)
    assert f"expected the packages of the extra '{extra}'" in said
    assert f"pip install 'afferents[{extra}]'" in said
