"""Responses are written whole and come back as they were, or not at all."""

import shutil

import numpy as np
import pytest
import xarray as xr

from afferents.errors import InputError
from afferents.neuro.neural import spikes_of_store
from afferents.robots.sources import find_recordings
from afferents.store.integrity import sealed
from afferents.store.zarr_store import (
    create_store,
    open_responses,
    open_whole,
    require_same_files,
    write_responses,
)


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
    create_store(tmp_path / "s.zarr", {"recordings": ["3/50"]})
    return tmp_path / "s.zarr"


def test_what_is_written_comes_back(store):
    written = responses()
    write_responses(store, written)
    xr.testing.assert_identical(open_responses(store)[0].load(), sealed(written))
    assert xr.open_zarr(store, group="3/50", consolidated=False)["sa1"].shape == (20, 4)


def test_a_recording_that_fails_half_way_is_not_there(store):
    broken = responses().drop_attrs(deep=False)
    broken.attrs["name"] = "3/50"
    with pytest.raises(InputError, match="attribute 'texture'"):
        write_responses(store, broken)
    with pytest.raises(InputError, match="at least one recording"):
        open_responses(store)


def test_a_store_of_another_configuration_is_refused(tmp_path):
    config = {"recordings": ["3/50"], "method": "published"}
    create_store(tmp_path / "s.zarr", config)
    create_store(tmp_path / "s.zarr", config)
    write_responses(tmp_path / "s.zarr", responses())
    with pytest.raises(InputError, match=r"method one-to-one.*found responses of another"):
        create_store(tmp_path / "s.zarr", {**config, "method": "one-to-one"})


def test_light_that_could_not_be_measured_stays_unknown(store):
    write_responses(store, responses().assign_attrs(edge_px=float("nan"), speed_mm_s=float("nan")))
    (found,) = open_whole(store)
    assert np.isnan([found.attrs["edge_px"], found.attrs["speed_mm_s"]]).all()


def test_a_recording_from_changed_files_is_refused(store):
    require_same_files(store, "3/50", "abc")
    write_responses(store, responses())
    require_same_files(store, "3/50", "abc")
    with pytest.raises(InputError, match="responses of other files"):
        require_same_files(store, "3/50", "other")


@pytest.mark.parametrize("array", ["sa1", "time"])
def test_a_copy_that_was_cut_off_is_refused(store, array):
    written = responses()
    written["sa1"][:] = np.nan  # as nothing that is there reads
    write_responses(store, written)
    assert np.isnan(open_responses(store)[0]["sa1"]).all()
    shutil.rmtree(store / "3/50" / array / "c")
    with pytest.raises(InputError, match=rf"3/50/{array}: expected 1 chunks, found 0; copy the st"):
        open_responses(store)


def test_half_a_store_is_refused_where_all_of_it_is_wanted(stores, tmp_path):
    store = shutil.copytree(stores["audio"], tmp_path / "half.zarr")
    shutil.rmtree(store / "2/30")
    for ask in (open_whole, spikes_of_store, lambda store: find_recordings(store, None)):
        with pytest.raises(InputError, match=r"12 recordings .*, found 11 \(2/30 missing\)"):
            ask(store)
    assert list(find_recordings(store, None, ["2/40"])) == ["2/40"]
