"""The camera of Linux against a driver that is none: every fault at a known frame."""

import numpy as np
import pytest

pytestmark = pytest.mark.system

PATHS = {
    "good": "",
    "faults": "drop=3,7-9&damaged=5&torn=6&repeat=20&late=25",
    "unplug": "unplug=10",
    "noclock": "noclock=1",
    "slower": "fps=30",
}
REFUSED = {
    "busy": ("busy=1", {}, "close what else uses it"),
    "absent": ("absent=1", {}, "'afferents devices' lists"),
    "denied": ("denied=1", {}, "group 'video'"),
    "metadata": ("metadata=1", {}, "a second file for metadata"),
    "no jpeg": ("formats=GREY", {}, "expected one that gives MJPG, found only GREY"),
    "takes raw": ("raw=1", {}, "YUYV of 640 x 480 px, which it took instead"),
    "size": ("", {"width": 1000}, "640 x 480 px, which it took instead"),
    "exposure": ("", {"exposure_ms": 900.0}, "500, which it took instead (it takes 1 to 500)"),
    "automatic": ("stubborn=1", {}, "a refusal: Input/output error; switch it off otherwise, or"),
    "no gain": ("nocontrols=1", {"gain": 3}, "one that has no such control; leave out gain"),
}


@pytest.fixture(scope="module")
def seen(with_driver):
    """What each camera gave; one process for all."""
    asked = {name: f"/x/fakecam/video0?{path}" for name, path in PATHS.items()}
    refused = {name: (f"/x/fakecam/video0?{p}", more) for name, (p, more, _) in REFUSED.items()}
    return with_driver(f"""
found = {{name: run(path) for name, path in {asked!r}.items()}}
found |= {{name: run(path, **more) for name, (path, more) in {refused!r}.items()}}
found["set"] = run("/x/fakecam/video0", 1, exposure_ms=5.0, gain=40, white_balance_k=5000)
found["auto"] = run("/x/fakecam/video0?formats=GREY,YUYV", 1, format="auto")
found["own"] = run("/x/fakecam/video0", 1, width=None, height=None, fps_hz=None, format="auto")
found["no rates"] = run("/x/fakecam/video0?norates=1", 1)
found["unset"] = run("/x/fakecam/video0?nocontrols=1", 1)
print(json.dumps(found))
""")


def test_every_frame_has_the_driver_s_number_and_time(seen):
    number, time_s, damaged, size, torn = np.array(seen["good"]["frames"]).T
    np.testing.assert_array_equal(number, range(30))
    np.testing.assert_allclose(np.diff(time_s), 1 / 90, atol=2e-6)
    assert not damaged.any()
    assert not torn.any()
    assert size.min() > 10


@pytest.mark.parametrize(
    ("camera", "expected"),
    [
        ("good", {"format": "MJPG", "width": 640, "height": 480, "fps_hz": 90, "unknown": []}),
        ("noclock", {"unknown": ["when a frame was captured (the time is that of its arrival)"]}),
        ("slower", {"fps_hz": 30}),
        ("own", {"format": "MJPG", "width": 640, "height": 480, "fps_hz": 30}),
        ("auto", {"format": "GREY"}),
        ("unset", {"controls": {}}),
    ],
)
def test_what_a_camera_took_is_read_back(seen, camera, expected):
    settings = seen[camera]["settings"]
    assert {name: settings[name] for name in expected} == expected


def test_controls_are_set_and_what_a_camera_does_by_itself_is_switched_off(seen):
    by_itself = {"auto_exposure": 1, "exposure_dynamic_framerate": 0, "white_balance_automatic": 0}
    assert by_itself.items() <= seen["good"]["settings"]["controls"].items()
    asked = {"exposure_time_absolute": 50, "gain": 40, "white_balance_temperature": 5000}
    assert asked.items() <= seen["set"]["settings"]["controls"].items()
    assert seen["no rates"]["settings"]["fps_hz"] == 90  # as it was asked for


def test_faults_are_found_at_the_frames_where_they_are(seen):
    frames = seen["faults"]["frames"]
    numbers = [frame[0] for frame in frames]
    assert numbers == [n for n in range(34) if n not in (3, 7, 8, 9)]
    assert [frame[0] for frame in frames if frame[2]] == [5]
    assert [frame[0] for frame in frames if frame[4] and not frame[2]] == [6]
    intervals = np.diff([frame[1] for frame in frames]) / np.diff(numbers) * 90
    assert [numbers[n + 1] for n in np.flatnonzero(intervals > 1.5)] == [25]


def test_what_came_before_a_camera_is_unplugged_is_kept(seen):
    found = seen["unplug"]
    assert [frame[0] for frame in found["frames"]] == list(range(10))
    assert found["kind"] == "DeviceError"
    assert found["error"].endswith("lost (no such device); plug it in again")


def test_a_hundred_unplugs_lose_no_frame_and_leave_nothing_open(with_driver):
    found = with_driver("""
import os
from pathlib import Path
def held():
    buffers = Path("/proc/self/maps").read_text().count("/dev/zero")
    return len(os.listdir("/proc/self/fd")), buffers
before = held()
gone = [run(f"/x/fakecam/video0?unplug={n}", 999) for n in range(100)]
whole = [[frame[0] for frame in one["frames"]] == list(range(n)) for n, one in enumerate(gone)]
print(json.dumps([all(whole), {one["kind"] for one in gone} == {"DeviceError"}, before, held()]))
""")
    whole, said, before, after = found
    assert whole
    assert said
    assert before == after


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_in_a_sentence(seen, name):
    assert seen[name]["kind"] == "InputError"
    assert seen[name]["frames"] == []
    assert REFUSED[name][2] in seen[name]["error"]
    assert "\n" not in seen[name]["error"]


def test_it_ends_when_told_from_another_thread_and_streams_again(with_driver):
    found = with_driver("""
import threading
from afferents.lab.devices import V4l2Camera
path = "/x/fakecam/video0?stall=3"
def seen(camera):
    # Frames until another thread ends it, once three have come.
    three, found = threading.Event(), []
    def end():
        three.wait()
        camera.end()
    threading.Thread(target=end).start()
    for frame in camera.frames():
        found.append(frame.sequence)
        if len(found) == 3:
            threading.Timer(0.2, three.set).start()  # it is waiting for a fourth by then
    return found
with V4l2Camera(V4l2Camera.Options(device=path)) as camera:
    first, again = seen(camera), seen(camera)
camera.close()
print(json.dumps([first, again]))
""")
    assert found == [[0, 1, 2], [0, 1, 2]]


def test_live_feels_by_the_same_source(with_driver, jpegs):
    """JPEGs are asked for although raw pixels come first; a camera that comes back is used."""
    found = with_driver(f"""
from afferents.lab.live import Camera, CameraFrame
camera = Camera("/x/fakecam/video0?unplug=4&film={jpegs}", 90, 640, 480)
pictures, said = [], []
for event in camera.events():
    (pictures if isinstance(event, CameraFrame) else said).append(event)
    if len(pictures) == 6:
        camera.close()
print(json.dumps([camera._camera.settings.format, [int(p.frame.luma.mean()) for p in pictures],
                  [p.time_s for p in pictures], [s.what for s in said]]))
""")
    kind, grey, times, said = found
    assert kind == "MJPG"
    np.testing.assert_allclose(grey, [20, 40, 60, 80, 20, 40], atol=1)
    assert (np.diff(times) > 0).all()
    assert said == ["camera /x/fakecam/video0?unplug=4&film=" + str(jpegs)
                    + ": lost (no such device); plug it in again"]  # fmt: skip


def test_cameras_are_listed_with_their_formats_and_rates(with_driver, tmp_path):
    folder = tmp_path / "fakecam"
    folder.mkdir()
    for name in ("video0", "video1?denied=1", "video2?metadata=1"):
        (folder / name).touch()
    by_id = folder / "v4l" / "by-id"
    by_id.mkdir(parents=True)
    (by_id / "usb-A_camera-video-index0").symlink_to("../../video0")
    found = with_driver(f"""
from pathlib import Path
from dataclasses import asdict
from afferents.lab.devices import find_devices
print(json.dumps(asdict(find_devices(Path({str(folder)!r})))))
""")
    (camera,) = found["cameras"]
    assert camera["name"] == "A camera that is none"
    assert camera["lasting"] == str(by_id / "usb-A_camera-video-index0")
    assert ["MJPG", 640, 480, [90, 30]] in camera["modes"]
    assert ["YUYV", 320, 240, [60, 30]] in camera["modes"]
    notes = [note for note in found["notes"] if "fakecam" in note]
    assert len(notes) == 2
