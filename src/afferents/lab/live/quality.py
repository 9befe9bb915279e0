"""How good pictures and sound are over the last second, by the measures of recordings."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.dims import SA1
from afferents.lab.live.events import CameraFrame, Sound
from afferents.lab.live.touch import MOVED_PX, MOVED_SHARE, Filled
from afferents.markers.detect import spacing_px, without_shine
from afferents.markers.sensor import Sensor
from afferents.quality import frames, image
from afferents.quality.repeats import MANY_REPEATED, find_repeated
from afferents.quality.sound import measure_level

EVERY_S = 0.5
"""Figures are worked out anew this often, s of the source's time."""
SPAN_S = 1.0
"""They are of this many seconds."""
SLOW = 0.9
"""A frame rate below this share of the source's is reported;"""
MANY_LOST = 0.05
"""so is a larger share of markers lost."""
REPEATS = 180
"""Frames in a row that are looked at for repeats."""
STILL_S, STILL_PX = 3.0, 0.1
"""Markers whose distance from rest stays the same, within this, for this time stand still;"""
MOST_OFF_PX = 1.5
"""and where they are no farther off, rest may have moved: a touch moves some of them more."""


class Figure(NamedTuple):
    """One of them in words; `issue` is a sentence on what is wrong, where something is."""

    name: str
    value: str
    issue: str = ""


class Quality(ABC):
    """Figures of one sensor stream.

    Parameters
    ----------
    rate_hz
        Frames or samples a second that the source states.

    Attributes
    ----------
    numbers
        By name, for programs; none before the first. Replaced whole, never changed.
    """

    def __init__(self, rate_hz: float) -> None:
        """Nothing has come yet."""
        self._rate_hz = rate_hz
        self.begin()

    def begin(self) -> None:
        """Forget all: another recording begins."""
        self.numbers: Mapping[str, float] = {}
        self._due_s: float | None = None

    @abstractmethod
    def figures(self) -> list[Figure]:
        """Return them in words, for people."""

    def _is_due(self, time_s: float) -> bool:
        """Return whether figures are due; not at once, where there is no second yet."""
        if self._due_s is None or abs(time_s - self._due_s) > 2 * EVERY_S:  # it begins, or jumped
            self._due_s = time_s + EVERY_S
        if time_s < self._due_s:
            return False
        self._due_s += EVERY_S
        return True


class AudioQuality(Quality):
    """Figures of a microphone: its numbers are those of `SoundLevel`."""

    def begin(self) -> None:
        """Forget all: another recording begins."""
        super().begin()
        self._pieces: deque[NDArray[np.float32]] = deque()
        self._n = 0

    def add(self, sound: Sound) -> None:
        """Take in some samples."""
        self._pieces.append(sound.samples)
        self._n += len(sound.samples)
        while self._n - len(self._pieces[0]) >= SPAN_S * self._rate_hz:
            self._n -= len(self._pieces.popleft())
        if self._is_due(sound.time_s):
            self.numbers = measure_level(np.concatenate(self._pieces))._asdict()

    def figures(self) -> list[Figure]:
        """Return them in words, for people."""
        if not (numbers := self.numbers):  # another thread may replace it
            return []
        peak, clipped = numbers["peak"], numbers["clipped"]
        silent = "It is silent: look at the microphone and its cable." if peak == 0 else ""
        loud = "Samples are clipped: lower the gain." if clipped > 0 else ""
        rms, loudest = (
            f"{20 * math.log10(share):.0f} dBFS" if share > 0 else "silent"
            for share in (numbers["rms"], peak)
        )
        return [
            Figure("sound level", rms, silent),
            Figure("loudest", loudest),
            Figure("clipped", f"{100 * clipped:.3g}% of samples", loud),
        ]


class VideoQuality(Quality):
    """Figures of a camera.

    Its numbers are ``fps_hz`` (frames a second, by their own times), ``n_markers``, ``lost`` (share
    of marker positions), ``n_lost`` (markers lost for more than half of the second), ``repeated``
    (share of the last 180 frames), ``rest_off_px`` (how far from rest markers have stood still for
    3 s, where that is so little that nothing may touch them), ``disc_grey``, ``skin_grey``,
    ``saturated`` and ``edge_px`` (as of `ImageQuality`, of the newest frame).
    """

    def begin(self) -> None:
        """Forget all: another recording begins."""
        super().begin()
        self._seen: deque[tuple[float, NDArray[np.bool_] | None]] = deque()  # s; markers found
        self._change: deque[float] = deque(maxlen=REPEATS)
        self._off: deque[tuple[float, float]] = deque()  # s; px from rest, of nearly all markers
        self._sample: NDArray[np.uint8] | None = None
        self._light: image.ImageQuality | None = None

    def add(self, picture: CameraFrame, found: Filled | None, sensor: Sensor | None) -> None:
        """Take in a frame and what was found in it, of which sensor; None before the rest frame."""
        before, self._sample = self._sample, frames.sample_pixels(picture.frame.luma)
        if not math.isnan(change := frames.mean_motion(self._sample, before)):
            self._change.append(change)
        self._seen.append((picture.time_s, None if found is None else found.touch.detected))
        while self._seen[0][0] < picture.time_s - SPAN_S:
            self._seen.popleft()
        if found is not None and found.touch.now.grey is not None:
            found = None  # cells have no rest in px, and no light and focus of markers
        if found is not None:
            off_px = float(np.quantile(found.markers[SA1], 1 - MOVED_SHARE))
            self._off.append((picture.time_s, off_px))
            while self._off[0][0] < picture.time_s - STILL_S:
                self._off.popleft()
        if self._is_due(picture.time_s):
            self._light = None
            if found is not None and found.touch.detected.any():
                at = found.touch.seen[found.touch.detected]
                plain = picture.frame.image
                if sensor is not None:
                    plain = without_shine(plain, sensor.looks)
                self._light = image.measure_image_quality(plain, at, spacing_px(at))
            self.numbers = {k: v for k, v in self._measure().items() if math.isfinite(v)}

    def _measure(self) -> dict[str, float]:
        """Return the numbers; NaN for those that are not known."""
        span_s = self._seen[-1][0] - self._seen[0][0]
        numbers = {"fps_hz": (len(self._seen) - 1) / span_s if span_s > 0 else math.nan}
        detected = [found for _, found in self._seen if found is not None]
        newest = [one for one in detected if one.shape == detected[-1].shape]  # of one sensor
        if newest:
            share = np.mean(newest, axis=0)
            numbers["n_markers"] = float(len(share))
            numbers["lost"] = float(1 - share.mean())
            numbers["n_lost"] = float((share < 0.5).sum())
        if len(self._change) == REPEATS:
            numbers["repeated"] = float(find_repeated(np.array(self._change)).mean())
        off_px = [px for _, px in self._off]
        if off_px and self._off[-1][0] - self._off[0][0] > STILL_S - EVERY_S:
            is_still = max(off_px) - min(off_px) < STILL_PX
            if is_still and MOVED_PX < off_px[-1] < MOST_OFF_PX:
                numbers["rest_off_px"] = off_px[-1]
        return numbers | (vars(self._light) if self._light else {})

    def figures(self) -> list[Figure]:
        """Return them in words, for people."""
        numbers, light, figures = self.numbers, self._light, list[Figure]()

        def add(name: str, value: str, issue: str = "", is_wrong: bool = True) -> None:
            figures.append(Figure(name, value, issue if is_wrong else ""))

        if (rate_hz := numbers.get("fps_hz")) is not None:
            expected = f"the {self._rate_hz:g} a second that were expected."
            slow = f"Frames come more slowly than {expected}"
            add("frame rate", f"{rate_hz:.1f} frames/s", slow, rate_hz < SLOW * self._rate_hz)
        if (lost := numbers.get("lost")) is not None:
            n, gone = int(numbers["n_markers"]), int(numbers["n_lost"])
            many = f"Markers lost for more than half of the last second: {gone} of {n} (hidden, "
            many += "cut by the rim, or no markers)."
            add("markers", f"{n - gone} of {n}")
            add("lost", f"{lost:.1%} of positions", many, lost > MANY_LOST)
        if (off_px := numbers.get("rest_off_px")) is not None:
            off = f"Markers stand still {off_px:.1f} px off rest: if nothing touches the skin, "
            add("off rest", f"{off_px:.1f} px", f"{off}set rest again (z).")
        if (share := numbers.get("repeated")) is not None:
            again = "Frames seem to repeat the one before: RA-I is near 0 there, and too large in "
            add("repeated frames", f"{share:.0%}", f"{again}the next.", share > MANY_REPEATED)
        if light is not None:
            issues = image.find_light_issues(light)
            grey = f"markers {light.disc_grey:.0f}, skin {light.skin_grey:.0f}"
            add("grey levels", grey, issues.get("faint", ""))
            add("overexposed", f"{light.saturated:.0%}", issues.get("overexposed", ""))
            if math.isfinite(light.edge_px):
                add("edges", f"{light.edge_px:.1f} px wide", issues.get("blurred", ""))
        return figures
