"""How loud a vibration is, and whether its samples are numbers within full scale at all."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.quality.issues import QualityIssue
from afferents.quality.lasting import lasting, sliding_part, span_text

LOUDEST = 1.01
"""Full scale, and what conversions add to it: 8-bit integers divided by 127 reach 1.008."""
RUN = 3
"""A signal that is clipped stays at its extreme for this many samples at least,"""
STEEP = 4
"""and comes there by a step of more than this many of the smallest steps that it makes: the top of
a slow wave is flat too, but is reached by small ones."""

MUCH_CLIPPED = 1e-4
"""Share of clipped samples that is named."""
SILENT, SILENT_S, _BLOCK_S = 2**-14, 1.0, 0.1
"""A microphone is silent where it stays within two steps of 16 bits for so long; s, in blocks."""

Samples = NDArray[np.floating[Any]]


def require_finite(samples: Samples, where: object, rate_hz: float, first: int = 0) -> None:
    """Refuse samples that are no numbers.

    Parameters
    ----------
    samples
        Shape (n,) or (n, channels).
    where, first
        What they are of, and the number of the first of them there.

    Raises
    ------
    InputError
        Naming the first that is NaN or infinite, and when it comes.
    """
    finite = np.isfinite(samples)
    if finite.all():
        return
    finite = finite.reshape(len(samples), -1)
    n = int(np.argmin(finite.all(axis=1)))
    what = samples.reshape(len(samples), -1)[n][~finite[n]][0]
    found = f"{what} at sample {first + n} ({(first + n) / rate_hz:.3f} s)"
    more = int((~finite.all(axis=1)).sum()) - 1
    if more:
        found += f" and in {more} more"
    raise InputError(
        f"{where}: expected samples that are numbers, found {found}; export or record it again"
    )


def find_overload(samples: Samples, where: object, rate_hz: float) -> list[QualityIssue]:
    """Find where samples of a sound file go beyond full scale, as those of a float file can.

    Parameters
    ----------
    samples
        Shape (n,) or (n, channels).
    """
    loud = np.abs(samples).reshape(len(samples), -1).max(axis=1, initial=0.0)
    n_beyond = int((loud > LOUDEST).sum())
    if n_beyond == 0:
        return []
    n = int(np.argmax(loud > LOUDEST))
    found = (
        f"{n_beyond} beyond it, up to {loud.max():.3g}, first at sample {n} ({n / rate_hz:.3f} s)"
    )
    return [QualityIssue("loud", where, "samples within full scale, -1 to 1", found)]


def find_sound_issues(
    samples: Samples, where: object, rate_hz: float, steady_s: tuple[float, float] | None = None
) -> list[QualityIssue]:
    """Find what is wrong with a sound file's samples: too loud, clipped, silent.

    Parameters
    ----------
    samples
        Shape (n,) or (n, channels), all of them numbers.
    steady_s
        Start and end of constant speed, s; None where nothing says so.
    """
    channels = samples.reshape(len(samples), -1)
    found = find_overload(samples, where, rate_hz)
    clipped = max((measure_clipping(one) for one in channels.T), default=0.0)
    if clipped > MUCH_CLIPPED:
        share = f"{100 * clipped:.2g}% of them cut off at their largest or smallest"
        found.append(QualityIssue("clipped", where, "whole samples", share, "lower the gain"))
    block = max(1, round(_BLOCK_S * rate_hz))
    n = len(samples) // block
    if n == 0:
        return found
    quiet = np.abs(channels[: n * block]).reshape(n, -1).max(axis=1) <= SILENT
    time_s = np.arange(n) * block / rate_hz
    part = sliding_part(0.0, len(samples) / rate_hz, steady_s)
    if (span := lasting(quiet, time_s, part, SILENT_S - _BLOCK_S)) is not None:
        look = "look at the microphone, its cable, and which channel is the sensor's"
        silence = f"silence {span_text(span, time_s)}"
        found.append(QualityIssue("silent", where, "a microphone's noise", silence, look))
    return found


class SoundLevel(NamedTuple):
    """How loud a sound is.

    Attributes
    ----------
    peak, rms
        Of the loudest channel, as shares of full scale; a peak of 0 is silence.
    clipped
        Largest share of samples that is cut off in any channel.
    """

    peak: float
    rms: float
    clipped: float


def measure_level(samples: Samples) -> SoundLevel:
    """Measure how loud samples (n, channel) are; at least one, all of them numbers."""
    exact = samples.astype(float)
    return SoundLevel(
        peak=float(np.abs(exact).max()),
        rms=float(np.sqrt((exact**2).mean(axis=0)).max()),
        clipped=max(measure_clipping(channel) for channel in exact.T),
    )


def measure_clipping(samples: Samples) -> float:
    """Measure the share of samples (n,) that are cut off at the largest or smallest of them."""
    steps = np.abs(np.diff(samples))
    if not steps.any():
        return 0.0
    finest = float(steps[steps > 0].min())
    n_clipped = 0
    for end in (samples.min(), samples.max()):
        edges = np.diff(np.r_[False, samples == end, False].astype(np.int8))
        first, stop = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        # Runs at an extreme count that are reached or left by a large step.
        around = np.r_[0.0, steps, 0.0]  # into sample n, and out of sample n - 1
        steep = np.maximum(around[first], around[stop]) > STEEP * finest
        lengths = stop - first
        n_clipped += int(lengths[(lengths >= RUN) & steep].sum())
    return n_clipped / len(samples)
