"""A log that another program writes is read as it grows, whole rows alone."""

import threading
import time

import pytest
from simulated_drum import until

from afferents.errors import InputError
from afferents.lab.devices import DRIVES, DeviceError, make_device
from afferents.lab.devices.drives import growing

POSE = "actual_TCP_pose_0,actual_TCP_pose_1,actual_TCP_pose_2"


class Arm:
    """Appends a row each 4 ms; its own clock says 1000 s and counts on."""

    def __init__(self, path, head, row):
        self.path, self._row, self._over = path, row, threading.Event()
        self.path.write_text(f"{head}\n")
        self.zero_s = time.monotonic()
        self._thread = threading.Thread(target=self._write)

    def _write(self):
        while not self._over.wait(0.004):
            self.append(f"{self._row(time.monotonic() - self.zero_s)}\n")

    def append(self, text):
        with self.path.open("a") as file:
            file.write(text)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()


def drive_of(path):
    return make_device(DRIVES, {"kind": "csv", "path": str(path)}, "[drive]")


ARMS = {
    "position": ("time_s,position_mm", lambda t: f"{1000 + t:.4f},{50 * t:.3f}"),
    "pose": (
        f"n,timestamp,{POSE}",
        lambda t: f"7,{1000 + t:.4f},{0.03 * t:.7f},{-0.04 * t:.7f},0.1",
    ),
    "speed": ("timestamp,speed_mm_s", lambda t: f"{1000 + t:.4f},50"),
}


@pytest.mark.parametrize("columns", ARMS)
def test_it_says_how_far_and_how_fast_an_arm_is_on_the_machines_clock(tmp_path, columns):
    with Arm(tmp_path / "arm.csv", *ARMS[columns]) as arm, drive_of(arm.path) as drive:
        drive.start(20.0)  # which moves nothing
        said = [drive.read()]

        def have_enough():
            said.append(drive.read())
            return said[-1].time_s - said[0].time_s > 0.4

        assert until(have_enough)
        assert said[-1].speed_mm_s == pytest.approx(50, rel=0.05)
        way, seconds = (said[-1][n] - said[len(said) // 2][n] for n in (1, 0))
        assert way / seconds == pytest.approx(50, rel=0.05)
        times = [state.time_s for state in said]
        assert times == sorted(times)
        newest = drive.read()
        assert 0 <= time.monotonic() - newest.time_s < 0.2
        if columns == "position":  # the arm was there when the machine's clock said so
            true_mm = 50 * (newest.time_s - arm.zero_s)
            assert newest.position_mm == pytest.approx(true_mm, abs=2)


@pytest.fixture
def still(tmp_path):
    """A log of which one row has come; a test writes the others."""
    arm = Arm(tmp_path / "arm.csv", *ARMS["position"])
    with arm, drive_of(arm.path) as drive:
        arm.__exit__()
        assert until(lambda: drive.query() == drive.query())
        arm._thread = threading.Thread()  # joined again at the end
        arm._thread.start()
        yield arm, drive


def test_half_a_row_is_left_until_it_is_whole(still):
    arm, drive = still
    before = drive.read()
    arm.append("2000.0,123")
    assert drive.read() == before
    arm.append(".5\n")
    assert drive.query().position_mm == 123.5


def test_a_row_that_is_no_later_is_passed_over(still):
    arm, drive = still
    before = drive.read()
    arm.append("0.0,9999\n\n")
    assert drive.read() == before


@pytest.mark.parametrize("row", ["2000.0", "2000.0,fast", "time_s,position_mm"])
def test_a_row_without_its_numbers_is_one_sentence(still, row):
    arm, drive = still
    arm.append(f"{row}\n")
    with pytest.raises(DeviceError, match=rf"arm\.csv: expected a log .* found the row '{row}'"):
        drive.read()


def test_a_log_that_grows_no_more_is_lost_and_found_again(still, monkeypatch):
    arm, drive = still
    monkeypatch.setattr(growing, "WAIT_S", 0.0)
    with pytest.raises(DeviceError, match="found no new row in 0 s; check what writes it"):
        until(lambda: drive.read() is None)
    with pytest.raises(DeviceError, match="no new row"):
        drive.open()
    monkeypatch.undo()
    with Arm(arm.path, *ARMS["speed"]):
        drive.open()
        assert drive.read().speed_mm_s == 50


def test_a_number_that_is_none_is_a_fault(still):
    arm, drive = still
    arm.append("2000.0,nan\n")
    assert "its position is nan" in drive.read().fault


def test_what_is_no_such_log_is_one_sentence(tmp_path):
    path = tmp_path / "arm.csv"
    with pytest.raises(InputError, match=r"arm\.csv: expected a log that another program writes"):
        drive_of(path).open()
    path.write_text("time_s,x\n1,2\n")
    with pytest.raises(InputError, match=r"expected the columns time_s or .* found time_s, x"):
        drive_of(path).open()
