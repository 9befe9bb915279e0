"""What a session that is recorded says of itself, and what may not go on in it."""

import json
from types import SimpleNamespace

import pytest

from afferents.errors import InputError
from afferents.lab.devices import CameraSettings, MicrophoneSettings
from afferents.lab.devices.base import DriveLimits
from afferents.lab.recorder.plan import RecordingPlan
from afferents.lab.recorder.session import RecordedSession

PLAN = RecordingPlan(textures=["4"], speeds_mm_s=[60], camera={}, seconds=2.0)
SOUND = MicrophoneSettings("mic", 44_100.3, 2)


def begun(root, sound=SOUND):
    session = RecordedSession(root, PLAN, simulated=False)
    camera = SimpleNamespace(settings=CameraSettings("mine", "MJPG", 640, 480, 90.0))
    drive = SimpleNamespace(limits=DriveLimits(1.0, 100.0))
    session.begin(SimpleNamespace(camera=camera, sound=sound, drive=drive))
    return json.loads((root / "session.json").read_text())


@pytest.fixture
def root(tmp_path):
    """A session with a finished run."""
    begun(tmp_path / "S")
    (tmp_path / "S/4/60").mkdir(parents=True)
    (tmp_path / "S/4/60/run.json").write_text('{"checksums": {"video.mp4": "a"}}')
    return tmp_path / "S"


def test_what_was_imported_stays(root):
    said = json.loads((root / "session.json").read_text())
    sums, holes = {"0/40": {"video.mp4": "b"}}, [["4", 40.0], ["0", 60.0]]
    (root / "session.json").write_text(json.dumps({**said, "checksums": sums, "holes": holes}))
    said = begun(root)
    assert said["checksums"] == {**sums, "4/60": {"video.mp4": "a"}}
    assert said["holes"] == sorted(holes)


def test_the_rate_is_that_of_the_files(root):
    assert begun(root)["sample_rate_hz"] == 44_100


def test_runs_without_sound_do_not_join_those_with_it(root):
    with pytest.raises(InputError, match=r"expected sound, as in .*found no \[microphone\]"):
        begun(root, None)


def test_a_rehearsal_is_called_one(root):
    with pytest.raises(InputError, match="expected a rehearsal, found a session of real devices"):
        RecordedSession(root, PLAN.model_copy(update={"drum_mm": 80.0}), simulated=True)
