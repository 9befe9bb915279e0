"""Which samples of a recording a model is asked about, to see what it leans on."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.cut import Cut
from afferents.core.responses import Responses
from afferents.core.samples import Samples
from afferents.core.split import Group, Split
from afferents.encodings import ImageEncoding
from afferents.pipeline.encode import Source, kept_part, response_of

_NUMBER = "number"
"""Coordinate of samples: which of the recording's they are."""


def some_of(
    responses: Responses,
    source: Source,
    cut: Cut,
    n: int,
    split: Split,
    learnt: Collection[Group],
) -> tuple[Samples, NDArray[np.float32] | None]:
    """Return up to n samples of a recording, evenly spread, and the runs of images they are of.

    None of them is of a group that was learnt from.
    """
    channel, encoding = source
    kept = kept_part(responses, source, cut)
    response = response_of(responses, source)
    samples = encoding.samples(response, kept, channel.lookback)
    if dims.FREQUENCY in samples.dims:
        n_seen = encoding.seen(samples.values[:1]).shape[-1]
        samples = samples.isel({dims.FREQUENCY: slice(n_seen)})
    samples = samples.assign_coords({_NUMBER: (dims.SAMPLE, np.arange(len(samples)))})
    samples = split.labelled(samples, [responses])
    samples = samples[~np.isin(split.of(samples), np.array([*learnt]))] if learnt else samples
    spread = np.unique(np.linspace(0, len(samples) - 1, n).round().astype(int))
    samples = samples.isel({dims.SAMPLE: spread})
    index = samples[_NUMBER].values
    runs = None
    if isinstance(encoding, ImageEncoding):
        runs = encoding.runs(response, kept)[index]
    return samples.drop_vars(_NUMBER), runs
