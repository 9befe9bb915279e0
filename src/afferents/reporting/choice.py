"""Which textures and speeds a figure shows where it cannot show all of them."""

from collections.abc import Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from afferents.core import dims
from afferents.core.samples import Samples, textures_of
from afferents.reporting.texture_names import texture_letter

EXAMPLE_LETTERS = ("a", "e", "i", "m")
"""Four of the paper's textures, evenly spread: 0, 2, 4 and 6 mm. Its own figures show others, which
`report --figures paper` draws."""

Item = TypeVar("Item")


def speeds_of(samples: Samples) -> list[float]:
    """Return the speeds of the samples, mm/s, ascending."""
    return sorted(map(float, np.unique(samples[dims.SPEED])))


def example_textures(samples: Samples) -> list[str]:
    """Return a, e, i, m of the paper where they are there, else four spread over the rest."""
    textures = textures_of(samples)
    letter = partial(texture_letter, about=samples.attrs)
    known = [texture for texture in textures if letter(texture) in EXAMPLE_LETTERS]
    return known if len(known) == len(EXAMPLE_LETTERS) else spread(textures, 4)


def in_condition(samples: Samples, texture: str, speed_mm_s: float) -> Samples:
    """Return the samples of one texture at one speed, maybe none."""
    chosen = (samples[dims.TEXTURE].values == texture) & (samples[dims.SPEED].values == speed_mm_s)
    return samples.isel({dims.SAMPLE: np.flatnonzero(chosen)})


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most `most` of the items, evenly spread, both ends included."""
    if len(items) <= most:
        return list(items)
    return [items[round(place)] for place in np.linspace(0, len(items) - 1, most)]
