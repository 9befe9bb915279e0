import json
import shutil

import pytest

from afferents.errors import AfferentsError, InputError
from afferents.evaluation.data import open_data
from afferents.extraction.extract import extract_session
from afferents.extraction.options import Extraction
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress

QUIET = Progress(quiet=True)


def extraction(session, store):
    return Extraction(session, store, load_sensor("tip_b"), "windowed", workers=1)


@pytest.fixture
def store(stores, tmp_path):
    return shutil.copytree(stores["audio"], tmp_path / "s.zarr")


def test_half_a_store_is_known_as_one(store):
    shutil.rmtree(store / "2" / "30")
    with pytest.raises(
        InputError, match=r"the 12 recordings of its session, found 11 \(2/30 missing"
    ):
        open_data([str(store)])
    (data,) = open_data([str(store)], keep_going=True)
    assert list(data.failed) == ["2/30"]


def test_the_same_recordings_are_no_repetition(store, tmp_path):
    copy = shutil.copytree(store, tmp_path / "copy.zarr")
    with pytest.raises(InputError, match="the same recordings twice"):
        open_data([str(store), str(copy)])


def test_recordings_of_a_session_declared_anew_are_made_anew(store, sounds, tmp_path):
    changed = shutil.copytree(sounds, tmp_path / sounds.name)
    declared = json.loads((changed / "session.json").read_text())
    (changed / "session.json").write_text(json.dumps({**declared, "sensor_channel": 0}))
    before = open_data([str(store)])[0]
    heard = [r.load() for r in before.responses]
    extract_session(extraction(changed, store), QUIET)
    after = open_data([str(store)])[0]
    assert after.origin.fingerprint != before.origin.fingerprint
    assert all(r["ra2"].any() for r in heard)
    assert not any(r["ra2"].any() for r in after.responses)  # the other channel is silent
    other = json.loads((changed / "session.json").read_text()) | {"sample_rate_hz": 16000}
    (changed / "session.json").write_text(json.dumps(other))
    with pytest.raises(AfferentsError, match="at 16000 Hz, found 2 at 8000 Hz"):
        extract_session(extraction(changed, store), QUIET)


def test_leaving_out_says_what_could_be(store):
    with pytest.raises(InputError, match="expected one of direction, found pressure"):
        open_data([str(store)], {"pressure": "F250"})
    with pytest.raises(InputError, match=r"direction= one of .*, found sideways"):
        open_data([str(store)], {"direction": "sideways"})


def taxels(folder, name, broken=False):
    header = ["timestamp", "proximity1", "proximity2", *(f"channel{i}" for i in range(1, 17))]
    rows = [",".join(map(str, [28 * n, 0, 0, *range(16)])) for n in range(150)]
    if broken:
        rows[7] = "rubbish"
    (folder / f"{name}.csv").write_text("\n".join([",".join(header), *rows]))


def test_a_broken_csv_is_skipped_only_when_told(tmp_path):
    taxels(tmp_path, "Linen_F120_V10mmps_0")
    taxels(tmp_path, "Linen_F120_V20mmps_0", broken=True)
    with pytest.raises(InputError, match=r"V20mmps_0\.csv"):
        open_data([f"fabricslide:{tmp_path}"])
    (data,) = open_data([f"fabricslide:{tmp_path}"], keep_going=True)
    assert len(data.responses) == len(data.failed) == 1
