"""Models to try live learn from the demo's store, if the demo has left all of it."""

import shutil

from afferents.store.zarr_store import holds_all


def test_a_demo_that_was_stopped_leaves_no_store_to_learn_from(stores, tmp_path):
    store = shutil.copytree(stores["audio"], tmp_path / "s.zarr")
    assert holds_all(store)
    shutil.rmtree(store / "2/30")
    assert not holds_all(store)
    assert not holds_all(tmp_path / "none.zarr")
