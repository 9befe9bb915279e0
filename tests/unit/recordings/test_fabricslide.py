"""FabricSlide by its description: files written here, and the real ones where they are."""

from pathlib import Path

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.recordings.check import facts
from afferents.recordings.described import PACKAGED, Described
from afferents.recordings.description import read_data_set_file
from afferents.recordings.series import SeriesFile

SIGNAL = read_data_set_file(PACKAGED["fabricslide"]).signal
HEADER = ", ".join(SIGNAL.columns)
REAL = Path(__file__).resolve().parents[3] / "../shared/datasets/fabricslide"
needs_real = pytest.mark.skipif(
    not REAL.is_dir(), reason="FabricSlide is not at ../shared/datasets/fabricslide"
)


def taxel_file(path):
    return SeriesFile(path, SIGNAL)


def read_fabricslide(path):
    return Described(path, PACKAGED["fabricslide"]).scan()


def _row(timestamp_ms, first):
    return ",".join(map(str, [timestamp_ms, 0, 65535, *range(first, first + 16)]))


def _write(path, rows, header=HEADER):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


ROWS = [_row(1000, 10), _row(1028, 20), _row(1057, 30), _row(1084, 40)]
ROWS += [_row(1084 + 28 * i, 50) for i in range(1, 33)]


def test_taxels_are_vibration_channels(tmp_path):
    taxels = taxel_file(_write(tmp_path / "a.csv", ROWS))
    response = taxels.read()
    assert response.dims == ("audio_time", "channel")
    assert response.dtype == np.float32
    assert response.attrs == {"sample_rate_hz": 1000 / 28, "units": "counts"}
    np.testing.assert_array_equal(response.sel(channel="channel1")[:5], [10, 20, 30, 40, 50])
    np.testing.assert_array_equal(response.sel(channel="channel16")[:4], [25, 35, 45, 55])
    assert taxels.n_samples == 36
    again = taxel_file(_write(tmp_path / "a.csv", [*ROWS, ROWS[-1]]))
    assert again.n_samples == len(again.read()) == 36  # a row written twice counts once


def test_names_say_the_condition(tmp_path):
    for name in ("Linen_F250_V-10mmps_3", "Denim_F120_V150mmps_0"):
        _write(tmp_path / "data/fabric" / f"{name}.csv", ROWS)
    _write(tmp_path / "data/board/Board2mm_F120_V-5mmps_0.csv", ROWS)
    _write(tmp_path / "data/fabric/notes.csv", ROWS)
    denim, linen = read_fabricslide(tmp_path).recordings
    assert (linen.name, linen.texture, linen.speed_mm_s) == ("Linen_F250_V-10mmps_3", "Linen", 10)
    assert linen.conditions == {"pressure": "F250", "direction": "-", "repetition": 3}
    assert denim.conditions == {"pressure": "F120", "direction": "+", "repetition": 0}
    assert linen.steady_s == pytest.approx((0, 36 * 0.028))
    assert facts(linen)["vibration"]["n_channels"] == 16
    assert facts(linen)["video"] is None


@pytest.mark.parametrize("folder", [".", "data/fabric", "some/where/else"])
def test_found_wherever_it_lies_and_broken_files_do_not_stop_the_others(tmp_path, folder):
    _write(tmp_path / folder / "Linen_F120_V10mmps_0.csv", ["nonsense"])
    _write(tmp_path / folder / "Linen_F120_V20mmps_0.csv", ROWS)
    broken, whole = read_fabricslide(tmp_path).recordings
    assert whole.audio.read().sizes["audio_time"] == 36
    with pytest.raises(InputError):
        broken.audio.read()


@needs_real
def test_the_real_set_reads_whole():
    session = read_fabricslide(REAL)
    assert set(session.speeds_mm_s) <= {10, 20, 50, 100, 120, 150}
    first = {recording.texture: recording for recording in session.recordings}
    assert len(first) == len(session.textures)
    for recording in first.values():
        response = recording.audio.read()
        assert response.sizes == {"audio_time": recording.audio.n_samples, "channel": 16}
        assert np.isfinite(response.values).all()
