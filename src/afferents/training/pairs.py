"""Which samples of one kind belong to a window of another: those that end within it."""

import numpy as np
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.samples import Samples

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


def mean_within(
    lead: Samples, windows: Indices, other: Samples, index: Indices, values: Floats
) -> Floats:
    """Return the mean value of the samples that end within each window.

    Parameters
    ----------
    lead, windows
        Samples whose extents are the windows, and which of them are asked for, (n,).
    other, index, values
        Samples of another kind, which of them have values, (m,), and these values, (m, k).

    Returns
    -------
    Shape (n, k); 0 where no sample of the other kind ends within a window.
    """
    found = np.zeros((len(windows), values.shape[1]))
    recording, stop_s = _touches(other)[index], other[dims.STOP].values[index]
    of_window = _touches(lead)[windows]
    for name in np.unique(of_window):
        mine = np.flatnonzero(of_window == name)
        theirs = np.flatnonzero(recording == name)
        order = theirs[np.argsort(stop_s[theirs], kind="stable")]
        sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values[order], axis=0)])
        edges = (lead[which].values[windows[mine]] for which in (dims.START, dims.STOP))
        first, stop = (np.searchsorted(stop_s[order], edge, side="right") for edge in edges)
        n = (stop - first)[:, None]
        found[mine] = np.where(n > 0, (sums[stop] - sums[first]) / np.maximum(n, 1), 0.0)
    return found


def last_within(lead: Samples, other: Samples) -> Indices:
    """Return which sample of another kind ends last in each window, (n,).

    Of a window in which none ends, as where the sound goes on after the video, it is the one of its
    recording that ended last before it, or the first one. Where parts of a recording are held out,
    it is one of the same part: a window that is learnt from must not bring what is tested.

    Parameters
    ----------
    lead
        Samples whose extents are the windows, (n,).
    other
        Samples of another kind, of the same recordings.

    Raises
    ------
    InputError
        If there is none of a window's recording, or of its part of the recording.
    """
    found = np.zeros(len(lead), dtype=np.int64)
    of_window, of_other = _touches(lead), _touches(other)
    stop_s = other[dims.STOP].values
    for name in np.unique(of_window):
        mine, theirs = np.flatnonzero(of_window == name), np.flatnonzero(of_other == name)
        if not len(theirs):
            raise _none(lead, mine[0])
        order = theirs[np.argsort(stop_s[theirs], kind="stable")]
        after = np.searchsorted(stop_s[order], lead[dims.STOP].values[mine], side="right")
        found[mine] = order[np.maximum(after - 1, 0)]
    return found


def _none(lead: Samples, window: int) -> InputError:
    of = lead[{dims.SAMPLE: window}]
    part = f" in part {of[dims.GROUP].item()}" if dims.GROUP in of.coords else ""
    return InputError(
        f"recording {of[dims.RECORDING].item()}",
        f"samples of every afferent that a model joins{part}",
        "none of one of them",
        "record for longer, or hold out larger parts, such as --split angle-3",
    )


def _touches(samples: Samples) -> NDArray[np.str_]:
    """Return what names each sample's recording, and its variant and part if it has several."""
    named = samples[dims.RECORDING].values.astype(np.str_)
    for mark, name in (("#", dims.VARIANT), ("@", dims.GROUP)):
        if name in samples.coords:
            named = np.char.add(named, np.char.add(mark, samples[name].values.astype(np.str_)))
    return named
