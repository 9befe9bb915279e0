"""Marker tracking against the rig's truth: speed beside decoding, errors, memory.

    python benchmarks/tracking.py [--rounds 5] [--seconds 30]

All on one core (the process is bound to it) but for the last table. Prints markdown.
"""

import argparse
import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from statistics import median

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.choices import Method
from afferents.markers.sensor import load_sensor
from afferents.markers.track import Tracker, track_markers
from afferents.parallel import side_by_side
from afferents.recordings.video import open_video
from afferents.rig import Rig, RigCamera, bumped_surface, project
from afferents.rig.camera import Renderer
from afferents.rig.run import simulate_run
from afferents.store.recording import Frame, GreyImage

TIP_B = load_sensor("tip_b")
REST = TIP_B.rest_frame
RATES_MB_S = (1.2, 2.0, 15.0)
PRESETS = ("medium", "ultrafast")
"""Of x264: its default, and the one that is the cheapest to encode and to decode."""
SHOWN_FRAMES = 40
"""Frames that the published method is timed on."""
JUDGED_FRAMES = 720
"""Frames that errors are taken from."""

Positions = NDArray[np.float64]


@dataclass
class Drawn:
    """Frames drawn when asked for; a `core.recording.Video`."""

    position: Positions
    camera: RigCamera = field(default_factory=RigCamera)
    path: Path = Path("drawn")
    fps_hz: float = 90.0
    width: int = 640
    height: int = 480

    def frames(self) -> Iterator[Frame]:
        """Draw from the start."""
        renderer = Renderer(self.camera, 0)
        for index, place in enumerate(self.position):
            yield Frame(index / self.fps_hz, np.asarray(renderer.draw(place), np.uint8))


def slid(seconds: float) -> Positions:
    """Return the marker positions of a run of g at 50 mm/s, px."""
    rig = Rig()
    run = simulate_run(rig, "3", bumped_surface(3.0), 50.0, seconds, 0)
    return project(run.position_mm, rig.camera)


def film(path: Path, position: Positions, rate: float, preset: str) -> Path:
    """Write the run as an H.264 video of so many Mb/s."""
    camera = RigCamera(noise_grey=2.0 if rate < 10 else 6.0)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=90, options={"preset": preset})
        stream.width, stream.height, stream.pix_fmt = camera.width, camera.height, "yuv420p"
        stream.bit_rate = round(rate * 1e6)
        for frame in Drawn(position, camera).frames():
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame.luma, format="gray")))
        container.mux(stream.encode(None))
    return path


def decode(path: Path) -> None:
    """Decode a video and look at nothing."""
    with av.open(str(path)) as container:
        container.streams.video[0].thread_type = "NONE"
        for _ in container.decode(video=0):
            pass


def seconds(work: Callable[[], object]) -> float:
    """Time one call."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def follow(images: list[GreyImage], rest: Positions, method: Method) -> Positions:
    """Track images in memory, of which the first shows `rest`; return positions from the next."""
    tracker = Tracker(TIP_B, rest, method, images[0])
    return np.stack([tracker.step(image).position for image in images[1:]])


def rms(error: Positions) -> float:
    """Return the root mean square distance, px."""
    return float(np.sqrt((error**2).sum(axis=-1).mean()))


def speed_and_error(folder: Path, position: Positions, rounds: int) -> None:
    """Print frames a second of the whole path beside decoding, and errors on the same frames."""
    columns = (
        "x264",
        "Mb/s",
        "decoding alone, frames/s",
        "whole path, frames/s",
        "whole path over decoding",
        "published method, frames/s",
        "times the published",
        "error, px",
        "error of the published, px",
    )
    print(f"\n| {' | '.join(columns)} |\n{'|---' * len(columns)}|")
    n = len(position)
    for preset in PRESETS:
        for rate in RATES_MB_S:
            path = film(folder / f"{preset}_{rate}.mp4", position, rate, preset)
            images = [f.image for f in islice(open_video(path).frames(), REST, JUDGED_FRAMES)]
            truth = position[REST + 1 : JUDGED_FRAMES]
            ours, theirs = (
                follow(images, position[REST], method) for method in ("windowed", "published")
            )
            some = images[:SHOWN_FRAMES]
            alone, whole, published = [], [], []
            for _ in range(rounds):
                alone.append(n / seconds(lambda p=path: decode(p)))
                whole.append(n / seconds(lambda p=path: track_markers(open_video(p), TIP_B)))
                spent = seconds(lambda s=some: follow(s, position[REST], "published"))
                published.append(1 / (spent / (len(some) - 1) + 1 / alone[-1]))
            ratio = median(w / a for w, a in zip(whole, alone, strict=True))
            times = median(w / p for w, p in zip(whole, published, strict=True))
            print(f"| {preset} | {path.stat().st_size * 8e-6 / n * 90:.1f} | {median(alone):.0f} | "
                  f"{median(whole):.0f} | {ratio:.2f} | {median(published):.0f} | {times:.0f} | "
                  f"{rms(ours - truth):.3f} | {rms(theirs - truth):.3f} |", flush=True)  # fmt: skip
    plain = Drawn(position[:JUDGED_FRAMES], RigCamera(noise_grey=0, blur_px=0, falloff=0))
    found = track_markers(plain, TIP_B)[dims.POSITION].values[REST:]
    print(f"\nUncompressed, without nuisances: {rms(found - plain.position[REST:]):.3f} px.")


def steps(position: Positions) -> None:
    """Print how long a step takes, and how memory grows."""
    images = [frame.luma for frame in Drawn(position[:JUDGED_FRAMES]).frames()]
    tracker = Tracker(TIP_B, position[REST], "windowed", images[REST])
    spent = []
    for image in images[REST + 1 :]:
        start = time.perf_counter()
        tracker.step(image)
        spent.append(time.perf_counter() - start)
    low, high = np.quantile(spent, [0.5, 0.99]) * 1e3
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for n in range(90 * 3600):
        tracker.step(images[REST + 1 + n % (len(images) - REST - 1)])
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(f"\nA step: median {low:.3f} ms, p99 {high:.3f} ms. An hour of frames (324,000 steps): "
          f"{grown:.1f} MB more.")  # fmt: skip


def _track_file(path: Path) -> float:
    track_markers(open_video(path), TIP_B)
    return 0.0


def workers(folder: Path, rounds: int, cores: set[int]) -> None:
    """Print how much faster two processes on two cores are than one."""
    if len(cores) < 2:
        return
    jobs = [(folder / "medium_2.0.mp4",)] * 8
    os.sched_setaffinity(0, cores)
    spent: dict[int, list[float]] = {1: [], 2: []}
    list(side_by_side(_track_file, jobs[:2], 2))
    for _ in range(rounds):
        for n in (1, 2):
            spent[n].append(seconds(lambda k=n: list(side_by_side(_track_file, jobs, k))))
    gain = median(a / b for a, b in zip(spent[1], spent[2], strict=True))
    print(f"\nTwo workers on two cores: {gain:.2f} times one.")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=30.0)
    wanted = parser.parse_args()
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        position = slid(wanted.seconds)
        speed_and_error(Path(folder), position, wanted.rounds)
        steps(position)
        workers(Path(folder), wanted.rounds, cores)


if __name__ == "__main__":
    main()
