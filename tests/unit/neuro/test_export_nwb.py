"""A store as an NWB file: sound by the inspector, and the same when it is read again."""

import json
from datetime import UTC, datetime
from itertools import pairwise

import cv2
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import afferents
from afferents.neuro import nwb
from afferents.neuro.neural import spikes_of_store
from afferents.recordings.pictures import ImageFolder
from afferents.spikes import Spikes
from afferents.spikes.artificial import end_times
from afferents.store.recording import Recording
from afferents.store.zarr_store import open_responses

pynwb = pytest.importorskip("pynwb")


@pytest.fixture(scope="module")
def content(written):
    with pynwb.NWBHDF5IO(str(written), "r", load_namespaces=True) as io:
        yield io.read()


def test_spikes_come_back_as_they_went_in(written, stores):
    expected, found = spikes_of_store(stores["video"]), afferents.read_nwb(written)
    np.testing.assert_array_equal(found.offsets, expected.offsets)
    np.testing.assert_allclose(found.times, expected.times, atol=1e-9)
    np.testing.assert_array_equal(found.recorded, expected.recorded)
    pd.testing.assert_frame_equal(found.units, expected.units, check_dtype=False)
    same = found.trials[list(expected.trials)]
    pd.testing.assert_frame_equal(same, expected.trials, check_dtype=False)
    assert set(found.trials["direction"]) == {"+x"}


def test_the_inspector_finds_nothing_critical(written):
    from nwbinspector import Importance, inspect_nwbfile

    found = list(inspect_nwbfile(nwbfile_path=str(written)))
    grave = [
        one for one in found if one.importance.value > Importance.BEST_PRACTICE_VIOLATION.value
    ]
    assert grave == []
    said = {one.check_function_name for one in found}
    assert said <= {
        "check_experimenter_exists",
        "check_institution",
        "check_subject_species_exists",  # of a fingertip
    }


def test_videos_sound_and_markers_lie_on_one_clock(content, written, stores, small_session):
    placed = nwb.place_recordings(open_responses(stores["video"]))
    assert all(a.start_s + max(end_times(a.responses)) < b.start_s for a, b in pairwise(placed))
    series = content.processing["behavior"]["markers"].pose_estimation_series
    times_s = series["marker_007"].timestamps[:]
    for one in placed:
        video = content.acquisition[f"video_{one.name}"]
        path = (written.parent / video.external_file[0]).resolve()
        assert path == (small_session / one.responses.attrs["name"] / "video.mp4").resolve()
        assert video.starting_time == one.start_s
        assert video.num_samples == one.responses.sizes["time"]
        sound = content.acquisition[f"sound_{one.name}"]
        assert sound.neurodata_type == "AcousticWaveformSeries"
        assert (sound.starting_time, sound.rate) == (one.start_s, 8000)
        np.testing.assert_array_equal(sound.data[:], one.responses["ra2"].values[:, 0])
        first = np.searchsorted(times_s, one.start_s)
        frames = slice(first, first + one.responses.sizes["time"])
        np.testing.assert_allclose(times_s[frames], one.frame_times_s)
        place = series["marker_007"].data[frames]
        np.testing.assert_array_equal(place, one.responses["position"].values[:, 7])
        found = series["marker_007"].confidence[frames]
        np.testing.assert_array_equal(found, one.responses["detected"].values[:, 7])
    assert content.session_start_time.isoformat() == "2026-03-31T09:30:00+02:00"
    trials = content.trials.to_dataframe()
    begin = [one.start_s + 0.17 for one in placed]
    np.testing.assert_allclose(trials["start_time"], begin)


def test_images_in_a_folder_are_named_in_their_order(tmp_path):
    names = [f"video/frame{n}.png" for n in (8, 9, 10, 12)]
    (tmp_path / "video").mkdir()
    for name in names:
        cv2.imwrite(str(tmp_path / name), np.zeros((4, 6), np.uint8))
    times_s = np.array([0.0, 0.1, 0.2, 0.4])
    placed = nwb.place_recordings([xr.Dataset(coords={"time": times_s}, attrs={"name": "1/20"})])
    images = ImageFolder(tmp_path / "video", 10.0)
    recording = Recording("1/20", "1", 20.0, tmp_path, video=images)
    nwbfile = pynwb.NWBFile("images", "id", datetime(2026, 1, 1, tzinfo=UTC))
    nwbfile.create_device(name="camera")
    nwb.add_videos(nwbfile, placed, {"1/20": recording}, tmp_path / "x.nwb")
    series = nwbfile.acquisition["video_1_20"]
    assert list(series.external_file) == names
    np.testing.assert_array_equal(series.timestamps, times_s)


@pytest.mark.parametrize(
    ("unit", "kind"), [("full scale", "AcousticWaveformSeries"), ("m/s^2", "TimeSeries")]
)
def test_vibration_that_is_no_sound_is_a_series_that_keeps_its_unit(unit, kind):
    """Those of sound lose it in the file: ndx-sound fixes it to n.a."""
    about = {"sample_rate_hz": 1000.0, "units": unit}
    vibration = xr.DataArray(np.zeros((50, 1)), dims=("sample", "channel"), attrs=about)
    responses = xr.Dataset({"ra2": vibration}, attrs={"name": "1/20"})
    nwbfile = pynwb.NWBFile("signals", "id", datetime(2026, 1, 1, tzinfo=UTC))
    nwb.add_sounds(nwbfile, [nwb.Placed("1_20", responses, 0.0)])
    series = nwbfile.acquisition["sound_1_20"]
    assert (type(series).__name__, series.unit) == (kind, unit)


def test_names_that_become_equal_without_slashes_stay_apart():
    recordings = [xr.Dataset(attrs={"name": name}) for name in ("a/b_c", "a_b/c", "a:b")]
    assert [one.name for one in nwb.place_recordings(recordings)] == ["a_b_c", "a_b_c-2", "a_b"]


def test_conditions_are_columns_of_one_kind():
    nwbfile = pynwb.NWBFile("conditions", "id", datetime(2026, 1, 1, tzinfo=UTC))
    said = [{"force": 1, "id": "a/b", "wet": True}, {"force": 2.5}]
    recordings = [
        xr.Dataset(
            coords={"time": np.array([0.0, 1.0])},
            attrs={"name": str(n), "conditions": json.dumps(one)},
        )
        for n, one in enumerate(said)
    ]
    trials = {"texture": ["1", "2"], "recording": ["0", "1"], "duration_s": [1.0, 1.0]}
    spikes = Spikes.from_trains([[[]], [[]]], {"name": ["a"], "class": ["PC"]}, trials)
    nwb.add_trials(nwbfile, spikes, nwb.place_recordings(recordings))
    table = nwbfile.trials.to_dataframe()
    assert table["force"].tolist() == [1.0, 2.5]
    assert table["condition_id"].tolist() == ["a/b", ""]
    assert table["wet"].tolist() == ["True", ""]


def test_sound_alone(stores, tmp_path, does):
    out = tmp_path / "sounds.nwb"
    said = does("export-nwb", stores["audio"], out, "--classes", "PC", "--model", "lif")
    assert said == f"NWB: {out}\n"
    found = afferents.read_nwb(out)
    assert set(found.units["class"]) == {"PC"}
    assert found.n_trials == 12
    size = out.stat().st_size
    does("export-nwb", stores["audio"], out, "--no-sound", "--force", "--quiet")
    assert out.stat().st_size < size / 2


def test_what_cannot_be_written_is_one_sentence(stores, sounds, tmp_path, fails):
    store, out = stores["video"], tmp_path / "x.nwb"
    for arguments, said in (
        ((tmp_path / "x.h5",), "a name that ends in .nwb"),
        ((out, "--model", "hh"), "one of izhikevich, lif"),
        ((out, "--classes", "SA,XX"), "some of SA, RA, PC"),
        ((out, "--start-time", "noon"), "a date and time"),
        ((out, "--session", sounds), "that the store was extracted from"),
    ):
        assert said in fails("export-nwb", store, *arguments)
    assert not list(tmp_path.iterdir())
