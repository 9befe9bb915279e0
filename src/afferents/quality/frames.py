"""What frames of a video show as they come: dark, frozen, repeated, stalled, missing.

A few pixels of each are compared with those before it (`mean_change`), by all that look at
frames: where a recording is extracted or inspected, and where it runs live.

Frozen means that the picture hardly changes for a second, or that it is the same to the bit
(`find_stalls`) for a second in all.

All tolerances were measured on simulated recordings as recorded and encoded again (H.264 at crf
18, 23 and 35, MJPEG), with and without such faults, and on clips of real sensors;
docs/reliability.md says what is promised.
"""

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.quality.issues import QualityIssue
from afferents.quality.lasting import lasting, sliding_part, span_text
from afferents.quality.repeats import PERIODS, WINDOW, Stalls, describe_repeats, find_stalls

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
_LOOK_BACK_S = FROZEN_S / 2
_FIRST_FRAMES = 10


class FrameFigures:
    """Light and change of frames that come one after the other.

    Attributes
    ----------
    time_s
        Of each frame so far, (n_frames,), s.
    changes
        Mean change of the picture from 1 to 6 frames before, (n_frames, 6), NaN at the start.
    """

    def __init__(self) -> None:
        """Wait for the first frame."""
        self._time_s: list[float] = []
        self._grey: list[float] = []
        self._changes: list[list[float]] = []
        self._slow: list[float] = []  # change since half a second before, NaN at the start
        self._equal: list[bool] = []
        self._before: deque[tuple[float, GreyImage]] = deque()
        self._last: GreyImage | None = None

    @property
    def time_s(self) -> Numbers:
        """Times of the frames, s."""
        return np.array(self._time_s)

    @property
    def changes(self) -> Numbers:
        """Mean change from 1 to 6 frames before, grey levels."""
        return np.array(self._changes).reshape(-1, PERIODS.stop - 1)

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
        return np.array(self._grey) >= DARK_SHARE * light

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
        frozen = self._find_frozen(where, part)
        found = [self._find_dark(where, part), frozen, self._find_repeated(where, part)]
        stalls = self.stalls.within(part)
        if stalls.spans and not frozen:
            expected = "a picture of its own in each frame"
            cause = "RA-I is 0 there and too large in the next frame"
            found.append(QualityIssue("stalled", where, expected, f"the same one {stalls}", cause))
        return [issue for issue in found if issue is not None]

    def _find_dark(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        time_s, grey = self.time_s, np.array(self._grey)
        light = float(np.median(grey[:_FIRST_FRAMES]))
        span = lasting(grey < DARK_SHARE * light, time_s, part, DARK_S)
        if span is None:
            return None
        least = float(grey[(time_s >= span[0]) & (time_s <= span[1])].min())
        expected = f"a picture as light as it begins (mean grey level {light:.0f})"
        return QualityIssue(
            "dark", where, expected, f"a dark one ({least:.0f}) {span_text(span, time_s)}"
        )

    def _find_frozen(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        time_s, slow = self.time_s, np.array(self._slow)
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

    def _find_repeated(self, where: object, part: tuple[float, float]) -> QualityIssue | None:
        time_s, changes = self.time_s, self.changes
        within = np.flatnonzero((time_s >= part[0]) & (time_s <= part[1]))
        within = within[~self.stalls.cover(time_s)[within]]  # key frames of a still picture beat
        for first in range(0, max(1, len(within) - WINDOW // 2), WINDOW // 2):
            frames = within[first : first + WINDOW]
            if how := describe_repeats(changes[frames]):
                found = f"{how} from {time_s[frames[0]]:.2f} s on"
                return QualityIssue("repeated", where, "every frame once", found)
        return None
