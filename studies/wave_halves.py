"""Two models of waves, of which each sees one half: waves longer or shorter than 6.7 mm.

No drum of the rig has bumps more than 6 mm apart. So what the long half recognises is not a drum's
own wavelength.

    python studies/wave_halves.py S12.zarr RESULTS

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.
"""

import sys

import numpy as np
from numpy.typing import NDArray

import afferents
from afferents import Model
from afferents.encodings.base import Floats
from afferents.encodings.wavenumbers import WavenumberEncoding
from afferents.rig.skin import Skin

CUT_PER_MM = 0.15


class LongWaves(WavenumberEncoding):
    """Waves longer than 1 / `CUT_PER_MM`; the others are 0."""

    name = "long-waves"

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the waves of runs of images, their logarithms less the mean of those kept."""
        found = super().of_runs(runs, lookback)
        kept = self.stay(runs.shape[3], runs.shape[4])
        level = found[..., kept].mean(axis=-1)[..., None, None]
        return np.asarray(np.where(kept, found - level, 0.0), np.float32)

    def stay(self, n_rows: int, n_columns: int) -> NDArray[np.bool_]:
        """Tell which waves stay, (row_wavenumber, column_wavenumber)."""
        rows, columns = np.fft.fftfreq(n_rows), np.fft.rfftfreq(n_columns)
        per_mm = np.hypot(rows[:, None], columns) / Skin().pitch_mm
        return np.asarray(per_mm < CUT_PER_MM, bool)


class ShortWaves(LongWaves):
    """The other waves."""

    name = "short-waves"

    def stay(self, n_rows: int, n_columns: int) -> NDArray[np.bool_]:
        """Tell which waves stay."""
        return ~super().stay(n_rows, n_columns)


long_waves = Model("long-waves", channel="sa1_vector", encoding=LongWaves(), classifier="ridge")
short_waves = Model("short-waves", channel="sa1_vector", encoding=ShortWaves(), classifier="ridge")


if __name__ == "__main__":
    store, results = sys.argv[1:3]
    models = ["sa-wave-vector", f"{__file__}:long_waves", f"{__file__}:short_waves"]
    print(afferents.evaluate(store, results, models=models).accuracy)
