"""From a clip at rest to a sensor file, with a picture to check it by."""

from pathlib import Path

import numpy as np

from afferents.core.errors import InputError
from afferents.core.files import write_aside
from afferents.core.outputs import has_mark, is_our_picture, require_free
from afferents.core.streams import printable
from afferents.markers.calibrate import MADE_BY, Calibration, calibrate, sensor_toml
from afferents.markers.estimate import looks
from afferents.markers.sensor import DiscDetector
from afferents.recordings import open_video
from afferents.reporting import markers_figure, save_figure


def calibrate_sensor(
    video: Path, out: Path, pitch_mm: float | None, force: bool = False
) -> tuple[list[str], Path]:
    """Write a sensor file and the picture beside it; return sentences and the picture's path.

    Parameters
    ----------
    force
        Whether those of an earlier calibration may be replaced.

    Raises
    ------
    InputError
        If the clip shows no markers, `out` is no .toml, or it or the picture is not free.
    """
    if out.suffix != ".toml":
        raise InputError("--out", "a name that ends in .toml", f"'{out}'")
    picture = out.with_suffix(".png")
    require_free(out, "a sensor file", _is_calibrated, force=force, reads=[video])
    require_free(picture, "a sensor file's picture", is_our_picture, force=force, reads=[video])
    found = calibrate(open_video(video), printable(out.stem), pitch_mm)
    seen = np.ones(len(found.position), dtype=bool)
    figure = markers_figure(found.image, found.position, seen, video.name)
    with write_aside(out) as partial:  # both, or neither
        partial.write_text(sensor_toml(found.sensor), encoding="utf-8")
        save_figure(figure, picture)
    return describe(found), picture


def _is_calibrated(path: Path) -> bool:
    return path.is_file() and has_mark(path, MADE_BY)


def describe(found: Calibration) -> list[str]:
    """Say what was found, to be checked against the picture."""
    sensor, layout, picture = found.sensor, found.found, found.picture
    shade = "bright" if sensor.detector.blob_colour else "dark"
    size = f", {sensor.rows} x {sensor.columns}" if sensor.rows else ""
    roll = f", rolled by {layout.roll_deg:.1f} deg" if layout.roll_deg == layout.roll_deg else ""
    scale, mm = "", ""
    if sensor.pitch_mm:
        px_per_mm = layout.spacing_px / sensor.pitch_mm
        scale = f" ({px_per_mm:.1f} px a mm)"
        if isinstance(sensor.detector, DiscDetector):
            mm = f" ({sensor.detector.radius_px / px_per_mm:.2f} mm)"
    missing = (sensor.n_markers or 0) - len(found.position)
    return [
        f"{len(found.position)} {shade} markers, {looks(sensor.detector)}{mm}, "
        f"{layout.spacing_px:.1f} px apart{scale}.",
        f"Layout: {sensor.layout}{size}{roll}{f', {missing} missing' if missing else ''}.",
        f"Grey levels: markers {picture.disc_grey:.0f}, skin {picture.skin_grey:.0f}; edges "
        f"{picture.edge_px:.1f} px wide.",
        *_motion(found),
    ]


def _motion(found: Calibration) -> list[str]:
    """Say whether the skin moved, which makes places at rest doubtful."""
    if found.n_still == found.n_looked:
        return []
    return [
        f"The skin moves from frame {found.n_still} on, so {found.n_still} of {found.n_looked} "
        "frames were used; for places at rest give a clip at rest."
    ]
