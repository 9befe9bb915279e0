"""The part of a recording in which the drum slides, and what lasts too long in it."""

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.float64]

GAP_S = 0.7
"""A frozen picture changes once where a codec begins anew (a key frame), and differs from those of
half a second before for as long."""


def sliding_part(
    begin_s: float, end_s: float, steady_s: tuple[float, float] | None
) -> tuple[float, float]:
    """Return between which times (s) the drum slides, for what is judged there.

    Where nothing is declared, or nothing of the recording lies there, the first and last 2.5 s are
    left out, of a short one a quarter at each end: something is always left.
    """
    if steady_s is not None and max(begin_s, steady_s[0]) < min(end_s, steady_s[1]):
        return max(begin_s, steady_s[0]), min(end_s, steady_s[1])
    edge_s = min(EDGE_S, (end_s - begin_s) / 4)
    return begin_s + edge_s, end_s - edge_s


def lasting(
    holds: NDArray[np.bool_], time_s: Times, part: tuple[float, float], least_s: float
) -> tuple[float, float] | None:
    """Return from when to when (s) something holds that lasts too long; None if nothing does.

    Parameters
    ----------
    holds, time_s
        Of each frame.
    part, least_s
        It must hold for at least so long without a break between these times; it may begin before
        them and end after them. If it does so again within `GAP_S`, that counts as one.
    """
    edges = np.diff(np.r_[False, holds, False].astype(np.int8))
    begins_s = time_s[np.flatnonzero(edges == 1)]
    ends_s = time_s[np.flatnonzero(edges == -1) - 1]
    spans: list[tuple[float, float]] = []
    for begin_s, end_s in zip(begins_s.tolist(), ends_s.tolist(), strict=True):
        if end_s - begin_s < least_s:
            continue
        if spans and begin_s - spans[-1][1] <= GAP_S:
            begin_s = spans.pop()[0]
        spans.append((begin_s, end_s))
    inside = (span for span in spans if min(span[1], part[1]) - max(span[0], part[0]) >= least_s)
    return next(inside, None)


def span_text(span: tuple[float, float], time_s: Times) -> str:
    """Say from when to when (s), or that it lasts to the end of the recording."""
    end = "to the end" if span[1] >= time_s[-1] - GAP_S else f"to {span[1]:.2f} s"
    return f"from {span[0]:.2f} s {end}"


EDGE_S = 2.5
"""Thrown away at each end where nothing says when the speed was constant (paper, section 2.2)."""
