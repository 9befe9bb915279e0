"""Markers followed live, frame by frame, through gaps, torn frames and a new rest: `Touch`es."""

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from statistics import median_low
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents import channels, dims, errors
from afferents.lab.live import prediction, touch
from afferents.lab.live.events import CameraFrame
from afferents.markers import calibrate, cells, detect, track, windowed
from afferents.markers.rest import N_FIRST, check_size, count_stale
from afferents.markers.sensor import Sensor
from afferents.store.recording import Frame

MISSING = 1.7
"""Frames farther apart than this multiple of their period have lost others between them."""
DOUBLED = 0.25
"""A frame this share of a period after the last, or less, or a little older, is a copy of it."""
STEPS, SUPPOSED = 101, 5
"""Without a model the period is the median of this many steps from frame to frame: the average rate
of a file that lost frames is too low. It begins as the source's, in this many steps."""
REST_FRAMES = 10
"""Frames without motion that displacement may count from anew."""
AGAIN_S = 1.0
"""Where no markers are found they are looked for this often, s."""
FOUND = "found"
"""Name of a sensor without a description, whose markers are found while they are at rest."""
_FIRST = "the first pictures"


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
        """Return how many periods after the last frame the next was taken; None if it is a copy.

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


def find_rest(
    seen: Sequence[detect.Positions], rest: NDArray[np.floating]
) -> tuple[detect.Positions | None, str]:
    """Return where the skin is at rest, unless something moves in the frames that show it.

    Parameters
    ----------
    seen
        Of each frame: positions of the markers, (marker, space), px; NaN where lost.
    rest
        Where displacement counts from now, (marker, space), px.

    Returns
    -------
    tuple
        Where it counts from next: the median of the frames, and `rest` of markers that none of
        them shows; None if something moves. And that it was set, or why not, in a sentence.
    """
    places = np.array(seen)
    shown = np.isfinite(places[..., 0]).any(axis=0)
    found = "no markers"
    if shown.any():
        still = np.nanmedian(places[:, shown], axis=0)
        moved = np.nanmax(np.hypot(*np.moveaxis(places[:, shown] - still, 2, 0)), axis=0)
        moved_px = float(np.quantile(moved, 1 - touch.MOVED_SHARE))
        if moved_px <= touch.MOVED_PX:
            anew = np.array(rest, np.float64)
            anew[shown] = still
            return anew, "rest was set: displacement counts from here"
        found = f"markers that move by {moved_px:.1f} px"
    return None, (
        f"rest was not set: expected a skin that stands still for {len(seen)} frames, found "
        f"{found}; let go, and set it again"
    )


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
        What was counted so far; the caller adds what it counts itself.
    """

    def __init__(self, sensor: Sensor | None, rate_hz: float, is_known: bool = False) -> None:
        """Wait for the first frame, with the skin at rest."""
        self.sensor = sensor
        self.counters = prediction.Counters()
        self._is_given = sensor is not None and sensor.name != FOUND  # else a clip was looked at
        self._cadence = Cadence(rate_hz, is_known)
        self._again_s = math.nan
        self.begin()

    def begin(self) -> None:
        """Take the next frame for the first of a recording, with the skin at rest."""
        self._tracker: track.Tracker | cells.Cells | None = None
        self._before: channels.Skin | None = None
        self._resting: list[detect.Positions] | None = None
        self._first: list[_Waiting] = []
        self._events: list[str] = []
        self._n, self._follows, self._last_s = 0, True, math.nan
        self._cadence.last_s = None

    def skip(self) -> None:
        """Note that something is missing before the next frame, which then has no RA-I."""
        self._follows = False

    def note(self, what: str) -> None:
        """Let the next touch report in a sentence what has happened."""
        self._events.append(what)

    def set_rest(self) -> None:
        """Let displacement count from where the next frames show the markers; see `find_rest`.

        Cells begin anew: the next frames are their picture at rest.
        """
        self._resting = []

    def describe(self) -> str:
        """Return in a sentence which sensor is followed, or that none is found."""
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
    ) -> Iterable[tuple[CameraFrame, touch.Touch]] | None:
        """Take in a frame; return it with its touch; None if it is torn, or comes twice.

        Nothing comes before `N_FIRST` frames have shown where the skin is at rest; then all of
        these do, from the rest frame on. Take them all before the next frame.

        Parameters
        ----------
        late
            Whether it came so late that it shows the past.

        Raises
        ------
        InputError
            If the first frames don't show the sensor's markers, or are of another size. It begins
            anew with the next.
        """
        if self._resting is not None and isinstance(self._tracker, cells.Cells):
            self.begin()
            self.note("rest was set: grey levels count from here")
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
            return [(picture, self._make_touch(picture, follows, late, seen))]
        if 0 <= self._again_s - picture.time_s <= AGAIN_S:
            return []
        self._n += 1
        if self._n > (self.sensor.rest_frame if self.sensor else 0):
            frame = picture.frame
            kept = frame._replace(luma=frame.luma.copy())  # a camera's memory is used again
            self._first.append(_Waiting(picture._replace(frame=kept), follows, late))
        return self.finish() if len(self._first) == N_FIRST else []

    def finish(self) -> Iterable[tuple[CameraFrame, touch.Touch]]:
        """Find the markers in the first frames, even if fewer than `N_FIRST`; see `feed`."""
        if not self._first:
            return []
        first, self._first = self._first, []
        frames = [waiting.picture.frame for waiting in first]
        try:
            if self.sensor is None:
                self.sensor = calibrate.calibrate_from_clips(_Clip(frames), FOUND).sensor
            check_size(_FIRST, frames[0].luma.shape[::-1], self.sensor)
            n_stale = count_stale([frame.image for frame in frames], self.sensor)
            begun = track.start_at_rest(frames[n_stale:], _FIRST, self.sensor)
        except errors.InputError:
            self.begin()
            if not self._is_given:  # the skin may have moved since it was found: look anew
                self.sensor, self._again_s = None, frames[-1].time_s + AGAIN_S
            raise
        tracker = self._tracker = begun.tracker
        self._grid = begun.grid
        self._rest = detect.upright(tracker.rest_position, self.sensor)
        rest_frame, *later = first[n_stale:]

        def follow() -> Iterator[tuple[CameraFrame, touch.Touch]]:
            at_rest = rest_frame._replace(follows=False)
            yield at_rest.picture, self._make_touch(*at_rest, begun.first)
            for waiting in later:
                seen = tracker.step(waiting.picture.frame.luma)
                yield waiting.picture, self._make_touch(*waiting, seen)

        return follow()

    def _make_touch(
        self, picture: CameraFrame, follows: bool, late: bool, seen: windowed.Tracked
    ) -> touch.Touch:
        """Return what a frame shows, given whether the touch before is of the frame just before."""
        assert self.sensor is not None
        now = channels.Skin(detect.upright(seen.position, self.sensor), self._rest, grey=seen.grey)
        before, step_s = self._before if follows else None, picture.time_s - self._last_s
        self._before, self._last_s = now, picture.time_s
        resting = self._resting  # which another thread may replace
        if resting is not None and now.grey is None:  # cells: see `feed`
            resting.append(np.asarray(now.position, np.float64))
            if len(resting) == REST_FRAMES:
                (rest, what), self._resting = find_rest(resting, now.rest), None
                self._events.append(what)
                if rest is not None:
                    self._rest, before = rest, None
                    self._before = now = channels.Skin(now.position, rest)
        events, self._events = tuple(self._events), []
        counters = prediction.Counters(**vars(self.counters))
        return touch.Touch(
            picture.time_s, seen.position, now, before, step_s, self._grid, late, counters, events
        )


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
