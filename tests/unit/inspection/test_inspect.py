"""What `inspect` finds wrong, and what it says of recordings too short for the paper's cut."""

import shutil

import numpy as np
import pytest
import xarray as xr

from afferents.inspection.files import draw_vibration
from afferents.inspection.init import list_first
from afferents.inspection.inspect import inspect
from afferents.inspection.sessions import too_short_sentences

HEADER = ",".join(["timestamp", "proximity1", "proximity2", *(f"channel{i}" for i in range(1, 17))])


@pytest.fixture
def look(tmp_path):
    return lambda source: inspect(str(source), tmp_path / "out", quiet=True)


def test_names_that_are_not_all_shown_end_in_dots():
    assert list_first(["1", "2"]) == "1, 2"
    assert list_first([str(n) for n in range(31)]).endswith("28, 29, ...")


def test_every_broken_slide_is_named(look, tmp_path):
    folder = tmp_path / "slides"
    folder.mkdir()
    rows = [",".join(map(str, [28 * n, 0, 0, *range(n % 7, n % 7 + 16)])) for n in range(200)]
    for speed in (10, 20):
        path = folder / f"Linen_F120_V{speed}mmps_0.csv"
        path.write_text("\n".join([HEADER, *rows]))
    found = look(f"fabricslide:{folder}")
    assert (found.problems, len(found.facts["recordings"]), len(found.pictures)) == ([], 2, 1)
    path.write_text(f"{HEADER}\n0,0,0,abc" + 15 * ",1")
    (problem,) = look(f"fabricslide:{folder}").problems
    assert "V20mmps_0.csv, line 2: expected numbers, found 'abc'" in problem


def test_a_signal_of_few_samples_in_ten_seconds_is_drawn(tmp_path):
    signal = xr.DataArray(
        np.sin(np.arange(600.0)).reshape(300, 2),
        dims=("audio_time", "channel"),
        attrs={"sample_rate_hz": 0.036, "units": "counts"},
    )
    assert draw_vibration(signal, "slow", tmp_path).is_file()


def test_recordings_too_short_for_the_published_cut_are_said(look, sounds, tmp_path):
    (sentence,) = [line for line in look(sounds).sentences if "too short" in line]
    expected = (
        "12 of 12 vibrations are shorter than 60 s: too short for the cut 'published', which "
        "is only for comparison with the paper."
    )
    assert sentence == expected
    listed = shutil.copytree(sounds, tmp_path / "listed")
    (listed / "session.json").unlink()
    (listed / "session.toml").write_text('pattern = "{texture}/{speed}/audio.wav"')
    assert not [line for line in look(listed).sentences if "too short" in line]
    enough = {"video": {"n_frames": 5510}, "vibration": {"duration_s": 60.0}}
    short = {"video": {"n_frames": 5509}, "vibration": None}
    assert too_short_sentences([enough]) == []
    (sentence,) = too_short_sentences([enough, short])
    assert sentence.startswith("1 of 2 videos are shorter than 5510 frames")


def test_a_run_that_does_not_begin_at_rest_is_named_as_extract_does(
    look, session, make_video, fails, tmp_path
):
    """Something presses on the skin from the first frame on, and hides a third of the markers."""
    pressed = shutil.copytree(session, tmp_path / "session")
    make_video(pressed / "2/40/video.mp4", np.sin(np.arange(45)), [range(120)] * 45)
    (problem,) = look(pressed).problems
    assert "2/40/video.mp4: expected" in problem
    assert "a run must begin with the skin at rest" in problem
    assert problem in fails("extract", pressed, tmp_path / "s.zarr", "--workers", 1, "--quiet")


def test_how_many_markers_were_lost_is_said_of_sessions_and_of_stores(
    look, session, make_video, does, tmp_path
):
    """In one recording, two of 361 markers are hidden in all frames but the first 20."""
    lossy = shutil.copytree(session, tmp_path / "session")
    hidden = [[] if i < 20 else [40, 300] for i in range(45)]
    make_video(lossy / "2/40/video.mp4", 3 * np.sin(np.arange(45)), hidden)
    does("extract", lossy, tmp_path / "s.zarr", "--workers", 1, "--quiet")
    for found in (look(lossy), look(tmp_path / "s.zarr")):
        (said,) = [line for line in found.sentences if line.startswith("Of the marker positions")]
        assert "at most 0.4%, in recording 2/40" in said
    assert "No marker was lost." in look(session).sentences


def test_a_store_is_drawn_its_images_and_the_responses_to_a_recording(look, stores):
    drawn = {kind: {path.name for path in look(store).pictures} for kind, store in stores.items()}
    assert drawn == {
        "video": {"steadiness.png", "responses.png", "vibration.png"},
        "audio": {"vibration.png"},
    }
