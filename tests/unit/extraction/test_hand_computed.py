"""A whole recording that can be worked out by hand."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from afferents.channels import CHANNELS
from afferents.encodings.images import SpatialEncoding
from afferents.evaluation.data import Source, encode
from afferents.extraction.extract import marker_responses
from afferents.store.recording import Recording
from afferents.store.responses import label
from afferents.store.zarr_store import create_store, open_responses, write_responses

NAN = np.nan


@pytest.fixture
def stored(tmp_path):
    """Three markers of a 1 x 3 sensor, five frames 0.5 s apart, written and read again.

    Rest positions (10, 10), (20, 10), (30, 10) px.

    =====  ==============  ====================  ==========
    frame  marker 0        marker 1              marker 2
    =====  ==============  ====================  ==========
    0      at rest         at rest               at rest
    1      moved (3, 4)    moved (0, 1)          at rest
    2      moved (3, 4)    lost                  at rest
    3      moved (6, 8)    moved (0, -2)         at rest
    4      at rest         moved (0, -2)         moved (1, 0)
    =====  ==============  ====================  ==========

    SA-I is the length of the move: 0 5 5 10 0, then 0 1 - 2 2, then 0 0 0 0 1.
    RA-I is its change: - 5 0 5 10, then - 1 - - 0, then - 0 0 0 1.
    """
    rest = np.array([[10, 10], [20, 10], [30, 10]], dtype=float)
    moved = np.array(
        [
            [[0, 0], [0, 0], [0, 0]],
            [[3, 4], [0, 1], [0, 0]],
            [[3, 4], [NAN, NAN], [0, 0]],
            [[6, 8], [0, -2], [0, 0]],
            [[0, 0], [0, -2], [1, 0]],
        ]
    )
    position = rest + moved
    tracks = xr.Dataset(
        {
            "position": (("time", "marker", "space"), position),
            "detected": (("time", "marker"), ~np.isnan(position[..., 0])),
            "rest_position": (("marker", "space"), rest),
        },
        coords={
            "time": np.arange(5) * 0.5,
            "space": ["x", "y"],
            "row": ("marker", [0, 0, 0]),
            "column": ("marker", [0, 1, 2]),
        },
    )
    recording = Recording("3/50", "3", 50.0, Path("3/50"), steady_s=(0.0, 9.0))
    create_store(tmp_path / "s.zarr", {"recordings": ["3/50"]})
    write_responses(tmp_path / "s.zarr", label(marker_responses(tracks), recording))
    return open_responses(tmp_path / "s.zarr")[0]


def test_sa1_and_ra1(stored):
    np.testing.assert_allclose(
        stored["sa1"].T, [[0, 5, 5, 10, 0], [0, 1, NAN, 2, 2], [0, 0, 0, 0, 1]]
    )
    np.testing.assert_allclose(
        stored["ra1"].T, [[NAN, 5, 0, 5, 10], [NAN, 1, NAN, NAN, 0], [NAN, 0, 0, 0, 1]]
    )
    assert stored["sa1"].attrs["units"] == "px"
    assert stored["ra1"].attrs["units"] == "px/frame"


def test_tactile_images_fill_what_was_lost_from_the_markers_beside(stored):
    """Marker 1 is lost in frame 2: its SA-I then, and its RA-I then and in frame 3, are a mean.

    RA-I begins with frame 1, the first that has one before it.
    """
    slow = encode(stored, Source(CHANNELS["sa1"], SpatialEncoding()), "all")
    np.testing.assert_allclose(
        slow.values[:, 0], [[0, 0, 0], [5, 1, 0], [5, 2.5, 0], [10, 2, 0], [0, 2, 1]]
    )
    rapid = encode(stored, Source(CHANNELS["ra1"], SpatialEncoding()), "all")
    np.testing.assert_allclose(rapid.values[:, 0], [[5, 1, 0], [0, 0, 0], [5, 2.5, 0], [10, 0, 1]])
    np.testing.assert_allclose(slow["start_s"], [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(rapid["start_s"], [0, 0.5, 1, 1.5])
    assert set(slow["texture"].values) == {"3"}
    assert set(slow["speed_mm_s"].values) == {50.0}
