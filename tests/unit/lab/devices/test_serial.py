"""Serial drives on a bad line, drums that stall or fail, and templates that make no sense."""

import numpy as np
import pytest
from dialects import ODrive
from simulated_drum import SimulatedDrum, until

from afferents.errors import InputError
from afferents.lab.devices import SerialDrive
from afferents.lab.devices.base import SpeedFromPosition
from afferents.lab.devices.drives.serial_drive import frame_line, read_template, unframe_line

pytestmark = pytest.mark.system  # devices keep real time

pytest.importorskip("serial", reason="pyserial (extra 'lab') is not there")
pytest.importorskip("pty", reason="no pseudo-terminals here")


def drive_at(drum, template="arduino", **more):
    return SerialDrive(SerialDrive.Options(port=drum.port, template=template, **more))


def test_lost_bytes_never_become_wrong_numbers():
    """One byte in 300 is lost, either way: questions are asked again, and none is misread."""
    with SimulatedDrum(lost=1 / 300, seed=3) as drum, drive_at(drum) as drive:
        drive.start(50.0)
        for _ in range(40):
            before, state, after = drum.now()[0], drive.read(), drum.now()[0]
            assert before - 0.01 <= state.position_mm <= after + 0.01
        assert len(drum.lines) > 41  # what was lost was sent again


def test_a_port_is_ours_alone():
    with SimulatedDrum() as drum, drive_at(drum), pytest.raises(InputError, match="and free"):
        drive_at(drum).open()


def test_speed_is_the_slope_of_the_positions():
    """Counts of 0.073 mm at 100 readings a second: 2% at 10 mm/s, not one count a reading."""
    measured = SpeedFromPosition()
    times = np.arange(0, 2, 0.01)
    counted = np.floor(10 * times / 0.073) * 0.073
    speeds = [measured.read(t, p) for t, p in zip(times, counted, strict=True)]
    np.testing.assert_allclose(speeds[50:], 10, rtol=0.03)


def test_checksums_are_the_published_ones_and_a_crc_finds_two_like_bytes_lost():
    assert frame_line("f 0", "xor") == b"f 0*118\n"  # as ODrive has it
    assert frame_line("123456789", "crc16") == b"123456789*12739\n"
    assert unframe_line(b"f 0*118\r\n", "xor") == "f 0"
    assert unframe_line(b"f 1*118\r\n", "xor") is unframe_line(b"f 0\n", "xor") is None
    assert unframe_line(b"f 0\n", "none") == "f 0"
    sent, came = "state 36.4517 49.584 ok", "state 36.517 49.58 ok"
    for checksum, found in (("xor", came), ("crc16", None)):
        end = frame_line(sent, checksum).partition(b"*")[2]
        assert unframe_line(came.encode() + b"*" + end, checksum) == found


WHOLE = """
name = "mine"
start = ["go {value}"]
stop = ["halt"]
read = [{ send = "?", reply = '(?P<position>.*)' }]
"""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("go {value}", "go"), "start must have {value}"),
        (("P<position>", "P<place>"), "a group 'position'"),
        (("(?P", "((?P"), "a valid regular expression"),
        (('stop = ["halt"]', ""), "the key 'stop'"),
        (('name = "mine"', 'name = "mine"\nunit = "count"'), "counts_a_turn goes with"),
        (('name = "mine"', 'name = "mine"\nstrat = 1'), "the unknown key 'strat'"),
    ],
)
def test_a_template_that_makes_no_sense_is_refused(tmp_path, change, said):
    path = tmp_path / "mine.toml"
    path.write_text(WHOLE)
    assert read_template(str(path)).name == "mine"
    path.write_text(WHOLE.replace(*change))
    with pytest.raises(InputError, match=r"mine\.toml") as caught:
        read_template(str(path))
    assert said in str(caught.value)


def test_what_a_plan_says_wrongly_is_refused_before_anything_moves():
    with pytest.raises(InputError, match=r"one of arduino.*found 'odrv'"):
        SerialDrive(SerialDrive.Options(port="/dev/x", template="odrv"))
    with pytest.raises(InputError, match="diameter_mm, since ODrive"):
        SerialDrive(SerialDrive.Options(port="/dev/x", template="odrive"))
    with pytest.raises(InputError, match="highest_mm_s above lowest_mm_s"):
        SerialDrive(SerialDrive.Options(port="/x", template="arduino", lowest_mm_s=300.0))


@pytest.mark.parametrize(
    ("unit", "mm"), [("turn", 100 * np.pi), ("rad", 50.0), ("deg", np.pi / 3.6), ("mm", 1.0)]
)
def test_units_become_mm_of_the_drum_s_surface(unit, mm):
    template = read_template("arduino").model_copy(update={"unit": unit})
    gear = 1.0 if unit == "mm" else 2.0
    assert template.mm_a_unit(100.0 * gear, gear) == pytest.approx(mm)


def test_a_drive_that_does_not_say_so_is_told_its_speed_again():
    """Of a line that loses a byte in 200 the one that starts it may be lost, or the stop."""
    for seed in range(5):
        with ODrive(slack=60, lost=1 / 200, seed=seed) as drum:
            with drive_at(drum, "odrive", diameter_mm=95.0) as drive:
                drive.start(50.0)
                assert until(lambda drive=drive, drum=drum: drive.read() and drum.now()[1] > 15)
            assert until(lambda drum=drum: drum.drum.aim_mm_s == 0)
