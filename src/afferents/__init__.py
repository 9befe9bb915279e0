"""Artificial SA-I, RA-I and RA-II/vibrotactile afferents for tactile sensing of texture.

The way of the data, in the paper's order::

    import afferents

    session = afferents.read_session("SESSION")             # recordings, lazy
    recording = session.recordings[0]
    tracks = afferents.track(recording.video, "tip_b")      # marker positions
    tracks.sa1, tracks.ra1                                  # SA-I, Eq. 1, and RA-I, Eq. 2
    vibration = afferents.ra2(recording.audio.read())       # RA-II

Every command of the shell is a function of the same name::

    afferents.extract("SESSION", "S.zarr")                  # the same of all recordings, kept
    results = afferents.evaluate("S.zarr", out="RESULTS", models=["ra-se", "ra-wave-vector"])
    results.accuracy                                        # a table, by speed held out
    afferents.report("RESULTS")                             # Table 1, figures, a page

A model of your own is an `afferents.Model`, data of your own an `afferents.DataSet`; see their
help.

Names are imported when first used, so that the command line starts without the networks.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from afferents import plot
    from afferents.channels import CHANNELS, Channel, fill, hold, marker_speed, ra1, ra2, sa1
    from afferents.commands import (
        calibrate,
        compare,
        evaluate,
        evaluate_textures,
        explain,
        explain_shear,
        export,
        export_lerobot,
        export_mcap,
        export_nwb,
        extract,
        fetch,
        import_recording,
        init_session,
        inspect,
        load_model,
        neural,
        record,
        report,
        reproduce,
        samples,
        simulate,
        track,
        train,
        view,
    )
    from afferents.core.model import MODELS, Model
    from afferents.core.recording import Recording
    from afferents.core.responses import Responses
    from afferents.core.results import load_results
    from afferents.core.store import open_responses
    from afferents.core.version import __version__ as __version__
    from afferents.encodings import (
        ENCODINGS,
        ImageEncoding,
        KernelEncoding,
        OrderEncoding,
        SpatialEncoding,
        SpatiotemporalEncoding,
        SpectralEncoding,
        VibrationEncoding,
        WavenumberEncoding,
        spatial_samples,
        spatiotemporal_samples,
        spectral_samples,
        stretch_spectrum,
    )
    from afferents.evaluation import LeaveOneGroupOut, LeaveOneSpeedOut
    from afferents.markers import Tracker, load_sensor
    from afferents.models import CLASSIFIERS
    from afferents.pipeline.example import example
    from afferents.recordings import (
        DATA_SETS,
        DataSet,
        Session,
        WavFile,
        open_video,
        read_session,
    )
    from afferents.spikes import Spikes, artificial_spikes
    from afferents.spikes.natural import read_natural, read_nwb
    from afferents.training import training_config


_COMMANDS = (
    "fetch",
    "init_session",
    "record",
    "import_recording",
    "calibrate",
    "track",
    "simulate",
    "extract",
    "evaluate",
    "report",
    "reproduce",
    "train",
    "export",
    "export_lerobot",
    "export_mcap",
    "export_nwb",
    "explain",
    "inspect",
    "samples",
    "load_model",
    "evaluate_textures",
    "explain_shear",
    "neural",
    "compare",
    "view",
)
_MODULES = {
    "devices": "afferents.devices",
    "live": "afferents.live",
    "plot": "afferents.plot",
}
_HOME = {
    "example": "pipeline.example",
    **dict.fromkeys(_COMMANDS, "commands"),
    "DATA_SETS": "recordings",
    "DataSet": "recordings",
    "Recording": "core.recording",
    "Session": "recordings",
    "WavFile": "recordings",
    "open_video": "recordings",
    "read_session": "recordings",
    "Tracker": "markers",
    "load_sensor": "markers",
    "CHANNELS": "channels",
    "Channel": "channels",
    "fill": "channels",
    "hold": "channels",
    "marker_speed": "channels",
    "ra1": "channels",
    "ra2": "channels",
    "sa1": "channels",
    "Responses": "core.responses",
    "open_responses": "core.store",
    "Spikes": "spikes",
    "artificial_spikes": "spikes",
    "ENCODINGS": "encodings",
    "ImageEncoding": "encodings",
    "KernelEncoding": "encodings",
    "OrderEncoding": "encodings",
    "SpatialEncoding": "encodings",
    "SpatiotemporalEncoding": "encodings",
    "SpectralEncoding": "encodings",
    "VibrationEncoding": "encodings",
    "WavenumberEncoding": "encodings",
    "spatial_samples": "encodings",
    "spatiotemporal_samples": "encodings",
    "spectral_samples": "encodings",
    "stretch_spectrum": "encodings",
    "CLASSIFIERS": "models",
    "MODELS": "core.model",
    "Model": "core.model",
    "training_config": "training",
    "LeaveOneGroupOut": "evaluation",
    "LeaveOneSpeedOut": "evaluation",
    "load_results": "core.results",
    "read_natural": "spikes.natural",
    "read_nwb": "spikes.natural",
}

__all__ = [  # noqa: RUF022  the commands, then the pipeline in paper order
    "example",
    "plot",
    "fetch",
    "init_session",
    "record",
    "import_recording",
    "calibrate",
    "track",
    "simulate",
    "extract",
    "evaluate",
    "report",
    "reproduce",
    "train",
    "export",
    "export_lerobot",
    "export_mcap",
    "export_nwb",
    "view",
    "explain",
    "inspect",
    "samples",
    "load_model",
    "evaluate_textures",
    "explain_shear",
    "neural",
    "compare",
    "DATA_SETS",
    "DataSet",
    "Recording",
    "Session",
    "WavFile",
    "open_video",
    "read_session",
    "Tracker",
    "load_sensor",
    "CHANNELS",
    "Channel",
    "fill",
    "hold",
    "marker_speed",
    "ra1",
    "ra2",
    "sa1",
    "Responses",
    "open_responses",
    "Spikes",
    "artificial_spikes",
    "ENCODINGS",
    "ImageEncoding",
    "KernelEncoding",
    "OrderEncoding",
    "SpatialEncoding",
    "SpatiotemporalEncoding",
    "SpectralEncoding",
    "VibrationEncoding",
    "WavenumberEncoding",
    "spatial_samples",
    "spatiotemporal_samples",
    "spectral_samples",
    "stretch_spectrum",
    "CLASSIFIERS",
    "MODELS",
    "Model",
    "training_config",
    "LeaveOneGroupOut",
    "LeaveOneSpeedOut",
    "load_results",
    "read_natural",
    "read_nwb",
]


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(_MODULES[name])
    if name == "__version__":
        return import_module("afferents.core.version").__version__
    if name in _HOME:
        return getattr(import_module(f"afferents.{_HOME[name]}"), name)
    raise AttributeError(f"module 'afferents' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted([*__all__, "live", "__version__"])
