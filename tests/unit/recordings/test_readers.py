"""What holds of every reader: a small example of each, and readers of other packages."""

import pickle
import re
import sys
from importlib.metadata import EntryPoint

import cv2
import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.recordings import data_sets
from afferents.recordings.data_sets import DATA_SETS, data_set_of, read_session
from afferents.recordings.video import VideoFile

from .arms import write_images, write_lines, write_runs, write_streams

NOT_OF_RECORDINGS = {"store"}
"""Holds responses, which were extracted already."""


@pytest.fixture(scope="module")
def examples(tmp_path_factory, write_video, write_audio):
    """A small folder of each format, and of each form of it."""
    root = tmp_path_factory.mktemp("formats")
    for speed in ("10", "20"):
        write_video(root / "session" / "0" / speed / "video.mp4")
        write_audio(root / "session" / "0" / speed / "audio.wav")
    write_video(root / "session-listed/felt_20.mkv")
    write_lines(root / "session-listed/session.toml", 'pattern = "{texture}_{speed}.mkv"')
    rows = [f"{n / 100},{n % 7}" for n in range(900)]
    write_lines(root / "dataset/felt_20.csv", "t,left", *rows)
    text = '[files]\npattern = "{texture}_{speed}.csv"\n[signal]\ntime = "t"'
    write_lines(root / "dataset/dataset.toml", text)
    write_images(root / "pictures", "{}.png")
    times = [f"{n}.png,{n / 50}" for n in range(6)]
    write_lines(root / "pictures/timestamps.csv", "image,time_s", *times)
    write_streams(root / "tactile-bench")
    write_runs(root / "tactip-runs")
    return root


FORMS = ["session", "session-listed", "dataset", "pictures", "tactile-bench", "tactip-runs"]


def test_every_format_has_an_example():
    assert {form.removesuffix("-listed") for form in FORMS} == DATA_SETS.keys() - NOT_OF_RECORDINGS


@pytest.mark.parametrize("form", FORMS)
def test_a_reader_recognises_its_own_and_no_others(examples, form):
    name = form.removesuffix("-listed")
    assert [k for k, kind in DATA_SETS.items() if kind.recognises(examples / form)] == [name]
    assert not any(kind.recognises(examples / "absent") for kind in DATA_SETS.values())
    assert data_set_of(examples / form).name == name
    assert str(data_set_of(f"{name}:{examples / form}")).startswith(f"{name}:{examples / form}")


@pytest.mark.parametrize("form", FORMS)
def test_a_scan_says_what_there_is_and_decodes_nothing(examples, form, monkeypatch):
    def decoded(*_):
        raise AssertionError("decoded")

    monkeypatch.setattr(cv2, "imdecode", decoded)
    monkeypatch.setattr(VideoFile, "frames", decoded)
    reader = data_set_of(examples / form)
    found = reader.scan().recordings
    assert len({one.name for one in found}) == len(found) > 0
    for one in found:
        assert one.texture
        assert one.speed_mm_s is None or one.speed_mm_s > 0
        assert all(isinstance(value, str | float | int) for value in one.conditions.values())
        assert (one.fps_hz or one.sample_rate_hz) > 0
        assert all(path.exists() for path in one.files)
        again = pickle.loads(pickle.dumps(one))  # as processes side by side are sent it
        assert (again.name, again.files) == (one.name, one.files)


@pytest.mark.parametrize("form", FORMS)
def test_reading_one_gives_frames_or_samples_in_order_of_time(examples, form):
    reader = data_set_of(examples / form)
    name = reader.scan().recordings[-1].name
    one = reader.read(name)
    assert one.name == name
    if one.video is not None:
        frames = list(one.video.frames())
        assert (np.diff([frame.time_s for frame in frames]) > 0).all()
        assert {frame.image.shape for frame in frames} == {(one.video.height, one.video.width)}
    if one.audio is not None:
        assert one.audio.read().sizes["audio_time"] == one.audio.n_samples
    with pytest.raises(InputError, match=r"expected an id of its recordings \(.*, found 'none'"):
        reader.read("none")


@pytest.mark.parametrize("form", [form for form in FORMS if form != "dataset"])
def test_what_has_videos_is_a_session(examples, form):
    session = read_session(examples / form)
    assert session.at_rate(50.0).recordings[0].video.fps_hz == 50
    assert [r.name for r in session.resolve().recordings] == [r.name for r in session.recordings]


# Readers of other packages.

READER = """
from afferents import DataSet, Session
import pandas

class Reader(DataSet):
    name, title, extracted_first = "odd", "odd", True

    @classmethod
    def recognises(cls, path):
        {recognises}

    def scan(self):
        {scan}
"""
OWN = "return (path / 'mine.odd').exists()"
SCAN = (
    "return Session.from_table(pandas.DataFrame([dict(video='a.mkv', texture='felt')]), self.path)"
)


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Install a package whose entry point names a reader; return a folder that is of it."""

    def install(recognises=OWN, scan=SCAN, value="odd_reader:Reader"):
        text = READER.format(recognises=recognises, scan=scan)
        (tmp_path / "odd_reader.py").write_text(text)
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, "odd_reader", raising=False)
        point = EntryPoint("odd", value, data_sets.ENTRY_POINTS)
        monkeypatch.setattr(data_sets, "entry_points", lambda group: [point])
        folder = tmp_path / "folder"
        folder.mkdir(exist_ok=True)
        (folder / "mine.odd").touch()
        return folder

    return install


def test_a_reader_of_another_package_is_found(installed, write_video):
    folder = installed()
    write_video(folder / "a.mkv")
    assert data_set_of(folder).name == "odd"
    assert data_set_of(f"odd:{folder}").read("felt").texture == "felt"
    (recording,) = afferents.read_session(folder).recordings
    assert recording.video.n_frames == 12


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [
        ({"recognises": "1 / 0"}, r"folder, reader 'odd': .* found ZeroDivisionError: division"),
        ({"scan": "1 / 0"}, r"folder: expected data that can be read, found ZeroDivisionError"),
        ({"scan": "return self.path"}, r"folder: expected recordings to extract, found \w*Path"),
        (
            {"value": "odd_reader:Missing"},
            r"entry point 'odd' .*: expected 'Missing' in odd_reader",
        ),
        ({"value": "odd_reader:Session"}, r"a class of afferents.DataSet with a name of its own"),
        ({"value": "not_there:Reader"}, r"expected a module that can be imported"),
    ],
)
def test_a_reader_that_fails_is_said_in_a_sentence(installed, fails, tmp_path, parts, sentence):
    folder = installed(**parts)
    assert re.search(sentence, fails("extract", folder, tmp_path / "out.zarr"))
    assert not (tmp_path / "out.zarr").exists()


@pytest.mark.parametrize("form", FORMS)
def test_a_reader_that_claims_files_of_another_is_refused(installed, examples, form):
    installed(recognises="return True")
    name = form.removesuffix("-listed")
    sentence = rf"expected files of one reader, found that {name} and odd take .* say which: {name}"
    with pytest.raises(InputError, match=sentence):
        data_set_of(examples / form)
    assert data_set_of(f"{name}:{examples / form}").name == name
