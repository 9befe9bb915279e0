"""What recording costs: processor share, the delay of a frame to the file, and memory.

    python benchmarks/recording.py [SECONDS] [--page]
    python benchmarks/recording.py --hours HOURS

Camera, microphone and drive are simulated, in their own time; their film is drawn before. With
`--hours` they give so many hours' worth of frames and blocks, in one run, as fast as they can be
written; pictures are small then (32 x 24), since none is kept in memory. With `--page` what the
page shows is drawn up all the time, as for a visitor.
"""

import argparse
import resource
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from afferents.lab.devices import (
    Block,
    ByHand,
    Camera,
    CameraSettings,
    Frame,
    Microphone,
    MicrophoneSettings,
)
from afferents.lab.recorder.devices import Clock, Devices, open_devices
from afferents.lab.recorder.page import RecordingPage
from afferents.lab.recorder.plan import RecordingPlan, read_plan
from afferents.lab.recorder.rehearsal import Bench, simulate_devices
from afferents.lab.recorder.run import Run
from afferents.lab.recorder.watch import Watch
from afferents.markers.sensor import load_sensor
from afferents.rig import Rig

PLAN = """
textures = ["4"]
speeds_mm_s = [60]
seconds = {seconds}
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", nargs="?", type=float, default=20.0)
    parser.add_argument("--hours", type=float)
    parser.add_argument("--page", action="store_true")
    asked = parser.parse_args()
    if asked.hours:
        long_run(asked.hours)
    else:
        short_run(asked.seconds, asked.page)


def short_run(seconds: float, with_page: bool) -> None:
    """Record one run in its own time and print what it cost."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "PLAN.toml")
        path.write_text(PLAN.format(seconds=seconds))
        plan = read_plan(path)
        bench = Bench(Rig(), plan, speed=1)
        bench.mount(plan.entries()[0], 1)
        folder = Path(place, "run")
        folder.mkdir()
        devices = simulate_devices(plan, path, bench)
        with open_devices(devices, plan, path):
            watch, over = Watch(), threading.Event()
            watch.open(devices, plan, folder, 0, 1)
            page = RecordingPage(watch, load_sensor("tip_b"))
            before, begun, begun_s = _kib(), time.process_time(), time.monotonic()
            if with_page:
                threading.Thread(target=look_on, args=(page, over), daemon=True).start()
            log = Run(devices, plan, folder, 60.0, watch).make()
            over.set()
            share = (time.process_time() - begun) / (time.monotonic() - begun_s)
        delay = np.array([row.written_s - row.time_s for row in log.frames]) * 1000
        jpeg = np.mean([len(data) for data in bench.film.jpegs]) / 1024
        print(f"{len(log.frames)} frames of {jpeg:.0f} KiB, processor share {share:.1%} of a core")
        print(
            f"delay of a frame to the file: median {np.median(delay):.2f} ms, "
            f"99% {np.quantile(delay, 0.99):.2f} ms, largest {delay.max():.2f} ms"
        )
        print(f"memory grew by {(_kib() - before) / 1024:.1f} MiB")


def look_on(page: RecordingPage, over: threading.Event) -> None:
    """Ask for the newest as often as a visitor is sent it."""
    while not over.wait(0.05):
        page.newest()


class FrameClock(Clock):
    """Goes on by a ninetieth of a second with each frame that is given."""

    def __init__(self) -> None:
        """Begin at 0."""
        super().__init__(speed=100.0)
        self.frames = 0

    def now(self) -> float:
        """Return the time, s."""
        return self.frames / 90


class QuickCamera(Camera):
    """Small pictures without end; waits while too many wait for the disk."""

    def __init__(self, clock: FrameClock) -> None:
        """Draw two pictures."""
        self._clock, self._ended = clock, threading.Event()
        self.waiting = lambda: 0
        self.settings = CameraSettings("quick", "MJPG", 32, 24, 90.0)
        grey = (np.full((24, 32), level, np.uint8) for level in (60, 180))
        self._jpegs = [cv2.imencode(".jpg", image)[1].tobytes() for image in grey]

    def open(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Let `frames` end."""
        self._ended.set()

    def frames(self) -> Iterator[Frame]:
        """Yield pictures."""
        number = 0
        while not self._ended.is_set():
            if number % 50 == 0:
                time.sleep(0.0005)
            while self.waiting() > 500 and not self._ended.is_set():
                time.sleep(0.001)
            yield Frame(number, number / 90, False, self._jpegs[number % 2])
            number += 1
            self._clock.frames = number


class QuickMicrophone(Microphone):
    """Noise without end, 8 kHz of its clock, 100 blocks a second."""

    def __init__(self, clock: FrameClock) -> None:
        """Draw a block."""
        self._clock, self._ended = clock, threading.Event()
        self.settings = MicrophoneSettings("quick", 8000.0, 1)
        self._block = np.random.default_rng(0).integers(-999, 999, (80, 1), dtype=np.int16)

    def open(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def end(self) -> None:
        """Let `blocks` end."""
        self._ended.set()

    def blocks(self) -> Iterator[Block]:
        """Yield blocks, each when its time has come."""
        zero_s, number = self._clock.now(), 0
        while not self._ended.is_set():
            due = int((self._clock.now() - zero_s) * 100)
            while number < due:
                yield Block(zero_s + number / 100, self._block, False)
                number += 1
            time.sleep(0.002)


def long_run(hours: float) -> None:
    """Record one run of so many hours' worth; print how memory grew."""
    tables = {"camera": {"kind": "v4l2"}, "microphone": {"kind": "portaudio"}}
    plan = RecordingPlan(textures=("4",), speeds_mm_s=(60.0,), seconds=3600 * hours, **tables)
    clock = FrameClock()
    camera = QuickCamera(clock)
    drive = ByHand(ByHand.Options())
    drive.open()
    devices = Devices(camera, QuickMicrophone(clock), drive, clock)
    with tempfile.TemporaryDirectory() as place:
        before, begun_s, over = _kib(), time.monotonic(), threading.Event()
        run = Run(devices, plan, Path(place), 60.0)
        camera.waiting = run._waiting.qsize
        grown: list[tuple[int, float]] = []

        def watch() -> None:
            while not over.wait(5):
                grown.append((len(run.log.frames), (_kib() - before) / 1024))

        watching = threading.Thread(target=watch, daemon=True)
        watching.start()
        log = run.make()
        over.set()
        print(f"{hours:g} h of frames and sound in {time.monotonic() - begun_s:.0f} s")
        for at in (0.1, 0.25, 0.5, 0.75, 0.9):
            n, mib = min(grown, key=lambda row: abs(row[0] - at * len(log.frames)))
            print(f"after {n} frames: {mib:.0f} MiB more")
        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        lost = log.frames[-1].sequence - log.frames[0].sequence + 1 - len(log.frames)
        print(f"{len(log.frames)} frames, {len(log.blocks)} blocks, {len(log.drive)} drive rows")
        print(f"{lost} lost; at most {most:.0f} MiB in all, tables written")


def _kib() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1024


if __name__ == "__main__":
    main()
