"""Artificial SA-I, RA-I and RA-II/vibrotactile afferents for tactile sensing of texture.

The way of the data, in the paper's order::

    session = afferents.read_session(path)                  # recordings, lazy
    tracks = afferents.track(recording.video, sensor)       # marker positions
    slow = afferents.sa1(tracks.position, tracks.rest_position)     # SA-I,  Eq. 1
    rapid = afferents.ra1(slow)                             # RA-I,  Eq. 2
    vibration = afferents.ra2(recording.audio.read())       # RA-II
    samples = afferents.spatial_samples(afferents.hold(slow), frames, memory=0)
    for fold in afferents.LeaveOneSpeedOut().folds(samples): ...

Names are imported when first used, so that the command line starts without the networks.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from afferents.channels import hold, marker_speed, ra1, ra2, sa1
    from afferents.core.responses import Responses
    from afferents.core.results import load_results
    from afferents.core.store import open_responses
    from afferents.encodings import (
        SpectralEncoding,
        spatial_samples,
        spatiotemporal_samples,
        spectral_samples,
        stretch_spectrum,
    )
    from afferents.evaluation import LeaveOneSpeedOut
    from afferents.markers import Tracker, load_sensor, track
    from afferents.models import build
    from afferents.recordings import open_video, read_fabricslide, read_session
    from afferents.training import predict, train, training_config

__version__ = "0.1.0"

_HOME = {
    "open_video": "recordings",
    "read_fabricslide": "recordings",
    "read_session": "recordings",
    "Tracker": "markers",
    "load_sensor": "markers",
    "track": "markers",
    "hold": "channels",
    "marker_speed": "channels",
    "ra1": "channels",
    "ra2": "channels",
    "sa1": "channels",
    "Responses": "core.responses",
    "open_responses": "core.store",
    "SpectralEncoding": "encodings",
    "spatial_samples": "encodings",
    "spatiotemporal_samples": "encodings",
    "spectral_samples": "encodings",
    "stretch_spectrum": "encodings",
    "build": "models",
    "predict": "training",
    "train": "training",
    "training_config": "training",
    "LeaveOneSpeedOut": "evaluation",
    "load_results": "core.results",
}

__all__ = [  # noqa: RUF022  the pipeline in paper order
    "open_video",
    "read_fabricslide",
    "read_session",
    "Tracker",
    "load_sensor",
    "track",
    "hold",
    "marker_speed",
    "ra1",
    "ra2",
    "sa1",
    "Responses",
    "open_responses",
    "SpectralEncoding",
    "spatial_samples",
    "spatiotemporal_samples",
    "spectral_samples",
    "stretch_spectrum",
    "build",
    "predict",
    "train",
    "training_config",
    "LeaveOneSpeedOut",
    "load_results",
]


def __getattr__(name: str) -> Any:
    if name == "live":
        return import_module("afferents.live")
    if name in _HOME:
        return getattr(import_module(f"afferents.{_HOME[name]}"), name)
    raise AttributeError(f"module 'afferents' has no attribute '{name}'")
