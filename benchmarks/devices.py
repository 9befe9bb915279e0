"""What the devices cost and how true they are, on stand-ins: no hardware is measured here.

    python benchmarks/devices.py

Camera: the driver of the tests (built with gcc and preloaded) gives JPEGs of 640 x 480 at 90
frames/s; each is read, checked and counted. Drive: a simulated drum behind a pseudo-terminal is
read 50 times a second, and a program that turns it is killed.
"""

import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from afferents.lab.devices import SerialDrive, V4l2Camera

STAND_INS = Path(__file__).parents[1] / "tests" / "unit" / "lab" / "devices"
sys.path.append(str(STAND_INS))

from simulated_drum import Drum, SimulatedDrum  # noqa: E402

FAKE = STAND_INS / "fake_v4l2.c"
SECONDS = 20.0
KILLS = 20
TURNING = """
from afferents.lab.devices import *
with SerialDrive(SerialDrive.Options(port={port!r}, template="arduino")) as drive:
    drive.start(50.0)
    print("turning", flush=True)
    while True:
        drive.read()
"""


def write_film(path: Path) -> int:
    """Write noisy JPEGs as the driver reads them; return the mean size of one."""
    rng = np.random.default_rng(0)
    coded = []
    for _ in range(30):
        picture = cv2.blur(rng.integers(0, 256, (480, 640), np.uint8), (3, 3))
        coded.append(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes())
    path.write_bytes(b"".join(len(data).to_bytes(4, "little") + data for data in coded))
    return sum(map(len, coded)) // len(coded)


def camera(film: str) -> None:
    """Read the preloaded driver for some time; print what it costs."""
    options = V4l2Camera.Options(device=f"/x/fakecam/video0?paced=1&film={film}")
    with V4l2Camera(options) as opened:
        numbers, times_s, delays_s = [], [], []
        begin_s, begin_cpu_s = time.monotonic(), time.process_time()
        for frame in opened.frames():
            delays_s.append(time.monotonic() - frame.time_s)
            numbers.append(frame.sequence)
            times_s.append(frame.time_s)
            if time.monotonic() - begin_s > SECONDS:
                opened.end()
    share = (time.process_time() - begin_cpu_s) / (time.monotonic() - begin_s)
    n = numbers[-1] - numbers[0]
    rate_hz, lost = n / (times_s[-1] - times_s[0]), n + 1 - len(numbers)
    print(f"camera: {len(numbers)} frames at {rate_hz:.3f} Hz, {lost} lost")
    print(f"  {share:.1%} of a core (the stand-in's own work included)")
    worst = np.percentile(delays_s, [50, 99, 100]) * 1e3
    print("  from capture to us, ms: median {:.2f}, 99% {:.2f}, largest {:.2f}".format(*worst))
    print(f"  memory at most {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB")


def drive() -> None:
    """Read a drum that turns; print how true it is, and how long it takes."""
    with SimulatedDrum(Drum(ripple=0.02)) as drum:
        options = SerialDrive.Options(port=drum.port, template="arduino")
        with SerialDrive(options) as opened:
            opened.start(50.0)
            errors_mm, took_s, begin_s = [], [], time.monotonic()
            while time.monotonic() - begin_s < SECONDS / 2:
                before_mm, asked_s = drum.now()[0], time.monotonic()
                state = opened.read()
                took_s.append(time.monotonic() - asked_s)
                middle_mm = (before_mm + drum.now()[0]) / 2
                errors_mm.append(state.position_mm - middle_mm)
                time.sleep(0.02)
    print(f"drive: read in {np.median(took_s) * 1e3:.1f} ms, at most {max(took_s) * 1e3:.1f} ms")
    rms = float(np.sqrt(np.mean(np.square(errors_mm))))
    print(
        f"  position at 50 mm/s off by {rms:.3f} mm (rms), {np.max(np.abs(errors_mm)):.3f} at most"
    )


def kills() -> None:
    """Kill a program that turns a drum without a watchdog; print how long it goes on."""
    took_s = []
    for _ in range(KILLS):
        with SimulatedDrum(Drum(watchdog_s=float("inf"))) as drum:
            program = [sys.executable, "-c", TURNING.format(port=drum.port)]
            process = subprocess.Popen(program, stdout=subprocess.PIPE)
            process.stdout.readline()
            time.sleep(0.2)
            process.send_signal(signal.SIGKILL)
            begin_s = time.monotonic()
            process.wait()
            while drum.drum.aim_mm_s != 0 and time.monotonic() - begin_s < 5:
                time.sleep(0.001)
            took_s.append(time.monotonic() - begin_s)
            process.stdout.close()
    print(f"kill -9: of {KILLS}, stopped after {np.median(took_s) * 1e3:.0f} ms, "
          f"at most {max(took_s) * 1e3:.0f} ms")  # fmt: skip


def main() -> None:
    """Measure all."""
    if len(sys.argv) > 1:
        camera(sys.argv[1])
        return
    with tempfile.TemporaryDirectory() as folder:
        library, film = Path(folder) / "fake.so", Path(folder) / "film"
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", library, FAKE, "-ldl"], check=True)
        print(f"JPEGs of {write_film(film) / 1024:.0f} KiB")
        env = {**os.environ, "LD_PRELOAD": str(library)}
        subprocess.run([sys.executable, __file__, str(film)], env=env, check=True)
    drive()
    kills()


if __name__ == "__main__":
    main()
