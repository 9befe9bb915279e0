"""Frames per second of the reference tracker, and of one-to-one linking.

    python benchmarks/reference_tracker.py [--frames 60] [--repeats 5]

Both run on drawn frames in memory (640 x 480, 19 x 19 discs that move by 2 px a frame at most),
so decoding is not counted. One thread. Prints a markdown table with the machine's name.
"""

import argparse
import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import NamedTuple

import cv2
import numpy as np
import scipy

from afferents.core.recording import GreyImage
from afferents.markers import Method, Sensor, Tracker, detect, load_sensor

RADIUS = 6.3
"""Area 125 px^2, in the middle of what the published detector takes."""


def draw_frames(n_frames: int) -> tuple[list[GreyImage], np.ndarray]:
    """Draw frames of a sliding skin; return them and the markers' rest positions (361, 2)."""
    x, y = np.meshgrid(320 + 22.0 * np.arange(-9, 10), 240 + 22.0 * np.arange(-9, 10))
    rest = np.stack([x.ravel(), y.ravel()], axis=1)
    frames = []
    for index in range(n_frames):
        image = np.full((480, 640), 25, dtype=np.uint8)
        shift = 4 * np.sin(0.5 * index + rest[:, :1] / 60)
        for centre in np.rint((rest + shift) * 256).astype(int):
            cv2.circle(image, centre, round(RADIUS * 256), 220, -1, cv2.LINE_AA, shift=8)
        frames.append(image)
    return frames, rest


def follow(frames: list[GreyImage], rest: np.ndarray, sensor: Sensor, method: Method) -> None:
    """Track all frames once."""
    tracker = Tracker(sensor, rest, method)
    for frame in frames:
        tracker.step(frame)


class Run(NamedTuple):
    """What one run took: time by the clock, and time of the processor (less when it is shared)."""

    clock_s: float
    processor_s: float


def measure(work: Callable[[], object]) -> Run:
    """Time one run."""
    clock_s, processor_s = time.perf_counter(), time.process_time()
    work()
    return Run(time.perf_counter() - clock_s, time.process_time() - processor_s)


def processor() -> str:
    """Name the processor, or its architecture where the system does not say."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.is_file() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=5)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    frames, rest = draw_frames(arguments.frames)
    sensor = load_sensor("tip_b")
    methods: dict[str, Callable[[], object]] = {
        "blob detector alone": lambda: [detect(frame, sensor) for frame in frames],
        "published (blob detector + nearest neighbour)": lambda: follow(
            frames, rest, sensor, "published"
        ),
        "one-to-one (blob detector + assignment)": lambda: follow(
            frames, rest, sensor, "one-to-one"
        ),
    }
    # Interleaved, so that a busy moment of the machine does not fall on one method alone.
    runs: dict[str, list[Run]] = {name: [] for name in methods}
    for _ in range(arguments.repeats):
        for name, work in methods.items():
            runs[name].append(measure(work))
    print(
        f"{processor()}, {os.cpu_count()} cores (1 thread used), {platform.system()}, "
        f"Python {platform.python_version()}, OpenCV {cv2.__version__}, "
        f"NumPy {np.__version__}, SciPy {scipy.__version__}"
    )
    print(f"{len(frames)} frames of 640 x 480 px, {len(rest)} markers, {arguments.repeats} runs\n")
    print("| method | frames/s (median) | least | most | processor ms/frame (median) |")
    print("|---|---|---|---|---|")
    for name, taken in runs.items():
        rates = [len(frames) / run.clock_s for run in taken]
        processor_ms = 1e3 * median(run.processor_s for run in taken) / len(frames)
        speeds = f"{median(rates):.0f} | {min(rates):.0f} | {max(rates):.0f}"
        print(f"| {name} | {speeds} | {processor_ms:.1f} |")


if __name__ == "__main__":
    main()
