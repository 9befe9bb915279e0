"""`Recording`, `RecordingSet`, their videos, audio and frames (all lazy); rules for names."""

import hashlib
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, Protocol

import cv2
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.errors import InputError, then
from afferents.files import checksum
from afferents.store.log import LoggedFile

LETTERS = "abcdefghijklm"
"""The 13 textures of the paper."""

GreyImage = NDArray[np.uint8]
"""One video frame, shape (height, width), 0 black to 255 white."""


class Frame(NamedTuple):
    """One decoded frame.

    Attributes
    ----------
    time_s
        Presentation time, s.
    luma
        As decoded, (height, width), without a copy where that can be.
    levels
        Grey level of each luma value, (256,); None where they are the same.
    in_colour
        Makes the picture in colour, (height, width, 3), blue, green, red; None of a grey one.
    bits
        Bits of each pixel that the camera gave; the upper eight are kept.
    """

    time_s: float
    luma: GreyImage
    levels: GreyImage | None = None
    in_colour: Callable[[], NDArray[np.uint8]] | None = None
    bits: int = 8

    @property
    def image(self) -> GreyImage:
        """The grey image, (height, width), 0 to 255: black to white."""
        return make_grey(self.luma, self.levels)


def make_grey(luma: GreyImage, levels: GreyImage | None) -> GreyImage:
    """Return luma as grey levels; see `Frame`."""
    return luma if levels is None else np.asarray(cv2.LUT(luma, levels), np.uint8)


class Video(Protocol):
    """A video that decodes frame by frame as it is read."""

    @property
    def path(self) -> Path:
        """The file."""

    @property
    def fps_hz(self) -> float:
        """Nominal frame rate, Hz."""

    @property
    def width(self) -> int:
        """Width, px."""

    @property
    def height(self) -> int:
        """Height, px."""

    def frames(self) -> Iterator[Frame]:
        """Decode from the start, in order of presentation."""


class Vibration(Protocol):
    """Vibration channels on a regular clock: a microphone, or taxels sampled fast enough."""

    @property
    def path(self) -> Path:
        """The file."""

    @property
    def sample_rate_hz(self) -> float:
        """Sample rate, Hz."""

    @property
    def n_samples(self) -> int:
        """Samples in each channel."""

    @property
    def n_channels(self) -> int:
        """Channels in the file."""

    def read(self) -> xr.DataArray:
        """Return `(audio_time, channel)` float32 with `sample_rate_hz` and `units` in attrs."""


@dataclass(frozen=True)
class Recording:
    """One texture slid at one speed, seen by a camera, recorded by vibration channels, or both.

    Parameters
    ----------
    name
        Unique in its session, such as ``3/50``.
    texture
        Folder name or word, such as ``3`` (bump spacing in mm) or ``Linen``.
    speed_mm_s
        Magnitude of the sliding speed, mm/s; None where it is not known.
    source
        The folder or file it was read from.
    video, audio
        Lazy sources, None where the recording has none.
    steady_s
        Start and end of constant speed in s, None where nothing says so.
    conditions
        Whatever else the source declares (pressure, direction, repetition).
    sensor
        Its own sensor file, or the name of a packaged sensor; None for the session's.
    rest_frame
        Index of the frame that shows the skin at rest; None for the one that the sensor file names.
    beside
        What else was logged meanwhile, with clocks of its own.
    named_by_spacing
        Whether a texture that is a number is the spacing of its bumps, mm: the published layout
        says so, and no other.
    """

    name: str
    texture: str
    speed_mm_s: float | None
    source: Path
    video: Video | None = None
    audio: Vibration | None = None
    steady_s: tuple[float, float] | None = None
    conditions: Mapping[str, str | float] = field(default_factory=dict)
    sensor: str | None = None
    rest_frame: int | None = None
    beside: tuple[LoggedFile, ...] = ()
    named_by_spacing: bool = False

    def __post_init__(self) -> None:
        """Bring texture and conditions into the form that names are compared in.

        Raises
        ------
        InputError
            If a name is not in UTF-8.
        """
        require_utf8(f"{self.name}, {self.texture}")
        one_form = {
            k: fold_label(v) if isinstance(v, str) else v for k, v in self.conditions.items()
        }
        object.__setattr__(self, "texture", fold_label(self.texture))
        object.__setattr__(self, "conditions", one_form)

    @property
    def fps_hz(self) -> float | None:
        """Nominal frame rate of the video, Hz; the true frame times come with the frames."""
        return self.video.fps_hz if self.video else None

    @property
    def sample_rate_hz(self) -> float | None:
        """Sample rate of the vibration channels, Hz."""
        return self.audio.sample_rate_hz if self.audio else None

    @property
    def files(self) -> tuple[Path, ...]:
        """The files behind the recording; of numbered images, their folder."""
        found: list[Path] = []
        for source in (self.video, self.audio):
            if source is not None:
                found += [part.path for part in getattr(source, "files", (source,))]
        return tuple(found)

    @property
    def checksum(self) -> str:
        """SHA-256 of the files behind the recording (reads them)."""
        return checksum(*self.files)


@dataclass(frozen=True)
class RecordingSet:
    """Recordings that belong together: one sensor, one mounting, textures x speeds.

    `reference` is the video that fixes the order of the markers (``0/10/throw_away.mp4`` in
    the published layout), None where there is none.
    """

    root: Path
    recordings: tuple[Recording, ...]
    reference: Video | None = None

    @property
    def textures(self) -> tuple[str, ...]:
        """Textures in natural order (numbers by value, then words)."""
        return tuple(sorted({r.texture for r in self.recordings}, key=natural_order))

    @property
    def speeds_mm_s(self) -> tuple[float, ...]:
        """Speeds that are known, ascending."""
        return tuple(sorted({r.speed_mm_s for r in self.recordings if r.speed_mm_s is not None}))

    @property
    def checksum(self) -> str:
        """SHA-256 over the names and checksums of all recordings."""
        digest = hashlib.sha256()
        for recording in self.recordings:
            digest.update(f"{recording.name}:{recording.checksum}\n".encode())
        return digest.hexdigest()


def name_folder(letter: str) -> str:
    """Return the texture folder of one of the paper's letters: i has bumps i / 2 mm apart."""
    return f"{LETTERS.index(letter) / 2:g}"


def spacing_mm(texture: str) -> float | None:
    """Return the bump spacing that a texture is named by, None where a word names it."""
    return float(texture) if re.fullmatch(r"\d+(\.\d+)?", texture) else None


NEARLY = 1e-3
"""Speeds closer than this share of one another are one speed, written in two ways."""


def fold_label(text: str) -> str:
    """Return a name in the form that names are compared in: composed (NFC), blanks folded."""
    return " ".join(unicodedata.normalize("NFC", text).split())


def require_utf8(name: str) -> None:
    """Refuse a name of a file or folder that a store and TOML can't hold.

    Raises
    ------
    InputError
        If some of its bytes are not UTF-8.
    """
    try:
        name.encode()
    except UnicodeEncodeError as error:
        do = "rename it"
        with suppress(UnicodeError):  # it is UTF-8, and the system reads names as something else
            name.encode(errors="surrogateescape").decode()
            do = "set PYTHONUTF8=1, since the system takes names for others"
        raise InputError(
            f"{name}: expected a name in UTF-8, found other bytes{then(do)}"
        ) from error


def require_distinct(
    where: Path | str, textures: Iterable[str], speeds: Iterable[tuple[str, float]]
) -> None:
    """Refuse one texture or one speed under two names.

    Parameters
    ----------
    speeds
        Each with its name.

    Raises
    ------
    InputError
        Naming both, such as the textures ``3`` and ``3.0``, or ``Felt`` and ``felt``, or the speeds
        ``40`` and ``40.0``.
    """
    named: dict[tuple[float, str], str] = {}
    for texture in sorted(set(textures)):
        other = named.setdefault(natural_order(texture.lower()), texture)
        if other != texture:
            raise _one_twice(where, "texture", other, texture)
    for (slow, one), (fast, other) in pairwise(sorted((v, name) for name, v in set(speeds))):
        if fast - slow <= NEARLY * fast:
            raise _one_twice(where, "speed", one, f"{other} mm/s")


def _one_twice(where: Path | str, kind: str, one: str, other: str) -> InputError:
    do = "rename one as the other"
    if one.lower() == other.lower():
        do += ", or, if they are two, so that more than capitals differ"
    return InputError(
        f"{where}: expected each {kind} under one name, found {one} and {other}{then(do)}"
    )


def natural_order(texture: str) -> tuple[float, str]:
    """Sort key: numbers by value, then words alphabetically."""
    spacing = spacing_mm(texture)
    return (np.inf, texture) if spacing is None else (spacing, "")
