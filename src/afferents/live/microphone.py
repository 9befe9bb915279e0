"""A running microphone: the one that records (`afferents.devices`)."""

import time
from collections.abc import Iterator

import numpy as np

from afferents import devices
from afferents.core.errors import AfferentsError, InputError
from afferents.live.events import Channel, Event, Sound, Trouble

AGAIN_S = 1.0
"""A microphone that vanished is looked for this often, s."""
FULL_SCALE = 32768.0
"""Of 16-bit samples, as wav files have them."""


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
    source
        Another microphone than PortAudio's.

    Raises
    ------
    InputError
        If PortAudio is missing, or there is no such microphone, or not of that rate.
    """

    channel: Channel = "audio"
    speed = 1.0

    def __init__(
        self,
        device: str,
        rate_hz: float,
        n_channels: int = 1,
        source: devices.Microphone | None = None,
    ) -> None:
        """Open it."""
        self.rate_hz = rate_hz
        options = devices.PortAudioMicrophone.Options(
            device=device, rate_hz=rate_hz, channels=n_channels
        )
        self._source = source or devices.PortAudioMicrophone(options)
        self._closed = self._running = False
        self._source.open()

    def close(self) -> None:
        """Let it go; where `events` runs, it does so at its end."""
        self._closed = True
        self._source.end()
        if not self._running:
            self._source.close()

    def events(self) -> Iterator[Event]:
        """Yield its sound; `Trouble` when samples are lost, when it vanishes or comes back."""
        now_s, self._running = 0.0, True
        try:
            while not self._closed:
                try:
                    for event in self._heard():
                        now_s = event.time_s
                        yield event
                except AfferentsError as error:
                    yield Trouble("audio", now_s, str(error))
                    self._reopen()
        finally:
            self._source.close()

    def _heard(self) -> Iterator[Event]:
        count = devices.SampleClock(self.rate_hz)
        for block in self._source.blocks():
            if self._closed:
                return
            if block.overflowed:
                yield Trouble("audio", count.next_s, "microphone: overrun, samples are lost")
                count = devices.SampleClock(self.rate_hz)
            samples = block.samples.astype(np.float32) / FULL_SCALE
            time_s = count.read(len(samples), block.time_s, block.time_s)
            yield Sound(time_s, samples, time.monotonic())

    def _reopen(self) -> None:
        """Wait, and try once to open it again."""
        self._source.close()
        time.sleep(AGAIN_S)
        if self._closed:
            return
        try:
            self._source.open()
        except InputError:
            return
