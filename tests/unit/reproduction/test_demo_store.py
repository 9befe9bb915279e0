"""Models to try live learn from the demo's store, if the demo has left all of it."""

import shutil

from afferents.reproduction.reproduce import _is_whole


def test_a_demo_that_was_stopped_leaves_no_store_to_learn_from(stores, tmp_path):
    store = shutil.copytree(stores["audio"], tmp_path / "s.zarr")
    assert _is_whole(store)
    shutil.rmtree(store / "2/30")
    assert not _is_whole(store)
    assert not _is_whole(tmp_path / "none.zarr")
