"""How much of the variance of tactile images is global shear, between textures and over time."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Shares(NamedTuple):
    """Variances of the displacement, px squared, mean over markers, x and y together.

    Attributes
    ----------
    shift, gradients
        Of the mean displacement, and of the plane's four gradients: together the global shear.
    local
        Of what is left of the images without it.
    """

    shift: float
    gradients: float
    local: float

    @property
    def total(self) -> float:
        """The variance of the images."""
        return self.shift + self.gradients + self.local

    @property
    def shear(self) -> float:
        """Share of the global shear in it, 0 to 1; NaN where nothing varies."""
        return (self.shift + self.gradients) / self.total if self.total > 0 else float("nan")


class Moving(NamedTuple):
    """What a recording's displacement is on average, and how it varies over time.

    Attributes
    ----------
    mean
        (marker, space), px.
    over_time
        Its variances over the frames.
    """

    mean: Floats
    over_time: Shares


def plane_basis(rest: NDArray[np.floating]) -> Floats:
    """Return an orthonormal basis (marker, 3) of planes over places (marker, space); 1 is first."""
    places = np.column_stack([np.ones(len(rest)), rest - rest.mean(axis=0)])
    return np.asarray(np.linalg.qr(places.astype(np.float64))[0])


def variances(fields: NDArray[np.floating], basis: Floats) -> Shares:
    """Return the variances of displacement fields, (n, marker, space), over the n."""
    varying = fields - fields.mean(axis=0, dtype=np.float64)
    power = np.square(np.einsum("mb,nms->bns", basis, varying)).sum(axis=2).mean(axis=1)
    power /= len(basis)
    total = float(np.square(varying).sum(axis=(1, 2)).mean() / len(basis))
    shift, gradients = float(power[0]), float(power[1:].sum())
    return Shares(shift, gradients, max(0.0, total - shift - gradients))


def moving(displacement: NDArray[np.floating], basis: Floats) -> Moving:
    """Return mean and variances over time of a recording's displacement, (time, marker, space)."""
    mean = displacement.mean(axis=0, dtype=np.float64)
    return Moving(np.asarray(mean), variances(displacement, basis))


def variance_shares(
    recordings: Mapping[tuple[str, float], list[Moving]], basis: Floats
) -> dict[str, Shares]:
    """Return the variances between textures, between speeds, and over time.

    Between textures: of the recordings' means at one speed, mean over speeds. Between speeds: of
    one texture. Over time: within recordings.

    Parameters
    ----------
    recordings
        Of every texture and speed.
    basis
        See `plane_basis`.
    """
    means = {key: np.mean([one.mean for one in found], axis=0) for key, found in recordings.items()}
    times = [one.over_time for found in recordings.values() for one in found]
    return {
        "between textures": _between(means, 0, basis),
        "between speeds": _between(means, 1, basis),
        "over time": Shares(*np.mean(times, axis=0).tolist()),
    }


def _between(means: Mapping[tuple[str, float], Floats], which: int, basis: Floats) -> Shares:
    """Return the variances between keys that differ in one place alone, mean over the other."""
    others = dict.fromkeys(key[1 - which] for key in means)
    fields = [np.stack([m for key, m in means.items() if key[1 - which] == one]) for one in others]
    return Shares(*np.mean([variances(f, basis) for f in fields if len(f) > 1], axis=0).tolist())
