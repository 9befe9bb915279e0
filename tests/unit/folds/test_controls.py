"""Controls: what is recognised once what should tell textures apart was taken away."""

import numpy as np
import pytest
import soundfile

import afferents
from afferents.folds.controls import CONTROLS, apply_control
from afferents.folds.held_out import SPEED
from afferents.reporting.tables import controls_table
from afferents.store.responses import steady_s
from afferents.store.zarr_store import open_responses

from .conftest import SoundFiles

RATE_HZ, SPEEDS = 2000, (10, 20, 30, 40)


class Sounds(SoundFiles):
    """Sounds ``{texture}_{speed}.wav``, two seconds each."""

    name, title, lasting_s = "sounds", "sounds", 2.0
    encodings = {  # noqa: RUF012
        "orders": {"window_s": 0.5, "stride_s": 0.25, "lowest_hz": 10.0, "highest_hz": 500.0},
    }


def recorded(folder, sound_of):
    """Write three textures at four speeds; `sound_of` takes texture number, speed and noise."""
    rng = np.random.default_rng(3)
    for number, texture in enumerate("abc"):
        for speed in SPEEDS:
            sound = sound_of(number, speed, rng.normal(size=2 * RATE_HZ))
            soundfile.write(folder / f"{texture}_{speed}.wav", sound, RATE_HZ, subtype="FLOAT")
    return Sounds(folder)


def test_controls_that_are_left_out_are_named_with_why(tmp_path, capsys):
    (tmp_path / "data").mkdir()
    data = recorded(tmp_path / "data", lambda number, speed, noise: 0.02 * 2**number * noise)
    found = afferents.evaluate(
        data, tmp_path / "r", "ridge-te", held_out="20", quiet=True, workers=1
    ).found
    why = "they answer no question with --held-out; evaluate once without"
    assert found.controls == {}
    assert why in found.controls_left_out
    said = capsys.readouterr().err
    assert f"controls ({', '.join(CONTROLS)}) are left out: {why}" in said
    table = controls_table(found)
    assert len(table) == len(CONTROLS)
    assert why in table.attrs["caption"]


def test_labels_are_exchanged_within_a_group_and_nothing_else_changes(stores):
    recordings = open_responses(stores["video"])
    left = apply_control(recordings, "permuted", SPEED)
    names = [one.attrs["name"] for one in recordings]
    assert [one.attrs["name"] for one in left] == names
    before, after = ([one.attrs["texture"] for one in of] for of in (recordings, left))
    assert before != after
    for speed in {one.attrs["speed_mm_s"] for one in recordings}:
        at = [n for n, one in enumerate(recordings) if one.attrs["speed_mm_s"] == speed]
        assert sorted(before[n] for n in at) == sorted(after[n] for n in at)
    assert apply_control(recordings, "permuted", SPEED)[0].attrs == left[0].attrs


@pytest.mark.parametrize("control", ["shuffled", "offsets", "amplitudes"])
def test_markers_keep_what_the_control_says_and_sa1_follows_them(stores, control):
    recordings = open_responses(stores["video"])[:3]
    usual = []
    for before, after in zip(recordings, apply_control(recordings, control, SPEED), strict=True):
        start, stop = np.searchsorted(before["time"].values, steady_s(before))
        was, now = (one["position"].values[start:stop] for one in (before, after))
        rest = before["rest_position"].values
        if control == "shuffled":
            np.testing.assert_allclose(np.sort(now, axis=0), np.sort(was, axis=0), atol=1e-3)
        else:
            off = now.mean(axis=0) - (was.mean(axis=0) if control == "offsets" else rest)
            assert np.abs(off).max() < 1.0
        usual.append(now.std(axis=0).mean())
        slow = np.hypot(*np.moveaxis(now - rest, -1, 0))
        np.testing.assert_allclose(after["sa1"].values[start:stop], slow, atol=1e-3)
    assert control != "offsets" or np.ptp(usual) < 0.1 * np.mean(usual)
