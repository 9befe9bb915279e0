"""Artificial SA-I, RA-I and RA-II/vibrotactile afferents for tactile sensing of texture.

The way of the data, in the paper's order::

    import afferents

    session = afferents.read_session("SESSION")             # recordings, lazy
    recording = session.recordings[0]
    tracks = afferents.track(recording.video, "tip_b")      # marker positions
    tracks.sa1, tracks.ra1                                  # SA-I, Eq. 1, and RA-I, Eq. 2
    vibration = afferents.ra2(recording.audio.read())       # RA-II

Most commands of the shell are functions of the same name::

    afferents.extract("SESSION", "S.zarr")                  # the same of all recordings, kept
    results = afferents.evaluate("S.zarr", out="RESULTS", models=["ra-se", "ra-wave-vector"])
    results.accuracy                                        # a table, by speed held out
    afferents.report("RESULTS")                             # Table 1, figures, a page

A model of your own is an `afferents.Model`, data of your own an `afferents.DataSet`; see their
help.

Names are imported when first used, so that the command line starts without the networks.
"""

from typing import Any

import lazy_loader

from afferents.plugins import missing_extra

_lazily, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Import what is asked for; say what to install where it needs packages for learning."""
    try:
        return _lazily(name)
    except ImportError as error:
        if (missing := missing_extra(error, f"afferents.{name}")) is not None:
            raise missing from error
        raise
