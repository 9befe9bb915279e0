"""What a summary says of the recordings: what was accepted, how many markers were lost."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

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
        str(r.attrs["name"]): share_lost(read_whole(r, dims.DETECTED), r.attrs)
        for r in recordings
        if dims.DETECTED in r
    }
    return ({"accepted": accepted} if accepted else {}) | lost_of(lost)


def share_lost(detected: xr.DataArray, about: Mapping[Any, Any]) -> float:
    """Return the share of marker positions lost from the rest frame on; before, none is looked for.

    Parameters
    ----------
    detected
        `(time, marker)`.
    about
        Attributes of the responses, which name the rest frame.
    """
    return 1 - float(detected[int(about.get("rest_frame", 0)) :].mean())


def lost_of(shares: Mapping[str, float]) -> dict[str, Any]:
    """Return `lost` of `data_quality`, from each recording's share; nothing of no recordings."""
    if not shares:
        return {}
    worst = max(shares, key=lambda name: shares[name])
    median = float(np.median(list(shares.values())))
    return {
        "lost": {"median": median, "worst": shares[worst], "recording": worst, "n": len(shares)}
    }
