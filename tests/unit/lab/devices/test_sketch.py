"""The Arduino sketch of the docs, compiled for this machine, with a motor that is none."""

import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest
from simulated_drum import until

from afferents.lab.devices import SerialDrive

pytestmark = pytest.mark.system

pytest.importorskip("serial", reason="pyserial (extra 'lab') is not there")
HERE = Path(__file__).parent
SKETCH = HERE.parents[3] / "docs" / "arduino" / "drum" / "drum.ino"


class Board:
    """The running sketch: its port, and where the drum truly is."""

    def __init__(self, program):
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        self.process = subprocess.Popen([program], text=True, bufsize=1, **pipes)
        self.port = self.process.stdout.readline().strip()
        self.position_mm = self.speed_mm_s = 0.0
        threading.Thread(target=self._follow, daemon=True).start()

    def _follow(self):
        for line in self.process.stdout:
            self.position_mm, self.speed_mm_s = map(float, line.split())

    def stall(self, stalled=True):
        self.process.stdin.write("s" if stalled else "g")
        self.process.stdin.flush()

    def end(self):
        self.process.kill()
        self.process.wait()


@pytest.fixture(scope="module")
def program(compiler, tmp_path_factory):
    out = tmp_path_factory.mktemp("sketch") / "drum"
    return compiler(HERE / "arduino.cpp", out, f'-DSKETCH="{SKETCH}"')


@pytest.fixture
def board(program):
    running = Board(program)
    yield running
    running.end()


@pytest.fixture
def drive(board):
    with SerialDrive(SerialDrive.Options(port=board.port, template="arduino")) as opened:
        yield opened


def test_it_holds_its_speed_and_stops(board, drive):
    drive.start(50.0)
    said = []

    def holds():
        said.append(drive.read())
        late = said[-60:]  # half a second and more
        if len(late) < 60:
            return False
        slope = np.polyfit([s.time_s for s in late], [s.position_mm for s in late], 1)[0]
        return abs(slope - 50) < 2.5

    assert until(holds)
    assert until(lambda: drive.read() and abs(board.speed_mm_s - 50) < 5)
    assert {s.fault for s in said} == {None}
    drive.stop()
    assert until(lambda: board.speed_mm_s == 0)
    assert drive.read().position_mm == pytest.approx(board.position_mm, abs=0.2)


def test_the_index_pulse_sets_the_position_and_leaves_the_speed(compiler, tmp_path):
    sketch = tmp_path / "drum.ino"
    sketch.write_text(SKETCH.read_text().replace("INDEX_PIN = -1", "INDEX_PIN = 4"))
    running = Board(compiler(HERE / "arduino.cpp", tmp_path / "drum", f'-DSKETCH="{sketch}"'))
    with SerialDrive(SerialDrive.Options(port=running.port, template="arduino")) as drive:
        drive.start(50.0)
        said_mm, speeds_mm_s = [], []

        def goes_on():
            state = drive.read()
            assert state.fault is None
            said_mm.append(np.nan if state.position_mm is None else state.position_mm)
            speeds_mm_s.append(running.speed_mm_s)
            return np.isfinite(said_mm[:-60]).any()

        assert until(goes_on)
    running.end()
    first, known = np.array(said_mm), np.isfinite(said_mm)
    assert not known[0]
    assert (np.diff(known.astype(int)) >= 0).all()
    assert 0 <= first[known][0] < 20  # from the pulse on
    assert max(speeds_mm_s) < 100  # of 265 at full duty


def test_its_watchdog_stops_it(board, drive):
    drive._guard.close()  # so that nothing but the sketch itself can stop it
    drive.start(50.0)
    assert until(lambda: board.speed_mm_s > 10)
    assert until(lambda: abs(board.speed_mm_s) < 1)
    assert drive.read().fault == "watchdog"


def test_a_drum_that_is_held_is_given_up(board, drive):
    drive.start(50.0)
    board.stall()
    assert until(lambda: drive.read().fault is not None)
    assert drive.read().fault == "stalled"
