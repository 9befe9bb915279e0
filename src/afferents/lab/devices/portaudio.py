"""A microphone through PortAudio (sounddevice)."""

import time
from collections.abc import Iterator
from queue import Empty, SimpleQueue
from types import ModuleType
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from afferents.errors import InputError
from afferents.lab.devices.base import Block, Microphone, MicrophoneSettings, Options
from afferents.lab.devices.clock import HostClock
from afferents.plugins import how_to_install

SILENT_S = 2.0
"""A microphone that gives nothing for this time, s, has vanished: sound cards never pause."""
LOOK_S = 0.1


class PortAudioOptions(Options):
    """A microphone.

    Attributes
    ----------
    device
        ``default``, or a number or part of the name as PortAudio lists them.
    rate_hz
        Samples a second.
    channels
        Their number; the published recordings have the sensor second of two.
    block_s
        Length of a block, s.
    buffer_s
        How long the writer may be busy elsewhere before sound is lost, s.
    settle_s
        Sound of this time after it was opened is thrown away, s: until then a sound server's
        times are off by up to half a second.
    """

    kind: Literal["portaudio"] = "portaudio"
    device: str = "default"
    rate_hz: Annotated[float, Field(ge=1000, le=400_000)] = 44_100.0
    channels: Annotated[int, Field(ge=1, le=64)] = 2
    block_s: Annotated[float, Field(ge=0.001, le=1)] = 0.01
    buffer_s: Annotated[float, Field(ge=0.1, le=60)] = 5.0
    settle_s: Annotated[float, Field(ge=0, le=4)] = 1.0


class PortAudioMicrophone(Microphone):
    """A microphone; its blocks carry the converter's time on the monotonic clock.

    PortAudio's own thread puts them into a queue and never waits: what finds it full is lost, and
    the next block says so.
    """

    Options = PortAudioOptions
    options: PortAudioOptions

    _opened = False

    def open(self) -> None:
        """Open it; if it was open before, PortAudio looks for devices again.

        Raises
        ------
        InputError
            If PortAudio is missing, or there is no such microphone, or not of that rate.
        """
        portaudio = import_portaudio()
        if self._opened:
            portaudio._terminate()
            portaudio._initialize()
        self._ended.clear()
        options = self.options
        self._most = max(2, round(options.buffer_s / options.block_s))
        self._blocks: SimpleQueue[Block] = SimpleQueue()
        self._lost_some = False
        self._clock, self._next_s = HostClock(), 0.0
        self._handle = self._start(portaudio, round(options.block_s * options.rate_hz))
        self._settled_s = time.monotonic() + options.settle_s
        self._opened = True
        name = str(portaudio.query_devices(self._handle.device)["name"])
        rate_hz, channels = float(self._handle.samplerate), int(self._handle.channels)
        self.settings = MicrophoneSettings(name, rate_hz, channels)

    def blocks(self) -> Iterator[Block]:
        """Yield its sound from now on."""
        self._begin()
        self._ended.wait(self._settled_s - time.monotonic())
        while not self._blocks.empty():
            self._blocks.get()
        self._lost_some = False  # before now nothing read the queue, which may have been full
        last_s = time.monotonic()
        while not self._ended.is_set():
            try:
                block = self._blocks.get(timeout=LOOK_S)
            except Empty:
                if time.monotonic() - last_s > SILENT_S:
                    raise self._lost("it gives no sound") from None
                continue
            last_s = time.monotonic()
            yield block

    def _start(self, portaudio: ModuleType, size: int) -> Any:
        options = self.options
        device: int | str | None = None if options.device == "default" else options.device
        if options.device.isdigit():
            device = int(options.device)
        try:
            stream = portaudio.InputStream(
                samplerate=options.rate_hz, device=device, channels=options.channels,
                blocksize=size, dtype="int16", callback=self._hear,
            )  # fmt: skip
            stream.start()
        except (portaudio.PortAudioError, ValueError) as error:
            there = [d["name"] for d in portaudio.query_devices() if d["max_input_channels"]]
            raise InputError(
                f"microphone {options.device}: expected one of {options.rate_hz:g} Hz with "
                f"{options.channels} channel(s), found {error} (there are: "
                f"{', '.join(there) or 'none'})"
            ) from error
        return stream

    def _hear(self, samples: NDArray[np.int16], n: int, times: Any, status: Any) -> None:
        """Take samples in PortAudio's own thread: copy, go."""
        arrived_s = time.monotonic()
        if times.inputBufferAdcTime > 0 and times.currentTime > 0:
            ago_s = times.currentTime - times.inputBufferAdcTime
            time_s = self._clock.read(times.currentTime, arrived_s) - ago_s
        else:  # a converter without a clock: samples are counted from the first
            time_s = self._next_s or arrived_s - n / self.options.rate_hz
        self._next_s = time_s + n / self.options.rate_hz
        self._lost_some |= bool(status.input_overflow)
        if self._blocks.qsize() >= self._most:
            self._lost_some = True
            return
        self._blocks.put(Block(time_s, samples.copy(), self._lost_some))
        self._lost_some = False


def import_portaudio() -> ModuleType:
    """Return the module `sounddevice`.

    Raises
    ------
    InputError
        If it or the PortAudio library is missing.
    """
    try:
        import sounddevice
    except (ImportError, OSError) as error:  # OSError: the PortAudio library is not there
        raise InputError(
            f"microphone: expected sounddevice and the PortAudio library, found {error!s}; "
            f"{how_to_install('lab')}; on Debian also apt-get install libportaudio2"
        ) from error
    return sounddevice  # type: ignore[no-any-return]
