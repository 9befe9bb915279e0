"""Which recordings are copies of others: encoded again, or made louder, under another name.

Such a copy differs in every byte. What stays is how the skin or the sound fluctuates over time: no
two runs do that alike, not even of one texture at one speed. A fingerprint is that, a number a
step; recordings of equal length are compared step by step. Of slow tables, whose taxels may all
follow one force, it is a number that stands for each row: copies have equal rows.
"""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.quality.lasting import sliding_part
from afferents.store.responses import Responses, steady_s

Series = NDArray[np.float32]
"""Fluctuations, shape (step,), mean 0 and standard deviation 1."""
Fingerprint = dict[str, Series]
"""A series a kind, of those that a recording has: `tracks`, `sound`, `rows`."""

FEWEST, MOST = 80, 1024
"""Steps of a fingerprint: fewer are alike by chance."""
ALIKE, SAME_CONDITION = 0.75, 0.95
"""Correlation of copies, at least. A robot that slides again over the same track feels nearly the
same: recordings of one texture at one speed must be more alike."""
TOO_EVEN = 0.95
"""What is so much like itself a little later is like every other run that swings at that rate."""
_STEP_S, _SLOWER_HZ = 0.05, 400
"""Sound: its energy below about 200 Hz, so often. What is sampled slower (tables) is compared row
by row."""
_FLOOR = 0.3
"""Energies below this share of the mean say nothing: the noise of 8 bits lies there."""
_FARTHEST = 6.0
"""From the mean, in medians of that distance; one tap would otherwise outweigh all the rest."""


def fingerprint(responses: Responses) -> Fingerprint:
    """Return the fingerprint of a recording, of the part at constant speed.

    Parameters
    ----------
    responses
        With `position` for `tracks`, with `ra2` for `sound` or `rows`; what is too short or
        does not fluctuate has none.
    """
    found: dict[str, NDArray[np.float64]] = {}
    if dims.POSITION in responses:
        found["tracks"] = _measure_tracks(responses)
    if dims.RA2 in responses:
        rate_hz = float(responses[dims.RA2].attrs[dims.SAMPLE_RATE])
        kind = "sound" if rate_hz >= _SLOWER_HZ else "rows"
        found[kind] = (_measure_sound if kind == "sound" else _hash_rows)(responses, rate_hz)
    every = {kind: _standardise(series) for kind, series in found.items()}
    return {kind: series for kind, series in every.items() if series.any()}


def _measure_tracks(responses: Responses) -> NDArray[np.float64]:
    """How far the markers move from frame to frame, mean over markers, x and y together.

    Of cells, which don't move, how SA-I changes.
    """
    time_s = responses[dims.TIME].values
    begin_s = sliding_part(float(time_s[0]), float(time_s[-1]), steady_s(responses))[0]
    first = int(np.searchsorted(time_s, begin_s))
    used = slice(first, first + MOST + 1)
    if dims.of_cells(responses):
        course = responses[dims.SA1][used].values
    else:
        course = responses[dims.POSITION][used].values.sum(axis=-1)
    step = np.diff(course.astype(np.float64), axis=0)
    seen = ~np.isnan(step)
    return np.asarray(np.where(seen, step, 0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1))


def _measure_sound(responses: Responses, rate_hz: float) -> NDArray[np.float64]:
    """How the logarithm of the energy changes from step to step."""
    mean_of, n_means = round(rate_hz / _SLOWER_HZ), round(_STEP_S * _SLOWER_HZ)
    samples = _take_steady(responses, rate_hz, (MOST + 1) * mean_of * n_means).sum(axis=1)
    n_steps = len(samples) // (mean_of * n_means)
    steps = samples[: n_steps * mean_of * n_means].reshape(n_steps, n_means, mean_of)
    energy = steps.mean(axis=2).var(axis=1)
    return np.diff(np.log(energy + _FLOOR * energy.mean() + 1e-20)) if n_steps else energy


def _hash_rows(responses: Responses, rate_hz: float) -> NDArray[np.float64]:
    """Return a checksum of each row: series of them are alike by the share of rows that are equal.

    Rows that repeat the one before, as at rest, say nothing.
    """
    rows = _take_steady(responses, rate_hz, MOST)
    series = np.array([zlib.crc32(row.tobytes()) for row in rows], np.float64) - 2.0**31
    series[1:][np.diff(series) == 0] = 0
    return series


def _take_steady(responses: Responses, rate_hz: float, most: int) -> NDArray[np.float64]:
    """Return at most `most` samples from constant speed on, (sample, channel)."""
    length_s = responses.sizes[dims.AUDIO_TIME] / rate_hz
    first = round(sliding_part(0.0, length_s, steady_s(responses))[0] * rate_hz)
    part = responses[dims.RA2][first : first + most]
    return np.asarray(part.transpose(dims.AUDIO_TIME, dims.CHANNEL).values, np.float64)


def _standardise(series: NDArray[np.floating]) -> Series:
    """Return a series with mean 0 and deviation 1; all 0 if it says nothing."""
    off = series - np.mean(series) if len(series) >= FEWEST else np.zeros(1)
    usual = np.median(np.abs(off)) if np.isfinite(off).all() else 0.0
    if usual <= 1e-9:
        return np.zeros(1, np.float32)
    kept = np.clip(off / usual, -_FARTHEST, _FARTHEST)
    return np.asarray((kept - kept.mean()) / kept.std(), np.float32)


@dataclass(frozen=True)
class Copy:
    """Two recordings that seem to be one: their names, and by which fingerprint."""

    one: str
    other: str
    kind: str
    alike: float


def find_copies(
    fingerprints: Mapping[str, Fingerprint], labels: Mapping[str, object]
) -> list[Copy]:
    """Find recordings that are copies of others.

    Parameters
    ----------
    fingerprints
        Of each recording by name, as `fingerprint` returns them.
    labels
        Texture and speed of each.

    Returns
    -------
    A row a pair, in the order of the recordings; of several ways in which a pair is alike, the
    first.
    """
    found: dict[tuple[str, str], Copy] = {}
    forms: dict[tuple[str, int], list[str]] = {}
    for name, one in fingerprints.items():
        for kind, series in one.items():
            forms.setdefault((kind, len(series)), []).append(name)
    for (kind, _), names in forms.items():
        series = np.stack([fingerprints[name][kind] for name in names])
        own = np.array([_correlate_later(one) for one in series])
        for i, name in enumerate(names):  # one by one: of thousands, all pairs fill the memory
            alike = series[i:] @ series[i] / series.shape[1]
            # Two runs that swing evenly, at one rate, may be as alike as each is like itself later.
            swings = np.maximum(own[i:], own[i])
            likely = (alike > np.maximum(ALIKE, 0.5 + 0.4 * swings)) & (swings < TOO_EVEN)
            for j in (np.flatnonzero(likely[1:]) + 1).tolist():
                other = names[i + j]
                if labels[name] != labels[other] or alike[j] > SAME_CONDITION:
                    found.setdefault((name, other), Copy(name, other, kind, float(alike[j])))
    place = {name: n for n, name in enumerate(fingerprints)}
    return sorted(found.values(), key=lambda copy: (place[copy.one], place[copy.other]))


def _correlate_later(series: Series) -> float:
    """Return how a series correlates with itself later, at most."""
    n = len(series)
    product = np.fft.irfft(np.abs(np.fft.rfft(series, 2 * n)) ** 2)[:n]
    return float((product / (n - np.arange(n)))[n // 16 : n // 2].max())


def written(found: Fingerprint) -> dict[str, list[int]]:
    """Return a fingerprint ready for JSON, in hundredths."""
    return {kind: np.rint(100 * series).astype(int).tolist() for kind, series in found.items()}


def read(text: Mapping[str, Sequence[int]]) -> Fingerprint:
    """Return a fingerprint that `written` wrote; what says nothing is left out.

    Raises
    ------
    ValueError
        If it did not write it.
    """
    every = {kind: _standardise(np.asarray(numbers, np.float64)) for kind, numbers in text.items()}
    return {kind: series for kind, series in every.items() if series.any()}
