"""FabricSlide: a finger of 16 capacitive taxels slid over fabrics, as vibration channels.

Wang et al. (2022) Fabric classification using a finger-shaped tactile sensor via robotic
sliding, Front. Neurorobot. 16:808222; github.com/wngfra/FabricSlide (MIT).

One file a slide, ``{Fabric}_F{pressure}_V{signed mm/s}mmps_{repetition}.csv``: a header line,
then integers ``timestamp (ms), proximity1, proximity2, channel1 ... channel16``.

Time. The taxels are put on a regular clock of 28 ms, as the set declares. Its timestamps step
by 27, 28 or 29 ms, never further than rounding from a regular clock, so nothing is resampled.
(Their mean step is 28.08 ms: true frequencies are 0.3 % below the ones of this clock.) A row
written twice, timestamp included, counts once; any other step than 27 to 29 ms is refused,
for a dropped sample would shift every frequency after it.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.recording import Recording, Session
from afferents.recordings.data_set import DataSet

PERIOD_MS = 28
SAMPLE_RATE_HZ = 1000 / PERIOD_MS
"""35.714 Hz; the timestamps themselves say 35.61."""
LEAST_ROWS = 36
_JITTER_MS = 1

_FOLDERS = ("*.csv", "data/fabric/*.csv")
"""Where the files lie: in the folder itself, or as in the public repository."""

COUNTS = "counts"
"""Unit of a taxel: what the sensor's converter counts, uncalibrated."""

TAXELS = tuple(f"channel{n}" for n in range(1, 17))
COLUMNS = ("timestamp", "proximity1", "proximity2", *TAXELS)
_FIRST_TAXEL = COLUMNS.index(TAXELS[0])

_INTEGER = re.compile(r"\s*-?[0-9]{1,18}\s*")
_ROW = re.compile(rf"{_INTEGER.pattern}(,{_INTEGER.pattern}){{{len(COLUMNS) - 1}}}")
_NAME = re.compile(
    r"(?P<fabric>[^_]+)_(?P<pressure>F\d+)_V(?P<sign>-?)(?P<speed>\d+)mmps_(?P<repetition>\d+)"
)


class FabricSlide(DataSet):
    """The set, whole or in part: see `read_fabricslide`.

    Three windows of 128 samples a slide, whatever its speed and so its length, zero-padded to 400
    so that 200 bins reach Nyquist. Taxels have offsets that differ from day to day. Orders are of
    whole slides: their waves are centimetres long, a second sees few of them. The axis of cycles
    per mm is what is heard at all of the set's speeds. Random kernels need windows of one length.
    """

    name, title = "fabricslide", "FabricSlide"
    encodings: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "spectral": {
            "window_s": 128 * 0.028,
            "windows": 3,
            "fft_points": 400,
            "kept_bins": 200,
            "remove_mean": True,
        },
        "orders": {
            "window_s": None,
            "windows": 3,
            "lowest_hz": 0.03,
            "highest_hz": 17.0,
            "bins_per_octave": 8,
            "lowest_per_mm": 0.004,
            "highest_per_mm": 0.11,
        },
        "kernels": {"window_s": 128 * 0.028, "windows": 3, "highest_hz": 17.0},
    }

    @classmethod
    def is_at(cls, path: Path) -> bool:
        """Tell whether files named as slides lie in a folder, or where the repository has them."""
        return any(_named_as_slides(path.glob(files)) for files in _FOLDERS)

    def recordings(self) -> Session:
        """Return a recording a file."""
        return read_fabricslide(self.path)


@dataclass(frozen=True)
class TaxelFile:
    """The 16 taxels of one slide, parsed when asked for.

    Implements `afferents.core.recording.Vibration`.
    """

    path: Path
    sample_rate_hz: float = SAMPLE_RATE_HZ

    @cached_property
    def n_samples(self) -> int:
        """Rows of data; counted without parsing them."""
        return sum(1 for _ in _rows(self._lines()))

    @property
    def n_channels(self) -> int:
        """Taxels."""
        return len(TAXELS)

    def read(self) -> xr.DataArray:
        """Read all taxels.

        Returns
        -------
        xarray.DataArray
            `(audio_time, channel)` float32 counts, channels `channel1` ... `channel16`, with
            the attributes `sample_rate_hz` and `units`.

        Raises
        ------
        InputError
            Naming the line, if the header or a row is not as documented above, or if a
            timestamp does not follow the one before by 27 to 29 ms.
        """
        lines = self._lines()
        self._check_header(lines[0])
        rows = list(_rows(lines))
        if not rows:
            raise InputError(self.path, "rows of data below the header", "none")
        values = self._parse(rows)
        if len(rows) < LEAST_ROWS:
            expected = f"at least {LEAST_ROWS} rows of data below the header, a second"
            raise InputError(self.path, expected, f"{len(rows)}")
        self._check_clock([number for number, _ in rows], values[:, 0])
        return xr.DataArray(
            values[:, _FIRST_TAXEL:].astype(np.float32),
            dims=(dims.AUDIO_TIME, dims.CHANNEL),
            coords={dims.CHANNEL: list(TAXELS)},
            attrs={dims.SAMPLE_RATE: self.sample_rate_hz, dims.UNITS: COUNTS},
        )

    def _lines(self) -> list[str]:
        try:
            return self.path.read_text(encoding="utf-8", errors="replace").rstrip().split("\n")
        except OSError as error:
            raise InputError(self.path, "a readable CSV file", f"{error.strerror}") from error

    def _check_header(self, header: str) -> None:
        found = [name.strip() for name in header.split(",")]
        if found != list(COLUMNS):
            raise InputError(
                f"{self.path}, line 1", f"the columns {', '.join(COLUMNS)}", f"{found}"
            )

    def _parse(self, rows: list[tuple[int, str]]) -> NDArray[np.int64]:
        for number, row in rows:
            if not _ROW.fullmatch(row):
                raise self._bad_row(number, row)
        texts = [row for _, row in rows]
        return np.loadtxt(texts, dtype=np.int64, delimiter=",", ndmin=2, comments=None)

    def _bad_row(self, number: int, row: str) -> InputError:
        where, fields = f"{self.path}, line {number}", row.split(",")
        if len(fields) != len(COLUMNS):
            return InputError(where, f"{len(COLUMNS)} fields", f"{len(fields)}")
        wrong = next(field for field in fields if not _INTEGER.fullmatch(field))
        return InputError(where, "integers", f"'{wrong.strip()}'")

    def _check_clock(self, numbers: list[int], timestamp_ms: NDArray[np.int64]) -> None:
        step = np.diff(timestamp_ms)
        irregular = np.flatnonzero(np.abs(step - PERIOD_MS) > _JITTER_MS)
        if len(irregular):
            raise InputError(
                f"{self.path}, line {numbers[irregular[0] + 1]}",
                f"a timestamp {PERIOD_MS} ms after the one before (within {_JITTER_MS})",
                f"{step[irregular[0]]} ms",
            )


def _rows(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Yield line number and text of each row of data that does not repeat the one before."""
    for number, (previous, row) in enumerate(pairwise(lines), start=2):
        if row != previous:
            yield number, row


def read_fabricslide(root: str | Path) -> Session:
    """Read FabricSlide, whole or in part; its grid keeps its gaps.

    Parameters
    ----------
    root
        The folder of the files, or one above it. Where the files lie in ``data/fabric``, as
        in the public repository, only these are taken (its ``data/board`` holds other slides).

    Returns
    -------
    Session
        Recordings named like their files, with texture = fabric, `speed_mm_s` = magnitude,
        `steady_s` = the whole file, and the conditions `pressure` (``F120``), `direction`
        (``+`` or ``-``) and `repetition`.

    Raises
    ------
    InputError
        If the folder is missing or holds no such file. Files are read when asked for.
    """
    root = Path(root)
    if not root.is_dir():
        raise InputError(root, "a folder of FabricSlide", "no such folder")
    paths = _slides(root)
    if not paths:
        raise InputError(
            root, "files {Fabric}_F{pressure}_V{speed}mmps_{repetition}.csv", "none of them"
        )
    return Session(root, tuple(_recording(path) for path in paths))


def _slides(root: Path) -> list[Path]:
    for files in (*_FOLDERS, "**/*.csv"):
        if found := _named_as_slides(root.glob(files)):
            return found
    return []


def _named_as_slides(paths: Iterable[Path]) -> list[Path]:
    return sorted(path for path in paths if _NAME.fullmatch(path.stem))


def _recording(path: Path) -> Recording:
    name = _NAME.fullmatch(path.stem)
    assert name is not None
    if int(name["speed"]) == 0:
        raise InputError(path, "a slide faster than 0 mm/s", "V0mmps in its name")
    taxels = TaxelFile(path)
    return Recording(
        name=path.stem,
        texture=name["fabric"],
        speed_mm_s=float(name["speed"]),
        source=path,
        audio=taxels,
        steady_s=(0.0, taxels.n_samples / taxels.sample_rate_hz),
        conditions={
            "pressure": name["pressure"],
            "direction": name["sign"] or "+",
            "repetition": int(name["repetition"]),
        },
    )
