"""Plates of somebody's own that are numbered: no letters, spacings or arrows of the paper's."""

import json
import shutil

import pytest

from afferents.evaluation.results import read_summary
from afferents.recordings.session import read_session
from afferents.store.responses import conditions
from afferents.store.zarr_store import open_responses

PATTERN = 'pattern = "{texture}/{speed}/audio.wav"\n'


@pytest.fixture(scope="module")
def numbered(sounds, tmp_path_factory):
    """The session of sounds with its files named by a pattern: 1, 2 and 3 are names."""
    root = shutil.copytree(sounds, tmp_path_factory.mktemp("own") / "plates")
    (root / "session.json").unlink()
    (root / "session.toml").write_text(PATTERN + "sensor_channel = 1\n")
    return root


def test_only_the_published_layout_says_that_names_are_spacings(sounds, numbered):
    assert all(one.named_by_spacing for one in read_session(sounds).recordings)
    assert not any(one.named_by_spacing for one in read_session(numbered).recordings)


def test_a_direction_is_there_only_if_it_is_declared(sounds, numbered):
    assert read_session(sounds).recordings[0].conditions["direction"] == "+x"
    assert "direction" not in read_session(numbered).recordings[0].conditions
    (numbered / "session.toml").write_text(PATTERN + 'direction = "-y"\n')
    said = {one.conditions["direction"] for one in read_session(numbered).recordings}
    assert said == {"-y"}


def test_a_session_without_a_session_file_is_of_the_papers_drums(sounds, tmp_path):
    root = shutil.copytree(sounds, tmp_path / "published")
    (root / "session.json").unlink()
    (first, *_) = read_session(root).recordings
    assert first.named_by_spacing
    assert first.conditions == {"direction": "+x"}


@pytest.mark.parametrize("kind", ["published", "pattern"])
def test_the_report_has_letters_only_where_they_are_declared(kind, sounds, tmp_path, run):
    root = shutil.copytree(sounds, tmp_path / "session")
    if kind == "pattern":
        (root / "session.json").unlink()
        steady = json.loads((sounds / "session.json").read_text()).get("steady_s", [0.3, 2.7])
        (root / "session.toml").write_text(f"{PATTERN}sensor_channel = 1\nsteady_s = {steady}\n")
    store, out = tmp_path / "s.zarr", tmp_path / "r"
    assert run("extract", root, store, "--workers", 1, "--quiet")[0] == 0
    command = ("evaluate", store, "--out", out, "--models", "vib-te", "--preset", "quick")
    assert run(*command, "--workers", 1, "--quiet")[0] == 0
    assert run("report", out, "--quiet")[0] == 0
    summary = read_summary(out).content()
    page = (out / "report.html").read_text().replace("\u00a0", " ")
    if kind == "published":
        assert summary["named_by_spacing"]
        assert "3: c, e, g; letters as in the paper, for bumps 1, 2, 3 mm apart" in page
    else:
        assert "named_by_spacing" not in summary
        assert "3: 1, 2, 3" in page
        assert "mm apart" not in page
        assert "mislabelled" not in page
        assert "direction" not in conditions(open_responses(store)[0])
