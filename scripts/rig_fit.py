"""Fit constants of the rig to the published figures: a random search, in minutes.

    python scripts/rig_fit.py images --seconds 600 --out constants.json
    python scripts/rig_fit.py spectra --start constants.json --seconds 600 --out constants.json

What is fitted: SA-I and RA-I of a at 50 and of g at 10 and 100 mm/s, and the spectra of a and g at
20, 50 and 100 mm/s. SA-I and RA-I of g at 50 mm/s and the spectra at 40 and 80 mm/s are kept from
it (`rig_quickly.py --test` shows them). Accuracies are never looked at. The constants that it ends
with are rounded and written into the rig by hand.
"""

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import rig_measures as measure
from numpy.typing import NDArray
from rig_quickly import HELD_OUT_IMAGES, IMAGES, PUBLISHED, changed, heard, images

from afferents.rig import Rig

Terms = list[float]
SPEEDS = (100, 50, 20)
SMALL = 5e-4
"""Amplitudes below this share of the loudest line are level with the pictures' resolution."""
MOST = 4.0
"""No figure counts for more than this many tolerances."""
IN_IMAGES = {
    "skin.shear_mn_mm": (0.1, 3), "skin.coupling_mn_mm": (0.3, 12),
    "skin.static_friction": (0.3, 1.5), "skin.kinetic_friction": (0.2, 1.2),
    "skin.stribeck_mm_s": (2, 60), "skin.spread_mm": (0.1, 5),
    "skin.pin_depth_mm": (1, 4), "skin.pin_unequal": (0.02, 0.3),
    "skin.relaxing_share": (0.1, 1.2), "skin.relaxation_s": (0.01, 0.1),
    "skin.recess_mm": (0.01, 0.4), "skin.tip_radius_mm": (15, 200), "drum.patch_sd_mm": (0.02, 0.3),
    "drum.patch_mm": (1.2, 8), "drum.print_sd_mm": (0.01, 0.12),
    "camera.marker_noise_px": (0.02, 0.3), "camera.marker_unequal": (0.05, 0.6),
    "drive.eccentricity_mm": (0.05, 0.8), "drive.back_mm": (0.02, 1),
    "mounting.camera_mm": (15, 150),
}  # fmt: skip
IN_SPECTRA = {
    "microphone.depth_mm": (0.5, 10), "microphone.shear_share": (0.02, 3),
    "microphone.low_hz": (0.5, 10), "microphone.high_hz": (20, 200),
    "microphone.corner_hz": (0.5, 100), "microphone.motor": (1e-4, 0.02),
    "microphone.mains": (1e-5, 0.003), "microphone.noise": (1e-4, 0.03),
    "skin.bridging_per_mm": (1, 20), "drum.bump_ratio": (0.3, 0.7), "skin.footprint_mm": (0.8, 2.4),
}  # fmt: skip
"""Between what the search keeps a constant."""


LOAD_TOLERANCES = {
    "swing": 0.3, "likeness": 0.04, "spot": 0.15, "spot_at": 1.0, "crescent": 0.25,
    "crescent_at": 1.0, "edge": 0.15,
}  # fmt: skip
"""Of what `rig_measures.load_pattern` says of the smooth drum."""


def of_images(rig: Rig) -> Terms:
    """Return how far the rig's tactile images are from the published ones, in tolerances."""
    archive = np.load(PUBLISHED / "tactile_images.npz", allow_pickle=False)
    terms: Terms = []
    smooth: dict[str, tuple[float, float]] = {}
    for texture, spacing, speed in IMAGES:
        if (texture, speed) in HELD_OUT_IMAGES:
            continue
        runs = [images(rig, spacing, speed, seed) for seed in range(4)]
        for half, afferent in enumerate(("SA", "RA")):
            ours = [measure.statistics(g) for run in runs for g in measure.groups(run[half])]
            mine = {key: float(np.mean([one[key] for one in ours])) for key in ours[0]}
            theirs = measure.statistics(measure.published_images(archive, afferent, texture, speed))
            first = smooth.setdefault(afferent, (mine["mean"], theirs["mean"]))
            growth = math.log(mine["mean"] / first[0] / (theirs["mean"] / first[1]))
            terms += [(mine[k] - theirs[k]) / by for k, by in
                      (("apart", 0.12), ("pin_1", 0.1), ("pin_3", 0.15))]  # fmt: skip
            terms += [math.log(mine[k] / theirs[k]) / 0.3 for k in ("sd", "sd_time")]
            # One recording's SA-I says little of the mean over recordings.
            terms.append(growth / (0.5 if afferent == "SA" else 0.2))
            if not spacing and afferent == "SA":
                found = measure.load_pattern(
                    measure.published_images(archive, "SA", texture, speed)
                )
                groups = [measure.load_pattern(g) for run in runs for g in measure.groups(run[0])]
                terms += [
                    (float(np.mean([g[key] for g in groups])) - found[key]) / by
                    for key, by in LOAD_TOLERANCES.items()
                ]
            if spacing:
                pattern = np.mean([measure.moving_contrast(run[half], draws=25) for run in runs])
                terms.append(3 * max(0.0, float(pattern) - (3 if afferent == "SA" else 1.3)))
    return terms


def of_spectra(rig: Rig) -> Terms:
    """Return how far the rig's spectra are from the published ones, in tolerances."""
    panels = json.loads((PUBLISHED / "spectra.json").read_text(encoding="utf-8"))["panels"]
    published = {
        (p["spacing_mm"], p["speed_true_mm_s"]): np.array([p["intensity"]]) for p in panels.values()
    }
    terms: Terms = []
    scales: dict[str, float] = {}
    for speed in SPEEDS:
        g, a = (
            np.concatenate([heard(rig, x, speed, seed) for seed in range(2)]) for x in (3.0, 0.0)
        )
        first_hz = rig.drum.periods(3.0) * speed / (math.pi * 80)
        mine = _loudness(g, a, first_hz, "rig", scales)
        theirs = _loudness(
            published[3.0, speed], published[0.0, speed], first_hz, "published", scales
        )
        tolerance = [0.25] * 4 + [0.6] * 2 + [0.4] * 8 + [0.2, 0.25]
        terms += [(x - y) / by for x, y, by in zip(mine, theirs, tolerance, strict=True)]
    return terms


def _loudness(
    g: NDArray[np.float64],
    a: NDArray[np.float64],
    first_hz: float,
    name: str,
    scales: dict[str, float],
) -> Terms:
    """Return lines, clarity, and logarithms of what g and a amount to in bands."""
    top = float(np.median(g.max(axis=1)))
    scale = scales.setdefault(name, top)
    high, least = float(np.median(g[:, 9:].max(axis=1))), SMALL * scale
    shares = [
        top / np.median(a.max(axis=1)),
        high / np.median(a[:, 9:].max(axis=1)),
        *(
            (np.median(g[:, low:high_hz]) + least) / scale
            for low, high_hz in ((20, 60), (80, 140), (200, 300), (1, 8))
        ),
        (np.median(a[:, 1:8]) + least) / scale,
        (np.mean(a[:, 20:150]) + least) / scale,
        top / scale,
        high / scale,
    ]
    clear = [math.log(measure.clarity(g, first_hz, k)) for k in (1, 2)]
    return [*measure.weights(g, first_hz), *clear, *(math.log(share) for share in shares)]


PARTS = {"images": (of_images, IN_IMAGES), "spectra": (of_spectra, IN_SPECTRA)}


def main() -> None:
    """Change a few constants at a time, and keep what comes nearer."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--start", type=Path)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--set", nargs="*", default=[], help="section.name=value, kept")
    parser.add_argument("--out", type=Path, default=Path("constants.json"))
    words = parser.parse_args()
    figures, space = PARTS[words.part]
    rng, step, until = np.random.default_rng(words.seed), 0.35, time.monotonic() + words.seconds

    def distance(constants: dict[str, Any]) -> float:
        if constants.get("skin.kinetic_friction", 0) > constants.get("skin.static_friction", 9):
            return math.inf
        rig = changed([*words.set, *(f"{name}={value}" for name, value in constants.items())])
        return sum(min(abs(term), MOST) ** 2 for term in figures(rig))

    usual = {name: rig_constant(name) for name in space}
    best = {**usual, **(json.loads(words.start.read_text()) if words.start else {})}
    nearest = distance(best)
    print(f"{nearest:.1f}", flush=True)
    while time.monotonic() < until:
        tried = dict(best)
        for name in rng.choice(list(space), size=rng.integers(1, 4), replace=False):
            tried[name] = float(np.clip(best[name] * math.exp(rng.normal(0, step)), *space[name]))
        found = distance(tried)
        if found < nearest:
            best, nearest = tried, found
            print(f"{nearest:.1f}", flush=True)
            words.out.write_text(json.dumps(best, indent=1), encoding="utf-8")
        else:
            step = max(0.08, step * 0.99)


def rig_constant(name: str) -> float:
    """Return a constant of the rig as it is."""
    section, _, field = name.partition(".")
    return float(getattr(getattr(Rig(), section), field))


if __name__ == "__main__":
    main()
