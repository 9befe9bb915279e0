import numpy as np
import pytest
import xarray as xr

from afferents import DataSet, Recording, Session, WavFile


class SoundFiles(DataSet):
    """Sounds ``{texture}_{...}.wav`` of `lasting_s` each; `told` reads what else is in a name."""

    lasting_s = 1.0

    def scan(self):
        return Session(self.path, tuple(map(self.one, sorted(self.path.glob("*.wav")))))

    def one(self, path):
        texture, *rest = path.stem.split("_")
        speed_mm_s, conditions = self.told(*rest)
        return Recording(
            path.stem, texture, speed_mm_s, path, audio=WavFile(path, channel=0),
            steady_s=(0.0, self.lasting_s), conditions=conditions,
        )  # fmt: skip

    def told(self, speed):
        """Return the speed, mm/s, and conditions."""
        return float(speed), {}


def make(speeds, textures=("a", "b"), n=6, overlap=0.0):
    """Samples of n windows of 1 s a recording, neighbours overlapping by `overlap` s."""
    rows = [
        (t, float(v), f"{t}/{v:g}", i * (1 - overlap), i * (1 - overlap) + 1.0)
        for t in textures
        for v in speeds
        for i in range(n)
    ]
    names = ("texture", "speed_mm_s", "recording", "start_s", "stop_s")
    coords = {
        k: ("sample", np.array(c)) for k, c in zip(names, zip(*rows, strict=True), strict=True)
    }
    return xr.DataArray(np.zeros((len(rows), 3), np.float32), dims=("sample", "x"), coords=coords)


@pytest.fixture
def samples():
    return make
