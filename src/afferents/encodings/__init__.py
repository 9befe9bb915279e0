"""From responses to samples: spatial, spatio-temporal and spectral encodings."""

from afferents.encodings.augment import COPIES, stretch_spectrum, stretched_copies
from afferents.encodings.spatial import spatial_samples, tactile_images
from afferents.encodings.spatiotemporal import FRAMES, require_run, spatiotemporal_samples
from afferents.encodings.spectral import (
    SpectralEncoding,
    amplitude_spectrum,
    require_window,
    spectral_samples,
    without_mean,
)

__all__ = [
    "COPIES",
    "FRAMES",
    "SpectralEncoding",
    "amplitude_spectrum",
    "require_run",
    "require_window",
    "spatial_samples",
    "spatiotemporal_samples",
    "spectral_samples",
    "stretch_spectrum",
    "stretched_copies",
    "tactile_images",
    "without_mean",
]
