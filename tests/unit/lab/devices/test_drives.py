"""What every drive must do, whatever it is made of."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from dialects import Dynamixel, ODrive, SimpleFoc, Slack
from simulated_drum import GONE_S, until

from afferents.errors import InputError
from afferents.lab.devices import DRIVES, ByHand, DeviceError, make_device

pytestmark = pytest.mark.system

pytest.importorskip("serial", reason="pyserial (extra 'lab') is not there")
pytest.importorskip("pty", reason="no pseudo-terminals here")

SERIAL = {"kind": "serial", "wait_s": 0.3}
WHEEL = {"diameter_mm": 95.0}
KINDS = {
    "arduino": (Slack, SERIAL | {"template": "arduino"}),
    "odrive": (ODrive, SERIAL | {"template": "odrive"} | WHEEL),
    "simplefoc": (SimpleFoc, SERIAL | {"template": "simplefoc"} | WHEEL),
    "dynamixel": (Dynamixel, {"kind": "dynamixel"} | WHEEL),
}
WATCHED = [name for name in KINDS if name != "simplefoc"]


def drive_of(drum, table, **more):
    return make_device(DRIVES, table | {"port": drum.port} | more, "[drive]")


def reads(drive, seconds, every_s=0.01):
    """What a drive says for some time, and where the drum truly was."""
    end_s, said = time.monotonic() + seconds, []
    while time.monotonic() < end_s:
        said.append(drive.read())
        time.sleep(every_s)
    return said


def stands(drum):
    return lambda: abs(drum.now()[1]) < 0.5


@pytest.fixture(params=KINDS)
def kind(request):
    if request.param == "dynamixel":
        pytest.importorskip("dynamixel_sdk", reason="the extra 'dynamixel' is not there")
    return KINDS[request.param]


@pytest.fixture
def drum(kind):
    with kind[0](slack=60) as simulated:
        yield simulated


@pytest.fixture
def drive(kind, drum):
    with drive_of(drum, kind[1]) as opened:
        yield opened


def test_it_reaches_its_speed_and_says_where_it_is(drive, drum):
    begin = drive.read()
    assert begin.speed_mm_s == pytest.approx(0, abs=0.1)
    drive.start(50.0)
    said = []

    def holds():
        said.append(drive.read())
        late = said[-50:]  # half a second and more
        if len(late) < 50:
            return False
        slope = np.polyfit([s.time_s for s in late], [s.position_mm for s in late], 1)[0]
        mean = np.mean([s.speed_mm_s for s in late])
        return max(abs(slope - 50), abs(mean - 50)) < 1.5

    assert until(holds)
    assert (np.diff([s.time_s for s in said]) > 0).all()
    assert {s.fault for s in said} == {None}
    before, now, after = drum.now()[0], drive.read().position_mm, drum.now()[0]
    assert before - 0.2 <= now <= after + 0.2


def test_stop_stops_it_and_it_can_be_started_again_at_any_speed(drive, drum):
    drive.start(60.0)
    reads(drive, 0.3)
    drive.stop()
    assert until(stands(drum))
    assert drive.read().fault is None
    for speed in (20.0, 80.0):
        drive.start(speed)
        assert until(lambda speed=speed: drive.read() and abs(drum.now()[1] - speed) < 8)


def test_it_is_stopped_while_another_thread_reads_it(drive, drum):
    drive.start(60.0)
    over, said = threading.Event(), []

    def read():
        while not over.is_set():
            said.append(drive.read())

    reader = threading.Thread(target=read)
    reader.start()
    assert until(lambda: drum.now()[1] > 30)
    drive.stop()
    assert until(stands(drum))
    time.sleep(0.2)
    assert stands(drum)()
    over.set()
    reader.join()
    assert {state.fault for state in said} == {None}


def test_leaving_by_an_error_stops_it(kind, drum):
    drive = drive_of(drum, kind[1])

    def slide():
        with drive:
            drive.start(50.0)
            reads(drive, 0.2)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        slide()
    assert until(stands(drum))
    drive.stop()
    drive.close()


def test_speeds_outside_its_limits_are_refused(drive, drum):
    assert 0 <= drive.limits.lowest_mm_s < drive.limits.highest_mm_s == 200
    for speed in (-5.0, 0.0, 201.0, float("nan")):
        with pytest.raises(InputError, match=r"mm/s, the drive's limits, found"):
            drive.start(speed)
    assert stands(drum)()


@pytest.mark.parametrize("fault", ["unplugged", "silent"])
def test_one_that_is_lost_is_said_and_stop_never_raises(drive, drum, fault):
    drive.start(50.0)
    reads(drive, 0.1)
    if fault == "unplugged":
        drum.unplug()
    else:
        drum.silent = True
    with pytest.raises(DeviceError, match="lost"):
        reads(drive, GONE_S)
    drive.stop()


def test_one_that_is_not_there_or_never_answers_is_refused(kind, drum):
    with pytest.raises(InputError, match="a serial port that is plugged in and free"):
        drive_of(drum, kind[1], port="/dev/ttyNONE9").open()
    drum.silent = True
    with pytest.raises(InputError, match=r"answers|speaks as"):
        drive_of(drum, kind[1]).open()


def test_it_turns_the_other_way(kind, drum):
    if not hasattr(drive_of(drum, kind[1]).options, "reversed"):
        pytest.skip("it has but one way")
    with drive_of(drum, kind[1], reversed=True) as drive:
        drive.start(50.0)
        assert until(lambda: abs(drive.read().speed_mm_s - 50) < 7)
        assert until(lambda: drive.read() and abs(drum.now()[1] + 50) < 7)


@pytest.mark.parametrize("name", WATCHED)
def test_a_drive_with_a_watchdog_stops_when_it_hears_nothing(name):
    if name == "dynamixel":
        pytest.importorskip("dynamixel_sdk", reason="the extra 'dynamixel' is not there")
    make, table = KINDS[name]
    with make() as drum, drive_of(drum, table) as drive:
        if getattr(drive, "_guard", None) is not None:
            drive._guard.close()  # so that nothing but the drive itself can stop it
        drive.start(50.0)
        reads(drive, 0.2)
        assert until(stands(drum))
        assert drive.read().fault is not None
        drive.start(50.0)
        assert drive.read().fault is None


KILLED = """
import sys, time
from afferents.lab.devices import DRIVES, make_device
from afferents.lab.devices.drives import guard
guard.PATIENCE_S = {patience_s}
with make_device(DRIVES, {table!r}, "[drive]") as drive:
    drive.start(50.0)
    while drive.read().speed_mm_s < 40:
        time.sleep(0.01)
    print("turning", flush=True)
    {then}
"""


@pytest.mark.parametrize("ending", ["kill", "hang", "terminate", "exit"])
def test_a_drum_never_goes_on_without_this_program(ending):
    """On a drive without a watchdog; a process beside ours stops it where we can't."""
    then = {"hang": "time.sleep(60)", "exit": "sys.exit()"}.get(
        ending, "[(drive.read(), time.sleep(0.01)) for _ in range(9999)]"
    )
    with SimpleFoc() as drum:
        table = KINDS["simplefoc"][1] | {"port": drum.port}
        # One that hangs is found out by its silence; of the others only their end may stop it.
        patience_s = 3 if ending == "hang" else 30
        code = KILLED.format(table=table, then=then, patience_s=patience_s)
        if ending == "terminate":
            code = "from afferents.stopping import *\nstop_on_signals()" + code
        process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
        assert process.stdout.readline() == b"turning\n"
        if ending in ("kill", "terminate"):
            assert drum.now()[1] > 30
            process.send_signal(signal.SIGKILL if ending == "kill" else signal.SIGTERM)
        assert until(stands(drum))
        process.kill()
        process.wait()
        process.stdout.close()


def test_a_question_asked_again_is_answered_at_its_own_time(monkeypatch):
    with Slack(slack=60) as drum, drive_of(drum, KINDS["arduino"][1]) as drive:
        drive.start(100.0)
        assert until(lambda: drive.read() and drum.now()[1] > 90)
        answer, unheard, answered_s = drum.answer, ["state", "state"], []

        def answer_late(text):
            if text in unheard:
                return unheard.pop() and None
            answered_s.append(time.monotonic())
            return answer(text)

        monkeypatch.setattr(drum, "answer", answer_late)
        said = drive.read()
        after_s = time.monotonic()
        assert not unheard
        # In the middle between the last question and its answer, however long these took.
        off_s = abs(said.time_s - answered_s[-1])
        assert off_s <= (after_s - drive._line.sent_s) / 2


def test_a_drum_turned_by_hand_knows_nothing():
    with make_device(DRIVES, {"kind": "none"}, "[drive]") as drive:
        assert isinstance(drive, ByHand)
        drive.start(50.0)
        state = drive.read()
        assert state[1:] == (None, None, None)
        drive.stop()


def test_a_dynamixel_is_asked_again_when_its_answer_is_damaged():
    pytest.importorskip("dynamixel_sdk", reason="the extra 'dynamixel' is not there")
    with Dynamixel(slack=60) as drum, drive_of(drum, KINDS["dynamixel"][1]) as drive:
        drive.start(50.0)
        for _ in range(10):
            drum.damaged = 2
            before, now, after = drum.now()[0], drive.read().position_mm, drum.now()[0]
            assert before - 0.1 <= now <= after + 0.1
        drum.fail("overload")
        assert drive.read().fault == "overload"
        drive._port.is_using = True  # as a signal in the middle of a packet leaves it
        drive.stop()
        assert drum.drum.aim_mm_s == 0
