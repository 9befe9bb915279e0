"""Sound against picture: the offset of a simulated microphone, from taps at the start of a run."""

import json

import pytest

from afferents.lab.recorder.plan import read_plan
from afferents.lab.recorder.record import Recorder
from afferents.lab.recorder.rehearsal import Bench
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress
from afferents.rig import Rig

from ..unit.lab.recorder.faulty import faulty_devices

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
