"""Claims of the paper on the rig, and what its skin does at slow slides.

    python studies/rig_experiments.py

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.

Nodules amplify vibration; a light touch shows the pattern; below 20 mm/s the skin sticks and slips
as a whole; how SA-I and RA-I grow with speed. Physics, projection and the noise of the markers;
some minutes on one core. Prints markdown.
"""

import numpy as np
import rig_measures as measure
from score_rig import SECONDS, changed, images

from afferents.rig import STEADY_S, Rig, bumped_surface
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.run import simulate_run

SPACINGS, SPEEDS, SEEDS = (0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0), (20.0, 50.0, 100.0), range(3)
WAYS = {
    "as the paper: 1 mm, nodules": [],
    "nodules off": ["skin.nodular=false"],
    "0.4 mm": ["mounting.indentation_mm=0.4"],
    "0.4 mm, nodules off": ["mounting.indentation_mm=0.4", "skin.nodular=false"],
}

FRICTIONS = {
    "as it is": [],
    "friction twice as great": ["skin.friction=1.36"],
}


def loudness(rig: Rig, spacing_mm: float) -> float:
    """Return the root mean square of the steady vibration, mean over speeds and seeds."""
    surface = bumped_surface(spacing_mm, rig.drum)
    quiet = rig.with_nuisances({"start-angle": 1.0, "eccentricity": 0.15, "going-back": 1.0})
    found = [
        simulate_run(quiet, f"{spacing_mm:g}", surface, v, STEADY_S + 3, seed)
        .sensor[round(STEADY_S * SAMPLE_RATE_HZ) :]
        .std()
        for v in SPEEDS
        for seed in SEEDS
    ]
    return float(np.mean(found))


def pattern(rig: Rig, spacing_mm: float) -> tuple[float, float]:
    """Return how far the pattern stands out of SA-I and RA-I, mean over speeds and seeds."""
    runs = [images(rig, spacing_mm, v, seed) for v in SPEEDS for seed in SEEDS]
    slow, rapid = zip(*runs, strict=True)
    return tuple(
        float(np.mean([measure.moving_contrast(one, max(spacing_mm, 3.0)) for one in half]))
        for half in (slow, rapid)
    )  # type: ignore[return-value]


def jerk(rig: Rig, spacing_mm: float, speed: float) -> float:
    """Return how far the whole skin moves from frame to frame, um: its 99th percentile."""
    surface, start = bumped_surface(spacing_mm, rig.drum), round(STEADY_S * rig.camera.fps_hz)
    runs = [
        simulate_run(rig, f"{spacing_mm:g}", surface, speed, STEADY_S + SECONDS, seed)
        for seed in SEEDS
    ]
    moved = [np.diff(run.position_mm[start:].mean(axis=1), axis=0) for run in runs]
    return float(1000 * np.mean([np.percentile(np.linalg.norm(m, axis=-1), 99) for m in moved]))


def growth(rig: Rig, spacing_mm: float) -> tuple[float, float]:
    """Return the powers of speed that mean SA-I and RA-I grow with, from 20 to 100 mm/s."""
    speeds = (20.0, 40.0, 60.0, 80.0, 100.0)
    means = [
        [float(half.mean()) for seed in SEEDS for half in images(rig, spacing_mm, v, seed)]
        for v in speeds
    ]
    of_each = np.log(np.reshape(means, (len(speeds), len(SEEDS), 2)).mean(axis=1))
    slow, rapid = np.polyfit(np.log(speeds), of_each, 1)[0]
    return float(slow), float(rapid)


def main() -> None:
    """Print the tables."""
    print(
        "| root mean square of the vibration | " + " | ".join(f"{x:g} mm" for x in SPACINGS) + " |"
    )
    print("|---" * (len(SPACINGS) + 1) + "|")
    for name, words in WAYS.items():
        rig = changed(words)
        found = [loudness(rig, x) for x in SPACINGS]
        print(
            f"| {name} | " + " | ".join(f"{1000 * value:.1f}" for value in found) + " |", flush=True
        )
    print(
        f"\n| pattern in SA-I, RA-I ({SECONDS:g} s a run) | 3 mm | 4 mm | 6 mm |\n|---|---|---|---|"
    )
    for name, words in WAYS.items():
        rig = changed(words)
        cells = [", ".join(f"{v:.1f}" for v in pattern(rig, x)) for x in (3.0, 4.0, 6.0)]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    slow = (10.0, 15.0, 20.0, 30.0, 50.0, 100.0)
    head = " | ".join(f"{v:g} mm/s" for v in slow)
    print(f"\n| the whole skin from frame to frame, um | {head} |\n" + "|---" * 7 + "|")
    for name, words in FRICTIONS.items():
        rig = changed(words)
        for spacing_mm in (0.0, 3.0, 6.0):
            cells = [f"{jerk(rig, spacing_mm, v):.1f}" for v in slow]
            print(f"| {name}, {spacing_mm:g} mm | " + " | ".join(cells) + " |", flush=True)
    head = " | ".join(f"{x:g} mm" for x in SPACINGS)
    print(f"\n| SA-I and RA-I grow with speed to the power | {head} |\n{'|---' * 8}|")
    noiseless = changed(["camera.marker_noise_px=0"])
    for name, rig in (("as it is", Rig()), ("without noise of the markers", noiseless)):
        cells = ["{:.2f}, {:.2f}".format(*growth(rig, x)) for x in SPACINGS]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
