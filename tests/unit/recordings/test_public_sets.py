"""Public data sets by their packaged descriptions, on files written here in their layout."""

from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
import soundfile

import afferents
from afferents.errors import InputError
from afferents.recordings.data_sets import data_set_of

WAY_MM = 90
"""Of each slide of the Cluster set, in which 0.3 s more are recorded."""
SPEEDS = {"cluster": (20, 40, 60), "ntp": (1200, 2400, 6000)}


def accelerated(path, waves, seconds, rng):
    """Write acceleration (g) at times (ns) that come at 8.6 kHz, most 0.11 ms apart, one 1.3 ms."""
    step = np.where(rng.random(round(8640 * seconds)) < 0.1, rng.uniform(0.12, 0.3), 0.111)
    step[len(step) // 2] = 1.3
    time = np.cumsum(step) * seconds / step.sum()
    felt = waves(time)[:, None] + rng.normal(0, 0.01, (len(time), 3)) + [0.01, 0.06, -0.96]
    frame = pd.DataFrame(felt.astype(np.float32), columns=["X", "Y", "Z"])
    frame.insert(0, "time_ns", (1e9 * time).astype(np.int64))
    frame.to_parquet(path.with_suffix(".parquet"))


def heard(path, waves, seconds, rng):
    sound = waves(np.arange(round(44100 * seconds)) / 44100) + rng.normal(
        0, 0.01, round(44100 * seconds)
    )
    soundfile.write(path.with_suffix(".flac"), sound, 44100)


KINDS = {"accel": (accelerated, 1.0), "audio": (heard, 20.0)}
"""How each is written, and waves a mm of the coarsest texture."""


def cluster(folder, kind, textures, direction=135, force=500):
    """Write a part of the Cluster set: whole slides, the machine speeding up at either end."""
    write, per_mm = KINDS[kind]
    for texture, speed, repetition in product(textures, SPEEDS["cluster"], (0, 1)):
        of_one = (texture, direction, speed, force, repetition)
        rng = np.random.default_rng(of_one)
        hz, start = 1.3**texture * per_mm * speed, rng.uniform(0, 6)
        path = folder / f"sensor_data/{kind}/{texture}" / "_".join(map(str, of_one))
        path.parent.mkdir(parents=True, exist_ok=True)
        wave = lambda t, hz=hz, start=start: 0.1 * np.sin(2 * np.pi * hz * t + start)  # noqa: E731
        write(path, wave, WAY_MM / speed + 0.3, rng)
    return folder


def ntp(folder, textures, below="data/processed"):
    """Write a part of NTP: rows 3 or 4 ms apart, each eleventh at the time of the one before."""
    for texture, speed, force in product(textures, SPEEDS["ntp"], (0.0, 1.5)):
        rng = np.random.default_rng([texture, speed, int(10 * force)])
        n = round(52 / (speed / 60) * 320)
        step = rng.choice([3.0, 4.0], n)
        step[::11] = 0
        step[n // 2] = 30
        time = np.cumsum(step) / 1000
        phase = 2 * np.pi * 0.1 * 1.5 ** (texture % 10) * (speed / 60 * time + rng.uniform(0, 50))
        taxels = np.sin(phase[:, None] - np.arange(9)) + rng.normal(0, 0.3, (n, 9))
        name = f"Data[Texture({texture:03d})][Speed({speed})][Force({force})][Trial(1)].csv"
        path = folder / below / f"Texture{texture:03d}" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        table = pd.DataFrame(np.c_[taxels, rng.normal(5e4, 99, n), time])
        table.to_csv(path, index=False, header=False)
    return folder


def order_accuracy(source, out, held_out):
    options = {"models": "order-te-speed-known,ridge-te", "preset": "quick", "workers": 1}
    results = afferents.evaluate(source, out, held_out=[held_out], quiet=True, **options)
    models = results.summary["models"]
    assert set(models) == {"order-te-speed-known", "ridge-te"}
    return models["order-te-speed-known"]["nested"]["mean_accuracy"]


@pytest.mark.parametrize(
    ("kind", "rate_hz", "units", "channels"),
    [("accel", 6000, "g", ["X", "Y", "Z"]), ("audio", 44100, "full scale", ["0"])],
)
def test_the_cluster_set_is_learnt_from(tmp_path, kind, rate_hz, units, channels):
    source = f"cluster-haptic-{kind}:{cluster(tmp_path / 'd', kind, (0, 3, 6))}"
    found = afferents.inspect(source, tmp_path / "look", quiet=True)
    assert found.problems == []
    said = " ".join(found.sentences)
    assert "18 recordings of 3 textures (0, 3, 6) at 3 speeds (20, 40, 60 mm/s)" in said
    assert ("resampled to 6000 Hz" in said) == (kind == "accel")
    assert "Nothing confirms" not in said

    recordings = {one.name: one for one in data_set_of(source).scan().recordings}
    one = recordings["3_135_60_500_1"]
    assert (one.texture, one.speed_mm_s) == ("3", 60)
    assert one.conditions == {"direction": 135, "force": 500, "repetition": 1}
    assert one.steady_s == pytest.approx((0.3, 1.5), abs=0.01)
    assert recordings["0_135_20_500_0"].steady_s == pytest.approx((0.3, 4.5), abs=0.05)
    response = one.audio.read()
    assert response.attrs == {"sample_rate_hz": rate_hz, "units": units}
    assert response.channel.values.tolist() == channels
    assert response.sizes["audio_time"] == pytest.approx(1.8 * rate_hz, rel=0.01)

    assert order_accuracy(source, tmp_path / "results", "40") > 0.9


def test_the_sound_may_be_wav_as_at_figshare(tmp_path):
    folder = cluster(tmp_path, "audio", (0,))
    for path in folder.rglob("*.flac"):
        soundfile.write(path.with_suffix(".wav"), *soundfile.read(path))
        path.unlink()
    (first, *_) = data_set_of(folder).scan().recordings
    assert first.audio.read().sizes == {"audio_time": round(4.8 * 44100), "channel": 1}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda f: f[["time_ns", "X", "Y"]], r"expected the column 'Z', found time_ns, X, Y"),
        (lambda f: f[:6000], r"expected at least 6000 rows .* 1 s, found"),
        (lambda f: pd.concat([f[:3000], f[3200:]]), r"row 3000: expected rows at most 10 ms apart"),
    ],
)
def test_what_is_wrong_with_an_acceleration_is_named(tmp_path, change, sentence):
    folder = cluster(tmp_path, "accel", (0,))
    path = folder / "sensor_data/accel/0/0_135_60_500_1.parquet"
    change(pd.read_parquet(path)).to_parquet(path)
    *whole, broken = data_set_of(folder).scan().recordings
    assert all(one.audio.read().sizes["channel"] == 3 for one in whole)
    with pytest.raises(InputError, match=rf"0_135_60_500_1\.parquet.*{sentence}"):
        broken.audio.read()


def test_a_folder_without_a_name_must_hold_one_data_set(tmp_path):
    folder = cluster(tmp_path, "accel", (0,))
    assert data_set_of(folder).name == "cluster-haptic-accel"
    cluster(folder, "audio", (0,))
    sentence = rf"say which: cluster-haptic-accel:{folder} or cluster-haptic-audio:{folder}"
    with pytest.raises(InputError, match=sentence):
        data_set_of(folder)
    assert data_set_of(f"cluster-haptic-audio:{folder}").title.endswith("sound")


def test_printed_textures_under_nine_taxels_are_learnt_from(tmp_path):
    folder = ntp(tmp_path / "d", (1, 13, 35))
    found = afferents.inspect(f"ntp:{folder}", tmp_path / "look", quiet=True)
    assert found.problems == []
    said = " ".join(found.sentences)
    assert "18 recordings of 3 textures (001, 013, 035) at 3 speeds (20, 40, 100 mm/s)" in said
    assert "resampled to 300 Hz" in said
    assert "out of order and dropped, at most 9." in said
    assert "longest gap that is bridged lasts 30 ms (Data[Texture" in said
    one = data_set_of(folder).scan().recordings[0]
    assert (one.texture, one.speed_mm_s) == ("001", 20)
    assert one.conditions == {"force": 0.0, "trial": 1}
    response = one.audio.read()
    assert response.attrs == {"sample_rate_hz": 300, "units": "a.u."}
    assert response.channel.values.tolist() == [str(n) for n in range(9)]  # and no load cell
    assert float(np.abs(response).max()) < 9
    assert one.steady_s == (0, response.sizes["audio_time"] / 300)

    assert order_accuracy(folder, tmp_path / "results", "40") > 0.9


@pytest.mark.parametrize("below", [".", "some/where"])
def test_printed_textures_are_found_wherever_they_lie(tmp_path, below):
    session = data_set_of(f"ntp:{ntp(tmp_path, (1,), below)}").scan()
    assert session.textures == ("001",)
    assert len(session.recordings) == 6


def biotac(folder, textures=(1, 12, 20)):
    """Write a part of BioTac_slide_20_50: 22 samples a row, rows at the times they arrived."""
    for texture, trial in product(textures, (1, 2, 3)):
        rng = np.random.default_rng([texture, trial])
        hz, at = 40 * 1.3 ** (texture / 2), np.arange(300 * 22) / 2200
        pac = np.abs(
            100 * np.sin(2 * np.pi * hz * at + rng.uniform(0, 6)) + rng.normal(0, 9, at.size)
        )
        columns = {"timestamp": 1.58e9 + np.arange(300) / 100, "tdc": 3, "tac": 100, "pdc": 90}
        rows = pac.round().astype(int).reshape(300, 22)
        columns |= {f"pac{n + 1}": rows[:, n] for n in range(22)} | {"ele1": 65, "ele19": 26}
        table = pd.DataFrame(columns)
        table[""] = ""  # rows end in a separator, their names don't
        path = folder / f"mat{texture}" / f"mat{texture}_{trial}_bio.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = table.to_csv(index=False).splitlines(True)
        path.write_text("".join([lines[0].rstrip(",\n") + "\n", *lines[1:]]))
    return folder


def test_materials_under_a_biotac_are_learnt_from(tmp_path):
    source = f"biotac-slide:{biotac(tmp_path / 'd')}"
    found = afferents.inspect(source, tmp_path / "look", quiet=True)
    assert found.problems == []
    said = " ".join(found.sentences)
    assert "9 recordings of 3 textures (mat1, mat12, mat20) at 1 speed (25 mm/s)" in said
    assert "Nothing confirms the 2200 Hz declared" in said
    one = data_set_of(source).scan().recordings[0]
    assert one.conditions == {"trial": 1}
    response = one.audio.read()
    assert response.attrs == {"sample_rate_hz": 2200, "units": "counts"}
    assert response.channel.values.tolist() == ["pac"]
    assert response.sizes["audio_time"] == 6600

    options = {"models": "nearest", "split": "trial", "workers": 1, "quiet": True}
    models = afferents.evaluate(source, tmp_path / "results", **options).summary["models"]
    assert models["nearest"]["nested"]["mean_accuracy"] > 0.9


def strokes(folder):
    """Write a part of vibrotexturerecog: a MATLAB struct of columns a stroke."""
    for (n, texture), gain, trial in product(
        enumerate(("still", "tkan")), (500, 2000, 7000), (1, 2)
    ):
        rng = np.random.default_rng([n, gain, trial])
        at = np.arange(round(60000 / gain) + 150)[:, None] / 100
        wave = np.sin(2 * np.pi * (1 + n) * gain / 500 * at)
        trial_of = {
            "set_point_4": np.full_like(at, 0.25),
            "pac0": 2000 + 50 * wave + rng.normal(size=at.shape),
            "pac1": 2000 + 50 * wave + rng.normal(size=at.shape), "label": texture[:3],
            "velocity": -float(gain), "filename": f"{texture}_vel1.csv",
        }  # fmt: skip
        path = folder / "data_by_trials" / texture / f"{gain}/trial{trial}.mat"
        path.parent.mkdir(parents=True, exist_ok=True)
        scipy.io.savemat(path, {"tosave": trial_of})
    return folder


def test_strokes_of_a_shadow_hand_are_read(tmp_path):
    source = f"vibrotexturerecog:{strokes(tmp_path / 'd')}"
    found = afferents.inspect(source, tmp_path / "look", quiet=True)
    assert found.problems == []
    assert "12 recordings of 2 textures (still, tkan)" in " ".join(found.sentences)
    one = data_set_of(source).scan().recordings[0]
    assert (one.texture, one.speed_mm_s, one.conditions) == (
        "still",
        None,
        {"gain": 2000, "trial": 1},
    )
    response = one.audio.read()
    assert response.channel.values.tolist() == ["tosave/pac0", "tosave/pac1"]
    options = {"models": "nearest", "split": "gain", "workers": 1, "quiet": True}
    results = afferents.evaluate(source, tmp_path / "results", **options)
    assert set(results.summary["models"]["nearest"]["nested"]["by"]) == {"500", "2000", "7000"}


REAL = Path(__file__).resolve().parents[3] / "../shared/datasets/ntp"


@pytest.mark.skipif(not REAL.is_dir(), reason="NTP is not at ../shared/datasets/ntp")
def test_every_real_file_of_ntp_is_read(tmp_path):
    found = afferents.inspect(f"ntp:{REAL}", tmp_path / "look", quiet=True)
    assert found.problems == []
    session = data_set_of(f"ntp:{REAL}").scan()
    assert len(found.facts["recordings"]) == len(session.recordings)
    assert max(one.audio.rows.longest_ms for one in session.recordings) == pytest.approx(76, abs=1)
    assert max(one.audio.rows.n_dropped / one.audio.rows.n for one in session.recordings) < 0.152
