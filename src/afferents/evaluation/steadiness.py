"""How steady tactile images are: how like an image is to the one some frames later.

The paper says of its tactile images that those of SA-I stay nearly the same while a texture slides
past, and those of RA-I change. Put as a number: the correlation, over markers, of an image with
that of the same recording 20 frames (0.22 s) later, as far apart as its Figures 8 and 10 show
them.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.responses import Responses, named_by_spacing, speed_of

APART = 20
"""Frames between the two images, as in the paper's Figures 8 and 10."""
LOOKED_AT = 900
"""Most frames of a recording that are looked at, from its middle: 10 s at 90 frames/s."""
_FEWEST = 3
"""Markers that both images must show."""


def steadiness(response: NDArray[np.floating], apart: int = APART) -> float:
    """Return the mean correlation of images with those some frames later.

    Parameters
    ----------
    response
        Of a channel, (time, marker); NaN where a marker was lost.
    apart
        Frames between the two images.

    Returns
    -------
    Mean over frames of Pearson's correlation over the markers that both images show, -1 to 1: near
    1 where images stay the same, near 0 where they change entirely. NaN where there are fewer than
    `apart` + 1 frames, or images that are the same everywhere.
    """
    earlier, later = response[:-apart], response[apart:]
    both = np.isfinite(earlier) & np.isfinite(later)
    used = both.sum(axis=1) >= _FEWEST
    if not used.any():
        return float("nan")
    one, other = _centred(earlier[used], both[used]), _centred(later[used], both[used])
    size = np.sqrt((one**2).sum(axis=1) * (other**2).sum(axis=1))
    product = (one * other).sum(axis=1)
    return float(np.mean(product[size > 0] / size[size > 0])) if (size > 0).any() else float("nan")


def _centred(images: NDArray[np.floating], there: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return images less their mean over the markers that are there, the others 0."""
    values = np.where(there, images, 0.0).astype(np.float64)
    mean = values.sum(axis=1, keepdims=True) / there.sum(axis=1, keepdims=True)
    return np.where(there, values - mean, 0.0)


def steadiness_of(recordings: Sequence[Responses]) -> list[dict[str, str | float | None]]:
    """Return how steady SA-I and RA-I images of each recording are, in the middle of it.

    Returns
    -------
    list of dict
        ``recording``, ``texture``, ``speed_mm_s`` (None where not known), ``named_by_spacing``
        (where textures are), ``sa1`` and ``ra1``, the correlations; recordings without markers, or
        too short for a number, are left out.
    """
    found: list[dict[str, str | float | None]] = []
    for responses in recordings:
        if dims.SA1 not in responses or dims.RA1 not in responses:
            continue
        values = {name: steadiness(_middle(responses, name)) for name in (dims.SA1, dims.RA1)}
        if np.isfinite(list(values.values())).all():
            attributes = responses.attrs
            found.append(
                {
                    "recording": str(attributes["name"]),
                    "texture": str(attributes[dims.TEXTURE]),
                    "speed_mm_s": speed_of(responses),
                    **named_by_spacing([responses]),
                    **values,
                }
            )
    return found


def _middle(responses: Responses, name: str) -> NDArray[np.floating]:
    response = responses[name]
    n = response.sizes[dims.TIME]
    first = max(0, (n - LOOKED_AT) // 2)
    # Time first: in a store dims have an order, but nothing forces it on other sources.
    shown = response.isel({dims.TIME: slice(first, first + LOOKED_AT)})
    values: NDArray[np.floating] = shown.transpose(dims.TIME, ...).values
    return values
