"""Numbered pictures as a video: a folder or zip of them, with the times of a CSV next to them."""

import re
import zipfile
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import islice
from pathlib import Path, PureWindowsPath
from typing import Any

import cv2
import joblib
import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError, reading
from afferents.recordings.media import IMAGES
from afferents.store.recording import Frame

Picture = Path | zipfile.Path
ZIP = ".zip"
TIMES = "timestamps.csv"
"""Name of the CSV in a folder of pictures; next to `clip/` it is `clip.csv`."""
TIME_COLUMNS = ("time_s", "timestamp", "real_time", "real_elapsed", "time")
PICTURE_COLUMNS = ("image", "time_series_images", "picture", "file", "frame_id", "frame")
"""Columns of such a CSV, of each the first that is there: s, and a picture's name or number."""

_NUMBER = re.compile(r"\d+$")
_AHEAD, _MOST_THREADS = 8, 4
"""Pictures decoded before they are needed, and in how many threads at most."""


@dataclass(frozen=True)
class ImageFolder:
    """Images whose names end in numbers, such as ``frame_0001.png``: the frames of a video.

    Implements `afferents.store.recording.Video`. Times are those of the CSV, s from the first
    image on; without one they count from `rate_hz`, and a number that is missing is a frame that
    was lost: the others keep their times.

    Parameters
    ----------
    path
        The folder, a zip file of images, or one image alone.
    rate_hz
        Images a second, where nothing else says when they were taken, or the CSV is wrong.
    times
        The CSV, with columns of `TIME_COLUMNS` and `PICTURE_COLUMNS`; None for ``timestamps.csv``
        in the folder, or the CSV of the folder's name next to it.

    Raises
    ------
    InputError
        If there is neither a rate nor a CSV.
    """

    path: Path
    rate_hz: float | None = None
    times: Path | None = None

    def __post_init__(self) -> None:
        """Find the CSV."""
        if self.rate_hz is None and self.times is None:
            found = times_beside(self.path)
            if found is None:
                raise InputError(
                    f"{self.path}: expected {TIMES} in it, or the rate at which the images were "
                    "taken, found neither; write fps_hz into session.toml, or give --fps"
                )
            object.__setattr__(self, "times", found)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what was read: an open zip file can't go to another process."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def numbered(self) -> dict[int, Picture]:
        """The images by their numbers, ascending.

        Raises
        ------
        InputError
            If there is none, or two have one number.
        """
        if self.path.suffix.lower() in IMAGES:
            return {0: self.path}
        found: dict[int, Picture] = {}
        for path in self._files():
            number = _NUMBER.search(path.stem) if Path(path.name).suffix.lower() in IMAGES else None
            if number is None or path.name.startswith("."):
                continue
            other = found.setdefault(int(number[0]), path)
            if other != path:
                raise InputError(
                    f"{self.path}: expected images with a number each, found {other.name} and "
                    f"{path.name}; move those that are not of this recording elsewhere"
                )
        if not found:
            raise InputError(f"{self.path}: expected numbered images, found none in it")
        return dict(sorted(found.items()))

    def _files(self) -> Sequence[Picture]:
        if self.path.is_dir():
            return sorted(self.path.iterdir())
        if self.path.suffix.lower() != ZIP:
            raise InputError(
                f"{self.path}: expected a folder of numbered images, found no such folder"
            )
        with reading(self.path, "a readable zip file", zipfile.BadZipFile, OSError):
            archive = zipfile.Path(self.path).root
        return [zipfile.Path(archive, name) for name in sorted(archive.namelist())]

    @cached_property
    def bits(self) -> int:
        """Bits that the camera gave of each pixel: 8, or up to 16 in images of 16 bits.

        Cameras of 10, 12 or 14 bits leave the upper ones of 16 empty, and no header says so: it is
        the least even number that holds the brightest pixel of all images.
        """
        if self._first.dtype == np.uint8:
            return 8
        brightest = max(int(image.max()) for _, image in _read_ahead(self.numbered.values()))
        return max(8, brightest.bit_length() + brightest.bit_length() % 2)

    @cached_property
    def _first(self) -> NDArray[Any]:
        return _read(next(iter(self.numbered.values())))

    @property
    def width(self) -> int:
        """Width of the first image, px."""
        return int(self._first.shape[1])

    @property
    def height(self) -> int:
        """Height of the first image, px."""
        return int(self._first.shape[0])

    @property
    def n_frames(self) -> int:
        """How many images there are."""
        return len(self.numbered)

    @cached_property
    def fps_hz(self) -> float:
        """Images a second: the rate, else by the median of the CSV's steps."""
        if self.rate_hz is not None:
            return self.rate_hz
        if self.n_frames == 1:
            raise InputError(f"{self.path}: expected two images or more, found one; give its rate")
        return float(1 / np.median(np.diff(self.clock_s)))

    @property
    def duration_s(self) -> float:
        """From the first image to the end of the last, s."""
        return float(self.clock_s[-1] - self.clock_s[0] + 1 / self.fps_hz)

    @cached_property
    def clock_s(self) -> NDArray[np.float64]:
        """When each image was taken, s: by the clock of the CSV, else from the first on.

        Raises
        ------
        InputError
            If the CSV is not of these images, or its times don't rise; if there is none, and the
            images' numbers count no frames.
        """
        if self.rate_hz is None and self.times is not None:
            return _read_times(self.times, self.numbered)
        numbers = np.array(list(self.numbered))
        steps = np.diff(numbers)
        least = steps.min(initial=numbers[-1] - numbers[0] or 1)
        odd = steps[steps % least > 0]
        if len(odd):
            raise InputError(
                f"{self.path}: expected numbers that count frames, in steps of {least} or, where "
                f"some were lost, of a multiple of it, found a step of {odd[0]}; number the "
                "images by frame, not by time"
            )
        return np.asarray((numbers - numbers[0]) / least / self.fps_hz)

    @property
    def began_s(self) -> float:
        """When the first image was taken by the clock of the CSV, s; 0 without one."""
        return float(_read_times(self.times, self.numbered)[0]) if self.times else 0.0

    def frames(self) -> Iterator[Frame]:
        """Read one image after the other, some ahead in threads.

        Raises
        ------
        InputError
            If one can't be read, or is of another size or type than the first; as `clock_s`.
        """
        time_s = self.clock_s - self.clock_s[0]
        ahead = _read_ahead(self.numbered.values())
        for at_s, (path, image) in zip(time_s.tolist(), ahead, strict=True):
            if (image.shape, image.dtype) != (self._first.shape, self._first.dtype):
                expected, found = (
                    f"{one.shape[1]}x{one.shape[0]} px in {8 * one.itemsize} bits"
                    for one in (self._first, image)
                )
                raise InputError(
                    f"{path}: expected an image of {expected}, found {found}; move those of "
                    "another size into a folder of their own"
                )
            yield Frame(at_s, (image >> (self.bits - 8)).astype(np.uint8), bits=self.bits)


def times_beside(path: Path) -> Path | None:
    """Return the CSV of times of a folder of images, or of a zip file; None where there is none."""
    places = (path / TIMES, path.with_suffix(".csv"))
    return next((one for one in places if one.is_file()), None)


def _read_times(csv: Path, numbered: dict[int, Picture]) -> NDArray[np.float64]:
    """Return the times, s, that a CSV says of numbered images, by its own clock."""
    import pandas as pd

    with reading(csv, "a readable CSV file"):
        table = pd.read_csv(csv, skipinitialspace=True, dtype=str)
    columns = [
        next((name for name in known if name in table), None)
        for known in (TIME_COLUMNS, PICTURE_COLUMNS)
    ]
    if None in columns:
        raise InputError(
            f"{csv}: expected a column of times in s ({', '.join(TIME_COLUMNS)}) and one of images "
            f"({', '.join(PICTURE_COLUMNS)}), found {', '.join(map(str, table))}; rename them"
        )
    time_s = pd.to_numeric(table[columns[0]], errors="coerce").to_numpy(np.float64)
    names = [str(name) for name in table[columns[1]]]
    found = [_NUMBER.search(PureWindowsPath(name).stem) for name in names]
    at = {int(n[0]): s for n, s in zip(found, time_s, strict=True) if n and np.isfinite(s)}
    if len(at) < len(names):
        raise InputError(
            f"{csv}: expected an image and a time in each of {len(names)} rows, each image once, "
            f"found {len(at)} of them; mend the others, or take them out"
        )
    if strange := sorted(at.keys() ^ numbered.keys()):
        is_named = strange[0] in at
        raise InputError(
            f"{csv}: expected rows for the {len(numbered)} images and no others, found "
            f"{f'{len(at)} rows, one of them' if is_named else 'none'} for number {strange[0]}"
            f"{', which is not there; copy the images again' if is_named else '; add its time'}, "
            "or take it out"
        )
    clock_s = np.array([at[number] for number in numbered])
    back = np.flatnonzero(np.diff(clock_s) <= 0)
    if len(back):
        later = list(numbered.values())[back[0] + 1]
        raise InputError(
            f"{csv}: expected times that rise from image to image, found "
            f"{clock_s[back[0] + 1]:.6f} s for {later.name} after {clock_s[back[0]]:.6f} s; mend "
            "the CSV, or give the true rate (fps_hz, --fps)"
        )
    return clock_s


def _read_ahead(paths: Iterable[Picture]) -> Iterator[tuple[Picture, NDArray[Any]]]:
    """Yield each path and its image in order; the next ones are decoded meanwhile."""
    pool = ThreadPoolExecutor(min(_MOST_THREADS, joblib.cpu_count()))
    coming = ((path, pool.submit(_read, path)) for path in paths)
    waiting = deque(islice(coming, _AHEAD))
    try:
        while waiting:
            path, image = waiting.popleft()
            waiting.extend(islice(coming, 1))
            yield path, image.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _read(path: Picture) -> NDArray[Any]:
    """Return an image in grey, (height, width) uint8 or uint16."""
    with reading(str(path), "a readable image", OSError, zipfile.BadZipFile):
        data = np.frombuffer(path.read_bytes(), np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE | cv2.IMREAD_ANYDEPTH) if data.size else None
    if image is None or image.dtype not in (np.uint8, np.uint16):
        found = "none in it" if image is None else f"{image.dtype}"
        raise InputError(
            f"{path}: expected a readable image of 8 or 16 bits, found {found}; write it with "
            "these, or take it out: a number that is missing is a frame that was lost"
        )
    return np.asarray(image)
