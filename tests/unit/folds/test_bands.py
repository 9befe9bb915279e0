"""Bands of speed and of force: of which a sample is, what crosses, and what can't be held out."""

import json

import numpy as np
import pytest
import xarray as xr

from afferents.encodings.samples import concatenate, make_samples
from afferents.errors import InputError
from afferents.folds.bands import name_bands
from afferents.folds.held_out import split_named
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneGroupOut, find_leaks, refuse_leaks

TIME = np.arange(0, 12.001, 0.01)


def triangle(low, high, period_s=6.0):
    """A quantity that goes up and down between two values."""
    return low + (high - low) * (1 - np.abs(2 * (TIME / period_s % 1) - 1))


def recording(name, texture, speed=None, force=None, nominal=np.nan):
    series = {}
    attrs = {"name": name, "texture": texture, "speed_mm_s": nominal}
    if speed is not None:
        series["speed"] = xr.DataArray(speed, dims="speed_time", coords={"speed_time": TIME})
    if force is not None:
        coords = {"force_time": TIME, "force_axis": ["z"]}
        series["force"] = xr.DataArray(force[:, None], coords, dims=("force_time", "force_axis"))
        attrs["normal_force"] = "z"
    frames = {"time": np.arange(0, 12, 0.1)}
    return xr.Dataset(series, frames, {**attrs, "steady_s": json.dumps([0.0, 12.0])})


def samples_of(recordings, window_s=0.4):
    parts = []
    for responses in recordings:
        start = np.arange(0, 12 - window_s, 0.1)
        values = np.zeros((len(start), 1), np.float32)
        parts.append(make_samples(values, ("frequency",), start, start + window_s, responses.attrs))
    return concatenate(parts)


@pytest.fixture(scope="module")
def swept():
    return [
        recording(f"{t}/{n}", t, triangle(20, 80), triangle(1, 3, 4.0)) for t in "ab" for n in "12"
    ]


def felt(samples, n, what, recordings):
    """Return all values of a quantity between the start and the stop of a sample."""
    start, stop = float(samples["start_s"][n]), float(samples["stop_s"][n])
    (one,) = [r for r in recordings if r.attrs["name"] == samples["recording"].values[n]]
    moments = np.linspace(start, stop, 200)
    series = one[what] if what == "speed" else one["force"][:, 0]
    return np.interp(moments, TIME, series.values)


@pytest.mark.parametrize(
    ("name", "edges"),
    [("speed-40-60", [40, 60]), ("speed-in-3", [40, 60]), ("force-1.5-2.5", [1.5, 2.5])],
)
def test_a_sample_is_of_the_band_in_which_all_of_it_lies(swept, name, edges):
    split, samples = split_named(name), samples_of(swept)
    kept = split.labelled(samples, swept)
    groups = split.groups_of(swept)
    assert groups == ["0", *(f"{edge:g}" for edge in edges)]
    assert 0.5 * len(samples) < len(kept) < len(samples)
    bounds = dict(zip(groups, zip([0, *edges], [*edges, 1e9], strict=True), strict=True))
    for n in range(0, len(kept), 7):
        values = felt(kept, n, split.of_what, swept)
        low, high = bounds[str(kept["group"].values[n])]
        assert low <= values.min()
        assert values.max() <= high + 1e-9


@pytest.mark.parametrize("name", ["speed-30-40-60", "force-1.5-2-2.5"])
def test_nothing_learnt_from_has_a_moment_in_the_band_held_out(swept, name):
    split = split_named(name)
    samples = split.labelled(samples_of(swept), swept)
    for fold in LeaveOneGroupOut(PROTOCOLS["nested"], what=split).folds(samples):
        refuse_leaks(find_leaks(samples, fold, fold.train), fold)
        tested = np.concatenate([felt(samples, n, split.of_what, swept) for n in fold.test[::9]])
        others = [*fold.train[::9], *fold.validation[::9]]
        learnt = np.concatenate([felt(samples, n, split.of_what, swept) for n in others])
        inside = (learnt > tested.min()) & (learnt < tested.max())
        assert not inside.any()


def test_the_guard_finds_a_window_that_crosses(swept):
    split = split_named("speed-40-60")
    samples = split.labelled(samples_of(swept), swept)
    fold = next(iter(LeaveOneGroupOut(PROTOCOLS["nested"], what=split).folds(samples)))
    reaching = samples.copy()  # as if windows that cross had not been left out
    stop = reaching["stop_s"].values.copy()
    stop[fold.validation] += 0.5
    reaching = reaching.assign_coords(stop_s=("sample", stop))
    assert find_leaks(reaching, fold, fold.train).test_samples_overlapping_validation > 0
    refuse_leaks(find_leaks(samples, fold, fold.train), fold)


def test_constant_slides_are_of_the_band_of_their_speed():
    several = [recording(f"{t}/{v}", t, nominal=float(v)) for t in "ab" for v in (10, 30, 50, 90)]
    split = split_named("speed-20-60")
    kept = split.labelled(samples_of(several), several)
    of = {
        str(r): str(g) for r, g in zip(kept["recording"].values, kept["group"].values, strict=True)
    }
    assert of["a/10"] == "0"
    assert of["b/30"] == of["a/50"] == "20"
    assert of["b/90"] == "60"


def test_bands_without_a_moment_are_none(swept):
    assert split_named("speed-10-40-90").groups_of(swept) == ["10", "40"]


@pytest.mark.parametrize(
    ("name", "window_s", "found"),
    [
        ("speed-in-1", 0.4, "--bands: expected 2 to 99 bands, or their edges, found 1"),
        ("speed-60-40", 0.4, "--bands: expected edges above 0 that rise, found 60, 40"),
        ("speed-40-42-44", 0.4, "every texture in every group, found none of a in speed 40 to 42"),
        ("speed-24-28-32-36-40-44-48-52-56-60-64-68-72-76", 4.0, "within a band .*, found none of"),
    ],
)
def test_bands_that_can_not_be_held_out_are_refused(swept, name, window_s, found):
    with pytest.raises(InputError, match=found):
        split_named(name).labelled(samples_of(swept, window_s), swept)


CONSTANT = [recording("a/1", "a", nominal=20.0), recording("a/2", "a", nominal=40.0)]


@pytest.mark.parametrize(
    ("name", "recordings", "found"),
    [
        ("force-1-2", CONSTANT[:1], "the force of every recording, found none of a/1"),
        ("speed-20-40", [recording("a/1", "a")], "the speed of every recording, found none of a/1"),
        ("speed-in-50", CONSTANT, "found 50, which is more than the speed has values for"),
        ("speed-200-300", None, r"which goes from 20\.\d to 79\.\d mm/s, found 200, 300"),
    ],
)
def test_recordings_without_these_bands_are_refused(swept, name, recordings, found):
    with pytest.raises(InputError, match=found):
        split_named(name).groups_of(recordings or swept)


def test_the_name_says_the_bands():
    assert name_bands("speed", "20,40, 60") == "speed-20-40-60"
    assert name_bands("force", "3") == "force-in-3"
    assert split_named("speed-20-40").printed("20") == "speed 20 to 40 mm/s"
    assert split_named("speed-20-40").printed("40") == "speed 40 mm/s and more"
    for split, bands in (("trial", "2,3"), ("speed", "fast"), ("speed", "2,,3")):
        with pytest.raises(InputError, match="--bands: expected"):
            name_bands(split, bands)


def test_quantiles_settle_to_edges(swept):
    settled = split_named("force-in-2").settled(swept)
    assert settled.name == "force-2"
    assert settled.printed("0") == "force 0 to 2 N"
    assert settled.title == "band of force"
    assert split_named("speed").settled(swept) is split_named("speed")
