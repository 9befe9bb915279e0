"""Textures slid at speeds that change: recognised as at constant ones, if windows are even in way.

The truth is made: a texture is ridges so far apart, under noise of the surface and of the
microphone; how fast it goes by is known. Trials are held out.
"""

import json
import re

import numpy as np
import pytest
import xarray as xr
from scipy.signal import butter, lfilter

import afferents
from afferents.errors import InputError

RATE, SECONDS = 1000.0, 8.0
RIDGES_PER_MM = {name: 0.5 * 1.09**n for n, name in enumerate("abcdef")}
SPEEDS, TRIALS = (20.0, 50.0, 80.0), 3


def heard(texture, speed, rng):
    """Return what a microphone hears of ridges that go by at speeds (n,), mm/s; (n, 1)."""
    way = np.cumsum(speed) / RATE
    knots = np.arange(0, way[-1] + 6, 3.0)  # ridges are printed unevenly
    uneven = np.interp(way, knots, rng.normal(0, 0.3, len(knots)))
    phase = 2 * np.pi * RIDGES_PER_MM[texture] * way + uneven + rng.uniform(0, 6)
    surface = np.sin(phase) + 0.4 * np.sin(2 * phase) + rng.normal(0, 6, len(way))
    skin = lfilter(*butter(1, 100, fs=RATE), surface)  # its band stands still in frequency
    return (skin + 0.3 * rng.normal(size=len(way)))[:, None].astype(np.float32)


def recording(texture, trial, speed, nominal, series):
    """Return responses to one slide; `speed` (n,), mm/s, kept as a series where that is wanted."""
    rng = np.random.default_rng([ord(texture), trial, round(speed[0]), len(series)])
    name = f"{texture}/{nominal:g}/{trial}"
    found = xr.Dataset({"ra2": (("audio_time", "channel"), heard(texture, speed, rng))})
    found["ra2"].attrs = {"sample_rate_hz": RATE, "units": "V"}
    attrs = {
        "name": name, "texture": texture, "speed_mm_s": nominal,
        "steady_s": json.dumps([0.0, SECONDS]), "conditions": json.dumps({"trial": trial}),
    }  # fmt: skip
    return found.assign(series).assign_attrs(attrs)


class Slides(afferents.DataSet):
    """Slides of six textures in three trials, at constant speeds or swept."""

    name, title = "slides", "slides"

    def scan(self):
        """Refuse: there are no files."""
        raise NotImplementedError

    def responses(self):
        """Return those of the kind that the path names."""
        time, kind = np.arange(round(SECONDS * RATE)) / RATE, self.path.name
        found = []
        for texture in RIDGES_PER_MM:
            for trial in range(TRIALS):
                if kind == "constant":
                    found += [recording(texture, trial, v + 0 * time, v, {}) for v in SPEEDS]
                    continue
                for n in range(len(SPEEDS)):
                    turn = 2 * np.pi * (time / 5 + (n + trial / 3) / len(SPEEDS))
                    speed = 50 - 30 * np.cos(turn)
                    log = xr.DataArray(
                        speed[::40], dims="speed_time", coords={"speed_time": time[::40]}
                    )
                    one = recording(texture, trial, speed, np.nan, {"speed": log})
                    found.append(one.assign_attrs(name=f"{texture}/swept/{trial}-{n}"))
        return found


@pytest.fixture(scope="module")
def accuracy(tmp_path_factory):
    """Return a function from a kind of slides and options to percent."""

    def measure(kind, **options):
        out = tmp_path_factory.mktemp("results")
        results = afferents.evaluate(
            Slides(kind), out / "r", models="order-te-speed-known", split="trial",
            window_s=2.0, stride_s=1.0, workers=1, quiet=True, **options,
        )  # fmt: skip
        return 100 * results.summary["models"]["order-te-speed-known"]["nested"]["mean_accuracy"]

    return measure


def test_swept_slides_are_recognised_as_constant_ones_if_resampled_by_distance(accuracy):
    constant, swept = accuracy("constant"), accuracy("swept")
    untold = accuracy("swept", resample="time")
    assert 60 < constant < 100  # neither easy nor hopeless
    assert swept > constant - 5
    assert untold < constant - 20


def test_a_band_of_speed_is_held_out_of_slides_that_go_through_all(tmp_path):
    results = afferents.evaluate(
        Slides("swept"), tmp_path / "r", models="order-te-speed-known", split="speed",
        bands="35,55", window_s=0.3, stride_s=0.1, workers=1, quiet=True,
    )  # fmt: skip
    assert results.summary["groups"] == ["0", "35", "55"]
    assert results.summary["options"]["split"] == "speed-35-55"
    found = results.summary["models"]["order-te-speed-known"]["nested"]
    assert not any(found["leaks"].values())
    assert found["mean_accuracy"] > results.summary["chance"]


def test_samples_that_change_too_much_are_left_out(tmp_path):
    options = {"models": "order-te", "split": "trial", "workers": 1, "quiet": True}
    short = {"window_s": 0.5, "stride_s": 0.25}
    all_of = afferents.evaluate(Slides("swept"), tmp_path / "a", **options, **short)
    fewer = afferents.evaluate(
        Slides("swept"), tmp_path / "b", speed_change=0.3, **options, **short
    )
    assert 0.1 < len(fewer.predictions) / len(all_of.predictions) < 0.9
    with pytest.raises(InputError, match="--speed-change: expected samples whose speed"):
        afferents.evaluate(Slides("swept"), tmp_path / "c", speed_change=0.01, **options, **short)


@pytest.mark.system
def test_a_sweep_goes_all_the_way(does, tmp_path):
    session, store = tmp_path / "S", tmp_path / "S.zarr"
    few = ("--textures", "2,4", "--repetitions", "2", "--seconds", "6", "--workers", "1")
    does("simulate", session, "--sweep", "20:80", *few, "--quiet")
    said = " ".join(does("inspect", session, "--out", tmp_path / "i").split())
    assert "at speeds that are logged alongside" in said
    does("extract", session, store, "--workers", "1", "--quiet")
    said = " ".join(does("inspect", store, "--out", tmp_path / "j").split())
    assert re.search(r"Speed in 4 recordings: (19|20)\S* to (79|80|81)\S* mm/s", said)
    assert "Force in 4 recordings: 0.0" in said
    bands = ("--split", "speed", "--bands", "35,65", "--workers", "1", "--quiet")
    does("evaluate", store, "--out", tmp_path / "B", "--models", "sa-wave-vector", *bands)
    heard = ("--models", "order-te-speed-known", "--window-s", "0.3", "--stride-s", "0.1")
    does("evaluate", store, "--out", tmp_path / "H", *heard, *bands)
    assert "bands of speed" in does("report", tmp_path / "B", "--quiet")
    force = ("--split", "force", "--bands", "3", "--workers", "1", "--quiet")
    does("evaluate", store, "--out", tmp_path / "F", "--models", "sa-wave-vector", *force)
