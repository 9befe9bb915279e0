"""Which part of a recording is used: the paper's cut, all of it, or what `--steady` says."""

import numpy as np
import pytest
import xarray as xr

from afferents.errors import InputError
from afferents.store.responses import steady_s
from afferents.store.trimming import (
    cut_audio,
    cut_frames,
    parse_steady,
    require_within,
    set_steady,
    written,
)

TENTHS_S = np.arange(0, 10.01, 0.1)


def test_published_frames_are_510_to_5509_and_sound_is_the_last_minute():
    assert cut_frames(np.arange(5850) / 90, "published", None, "3/50") == slice(510, 5510)
    assert cut_audio(6500, 100, "published", None, "3/50") == slice(500, 6500)
    with pytest.raises(InputError, match=r"3/50: expected at least 5510 .* found 5509"):
        cut_frames(np.arange(5509) / 90, "published", None, "3/50")
    with pytest.raises(InputError, match=r"3/50: expected at least 60 s .*, found 59\.90 s"):
        cut_audio(5990, 100, "published", None, "3/50")


def test_all_is_the_constant_speed_or_drops_two_and_a_half_seconds_at_each_end():
    assert cut_frames(TENTHS_S, "all", None, "x") == slice(25, 75)
    assert cut_audio(1000, 100, "all", None, "x") == slice(250, 750)
    assert cut_frames(TENTHS_S, "all", (1.0, 9.0), "x") == slice(10, 90)
    assert cut_audio(1000, 100, "all", (1.0, 12.0), "x") == slice(100, 1000)


def test_what_is_shorter_than_the_ends_says_what_to_declare():
    with pytest.raises(InputError, match=r"found audio from 0\.00 to 4\.00 s"):
        cut_audio(400, 100, "all", None, "3/50")
    with pytest.raises(InputError, match=r"steady_s = \[START, STOP\] in session\.toml or data"):
        cut_frames(np.arange(0, 3, 0.01), "all", None, "felt/1")


ONE = xr.Dataset(
    {
        "sa1": (("time", "marker"), np.zeros((90, 4), np.float32)),
        "ra2": (("audio_time", "channel"), np.zeros((500, 1), np.float32), {"sample_rate_hz": 500}),
    },
    {"time": 0.5 + np.arange(90) / 90},
    {"name": "1/20", "steady_s": "[0.1, 0.9]", "conditions": "{}"},
)


def test_it_is_read_and_written_and_overrules_what_the_recording_says():
    assert parse_steady(None, "all") is None
    steady = parse_steady("0.25:1", "all")
    assert (steady, written(steady)) == ((0.25, 1.0), "0.25:1")
    assert [steady_s(r) for r in set_steady([ONE], steady)] == [(0.25, 1.0)]
    assert [steady_s(r) for r in set_steady([ONE], None)] == [(0.1, 0.9)]


@pytest.mark.parametrize(
    "wanted", ["", "1", "1:2:3", "a:b", "1,2", (2, 1), (-1, 2), (0, np.inf), (np.nan, 1), (1,)]
)
def test_malformed_and_impossible_ones_are_refused(wanted):
    with pytest.raises(InputError, match=r"--steady: expected START:STOP in s, as in 0\.2:2\.8"):
        parse_steady(wanted, "all")
    with pytest.raises(InputError, match="the cut 'all', found 'published'"):
        parse_steady((0, 1), "published")


def test_it_must_lie_within_what_is_used():
    require_within(ONE, "sa1", (0.5, 1.5))
    require_within(ONE, "ra2", (0.0, 1.0))
    require_within(ONE, "ra2", None)
    for variable, steady in (("sa1", (0.2, 1.0)), ("sa1", (0.5, 1.6)), ("ra2", (0.5, 1.5))):
        with pytest.raises(InputError, match=f"as 1/20, whose {variable} is from"):
            require_within(ONE, variable, steady)
