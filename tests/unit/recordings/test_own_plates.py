"""Plates of somebody's own that are numbered: no letters, spacings or arrows of the paper's."""

import json
import shutil

import pytest

from afferents.evaluation.results import read_summary
from afferents.recordings.data_sets import read_session
from afferents.store.responses import conditions
from afferents.store.zarr_store import open_responses

ALONE = ("--workers", 1, "--quiet")


@pytest.fixture
def plates(sounds, tmp_path):
    """The session of sounds, whose files may be named by a pattern: 1, 2 and 3 are names then."""

    def copy(kind, more=""):
        root = shutil.copytree(sounds, tmp_path / "plates")
        if kind != "declared":
            (root / "session.json").unlink()
        if kind == "pattern":
            toml = 'pattern = "{texture}/{speed}/audio.wav"\nsensor_channel = 1\n' + more
            (root / "session.toml").write_text(toml)
        return root

    return copy


@pytest.mark.parametrize(
    ("kind", "more", "by_spacing", "direction"),
    [
        ("declared", "", True, "+x"),
        ("published", "", True, "+x"),
        ("pattern", "", False, None),
        ("pattern", 'direction = "-y"\n', False, "-y"),
    ],
)
def test_spacings_and_directions_are_the_papers_or_declared(
    plates, kind, more, by_spacing, direction
):
    for one in read_session(plates(kind, more)).recordings:
        assert one.named_by_spacing == by_spacing
        assert one.conditions.get("direction") == direction


@pytest.mark.parametrize("kind", ["declared", "pattern"])
def test_the_report_has_letters_only_where_they_are_declared(kind, plates, sounds, tmp_path, does):
    steady = json.loads((sounds / "session.json").read_text())["steady_s"]
    root, store, out = plates(kind, f"steady_s = {steady}\n"), tmp_path / "s.zarr", tmp_path / "r"
    does("extract", root, store, *ALONE)
    does("evaluate", store, "--out", out, "--models", "vib-te", *ALONE)
    does("report", out, "--quiet")
    summary = read_summary(out).content()
    page = (out / "report.html").read_text().replace("\u00a0", " ")
    if kind == "declared":
        assert summary["named_by_spacing"]
        assert "3: c, e, g; letters as in the paper (c, e, g: bumps 1, 2, 3 mm apart)" in page
    else:
        assert "named_by_spacing" not in summary
        assert "3: 1, 2, 3" in page
        assert "mm apart" not in page
        assert "mislabelled" not in page
        assert "direction" not in conditions(open_responses(store)[0])
