"""A fingertip as a sensor: SA-I, RA-I, RA-II and shear of every frame, as `extract` stores them."""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from afferents.lab.live import events, sensors, streams
from afferents.lab.live.follower import Follower
from afferents.lab.live.sources import find_sensor, open_sources
from afferents.lab.live.touch import NO_SOUND, NO_TIMES, Response, Touch
from afferents.markers.sensor import Sensor, resolve_sensor

MOST_SOUND_S = 5.0
"""Sound that waits for a frame is kept for this time."""


class Fingertip(AbstractContextManager["Fingertip", None]):
    """Gives a `Touch` for each frame of a running camera, clip or rig; see `stream`.

    Parameters
    ----------
    sources
        One of video, and one of audio or none; closed with it.
    sensor
        What markers look like, and where they are; None to find them in the first frames.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Attributes
    ----------
    fps_hz, sample_rate_hz
        Of the sources; None where there is no sound.
    is_live
        Whether it runs on a device: times are of this machine's monotonic clock.
    """

    def __init__(
        self, sources: Sequence[events.Source], sensor: Sensor | None, audio_offset_s: float = 0.0
    ) -> None:
        """Wait for the first frame, with the skin at rest."""
        self._sources = sources
        self.is_live = isinstance(sources[0], sensors.DeviceSource)
        rates = {source.channel: source.rate_hz for source in sources}
        self.fps_hz, self.sample_rate_hz = rates["video"], rates.get("audio")
        self._offset_s = audio_offset_s
        self._follower = Follower(sensor, self.fps_hz)
        self._pieces: list[tuple[NDArray[np.float64], Response]] = []
        self._sound_ends_s: float | None = None

    @property
    def sensor(self) -> Sensor | None:
        """Which is followed; None until its markers are found, if it was not given."""
        return self._follower.sensor

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let go of camera and microphone."""
        for source in self._sources:
            source.close()

    def __iter__(self) -> Iterator[Touch]:
        """Yield a touch for each frame, from the rest frame on, until the sources end.

        The first come once `N_FIRST` frames have shown where the skin is at rest. A loop that
        takes them too slowly from a running source misses some, which are counted as dropped.

        Raises
        ------
        InputError
            If the first frames don't show the sensor's markers.
        """
        for event in self._take_events():
            if isinstance(event, events.Sound):
                self._listen(event)
                continue
            for _, touch in self._follow(event):
                if self.sample_rate_hz is None:
                    yield touch
                else:
                    samples, times = self._take_sound(touch.time_s)
                    yield replace(touch, ra2=samples, ra2_time_s=times)

    def set_rest(self) -> None:
        """Let displacement count from where the markers are now.

        That is where the next ten frames show them, if nothing moves in these; whether it
        was set, or why not, is among the `events` of the last of them.
        """
        self._follower.set_rest()

    def _take_events(self) -> Iterator[events.Event]:
        """Yield what the sources give, and that the video ends."""
        if any(math.isfinite(source.speed) for source in self._sources):
            mailbox = events.Mailbox()
            for source in self._sources:
                mailbox.take_from(source)
            yield from (event for event in mailbox.take(1.0) if event is not None)
        else:
            yield from events.take_in_order(self._sources, self._time_of)
        yield events.Begin("video", math.nan)

    def _follow(self, event: events.Event) -> Iterable[tuple[events.CameraFrame, Touch]]:
        """Yield the touches of a frame, or of the first ones where the video ends."""
        follower = self._follower
        if isinstance(event, events.CameraFrame):
            is_paced = math.isfinite(self._sources[0].speed)
            late = is_paced and time.monotonic() - event.arrived_s > streams.LATE_S
            follower.counters.late += late
            yield from follower.feed(event, late) or ()
        elif isinstance(event, events.Trouble):
            follower.counters.troubles += 1
            follower.note(event.what)
            if event.channel == "video":
                follower.skip()
        elif event.channel == "video":
            yield from follower.finish()
            follower.begin()
        else:
            self._sound_ends_s = None

    def _time_of(self, event: events.Event) -> float:
        """Return when something was, s on the video's clock."""
        return event.time_s - (self._offset_s if event.channel == "audio" else 0.0)

    def _listen(self, sound: events.Sound) -> None:
        """Keep samples for the next frame."""
        assert self.sample_rate_hz is not None
        begin_s, n = self._time_of(sound), len(sound.samples)
        self._follower.counters.samples += n
        if self._sound_ends_s is not None and begin_s - self._sound_ends_s > streams.JUMP_S:
            lost = round((begin_s - self._sound_ends_s) * self.sample_rate_hz)
            self._follower.counters.lost_samples += lost
        self._sound_ends_s = begin_s + n / self.sample_rate_hz
        self._pieces.append((begin_s + np.arange(n) / self.sample_rate_hz, sound.samples))
        while begin_s - self._pieces[0][0][0] > MOST_SOUND_S:  # the camera gives nothing
            self._follower.counters.lost_samples += len(self._pieces.pop(0)[0])

    def _take_sound(self, time_s: float) -> tuple[Response, NDArray[np.float64]]:
        """Return the samples that were taken by then and are not given out yet, and their times."""
        if not self._pieces:
            return NO_SOUND, NO_TIMES
        times, samples = (np.concatenate(part) for part in zip(*self._pieces, strict=True))
        n = int(np.searchsorted(times, time_s, "right"))
        self._pieces = [(times[n:], samples[n:])] if n < len(times) else []
        return samples[:n], times[:n]


def stream(
    video: str | Path,
    audio: str | Path | None = None,
    sensor: str | Path | Sensor | None = None,
    audio_offset_s: float = 0.0,
    speed: float = math.inf,
    fps_hz: float | None = None,
    exposure_ms: float | None = None,
) -> Fingertip:
    """Open a fingertip, and read what its skin feels frame by frame.

    Parameters
    ----------
    video
        ``camera:0``, a clip, a recording's folder, or ``rig`` (``rig:g/50`` for one drum).
    audio
        ``mic:default``, a sound file, a recording's folder, or ``rig``; None without sound.
    sensor
        A sensor file, or the name of a packaged one. None: markers are found at rest, as
        `calibrate` finds them; write a file for markers that keep their order between runs.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s (`afferents align`).
    speed
        Of clips: seconds of theirs in a second; infinite for as fast as they are read.
    fps_hz
        Frame rate requested of a camera, or a clip's true one; None for its own.
    exposure_ms
        Of the camera; None leaves it.

    Raises
    ------
    InputError
        If there is no such source, or no sensor is known.

    Examples
    --------
    >>> with stream("session/1/20", sensor="tip_b") as fingertip:
    ...     largest = [touch.sa1.max() for touch in fingertip]
    >>> len(largest)
    35
    """
    events.require_offset(audio_offset_s)
    given = None if sensor is None else resolve_sensor(sensor)
    known = given or find_sensor(str(video), fps_hz=fps_hz)
    channels: frozenset[events.Channel] = events.BOTH if audio is not None else frozenset({"video"})
    wanted, sound = events.Wanted(channels, known, fps_hz), None if audio is None else str(audio)
    sources = open_sources(str(video), sound, wanted, speed, exposure_ms, fps_hz)
    return Fingertip(sources, known, audio_offset_s)
