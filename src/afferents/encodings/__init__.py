"""From responses to samples: the paper's encodings, then orders, wavenumbers and kernels."""

from afferents.encodings.augment import COPIES, stretch_spectrum, stretched_copies
from afferents.encodings.kernels import KernelEncoding, kernel_samples, require_kernels
from afferents.encodings.lines import Lines
from afferents.encodings.orders import OrderEncoding, order_samples, require_orders
from afferents.encodings.settings import Encodings
from afferents.encodings.spatial import spatial_samples, tactile_images
from afferents.encodings.spatiotemporal import FRAMES, require_run, spatiotemporal_samples
from afferents.encodings.spectral import (
    SpectralEncoding,
    amplitude_spectrum,
    require_window,
    spectral_samples,
    without_mean,
)
from afferents.encodings.wavenumbers import (
    WavenumberEncoding,
    component_images,
    image_runs,
    log_waves,
    wave_spectra,
    wavenumber_samples,
)

__all__ = [
    "COPIES",
    "FRAMES",
    "Encodings",
    "KernelEncoding",
    "Lines",
    "OrderEncoding",
    "SpectralEncoding",
    "WavenumberEncoding",
    "amplitude_spectrum",
    "component_images",
    "image_runs",
    "kernel_samples",
    "log_waves",
    "order_samples",
    "require_kernels",
    "require_orders",
    "require_run",
    "require_window",
    "spatial_samples",
    "spatiotemporal_samples",
    "spectral_samples",
    "stretch_spectrum",
    "stretched_copies",
    "tactile_images",
    "wave_spectra",
    "wavenumber_samples",
    "without_mean",
]
