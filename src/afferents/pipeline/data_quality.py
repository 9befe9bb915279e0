"""What a summary says of the recordings: what was accepted, how many markers were lost."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from afferents.core import dims
from afferents.core.responses import Responses, doubts_in
from afferents.pipeline.reading import read_whole


def data_quality(recordings: Sequence[Responses]) -> dict[str, Any]:
    """Return what of the recordings whoever reads the numbers must know, ready for JSON.

    Returns
    -------
    dict
        `accepted`, of each recording that was kept with ``--accept`` what is wrong with it;
        `lost`, the share of marker positions (time, marker) that were lost, from 0 to 1: median
        over recordings, worst, and in which. Each is left out where there is none.

    Raises
    ------
    InputError
        If what a store says of lost markers can't be read.
    """
    accepted = [
        {"recording": str(r.attrs["name"]), "found": found}
        for r in recordings
        if (found := doubts_in(r.attrs))
    ]
    lost = {
        str(r.attrs["name"]): 1 - float(read_whole(r, dims.DETECTED).mean())
        for r in recordings
        if dims.DETECTED in r
    }
    said: dict[str, Any] = {"accepted": accepted} if accepted else {}
    if lost:
        worst = max(lost, key=lambda name: lost[name])
        median = float(np.median(list(lost.values())))
        said["lost"] = {
            "median": median, "worst": lost[worst], "recording": worst, "n": len(lost),
        }  # fmt: skip
    return said
