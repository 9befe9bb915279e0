import numpy as np
import pytest

from afferents.errors import InputError
from afferents.store.trimming import cut_audio, cut_frames


def test_published_frames_are_510_to_5509():
    kept = cut_frames(np.arange(5850) / 90, "published", None, "3/50")
    assert (kept.start, kept.stop) == (510, 5510)


def test_published_refuses_a_video_of_5509_frames():
    with pytest.raises(InputError, match=r"3/50: expected at least 5510 .* found 5509"):
        cut_frames(np.arange(5509) / 90, "published", None, "3/50")


def test_published_audio_is_the_last_minute():
    kept = cut_audio(65 * 44100, 44100, "published", None, "3/50")
    assert (kept.start, kept.stop) == (5 * 44100, 65 * 44100)


def test_published_refuses_audio_under_a_minute():
    with pytest.raises(InputError, match=r"at least 60 s .* found 59\.00 s"):
        cut_audio(59 * 44100, 44100, "published", None, "3/50")


def test_all_drops_two_and_a_half_seconds_at_each_end():
    kept = cut_frames(np.arange(0, 10.01, 0.1), "all", None, "3/50")
    assert (kept.start, kept.stop) == (25, 75)


def test_all_keeps_constant_speed_where_it_is_declared():
    times = np.arange(0, 10.01, 0.1)
    assert cut_frames(times, "all", (1.0, 9.0), "x") == slice(10, 90)
    assert cut_audio(1000, 100, "all", (1.0, 9.0), "x") == slice(100, 900)


def test_all_refuses_what_is_shorter_than_the_ends():
    with pytest.raises(InputError, match=r"found audio from 0\.00 to 4\.00 s"):
        cut_audio(400, 100, "all", None, "3/50")
