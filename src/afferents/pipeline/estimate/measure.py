"""Rates of this machine: frames tracked, recordings encoded, batches learnt from."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import cv2

from afferents.core.cut import Cut
from afferents.core.errors import AfferentsError, InputError
from afferents.core.recording import Frame, Recording, Video
from afferents.core.responses import Responses
from afferents.core.samples import Samples
from afferents.markers import Method
from afferents.pipeline.doubts import watched
from afferents.pipeline.encode import Source, encode
from afferents.pipeline.estimate.amount import lengthened
from afferents.pipeline.extract import responses_of
from afferents.pipeline.sensors import Sensors

TRACKED_S = 0.7
"""So long, about, tracking is measured."""
_AFTER_REST = 20
"""So many frames after the rest frame: by then the markers have been found at rest."""
_FEWEST, _MOST = 5, 600
_TRIED = 5
"""So many recordings are tried before it is said that none can be tracked."""


@dataclass
class Clip:
    """The first part of a video, that counts its frames and their processor time.

    Attributes
    ----------
    early
        Frames that are not measured.
    n, seconds
        Frames that were decoded and tracked after these, and how long that took.
    """

    video: Video
    early: int
    n: int = 0
    seconds: float = 0.0

    @property
    def path(self) -> Path:
        """The file."""
        return self.video.path

    @property
    def fps_hz(self) -> float:
        """Nominal frame rate, Hz."""
        return self.video.fps_hz

    @property
    def width(self) -> int:
        """Width, px."""
        return self.video.width

    @property
    def height(self) -> int:
        """Height, px."""
        return self.video.height

    def frames(self) -> Iterator[Frame]:
        """Decode from the start, until enough has been measured."""
        coming = self.video.frames()
        yield from islice(coming, self.early)
        begun = time.process_time()
        for self.n, frame in enumerate(coming, start=1):
            yield frame
            self.seconds = time.process_time() - begun
            enough = self.seconds > TRACKED_S and self.n >= _FEWEST
            if enough or self.n >= _MOST:
                return

    @property
    def frame_s(self) -> float:
        """How long a frame takes in one process, s."""
        return self.seconds / self.n if self.n else 0.0


class Measured(NamedTuple):
    """One recording: as it was read, its responses at full length, and what a frame takes, s."""

    recording: Recording
    responses: Responses
    frame_s: float


def measure_recording(
    recordings: Sequence[Recording], sensors: Sensors, method: Method
) -> Measured:
    """Track the first frames of the first recording that can be; the others will be like it.

    Raises
    ------
    AfferentsError
        If none of the first few recordings can be tracked.
    """
    fault: AfferentsError | None = None
    for recording in recordings[:_TRIED]:
        try:
            return _measured(recording, sensors, method)
        except AfferentsError as error:
            fault = fault or error
    raise fault or InputError("the session", "a recording that is long enough", "none")


def _measured(recording: Recording, sensors: Sensors, method: Method) -> Measured:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)  # as every process that extracts has it
    try:
        sensor = sensors.of(recording)
        video, early = recording.video, sensor.rest_frame + _AFTER_REST
        clip = Clip(video, early) if video is not None else None
        found = responses_of(watched(replace(recording, video=clip)), sensor, method)
    finally:
        cv2.setNumThreads(threads)
    return Measured(recording, lengthened(found, recording), clip.frame_s if clip else 0.0)


def measure_encoding(measured: Measured, source: Source, cut: Cut) -> tuple[Samples, float]:
    """Encode the measured recording; return its samples, and how long that took, s.

    Raises
    ------
    InputError
        If it is too short for the cut.
    """
    begun = time.process_time()
    samples = encode(measured.responses, source, cut)
    return samples, time.process_time() - begun
