"""From responses to samples: the paper's encodings, then orders, wavenumbers and kernels."""

from afferents.core.pixels import covered, images_of
from afferents.encodings.augment import COPIES, stretch_spectrum, stretched_copies
from afferents.encodings.base import (
    Encoding,
    ImageEncoding,
    Option,
    VibrationEncoding,
)
from afferents.encodings.kernels import KernelEncoding, kernel_samples
from afferents.encodings.known import Known
from afferents.encodings.lines import Lines
from afferents.encodings.markers import MarkersEncoding
from afferents.encodings.moments import MomentEncoding
from afferents.encodings.orders import OrderEncoding, order_samples
from afferents.encodings.settings import (
    ENCODINGS,
    Encodings,
    described,
    encoding_of,
    options,
)
from afferents.encodings.spatial import SpatialEncoding, spatial_samples
from afferents.encodings.spatiotemporal import SpatiotemporalEncoding, spatiotemporal_samples
from afferents.encodings.spectral import (
    SpectralEncoding,
    SpectrumStream,
    amplitude_spectrum,
    spectral_samples,
)
from afferents.encodings.spike_rate import SpikeRateEncoding
from afferents.encodings.spike_timing import SpikeTimingEncoding, interval_histograms
from afferents.encodings.streams import ImageStream, Ready
from afferents.encodings.tactile_image import image_runs, tactile_images
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
    "Known",
    "Lines",
    "MarkersEncoding",
    "MomentEncoding",
    "Option",
    "OrderEncoding",
    "Ready",
    "SpatialEncoding",
    "SpatiotemporalEncoding",
    "SpectralEncoding",
    "SpectrumStream",
    "SpikeRateEncoding",
    "SpikeTimingEncoding",
    "VibrationEncoding",
    "WaveStream",
    "WavenumberEncoding",
    "amplitude_spectrum",
    "covered",
    "described",
    "encoding_of",
    "image_runs",
    "images_of",
    "interval_histograms",
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
