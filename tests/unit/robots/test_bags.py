"""Recordings as bags of ROS 2, and back: the same pictures, sound, times and tracks."""

import json
import os
import shutil
import sys

import av
import cv2
import numpy as np
import pytest
import soundfile

import afferents
from afferents import cli
from afferents.errors import InputError
from afferents.store.drum_path import MARK, Drum, DrumPath
from afferents.store.zarr_store import open_responses

pytest.importorskip("rosbags")

from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer

from afferents.lab.recorder.bags import extract_files
from afferents.recordings import ros_messages
from afferents.recordings.audio import WavFile
from afferents.recordings.video import VideoFile
from afferents.robots.bags import drum_messages, sound_messages, write_bag

NAME = "4/60"


@pytest.fixture(scope="module")
def rig(simulated, tmp_path_factory):
    """A simulated recording, its store, and the bag that is made of both."""
    session, store = simulated
    bags = tmp_path_factory.mktemp("bags") / "bags"
    (made,) = afferents.export_mcap(session, bags, store=store, quiet=True)
    return session, store, made


def packets(video):
    with av.open(str(video)) as container:
        stream = container.streams.video[0]
        return [(float(p.pts * p.time_base), bytes(p)) for p in container.demux(stream) if p.size]


def messages(bag, topic):
    with AnyReader([bag], default_typestore=ros_messages.typestore()) as reader:
        chosen = [one for one in reader.connections if one.topic == topic]
        return [
            (at_ns, reader.deserialize(data, one.msgtype))
            for one, at_ns, data in reader.messages(connections=chosen)
        ]


def test_a_store_of_another_session_is_refused(rig, tmp_path, fails):
    session, store, _ = rig
    other = tmp_path / "other"
    shutil.copytree(session, other)
    sound = other / NAME / "audio.wav"
    samples, rate_hz = soundfile.read(sound)
    soundfile.write(sound, samples[::-1], rate_hz)
    about = json.loads((other / "session.json").read_text())
    (other / "session.json").write_text(json.dumps({**about, "checksums": {}}))
    said = fails("export-mcap", other, tmp_path / "bags", "--store", store)
    assert f"the files of '{NAME}' that the store was extracted from" in said


def test_a_recording_comes_back_as_it_went(rig, tmp_path):
    session, store, bag = rig
    assert sorted(path.name for path in bag.iterdir()) == ["4_60.mcap", "metadata.yaml"]
    back = tmp_path / "back"
    checks = afferents.import_recording(bag, None, None, session=back, texture="4", speed_mm_s=60)
    assert all(check.passes for check in checks)
    ours, theirs = (packets(root / NAME / "video.mp4") for root in (session, back))
    assert [data for _, data in ours] == [data for _, data in theirs]
    np.testing.assert_allclose([t for t, _ in theirs], [t for t, _ in ours], atol=1.5e-6)
    sounds = [soundfile.read(root / NAME / "audio.wav", dtype="int16") for root in (session, back)]
    np.testing.assert_array_equal(sounds[0][0], sounds[1][0])
    assert sounds[0][1] == sounds[1][1]
    assert json.loads((back / NAME / "run.json").read_text())["imported"] == {"bag": str(bag)}
    command = ["extract", back, tmp_path / "back.zarr", "--workers", "1", "--quiet"]
    cli.run([*map(str, command)])
    (before,), (after,) = open_responses(store), open_responses(tmp_path / "back.zarr")
    for name in ("position", "sa1", "ra1", "ra2"):
        np.testing.assert_array_equal(before[name].values, after[name].values)


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_the_name_of_a_sound_file_need_not_be_text(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff.wav")
    soundfile.write(os.fsencode(path), np.zeros((800, 2)), 8000)
    blocks = [*sound_messages(ros_messages.Messages(ros_messages.typestore()), WavFile(path))]
    assert [block.at_ns for block in blocks] == [0]


def test_markers_and_responses_are_those_of_the_store(rig):
    _, store, bag = rig
    (responses,) = open_responses(store)
    position, time_ns = responses["position"].values, np.rint(responses["time"].values * 1e9)
    marks, drawn = messages(bag, "/touch/positions"), messages(bag, "/camera/markers")
    assert [at_ns for at_ns, _ in marks] == time_ns.astype(int).tolist()
    for n in (20, 40, 150):
        got = marks[n][1]
        assert [dim.label for dim in got.layout.dim] == ["marker", "space"]
        np.testing.assert_array_equal(got.data.reshape(position[n].shape), position[n])
        points = np.array([(p.x, p.y) for p in drawn[n][1].points[0].points])
        seen = position[n][np.isfinite(position[n]).all(axis=1)]
        np.testing.assert_allclose(points, seen + 0.5)
    sa1 = np.stack([message.data for _, message in messages(bag, "/touch/sa1")])
    np.testing.assert_array_equal(sa1, responses["sa1"].values)
    drum = messages(bag, "/drum/speed_mm_s")
    assert max(message.data for _, message in drum) == pytest.approx(60, rel=0.05)
    with AnyReader([bag], default_typestore=ros_messages.typestore()) as reader:
        times = [at_ns for _, at_ns, _ in reader.messages()]
    assert times == sorted(times)


def test_a_store_alone_and_what_was_felt(rig, tmp_path):
    _, store, _ = rig
    said = [{"time_s": 1.5, "texture": "4"}, {"time_s": 0.5, "texture": "2"}]
    (tmp_path / "felt.jsonl").write_text("\n".join(map(json.dumps, said)) + "\n")
    (bag,) = afferents.export_mcap(
        store, tmp_path / "bags", recordings=NAME, percepts=tmp_path / "felt.jsonl", quiet=True
    )
    felt = messages(bag, "/touch/percept")
    assert [(at_ns, json.loads(m.data)["texture"]) for at_ns, m in felt] == [
        (500_000_000, "2"),
        (1_500_000_000, "4"),
    ]
    (responses,) = open_responses(store)
    heard = np.concatenate([m.data.view("<i2") for _, m in messages(bag, "/microphone")])
    np.testing.assert_array_equal(heard / 32768, responses["ra2"].values[:, 0])
    with AnyReader([bag], default_typestore=ros_messages.typestore()) as reader:
        assert "/camera/image/compressed" not in reader.topics


def test_what_was_logged_before_the_zero_is_left_out(tmp_path):
    drum = Drum(circumference_mm=250, contact_mm=16, zero=MARK)
    way = DrumPath(drum, np.array([-1.0, 0.0, 1.0]), np.array([0.0, 40.0, 80.0]))
    types = ros_messages.typestore()
    write_bag(tmp_path / "bag", types, [drum_messages(ros_messages.Messages(types), way)], NAME)
    found = [(at_ns, m.data) for at_ns, m in messages(tmp_path / "bag", "/drum/position_mm")]
    assert found == [(0, 40.0), (10**9, 80.0)]


def test_a_video_that_is_no_jpegs_is_encoded(small_session, tmp_path):
    bags = afferents.export_mcap(small_session, tmp_path / "bags", recordings="1/20", quiet=True)
    frames = messages(bags[0], "/camera/image/compressed")
    video = small_session / "1" / "20" / "video.mp4"
    with av.open(str(video)) as container:
        expected = [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
    assert len(frames) == len(expected)
    found = cv2.imdecode(frames[7][1].data, cv2.IMREAD_GRAYSCALE)
    assert np.abs(found.astype(int) - expected[7]).mean() < 2


def test_sound_of_floats_is_heard_and_the_drum_is_there_without_sound(rig, tmp_path):
    session, _, bag = rig
    shutil.copytree(session / "4", tmp_path / "S" / "4")
    audio = tmp_path / "S" / NAME / "audio.wav"
    soundfile.write(audio, *soundfile.read(audio), subtype="FLOAT")
    (heard,) = afferents.export_mcap(tmp_path / "S", tmp_path / "heard", quiet=True)
    expected, found = (messages(one, "/microphone") for one in (bag, heard))
    np.testing.assert_array_equal(found[3][1].data, expected[3][1].data)
    audio.unlink()
    (mute,) = afferents.export_mcap(tmp_path / "S", tmp_path / "mute", quiet=True)
    assert len(messages(mute, "/drum/speed_mm_s")) == len(messages(bag, "/drum/speed_mm_s"))


@pytest.fixture(scope="module")
def types():
    return ros_messages.typestore()


def ros_bag(path, types, pictures, sound=(), plugin=StoragePlugin.SQLITE3, info=None):
    """A bag as a robot writes it: pictures and sound with times of their own headers."""
    with Writer(path, version=9, storage_plugin=plugin) as bag:
        at = {}
        for topic, kind, at_ns, fields in (*pictures, *sound, *(info or ())):
            if topic not in at:
                at[topic] = bag.add_connection(topic, kind, typestore=types)
            bag.write(
                at[topic], at_ns + 5_000_000, types.serialize_cdr(types.types[kind](**fields), kind)
            )
    return path


def stamped(types, at_ns):
    time = types.types["builtin_interfaces/msg/Time"](sec=at_ns // 10**9, nanosec=at_ns % 10**9)
    return types.types["std_msgs/msg/Header"](stamp=time, frame_id="tip")


def raw(types, n, encoding="mono8", topic="/tip/image", size=(48, 64)):
    """So many raw pictures, 90 a second; each is as grey as its number."""
    channels = 1 if encoding == "mono8" else 3
    shape = (size[0], size[1] * channels)
    for number in range(n):
        at_ns = 7 * 10**9 + round(number * 1e9 / 90)
        fields = {
            "header": stamped(types, at_ns), "height": size[0], "width": size[1],
            "encoding": encoding, "is_bigendian": 0, "step": shape[1],
            "data": np.full(shape, number, np.uint8).ravel(),
        }  # fmt: skip
        yield topic, ros_messages.RAW_PICTURE, at_ns, fields


def heard(types, samples, kind=ros_messages.ROS_SOUND, per_block=441):
    """Sound in blocks that begin 20 ms after the first picture."""
    for first in range(0, len(samples), per_block):
        at_ns = 7 * 10**9 + 20_000_000 + round(first / 44_100 * 1e9)
        data = samples[first : first + per_block].astype("<i2").view(np.uint8).ravel()
        if kind == ros_messages.ROS_SOUND:
            yield "/tip/audio", kind, at_ns, {"data": data}
        else:
            audio = types.types[ros_messages.ROS_SOUND](data=data)
            yield "/tip/audio", kind, at_ns, {"header": stamped(types, at_ns), "audio": audio}


INFO = {
    "channels": 2, "sample_rate": 44_100, "sample_format": "S16LE", "bitrate": 0,
    "coding_format": "wave",
}  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "plugin"), zip(("mono8", "bgr8"), StoragePlugin, strict=True), ids=str
)
def test_raw_pictures_of_a_robot_are_kept_without_loss(types, tmp_path, encoding, plugin):
    samples = np.random.default_rng(0).integers(-9000, 9000, (4410, 2)).astype(np.int16)
    ros_bag(
        tmp_path / "bag", types, raw(types, 30, encoding),
        heard(types, samples, ros_messages.ROS_SOUND_STAMPED), plugin,
        [("/tip/audio_info", ros_messages.ROS_SOUND_INFO, 7 * 10**9, INFO)],
    )  # fmt: skip
    afferents.import_recording(
        tmp_path / "bag", None, None, session=tmp_path / "S", texture="wool", speed_mm_s=20
    )
    video = VideoFile(tmp_path / "S" / "wool" / "20" / "video.mp4")
    frames = [(frame.time_s, frame.image) for frame in video.frames()]
    assert [int(picture.mean()) for _, picture in frames] == list(range(30))
    assert np.ptp(frames[9][1]) == 0
    np.testing.assert_allclose([t for t, _ in frames], np.arange(30) / 90, atol=1.5e-6)
    found, rate_hz = soundfile.read(tmp_path / "S" / "wool" / "20" / "audio.wav", dtype="int16")
    late = round(0.02 * 44_100)  # silence stands for what was not heard
    np.testing.assert_array_equal(found[late:], samples)
    assert (rate_hz, np.abs(found[:late]).max()) == (44_100, 0)


def test_sound_that_says_nothing_of_itself_is_what_the_options_say(types, tmp_path):
    samples = np.arange(2000, dtype=np.int16)[:, None]
    ros_bag(tmp_path / "bag", types, raw(types, 5), heard(types, samples))
    files = extract_files(tmp_path / "bag", tmp_path, audio_rate_hz=16_000)
    found, rate_hz = soundfile.read(files.audio, dtype="int16")
    np.testing.assert_array_equal(found, samples[:, 0])
    assert rate_hz == 16_000
    # AudioData has no stamp of its own: its time is the bag's, 5 ms later
    assert files.audio_start_s == pytest.approx(7.025)


def test_a_header_without_a_time_leaves_the_bags(types, tmp_path):
    sound = list(heard(types, np.ones((2000, 1), np.int16), ros_messages.ROS_SOUND_STAMPED))
    empty = [(*said, fields | {"header": stamped(types, 0)}) for *said, fields in sound]
    bag = ros_bag(tmp_path / "bag", types, raw(types, 5), empty)
    assert extract_files(bag, tmp_path).audio_start_s == pytest.approx(7.025)


@pytest.mark.parametrize("kind", [ros_messages.ROS_SOUND, ros_messages.ROS_SOUND_STAMPED])
def test_sound_that_was_lost_is_refused_and_what_comes_late_is_not(types, tmp_path, kind):
    blocks = list(heard(types, np.ones((8820, 1), np.int16), kind))
    lost = ros_bag(tmp_path / "lost", types, raw(types, 5), blocks[:5] + blocks[16:])
    assert "found 0.11 s missing before 0.16 s" in refused(lost, tmp_path)
    for n in range(3, 18):  # all at once, with the one after them
        late = {"header": blocks[18][3]["header"]} if kind == ros_messages.ROS_SOUND_STAMPED else {}
        blocks[n] = (*blocks[n][:2], blocks[18][2], blocks[n][3] | late)
    files = extract_files(ros_bag(tmp_path / "late", types, raw(types, 5), blocks), tmp_path)
    assert len(soundfile.read(files.audio)[0]) == 8820


def refused(bag, tmp_path, *options):
    """Return the sentence with which an import of a bag is refused; nothing is left behind."""
    command = ["import", bag, "--session", tmp_path / "S", "--texture", "4", "--speed", "60"]
    with pytest.raises(InputError) as raised:
        cli.run([*map(str, command), *options])
    assert not (tmp_path / "S").exists()
    return str(raised.value)


@pytest.mark.parametrize(("key", "found"), [("coding_format", "mp3"), ("sample_format", "F32LE")])
def test_sound_that_is_no_16_bit_samples_is_refused(types, tmp_path, key, found):
    info = [("/tip/audio_info", ros_messages.ROS_SOUND_INFO, 7 * 10**9, INFO | {key: found})]
    sound = heard(types, np.zeros((900, 2), np.int16))
    bag = ros_bag(tmp_path / "bag", types, raw(types, 5), sound, info=info)
    assert f"S16LE, found '{found}'" in refused(bag, tmp_path)


def test_bags_that_can_t_be_imported_are_refused_in_a_sentence(types, tmp_path, rig):
    two = ros_bag(tmp_path / "two", types, [*raw(types, 3), *raw(types, 3, topic="/other")])
    assert "found 2 (/other, /tip/image)" in refused(two, tmp_path)
    assert "found '/none'" in refused(two, tmp_path, "--image-topic", "/none")
    assert "a bag alone" in refused(two, tmp_path, "--times", "times.csv")
    back = list(raw(types, 4))
    back[2] = (*back[2][:3], {**back[2][3], "header": stamped(types, 10**9)})
    odd = [(t, k, n, {**f, "encoding": "16UC1"}) for t, k, n, f in raw(types, 3)]
    png = cv2.imencode(".png", np.zeros((8, 8), np.uint8))[1].ravel()
    png = {"header": stamped(types, 10**9), "format": "png", "data": png}
    for name, pictures, said in (
        ("none", heard(types, np.zeros((900, 1), np.int16)), "pictures, found /tip/audio"),
        ("back", back, "times that rise"),
        ("odd", odd, "found '16UC1'"),
        ("png", [("/a", ros_messages.PICTURE, 10**9, png)], "JPEGs, found 'png'"),
        ("one", [*raw(types, 1)], "expected 2 pictures or more"),
    ):
        assert said in refused(ros_bag(tmp_path / name, types, pictures), tmp_path)
    shutil.copytree(rig[2], tmp_path / "cut")
    cut = tmp_path / "cut" / "4_60.mcap"
    cut.write_bytes(cut.read_bytes()[:100_000])
    assert "afferents" not in refused(tmp_path / "cut", tmp_path)
    assert "no such file" in refused(tmp_path / "gone.mcap", tmp_path)


def test_what_can_t_be_exported_is_refused_in_a_sentence(rig, fails, tmp_path):
    session, store, _ = rig
    out, felt, timeless = tmp_path / "bags", tmp_path / "felt", tmp_path / "timeless"
    felt.write_text("not json")
    timeless.write_text('{"texture": "4"}\n')
    for source, options, said in (
        (session, ("--recording", "7/60"), "'7/60'"),
        (store, ("--store", store), "a session with it"),
        (store, ("--percepts", felt), "lines that 'afferents live --json' wrote"),
        (store, ("--percepts", timeless), "timeless: expected lines that"),
    ):
        assert said in fails("export-mcap", source, out, *options)
    assert not out.exists()
