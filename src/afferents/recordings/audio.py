"""What a wav file's own header declares; libsndfile counts what is there, whatever that says."""

import os
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
import soundfile
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError, reason_of
from afferents.quality.sound import require_finite

_UNKNOWN_BYTES = frozenset({0, 0xFFFFFFFF, 0xFFFFFFFFFFFFFFFF})
"""Lengths that a recorder writes into a wav whose end it does not know yet."""
_IN_DS64 = 0xFFFFFFFF
"""Length of the data in a file of more than 4 GB: it stands in the chunk `ds64`, in 64 bits."""
_PLAIN = frozenset({0x0001, 0x0003, 0x0006, 0x0007, 0xFFFE})
"""Formats that write each sample by itself: integers, float, A-law, mu-law, extensible. In the
others a block holds many samples."""
_MOST_CHUNKS = 1000
"""No recorder writes more; noise with a wav's first bytes would be walked for long."""


def sound_name(path: Path) -> str | bytes:
    """Return a file's name as libsndfile takes it: bytes, of any letters; wide ones on Windows."""
    return str(path) if sys.platform == "win32" else os.fsencode(path)


def declared_samples(path: Path) -> int | None:
    """Return the samples a channel that a wav declares.

    Returns
    -------
    None where that can't be told: no wav, no data in it, a compressed format, or a length that the
    recorder left open.
    """
    with path.open("rb") as file:
        declared = _declared(file)
    if declared is None:
        return None
    data_bytes, block_align = declared
    return data_bytes // block_align if block_align else None


def _declared(file: BinaryIO) -> tuple[int, int] | None:
    """Return bytes of data and bytes of a sample in all channels; None where not declared."""
    head = file.read(12)
    if head[:4] not in (b"RIFF", b"RIFX", b"RF64", b"BW64") or head[8:] != b"WAVE":
        return None
    order = ">" if head[:4] == b"RIFX" else "<"
    long_bytes: int | None = None
    block_align = 0
    for name, n_bytes in _chunks(file, order):
        if name == b"ds64":
            sizes = file.read(16)
            long_bytes = struct.unpack("<QQ", sizes)[1] if len(sizes) == 16 else None
        elif name == b"fmt ":
            fields = file.read(16)
            if len(fields) < 16 or struct.unpack(f"{order}H", fields[:2])[0] not in _PLAIN:
                return None
            block_align = struct.unpack(f"{order}H", fields[12:14])[0]
        elif name == b"data":
            if n_bytes == _IN_DS64 and long_bytes is not None:
                n_bytes = long_bytes
            return None if n_bytes in _UNKNOWN_BYTES else (n_bytes, block_align)
    return None


def _chunks(file: BinaryIO, order: str) -> Iterator[tuple[bytes, int]]:
    """Yield name and length of each chunk, the file at its content."""
    for _ in range(_MOST_CHUNKS):
        head = file.read(8)
        if len(head) < 8:
            return
        name, n_bytes = struct.unpack(f"{order}4sI", head)
        content = file.tell()
        yield name, n_bytes
        file.seek(content + n_bytes + n_bytes % 2, os.SEEK_SET)


# Sound files as vibration channels.

_BLOCK = 1 << 16
"""Samples read at a time, so that the channels that are not wanted never fill the memory."""

FULL_SCALE = "full scale"
"""Unit of a sample: 1 is the largest value that the file format holds, a float file apart."""


class _Header(NamedTuple):
    sample_rate_hz: float
    n_samples: int
    n_channels: int


@dataclass(frozen=True)
class WavFile:
    """One channel of a sound file; its header is read when first asked for.

    Implements `afferents.store.recording.Vibration`.

    Parameters
    ----------
    path
        A wav, or another format that libsndfile reads.
    channel
        Which channel is the sensor, from 0; -1 for the last. In the published recordings it is
        the second (vibrotactile/process_vibration.ipynb, cell 3).
    """

    path: Path
    channel: int = 1

    @cached_property
    def header(self) -> _Header:
        """Rate, length and channels as the file declares them.

        Raises
        ------
        InputError
            If the file is missing, unreadable, shorter than it declares, or holds no samples.
        """
        if not self.path.is_file():
            raise InputError(f"{self.path}: expected a sound file, found no such file")
        try:
            info = soundfile.info(sound_name(self.path))
        except soundfile.SoundFileError as error:
            raise InputError(
                f"{self.path}: expected a readable sound file, found {reason_of(error)}"
            ) from error
        if info.frames == 0:
            raise InputError(f"{self.path}: expected a sound file with samples, found none in it")
        declared = declared_samples(self.path)
        if declared is not None and info.frames < declared:
            raise self._too_short(declared, info.frames)
        return _Header(float(info.samplerate), int(info.frames), int(info.channels))

    @cached_property
    def sample_rate_hz(self) -> float:
        """Sample rate, Hz."""
        return self.header.sample_rate_hz

    @cached_property
    def n_samples(self) -> int:
        """Samples in each channel."""
        return self.header.n_samples

    @cached_property
    def n_channels(self) -> int:
        """Channels in the file, the sensor's among them."""
        return self.header.n_channels

    def read(self) -> xr.DataArray:
        """Read the sensor's channel.

        Returns
        -------
        xarray.DataArray
            `(audio_time, channel)` float32 with the one channel `sensor`, -1 to 1 (more in a
            float file that goes beyond full scale), and the attributes `sample_rate_hz` and
            `units`.

        Raises
        ------
        InputError
            If the file is unreadable, empty, shorter than it declares, has no such channel, or
            holds NaN or infinite samples in it.
        """
        samples = self.samples()
        require_finite(samples, self.path, self.sample_rate_hz)
        return xr.DataArray(
            samples[:, np.newaxis],
            dims=(dims.AUDIO_TIME, dims.CHANNEL),
            coords={dims.CHANNEL: ["sensor"]},
            attrs={dims.SAMPLE_RATE: self.sample_rate_hz, dims.UNITS: FULL_SCALE},
        )

    def samples(self) -> NDArray[np.float32]:
        """Return the sensor's channel as it stands in the file, (n_samples,).

        A float file may hold NaN, infinite values, or such beyond full scale.

        Raises
        ------
        InputError
            As `read`, but for the samples themselves.
        """
        if not -1 <= self.channel < self.n_channels:
            raise InputError(
                f"{self.path}: expected the sensor on channel {self.channel + 1}, found "
                f"{self.n_channels} channel(s)"
            )
        samples = np.empty(self.n_samples, np.float32)
        n = 0
        try:
            with soundfile.SoundFile(sound_name(self.path)) as file:
                for block in file.blocks(_BLOCK, dtype="float32", always_2d=True):
                    samples[n : n + len(block)] = block[:, self.channel]
                    n += len(block)
        except soundfile.SoundFileError as error:
            raise InputError(
                f"{self.path}: expected a readable sound file, found {reason_of(error)}"
            ) from error
        if n < self.n_samples:
            raise self._too_short(self.n_samples, n)
        return samples

    def _too_short(self, declared: int, found: int) -> InputError:
        return InputError(
            f"{self.path}: expected {declared} samples as it declares, found {found}; copy or "
            "record the file again"
        )
