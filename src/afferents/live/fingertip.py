"""A fingertip as a sensor: SA-I, RA-I, RA-II and shear of every frame, as `extract` stores them."""

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS, Skin
from afferents.errors import InputError
from afferents.live.events import (
    BOTH,
    CameraFrame,
    Channel,
    Event,
    Mailbox,
    Sound,
    Source,
    Trouble,
    Wanted,
    in_order,
    require_finite,
)
from afferents.live.prediction import Counters
from afferents.live.rest import NewRest, have_moved
from afferents.live.sensor_streams import JUMP_S, LATE_S, MISSING, Cadence
from afferents.live.sensors import DeviceSource
from afferents.live.sources import open_sources, sensor_of
from afferents.markers.detect import Positions, undistort
from afferents.markers.grid import Grid
from afferents.markers.places import images_of
from afferents.markers.rest import N_FIRST, count_stale
from afferents.markers.sensor import Sensor, sensor_in
from afferents.markers.track import Tracker, start_at_rest
from afferents.store.recording import Frame

Response = NDArray[np.float32]
MOST_SOUND_S = 5.0
"""Sound that waits for a frame is kept for so long."""
_NO_SOUND = np.zeros((0, 1), np.float32)


@dataclass(frozen=True, eq=False)
class Touch:
    """What one frame says of the skin; arrays are float32, as in a store.

    Attributes
    ----------
    time_s
        When the frame was taken, on the source's clock, s. Frames that are missing are a gap.
    now
        Where the markers are, (marker, space), px, x right and y down, as a lens without distortion
        shows them; NaN where lost. And where displacement counts from.
    before
        The same of the frame just before; None in the first, and after a gap.
    step_s
        How long ago that was, s.
    grid
        Places of the markers in a tactile image; None for layouts without.
    ra2, ra2_time_s
        What the microphone gave since the frame before: samples (n, channel), full scale 1, and
        when each was taken, (n,), s on the video's clock.
    quality
        What was counted so far; see `Counters`.
    events
        In a sentence each: what happened since the frame before (sources that went and came, rest
        that was set anew or not).
    """

    time_s: float
    now: Skin
    before: Skin | None
    step_s: float
    grid: Grid | None
    ra2: Response
    ra2_time_s: NDArray[np.float64]
    quality: Counters
    events: tuple[str, ...] = ()

    @cached_property
    def position(self) -> Response:
        """Where the markers are, (marker, space), px; NaN where lost."""
        return self.now.position.astype(np.float32)

    @cached_property
    def sa1(self) -> Response:
        """SA-I of each marker (Eq. 1), (marker,), px; NaN where lost."""
        return self.now.distance.astype(np.float32)

    @cached_property
    def ra1(self) -> Response:
        """RA-I of each marker (Eq. 2), (marker,), px/frame; NaN where lost, and after a gap."""
        if self.before is None:
            return np.full(len(self.now.rest), np.nan, np.float32)
        return np.asarray(np.abs(self.now.distance - self.before.distance), np.float32)

    @cached_property
    def speed(self) -> Response:
        """How fast each marker moves, (marker,), px/s; NaN where lost, and after a gap."""
        if self.before is None:
            return np.full(len(self.now.rest), np.nan, np.float32)
        way = np.hypot(*(self.now.position - self.before.position).T)
        return np.asarray(way / self.step_s, np.float32)

    @cached_property
    def shear(self) -> Response:
        """The six parts of the global shear (`channels.PARTS`), (6,), px."""
        kept = Skin(self.position, self.now.rest.astype(np.float32).astype(np.float64))
        return np.asarray(CHANNELS[dims.SHEAR].step(kept, None), np.float32)

    @property
    def lost(self) -> float:
        """Share of the markers that were not found."""
        return float(np.isnan(self.now.position[:, 0]).mean())

    @property
    def touching(self) -> bool:
        """Whether something touches the skin: more markers are off rest than tracking moves."""
        return have_moved(self.now.distance)

    def image(self, name: str) -> Response:
        """Return `sa1`, `ra1` or `speed` as a tactile image, (row, column); NaN where lost.

        Raises
        ------
        InputError
            If the name is none of these, or the sensor file does not say where markers stand.
        """
        if name not in (dims.SA1, dims.RA1, "speed"):
            raise InputError(f"image: expected sa1, ra1 or speed, found {name!r}")
        if self.grid is None:
            raise InputError("image: expected a sensor file that says where the markers are")
        images = images_of(getattr(self, name)[np.newaxis], self.grid.row, self.grid.column)
        return np.asarray(images[0])


class Fingertip:
    """Gives a `Touch` for each frame of a running camera, clip or rig; see `stream`.

    Parameters
    ----------
    sources
        One of video, and one of audio or none; closed with it.
    sensor
        Says what markers look like, and where they are.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Attributes
    ----------
    sensor
        As given.
    fps_hz, sample_rate_hz
        Of the sources; None where there is no sound.
    is_live
        Whether it runs on a device: times are of this machine's monotonic clock.
    """

    def __init__(
        self, sources: Sequence[Source], sensor: Sensor, audio_offset_s: float = 0.0
    ) -> None:
        """Wait for the first frame, with the skin at rest."""
        self.sensor = sensor
        self._sources = sources
        self.is_live = isinstance(sources[0], DeviceSource)
        rates = {source.channel: source.rate_hz for source in sources}
        self.fps_hz, self.sample_rate_hz = rates["video"], rates.get("audio")
        self._offset_s = audio_offset_s
        self._counters = Counters()
        self._said: list[str] = []
        self._pieces: list[tuple[NDArray[np.float64], Response]] = []
        self._sound_ends_s: float | None = None
        self._tracker: Tracker | None = None
        self._before: Skin | None = None
        self._resting: NewRest | None = None
        self._first: list[tuple[Frame, bool]] = []
        self._begin()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Let go of camera and microphone."""
        for source in self._sources:
            source.close()

    def __iter__(self) -> Iterator[Touch]:
        """Yield a touch for each frame, from the rest frame on, until the sources end.

        The first come once `N_FIRST` frames have shown where the skin is at rest. Who takes them
        too slowly from a running source misses some, which are counted as dropped.

        Raises
        ------
        InputError
            If the first frames don't show the sensor's markers.
        """
        for event in self._events():
            if isinstance(event, CameraFrame):
                yield from self._look(event)
            elif isinstance(event, Sound):
                self._listen(event)
            elif isinstance(event, Trouble):
                self._counters.troubles += 1
                self._said.append(event.what)
                self._follows = False
            elif event.channel == "video":
                yield from self._start()
                self._begin()
            else:
                self._sound_ends_s = None
        yield from self._start()

    def set_rest(self) -> None:
        """Let displacement count from where the markers are now.

        That is where the next ten frames show them, if nothing moves in these; whether it
        was set, or why not, is among the `events` of the last of them.
        """
        self._resting = NewRest()

    def _begin(self) -> None:
        """Take the next frame for the first of a recording, with the skin at rest."""
        self._tracker = self._before = self._resting = None
        self._first, self._n, self._follows = [], 0, True
        self._cadence = Cadence(self.fps_hz)
        self._last_s = math.nan

    def _events(self) -> Iterator[Event]:
        """Yield what the sources give: as it comes, or of recordings in the order of its time."""
        if any(math.isfinite(source.speed) for source in self._sources):
            mailbox = Mailbox()
            for source in self._sources:
                mailbox.take_from(source)
            while True:
                try:
                    event = mailbox.get(1.0)
                except EOFError:
                    return
                if event is not None:
                    yield event
        else:
            yield from in_order(self._sources, self._time_of)

    def _time_of(self, event: Event) -> float:
        """Return when something was, s on the video's clock."""
        return event.time_s - (self._offset_s if event.channel == "audio" else 0.0)

    def _listen(self, sound: Sound) -> None:
        """Keep samples for the next frame."""
        assert self.sample_rate_hz is not None
        begin_s, n = self._time_of(sound), len(sound.samples)
        self._counters.samples += n
        if self._sound_ends_s is not None and begin_s - self._sound_ends_s > JUMP_S:
            lost = round((begin_s - self._sound_ends_s) * self.sample_rate_hz)
            self._counters.lost_samples += lost
        self._sound_ends_s = begin_s + n / self.sample_rate_hz
        self._pieces.append((begin_s + np.arange(n) / self.sample_rate_hz, sound.samples))
        while begin_s - self._pieces[0][0][0] > MOST_SOUND_S:  # the camera gives nothing
            self._counters.lost_samples += len(self._pieces.pop(0)[0])

    def _look(self, picture: CameraFrame) -> Iterator[Touch]:
        """Follow the markers into the next frame; the first frames wait until there are enough."""
        self._counters.frames += 1
        if picture.torn:
            self._counters.torn += 1
            self._follows, self._cadence.last_s = False, picture.time_s
            return
        periods = self._cadence.step(picture.time_s)
        if periods is None:
            self._counters.doubled += 1
            return
        if not 0 <= periods <= MISSING:
            self._counters.dropped += max(0, round(periods) - 1)
            self._follows = False
        follows, self._follows = self._follows, True
        if math.isfinite(self._sources[0].speed):
            self._counters.late += time.monotonic() - picture.arrived_s > LATE_S
        self._n += 1
        if self._tracker is not None:
            position = self._tracker.step(picture.frame.luma).position
            yield self._felt(picture.frame, position, follows)
        elif self._n > self.sensor.rest_frame:
            luma = picture.frame.luma.copy()  # a camera's memory is used again
            self._first.append((picture.frame._replace(luma=luma), follows))
            if len(self._first) == N_FIRST:
                yield from self._start()

    def _start(self) -> Iterator[Touch]:
        """Find the markers in the first frames, and follow them through these."""
        if self._tracker is not None or not self._first:
            return
        n_stale = count_stale([frame.image for frame, _ in self._first], self.sensor)
        first = self._first[n_stale:]
        begun = start_at_rest([frame for frame, _ in first], "the first pictures", self.sensor)
        self._tracker, self._grid, self._first = begun.tracker, begun.grid, []
        self._rest = undistort(self._tracker.rest_position, self.sensor.lens)
        yield self._felt(first[0][0], self._tracker.at_rest(begun.present).position, False)
        for frame, follows in first[1:]:
            yield self._felt(frame, self._tracker.step(frame.luma).position, follows)

    def _felt(self, frame: Frame, position: Positions, follows: bool) -> Touch:
        """Return what a frame says, with the sound that came before it.

        Parameters
        ----------
        follows
            Whether the frame felt last is the one just before.
        """
        now = Skin(undistort(position, self.sensor.lens), self._rest)
        before = self._before if follows else None
        step_s, self._last_s, self._before = frame.time_s - self._last_s, frame.time_s, now
        if self._resting is not None:
            done = self._resting.feed(now.position, now.rest)
            if done is not None:
                (rest, what), self._resting = done, None
                self._said.append(what)
                if rest is not None:
                    self._rest, before = rest, None
                    self._before = now = Skin(now.position, rest)
        said, self._said = tuple(self._said), []
        times, samples = self._sound_until(frame.time_s)
        counted = Counters(**vars(self._counters))
        return Touch(frame.time_s, now, before, step_s, self._grid, samples, times, counted, said)

    def _sound_until(self, time_s: float) -> tuple[NDArray[np.float64], Response]:
        """Return the samples that were taken by then and are not given out yet."""
        if not self._pieces:
            return np.zeros(0), _NO_SOUND
        times, samples = (np.concatenate(part) for part in zip(*self._pieces, strict=True))
        n = int(np.searchsorted(times, time_s, "right"))
        self._pieces = [(times[n:], samples[n:])] if n < len(times) else []
        return times[:n], samples[:n]


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
        A sensor file, or the name of a packaged one. None: a clip's markers are found as
        `calibrate` finds them; a camera needs one.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s (`afferents align`).
    speed
        Of clips: seconds of theirs in a second; infinite for as fast as they are read.
    fps_hz
        Frame rate asked of a camera, or a clip's true one; None for its own.
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
    require_finite(audio_offset_s)
    given = None if sensor is None else sensor_in(sensor)
    known = given or sensor_of(str(video), fps_hz)
    channels: frozenset[Channel] = BOTH if audio is not None else frozenset({"video"})
    wanted, sound = Wanted(channels, known, fps_hz), None if audio is None else str(audio)
    sources = open_sources(str(video), sound, wanted, speed, exposure_ms, fps_hz)
    return Fingertip(sources, known, audio_offset_s)
