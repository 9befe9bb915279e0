"""Statistics of features, as LeRobot normalises with them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

_QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
Stats = dict[str, NDArray[Any]]
SEEN = 100
"""So many pictures of an episode are looked at, evenly spread."""


def stats_of(values: NDArray[Any]) -> Stats:
    """Return least, largest, mean, standard deviation, quantiles and number, over the frames.

    Parameters
    ----------
    values
        (frame,) or (frame, n).
    """
    rows = values.reshape(len(values), -1).astype(np.float64)
    return {
        "min": rows.min(axis=0),
        "max": rows.max(axis=0),
        "mean": rows.mean(axis=0),
        "std": rows.std(axis=0),
        "count": np.array([len(rows)]),
        **{name: np.quantile(rows, share, axis=0) for name, share in _QUANTILES.items()},
    }


def stats_of_pictures(pictures: NDArray[np.uint8]) -> Stats:
    """Return the same of each colour, 0 to 1, (3, 1, 1), from some grey pictures (n, h, w)."""
    found = stats_of(pictures.reshape(-1, 1) / 255)
    shaped = {name: np.tile(value, 3).reshape(3, 1, 1) for name, value in found.items()}
    return {**shaped, "count": np.array([len(pictures)])}


def together(parts: list[Stats]) -> Stats:
    """Return the statistics of all episodes, from those of each; quantiles are mean ones.

    Chan, Golub & LeVeque 1979 put means and variances together, as LeRobot does.
    """
    n = np.array([part["count"][0] for part in parts], np.float64)
    share = (n / n.sum()).reshape(-1, *[1] * parts[0]["mean"].ndim)
    mean = (share * np.stack([part["mean"] for part in parts])).sum(axis=0)
    apart = np.stack([part["mean"] - mean for part in parts])
    variance = (share * (np.stack([part["std"] for part in parts]) ** 2 + apart**2)).sum(axis=0)
    return {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": mean,
        "std": np.sqrt(variance),
        "count": np.array([int(n.sum())]),
        **{q: (share * np.stack([part[q] for part in parts])).sum(axis=0) for q in _QUANTILES},
    }
