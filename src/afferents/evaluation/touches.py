"""Whole recordings: what all samples of one touch say together."""

import numpy as np
import pandas as pd

from afferents.core.results import PROBABILITY
from afferents.core.split import SPEED, column_of

_LEAST = 1e-12


def name_recordings(predictions: pd.DataFrame, textures: list[str]) -> pd.DataFrame:
    """Name each recording by the sum of its samples' log-probabilities.

    Neighbouring samples say nearly the same, so the sum is far too sure of itself; which texture
    leads does not depend on that.

    Parameters
    ----------
    predictions
        One row a test sample, as `predictions_table` makes them.

    Returns
    -------
    DataFrame
        One row a recording and seed: seed, held_out_speed_mm_s (or held_out_group), recording,
        true_texture, predicted_texture.
    """
    columns = [f"{PROBABILITY}{texture}" for texture in textures]
    by = ["seed", column_of(predictions), "recording", "true_texture"]
    logs = predictions[[*by, *columns]].copy()
    logs[columns] = np.log(logs[columns].clip(lower=_LEAST))
    sums = logs.groupby(by, sort=True)[columns].sum()
    named = pd.DataFrame(sums.index.to_frame(index=False))
    named["predicted_texture"] = np.array(textures)[sums.to_numpy().argmax(axis=1)]
    return named


def inside_speeds(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return the rows whose held-out speed lies between others: neither slowest nor fastest.

    To hold out an end of the range is to extrapolate, a harder question than the other speeds'.
    Of groups that lie on no scale none lies between others.
    """
    if SPEED.column not in predictions:
        return predictions.iloc[:0]
    speed = predictions[SPEED.column]
    inner: pd.DataFrame = predictions.loc[(speed > speed.min()) & (speed < speed.max())]
    return inner
