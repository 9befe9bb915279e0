import json
import shutil

import numpy as np
import pytest
import xarray as xr

from afferents.errors import InputError
from afferents.store.integrity import sealed
from afferents.store.zarr_store import create_store, has_responses, open_responses, write_responses


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


def test_what_is_written_comes_back(tmp_path):
    store = tmp_path / "s.zarr"
    create_store(store, {"session": "s"})
    written = responses()
    write_responses(store, written)
    xr.testing.assert_identical(open_responses(store)[0].load(), sealed(written))


def test_plain_xarray_reads_a_recording(tmp_path):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    write_responses(store, responses())
    assert xr.open_zarr(store, group="3/50", consolidated=False)["sa1"].shape == (20, 4)


def test_names_of_markers_and_axes_are_stored_without_complaint(tmp_path, recwarn):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    write_responses(store, responses().assign_coords(channel=["sensor"]))
    assert list(open_responses(store)[0]["channel"].values) == ["sensor"]
    assert not [w for w in recwarn if "Zarr" in str(w.message)]


def test_recordings_come_in_order_of_texture_and_speed(tmp_path):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    for texture, speed in (("10", 20.0), ("2", 100.0), ("2", 20.0), ("wool", 20.0)):
        write_responses(store, responses(f"{texture}/{speed:g}", texture, speed))
    assert [r.attrs["name"] for r in open_responses(store)] == ["2/20", "2/100", "10/20", "wool/20"]


def test_a_recording_that_fails_half_way_is_not_there(tmp_path):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    broken = responses().drop_attrs(deep=False)
    broken.attrs["name"] = "3/50"
    with pytest.raises(InputError, match="attribute 'texture'"):
        write_responses(store, broken)
    with pytest.raises(InputError, match="at least one recording"):
        open_responses(store)


def test_a_store_of_another_configuration_is_refused(tmp_path):
    create_store(tmp_path / "s.zarr", {"method": "published"})
    create_store(tmp_path / "s.zarr", {"method": "published"})
    write_responses(tmp_path / "s.zarr", responses())
    with pytest.raises(InputError, match=r"method one-to-one.*found responses of another"):
        create_store(tmp_path / "s.zarr", {"method": "one-to-one"})


def test_something_else_is_not_overwritten(tmp_path):
    (tmp_path / "s.zarr").write_text("precious")
    with pytest.raises(InputError, match="something else of that name"):
        create_store(tmp_path / "s.zarr", {})
    assert (tmp_path / "s.zarr").read_text() == "precious"


def test_a_recording_from_changed_files_is_refused(tmp_path):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    assert not has_responses(store, "3/50", "abc")
    write_responses(store, responses())
    assert has_responses(store, "3/50", "abc")
    with pytest.raises(InputError, match="responses of other files"):
        has_responses(store, "3/50", "other")


@pytest.mark.parametrize("array", ["sa1", "time"])
def test_a_copy_that_was_cut_off_is_refused(tmp_path, array):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    written = responses()
    written["sa1"][:] = np.nan  # as nothing that is there reads
    write_responses(store, written)
    assert np.isnan(open_responses(store)[0]["sa1"]).all()
    shutil.rmtree(store / "3/50" / array / "c")
    with pytest.raises(InputError, match=rf"3/50/{array}: expected 1 chunks, found 0; copy the st"):
        open_responses(store)


def test_no_store_is_said_so(tmp_path):
    with pytest.raises(InputError, match="extract first"):
        open_responses(tmp_path / "nothing.zarr")


def test_a_grid_of_chunks_that_makes_no_sense_is_refused(tmp_path):
    store = tmp_path / "s.zarr"
    create_store(store, {})
    write_responses(store, responses())
    metadata = store / "3/50/sa1/zarr.json"
    array = json.loads(metadata.read_text())
    array["chunk_grid"]["configuration"]["chunk_shape"] = [0, 4]
    metadata.write_text(json.dumps(array))
    with pytest.raises(InputError, match="3/50: expected responses that can be read"):
        open_responses(store)


def test_what_may_not_be_read_is_said_in_words(tmp_path, monkeypatch):
    """No number of the system's, and no path twice."""
    store = tmp_path / "s.zarr"
    create_store(store, {})
    write_responses(store, responses())

    def shut(*_, **__):
        raise PermissionError(13, "Permission denied", "3/50/sa1/c/0/0")

    monkeypatch.setattr(xr, "open_zarr", shut)
    with pytest.raises(InputError, match="that can be read, found Permission denied; remove the"):
        open_responses(store)
