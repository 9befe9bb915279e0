"""From responses to samples: the paper's encodings, then orders, wavenumbers and kernels."""

from afferents.encodings.augment import COPIES, stretch_spectrum, stretched_copies
from afferents.encodings.base import (
    Encoding,
    ImageEncoding,
    Option,
    VibrationEncoding,
)
from afferents.encodings.kernels import KernelEncoding, kernel_samples
from afferents.encodings.lines import Lines
from afferents.encodings.orders import OrderEncoding, order_samples
from afferents.encodings.settings import (
    ENCODINGS,
    Encodings,
    described,
    encoding_of,
    options,
)
from afferents.encodings.spatial import (
    SpatialEncoding,
    image_runs,
    spatial_samples,
    tactile_images,
)
from afferents.encodings.spatiotemporal import SpatiotemporalEncoding, spatiotemporal_samples
from afferents.encodings.spectral import (
    SpectralEncoding,
    SpectrumStream,
    amplitude_spectrum,
    spectral_samples,
)
from afferents.encodings.streams import ImageStream, Ready
from afferents.encodings.wavenumbers import (
    WavenumberEncoding,
    WaveStream,
    log_waves,
    wave_spectra,
    wavenumber_samples,
)

__all__ = [
    "COPIES",
    "ENCODINGS",
    "Encoding",
    "Encodings",
    "ImageEncoding",
    "ImageStream",
    "KernelEncoding",
    "Lines",
    "Option",
    "OrderEncoding",
    "Ready",
    "SpatialEncoding",
    "SpatiotemporalEncoding",
    "SpectralEncoding",
    "SpectrumStream",
    "VibrationEncoding",
    "WaveStream",
    "WavenumberEncoding",
    "amplitude_spectrum",
    "described",
    "encoding_of",
    "image_runs",
    "kernel_samples",
    "log_waves",
    "options",
    "order_samples",
    "spatial_samples",
    "spatiotemporal_samples",
    "spectral_samples",
    "stretch_spectrum",
    "stretched_copies",
    "tactile_images",
    "wave_spectra",
    "wavenumber_samples",
]
