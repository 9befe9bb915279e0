"""Windows of vibration: cut from sound, resampled by distance, and a machine's lines taken out."""

import math
import re
from abc import abstractmethod
from typing import Annotated, Any, Literal, NamedTuple, NoReturn, Self

import numpy as np
import pydantic
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, PositiveInt

from afferents import dims
from afferents.encodings.base import Option, VibrationEncoding
from afferents.encodings.samples import Samples, make_samples
from afferents.errors import InputError
from afferents.store.motion import Series

LINE_WIDTH = 2.0
"""Half the width of a line's main lobe under a Hann window, in steps of the resolution."""
_HEARD = 0.95
"""Frequencies up to this share of half the sample rate are used."""
_OVERSAMPLING = 2.56
"""Samples a period of the highest frequency that are kept."""
_SMOOTH = 3.0
"""Times as many are kept where values are read between samples, by cubic splines."""
_FINEST = 8.0
"""What is slower than the mean by more than this has too little of a window's way to matter."""
_DENSEST = 1000
"""Windows that begin in the time of one: more would fill the memory with the same sound."""
WINDOW_OPTION = Option("--window-s", "Length of a window of vibration, s.")
STRIDE_OPTION = Option("--stride-s", "Time from the start of a window to that of the next, s.")
HARMONICS = 8
"""This many harmonics of a line are cut out."""
_LINE_SHARE = 0.01
"""A line that follows the speed is as wide as the speed is uneven: this share of its frequency."""


class StridedEncoding(VibrationEncoding):
    """An encoding of windows of vibration: a stride apart, or a number of them a recording."""

    window_s: Annotated[PositiveFloat | None, WINDOW_OPTION] = 4.0
    stride_s: Annotated[PositiveFloat, STRIDE_OPTION] = 2.0
    windows: PositiveInt | None = None

    def changed(self, **wanted: Any) -> Self:
        """Return it with the values wanted; a stride replaces a number of windows."""
        new = super().changed(**wanted)
        return new if wanted.get("stride_s") is None else new.model_copy(update={"windows": None})

    def require_window(self, length: int, rate_hz: float) -> None:
        """Refuse windows of less than two samples, and a stride that is far smaller than they."""
        if length < 2:
            raise InputError(
                f"--window-s: expected at least two samples at {rate_hz:g} Hz, found {length}"
            )
        least_s = (self.window_s or 0.0) / _DENSEST
        if self.stride_s < least_s:
            expected = f"at least {least_s:g} s, a thousandth of the window"
            raise InputError(f"--stride-s: expected {expected}, found {self.stride_s:g}")

    def refuse_short(self, window_s: float, found_s: float, where: str) -> NoReturn:
        """Refuse what is used of a recording as shorter than a window."""
        raise InputError(
            f"{where}: expected at least one window of {window_s:g} s, found {found_s:.2f} s; "
            "--window-s sets a shorter one, steady_s a longer part"
        )

    def starts(self, n: int, length: int, rate_hz: float) -> NDArray[np.int64]:
        """Return where windows of a signal of n samples start."""
        if (count := 1 if self.window_s is None else self.windows) is None:
            return np.arange(0, n - length + 1, max(1, round(self.stride_s * rate_hz)))
        return np.linspace(0, n - length, count).astype(np.int64)


class Lines(BaseModel):
    """Lines to be masked, with their harmonics.

    Attributes
    ----------
    hertz
        Fundamentals that stand still, such as 50.
    per_mm
        Fundamentals that follow the sliding speed, cycles per mm, such as a motor that turns 14.4
        times for 251 mm: 0.0573.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hertz: tuple[PositiveFloat, ...] = ()
    per_mm: tuple[PositiveFloat, ...] = ()

    @pydantic.model_validator(mode="before")
    @classmethod
    def _of_text(cls, given: Any) -> Any:
        """Take text as well, so that an encoding's `mask` may be given as it is typed."""
        return cls.parse(given).model_dump() if isinstance(given, str) else given

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read an option such as ``50Hz,0.0573/mm``.

        Raises
        ------
        InputError
            If a part is neither.
        """
        found: dict[str, list[float]] = {"Hz": [], "/mm": []}
        for part in text.split(","):
            line = re.fullmatch(r"\s*(\d*\.?\d+)\s*(Hz|/mm)\s*", part)
            if line is None or float(line[1]) == 0:
                raise InputError(f"--mask: expected lines as in 50Hz,0.0573/mm, found '{part}'")
            found[line[2]].append(float(line[1]))
        return cls(hertz=tuple(found["Hz"]), per_mm=tuple(found["/mm"]))

    def masks(
        self, frequency: NDArray[np.float64], speed_mm_s: float, resolution_hz: float
    ) -> NDArray[np.bool_]:
        """Return which frequencies, Hz, lie on a line or a harmonic of it."""
        fundamentals = [(f, 0.0) for f in self.hertz]
        fundamentals += [(k * speed_mm_s, _LINE_SHARE) for k in self.per_mm]
        masked = np.zeros(len(frequency), dtype=bool)
        for fundamental, width in fundamentals:
            for line in fundamental * np.arange(1, HARMONICS + 1):
                masked |= np.abs(frequency - line) <= max(resolution_hz, width * line)
        return masked


class WindowEncoding(StridedEncoding):
    """An encoding of windows that may be long, and of low frequencies.

    Attributes
    ----------
    window_s
        Length of a window, s; None for all that the cut leaves of a recording (``"whole"`` where
        a file has no word for None).
    stride_s
        Distance between the starts of windows, s.
    windows
        Number of windows a recording instead of the stride, evenly spread; only one where a window
        is all of it.
    highest_hz
        Of the frequencies that are kept (lowered to what the sample rate allows).
    mask
        Lines of the machine that are cut out; may be given as text, see `Lines.parse`.
    resample
        ``distance``: where a recording keeps its speed as a series, windows are resampled at equal
        steps of the surface. ``time``: they are left as they were recorded.
    """

    highest_hz: PositiveFloat = 200.0
    mask: Annotated[
        Lines,
        Option(
            "--mask",
            "Lines of the machine to cut out, with their harmonics: 50Hz; 0.0573/mm only where a "
            "model is told the speed.",
            str,
        ),
    ] = Lines()

    resample: Annotated[
        Literal["distance", "time"],
        Option(
            "--resample",
            "What windows are even in where a recording's speed changes and is known: distance "
            "along the surface, or time.",
            str,
        ),
    ] = Field(default="distance", exclude_if=lambda way: way == "distance")

    @property
    def by_distance(self) -> bool:
        """Whether windows are resampled at equal steps of the surface; see `cut_by_distance`."""
        return self.resample == "distance"

    @property
    def needs_speed(self) -> bool:
        """Whether lines are cut out that follow the speed."""
        return bool(self.mask.per_mm)

    @pydantic.field_validator("window_s", mode="before")
    @classmethod
    def _whole(cls, given: Any) -> Any:
        return None if given == "whole" else given

    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse n values, of a rate in Hz, that are shorter than a window."""
        seconds = self.window_s or n / rate_hz
        kept_hz = rate_hz / decimation(rate_hz, self.highest_hz)
        if self.window_s is not None:
            self.require_window(round(self.window_s * kept_hz), kept_hz)
        if n < round(seconds * rate_hz) or n < 2:
            self.refuse_short(seconds, n / rate_hz, where)

    @abstractmethod
    def features(
        self, windows: "Windows", speed_mm_s: float, rate_hz: float
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Return the values of samples, (window, *sample_shape), and their coordinates.

        Parameters
        ----------
        speed_mm_s
            Of the recording; NaN where it is not known.
        rate_hz
            Sample rate of the recording; see `Windows` for the one that was kept.
        """

    def samples(self, response: xr.DataArray, kept: slice, lookback: int = 0) -> Samples:
        """Return samples `(sample, *sample_dims)` of the windows of one recording.

        Parameters
        ----------
        response
            RA-II `(audio_time, channel)` with `sample_rate_hz` and the recording's labels in its
            attrs.
        kept
            Audio samples that the cut keeps.

        Raises
        ------
        InputError
            If a window is longer than what the cut leaves, or the sample rate is too low.
        """
        rate_hz, attrs = float(response.attrs[dims.SAMPLE_RATE]), response.attrs
        self.require(
            len(response[dims.AUDIO_TIME][kept]), rate_hz, attrs.get("name", "a recording")
        )
        cut = cut_by_distance if dims.DISTANCE in response.coords else cut_windows
        windows = cut(response, kept, self)
        values, coords = self.features(windows, float(attrs[dims.SPEED]), rate_hz)
        return make_samples(
            values, self.sample_dims, windows.start_s, windows.stop_s, attrs, coords
        )


class Windows(NamedTuple):
    """Windows of one recording.

    Attributes
    ----------
    values
        Vibration, float64 (window, time, channel), in its unit.
    rate_hz
        Sample rate that was kept.
    start_s, stop_s
        Extents since the recording's start, (window,).
    """

    values: NDArray[np.float64]
    rate_hz: float
    start_s: NDArray[np.float64]
    stop_s: NDArray[np.float64]


def cut_windows(vibration: xr.DataArray, kept: slice, encoding: WindowEncoding) -> Windows:
    """Cut vibration `(audio_time, channel)` into windows.

    Parameters
    ----------
    vibration
        RA-II with `sample_rate_hz` in its attrs.
    kept
        Audio samples that the cut keeps; `WindowEncoding.require` checks that they are enough.
    """
    rate = float(vibration.attrs[dims.SAMPLE_RATE])
    signal = vibration.transpose(dims.AUDIO_TIME, dims.CHANNEL).values[kept].astype(np.float64)
    down = decimation(rate, encoding.highest_hz)
    if down > 1:
        import scipy.signal  # which takes longer to import than all the rest

        signal = np.asarray(scipy.signal.resample_poly(signal, 1, down, axis=0, padtype="mean"))
    rate_kept, length = rate / down, len(signal)
    if encoding.window_s is not None:
        length = min(length, round(encoding.window_s * rate_kept))
    starts = encoding.starts(len(signal), length, rate_kept)
    values = np.stack([signal[i : i + length] for i in starts])
    start_s = kept.start / rate + starts / rate_kept
    return Windows(values, rate_kept, start_s, start_s + length / rate_kept)


def add_distance(vibration: xr.DataArray, speed: Series) -> xr.DataArray:
    """Return vibration with the way along the surface, mm, as a coordinate; NaN where not known."""
    n, rate = vibration.sizes[dims.AUDIO_TIME], float(vibration.attrs[dims.SAMPLE_RATE])
    way = speed.along(np.arange(n) / rate)
    return vibration.assign_coords({dims.DISTANCE: (dims.AUDIO_TIME, way)})


def cut_by_distance(vibration: xr.DataArray, kept: slice, encoding: WindowEncoding) -> Windows:
    """Cut vibration into windows of equal steps of the surface (computed order tracking).

    A window holds the same time as one of `cut_windows`. Within it the vibration is read at equal
    steps of the way, as if the surface had gone by at the window's mean speed v: what repeats every
    1 / k mm lies at k v Hz however the speed went (Fyfe & Munck, Mech. Syst. Signal Process. 1997,
    11:187).

    Nothing is folded back: the vibration is first cut off above what the fastest part needs
    (`resample_poly`), and steps are as small as the slowest part needs, up to `_FINEST` times. The
    band is whole up to `highest_hz` where the sample rate reaches `_SMOOTH` times that.

    Parameters
    ----------
    vibration
        RA-II with `sample_rate_hz` in its attrs and the coordinate `distance_mm`, which may be
        NaN at its ends: windows that reach there are left out.
    """
    from scipy.interpolate import make_interp_spline
    from scipy.signal import resample_poly

    rate = float(vibration.attrs[dims.SAMPLE_RATE])
    way = vibration[dims.DISTANCE].values[kept]
    plain = cut_windows(vibration, kept, encoding)
    first = np.round((plain.start_s - kept.start / rate) * rate).astype(int)
    last = np.minimum(np.round((plain.stop_s - kept.start / rate) * rate).astype(int), len(way)) - 1
    is_known = np.isfinite(way[first] + way[last]) & (way[last] > way[first])
    if not is_known.any():
        name = vibration.attrs.get("name", "a recording")
        raise InputError(
            f"{name}: expected the speed of the slide while the vibration is used, found none; "
            "keep a log that reaches as far, or say with steady_s which part to use"
        )
    first, last = first[is_known], last[is_known]
    speeds = np.diff(way) * rate
    mean = (way[last] - way[first]) * rate / (last - first)
    slowest = np.array([speeds[a:b].min() for a, b in zip(first, last, strict=True)])
    fastest = np.array([speeds[a:b].max() for a, b in zip(first, last, strict=True)])
    signal = vibration.transpose(dims.AUDIO_TIME, dims.CHANNEL).values[kept].astype(np.float64)
    down = decimation(rate, _SMOOTH * encoding.highest_hz * float((fastest / mean).max()))
    if down > 1:
        signal = np.asarray(resample_poly(signal, 1, down, axis=0, padtype="mean"))
    curve = make_interp_spline(np.arange(len(signal)) * down, signal, k=3)
    finer = float(np.clip((mean / np.maximum(slowest, 1e-9)).max(), 1, _FINEST))
    length = float((last - first).mean())
    points = round(finer * length / down)
    values = []
    for a, b in zip(first, last, strict=True):
        steps = np.linspace(way[a], way[b], points)
        values.append(curve(np.interp(steps, way[a : b + 1], np.arange(a, b + 1))))
    steps_a_s = (points - 1) * rate / length
    level = math.sqrt(plain.rate_hz / steps_a_s)  # as much power a Hz as without resampling
    return Windows(
        level * np.stack(values), steps_a_s, plain.start_s[is_known], plain.stop_s[is_known]
    )


def audible_hz(rate_hz: float, highest_hz: float) -> float:
    """Return the highest frequency wanted that a sample rate allows, Hz."""
    return min(highest_hz, rate_hz / 2 * _HEARD)


def decimation(rate: float, highest_hz: float) -> int:
    """Return n where one of n samples is enough for frequencies up to the highest."""
    return max(1, int(rate / (_OVERSAMPLING * highest_hz)))


def bridge(
    power: NDArray[np.float64], frequency: NDArray[np.float64], masked: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return spectra (..., frequency), above 0, with masked stretches replaced by straight lines.

    Straight in the logarithm, from edge to edge: nothing of the masked values is left, and nothing
    at all where all are masked.
    """
    if not masked.any():
        return power
    if masked.all():
        return np.ones_like(power)
    kept = ~masked
    logs = np.log(power)
    flat = logs.reshape(-1, logs.shape[-1])
    for row in flat:
        row[masked] = np.interp(frequency[masked], frequency[kept], row[kept])
    return np.exp(logs)
