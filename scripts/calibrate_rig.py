"""Set the rig beside the published spectra and tactile images: `calibrate_rig.py FOLDER`.

FOLDER holds `spectra.json` and `tactile_images.npz`, digitised from the paper's notebook. Pictures
go to `docs/images`, the tables into `docs/rig.md`, between its marks. Takes minutes.
"""

import argparse
import json
import math
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents.channels import ra1, sa1
from afferents.core import dims
from afferents.encodings import amplitude_spectrum
from afferents.markers import load_sensor, track
from afferents.recordings import open_video
from afferents.reporting.style import SEQUENTIAL
from afferents.rig import STEADY_S, VIDEO, Rig, bumped_surface, record, simulate
from afferents.rig.microphone import SAMPLE_RATE_HZ

DOCS = Path(__file__).resolve().parents[1] / "docs"
RIG = Rig()
SPECTRA_MM_S = (20, 40, 50, 80, 100)
IMAGES = (("a", 0.0, 50), ("g", 3.0, 10), ("g", 3.0, 50), ("g", 3.0, 100))
SEEDS, FILMED_SEEDS = range(6), range(3)
APART = 20
"""Published tactile images lie 20 frames apart."""

SOURCES = {
    "drum.diameter_mm": "paper, 2.2",
    "drum.bump_height_mm": "paper, 2.2",
    "drum.bump_ratio": "chosen to fit the weights of k = 1 to 4 in g; no figure is published",
    "drum.print_sd_mm": "chosen to fit the skirts round the lines of g",
    "skin.pitch_mm": "paper, 2.1",
    "skin.radius_mm": "the drum's (paper, 2.2)",
    "skin.tip_radius_mm": "chosen to fit the size of the dark spot and the crescent in SA-I",
    "skin.footprint_mm": "chosen: a nodule's width, between the pins' distance and twice it",
    "skin.recess_mm": "chosen to fit the grain of RA-I",
    "skin.bridging_per_mm": "chosen to fit the weights of k = 1 to 4 in g",
    "skin.normal_mn_mm": "chosen: sets the unit of force and nothing else",
    "skin.relaxing_share": "chosen to fit the weights of k = 1 to 4 at different speeds",
    "skin.relaxation_s": "chosen: middle of the 20 to 50 ms of soft silicones",
    "skin.mass_mg": "chosen: 1.2 x 1.2 mm of 2.6 mm silicone at 1.07 mg/mm3",
    "skin.shear_mn_mm": "chosen to fit the reach of SA-I",
    "skin.coupling_mn_mm": "chosen to fit the spatial autocorrelation of SA-I and RA-I",
    "skin.damping_ratio": "chosen: a swing dies within a few ms",
    "skin.spread_mm": "chosen to fit the dark spot in SA-I",
    "skin.static_friction": "chosen to fit RA-I's growth with speed",
    "skin.kinetic_friction": "chosen to fit RA-I's growth with speed",
    "skin.stribeck_mm_s": "chosen so that textured drums stick and slip at 10 mm/s, not at 50",
    "skin.bristle_per_mm": "chosen: bristles bend 0.05 mm before they slip",
    "skin.bristle_damping_s_mm": "chosen: damps the bristles' own swing",
    "skin.viscous_s_mm": "chosen: small",
    "mounting.indentation_mm": "paper, 2.2",
    "mounting.indentation_sd_mm": "chosen: remounting by hand",
    "mounting.tilt_rad": "chosen: remounting by hand",
    "mounting.lateral_mm": "chosen: remounting by hand",
    "mounting.friction_sd": "chosen: dust and wear",
    "mounting.once_a_drum": "chosen: anew for each run",
    "mounting.any_angle": "chosen: the drum starts anywhere",
    "mounting.contact_at_rest": "chosen: the published recordings don't say",
    "mounting.camera_mm": "chosen to fit the dark spot in SA-I",
    "mounting.jitter_s": "chosen",
    "mounting.clock_sd_s": "chosen",
    "drive.eccentricity_mm": "chosen to fit how SA-I varies within a recording",
    "drive.ripple": "chosen to fit the width of the lines",
    "drive.motor_ripple": "chosen",
    "drive.drift_mm": "chosen",
    "microphone.x_mm": "chosen: beside the axis",
    "microphone.y_mm": "chosen: beside the axis",
    "microphone.depth_mm": "chosen to fit the weights of k = 1 to 4 in g",
    "microphone.shear_share": "chosen to fit the weights of k = 1 to 4 in g",
    "microphone.low_hz": "chosen: the published spectra have lines from 1 or 2 Hz",
    "microphone.high_hz": "chosen to fit how little lies above 300 Hz",
    "microphone.gain_per_mn_s": "chosen so that no drum of the paper's is clipped",
    "microphone.motor": "chosen to fit the smooth drum's loudness",
    "microphone.mains": "chosen: below the lines",
    "microphone.noise": "chosen to fit the floor of the smooth drum",
    "microphone.room_noise": "chosen",
    "camera.width": "paper, 2.1",
    "camera.height": "paper, 2.1",
    "camera.fps_hz": "paper, 2.1",
    "camera.px_per_mm": "chosen so that all pins stay in the picture",
    "camera.roll_deg": "published code: 6.2 degrees",
    "camera.barrel": "chosen",
    "camera.marker_diameter_mm": "published detector: areas of 95 to 180 px2",
    "camera.marker_grey": "chosen",
    "camera.skin_grey": "chosen",
    "camera.blur_px": "chosen",
    "camera.falloff": "chosen",
    "camera.noise_grey": "chosen",
    "camera.jpeg_quality": "chosen: coding moves a marker by 0.04 px (rms), which its noise hides",
}
"""Where every constant comes from."""


class Panel(NamedTuple):
    """Spectra of one drum at one speed: shape (window, frequency), 1 Hz a bin."""

    spacing_mm: float
    speed_mm_s: int
    published: NDArray[np.float64]
    rig: NDArray[np.float64]

    @property
    def first_hz(self) -> float:
        """f1 = N v / (pi 80 mm)."""
        return RIG.drum.periods(self.spacing_mm) * self.speed_mm_s / (math.pi * 80)


def spectra(published: dict[str, Any]) -> list[Panel]:
    """Return one published window and all the rig's windows of each panel of Figure 12."""
    panels = []
    for panel in published["panels"].values():
        spacing, speed = panel["spacing_mm"], panel["speed_true_mm_s"]
        windows = [heard(spacing, speed, seed) for seed in SEEDS]
        panels.append(
            Panel(spacing, speed, np.array(panel["intensity"])[None], np.concatenate(windows))
        )
    return panels


def heard(spacing_mm: float, speed_mm_s: float, seed: int) -> NDArray[np.float64]:
    """Return the spectra of four windows of 1 s, shape (4, 400)."""
    surface = bumped_surface(spacing_mm, RIG.drum)
    run = simulate(RIG, f"{spacing_mm:g}", surface, speed_mm_s, STEADY_S + 4, seed)
    steady = run.sensor[-4 * SAMPLE_RATE_HZ :].reshape(4, -1)
    return amplitude_spectrum(steady, SAMPLE_RATE_HZ, 400).astype(float)


def line(spectrum: NDArray[np.float64], hz: float) -> NDArray[np.float64]:
    """Return the largest amplitude within one bin of a frequency, of every window."""
    at = round(hz)
    return spectrum[:, at - 1 : at + 2].max(axis=1)


def weights(panel: Panel, spectrum: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lines k = 1 to 4 over the loudest of them, median over windows."""
    lines = np.stack([line(spectrum, k * panel.first_hz) for k in (1, 2, 3, 4)], axis=1)
    return np.asarray(np.median(lines / lines.max(axis=1, keepdims=True), axis=0))


def clarity(panel: Panel, spectrum: NDArray[np.float64], k: int) -> float:
    """Return line k over what lies round it, median over windows."""
    low, high = math.ceil((k - 0.45) * panel.first_hz), int((k + 0.45) * panel.first_hz)
    around = np.median(spectrum[:, low : high + 1], axis=1)
    return float(np.median(line(spectrum, k * panel.first_hz) / around))


def spectra_table(panels: list[Panel]) -> str:
    """Return the numbers of the spectra of g, and of g over a, as markdown."""
    of = {(p.spacing_mm, p.speed_mm_s): p for p in panels}
    rows = [
        "| speed, mm/s | | k = 1 : 2 : 3 : 4 | k = 1, 2 over what lies round it | g over a | above "
        "8 Hz | largest line, at 100 mm/s = 1 |",
        "|---|---|---|---|---|---|---|",
    ]
    for speed in SPECTRA_MM_S:
        g, a = of[3.0, speed], of[0.0, speed]
        for name in ("published", "rig"):
            mine, smooth = getattr(g, name), getattr(a, name)
            loudest = np.median(getattr(of[3.0, 100], name).max(axis=1))
            ratio = [
                np.median(mine[:, b:].max(axis=1)) / np.median(smooth[:, b:].max(axis=1))
                for b in (0, 9)
            ]
            cells = (
                f"{speed}" if name == "published" else "",
                name,
                " : ".join(f"{w:.2f}" for w in weights(g, mine)),
                ", ".join(f"{clarity(g, mine, k):.1f}" for k in (1, 2)),
                f"{ratio[0]:.0f}",
                f"{ratio[1]:.0f}",
                f"{np.median(mine.max(axis=1)) / loudest:.2f}",
            )
            rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def draw_spectra(panels: list[Panel]) -> None:
    """Draw Figure 12's panels of a and g, published above the rig's first window."""
    figure = Figure(figsize=(13, 7.2), layout="constrained")
    axes = figure.subplots(4, 5, sharex=True)
    loudest = [
        max(np.median(getattr(p, name).max(axis=1)) for p in panels)
        for name in ("published", "rig")
    ]
    for panel in panels:
        column = SPECTRA_MM_S.index(panel.speed_mm_s)
        first = 0 if panel.spacing_mm else 2
        for row, (name, values, top) in enumerate(
            (("published", panel.published[0], loudest[0]), ("rig", panel.rig[0], loudest[1]))
        ):
            axis = axes[first + row, column]
            colour = "#555555" if name == "published" else "#0072b2"
            axis.plot(np.arange(300), values[:300] / top, color=colour, linewidth=0.9)
            axis.set_ylim(0, 1.05 if panel.spacing_mm else 0.22)
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
        "Amplitude over the loudest line of g; orange: k f1, k = 1 to 4", ha="left", x=0.01
    )
    figure.savefig(DOCS / "images" / "rig-spectra.png", dpi=110)


class Images(NamedTuple):
    """Tactile images 20 frames apart, shape (image, row, column), and their neighbours."""

    slow: NDArray[np.float64]
    rapid: NDArray[np.float64]
    slow_next: NDArray[np.float64] | None = None
    rapid_next: NDArray[np.float64] | None = None


def published_images(archive: Any, texture: str, speed: int) -> Images:
    """Return the ten published images; slides of paper and rig point the same way then."""
    chosen = (archive["texture"] == texture) & (archive["speed_mm_s"] == speed)
    pair = [
        archive["intensity_recovered"][chosen & (archive["afferent"] == name)].transpose(0, 2, 1)
        for name in ("SA", "RA")
    ]
    return Images(*(images.astype(float) for images in pair))


def filmed_images(spacing_mm: float, speed_mm_s: float, seed: int) -> Images:
    """Record, find blobs as published, and return the images of the steady part."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "run"
        surface = bumped_surface(spacing_mm, RIG.drum)
        record(RIG, target, f"{spacing_mm:g}", surface, speed_mm_s, STEADY_S + 4, seed)
        tracks = track(open_video(target / VIDEO), load_sensor("tip_b"), "one-to-one")
    slow = sa1(tracks[dims.POSITION], tracks[dims.REST_POSITION])
    rapid = ra1(slow).values[round(STEADY_S * 90) :].reshape(-1, 19, 19)
    steady = slow.values[round(STEADY_S * 90) :].reshape(-1, 19, 19)
    last = len(steady) - 1
    return Images(
        steady[:last:APART], rapid[:last:APART], steady[1::APART][: -(-last // APART)],
        rapid[1::APART][: -(-last // APART)],
    )  # fmt: skip


def correlation(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the mean correlation of pairs of images."""
    return float(
        np.mean(
            [np.corrcoef(a.ravel(), b.ravel())[0, 1] for a, b in zip(first, second, strict=False)]
        )
    )


def statistics(images: NDArray[np.float64]) -> list[float]:
    """Return correlation 20 frames apart, spread over space and time, autocorrelation."""
    centred = images - images.mean(axis=(1, 2), keepdims=True)
    power = (centred**2).mean()
    near = [
        (centred[:, :, k:] * centred[:, :, :-k]).mean() / power / 2
        + (centred[:, k:] * centred[:, :-k]).mean() / power / 2
        for k in (1, 3)
    ]
    return [
        correlation(images[:-1], images[1:]),
        float(images.std() / images.mean()),
        float(images.std(axis=0).mean() / images.mean()),
        *map(float, near),
    ]


def image_tables(published: list[Images], rig: list[list[Images]]) -> str:
    """Return the statistics of the tactile images as markdown."""
    head = (
        "| | | 20 frames apart | next frame | sd / mean | sd over time / mean | "
        "1 pin apart | 3 pins apart | mean, a at 50 mm/s = 1 |\n"
        "|---|---|---|---|---|---|---|---|---|"
    )
    rows = [head]
    for afferent in ("slow", "rapid"):
        title = {"slow": "SA-I", "rapid": "RA-I"}[afferent]
        for index, (texture, _, speed) in enumerate(IMAGES):
            theirs = getattr(published[index], afferent)
            mine = [getattr(images, afferent) for images in rig[index]]
            after = [getattr(images, f"{afferent}_next") for images in rig[index]]
            paper_mean = getattr(published[0], afferent).mean()
            rig_mean = np.mean([getattr(images, afferent).mean() for images in rig[0]])
            found = np.mean([statistics(images) for images in mine], axis=0)
            following = np.mean([correlation(a, b) for a, b in zip(mine, after, strict=True)])
            rows += [
                _row(f"{title}, {texture}, {speed}", "published", statistics(theirs), None,
                     theirs.mean() / paper_mean),
                _row("", "rig", list(found), float(following),
                     float(np.mean([images.mean() for images in mine]) / rig_mean)),
            ]  # fmt: skip
    return "\n".join(rows)


def _row(title: str, name: str, found: list[float], following: float | None, mean: float) -> str:
    apart, *rest = (f"{value:.2f}" for value in found)
    shown = "" if following is None else f"{following:.2f}"
    return f"| {title} | {name} | {apart} | {shown} | {' | '.join(rest)} | {mean:.2f} |"


def draw_images(published: list[Images], rig: list[list[Images]]) -> None:
    """Draw six images 20 frames apart of every group, published above the rig's."""
    figure = Figure(figsize=(13, 9.6), layout="constrained")
    axes = figure.subplots(8, 12)
    for index, (texture, _, speed) in enumerate(IMAGES):
        for row, (name, images) in enumerate((("paper", published[index]), ("rig", rig[index][0]))):
            for half, shown in enumerate((images.slow, images.rapid)):
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
    figure.savefig(DOCS / "images" / "rig-tactile-images.png", dpi=110)


def constants_table() -> str:
    """Return every constant, its value and where it comes from, as markdown."""
    rows = ["| constant | value | source |", "|---|---|---|"]
    constants = {
        f"{section}.{name}": value
        for section, fields in RIG.model_dump().items()
        for name, value in fields.items()
    }
    if set(constants) != set(SOURCES):
        raise SystemExit(f"no source for, or no longer there: {set(constants) ^ set(SOURCES)}")
    rows += [f"| `{name}` | {value} | {SOURCES[name]} |" for name, value in constants.items()]
    return "\n".join(rows)


def insert(page: Path, mark: str, text: str) -> None:
    """Replace what stands between two marks of a page."""
    content = page.read_text(encoding="utf-8")
    head, _, rest = content.partition(f"<!-- {mark} -->")
    tail = rest.partition(f"<!-- /{mark} -->")[2]
    whole = f"{head}<!-- {mark} -->\n{text}\n<!-- /{mark} -->{tail}"
    page.write_text(whole, encoding="utf-8")


def main() -> None:
    """Simulate, compare, draw, and write the tables into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    page = DOCS / "rig.md"
    insert(page, "constants", constants_table())
    panels = spectra(json.loads((folder / "spectra.json").read_text(encoding="utf-8")))
    insert(page, "spectra", spectra_table(panels))
    draw_spectra(panels)
    archive = np.load(folder / "tactile_images.npz", allow_pickle=False)
    published = [published_images(archive, texture, speed) for texture, _, speed in IMAGES]
    rig = [[filmed_images(x, speed, seed) for seed in FILMED_SEEDS] for _, x, speed in IMAGES]
    insert(page, "images", image_tables(published, rig))
    draw_images(published, rig)


if __name__ == "__main__":
    main()
