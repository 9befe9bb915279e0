"""The clocks of camera and microphone, from recordings of one set-up."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from afferents.channels.offset import Offset, measure_offset
from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.progress import Progress
from afferents.markers import Sensor, track
from afferents.recordings import WavFile, open_video
from afferents.recordings.published import AUDIO, VIDEO


class Alignment(NamedTuple):
    """Offsets in ms, one a recording, and their mean; `error_ms` is the mean's standard error."""

    offsets_ms: tuple[float, ...]
    explained: tuple[float, ...]
    mean_ms: float
    error_ms: float | None

    def describe(self) -> list[str]:
        """Return it in sentences."""
        each = [
            f"{offset:+.1f} ms, under which the skin's motion explains {100 * share:.0f}% of the "
            "sound below 40 Hz."
            for offset, share in zip(self.offsets_ms, self.explained, strict=True)
        ]
        error = "" if self.error_ms is None else f" ± {self.error_ms:.1f}"
        return [
            *each,
            f"The microphone's clock is ahead of the camera's by {self.mean_ms:.1f}{error} ms; "
            f"feel with --audio-offset-ms {self.mean_ms:.1f}.",
        ]


def align(folders: Sequence[Path], sensor: Sensor, progress: Progress) -> Alignment:
    """Measure the offset of microphone and camera in each recording, and their mean.

    Raises
    ------
    InputError
        If a recording lacks video or audio, or shows no touch whose sound is that of the skin.
    """
    found = [
        _offset(folder, sensor) for folder in progress.track(folders, "aligning", len(folders))
    ]
    offsets = np.array([1000 * offset.seconds for offset in found])
    error = float(offsets.std(ddof=1) / np.sqrt(len(offsets))) if len(offsets) > 1 else None
    explained = tuple(offset.explained for offset in found)
    return Alignment(tuple(offsets.tolist()), explained, float(offsets.mean()), error)


def _offset(folder: Path, sensor: Sensor) -> Offset:
    tracks = track(open_video(folder / VIDEO), sensor)
    audio = WavFile(folder / AUDIO)
    felt = tracks.isel({dims.TIME: slice(sensor.rest_frame, None)})
    try:
        return measure_offset(
            felt[dims.TIME].values,
            felt[dims.POSITION].values,
            audio.read().values[:, 0],
            audio.sample_rate_hz,
        )
    except InputError as error:
        raise error.at(folder) from error
