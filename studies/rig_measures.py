"""What is measured of tactile images and spectra, published or simulated."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]

APART = 20
"""Published tactile images lie 20 frames (0.22 s) apart, ten a group."""
GROUP = 10
_POINTS = 128
_PITCH_MM = 1.2


def contrast(images: Values, x_mm: float = 3.0) -> list[float]:
    """Return how far the drum's pattern stands out: about 1 where there is none.

    Power of windowed images, (n, 19, 19), at the drum's lattice wavenumbers (1 / x along both
    diagonals) over the median of a ring of the same wavenumber.
    """
    window = np.outer(np.hanning(19), np.hanning(19))
    flat = images - images.mean(axis=(1, 2), keepdims=True)
    power = (np.abs(np.fft.fft2(flat * window, (_POINTS, _POINTS))) ** 2).mean(axis=0)
    at = _PITCH_MM / x_mm / math.sqrt(2)
    lattice = [(at, at), (at, -at), (-at, at), (-at, -at)]
    f = np.fft.fftfreq(_POINTS)
    fx, fy = np.meshgrid(f, f, indexing="ij")
    ring = np.abs(np.hypot(fx, fy) - np.hypot(at, at)) < 0.03
    for kx, ky in lattice:
        ring &= np.hypot(fx - kx, fy - ky) > 0.09
    around = np.median(power[ring])
    return [
        float(power[np.hypot(fx - kx, fy - ky) < 0.03].mean() / around) for kx, ky in lattice[:2]
    ]


def moving_contrast(images: Values, x_mm: float = 3.0, draws: int = 50) -> float:
    """Return the median contrast of groups of ten images, their mean over time taken away.

    Parameters
    ----------
    images
        Of every frame, (n, 19, 19): groups start anywhere.
    """
    rng = np.random.default_rng(0)
    last = len(images) - APART * (GROUP - 1)
    found = []
    for start in rng.integers(0, last, draws):
        group = images[start::APART][:GROUP]
        found.append(np.mean(contrast(group - group.mean(axis=0), x_mm)))
    return float(np.median(found))


def groups(images: Values) -> list[Values]:
    """Return groups of ten images 20 frames apart, as published, from those of every frame."""
    length = APART * (GROUP - 1) + 1
    return [images[i::APART][:GROUP] for i in range(0, len(images) - length + 1, 45)]


def correlation(first: Values, second: Values) -> float:
    """Return the mean correlation of pairs of images."""
    return float(
        np.mean(
            [np.corrcoef(a.ravel(), b.ravel())[0, 1] for a, b in zip(first, second, strict=False)]
        )
    )


def neighbours(images: Values, k: int = 1) -> float:
    """Return how far pins k apart go together, over the images' own means."""
    centred = images - images.mean(axis=(1, 2), keepdims=True)
    along = (centred[:, :, k:] * centred[:, :, :-k]).mean()
    across = (centred[:, k:] * centred[:, :-k]).mean()
    return float((along + across) / 2 / (centred**2).mean())


def statistics(images: Values) -> dict[str, float]:
    """Return the figures of a group of images 20 frames apart."""
    return {
        "apart": correlation(images[:-1], images[1:]),
        "sd": float(images.std() / images.mean()),
        "sd_time": float(images.std(axis=0).mean() / images.mean()),
        "pin_1": neighbours(images, 1),
        "pin_3": neighbours(images, 3),
        "mean": float(images.mean()),
    }


def line(spectrum: Values, hz: float) -> Values:
    """Return the largest amplitude within one bin of a frequency, of every window."""
    at = round(hz)
    return np.asarray(spectrum[:, at - 1 : at + 2].max(axis=1))


def weights(spectrum: Values, first_hz: float) -> Values:
    """Return the lines k = 1 to 4 over the loudest of them, median over windows."""
    lines = np.stack([line(spectrum, k * first_hz) for k in (1, 2, 3, 4)], axis=1)
    return np.asarray(np.median(lines / lines.max(axis=1, keepdims=True), axis=0))


def clarity(spectrum: Values, first_hz: float, k: int) -> float:
    """Return line k over what lies round it, median over windows."""
    low, high = math.ceil((k - 0.45) * first_hz), int((k + 0.45) * first_hz)
    around = np.median(spectrum[:, low : high + 1], axis=1)
    return float(np.median(line(spectrum, k * first_hz) / around))


def published_images(archive: Any, afferent: str, texture: str, speed: int) -> Values:
    """Return the published images as printed, (10, 19, 19).

    Their crescent lies to the right of their dark spot, as does that of the rig, whose skin is
    dragged to the right: so both slide the same way. Printed rows are ranks along the camera's x.
    """
    chosen = (archive["texture"] == texture) & (archive["speed_mm_s"] == speed)
    images = archive["intensity_recovered"][chosen & (archive["afferent"] == afferent)]
    return np.asarray(images, float)[:GROUP]
