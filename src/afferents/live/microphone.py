"""A running microphone, through PortAudio (sounddevice)."""

import queue
import time
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.live.clock import HostClock
from afferents.live.events import Channel, Event, Sound, Trouble

CHUNK_S = 0.01
AGAIN_S = 1.0
"""A microphone that vanished is looked for this often, s."""
SILENT_S = 2.0
"""One that gives nothing for so long has vanished: sound cards never pause."""
LOST_S = 0.02
"""A clock that is off by more than this from the count tells of lost samples."""
FOLLOW = 0.01
"""Share by which the count of samples follows the clock of the converter, a chunk."""

Chunk = tuple[NDArray[np.float32], float, float, bool]
"""Samples, time of the first by the converter, arrival, and whether some were lost before."""


class Microphone:
    """Sound of a microphone as it comes; when it vanishes it is waited for.

    Parameters
    ----------
    device
        ``default``, or a number or part of the name as PortAudio lists them.
    rate_hz
        Sample rate asked for.
    n_channels
        Channels asked for.

    Raises
    ------
    InputError
        If PortAudio is missing, or there is no such microphone, or not of that rate.
    """

    channel: Channel = "audio"
    speed = 1.0

    def __init__(self, device: str, rate_hz: float, n_channels: int = 1) -> None:
        """Open it."""
        self.rate_hz = rate_hz
        self._n_channels = n_channels
        self._device: int | str | None = None if device == "default" else device
        if device.isdigit():
            self._device = int(device)
        self._chunks: queue.SimpleQueue[Chunk] = queue.SimpleQueue()
        self._closed = False
        self._portaudio = _portaudio()
        self._stream = self._open()

    def close(self) -> None:
        """Let it go."""
        self._closed = True
        self._stream.close(ignore_errors=True)

    def events(self) -> Iterator[Event]:
        """Yield its sound; `Trouble` when samples are lost, when it vanishes or comes back."""
        count = SampleClock(self.rate_hz)
        try:
            while not self._closed:
                try:
                    samples, taken_s, arrived_s, lost = self._chunks.get(timeout=SILENT_S)
                except queue.Empty:
                    yield Trouble("audio", count.next_s, "microphone: it gives no sound")
                    self._reopen()
                    count = SampleClock(self.rate_hz)
                    continue
                if lost:
                    yield Trouble("audio", count.next_s, "microphone: overrun, samples are lost")
                    count = SampleClock(self.rate_hz)
                yield Sound(count.read(len(samples), taken_s, arrived_s), samples, arrived_s)
        finally:
            self.close()

    def _reopen(self) -> None:
        """Try once to open it again; PortAudio must be told to look for devices."""
        self._stream.close(ignore_errors=True)
        time.sleep(AGAIN_S)
        self._portaudio._terminate()
        self._portaudio._initialize()
        try:
            self._stream = self._open()
        except InputError:
            return

    def _open(self) -> Any:
        portaudio = self._portaudio
        try:
            stream = portaudio.InputStream(
                samplerate=self.rate_hz,
                device=self._device,
                channels=self._n_channels,
                blocksize=round(CHUNK_S * self.rate_hz),
                dtype="float32",
                callback=self._hear,
            )
            stream.start()
        except (portaudio.PortAudioError, ValueError) as error:
            there = [d["name"] for d in portaudio.query_devices() if d["max_input_channels"]]
            raise InputError(
                f"microphone {'default' if self._device is None else self._device}",
                f"one of {self.rate_hz:g} Hz with {self._n_channels} channel(s)",
                f"{error} (there are: {', '.join(there) or 'none'})",
            ) from error
        return stream

    def _hear(self, samples: NDArray[np.float32], _: int, times: Any, status: Any) -> None:
        """Take samples from PortAudio's own thread: copy, leave them, go."""
        if self._closed:
            return
        taken_s = float(times.inputBufferAdcTime)
        lost = bool(status.input_overflow)
        self._chunks.put((samples.copy(), taken_s, time.monotonic(), lost))


class SampleClock:
    """When samples were taken: counted at their rate, after the converter's clock.

    Converters say when a chunk was taken to some ms only; counted samples are regular.
    """

    def __init__(self, rate_hz: float) -> None:
        """Begin at the first chunk."""
        self._rate_hz = rate_hz
        self._clock = HostClock()
        self.next_s = 0.0
        self._taken_s: float | None = None

    def read(self, n: int, taken_s: float, arrived_s: float) -> float:
        """Return when the first of the next n samples was taken, on the monotonic clock, s."""
        first = self._taken_s is None
        if self._taken_s is None or taken_s > self._taken_s:
            stamp = self._clock.read(taken_s, arrived_s)
        else:  # a converter without a clock
            stamp = self.next_s
        self._taken_s = taken_s
        off_s = stamp - self.next_s
        begin_s = stamp if first or abs(off_s) >= LOST_S else self.next_s + FOLLOW * off_s
        self.next_s = begin_s + n / self._rate_hz
        return begin_s


def _portaudio() -> ModuleType:
    try:
        import sounddevice
    except (ImportError, OSError) as error:  # OSError: the PortAudio library is not there
        raise InputError(
            "microphone",
            "sounddevice and the PortAudio library",
            str(error),
            "pip install 'afferents[live]'; on Debian also apt-get install libportaudio2",
        ) from error
    return sounddevice  # type: ignore[no-any-return]
