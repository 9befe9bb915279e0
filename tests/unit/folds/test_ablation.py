"""Less of the data: which recordings, markers and training speeds are left."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st

from afferents import dims
from afferents.errors import InputError
from afferents.folds.ablation import Ablation, parse_speeds
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneSpeedOut
from afferents.markers.places import image_places
from afferents.markers.sensor import load_sensor


def recordings(textures=("0", "0.5", "3"), speeds=(10, 20, 30)):
    return [
        xr.Dataset(attrs={dims.TEXTURE: t, dims.SPEED: float(v), "name": f"{t}/{v}"})
        for t in textures
        for v in speeds
    ]


def images(n_speeds=6, side=19):
    speed = np.repeat(np.arange(1, n_speeds + 1) * 10.0, 4)
    n = len(speed)
    on_sample = {
        dims.SPEED: speed,
        dims.TEXTURE: np.tile(["a", "b"], n // 2),
        dims.RECORDING: np.array([f"{v}/{i % 2}" for i, v in enumerate(speed)]),
    }
    values = np.random.default_rng(0).uniform(1, 2, (n, side, side)).astype(np.float32)
    coords = {name: (dims.SAMPLE, column) for name, column in on_sample.items()}
    return xr.DataArray(values, dims=(dims.SAMPLE, dims.ROW, dims.COLUMN), coords=coords)


def response(side=19):
    """What markers in rows and columns show in three frames."""
    row, column = np.divmod(np.arange(side**2), side)
    values = np.random.default_rng(0).uniform(1, 2, (3, side**2)).astype(np.float32)
    places = {dims.ROW: (dims.MARKER, row), dims.COLUMN: (dims.MARKER, column)}
    return xr.DataArray(values, places, (dims.TIME, dims.MARKER))


@given(share=st.floats(0.05, 1), side=st.integers(8, 25))
def test_as_many_markers_are_shown_as_asked_and_all_over_the_skin(share, side):
    whole = response(side)
    kept = Ablation(markers=share).shown(whole).values
    np.testing.assert_array_equal(kept[kept != 0], whole.values[kept != 0])
    shown = kept.reshape(3, side, side) != 0
    assert shown.mean() == pytest.approx(share, abs=0.08)
    assert (shown == shown[0]).all()
    if share >= 0.5:
        quarter = side // 2
        assert shown[0, :quarter, :quarter].mean() == pytest.approx(share, abs=0.25)


def test_markers_of_other_layouts_are_left_out_by_their_places_and_vibration_is_left_alone():
    row, column = image_places(np.array(load_sensor("hex331").markers))
    places = {dims.ROW: (dims.MARKER, row), dims.COLUMN: (dims.MARKER, column)}
    felt = xr.DataArray(np.ones((2, 331)), places, (dims.TIME, dims.MARKER))
    shown = Ablation(markers=0.5).shown(felt).values
    assert shown.mean() == pytest.approx(0.5, abs=0.05)
    assert shown[:, row < 9].mean() == pytest.approx(0.5, abs=0.1)
    sound = xr.DataArray(np.ones((5, 1)), dims=(dims.AUDIO_TIME, dims.CHANNEL))
    assert Ablation(markers=0.5).shown(sound) is sound
    with pytest.raises(InputError, match="expected markers whose places are known"):
        Ablation(markers=0.5).shown(felt.drop_vars([dims.ROW, dims.COLUMN]))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_a_fold_trains_on_so_many_speeds_spread_over_its_own(n):
    samples = images()
    for protocol in PROTOCOLS.values():
        for fold in LeaveOneSpeedOut(protocol).folds(samples):
            less = Ablation(train_speeds=n).fold(fold, samples)
            speeds = np.unique(samples[dims.SPEED].values[less.train])
            assert len(speeds) == n
            assert set(less.train) <= set(fold.train)
            assert less.test is fold.test
            if n >= 2:
                there = samples[dims.SPEED].values[fold.train]
                assert (speeds.min(), speeds.max()) == (there.min(), there.max())


@pytest.mark.parametrize(
    ("text", "speeds"),
    [
        (None, ()),
        ("10..100:30", (10, 40, 70, 100)),
        ("5, 10..20:2.5", (5, 10, 12.5, 15, 17.5, 20)),
        ("10,10", (10,)),
    ],
)
def test_speeds_are_read_and_textures_go_by_letter_or_folder(text, speeds):
    assert parse_speeds(text) == speeds
    kept = Ablation(textures=("b", "3"), speeds_mm_s=(10, 30)).recordings(recordings())
    assert [r.attrs["name"] for r in kept] == ["0.5/10", "0.5/30", "3/10", "3/30"]


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: parse_speeds("10-100"), r"--speeds: expected mm/s as in .*found '10-100'"),
        (lambda: parse_speeds("10..100:0"), "--speeds"),
        (lambda: Ablation(markers=0), r"--markers: expected a share above 0, up to 1, found 0"),
        (lambda: Ablation(train_speeds=0), "--train-speeds: expected at least 1"),
        (lambda: Ablation(textures=("z",)).recordings(recordings()), "0, 0.5, 3, found 'z'"),
        (lambda: Ablation(speeds_mm_s=(15,)).recordings(recordings()), "20, 30 mm/s, found 15"),
        (lambda: in_first_fold(Ablation(train_speeds=9)), "at most 4, as each fold has, found 9"),
        (
            lambda: in_first_fold(Ablation(), set(images()[dims.RECORDING].values)),
            "nothing to train with 10 mm/s held out",
        ),
    ],
)
def test_what_can_not_be_left_out_is_refused(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()


def in_first_fold(ablation, *tested):
    samples = images()
    return ablation.fold(next(LeaveOneSpeedOut().folds(samples)), samples, *tested)


def test_a_condition_is_tested_and_never_learnt_from():
    slides = [
        r.assign_attrs(conditions=f'{{"direction": "{sign}"}}', name=f"{r.attrs['name']}{sign}")
        for r in recordings()
        for sign in "+-"
    ]
    backwards = Ablation(test_only=("direction", "-")).tested(slides)
    assert backwards == {r.attrs["name"] for r in slides if r.attrs["name"].endswith("-")}
    with pytest.raises(InputError, match=r"\(direction=\+, direction=-\), found direction=x, of 0"):
        Ablation(test_only=("direction", "x")).tested(slides)


def test_a_number_is_the_same_condition_however_it_is_written():
    slides = [
        r.assign_attrs(conditions=f'{{"print": {n}.0}}', name=f"{r.attrs['name']}{n}")
        for r in recordings()
        for n in (11, 99)
    ]
    again = Ablation(test_only=("print", "99")).tested(slides)
    assert again == {r.attrs["name"] for r in slides if r.attrs["name"].endswith("99")}


def test_folds_keep_what_is_tested_apart():
    samples = images()
    second = {name for name in samples[dims.RECORDING].values if name.endswith("/1")}
    for fold in LeaveOneSpeedOut().folds(samples):
        apart = Ablation().fold(fold, samples, second)
        names = samples[dims.RECORDING].values
        assert set(names[apart.test]) <= second
        assert not second & set(names[np.concatenate([apart.train, apart.validation])])
        assert len(apart.train) == len(fold.train) // 2
