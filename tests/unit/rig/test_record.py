"""A recording: video, sound and truth in one folder, whole or not at all."""

from pathlib import Path

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.recordings.video import open_video
from afferents.rig import AUDIO, REFERENCE, TRUTH, VIDEO, Rig, bumped_surface, record
from afferents.store.drum_path import DRIVE, logged_path

from .conftest import changed


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    target = tmp_path_factory.mktemp("rig") / "3" / "50"
    record(Rig(), target, "3", bumped_surface(3.0), 50.0, 1.6, seed=0, reference=True)
    return target


def test_the_truth_has_a_row_for_every_frame(folder):
    assert {path.name for path in folder.iterdir()} == {VIDEO, AUDIO, TRUTH, DRIVE, REFERENCE}
    assert soundfile.info(folder / AUDIO).frames == round(1.6 * 44100)
    truth = np.load(folder / TRUTH)
    frames = list(open_video(folder / VIDEO).frames())
    n = len(frames)
    assert n == 144
    shapes = {name: value.shape for name, value in truth.items()}
    assert shapes == {
        "time": (n,),
        "position": (n, 361, 2),
        "drum_angle_rad": (n,),
        "speed_mm_s": (n,),
        "pressure": (n, 361),
    }
    np.testing.assert_allclose([f.time_s for f in frames], truth["time"], atol=1 / 90000)
    assert truth["speed_mm_s"][0] == 0
    assert truth["speed_mm_s"][-1] == pytest.approx(50, rel=0.05)


def test_the_drums_way_is_logged_as_it_truly_was(folder):
    truth, way = np.load(folder / TRUTH), logged_path(folder)
    np.testing.assert_allclose(way.at(truth["time"]) / 40, truth["drum_angle_rad"], atol=1e-9)
    assert (way.drum.circumference_mm, way.drum.zero) == (np.pi * 80, "mark")


def test_the_reference_clip_shows_the_skin_at_rest(folder):
    clip = [frame.image for frame in open_video(folder / REFERENCE).frames()]
    assert len(clip) == 45
    first, last = clip[0].astype(float), clip[-1].astype(float)
    assert np.corrcoef(first.ravel(), last.ravel())[0, 1] > 0.98


def test_a_colon_in_a_name_makes_no_address_of_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    record(Rig(), Path("a:b"), "3", bumped_surface(3.0), 50.0, 1.6, seed=0)
    assert logged_path(Path("a:b")) is not None


@pytest.mark.parametrize(
    ("part", "change", "sentence"),
    [
        ("camera", {"px_per_mm": 25.0}, r"pins that stay in the picture.*lower px_per_mm"),
        ("microphone", {"gain_per_mn_s": 10.0}, r"lower gain_per_mn_s"),
    ],
)
def test_pins_out_of_the_picture_and_sound_too_loud_are_refused(tmp_path, part, change, sentence):
    other = changed(Rig(), part, **change)
    with pytest.raises(InputError, match=sentence):
        record(other, tmp_path / "3" / "100", "3", bumped_surface(3.0), 100.0, 1.8, seed=0)
    assert not (tmp_path / "3").exists()
