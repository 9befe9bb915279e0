"""From frames to touches: markers followed through gaps, torn frames and rest set anew."""

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import median_low
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS, NO_DISPLACEMENT, Skin
from afferents.errors import InputError
from afferents.lab.live.events import CameraFrame
from afferents.lab.live.prediction import Counters
from afferents.lab.live.rest import NewRest, have_moved
from afferents.markers.calibrate import calibrate_from_clips
from afferents.markers.cells import Cells
from afferents.markers.detect import Positions, upright
from afferents.markers.grid import Grid
from afferents.markers.places import images_of
from afferents.markers.rest import N_FIRST, check_size, count_stale
from afferents.markers.sensor import Sensor
from afferents.markers.track import Begun, Tracker, start_at_rest
from afferents.markers.windowed import Tracked
from afferents.store.recording import Frame, Video

Response = NDArray[np.float32]
NO_SOUND = np.zeros((0, 1), np.float32)
NO_TIMES = np.zeros(0)


@dataclass(frozen=True, eq=False)
class Touch:
    """What one frame says of the skin; arrays are float32, as in a store.

    Attributes
    ----------
    time_s
        When the frame was taken, on the source's clock, s. Frames that are missing are a gap.
    seen
        Where the picture shows markers, (marker, space), px, x right and y down; NaN where lost.
    now
        Where they are as an upright camera without distortion shows them, and where displacement
        counts from.
    before
        The same of the frame just before; None in the first, and after a gap.
    step_s
        How long ago that was, s.
    grid
        Places of the markers in a tactile image; None for layouts without.
    ra2, ra2_time_s
        What the microphone gave since the frame before: samples (n, channel), full scale 1, and
        when each was taken, (n,), s on the video's clock.
    late
        Whether the frame came so late that it tells of the past.
    quality
        What was counted so far; see `Counters`.
    events
        In a sentence each: what happened since the frame before (sources that went and came, rest
        that was set anew or not).
    ra2, ra2_time_s
        What the microphone gave since the frame before: samples (n, channel), full scale 1, and
        when each was taken, (n,), s on the video's clock.
    """

    time_s: float
    seen: Positions
    now: Skin
    before: Skin | None
    step_s: float
    grid: Grid | None
    late: bool
    quality: Counters
    events: tuple[str, ...] = ()
    ra2: Response = field(default_factory=lambda: NO_SOUND)
    ra2_time_s: NDArray[np.float64] = field(default_factory=lambda: NO_TIMES)

    @cached_property
    def position(self) -> Response:
        """Where the markers are, (marker, space), px; NaN where lost."""
        return self.now.position.astype(np.float32)

    @cached_property
    def sa1(self) -> Response:
        """SA-I of each marker (Eq. 1), (marker,), px (cells: grey levels); NaN where lost."""
        return self.now.distance.astype(np.float32)

    @cached_property
    def ra1(self) -> Response:
        """RA-I of each marker (Eq. 2), (marker,), that a frame; NaN where lost, and after a gap."""
        if self.before is None:
            return np.full(len(self.now.rest), np.nan, np.float32)
        return np.asarray(np.abs(self.now.distance - self.before.distance), np.float32)

    @cached_property
    def speed(self) -> Response:
        """How fast each marker moves, (marker,), px/s; NaN where lost, and after a gap.

        Raises
        ------
        InputError
            If these are cells, which don't move.
        """
        if self.now.grey is not None:
            raise InputError(NO_DISPLACEMENT)
        if self.before is None:
            return np.full(len(self.now.rest), np.nan, np.float32)
        way = np.hypot(*(self.now.position - self.before.position).T)
        return np.asarray(way / self.step_s, np.float32)

    @cached_property
    def shear(self) -> Response:
        """The six parts of the global shear (`channels.PARTS`), (6,), px; cells have none."""
        rest = self.now.rest.astype(np.float32).astype(np.float64)
        kept = Skin(self.position, rest, grey=self.now.grey)
        return np.asarray(CHANNELS[dims.SHEAR].step(kept, None), np.float32)

    @cached_property
    def detected(self) -> NDArray[np.bool_]:
        """Which markers were found, (marker,)."""
        return np.isfinite(self.seen[:, 0])

    @property
    def lost(self) -> float:
        """Share of the markers that were not found."""
        return 1 - np.count_nonzero(self.detected) / len(self.detected)

    @property
    def touching(self) -> bool:
        """Whether something touches the skin: more markers are off rest than tracking moves."""
        return have_moved(self.now)

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


# How frames follow each other.

MISSING = 1.7
"""Frames farther apart than this multiple of their period have lost others between them."""
DOUBLED = 0.25
"""A frame that comes within this share of the period is the one before once more."""
STEPS, SUPPOSED = 101, 5
"""Without a model the period is the median of so many steps from frame to frame: the average rate
of a file that lost frames is too low. It begins as the source's, in so many steps."""


class Cadence:
    """How frames follow each other, in periods of the camera.

    Parameters
    ----------
    rate_hz
        Frames a second.
    is_known
        Whether that is the true rate, as models learnt from; else it is found as frames come.

    Attributes
    ----------
    last_s
        When the last frame was taken, s; None before the first of a recording.
    """

    def __init__(self, rate_hz: float, is_known: bool = False) -> None:
        """Wait for the first frame."""
        self.last_s: float | None = None
        self._rate_hz = rate_hz
        self._steps_s = None if is_known else deque([1 / rate_hz] * SUPPOSED, STEPS)

    def step(self, time_s: float) -> float | None:
        """Return how many periods after the last frame the next was taken; None if it is that one.

        Less than 0 where the clock goes back.
        """
        last, rate_hz = self.last_s, self._rate_hz
        if last is not None and self._steps_s is not None:
            if time_s > last:
                self._steps_s.append(time_s - last)
            rate_hz = 1 / median_low(self._steps_s)
        periods = 1.0 if last is None else (time_s - last) * rate_hz
        if -MISSING < periods < DOUBLED:
            return None
        self.last_s = time_s
        return periods


class _Waiting(NamedTuple):
    """One of the first frames, until there are enough of them."""

    picture: CameraFrame
    follows: bool
    late: bool


class Follower:
    """Follows a sensor's markers from frame to frame, as `extract` does.

    Parameters
    ----------
    sensor
        Says what markers look like, and where they are; None to find its markers in the first
        frames, as `calibrate` does.
    rate_hz
        Frames a second.
    is_known
        Whether that is the true rate; see `Cadence`.

    Attributes
    ----------
    sensor
        As given, or as it was found; None until then.
    counters
        What was counted so far. Who feeds it counts what else is to be counted.
    """

    def __init__(self, sensor: Sensor | None, rate_hz: float, is_known: bool = False) -> None:
        """Wait for the first frame, with the skin at rest."""
        self.sensor = sensor
        self.counters = Counters()
        self._is_given = sensor is not None and sensor.name != NAME  # else a clip was looked at
        self._cadence = Cadence(rate_hz, is_known)
        self._again_s = math.nan
        self.begin()

    def begin(self) -> None:
        """Take the next frame for the first of a recording, with the skin at rest."""
        self._tracker: Tracker | Cells | None = None
        self._before: Skin | None = None
        self._resting: NewRest | None = None
        self._first: list[_Waiting] = []
        self._said: list[str] = []
        self._n, self._follows, self._last_s = 0, True, math.nan
        self._cadence.last_s = None

    def skip(self) -> None:
        """Begin anew: something is missing before the next frame, which has no RA-I."""
        self._follows = False

    def say(self, what: str) -> None:
        """Let the next touch say in a sentence what has happened."""
        self._said.append(what)

    def set_rest(self) -> None:
        """Let displacement count from where the next frames show the markers; see `NewRest`.

        Cells begin anew: the next frames are their picture at rest.
        """
        self._resting = NewRest()

    def describe(self) -> str:
        """Say in a sentence which sensor is followed, or that none is found."""
        sensor = self.sensor
        if sensor is None:
            return "No sensor file (--sensor): markers are looked for, with the skin at rest."
        n = sensor.n_markers if sensor.markers is None else len(sensor.markers)
        if self._is_given:
            many = f", {n} markers" if n else ""
            if sensor.layout == dims.CELLS:
                many = f", {sensor.rows} x {sensor.columns}"
            return f"Sensor '{sensor.name}': {sensor.layout} layout{many}."
        shade = "bright" if sensor.looks.blob_colour else "dark"
        return (
            f"No sensor file (--sensor): {n} {shade} markers were found, in a {sensor.layout} "
            "layout; 'afferents calibrate' writes them to a file, with a picture to check."
        )

    def feed(
        self, picture: CameraFrame, late: bool = False
    ) -> Iterable[tuple[CameraFrame, Touch]] | None:
        """Take in a frame; return what it says, beside it; None if it is torn, or comes twice.

        Nothing comes before `N_FIRST` frames have shown where the skin is at rest; then all of
        these do, from the rest frame on. Take them all before the next frame.

        Parameters
        ----------
        late
            Whether it came so late that it tells of the past.

        Raises
        ------
        InputError
            If the first frames don't show the sensor's markers, or are of another size. It begins
            anew with the next.
        """
        if self._resting is not None and isinstance(self._tracker, Cells):
            self.begin()
            self.say("rest was set: grey levels count from here")
        counted = self.counters
        counted.frames += 1
        if picture.torn:
            counted.torn += 1
            self._follows, self._cadence.last_s = False, picture.time_s
            return None
        periods = self._cadence.step(picture.time_s)
        if periods is None:
            counted.doubled += 1
            return None
        if not 0 <= periods <= MISSING:
            counted.dropped += max(0, round(periods) - 1)
            self._follows = False
        follows, self._follows = self._follows, True
        if self._tracker is not None:
            seen = self._tracker.step(picture.frame.luma)
            return [(picture, self._felt(picture.time_s, seen, follows, late))]
        if 0 <= self._again_s - picture.time_s <= AGAIN_S:
            return []
        self._n += 1
        if self._n > (self.sensor.rest_frame if self.sensor else 0):
            frame = picture.frame
            kept = frame._replace(luma=frame.luma.copy())  # a camera's memory is used again
            self._first.append(_Waiting(picture._replace(frame=kept), follows, late))
        return self.finish() if len(self._first) == N_FIRST else []

    def finish(self) -> Iterable[tuple[CameraFrame, Touch]]:
        """Find the markers in the first frames, be they fewer than `N_FIRST`; see `feed`."""
        if not self._first:
            return []
        first, self._first = self._first, []
        frames = [waiting.picture.frame for waiting in first]
        try:
            if self.sensor is None:
                self.sensor = found_in(_Clip(frames))
            check_size(_FIRST, frames[0].luma.shape[::-1], self.sensor)
            n_stale = count_stale([frame.image for frame in frames], self.sensor)
            begun = start_at_rest(frames[n_stale:], _FIRST, self.sensor)
        except InputError:
            self.begin()
            if not self._is_given:  # the skin may have moved since it was found: look anew
                self.sensor, self._again_s = None, frames[-1].time_s + AGAIN_S
            raise
        self._tracker, self._grid = begun.tracker, begun.grid
        self._rest = upright(begun.tracker.rest_position, self.sensor)
        return self._follow_first(first[n_stale:], begun)

    def _follow_first(
        self, first: Sequence[_Waiting], begun: Begun
    ) -> Iterator[tuple[CameraFrame, Touch]]:
        """Yield what the rest frame says, and those after it that have waited."""
        (picture, _, late), *later = first
        seen = begun.tracker.at_rest(begun.present)
        yield picture, self._felt(picture.time_s, seen, False, late)
        for picture, follows, late in later:
            seen = begun.tracker.step(picture.frame.luma)
            yield picture, self._felt(picture.time_s, seen, follows, late)

    def _felt(self, time_s: float, seen: Tracked, follows: bool, late: bool) -> Touch:
        """Return what a frame says.

        Parameters
        ----------
        follows
            Whether the frame felt last is the one just before.
        """
        assert self.sensor is not None
        now = Skin(upright(seen.position, self.sensor), self._rest, grey=seen.grey)
        before = self._before if follows else None
        step_s, self._last_s, self._before = time_s - self._last_s, time_s, now
        resting = None if now.grey is not None else self._resting  # cells: see `feed`
        if resting is not None and (done := resting.feed(now.position, now.rest)):
            (rest, what), self._resting = done, None
            self._said.append(what)
            if rest is not None:
                self._rest, before = rest, None
                self._before = now = Skin(now.position, rest)
        said, self._said = tuple(self._said), []
        counted = Counters(**vars(self.counters))
        return Touch(time_s, seen.position, now, before, step_s, self._grid, late, counted, said)


# A sensor that nobody has described: its markers are found while they are at rest.

AGAIN_S = 1.0
"""Where there are no markers to be found they are looked for this often, s."""
NAME = "found"
"""Of a sensor that was found here."""
_FIRST = "the first pictures"


def found_in(clip: Video) -> Sensor:
    """Return the sensor that a clip shows, which begins with the skin at rest.

    Raises
    ------
    InputError
        If it shows no markers.
    """
    return calibrate_from_clips(clip, NAME).sensor


class _Clip:
    """Frames of a running source as a video."""

    path = Path(_FIRST)

    def __init__(self, taken: Sequence[Frame]) -> None:
        self._taken = taken
        self.height, self.width = taken[0].luma.shape
        span_s = taken[-1].time_s - taken[0].time_s
        self.fps_hz = (len(taken) - 1) / span_s if span_s > 0 else 0.0

    def frames(self) -> Iterator[Frame]:
        """Return them from the first."""
        return iter(self._taken)
