"""Recordings in order, and their responses: written whole and as they were, or not at all."""

import os
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from afferents.errors import InputError
from afferents.neuro.neural import spikes_of_store
from afferents.robots.sources import find_recordings
from afferents.store import zarr_store
from afferents.store.integrity import sealed
from afferents.store.recording import Recording, RecordingSet, natural_order, require_utf8


def responses(name="3/50", texture="3", speed=50.0):
    rng = np.random.default_rng(0)
    return xr.Dataset(
        {
            "sa1": (("time", "marker"), rng.random((20, 4), dtype=np.float32)),
            "ra2": (("audio_time", "channel"), rng.random((500, 1), dtype=np.float32)),
        },
        coords={"time": np.arange(20) / 90},
        attrs={"name": name, "texture": texture, "speed_mm_s": speed, "checksum": "abc"},
    ).pipe(lambda d: d.assign(ra2=d["ra2"].assign_attrs(sample_rate_hz=44100.0)))


@pytest.fixture
def store(tmp_path):
    """An empty one."""
    zarr_store.create_store(tmp_path / "s.zarr", {"recordings": ["3/50"]})
    return tmp_path / "s.zarr"


def test_what_is_written_comes_back(store):
    written = responses()
    zarr_store.write_responses(store, written)
    xr.testing.assert_identical(zarr_store.open_responses(store)[0].load(), sealed(written))
    assert xr.open_zarr(store, group="3/50", consolidated=False)["sa1"].shape == (20, 4)


def test_a_recording_that_fails_half_way_is_not_there(store):
    broken = responses().drop_attrs(deep=False)
    broken.attrs["name"] = "3/50"
    with pytest.raises(InputError, match="attribute 'texture'"):
        zarr_store.write_responses(store, broken)
    with pytest.raises(InputError, match="at least one recording"):
        zarr_store.open_responses(store)


def test_a_store_of_another_configuration_is_refused(tmp_path):
    config = {"recordings": ["3/50"], "method": "published"}
    zarr_store.create_store(tmp_path / "s.zarr", config)
    zarr_store.create_store(tmp_path / "s.zarr", config)
    zarr_store.write_responses(tmp_path / "s.zarr", responses())
    with pytest.raises(InputError, match=r"method one-to-one.*found responses of another"):
        zarr_store.create_store(tmp_path / "s.zarr", {**config, "method": "one-to-one"})


def test_light_that_could_not_be_measured_stays_unknown(store):
    zarr_store.write_responses(
        store, responses().assign_attrs(edge_px=float("nan"), speed_mm_s=float("nan"))
    )
    (found,) = zarr_store.open_whole(store)
    assert np.isnan([found.attrs["edge_px"], found.attrs["speed_mm_s"]]).all()


def test_a_recording_from_changed_files_is_refused(store):
    zarr_store.require_same_files(store, "3/50", "abc")
    zarr_store.write_responses(store, responses())
    zarr_store.require_same_files(store, "3/50", "abc")
    with pytest.raises(InputError, match="responses of other files"):
        zarr_store.require_same_files(store, "3/50", "other")


@pytest.mark.parametrize("array", ["sa1", "time"])
def test_a_copy_that_was_cut_off_is_refused(store, array):
    written = responses()
    written["sa1"][:] = np.nan  # as nothing that is there reads
    zarr_store.write_responses(store, written)
    assert np.isnan(zarr_store.open_responses(store)[0]["sa1"]).all()
    shutil.rmtree(store / "3/50" / array / "c")
    with pytest.raises(InputError, match=rf"3/50/{array}: expected 1 chunks, found 0; copy the st"):
        zarr_store.open_responses(store)


def test_half_a_store_is_refused_where_all_of_it_is_wanted(stores, tmp_path):
    store = shutil.copytree(stores["audio"], tmp_path / "half.zarr")
    shutil.rmtree(store / "2/30")
    for ask in (zarr_store.open_whole, spikes_of_store, lambda store: find_recordings(store, None)):
        with pytest.raises(InputError, match=r"12 recordings .*, found 11 \(2/30 missing\)"):
            ask(store)
    assert list(find_recordings(store, None, ["2/40"])) == ["2/40"]


def test_textures_are_in_order_of_their_value_then_words(tmp_path):
    names = ["wool", "10", "2", "0.5", "felt"]
    assert sorted(names, key=natural_order) == ["0.5", "2", "10", "felt", "wool"]
    recordings = tuple(
        Recording(f"{t}/{v}", t, v, tmp_path) for t in ("10", "2") for v in (20.0, 10.0)
    )
    session = RecordingSet(tmp_path, recordings)
    assert session.textures == ("2", "10")
    assert session.speeds_mm_s == (10.0, 20.0)


def test_a_recordings_checksum_is_of_its_files(tmp_path):
    path = tmp_path / "audio.wav"
    sound = SimpleNamespace(path=path, sample_rate_hz=44100.0, n_samples=10)
    recording = Recording("3/50", "3", 50.0, tmp_path, audio=sound)
    assert (recording.fps_hz, recording.sample_rate_hz) == (None, 44100.0)
    path.write_bytes(b"one")
    before = recording.checksum
    path.write_bytes(b"two")
    assert recording.checksum != before
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match="expected a file, found a pipe"):
        recording.checksum  # noqa: B018


@pytest.mark.parametrize(
    ("name", "do"),
    [(b"caf\xe9", "rename it"), (b"caf\xc3\xa9", "set PYTHONUTF8=1, since the system")],
)
def test_a_name_that_the_system_reads_wrongly_need_not_be_changed(name, do):
    """As under LC_ALL=C where Python may not choose UTF-8."""
    with pytest.raises(InputError, match=f"a name in UTF-8, found other bytes; {do}"):
        require_utf8(name.decode("ascii", "surrogateescape"))
