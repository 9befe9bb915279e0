"""Frames that repeat the one before, one by one, by a beat or as a camera stalls; missing frames.

A camera that stalls gives frames that equal the one before to the bit. Two frames of a camera that
is alive never do, since its noise differs. That of a stalled one is the same packet in MJPEG, and
decodes to the same frame; other codecs say 'as before'. Genuine skins that were encoded again at
crf 35 had 2 equal frames in a row at most.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.quality.issues import QualityIssue
from afferents.quality.lasting import Times

Numbers = NDArray[np.float64]

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
_FAINT = 0.03
"""Change below which a codec's arithmetic is all there is, grey levels."""
REPEATED_SHARE = 0.2
"""A repeated frame changes less than this share of what changes before and after it."""
MOVING = 0.1
"""Change means motion where it is this share of the most that frames change (95%)."""
MANY_REPEATED = 0.01
"""Share of frames that seem repeated beyond which it is reported."""
UNEVEN, OFTEN_UNEVEN = 0.1, 0.05
"""An interval between frames is uneven beyond this share of the median; and reported beyond
this share of intervals (single gaps are counted as missing frames)."""
_CLOCK_S = 0.0011
"""Containers such as mkv round times to ms."""


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
    beats = [_measure_beat(changes[:, 0], changes[:, period - 1], period) for period in PERIODS]
    if any(passes for _, passes in beats):
        explained = [share for share, _ in beats]  # every second one beats at 4 and 6 frames too
        times = next(p for p, e in zip(PERIODS, explained, strict=True) if e > 0.9 * max(explained))
        return f"each about {times} times"
    change = changes[:, 0]
    around = _measure_around(change, AGAIN_WITHIN)
    moves = around > MOVES_GREY
    share = 0.0
    if moves.mean() >= ENOUGH_MOVES:
        share = float((change < AGAIN * around)[moves].mean())
    return f"{share:.0%} of them twice or more often" if share > MANY_AGAIN else ""


def _measure_beat(change: Numbers, over_period: Numbers, period: int) -> tuple[float, bool]:
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


def _measure_around(change: Numbers, within: int) -> Numbers:
    """Return what frames changed at most shortly before and shortly after each, the less of both.

    Parameters
    ----------
    within
        Of how many frames on either side.
    """
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(change, within), within)
    most: Numbers = windows.max(axis=1)
    return np.minimum(most[: len(change)], most[within + 1 :][: len(change)])


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
    moved = _measure_around(filled, 2)
    most = np.quantile(filled, 0.95) if len(filled) else 0.0
    return (filled < REPEATED_SHARE * moved) & (moved > MOVING * most) & ~np.isnan(change)


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
