"""Data of figures: what is drawn or stands in, and what is lost where data are gone or damaged."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from afferents.encodings.settings import Encodings
from afferents.evaluation.data import open_data
from afferents.evaluation.results import Results, Summary
from afferents.progress import Progress
from afferents.reporting import data as reading
from afferents.reporting.data import PANELS, choose_rows, choose_substitutes, describe_substitutes
from afferents.reporting.report import draw_pictures

QUIET = Progress(quiet=True)


def about(textures):
    """What figures of the data need of a summary."""
    return Summary.model_construct(
        skipped=(), textures=tuple(textures), named_by_spacing=True, models={}
    )


@pytest.fixture
def store(stores, tmp_path):
    return shutil.copytree(stores["audio"], tmp_path / "sounds.zarr")


@pytest.fixture
def of_store(store, tmp_path):
    return evaluated(store, tmp_path / "r", ["1", "2"])


def evaluated(store, out, textures, **wanted):
    """What figures of the data need of an evaluation of a store."""
    data = [data.origin.model_dump() for data in open_data([str(store)])]
    config = {"data": data, "without": {}, "cut": "all", **Encodings(wanted=wanted).describe()}
    return Results(out, config, about(textures), pd.DataFrame())


def test_figures_as_in_the_paper_say_what_stands_in_and_are_drawn(stores, results, tmp_path):
    opened = open_data([str(stores["video"])])
    textures = sorted({str(r.attrs["texture"]) for data in opened for r in data.responses})
    shown = evaluated(stores["video"], tmp_path / "r", textures, window_s=0.2, stride_s=0.1)
    paper, notes = reading.read_figure_data(shown, QUIET, "paper")
    assert notes == []
    rows = paper.frames["ra1", 1]
    assert [(row.panel, row.shown.speed_mm_s) for row in rows] == [
        ("A", 40.0), ("A", 40.0), ("A", 40.0), ("B", 20.0), ("B", 40.0), ("B", 60.0),
    ]  # fmt: skip
    assert "shorter than the paper's" in paper.began
    name = f"{rows[3].shown.texture}/20"
    first = next(r for d in opened for r in d.responses if r.attrs["name"] == name)
    grid = first["ra1"].isel(time=first["ra1"].sizes["time"] // 2 - 5).values
    places = first["row"].values.astype(int), first["column"].values.astype(int)
    np.testing.assert_allclose(rows[3].images[0][places], grid, atol=1e-6)
    pictures = {one.name: one.figure for one in draw_pictures(results, paper, "paper")}
    for part in ("figure08", "figure10", "figure12", "vib-te"):
        drawn = [figure for name, figure in pictures.items() if part in name]
        assert drawn, part
        drawn[0].draw_without_rendering()


def test_data_that_changed_are_not_drawn_as_if_they_were_the_results(of_store, store):
    group = store / "zarr.json"
    content = json.loads(group.read_text())
    content["attributes"]["config"]["session"] = "another"
    group.write_text(json.dumps(content))
    data, (note,) = reading.read_figure_data(of_store, QUIET)
    assert data == reading.FigureData()
    assert "sounds.zarr: expected the data that were evaluated, found changed data" in note


def remove(of_store, store):
    shutil.rmtree(store)


def damage(of_store, store):
    chunk = next(path for path in (store / "2/30/ra2/c").rglob("*") if path.is_file())
    chunk.write_bytes(b"damaged")


def ask_too_long_windows(of_store, store):
    of_store.config["spectral"]["window_s"] = 100.0


@pytest.mark.parametrize(
    ("change", "said"),
    [(remove, "missing: "), (damage, "missing: "), (ask_too_long_windows, "window of 100 s")],
)
def test_data_that_are_gone_or_damaged_only_cost_the_figures(of_store, store, change, said):
    change(of_store, store)
    data, (note,) = reading.read_figure_data(of_store, QUIET)
    assert (data.spectra, data.frames) == (None, {})
    assert note.startswith("Figures of ")
    assert said in note


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
    frames, began = reading.read_frames([recording(n_frames)], True, "paper")
    row = frames["sa1", apart][0]
    expected = first + apart * np.arange(10)[:, None, None] + np.array([[0, 0.1], [0.2, 0.3]])
    np.testing.assert_allclose(row.images, expected, rtol=1e-6)
    assert row.time_s[1] == pytest.approx(apart / 90)
    assert began == said
    assert ("ra1", apart) not in frames


def test_the_papers_own_are_shown_where_they_are_there_else_what_is_nearest():
    """The nearest speed stands in, and is named; other textures by their place in the row."""
    recorded = [(texture, float(v)) for texture in ("0", "3", "6") for v in range(10, 101, 10)]
    shown = [one for panel in PANELS.values() for one in choose_substitutes(panel, recorded, True)]
    assert [(one.texture, one.speed_mm_s) for one in shown] == [
        ("0", 50), ("3", 50), ("6", 50), ("3", 10), ("3", 50), ("3", 100),
    ]  # fmt: skip
    assert describe_substitutes(shown) == ""
    (near,) = choose_substitutes([("g", 50.0)], [("3", 10.0), ("3", 40.0), ("0", 50.0)], True)
    assert (near.texture, near.label) == ("3", "g\n40 mm/s\n(for 50)")
    assert describe_substitutes([near]).endswith("session lacks: g at 40 mm/s for 50 mm/s.")
    others = [(name, 20.0) for name in ("cotton", "denim", "silk", "wool", "zinc")]
    shown = choose_substitutes([("a", 50.0), ("g", 50.0), ("m", 50.0)], others, True)
    assert [one.texture for one in shown] == ["cotton", "silk", "zinc"]
    assert shown[0].wanted == "a, 50"


def test_the_report_shows_textures_spread_over_what_there_is_and_one_of_them_at_three_speeds():
    recorded = [(name, float(v)) for name in "pqrstu" for v in (20, 40, 60, 80)] + [("v", 90.0)]
    shown = [(panel, one.label) for panel, one in choose_rows(recorded, False, "report")]
    assert shown == [
        ("A", "p\n40 mm/s"), ("A", "r\n40 mm/s"), ("A", "t\n40 mm/s"), ("A", "v\n90 mm/s"),
        ("B", "s\n20 mm/s"), ("B", "s\n60 mm/s"), ("B", "s\n80 mm/s"),
    ]  # fmt: skip
