"""Short fingerprints of recordings, and a search for recordings that are copies of others.

A copy that was encoded again, cut, or made louder differs in every byte. What stays is how the
skin and the sound fluctuate over time: no two runs do that alike, not even of one texture at one
speed.
A fingerprint is some seconds of that, standardised. Copies are looked for among neighbours by what
does not depend on when a recording begins (the amplitudes of its spectrum, in a few random
directions), so that the search of n recordings does not compare all pairs, and confirmed by the
correlation of the fingerprints over shifts.
"""

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.spatial import cKDTree

from afferents import dims
from afferents.quality.lasting import sliding_part
from afferents.store.responses import Responses, steady_s

Series = NDArray[np.float32]
"""Fluctuations, shape (step, feature)."""
Fingerprint = dict[str, Series]
"""One series a kind, of those that a recording has: `tracks`, `sound`, `taxels`."""


class Kind(NamedTuple):
    """How one kind of fingerprint is compared.

    Attributes
    ----------
    features
        Values a step.
    steps, fewest
        Steps at most, about 12 s, and at least: a few seconds of sound are alike by chance.
    shift
        Steps by which copies may be shifted, about 1 s.
    spectra
        Correlation that the spectra of copies have at least.
    alike
        Correlation from which two recordings are copies, at least; see `least_alike`.
    """

    features: int
    steps: int
    fewest: int
    shift: int
    spectra: float
    alike: float


KINDS = {
    "tracks": Kind(2, 1024, 90, 90, 0.6, 0.65),
    "sound": Kind(8, 256, 80, 20, 0.65, 0.85),
    "taxels": Kind(4, 512, 90, 36, 0.8, 0.9),
}
SWINGS = (0.5, 0.4)
"""What swings evenly, as a smooth drum's stick and slip, is like any other that does at some shift,
and like itself a little later (by r): copies are alike by 0.5 + 0.4 r at least. The nearest of
different runs came within 0.06 of that; copies at crf 35 lie 0.06 above it, but for a smooth
drum's."""
TOO_EVEN = 0.95
"""What is so much like itself a little later is like every other run that swings at that rate."""
SAME_CONDITION = 0.95
"""Correlation from which recordings of one texture at one speed are copies: a robot that slides
again over the same track feels nearly the same."""

STEP_S = 0.05
"""Sound: energies in bands, this far apart."""
BANDS_HZ = np.geomspace(5.0, 160.0, 9)
LOWEST_RATE_HZ = 2.5 * BANDS_HZ[-1]
"""Vibration sampled slower (taxels) is compared sample by sample."""
FLOOR = 0.3
"""Energies below this share of the mean say nothing: the noise of 8 bits lies there."""
STEADY = 1e-4
"""Energies whose logarithms change by less are those of a constant: what is left is rounding."""
DIRECTIONS, NEAR = 64, 1.14
"""Random directions in which neighbours are looked for; and how much farther apart than the
spectra themselves two copies may lie in them (5% lie farther)."""
SOON = 15
"""A fingerprint is like itself at shifts below this part of the largest: it is band-limited."""
SURROUNDINGS = 41
"""Values of a spectrum whose mean is its broad shape, which all runs of a kind have in common."""
_PAIRS_AT_ONCE = 4096


def fingerprint(responses: Responses) -> Fingerprint:
    """Return the fingerprint of a recording.

    Parameters
    ----------
    responses
        With `position` for `tracks`, with `ra2` for `sound` or `taxels`; what is too short or
        does not fluctuate has none.
    """
    steady = steady_s(responses)
    found: Fingerprint = {}
    if dims.POSITION in responses:
        found["tracks"] = _tracks(responses, steady)
    if dims.RA2 in responses:
        rate = float(responses[dims.RA2].attrs[dims.SAMPLE_RATE])
        kind = "sound" if rate >= LOWEST_RATE_HZ else "taxels"
        begin_s = sliding_part(0.0, responses.sizes[dims.AUDIO_TIME] / rate, steady)[0]
        steps_a_s = 1 / STEP_S if kind == "sound" else rate
        n_samples = round((KINDS[kind].steps + 2) / steps_a_s * rate)
        part = slice(round(begin_s * rate), round(begin_s * rate) + n_samples)
        samples = responses[dims.RA2][part].values.astype(np.float64)
        samples -= samples.sum(axis=0) / max(1, len(samples))  # conversions leave an offset
        found[kind] = _sound(samples, rate) if kind == "sound" else _taxels(samples)
    return {name: series for name, series in found.items() if _says_something(name, series)}


def _says_something(name: str, series: Series) -> bool:
    enough = KINDS[name].fewest <= len(series) <= KINDS[name].steps
    return enough and bool(series.any() and np.isfinite(series).all())


def _tracks(responses: Responses, steady: tuple[float, float] | None) -> Series:
    """Mean step of the markers from frame to frame, (frame, 2), flattened in frequency.

    Slip-stick and bumps would else make all runs of a drum alike.
    """
    time_s = responses[dims.TIME].values
    begin_s = sliding_part(float(time_s[0]), float(time_s[-1]), steady)[0]
    first = int(np.searchsorted(time_s, begin_s))
    if len(time_s) - first <= KINDS["tracks"].fewest:
        return np.zeros((0, 2), np.float32)
    position = responses[dims.POSITION][first : first + KINDS["tracks"].steps + 1].values
    step = np.diff(position.astype(np.float64), axis=0)
    seen = ~np.isnan(step)
    mean = np.where(seen, step, 0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    spectrum = np.fft.rfft(_limited(mean, 3), axis=0)
    amplitude = np.sqrt((np.abs(spectrum) ** 2).sum(axis=1, keepdims=True))
    flat = spectrum / np.sqrt(np.maximum(amplitude, 1e-9 * amplitude.max(initial=1e-9)))
    return _limited(np.fft.irfft(flat, len(mean), axis=0), 2)


def _sound(samples: NDArray[np.float64], rate: float) -> Series:
    """Log energies in bands, (step, band), summed over channels."""
    every = max(1, int(rate // (2 * LOWEST_RATE_HZ)))
    slower = samples
    if every > 1:
        import scipy.signal  # which takes longer to import than all the rest

        slower = scipy.signal.resample_poly(samples, 1, every, axis=0)
    step = round(STEP_S * rate / every)
    if len(slower) < 2 * step:
        return np.zeros((0, KINDS["sound"].features), np.float32)
    windows = np.lib.stride_tricks.sliding_window_view(slower, 2 * step, axis=0)[::step]
    n_fft = 8 * step
    power = np.abs(np.fft.rfft(windows * np.hanning(2 * step), n_fft, axis=-1)) ** 2
    band = np.digitize(np.arange(power.shape[-1]) * rate / every / n_fft, BANDS_HZ)
    energy = np.stack(
        [power[..., band == b].sum(axis=(1, 2)) for b in range(1, len(BANDS_HZ))], axis=1
    )[: KINDS["sound"].steps]
    if not energy.any():
        return np.zeros_like(energy, np.float32)
    loudness = np.log(energy + FLOOR * energy.mean())
    if np.ptp(loudness, axis=0).max() < STEADY:
        return np.zeros_like(energy, np.float32)
    return _limited(loudness, 2)


def _taxels(samples: NDArray[np.float64]) -> Series:
    """Change from sample to sample, (step, sum), in a few sums of all taxels."""
    signs = np.random.default_rng(0).choice(
        [-1.0, 1.0], (samples.shape[1], KINDS["taxels"].features)
    )
    return _limited(np.diff(samples[: KINDS["taxels"].steps + 1], axis=0) @ signs, 2)


def _limited(series: NDArray[np.float64], most: float) -> Series:
    """Take off the mean; no step goes beyond `most` times the median one."""
    series = series - series.mean(axis=0) if len(series) else series
    size = np.sqrt((series**2).sum(axis=1, keepdims=True))
    limit = most * np.median(size) if len(size) else 0.0
    return np.asarray(series * np.minimum(1, limit / np.maximum(size, 1e-12)), np.float32)


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
        Texture and speed of each. Recordings of one texture at one speed must be more alike to
        be taken for copies.

    Returns
    -------
    A row a pair, in the order of the recordings; of several ways in which a pair is alike, the
    first.
    """
    found: dict[tuple[str, str], Copy] = {}
    for by, kind in KINDS.items():
        having = [name for name, one in fingerprints.items() if by in one]
        series = [fingerprints[name][by] for name in having]
        for i, j in _neighbours(series, kind):
            one, other = having[i], having[j]
            alike = likeness(series[i], series[j], range(-kind.shift, kind.shift + 1))
            least = SAME_CONDITION if labels[one] == labels[other] else kind.alike
            if alike >= max(least, least_alike(series[i], kind), least_alike(series[j], kind)):
                found.setdefault((one, other), Copy(one, other, by, alike))
    place = {name: n for n, name in enumerate(fingerprints)}
    return sorted(found.values(), key=lambda copy: (place[copy.one], place[copy.other]))


def _neighbours(series: Sequence[Series], kind: Kind) -> Iterator[tuple[int, int]]:
    """Yield the pairs whose spectra are alike, found in a few random directions."""
    if len(series) < 2:
        return
    spectra = np.stack([_spectrum(one, kind) for one in series])
    n_values = spectra.shape[1]
    random = np.random.default_rng(0).standard_normal((n_values, DIRECTIONS), np.float32)
    places = spectra @ random / np.sqrt(DIRECTIONS)
    radius = NEAR * np.sqrt(2 - 2 * kind.spectra)
    pairs = cKDTree(places).query_pairs(radius, output_type="ndarray")
    for some in np.array_split(pairs, len(pairs) // _PAIRS_AT_ONCE + 1):
        alike = np.einsum("ij,ij->i", spectra[some[:, 0]], spectra[some[:, 1]])
        for i, j in some[alike >= kind.spectra].tolist():
            yield min(i, j), max(i, j)


def _spectrum(series: Series, kind: Kind) -> NDArray[np.float32]:
    """Return how the amplitudes of all features stand out, of length 1: blind to shifts."""
    amplitude = np.abs(np.fft.rfft(series, 2 * kind.steps, axis=0))[1:]
    fine = (amplitude - uniform_filter1d(amplitude, SURROUNDINGS, axis=0)).ravel()
    return np.asarray(fine / np.linalg.norm(fine), np.float32)


def least_alike(series: Series, kind: Kind) -> float:
    """Return how alike a copy is at least, by how the recording swings; see `SWINGS`."""
    later = likeness(series, series, range(kind.shift // SOON, kind.shift + 1))
    return np.inf if later > TOO_EVEN else SWINGS[0] + SWINGS[1] * later


def likeness(one: Series, other: Series, shifts_tried: range) -> float:
    """Return the largest correlation of two fingerprints over shifts of so many steps."""
    n_fft = 1 << (len(one) + len(other)).bit_length()
    product = np.fft.rfft(one, n_fft, axis=0) * np.fft.rfft(other, n_fft, axis=0).conj()
    by_shift = np.fft.irfft(product.sum(axis=1), n_fft)
    shifts = np.array(shifts_tried)
    # Both are cut to where they overlap.
    first, stop = np.maximum(shifts, 0), np.minimum(len(one), len(other) + shifts)
    overlaps = stop - first >= min(len(one), len(other)) / 2
    first, stop, shifts = first[overlaps], stop[overlaps], shifts[overlaps]
    if len(shifts) == 0:
        return 0.0
    energy = _energy(one, first, stop) * _energy(other, first - shifts, stop - shifts)
    return float((by_shift[shifts] / np.sqrt(np.maximum(energy, 1e-12))).max(initial=0.0))


def _energy(series: Series, first: NDArray[np.int64], stop: NDArray[np.int64]) -> Series:
    total = np.r_[0.0, np.cumsum((series.astype(np.float64) ** 2).sum(axis=1))]
    return np.asarray(total[stop] - total[first])


def written(found: Fingerprint) -> dict[str, str]:
    """Return a fingerprint as text, a byte a value, for an attribute."""
    return {name: _as_text(series) for name, series in found.items()}


def _as_text(series: Series) -> str:
    scaled = np.rint(series * (127 / np.abs(series).max()))
    return base64.b64encode(scaled.astype(np.int8).tobytes()).decode("ascii")


def read(text: Mapping[str, str]) -> Fingerprint:
    """Return a fingerprint that `written` wrote; what says nothing is left out.

    Raises
    ------
    ValueError
        If it did not write it.
    """
    found = {name: _from_text(text[name], kind) for name, kind in KINDS.items() if name in text}
    return {name: series for name, series in found.items() if _says_something(name, series)}


def _from_text(text: str, kind: Kind) -> Series:
    values = np.frombuffer(base64.b64decode(text, validate=True), np.int8)
    return values.astype(np.float32).reshape(-1, kind.features)
