"""Sound files as vibration channels, whole or refused: libsndfile counts what is there."""

import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import av
import numpy as np
import soundfile
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError, reading
from afferents.quality.sound import require_finite
from afferents.recordings.media import SOUNDS

_TOO_LONG = re.compile(r"^(?:data : (\d+) \(should|  Data size : (\d+))", re.MULTILINE)
_A_SAMPLE = re.compile(r"^  Block Align +: (\d+)", re.MULTILINE)
"""What libsndfile notes of a wav whose data are longer than the file (or of any of more than 4 GB),
and of the bytes of a sample in all channels (of a compressed one, of a block of many)."""
_AFTER = re.compile(r"(?:Unknown chunk|Have 0) marker.* at position (\d+)")
"""What libsndfile notes where a wav goes on after the data that it declares, with no chunk."""
_STRAY, _STRAY_BYTES = 0.01, 2048
"""Share of a file that such bytes may be, and how many in any case: recorders that fill up their
blocks, or end before they note the last one in the header, leave some."""
_UNKNOWN = 2**63 - 1
"""Samples that libsndfile tells of a FLAC that was written to a pipe."""
_OPEN = 0xFFFFFFFF
"""Length that a recorder writes into a wav whose end it does not know yet."""


def sound_name(path: Path) -> str | bytes:
    """Return a file's name as libsndfile takes it: bytes, of any letters; wide ones on Windows."""
    return str(path) if sys.platform == "win32" else os.fsencode(path)


@contextmanager
def reading_sound(path: Path) -> Iterator[None]:
    """Say in a sentence that names the file what libsndfile raises; see `errors.reading`."""
    again = f"export it again, or try 'ffmpeg -i {path.name} OUT.wav'"
    do = again if path.suffix.lower() in SOUNDS else advise_conversion(path)
    with reading(path, "a readable sound file", soundfile.SoundFileError, do=do):
        try:
            yield
        except soundfile.LibsndfileError as error:  # whose words name the file once more
            found = error.error_string.rstrip(".")
            raise soundfile.SoundFileError(f"none that libsndfile reads ({found})") from error


def advise_conversion(path: Path) -> str:
    """Return how sound in a format that is not read becomes a file that is."""
    return f"'ffmpeg -i {path.name} -vn {path.stem}.wav' writes sound that is read"


def sound_within(videos: Sequence[Path]) -> list[str]:
    """Return how many videos hold sound, which is not read from them; nothing where none does."""
    found = []
    for path in videos:
        with suppress(av.FFmpegError, OSError), av.open(f"file:{path}") as container:
            found += [path] if container.streams.audio else []
    of = f"{len(found)} of {len(videos)} videos hold" if len(videos) > 1 else "The video holds"
    return [f"{of} sound, which is left out: {advise_conversion(found[0])}."] if found else []


_BLOCK = 1 << 16
"""Samples read at a time, so that the channels that are not wanted never fill the memory."""

FULL_SCALE = "full scale"
"""Unit of a sample: 1 is the largest value that the file format holds, a float file apart."""


@dataclass(frozen=True)
class WavFile:
    """One channel of a sound file; its header is read when first needed.

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
    def header(self) -> Any:
        """Rate, length and channels as the file declares them, by libsndfile's own names.

        Raises
        ------
        InputError
            If the file is missing, unreadable, shorter or longer than it declares, or holds no
            samples.
        """
        with reading_sound(self.path):
            info = soundfile.info(sound_name(self.path))
        after, size = _AFTER.search(info.extra_info), self.path.stat().st_size
        if after and (rest := size - int(after[1])) > max(_STRAY * size, _STRAY_BYTES):
            raise InputError(
                f"{self.path}: expected a wav whose header says how long it is, found {rest} bytes "
                f"after the {info.frames} samples that it declares; close the header: ffmpeg "
                f"-ignore_length 1 -i {self.path.name} OUT.wav"
            )
        if info.frames == 0:
            raise InputError(f"{self.path}: expected a sound file with samples, found none in it")
        if info.frames == _UNKNOWN:
            raise InputError(
                f"{self.path}: expected a sound file that says how long it is, found a stream; "
                f"write it again: ffmpeg -i {self.path.name} OUT.wav"
            )
        # The samples a channel that a wav declares beyond its end; 0 where it declares none.
        data, a_sample = (one.search(info.extra_info) for one in (_TOO_LONG, _A_SAMPLE))
        n_bytes = int(data[1] or data[2]) if data else 0
        declared = n_bytes // int(a_sample[1]) if a_sample and n_bytes != _OPEN else 0
        if info.frames < declared:
            raise self._too_short(declared, info.frames)
        return info

    @cached_property
    def sample_rate_hz(self) -> float:
        """Sample rate, Hz."""
        return float(self.header.samplerate)

    @cached_property
    def n_samples(self) -> int:
        """Samples in each channel."""
        return int(self.header.frames)

    @cached_property
    def n_channels(self) -> int:
        """Channels in the file, the sensor's among them."""
        return int(self.header.channels)

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
        with reading_sound(self.path), soundfile.SoundFile(sound_name(self.path)) as file:
            for block in file.blocks(_BLOCK, dtype="float32", always_2d=True):
                samples[n : n + len(block)] = block[:, self.channel]
                n += len(block)
        if n < self.n_samples:
            raise self._too_short(self.n_samples, n)
        return samples

    def _too_short(self, declared: int, found: int) -> InputError:
        return InputError(
            f"{self.path}: expected {declared} samples as it declares, found {found}; copy or "
            "record the file again"
        )
