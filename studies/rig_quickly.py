"""Set the rig beside the published figures without filming it, in a minute or so on one core.

    python studies/rig_quickly.py [--set skin.coupling_mn_mm=4 ...] [--images] [--spectra] [--test]

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.

Physics, projection and the noise of the markers, for the conditions that constants are fitted to
(spectra at 20, 50, 100 mm/s; images of g at 10 and 100 mm/s and of a at 50 mm/s); with --test also
those kept from the fit (40 and 80 mm/s; g at 50 mm/s).
"""

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import rig_measures as measure
from numpy.typing import NDArray

from afferents.encodings.spectra import amplitude_spectrum
from afferents.rig import STEADY_S, Rig, bumped_surface
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.record import filmed_positions
from afferents.rig.run import simulate_run

PUBLISHED = Path(__file__).parent / "published"
IMAGES = (("a", 0.0, 50), ("g", 3.0, 10), ("g", 3.0, 50), ("g", 3.0, 100))
HELD_OUT_IMAGES, HELD_OUT_SPECTRA = {("g", 50)}, {40, 80}
SECONDS = 5.0
REST_FRAME = 10

Values = NDArray[np.float64]


def changed(words: list[str]) -> Rig:
    """Return the rig with constants of `section.name=value`."""
    constants: dict[str, Any] = Rig().model_dump()
    for word in words:
        path, _, value = word.partition("=")
        section, _, name = path.partition(".")
        constants[section][name] = json.loads(value)
    return Rig.model_validate(constants)


def images(rig: Rig, spacing_mm: float, speed: float, seed: int) -> tuple[Values, Values]:
    """Return SA-I and RA-I of the steady part, (frame, row, column), px."""
    surface = bumped_surface(spacing_mm, rig.drum)
    name = f"{spacing_mm:g}"
    run = simulate_run(rig, name, surface, speed, STEADY_S + SECONDS, seed)
    seen = filmed_positions(rig, run.position_mm, name, speed, seed)
    slow = np.linalg.norm(seen - seen[REST_FRAME], axis=-1).reshape(-1, 19, 19)
    rapid = np.abs(np.diff(slow, axis=0, prepend=slow[:1]))
    steady = round(STEADY_S * rig.camera.fps_hz)
    return slow[steady:], rapid[steady:]


def heard(rig: Rig, spacing_mm: float, speed: float, seed: int) -> Values:
    """Return the spectra of four windows of 1 s, (4, 400)."""
    surface = bumped_surface(spacing_mm, rig.drum)
    run = simulate_run(rig, f"{spacing_mm:g}", surface, speed, STEADY_S + 4, seed)
    steady = run.sensor[-4 * SAMPLE_RATE_HZ :].reshape(4, -1)
    return np.asarray(amplitude_spectrum(steady, SAMPLE_RATE_HZ, 400), float)


def show_images(rig: Rig, seeds: range, test: bool) -> None:
    """Print the published images' figures above the rig's."""
    archive = np.load(PUBLISHED / "tactile_images.npz", allow_pickle=False)
    smooth: dict[tuple[str, str], float] = {}
    print("            pattern  next pin  3 pins  20 frames  sd   sd time  mean (a 50 = 1)")
    for texture, spacing, speed in IMAGES:
        if (texture, speed) in HELD_OUT_IMAGES and not test:
            continue
        runs = [images(rig, spacing, speed, seed) for seed in seeds]
        for half, afferent in enumerate(("SA", "RA")):
            theirs = measure.published_images(archive, afferent, texture, speed)
            mine = [group for run in runs for group in measure.groups(run[half])]
            still = theirs - theirs.mean(axis=0)
            rows = {
                "paper": (float(np.mean(measure.contrast(still))), measure.statistics(theirs)),
                "rig": (
                    float(np.mean([measure.moving_contrast(run[half]) for run in runs])),
                    {
                        key: float(np.mean([measure.statistics(group)[key] for group in mine]))
                        for key in measure.statistics(theirs)
                    },
                ),
            }
            for name, (pattern, found) in rows.items():
                first = smooth.setdefault((name, afferent), found["mean"])
                print(
                    f"{afferent} {texture} {speed:3d} {name:5s} {pattern:6.1f}"
                    f" {found['pin_1']:7.2f}"
                    f" {found['pin_3']:8.2f} {found['apart']:8.2f} {found['sd']:8.2f}"
                    f" {found['sd_time']:6.2f} {found['mean'] / first:8.2f}"
                    f"   {found['mean']:6.3f} {'px' if name == 'rig' else ''}"
                )


def show_spectra(rig: Rig, seeds: range, test: bool) -> None:
    """Print the published spectra's figures above the rig's."""
    panels = json.loads((PUBLISHED / "spectra.json").read_text(encoding="utf-8"))["panels"]
    of = {
        (p["spacing_mm"], p["speed_true_mm_s"]): np.array([p["intensity"]]) for p in panels.values()
    }
    print(
        "         k = 1 : 2 : 3 : 4        clear 1, 2   g/a  above 8 Hz  loudest  floor 20-60"
        "  300-400"
    )
    speeds = [v for v in (100, 80, 50, 40, 20) if test or v not in HELD_OUT_SPECTRA]
    loudest: dict[str, float] = {}
    for speed in speeds:
        mine = [np.concatenate([heard(rig, x, speed, s) for s in seeds]) for x in (3.0, 0.0)]
        for name, (g, a) in (("paper", (of[3.0, speed], of[0.0, speed])), ("rig", mine)):
            first = rig.drum.rate_hz(3.0, speed)
            top = float(np.median(g.max(axis=1)))
            scale = loudest.setdefault(name, top)
            weight = " : ".join(f"{w:.2f}" for w in measure.weights(g, first))
            clear = ", ".join(f"{measure.clarity(g, first, k):4.1f}" for k in (1, 2))
            ratio = [
                np.median(g[:, b:].max(axis=1)) / np.median(a[:, b:].max(axis=1)) for b in (0, 9)
            ]
            print(
                f"{speed:3d} {name:5s} {weight}  {clear}  {ratio[0]:5.1f} {ratio[1]:8.1f}"
                f" {top / scale:10.2f} {np.median(g[:, 20:60]) / scale:11.4f}"
                f" {np.median(g[:, 300:]) / scale:9.4f}"
            )


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--set", nargs="*", default=[])
    parser.add_argument("--images", action="store_true")
    parser.add_argument("--spectra", action="store_true")
    parser.add_argument("--test", action="store_true")
    parser.add_argument("--seeds", type=int, default=2)
    words = parser.parse_args()
    rig, seeds, start = changed(words.set), range(words.seeds), time.perf_counter()
    if words.images or not words.spectra:
        show_images(rig, seeds, words.test)
    if words.spectra or not words.images:
        show_spectra(rig, seeds, words.test)
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
