"""How fast the rig is on one core: physics, sound, drawing, coding, a whole recording.

    python benchmarks/rig_speed.py [ROUNDS]

Every round simulates other drums and speeds; medians over rounds. Times are the
processor's, so that other work on the machine counts little.
"""

import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from afferents.doctor import processor
from afferents.rig import Rig, bumped_surface, draw as draw_run, project, record
from afferents.rig.camera import Points, Renderer
from afferents.rig.drive import turn
from afferents.rig.record import write_film
from afferents.rig.run import press, simulate_run
from afferents.rig.skin import PHYSICS_RATE_HZ
from afferents.store.recording import GreyImage

SECONDS = 8.0
N_IMAGES = 90
RUNS = ((0.0, 50.0), (3.0, 10.0), (3.0, 100.0), (0.5, 70.0), (6.0, 40.0))


def timed(work: Callable[..., Any], *arguments: object) -> tuple[float, Any]:
    """Return how many times faster than real time work is, and what it returns."""
    start = time.process_time()
    result = work(*arguments)
    return SECONDS / (time.process_time() - start), result


def draw(renderer: Renderer, place_px: Points) -> None:
    """Draw all frames of a run."""
    for frame in place_px:
        renderer.draw(frame)


def code(path: Path, rig: Rig, time_s: Points, images: list[GreyImage]) -> None:
    """Write the video, of a few frames again and again."""
    write_film(path, zip(time_s, cycle(images), strict=False), rig.camera)


def measure(spacing_mm: float, speed_mm_s: float, seed: int, folder: Path) -> dict[str, float]:
    """Return how many times faster than real time each part of a recording is."""
    rig, name, surface = Rig(), f"{spacing_mm:g}", bumped_surface(spacing_mm)
    run_of = (name, surface, speed_mm_s, SECONDS, seed)
    whole, run = timed(simulate_run, rig, *run_of)
    drawn = draw_run(rig, name, speed_mm_s, seed)
    turning = turn(
        speed_mm_s, SECONDS, rig.drive, rig.drum.diameter_mm / 2, 0.0, drawn.run_out_mm, False,
        PHYSICS_RATE_HZ, np.random.default_rng(seed),
    )  # fmt: skip
    physics, _ = timed(press, rig, drawn, surface, turning, run.time_s)
    place, renderer = project(run.position_mm, rig.camera), Renderer(rig.camera, seed)
    images = [renderer.draw(p) for p in place[-N_IMAGES:]]
    return {
        "physics": physics,
        "physics and sound": whole,
        "drawing": timed(draw, renderer, place)[0],
        "coding": timed(code, folder / "a.mp4", rig, run.time_s, images)[0],
        "a whole recording": timed(record, rig, folder / "run", *run_of)[0],
    }


def main(rounds: int) -> None:
    """Measure and print."""
    simulate_run(Rig(), "3", bumped_surface(3.0), 50.0, 1.6, 0)  # compiles
    found = []
    for n in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            found.append(measure(*RUNS[n % len(RUNS)], n, Path(folder)))
    print(f"{processor()}, one core, median of {rounds}")
    for what in found[0]:
        print(f"{what:18} {statistics.median(f[what] for f in found):5.1f} x real time")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5)
