"""Answers of drives that can't be true: they stop the drum, and are a fault, whatever the drive."""

import math
import time

import pytest
from simulated_drum import SimulatedDrum, until

from afferents.errors import InputError
from afferents.lab.devices import Drive, DriveLimits, DriveState, SerialDrive
from afferents.lab.devices.base import CameraSettings, MicrophoneSettings

LIMITS = DriveLimits(1.0, 200.0)
BEFORE = DriveState(10.0, 1000.0, 60.0, None)


def after(position_mm, speed_mm_s=60.0, gone_s=0.02):
    return DriveState(BEFORE.time_s + gone_s, position_mm, speed_mm_s, None)


@pytest.mark.parametrize(
    "state",
    [
        after(1001.2),
        after(998.8, -60.0),
        after(1007.0),  # of a motor whose sensor counts 42 a turn
        after(1060.0, 200.0, 0.3),
        after(-3000.0, 0.0, 0.6),  # the board may have been restarted
        after(1001.2, 250.0),  # above what is asked of it, below what it can do
        after(None, 60.0),  # no index pulse yet
        after(None, None),  # turned by hand
    ],
)
def test_what_a_drum_can_do_is_possible(state):
    assert LIMITS.find_impossible(state, BEFORE) == ""


@pytest.mark.parametrize(
    ("state", "why"),
    [
        (after(math.nan), "its position is nan"),
        (after(-math.inf), "its position is -inf"),
        (after(1001.2, math.nan), "its speed is nan"),
        (after(1001.2, math.inf), "its speed is inf"),
        (DriveState(math.nan, 0.0, 0.0, None), "its time is nan"),
        (after(1001.2, -21_711), "its speed is -21711 mm/s, its highest 200"),
        (after(1001.2 - 65536 * 0.0628), "its position went -4114 mm in 0.020 s"),  # it wrapped
        (after(0.0), "its position went -1000 mm in 0.020 s"),  # one answer was 0
    ],
)
def test_what_no_drum_can_do_is_impossible(state, why):
    assert LIMITS.find_impossible(state, BEFORE) == why


class Belt(Drive):
    """A drive of somebody's own, which answers what it is told to."""

    def __init__(self, *answers):
        self.limits, self.answers, self.stops = LIMITS, iter(answers), 0

    def open(self):
        pass

    def close(self):
        pass

    def start(self, speed_mm_s):
        pass

    def query(self):
        return next(self.answers)

    def stop(self):
        self.stops += 1


def test_any_drive_is_stopped_by_an_impossible_answer_and_reports_it():
    own = after(math.nan)._replace(fault="encoder")
    belt = Belt(BEFORE, after(1001.2), after(0.0), own)
    assert [belt.read().fault for _ in range(2)] == [None, None]
    assert belt.stops == 0
    assert belt.read().fault == "impossible answer: its position went -1001 mm in 0.000 s"
    assert belt.stops == 1
    assert belt.read().fault == "encoder"
    assert belt.stops == 2


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, math.inf])
def test_rates_that_no_device_has_are_refused(rate_hz):
    with pytest.raises(InputError, match="camera it: expected a rate above 0 frames/s, found"):
        CameraSettings("it", "MJPG", 640, 480, rate_hz)
    with pytest.raises(InputError, match="microphone it: expected a rate above 0 Hz, one channel"):
        MicrophoneSettings("it", rate_hz, 2)
    with pytest.raises(InputError, match="44100 Hz, 0 channels"):
        MicrophoneSettings("it", 44_100.0, 0)
    assert math.isnan(CameraSettings("it", "MJPG", 640, 480, math.nan).fps_hz)  # it names none


assert math.isnan(CameraSettings("it", "MJPG", 640, 480, math.nan).fps_hz)  # it names none


class Board(SimulatedDrum):
    """A board with a counter of 16 bits for an encoder, and a fault of its own; 0.05 mm a count."""

    checksum = "none"

    def __init__(self, fault):
        super().__init__()
        self.fault_kind, self.broken = fault, False

    def answer(self, text):
        if text == "?":
            counts = 32000 + round(self.drum.position_mm / 0.05)
            wrapped = (counts + 32768) % 65536 - 32768
            return {"nan": "nan", "inf": "inf", "one 0": "0", "comma": "12,5"}.get(
                self.fault_kind if self.broken else "", str(wrapped)
            )
        verb, value = text.split()
        assert verb == "v"
        self.drum.aim_mm_s = float(value) * 0.05
        return None


TEMPLATE = """
name = "made"
unit = "count"
counts_a_turn = 4000
start = ["v {value}"]
stop = ["v 0"]
read = [{ send = "?", reply = '^(?P<position>\\S+)$' }]
"""


@pytest.mark.system
@pytest.mark.parametrize(
    ("fault", "why"),
    [
        ("wraps", "its position went -32"),
        ("nan", "its position is nan"),
        ("inf", "its position is inf"),
        ("one 0", "its position went -1"),
        ("comma", "no number: '12,5'; correct the template"),
    ],
)
def test_a_serial_drive_is_stopped_by_what_its_encoder_can_t_be(tmp_path, fault, why):
    pytest.importorskip("serial", reason="pyserial (extra 'lab') is not there")
    template = tmp_path / "made.toml"
    template.write_text(TEMPLATE)
    options = {"template": str(template), "diameter_mm": 200 / math.pi, "wait_s": 0.3}
    with Board(fault) as board:
        with SerialDrive(SerialDrive.Options(port=board.port, **options)) as drive:
            drive.start(60.0)
            states = [drive.read()]
            while states[-1].fault is None and len(states) < 5000:  # it wraps after 38 mm
                time.sleep(0.01)
                board.broken = board.drum.position_mm > 5
                states.append(drive.read())
            assert states[-1].fault.startswith(f"impossible answer: {why}")
            assert {state.fault for state in states[:-1]} == {None}
            assert until(lambda: board.lines[-2:] == ["v 0", "v 0"])
            assert "v 1200.00000" in board.lines  # counts a second
            assert board.drum.aim_mm_s == 0
        if fault in ("nan", "inf", "comma"):  # nor is it opened
            with pytest.raises(InputError, match=r"none that answers so \(.*(nan|inf|12,5)"):
                SerialDrive(SerialDrive.Options(port=board.port, **options)).open()
