"""The parameters of all encodings that have any."""

from pydantic import BaseModel, ConfigDict

from afferents.encodings.kernels import KernelEncoding
from afferents.encodings.lines import Lines
from afferents.encodings.orders import OrderEncoding
from afferents.encodings.spectral import SpectralEncoding
from afferents.encodings.wavenumbers import WavenumberEncoding


class Encodings(BaseModel):
    """How samples are made of responses; the spatial encodings have no parameters."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    spectral: SpectralEncoding = SpectralEncoding()
    orders: OrderEncoding = OrderEncoding()
    kernels: KernelEncoding = KernelEncoding()
    wavenumbers: WavenumberEncoding = WavenumberEncoding()

    def changed(
        self,
        window_s: float | None = None,
        stride_s: float | None = None,
        fft_points: int | None = None,
        model_bins: int | None = None,
        frames: int | None = None,
        every: int | None = None,
        mask: Lines | None = None,
    ) -> "Encodings":
        """Return them with the parameters given; see `SpectralEncoding.changed`.

        Raises
        ------
        InputError
            If a value is not a positive, finite number.
        """
        spectral = self.spectral.changed(window_s, stride_s, fft_points, model_bins)
        windows: dict[str, object] = {"mask": mask} if mask else {}
        if window_s is not None:
            windows |= {"window_s": window_s, "windows": self.spectral.windows}
        if stride_s is not None:
            windows |= {"stride_s": stride_s, "windows": None}
        waves = {name: n for name, n in {"frames": frames, "every": every}.items() if n}
        return Encodings(
            spectral=spectral,
            orders=self.orders.model_copy(update=windows),
            kernels=self.kernels.model_copy(update=windows),
            wavenumbers=self.wavenumbers.model_copy(update=waves),
        )
