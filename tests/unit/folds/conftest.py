import numpy as np
import pytest
import xarray as xr


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
