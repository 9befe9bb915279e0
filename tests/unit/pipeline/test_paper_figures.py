"""Which frames the figures as in the paper show of a recording."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from afferents.evaluation.results import Results
from afferents.reporting.paper import drums, paper_data
from afferents.reporting.pictures import FigureData


def evaluated(*textures, named=True):
    return Results(Path("r"), {}, {"textures": textures, "named_by_spacing": named}, pd.DataFrame())


def recording(n_frames):
    """Four markers; SA-I of each is the number of the frame, plus a tenth of that of the marker."""
    sa1 = np.arange(n_frames, dtype=np.float32)[:, None] + np.arange(4, dtype=np.float32) / 10
    coords = {
        "time": np.arange(n_frames) / 90,
        "row": ("marker", [0, 0, 1, 1]),
        "column": ("marker", [0, 1, 0, 1]),
    }
    attributes = {"name": "0/50", "texture": "0", "speed_mm_s": 50.0}
    return xr.Dataset({"sa1": (("time", "marker"), sa1)}, coords, attributes)


@pytest.mark.parametrize(
    ("n_frames", "apart", "first", "said"),
    [
        (5850, 20, 2521, "at video frame 2521 as in the paper"),
        (5850, 1, 2521, "at video frame 2521 as in the paper"),
        (900, 20, 359, "in the middle of each recording, which is shorter than the paper's"),
        (900, 1, 445, "in the middle of each recording, which is shorter than the paper's"),
    ],
)
def test_frames_are_the_papers_or_those_in_the_middle(n_frames, apart, first, said):
    paper = paper_data(evaluated("0", "linen"), [recording(n_frames)], FigureData())
    row = paper.frames["sa1", apart][0]
    expected = first + apart * np.arange(10)[:, None, None] + np.array([[0, 0.1], [0.2, 0.3]])
    np.testing.assert_allclose(row.images, expected, rtol=1e-6)
    assert row.time_s[1] == pytest.approx(apart / 90)
    assert paper.began == said
    assert ("ra1", apart) not in paper.frames


def test_drums_are_those_of_the_papers_series():
    (smooth,) = drums(evaluated("0", "linen"))
    assert smooth.name == "a (0 mm)"
    assert smooth.height_mm.max() == 0
    assert drums(evaluated("linen")) == []
    assert drums(evaluated("0", named=False)) == []
