"""What `inspect` finds wrong, says of short recordings, and measures of images."""

import shutil

import numpy as np
import pytest
import xarray as xr

from afferents.inspection.files import draw_vibration
from afferents.inspection.init import list_first
from afferents.inspection.inspect import inspect
from afferents.inspection.sessions import too_short_sentences
from afferents.inspection.stores import measure_steadiness, steadiness

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


@pytest.fixture
def few(session, tmp_path):
    """The recordings of texture 2 alone, to be changed."""
    shutil.copytree(session / "2", tmp_path / "session/2")
    shutil.copy(session / "session.json", tmp_path / "session")
    return tmp_path / "session"


def test_a_run_that_does_not_begin_at_rest_is_named_as_extract_does(
    look, few, make_video, fails, tmp_path
):
    """Something presses on the skin from the first frame on, and hides a third of the markers."""
    make_video(few / "2/40/video.mp4", np.sin(np.arange(45)), [range(120)] * 45)
    (problem,) = look(few).problems
    assert "2/40/video.mp4: expected" in problem
    assert "a run must begin with the skin at rest" in problem
    assert problem in fails("extract", few, tmp_path / "s.zarr", "--workers", 1, "--quiet")


def test_how_many_markers_were_lost_is_said_of_sessions_and_of_stores(
    look, few, make_video, does, tmp_path
):
    """In one recording, two of 361 markers are hidden in all frames but the first 20."""
    assert "No marker was lost." in look(few).sentences
    hidden = [[] if i < 20 else [40, 300] for i in range(45)]
    make_video(few / "2/40/video.mp4", 3 * np.sin(np.arange(45)), hidden)
    does("extract", few, tmp_path / "s.zarr", "--workers", 1, "--quiet")
    for found in (look(few), look(tmp_path / "s.zarr")):
        (said,) = [line for line in found.sentences if line.startswith("Of the marker positions")]
        assert "at most 0.4%, in recording 2/40" in said


def test_a_store_is_drawn_its_images_and_the_responses_to_a_recording(look, stores):
    drawn = {kind: {path.name for path in look(store).pictures} for kind, store in stores.items()}
    assert drawn == {
        "video": {"steadiness.png", "responses.png", "vibration.png"},
        "audio": {"vibration.png"},
    }


def test_what_stays_the_same_is_one_and_what_turns_round_is_minus_one():
    rng = np.random.default_rng(0)
    image = rng.normal(size=361)
    scaled = np.outer(np.linspace(1, 5, 60), image) + 3.0  # the same pattern, ever stronger
    assert steadiness(scaled, 20) == pytest.approx(1)
    turned = np.where(np.arange(60)[:, None] // 20 % 2, image, -image)
    assert steadiness(turned, 20) == pytest.approx(-1)
    for none in (np.zeros((20, 9)), np.full((40, 9), np.nan)):  # too few frames, and no marker
        assert np.isnan(steadiness(none, 20))


def test_a_pattern_with_noise_has_the_share_of_its_variance():
    rng = np.random.default_rng(1)
    pattern = rng.normal(size=361)
    noisy = 2 * pattern + rng.normal(size=(200, 361))
    share = 4 * pattern.var() / (4 * pattern.var() + 1)
    assert steadiness(noisy, 20) == pytest.approx(share, abs=0.01)
    assert steadiness(rng.normal(size=(200, 361)), 20) == pytest.approx(0, abs=0.02)


def test_lost_markers_are_left_out_of_both_images():
    rng = np.random.default_rng(2)
    images = np.tile(rng.normal(size=50), (40, 1))
    images[:10, 3] = np.nan
    images[25:, 7] = np.nan
    assert steadiness(images, 20) == pytest.approx(1)


def test_recordings_with_markers_have_a_row():
    rng = np.random.default_rng(3)
    still = np.tile(rng.normal(size=30), (50, 1))
    attributes = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0}
    dims = ("time", "marker")
    felt = xr.Dataset({"sa1": (dims, still), "ra1": (dims, rng.normal(size=(50, 30)))})
    heard = xr.Dataset({"ra2": ("audio_time", np.zeros(9))}, attrs=attributes)
    (row,) = measure_steadiness([felt.assign_attrs(attributes), heard])
    assert row["recording"] == "3/50"
    assert row["speed_mm_s"] == 50
    assert row["sa1"] == pytest.approx(1)
    assert row["ra1"] < 0.2
