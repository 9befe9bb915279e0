"""What frames of a video show as they come: dark, frozen, repeated, stalled, missing.

A few pixels of each are compared with those before it (`mean_change`), by everybody who looks at
frames: where a recording is extracted or inspected, and where it runs live.
"""

from collections import deque
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.quality.issues import QualityIssue
from afferents.quality.lasting import Times, lasting, sliding_part, span_text

Numbers = NDArray[np.float64]
GreyImage = NDArray[np.uint8]

_ROWS_APART, _COLUMNS_APART = 17, 8
"""Pixels that are looked at: unlike the pitch of markers in either direction."""


def sample_pixels(luma: GreyImage) -> GreyImage:
    """Return a copy of the pixels of a frame that are compared with those of others."""
    return luma[::_ROWS_APART, ::_COLUMNS_APART].copy()


def mean_change(sample: GreyImage, other: GreyImage | None) -> float:
    """Return by how much sampled pixels differ in the mean, grey levels; NaN of another size."""
    if other is None or other.shape != sample.shape:
        return float("nan")
    return cv2.norm(sample, other, cv2.NORM_L1) / sample.size


def mean_motion(sample: GreyImage, other: GreyImage | None) -> float:
    """Return `mean_change` of pictures of equal light: a lamp that flickers moves nothing."""
    if other is not None and (before := cv2.sumElems(other)[0]) > 0:
        other = np.asarray(
            cv2.convertScaleAbs(other, alpha=cv2.sumElems(sample)[0] / before), np.uint8
        )
    return mean_change(sample, other)


# A camera that stalls and gives its picture again: frames that equal the one before to the bit.
#
# Two frames of a camera that is alive never do, since its noise differs. That of a stalled one is
# the same packet in MJPEG, and decodes to the same frame; other codecs say 'as before'. Genuine
# skins that were encoded again at crf 35 had 2 equal frames in a row at most.

FEWEST_AGAIN = 7
"""Equal frames in a row that are a stall. Fewer are frames that a converter wrote several times."""
STALL_S = 0.1
"""So long a stall lasts at least."""


class Stalls(NamedTuple):
    """How often a camera stalled.

    Attributes
    ----------
    spans
        From when to when, s: from a picture to the last that equals it.
    """

    spans: tuple[tuple[float, float], ...]

    @property
    def total_s(self) -> float:
        """How long in all, s."""
        return sum(end - begin for begin, end in self.spans)

    def within(self, part: tuple[float, float]) -> "Stalls":
        """Return what lies between two times, s."""
        cut = ((max(begin, part[0]), min(end, part[1])) for begin, end in self.spans)
        return Stalls(tuple(span for span in cut if span[1] > span[0]))

    def cover(self, time_s: Times) -> NDArray[np.bool_]:
        """Return which frames lie in one, (n_frames,)."""
        covered = np.zeros(len(time_s), bool)
        for begin, end in self.spans:
            covered |= (time_s > begin) & (time_s <= end)
        return covered

    def __str__(self) -> str:
        """Say it."""
        if not self.spans:
            return "never"
        begin, end = self.spans[0]
        if len(self.spans) == 1:
            return f"from {begin:.2f} s to {end:.2f} s"
        n = len(self.spans)
        return f"{n} times, {self.total_s:.2f} s in all, first from {begin:.2f} s to {end:.2f} s"


def find_stalls(equal: NDArray[np.bool_], time_s: Times) -> Stalls:
    """Find when a camera stalled.

    Parameters
    ----------
    equal, time_s
        Of each frame, (n_frames,): whether it equals the one before to the bit; its time.
    """
    edges = np.diff(np.r_[False, equal, False].astype(np.int8))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
    return Stalls(
        tuple(
            (float(time_s[max(begin - 1, 0)]), float(time_s[end]))
            for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
            if end - begin + 1 >= FEWEST_AGAIN
            and time_s[end] - time_s[max(begin - 1, 0)] >= STALL_S
        )
    )


# What is measured of each frame, and what is wrong with them: dark, frozen, the same ones again.
#
# Frozen means that the picture hardly changes for a second, or that it is the same to the bit
# (`find_stalls`) for a second in all.
#
# All tolerances were measured on simulated recordings as recorded and encoded again (H.264 at crf
# 18, 23 and 35, MJPEG), with and without such faults, and on clips of real sensors;
# docs/reliability.md says what is promised.

FROZEN_S = 1.0
"""A picture may stand still for so long while the drum slides. Half of it is the distance at which
pictures are compared: a skin that slides looks another after that, a frozen one does not."""
STILL_GREY = 0.1
"""Pictures half a second apart that differ by less (grey levels, mean over the picture) are the
same. Frozen ones differ by up to 0.07 (crf 35); a smooth drum's at 10 mm/s by at least 0.18 within
any half second (crf 35), 0.8 (crf 18), 1.1 (as recorded); all others by more."""
NOISE_GREY, NOISE_FRAMES, MOVED_GREY = 0.005, 30, 5.0
"""Median change from frame to frame of a camera's noise, among a video's first frames: 0.017 and
more at crf 35. Where there is none (a simulation without nuisances, a fast encoder at crf 35) a
smooth drum's picture stands still too. Then one is frozen if it never moves at all (a key frame
changes a still one by up to 3.1 grey levels, a touch by 15 and more),"""
LIVELY_GREY = 1.0
"""or if before that, while the drum slid, its median change in half a second was above this: 3.6
and more on a drum with bumps and on a smooth one at 50 mm/s, at most 0.4 on a smooth one at 10."""
DARK_S = 0.5
"""The picture may be dark for so long while the drum slides."""
DARK_SHARE = 0.4
"""Of the light that there is when a recording begins: less is dark. Real clips keep 0.8 of it."""

WINDOW = 360
"""Frames in a row that are judged for repeats together."""
FEWEST = 150
"""Of fewer frames the share that a beat explains is chance: up to 0.27 in 90, 0.09 in 180."""
PERIODS = range(2, 7)
"""Each frame this many times."""
BEAT = 0.18
"""Share of the variance of the change from frame to frame that a beat of 2 to 6 frames explains.
Genuine frames: up to 0.09 in 180 and 0.06 in 360; repeated and encoded again mostly above 0.2. Only
of a smooth drum is crf 35 too much, where a step is smeared over its repeats."""
UNEQUAL = 1.5
"""The beat's largest change is this many times its smallest. A texture whose bumps come every few
frames exactly beats too, but evenly: up to 1.34."""
ADDS_UP = 0.75
"""Over a whole beat the picture changes by this share of the sum of its steps: 0.93 and more where
frames are repeated, 0.65 where a coarse codec smears them; less where a texture or a flickering
lamp comes back to where it was: 0.1 to 0.7."""
AGAIN, AGAIN_WITHIN = 0.3, 4
"""A frame that changes by less than this share of what changes within this many frames before and
after it repeats the one before,"""
MOVES_GREY = 0.3
"""where that is at least this many grey levels: below it a codec's own steps look like that."""
MANY_AGAIN, ENOUGH_MOVES = 0.35, 0.1
"""Share of such frames, among those where so much moves (at least this share of all). Genuine ones:
up to 0.19; four of the real clips, whose recorder wrote most frames twice: 0.39 to 0.51."""

_LOOK_BACK_S = FROZEN_S / 2
_FAINT = 0.03
"""Change below which a codec's arithmetic is all there is, grey levels."""
_FIRST_FRAMES = 10


class FrameFigures:
    """Light and change of frames that come one after the other.

    Attributes
    ----------
    time_s, grey
        Of each frame so far, (n_frames,): its time, and its mean grey level, 0 to 255.
    changes
        Mean change of the picture from 1 to 6 frames before, (n_frames, 6), NaN at the start.
    slow_change
        Mean change of the picture since half a second before, (n_frames,), NaN at the start.
    """

    def __init__(self) -> None:
        """Wait for the first frame."""
        self._time_s: list[float] = []
        self._grey: list[float] = []
        self._changes: list[list[float]] = []
        self._slow: list[float] = []
        self._equal: list[bool] = []
        self._before: deque[tuple[float, GreyImage]] = deque()
        self._last: GreyImage | None = None

    @property
    def time_s(self) -> Numbers:
        """Times of the frames, s."""
        return np.array(self._time_s)

    @property
    def grey(self) -> Numbers:
        """Mean grey level of each frame."""
        return np.array(self._grey)

    @property
    def changes(self) -> Numbers:
        """Mean change from 1 to 6 frames before, grey levels."""
        return np.array(self._changes).reshape(-1, PERIODS.stop - 1)

    @property
    def slow_change(self) -> Numbers:
        """Mean change since half a second before, grey levels."""
        return np.array(self._slow)

    @property
    def stalls(self) -> Stalls:
        """When the camera gave its picture again, for `STALL_S` or longer.

        None in a video without noise, as of a simulation without nuisances: there a skin that
        stands still looks the same; nor in the dark, which has no noise either.
        """
        equal = np.array(self._equal, bool) & self._lit
        return find_stalls(equal if self._has_noise else np.zeros_like(equal), self.time_s)

    @property
    def _lit(self) -> NDArray[np.bool_]:
        """Which frames are not much darker than the first, (n_frames,)."""
        light = np.median(self._grey[:_FIRST_FRAMES] or [0.0])
        return self.grey >= DARK_SHARE * light

    @property
    def _has_noise(self) -> bool:
        """Whether a camera's noise is there in the first frames."""
        noise = self.changes[1 : NOISE_FRAMES + 1, 0]
        return len(noise) > 0 and bool(np.median(noise) > NOISE_GREY)

    def add(self, time_s: float, luma: GreyImage, levels: GreyImage | None = None) -> None:
        """Take in the next frame: its time, s, and its picture.

        Parameters
        ----------
        luma, levels
            As of `afferents.store.recording.Frame`.
        """
        sample, before = sample_pixels(luma), self._before
        since_s = time_s - _LOOK_BACK_S
        while len(before) >= PERIODS.stop and before[1][0] <= since_s:
            before.popleft()
        mean = cv2.sumElems(sample)[0] / sample.size  # as sample.mean(), in a tenth of its time
        self._time_s.append(time_s)
        self._grey.append(mean if levels is None else float(levels[round(mean)]))
        ago = [before[-k][1] if k <= len(before) else None for k in range(1, PERIODS.stop)]
        self._changes.append([mean_change(sample, one) for one in ago])
        old = before[0] if before and before[0][0] <= since_s else None
        self._slow.append(mean_change(sample, old[1] if old else None))
        same = self._changes[-1][0] == 0 and np.array_equal(luma, self._last)  # type: ignore[arg-type]
        self._equal.append(bool(same))
        before.append((time_s, sample))
        self._last = luma

    def find_issues(
        self, where: object, steady_s: tuple[float, float] | None = None
    ) -> list[QualityIssue]:
        """Find what is wrong with the pictures while the drum slides.

        Parameters
        ----------
        where
            The video.
        steady_s
            Start and end of constant speed, s; None where nothing says so.
        """
        time_s = self.time_s
        if len(time_s) == 0:
            return []
        part = sliding_part(float(time_s[0]), float(time_s[-1]), steady_s)
        frozen = self._frozen(where, part)
        found = (
            self._dark(where, part),
            frozen,
            self._repeated(where, part),
            None if frozen else self._stalled(where, part),
        )
        return [issue for issue in found if issue is not None]

    def _stalled(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        stalls = self.stalls.within(part)
        if not stalls.spans:
            return None
        cause = "RA-I is 0 there and too large in the next frame"
        return QualityIssue(
            "stalled", where, "a picture of its own in each frame", f"the same one {stalls}", cause
        )

    def _dark(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        time_s, grey = self.time_s, self.grey
        light = float(np.median(grey[:_FIRST_FRAMES]))
        span = lasting(grey < DARK_SHARE * light, time_s, part, DARK_S)
        if span is None:
            return None
        least = float(grey[(time_s >= span[0]) & (time_s <= span[1])].min())
        expected = f"a picture as light as it begins (mean grey level {light:.0f})"
        return QualityIssue(
            "dark", where, expected, f"a dark one ({least:.0f}) {span_text(span, time_s)}"
        )

    def _frozen(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        time_s, slow = self.time_s, self.slow_change
        if len(time_s) <= 1:
            return None
        expected = "a picture that changes while the drum slides"
        still = (slow < STILL_GREY) & self._lit  # False where NaN
        span = lasting(still, time_s, part, FROZEN_S - _LOOK_BACK_S)
        if span is None:  # it may stand still between key frames, or by pieces
            stalls = self.stalls.within(part)
            if stalls.total_s < FROZEN_S:
                return None
            return QualityIssue("frozen", where, expected, f"the very same one {stalls}")
        began = max(span[0] - _LOOK_BACK_S, float(time_s[0]))
        if not self._has_noise and (slow > MOVED_GREY).any():
            slid = slow[(time_s >= part[0]) & (time_s < began)]
            if len(slid) == 0 or not np.median(slid) > LIVELY_GREY:  # nor where NaN
                return None
        found = f"the same one {span_text((began, span[1]), time_s)}"
        return QualityIssue("frozen", where, expected, found)

    def _repeated(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        time_s, changes = self.time_s, self.changes
        within = np.flatnonzero((time_s >= part[0]) & (time_s <= part[1]))
        within = within[~self.stalls.cover(time_s)[within]]  # key frames of a still picture beat
        for first in range(0, max(1, len(within) - WINDOW // 2), WINDOW // 2):
            frames = within[first : first + WINDOW]
            if how := describe_repeats(changes[frames]):
                found = f"{how} from {time_s[frames[0]]:.2f} s on"
                return QualityIssue("repeated", where, "every frame once", found)
        return None


def describe_repeats(changes: Numbers) -> str:
    """Say how frames in a row repeat one another, or nothing.

    Parameters
    ----------
    changes
        As of `FrameFigures`, shape (n_frames, 6).
    """
    changes = changes[~np.isnan(changes).any(axis=1)]
    if len(changes) < FEWEST:
        return ""
    beats = [_beat(changes[:, 0], changes[:, period - 1], period) for period in PERIODS]
    if any(passes for _, passes in beats):
        explained = [share for share, _ in beats]  # every second one beats at 4 and 6 frames too
        times = next(p for p, e in zip(PERIODS, explained, strict=True) if e > 0.9 * max(explained))
        return f"each about {times} times"
    share = _share_again(changes[:, 0])
    return f"{share:.0%} of them twice or more often" if share > MANY_AGAIN else ""


def _beat(change: Numbers, over_period: Numbers, period: int) -> tuple[float, bool]:
    """Return the share of variance that a beat explains, and whether it is that of repeats."""
    mean = np.ones(period) / period
    log = np.log(change + _FAINT)
    trend = np.convolve(np.convolve(log, mean, "same"), mean, "same")
    ends = slice(period, period + (len(log) - 2 * period) // period * period)
    left = (log - trend)[ends]
    most = 3 * np.median(np.abs(left))  # a key frame or a slip is not to hide the rest
    left = np.clip(left, -most, most).reshape(-1, period)
    if not left.var() > 0:
        return 0.0, False
    explained = float(left.mean(axis=0).var() / left.var())
    steps = np.median(change[ends].reshape(-1, period), axis=0)
    unequal = steps.max() >= UNEQUAL * steps.min()
    adds_up = np.median(over_period[ends]) >= ADDS_UP * steps.sum()
    return explained, bool(explained >= BEAT and unequal and adds_up)


def _share_again(change: Numbers) -> float:
    """Return the share of frames that repeat the one before, where something moves."""
    around = _around(change, AGAIN_WITHIN)
    moves = around > MOVES_GREY
    if moves.mean() < ENOUGH_MOVES:
        return 0.0
    return float((change < AGAIN * around)[moves].mean())


def _around(change: Numbers, within: int) -> Numbers:
    """Return what frames changed at most shortly before and shortly after each, the less of both.

    Parameters
    ----------
    within
        Of how many frames on either side.
    """
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(change, within), within)
    most: Numbers = windows.max(axis=1)
    return np.minimum(most[: len(change)], most[within + 1 :][: len(change)])


# Single frames that repeat the one before, and frames that are missing.

REPEATED_SHARE = 0.2
"""A repeated frame changes less than this share of what changes before and after it."""
MOVING = 0.1
"""Change means motion where it is this share of the most that frames change (95%)."""
MANY_REPEATED = 0.01
"""Share of frames that seem repeated beyond which it is reported."""


def find_repeated(change: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Find the frames that repeat the one before: all still between two that moved.

    Cameras and converters write a frame twice to keep a rate up. A skin at rest changes no more
    than such a frame, so both neighbours must have moved.

    Parameters
    ----------
    change
        Of each frame from the one before, shape (n_frames,); the first is NaN.
    """
    filled = np.nan_to_num(change)
    moved = _around(filled, 2)
    most = np.quantile(filled, 0.95) if len(filled) else 0.0
    return (filled < REPEATED_SHARE * moved) & (moved > MOVING * most) & ~np.isnan(change)


UNEVEN, OFTEN_UNEVEN = 0.1, 0.05
"""An interval between frames is uneven beyond this share of the median; and reported beyond
this share of intervals (single gaps are counted as missing frames)."""
_CLOCK_S = 0.0011
"""Containers such as mkv round times to ms."""


def find_time_issues(time_s: NDArray[np.float64], where: object) -> list[QualityIssue]:
    """Find gaps in the times (s) of a video's frames, or a rate that changes.

    A count below the one that a container declares proves nothing: avi counts empty packets.
    """
    step = np.diff(time_s)
    if len(step) == 0:
        return []
    period = float(np.median(step))
    uneven = float((np.abs(step - period) > max(UNEVEN * period, _CLOCK_S)).mean())
    every = f"a frame every {1000 * period:.1f} ms"
    if uneven > OFTEN_UNEVEN:
        found = f"a variable frame rate: {uneven:.0%} of the intervals differ by more than a tenth"
        cause = "RA-I, a change per frame, is another thing there"
        return [QualityIssue("uneven", where, every, found, cause)]
    if (n := count_dropped(time_s)) == 0:
        return []
    longest = int(np.argmax(step))
    found = (
        f"{n} missing by the times of the others, the longest gap {step[longest]:.3f} s at "
        f"{time_s[longest]:.2f} s"
    )
    return [QualityIssue("gaps", where, every, found, "RA-I is too large after each gap")]


def find_doubled_frames(change: NDArray[np.float64], where: object) -> list[QualityIssue]:
    """Find many frames that repeat the one before; see `find_repeated`."""
    n = int(find_repeated(change).sum())
    if len(change) < FEWEST or n <= MANY_REPEATED * len(change):
        return []
    found = f"{n} of {len(change)} that seem to repeat the one before"
    cause = "RA-I is near 0 there and too large in the next, and the true frame rate is lower"
    return [QualityIssue("doubled", where, "frames that differ", found, cause)]


def count_dropped(time_s: NDArray[np.float64]) -> int:
    """Count how many frames are missing in gaps of the times of the others."""
    step = np.diff(time_s)
    if len(step) == 0:
        return 0
    period = np.median(step)
    return int(np.maximum(np.rint(step / period) - 1, 0).sum()) if period > 0 else 0
