"""A microphone's samples on disk: a wav whose header is right every second, and its repair."""

import os
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError

_HEADER = struct.Struct("<4sI4s4sIHHIIHH4sI")
_DATA_AT = _HEADER.size - 8
SAMPLE_BYTES = 2
LONGEST_BYTES = 0xFFFFFFFF - _HEADER.size
"""A wav says in 32 bits how much there is."""


class Sound:
    """A 16-bit wav that is being recorded; closing it twice is no error.

    Parameters
    ----------
    path
        File to write.
    rate_hz, channels
        Of the microphone.
    """

    def __init__(self, path: Path, rate_hz: float, channels: int) -> None:
        """Open the file."""
        self.path = path
        self._rate_hz, self._channels = round(rate_hz), channels
        self.n_samples = 0
        self._patched = 0
        self._file = path.open("wb", buffering=0)
        self._file.write(_header(self._rate_hz, channels, 0))

    def write(self, samples: NDArray[np.int16]) -> None:
        """Write samples, (n, channel).

        Raises
        ------
        OSError
            If the disk is full.
        """
        content = np.ascontiguousarray(samples, "<i2").tobytes()
        written = self._file.write(content)
        if written != len(content):
            raise OSError(28, os.strerror(28), str(self.path))
        self.n_samples += len(samples)
        if self.n_samples - self._patched >= self._rate_hz:
            self._patch()

    def close(self) -> None:
        """Write the last length."""
        if not self._file.closed:
            try:
                self._patch()
            finally:
                self._file.close()

    def _patch(self) -> None:
        """Write into the header how much there is."""
        self._patched = self.n_samples
        head = _header(self._rate_hz, self._channels, self.n_samples)
        self._file.seek(0)
        self._file.write(head)
        self._file.seek(0, os.SEEK_END)


def repair(path: Path) -> int:
    """Let the header of a wav of ours, whose recording broke off, say what is in the file.

    Returns
    -------
    Samples a channel that are in it now; 0 where there is no such file.

    Raises
    ------
    InputError
        If it is no wav that was recorded here.
    """
    if not path.is_file():
        return 0
    with path.open("r+b") as file:
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            return 0
        fields = _HEADER.unpack(head)
        if (fields[0], fields[2], fields[11]) != (b"RIFF", b"WAVE", b"data"):
            raise InputError(path, "a wav that 'afferents record' began", "another file")
        channels, rate_hz = fields[6], fields[7]
        n: int = (path.stat().st_size - _HEADER.size) // (SAMPLE_BYTES * channels)
        file.truncate(_HEADER.size + n * SAMPLE_BYTES * channels)
        file.seek(0)
        file.write(_header(rate_hz, channels, n))
    return n


def _header(rate_hz: int, channels: int, n_samples: int) -> bytes:
    frame = SAMPLE_BYTES * channels
    n_bytes = min(n_samples * frame, LONGEST_BYTES // frame * frame)
    return _HEADER.pack(
        b"RIFF", n_bytes + _DATA_AT, b"WAVE", b"fmt ", 16, 1, channels, rate_hz,
        rate_hz * frame, frame, 8 * SAMPLE_BYTES, b"data", n_bytes,
    )  # fmt: skip
