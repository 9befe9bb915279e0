"""Turn a simulated session into a folder as the published one may be, with its flaws.

``python scripts/as_published.py SESSION OUT`` writes ``<texture>/<speed>/video.mp4`` and
``audio.wav`` and the reference clip ``throw_away.mp4``, and nothing else: no session file, no
truth. The videos are written as the published code's kind of writer does it: OpenCV's, MPEG-4 Part
2 (``mp4v``) at its own bit rate, three colours, under a frame rate of 30 whatever the camera's was.
Flaws are asked for by the recordings that have them:

    --extra 3/50 --extra 1/20     a reflection beside the skin: 362 blobs in the rest frame
    --lacking 2/10                a marker hidden while the skin rests: 360 blobs
    --short 4/60                  sound that ends a second before the video
    --shifted 5/70                the picture 12 px beside the reference clip's

The frame rate that overrules the containers' is then ``afferents extract OUT STORE --fps 90``.
"""

import argparse
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import soundfile
from numpy.typing import NDArray

from afferents.parallel import side_by_side
from afferents.progress import Progress
from afferents.recordings.data_sets import read_session
from afferents.recordings.layouts import AUDIO, REFERENCE, VIDEO
from afferents.recordings.video import open_video

Picture = NDArray[np.uint8]

CONTAINER_HZ = 30.0
"""What the writer notes as frame rate, where nobody says another."""
REST_FRAMES = 30
"""The drum stands still for so many frames (docs/rig.md)."""
HIDDEN_PX = (320, 240)
"""What is nearest to here is hidden: the middle of the skin."""
SPECK_PX, SPECK_RADIUS_PX, SPECK_GREY = (60, 240), 6.0, 230
"""A reflection left of the markers: as large and bright as one, within the detector's 300 px."""


@dataclass(frozen=True)
class Flaws:
    """Which recordings have which, by name (``3/50``).

    Attributes
    ----------
    extra, lacking
        A blob too many or too few in the rest frame.
    short
        Sound that is `short_s` shorter.
    shifted
        A picture that lies `shift_px` beside the reference's.
    """

    extra: tuple[str, ...] = ()
    lacking: tuple[str, ...] = ()
    short: tuple[str, ...] = ()
    shifted: tuple[str, ...] = ()
    short_s: float = 1.0
    shift_px: tuple[float, float] = (12.0, 0.0)


def as_published(
    session: Path, out: Path, flaws: Flaws, workers: int | None = None, quiet: bool = False
) -> None:
    """Write a session's recordings anew into a folder that is not there yet."""
    recordings = read_session(session).recordings
    names = [recording.name for recording in recordings]
    for name in {*flaws.extra, *flaws.lacking, *flaws.short, *flaws.shifted} - {*names}:
        raise SystemExit(f"{name}: expected a recording of {session}")
    out.mkdir(parents=True)
    jobs = [(session, out, name, flaws) for name in names]
    with Progress(quiet) as progress:
        done = side_by_side(write_recording, jobs, workers, progress.note)
        for _ in progress.track(done, "writing", len(jobs)):
            pass


def write_recording(session: Path, out: Path, name: str, flaws: Flaws) -> str:
    """Write one recording, and the reference clip if it lies beside it; return its name."""
    here, there = session / name, out / name
    there.mkdir(parents=True)
    write_video(there / VIDEO, spoilt(pictures(here / VIDEO), name, flaws))
    if (here / REFERENCE).is_file():
        write_video(there / REFERENCE, pictures(here / REFERENCE))
    if name in flaws.short:
        shorten(here / AUDIO, there / AUDIO, flaws.short_s)
    elif (here / AUDIO).is_file():
        shutil.copyfile(here / AUDIO, there / AUDIO)
    return name


def pictures(path: Path) -> Iterator[Picture]:
    """Yield a video's frames, (height, width), grey."""
    for frame in open_video(path).frames():
        yield frame.image.copy()


def spoilt(frames: Iterator[Picture], name: str, flaws: Flaws) -> Iterator[Picture]:
    """Yield frames with what is wrong with a recording's picture."""
    for index, frame in enumerate(frames):
        picture = frame
        if name in flaws.shifted:
            moved = np.array([[1, 0, flaws.shift_px[0]], [0, 1, flaws.shift_px[1]]], np.float32)
            size = (picture.shape[1], picture.shape[0])
            picture = cv2.warpAffine(picture, moved, size, borderMode=cv2.BORDER_REPLICATE)
        if name in flaws.extra:
            radius = round(16 * SPECK_RADIUS_PX)
            centre = (16 * SPECK_PX[0], 16 * SPECK_PX[1])
            cv2.circle(picture, centre, radius, SPECK_GREY, -1, cv2.LINE_AA, shift=4)
        if name in flaws.lacking and index < REST_FRAMES:
            hide_marker(picture)
        yield picture


def hide_marker(picture: Picture) -> None:
    """Cover the marker nearest to the middle with the skin's grey."""
    x, y = HIDDEN_PX
    around = picture[y - 24 : y + 25, x - 24 : x + 25]
    blobs = (around > np.percentile(around, 70)).astype(np.uint8)
    _, _, _, centres = cv2.connectedComponentsWithStats(blobs)
    nearest = min(centres[1:], key=lambda centre: np.hypot(*(centre - 24)))
    centre = (round(nearest[0] + x - 24), round(nearest[1] + y - 24))
    cv2.circle(picture, centre, 9, int(np.percentile(around, 10)), -1)


def write_video(path: Path, frames: Iterator[Picture]) -> None:
    """Write frames as OpenCV's writer does, under its usual frame rate."""
    writer = None
    for frame in frames:
        if writer is None:
            size = (frame.shape[1], frame.shape[0])
            codec = cv2.VideoWriter.fourcc(*"mp4v")
            writer = cv2.VideoWriter(str(path), codec, CONTAINER_HZ, size)
            if not writer.isOpened():
                raise SystemExit(f"{path}: OpenCV was built without a writer of mp4v")
        writer.write(cv2.cvtColor(frame, cv2.COLOR_GRAY2BGR))
    if writer is not None:
        writer.release()


def shorten(here: Path, there: Path, seconds: float) -> None:
    """Write a wav without its last seconds."""
    samples, rate_hz = soundfile.read(here, dtype="int16", always_2d=True)
    soundfile.write(there, samples[: len(samples) - round(seconds * rate_hz)], rate_hz, "PCM_16")


def _flaws_in(given: argparse.Namespace) -> Flaws:
    kinds = ("extra", "lacking", "short", "shifted")
    return Flaws(**{kind: tuple(getattr(given, kind)) for kind in kinds})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("session", type=Path)
    parser.add_argument("out", type=Path)
    for flaw in ("extra", "lacking", "short", "shifted"):
        parser.add_argument(f"--{flaw}", action="append", default=[], metavar="TEXTURE/SPEED")
    parser.add_argument("--workers", type=int)
    asked = parser.parse_args()
    as_published(asked.session, asked.out, _flaws_in(asked), asked.workers)
