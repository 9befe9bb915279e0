"""RA-II: the vibration itself, as the microphone or the taxels sense it (section 2.3.3)."""

import numpy as np
import xarray as xr

from afferents.channels.base import Channel
from afferents.channels.checks import require_dims
from afferents.core import dims
from afferents.core.errors import InputError


class Ra2(Channel):
    """RA-II: the vibration of microphone or taxels."""

    name, title, made_of = dims.RA2, "RA-II", dims.RA2

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the vibration `(audio_time, channel)` as it was extracted."""
        return recording[dims.RA2]


def ra2(audio: xr.DataArray) -> xr.DataArray:
    """Return the artificial RA-II response: the vibration, unfiltered and unscaled.

    What makes it a response (windows, spectra) belongs to the encoding.

    Parameters
    ----------
    audio
        `(audio_time, channel)` with `sample_rate_hz` in its attributes; unit as it comes.

    Returns
    -------
    xarray.DataArray
        `ra2` `(audio_time, channel)` float32, attributes kept; NaN stays NaN.

    Raises
    ------
    InputError
        If a dim or the sample rate is missing.
    """
    vibration = require_dims(audio, (dims.AUDIO_TIME, dims.CHANNEL), "audio")
    if dims.SAMPLE_RATE not in vibration.attrs:
        raise InputError("audio", f"the attribute '{dims.SAMPLE_RATE}'", "none")
    return vibration.astype(np.float32, copy=False).rename(dims.RA2)
