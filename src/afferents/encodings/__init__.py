"""From responses to samples: spatial, spatio-temporal and spectral encodings."""

from afferents.encodings.augment import stretch_spectrum, stretched_copies
from afferents.encodings.spatial import spatial_samples, tactile_images
from afferents.encodings.spatiotemporal import spatiotemporal_samples
from afferents.encodings.spectral import SpectralEncoding, amplitude_spectrum, spectral_samples

__all__ = [
    "SpectralEncoding",
    "amplitude_spectrum",
    "spatial_samples",
    "spatiotemporal_samples",
    "spectral_samples",
    "stretch_spectrum",
    "stretched_copies",
    "tactile_images",
]
