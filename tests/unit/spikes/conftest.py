"""Recordings with responses that a test has chosen."""

import numpy as np
import xarray as xr


def recording_of(time, sa1=None, ra1=None, sound=None, rate_hz=8000):
    """Responses (time, marker) and sound (sample,); RA-I is how SA-I changes, unless given."""
    variables = {}
    if sa1 is not None:
        changes = np.abs(np.diff(sa1, axis=0, prepend=np.nan)) if ra1 is None else ra1
        variables |= {"sa1": (("time", "marker"), np.asarray(sa1, np.float32), {"units": "px"})}
        variables |= {"ra1": (("time", "marker"), np.asarray(changes, np.float32))}
    if sound is not None:
        attrs = {"sample_rate_hz": float(rate_hz)}
        variables |= {"ra2": (("audio_time", "channel"), np.float32(sound)[:, None], attrs)}
    attrs = {"name": "g/50", "texture": "g", "speed_mm_s": 50.0, "steady_s": "null"}
    return xr.Dataset(variables, {} if sa1 is None else {"time": time}, attrs=attrs)
