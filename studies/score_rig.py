"""Score the rig by every published figure, beside how far one run of it is from its others.

    python studies/score_rig.py [--set skin.shear_mn_mm=1 ...] [--seeds 16] [--worst 12] [--parts]

It needs insides of the package, and was last run at the commit that froze the rig's constants.

The score is the sum of squared log ratios of the rig's figures to the published ones (of
correlations the squared differences of Fisher's z), over spectra, SA-I and RA-I apart. Constants
are fitted to spectra at 20, 50, 100 mm/s, images of g at 10 and 100 mm/s and of a at 50 mm/s; held
out are spectra at 40 and 80 mm/s and images of g at 50 mm/s. A published panel is one window of 1 s
or ten images of one run. So the floor, what one run's panels score against the mean of the other
runs, is as near as the paper could come to a rig that is true: below it there is noise.

Physics, projection and the noise of filmed markers, without video: some 10 s a seed on one core.
Each seed has drums of its own. `--worst` prints the figures that score most; `--parts` scores the
rig with each part of its physics taken away, or put back as it was.
"""

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rig_measures as measure
from here import DATA
from numpy.typing import NDArray
from results_pages import write

from afferents.encodings.spectra import amplitude_spectrum
from afferents.rig import STEADY_S, Drum, Rig, Surface, bumped_surface
from afferents.rig.microphone import SAMPLE_RATE_HZ, RigMicrophone
from afferents.rig.record import filmed_positions
from afferents.rig.run import simulate_run

PUBLISHED = Path(__file__).parent / "published"
KEPT = DATA / "rig-score.json"
COMMANDS = ["git switch --detach 16e4e76f; python studies/score_rig.py", "git switch main"]
COMMANDS += ["python studies/score_rig.py --parts"]
IMAGES = (("a", 0.0, 50), ("g", 3.0, 10), ("g", 3.0, 50), ("g", 3.0, 100))
SPEEDS = (20, 40, 50, 80, 100)
HELD_OUT = {
    ("SA-I", "g", 50),
    ("RA-I", "g", 50),
    *(("spectra", x, v) for x in "ag" for v in (40, 80)),
}
KINDS = ("spectra", "SA-I", "RA-I")
CORRELATIONS = ("apart", "pin_1", "pin_3")
PARTS = {
    "without patches of friction on bumps": ["drum.grip_sd=0"],
    "with the printing errors of before": ["drum.print_sd_mm=0.037", "drum.patch_sd_mm=0.15"],
    "with friction by the cube root of the share (one smooth cap)": ["share"],
    "as stiff in its plane as before": [
        "skin.shear_mn_mm=1.5",
        "skin.coupling_mn_mm=11.7",
        "skin.spread_mm=2.5",
        "skin.tip_radius_mm=59",
    ],
    "as little damped in its plane as before": ["skin.damping_ratio=0.6"],
    "off the drum at rest": ["mounting.contact_at_rest=false"],
    "with the run-out of before": ["drive.eccentricity_mm=0.27"],
    "with a microphone that hears vertical stress": ["stress"],
}
"""What stands for each part in `changed`; two words for what is no constant."""
SECONDS = 5.0
REST_FRAME = 10
JPEG_PX = 0.03
"""By how much coding moves a tracked marker (rms), beside the camera's own noise."""

Values = NDArray[np.float64]
Panel = tuple[str, str, int]
"""Which figure of the paper: spectra, SA-I or RA-I; drum; speed in mm/s."""
Run = dict[Panel, list[Any]]
"""Of each panel: spectra (400,) of windows of 1 s, or the figures of groups of ten images."""
PANELS = [(kind, x, v) for kind in KINDS[1:] for x, _, v in IMAGES]
PANELS += [("spectra", x, v) for v in SPEEDS for x in "ag"]


class Vertical(RigMicrophone):
    """One that hears the vertical stress, h^3 / (r^2 + h^2)^(5/2), not the mean one."""

    def weights(self, rest_mm: Values) -> Values:
        """Return how loudly each node sounds."""
        weight = super().weights(rest_mm) ** (5 / 3)
        return np.asarray(weight / weight.sum())


def surface_of(spacing_mm: float, drum: Drum, words: Sequence[str]) -> Surface:
    """Return a drum's surface; with `share` its friction goes with the cube root of the share."""
    surface = bumped_surface(spacing_mm, drum)
    share = surface.contact_share ** (3 if "share" in words else 1)  # of which the ninth root goes
    return replace(surface, contact_share=share)


def changed(words: Sequence[str]) -> Rig:
    """Return the rig with constants of `section.name=value`."""
    constants: dict[str, Any] = Rig().model_dump()
    if "stress" in words:
        return Rig().model_copy(update={"microphone": Vertical()})
    for word in set(words) - {"share"}:
        path, _, value = word.partition("=")
        section, _, name = path.partition(".")
        constants[section][name] = json.loads(value)
    return Rig.model_validate(constants)


def images(
    rig: Rig, spacing_mm: float, speed: float, seed: int, words: Sequence[str] = ()
) -> tuple[Values, Values]:
    """Return SA-I and RA-I of the steady part, (frame, row, column), px."""
    surface, name = surface_of(spacing_mm, rig.drum, words), f"{spacing_mm:g}"
    run = simulate_run(rig, name, surface, speed, STEADY_S + SECONDS, seed)
    noise_px = float(np.hypot(rig.camera.marker_noise_px, JPEG_PX))
    camera = rig.camera.model_copy(update={"marker_noise_px": noise_px})
    noisy = rig.model_copy(update={"camera": camera})
    seen = filmed_positions(noisy, run.position_mm, name, speed, seed)
    slow = np.linalg.norm(seen - seen[REST_FRAME], axis=-1).reshape(-1, 19, 19)
    rapid = np.abs(np.diff(slow, axis=0, prepend=slow[:1]))
    steady = round(STEADY_S * rig.camera.fps_hz)
    return slow[steady:], rapid[steady:]


def heard(
    rig: Rig, spacing_mm: float, speed: float, seed: int, words: Sequence[str] = ()
) -> Values:
    """Return the spectra of four windows of 1 s, (4, 400)."""
    surface = surface_of(spacing_mm, rig.drum, words)
    run = simulate_run(rig, f"{spacing_mm:g}", surface, speed, STEADY_S + 4, seed)
    steady = run.sensor[-4 * SAMPLE_RATE_HZ :].reshape(4, -1)
    return np.asarray(amplitude_spectrum(steady, SAMPLE_RATE_HZ, 400), float)


def published() -> Run:
    """Return what the paper printed: one window and ten images a panel."""
    archive = np.load(PUBLISHED / "tactile_images.npz", allow_pickle=False)
    spectra = json.loads((PUBLISHED / "spectra.json").read_text(encoding="utf-8"))["panels"]
    found: Run = {
        (f"{afferent}-I", x, v): [
            figures_of_images(measure.published_images(archive, afferent, x, v))
        ]
        for afferent in ("SA", "RA")
        for x, _, v in IMAGES
    }
    for panel in spectra.values():
        key = ("spectra", panel["texture"], panel["speed_true_mm_s"])
        found[key] = [np.array(panel["intensity"], float)]
    return found


def simulated(words: Sequence[str], seed: int) -> Run:
    """Return what a changed rig shows and lets hear of the same panels, in one session."""
    rig, found = changed(words).printed(seed), {}
    for x, spacing, v in IMAGES:
        halves = images(rig, spacing, v, seed, words)
        for kind, half in zip(KINDS[1:], halves, strict=True):
            found[kind, x, v] = [figures_of_images(group) for group in measure.groups(half)]
    for v in SPEEDS:
        for x, spacing in (("a", 0.0), ("g", 3.0)):
            found["spectra", x, v] = list(heard(rig, spacing, v, seed, words))
    return found


def figures(runs: Sequence[Run]) -> dict[tuple[Panel, str], float]:
    """Return every figure of some runs: medians over windows, means over groups of images."""
    pooled = {panel: [one for run in runs for one in run[panel]] for panel in PANELS}
    found: dict[tuple[Panel, str], float] = {}
    for panel in PANELS:
        kind, x, v = panel
        if kind != "spectra":
            for name in pooled[panel][0]:
                found[panel, name] = float(np.mean([one[name] for one in pooled[panel]]))
        elif x == "g":
            g, a = (np.array(pooled["spectra", drum, v]) for drum in "ga")
            loudest = np.median(np.max(pooled["spectra", "g", 100], axis=1))
            found |= {
                (panel, name): value for name, value in figures_of_spectra(g, a, v, loudest).items()
            }
    for kind in KINDS[1:]:  # displacements of the paper have no unit: all over the smooth drum's
        smooth = found[(kind, "a", 50), "mean"]
        for _, x, v in (panel for panel in PANELS if panel[0] == kind):
            found[(kind, x, v), "mean"] /= smooth
    return found


def figures_of_images(group: Values) -> dict[str, float]:
    """Return the figures of ten images 20 frames apart, and how far the pattern stands out."""
    pattern = float(np.mean(measure.contrast(group - group.mean(axis=0))))
    return {**measure.statistics(group), "pattern": pattern}


def figures_of_spectra(g: Values, a: Values, speed: int, loudest: float) -> dict[str, float]:
    """Return the figures of windows of g, (window, 400), some of them beside those of a."""
    first_hz = Rig().drum.rate_hz(3.0, speed)
    return {
        **{f"k = {k}": float(w) for k, w in enumerate(measure.weights(g, first_hz), 1)},
        **{f"clear {k}": measure.clarity(g, first_hz, k) for k in (1, 2)},
        "g over a": float(np.median(g.max(axis=1)) / np.median(a.max(axis=1))),
        "above 8 Hz": float(np.median(g[:, 9:].max(axis=1)) / np.median(a[:, 9:].max(axis=1))),
        "loudest": float(np.median(g.max(axis=1)) / loudest),
        "20 to 60 Hz": float(np.median(g[:, 20:60]) / loudest),
    }  # fmt: skip


def squares(
    one: dict[tuple[Panel, str], float], other: dict[tuple[Panel, str], float]
) -> dict[tuple[Panel, str], float]:
    """Return how far two sets of figures lie apart, figure by figure."""
    return {
        key: float(
            (np.arctanh(value) - np.arctanh(other[key])) ** 2
            if key[1] in CORRELATIONS
            else np.log(value / other[key]) ** 2
        )
        for key, value in one.items()
    }


def sums(found: dict[tuple[Panel, str], float]) -> Values:
    """Return the score, (fit and held out, kind)."""
    total = np.zeros((2, len(KINDS)))
    for (panel, _), value in found.items():
        total[int(panel in HELD_OUT), KINDS.index(panel[0])] += value
    return total


def floor(runs: Sequence[Run]) -> Values:
    """Return what a window and a group of each run score against all other runs, in the mean."""
    of_each = []
    for i, run in enumerate(runs):
        panels = {panel: values[:1] for panel, values in run.items()}
        others = figures([*runs[:i], *runs[i + 1 :]])
        of_each.append(sums(squares(figures([panels]), others)))
    return np.asarray(np.mean(of_each, axis=0))


def cells(total: Values) -> list[str]:
    """Return a row's cells: the three kinds and their sum, of the fit and held out."""
    return [f"{', '.join(f'{value:.2g}' for value in half)} ({half.sum():.1f})" for half in total]


def score(
    words: Sequence[str], seeds: Sequence[int], theirs: dict[tuple[Panel, str], float]
) -> tuple[list[Run], dict[tuple[Panel, str], float]]:
    """Return runs of a changed rig, and how far each of its figures lies from the published."""
    with ProcessPoolExecutor() as pool:
        runs = list(pool.map(partial(simulated, words), seeds))
    return runs, squares(figures(runs), theirs)


def main() -> None:
    """Simulate, score and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--set", nargs="*", default=[])
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--first", type=int, default=16)
    parser.add_argument("--worst", type=int, default=0)
    parser.add_argument("--parts", action="store_true")
    words = parser.parse_args()
    seeds = range(words.first, words.first + words.seeds)
    columns = ["rig", *(f"{half}: {', '.join(KINDS)} (sum)" for half in ("fit", "held out"))]
    theirs = figures([published()])
    runs, apart = score(words.set, seeds, theirs)
    mine = figures(runs)
    rows = [["as it is", *cells(sums(apart))], ["floor: one run of it", *cells(floor(runs))]]
    for name, part in PARTS.items() if words.parts else ():
        rows.append([name, *cells(sums(score(part, seeds, theirs)[1]))])
    for row in [columns, *rows]:
        print(" | ".join(row))
    if words.parts:
        before = json.loads(KEPT.read_text())["rows"][:2]  # of the rig before, at its commit
        write(KEPT, "The rig's score", COMMANDS, columns, [*before, *rows])
    for key in sorted(apart, key=apart.__getitem__, reverse=True)[: words.worst]:
        (kind, x, v), name = key
        half = "held out" if key[0] in HELD_OUT else "fit"
        print(f"{kind} {x} {v} {name}: rig {mine[key]:.2f}, published {theirs[key]:.2f} ({half})")


if __name__ == "__main__":
    main()
