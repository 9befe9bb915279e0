"""Set the rig beside the published spectra and tactile images, and predict those of drum m.

    python studies/calibrate_rig.py

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.

`studies/published` holds what was digitised of the paper's figures. Pictures go to
`studies/images`, numbers to `studies/data`, from which `python studies/here.py` draws the tables,
and a prediction for drum m, whose published panels were not measured, to
`studies/data/rig-predictions.json`. Takes minutes.
"""

import json
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rig_measures as measure
from here import DATA
from here import IMAGES as PICTURES
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray
from results_pages import write
from score_rig import IMAGES, PUBLISHED, heard

from afferents import dims
from afferents.channels import ra1, sa1
from afferents.markers.sensor import load_sensor
from afferents.markers.track import track_markers
from afferents.recordings.video import open_video
from afferents.reporting.style import SEQUENTIAL
from afferents.rig import STEADY_S, VIDEO, Rig, bumped_surface, record

RIG = Rig()
SPECTRA_MM_S = (20, 40, 50, 80, 100)
PREDICTED = ("m", 6.0, (10, 50, 100))
SEEDS, FILMED_SEEDS = range(6), range(3)
SPECTRA_COLUMNS = [
    "speed, mm/s", "of", "k = 1 : 2 : 3 : 4", "k = 1, 2 over what lies round it", "g over a",
    "above 8 Hz", "largest line, at 100 mm/s = 1",
]  # fmt: skip
IMAGE_COLUMNS = [
    "recording", "of", "20 frames apart", "sd / mean", "sd over time / mean", "1 pin apart",
    "3 pins apart", "mean, a at 50 mm/s = 1", "pattern",
]  # fmt: skip
FILMED_S = 7.0


class Panel(NamedTuple):
    """Spectra of one drum at one speed: shape (window, frequency), 1 Hz a bin."""

    spacing_mm: float
    speed_mm_s: int
    published: NDArray[np.float64]
    rig: NDArray[np.float64]

    @property
    def first_hz(self) -> float:
        """The drum's own rate."""
        return RIG.drum.rate_hz(self.spacing_mm, self.speed_mm_s)


def spectra(published: dict[str, Any]) -> list[Panel]:
    """Return one published window and all the rig's windows of each panel of Figure 12."""
    panels = []
    for panel in published["panels"].values():
        spacing, speed = panel["spacing_mm"], panel["speed_true_mm_s"]
        windows = [heard(RIG, spacing, speed, seed) for seed in SEEDS]
        panels.append(
            Panel(spacing, speed, np.array(panel["intensity"])[None], np.concatenate(windows))
        )
    return panels


def spectra_table(panels: list[Panel]) -> list[list[str]]:
    """Return the numbers of the spectra of g, and of g over a: a row a speed and origin."""
    of = {(p.spacing_mm, p.speed_mm_s): p for p in panels}
    rows = []
    for speed in SPECTRA_MM_S:
        g, a = of[3.0, speed], of[0.0, speed]
        for name in ("published", "rig"):
            mine, smooth = getattr(g, name), getattr(a, name)
            loudest = np.median(getattr(of[3.0, 100], name).max(axis=1))
            ratio = [
                np.median(mine[:, b:].max(axis=1)) / np.median(smooth[:, b:].max(axis=1))
                for b in (0, 9)
            ]
            cells = [
                f"{speed}" if name == "published" else "",
                name,
                " : ".join(f"{w:.2f}" for w in measure.weights(mine, g.first_hz)),
                ", ".join(f"{measure.clarity(mine, g.first_hz, k):.1f}" for k in (1, 2)),
                f"{ratio[0]:.0f}",
                f"{ratio[1]:.0f}",
                f"{np.median(mine.max(axis=1)) / loudest:.2f}",
            ]
            rows.append(cells)
    return rows


def draw_spectra(panels: list[Panel]) -> None:
    """Draw Figure 12's panels of a and g, published above the rig's first window."""
    figure = Figure(figsize=(13, 7.2), layout="constrained")
    axes = figure.subplots(4, 5, sharex=True)
    loudest = [
        max(np.median(getattr(p, name).max(axis=1)) for p in panels)
        for name in ("published", "rig")
    ]
    tops = {
        bumpy: max(
            float(values[0, :300].max() / top)
            for panel in panels
            if bool(panel.spacing_mm) == bumpy
            for values, top in zip((panel.published, panel.rig), loudest, strict=True)
        )
        for bumpy in (False, True)
    }
    for panel in panels:
        column = SPECTRA_MM_S.index(panel.speed_mm_s)
        first = 0 if panel.spacing_mm else 2
        for row, (name, values, top) in enumerate(
            (("published", panel.published[0], loudest[0]), ("rig", panel.rig[0], loudest[1]))
        ):
            axis = axes[first + row, column]
            colour = "#555555" if name == "published" else "#0072b2"
            axis.plot(np.arange(300), values[:300] / top, color=colour, linewidth=0.9)
            axis.set_ylim(0, 1.05 * tops[bool(panel.spacing_mm)])
            axis.spines[["top", "right"]].set_visible(False)
            if panel.spacing_mm:
                for k in (1, 2, 3, 4):
                    axis.axvline(k * panel.first_hz, color="#d55e00", linewidth=0.6, alpha=0.5)
            if column == 0:
                axis.set_ylabel(f"{'g' if panel.spacing_mm else 'a'}, {name}")
            if first + row == 0:
                axis.set_title(f"{panel.speed_mm_s} mm/s")
            if first + row == 3:
                axis.set_xlabel("frequency (Hz)")
    figure.suptitle(
        "One window's amplitude over the median of g's loudest line; orange: k f1, k = 1 to 4",
        ha="left",
        x=0.01,
    )
    figure.savefig(PICTURES / "rig-spectra.png", dpi=110)


class Images(NamedTuple):
    """SA-I and RA-I, shape (image, row, column): ten published, or every frame of the rig's."""

    slow: NDArray[np.float64]
    rapid: NDArray[np.float64]


def published_images(archive: Any, texture: str, speed: int) -> Images:
    """Return the ten published images; slides of paper and rig point the same way then."""
    return Images(
        *(measure.published_images(archive, name, texture, speed) for name in ("SA", "RA"))
    )


def filmed_images(spacing_mm: float, speed_mm_s: float, seed: int) -> Images:
    """Record, find blobs as published, and return the images of the steady part."""
    rig = RIG.printed(seed)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "run"
        surface = bumped_surface(spacing_mm, rig.drum)
        record(rig, target, f"{spacing_mm:g}", surface, speed_mm_s, STEADY_S + FILMED_S, seed)
        tracks = track_markers(open_video(target / VIDEO), load_sensor("tip_b"), "one-to-one")
    slow = sa1(tracks[dims.POSITION], tracks[dims.REST_POSITION])
    first = round(STEADY_S * 90)
    return Images(
        *(of.values[first:].reshape(-1, 19, 19).astype(float) for of in (slow, ra1(slow)))
    )


def figures_of(images: NDArray[np.float64]) -> dict[str, float]:
    """Return the figures of the rig's images: means over groups like the published ones."""
    groups = [measure.statistics(group) for group in measure.groups(images)]
    found = {name: float(np.mean([group[name] for group in groups])) for name in groups[0]}
    return {**found, "pattern": measure.moving_contrast(images)}


def image_table(published: list[Images], rig: list[list[Images]]) -> list[list[str]]:
    """Return the figures of the tactile images: a row a panel and origin."""
    rows = []
    for afferent, title in (("slow", "SA-I"), ("rapid", "RA-I")):
        first: dict[str, float] = {}
        for index, (texture, _, speed) in enumerate(IMAGES):
            theirs = getattr(published[index], afferent)
            mine = [figures_of(getattr(images, afferent)) for images in rig[index]]
            moving = theirs - theirs.mean(axis=0)
            found = {
                "published": {
                    **measure.statistics(theirs),
                    "pattern": float(np.mean(measure.contrast(moving))),
                },
                "rig": {name: float(np.mean([one[name] for one in mine])) for name in mine[0]},
            }
            for name, values in found.items():
                smooth = first.setdefault(name, values["mean"])
                shown = f"{title}, {texture}, {speed}" if name == "published" else ""
                rows.append(_row(shown, name, values, smooth))
    return rows


def _row(title: str, name: str, found: dict[str, float], smooth: float) -> list[str]:
    cells = [found[key] for key in ("apart", "sd", "sd_time", "pin_1", "pin_3")]
    shown = [f"{value:.2f}" for value in (*cells, found["mean"] / smooth)]
    return [title, name, *shown, f"{found['pattern']:.1f}"]


def predictions(smooth: list[Images]) -> dict[str, Any]:
    """Return what the rig says of a drum whose published panels have not been measured here."""
    letter, spacing, speeds = PREDICTED
    found: dict[str, Any] = {"texture": letter, "spacing_mm": spacing, "seeds": len(FILMED_SEEDS)}
    for speed in speeds:
        filmed = [filmed_images(spacing, speed, seed) for seed in FILMED_SEEDS]
        spectrum = np.concatenate([heard(RIG, spacing, speed, seed) for seed in SEEDS])
        first_hz = RIG.drum.rate_hz(spacing, speed)
        found[f"{speed} mm/s"] = {
            "first_hz": first_hz,
            "lines_1_to_4": [round(float(w), 3) for w in measure.weights(spectrum, first_hz)],
            **{
                name: _mean_figures(
                    [getattr(one, half) for one in filmed], [getattr(one, half) for one in smooth]
                )
                for name, half in (("SA-I", "slow"), ("RA-I", "rapid"))
            },
        }
    return found


def _mean_figures(
    filmed: list[NDArray[np.float64]], smooth: list[NDArray[np.float64]]
) -> dict[str, float]:
    mine = [figures_of(images) for images in filmed]
    found = {name: float(np.mean([one[name] for one in mine])) for name in mine[0]}
    found["mean"] /= float(np.mean([images.mean() for images in smooth]))
    return {name: round(value, 3) for name, value in found.items()}


def draw_images(published: list[Images], rig: list[list[Images]]) -> None:
    """Draw six images 20 frames apart of every group, published above the rig's."""
    figure = Figure(figsize=(13, 9.6), layout="constrained")
    axes = figure.subplots(8, 12)
    for index, (texture, _, speed) in enumerate(IMAGES):
        for row, (name, images) in enumerate((("paper", published[index]), ("rig", rig[index][0]))):
            for half, every in enumerate((images.slow, images.rapid)):
                shown = every if name == "paper" else every[:: measure.APART]
                for column in range(6):
                    axis = axes[2 * index + row, 6 * half + column]
                    axis.imshow(
                        shown[column], cmap=colormaps[SEQUENTIAL], vmin=0,
                        vmax=np.quantile(shown, 0.999),
                    )  # fmt: skip
                    axis.set_xticks([])
                    axis.set_yticks([])
            axes[2 * index + row, 0].set_ylabel(f"{name}\n{texture}, {speed}")
    axes[0, 0].set_title("SA-I", loc="left")
    axes[0, 6].set_title("RA-I", loc="left")
    figure.suptitle(
        "Tactile images 20 frames apart, each row at its own scale; the texture slides to the right"
        " in the rig's",
        ha="left",
        x=0.01,
    )
    figure.savefig(PICTURES / "rig-tactile-images.png", dpi=110)


def keep(name: str, title: str, columns: list[str], rows: list[list[str]]) -> None:
    """Write a table's numbers where the page finds them."""
    write(DATA / f"rig-{name}.json", title, ["python studies/calibrate_rig.py"], columns, rows)


def main() -> None:
    """Simulate, compare, draw, and keep the numbers."""
    panels = spectra(json.loads((PUBLISHED / "spectra.json").read_text(encoding="utf-8")))
    keep("spectra", "Spectra of drum g", SPECTRA_COLUMNS, spectra_table(panels))
    draw_spectra(panels)
    archive = np.load(PUBLISHED / "tactile_images.npz", allow_pickle=False)
    published = [published_images(archive, texture, speed) for texture, _, speed in IMAGES]
    rig = [[filmed_images(x, speed, seed) for seed in FILMED_SEEDS] for _, x, speed in IMAGES]
    keep("images", "Tactile images", IMAGE_COLUMNS, image_table(published, rig))
    draw_images(published, rig)
    text = json.dumps(predictions(rig[0]), indent=1)
    (DATA / "rig-predictions.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
