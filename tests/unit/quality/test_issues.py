"""What is wrong with pictures and sound: how long it lasts, and whether it is refused or kept."""

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.quality.issues import QualityIssue, parse_kinds, require_accepted
from afferents.quality.lasting import lasting, sliding_part, span_text
from afferents.quality.sound import find_overload, measure_clipping, require_finite
from afferents.recordings.audio import WavFile

FROZEN = QualityIssue("frozen", "v.mp4", "a picture that changes", "the same one")
LOUD = QualityIssue("loud", "a.wav", "samples within full scale", "3 beyond it")


def test_what_is_accepted_comes_back_and_what_is_not_is_refused_with_the_way_to_accept_it():
    assert require_accepted([LOUD, FROZEN], {"loud", "frozen"}) == [LOUD, FROZEN]
    assert require_accepted([], ()) == []
    with pytest.raises(InputError, match=r"^v\.mp4: .*found the same one; .*--accept frozen$"):
        require_accepted([LOUD, FROZEN], {"loud"})


def test_kinds_are_read_by_name():
    assert parse_kinds(["frozen", "loud"]) == {"frozen", "loud"}
    with pytest.raises(InputError, match=r"--accept: expected one of length, dark, .* found 'ice'"):
        parse_kinds(["ice"])


TIME_S = np.arange(1000) / 100


def holding(*spans):
    holds = np.zeros(len(TIME_S), bool)
    for begin, end in spans:
        holds |= np.clip(TIME_S, begin, end) == TIME_S
    return holds


@pytest.mark.parametrize(
    ("stop_s", "declared", "part"),
    [
        (10.0, (1.5, 8.0), (1.5, 8.0)),
        (10.0, (1.5, 1e9), (1.5, 10.0)),
        (65.0, None, (2.5, 62.5)),
        (4.0, None, (1.0, 3.0)),
        (4.0, (100.0, 200.0), (1.0, 3.0)),
    ],
)
def test_the_part_is_what_was_declared_or_leaves_the_ends_out(stop_s, declared, part):
    assert sliding_part(0.0, stop_s, declared) == part


@pytest.mark.parametrize(
    ("spans", "found"),
    [
        ([(1.0, 5.0)], (1.0, 5.0)),
        ([(1.0, 2.3)], None),
        ([(3.0, 3.4)], None),
        ([], None),
        ([(1.0, 3.0), (3.5, 6.0), (8.0, 9.0)], (1.0, 6.0)),  # a key frame is no end
    ],
)
def test_what_lasts_long_enough_within_the_part_is_found_as_a_whole(spans, found):
    assert lasting(holding(*spans), TIME_S, (2.0, 9.0), 0.5) == found


def test_an_end_near_that_of_the_recording_is_said_to_be_it():
    assert span_text((1.0, 5.0), TIME_S) == "from 1.00 s to 5.00 s"
    assert span_text((1.0, 9.5), TIME_S) == "from 1.00 s to the end"


RATE = 8000


@pytest.fixture
def noise():
    return np.random.default_rng(0).normal(0, 0.1, (RATE, 2)).astype(np.float32)


@pytest.mark.parametrize(
    ("value", "name"), [(np.nan, "nan"), (np.inf, "inf"), (-np.inf, "-inf"), (1e300, "inf")]
)
def test_what_is_no_number_is_named_with_its_place(tmp_path, noise, value, name):
    samples = noise.astype(np.float64)
    samples[4000:4003, 1] = value
    soundfile.write(str(tmp_path / "a.wav"), samples, RATE, subtype="DOUBLE")
    with pytest.raises(InputError, match=rf"found {name} at sample 4000 \(0\.500 s\) and in 2 mor"):
        WavFile(tmp_path / "a.wav").read()
    assert WavFile(tmp_path / "a.wav", 0).read().sizes["audio_time"] == RATE  # the other channel


def test_places_count_from_the_first_sample_given():
    samples = np.array([[0.0, 1.0], [0.0, np.nan]])
    with pytest.raises(InputError, match=r"nan at sample 801 \(0\.100 s\);"):
        require_finite(samples, "a.wav", RATE, 800)


def test_beyond_full_scale_is_a_doubt_with_its_place(noise):
    noise[2000, 1] = -3
    (doubt,) = find_overload(noise[:, 1], "a.wav", RATE)
    assert doubt.kind == "loud"
    assert "found 1 beyond it, up to 3, first at sample 2000 (0.250 s)" in str(doubt)
    assert "--accept loud" in str(doubt.error)
    noise[0], noise[2000] = 1, -128 / 127  # full scale itself, and what conversion adds
    assert find_overload(noise, "a.wav", RATE) == []


@pytest.mark.parametrize("full", [1.0, 0.3, 12.0])
def test_a_clipped_signal_is_so_at_its_own_extremes(full):
    rng = np.random.default_rng(0)
    wave = 1.5 * np.sin(2 * np.pi * 50 * np.arange(RATE) / RATE) + rng.normal(0, 0.01, RATE)
    clipped = full * np.clip(wave, -1, 1)
    assert measure_clipping(clipped) == pytest.approx((np.abs(wave) >= 1).mean(), abs=0.02)
    assert measure_clipping(full * wave) == 0


def test_the_flat_top_of_a_slow_wave_and_silence_are_not_clipped():
    wave = np.rint(1000 * np.sin(2 * np.pi * 5 * np.arange(RATE) / RATE)) / 32768
    assert measure_clipping(wave) == measure_clipping(np.zeros(100)) == 0
