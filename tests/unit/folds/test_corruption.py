"""What spoils recordings: so much as is asked for, the same for every process."""

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.folds.corruption import Corruption


def test_text_names_and_objects_say_the_same():
    text = Corruption.of("markers=0.1, sound=-20dB,frames=0.05,lost=0.2,seed=3", "--disturb")
    named = {"markers": 0.1, "sound": 0.1, "frames": 0.05, "lost": 0.2, "seed": 3}
    assert text == Corruption.of(named, "") == Corruption(**named)
    assert Corruption.of(str(text), "") == text
    assert text.describe() == named
    assert Corruption.of(None, "") == Corruption()
    assert Corruption.of("markers=0,seed=4", "").describe() == {}, "a seed alone changes nothing"


@pytest.mark.parametrize(
    "given",
    ["markers", "marker=1", "markers=a", "markers=-20dB", "frames=1", "sound=nan", "seed=-1"],
)
def test_what_makes_no_sense_is_refused_in_a_sentence(given):
    with pytest.raises(InputError, match=r"--disturb: expected .*, found "):
        Corruption.of(given, "--disturb")


def test_noise_is_as_strong_as_asked_and_the_same_twice_as_large():
    once, twice = (Corruption(markers=px).noise((200, 50, 2), "3/50") for px in (0.1, 0.2))
    assert once.std() == pytest.approx(0.1, rel=0.02)
    np.testing.assert_allclose(twice, 2 * once)
    assert abs(np.corrcoef(once[1:].ravel(), once[:-1].ravel())[0, 1]) < 0.02
    other = Corruption(markers=0.1).noise((200, 50, 2), "3/60")
    assert abs(np.corrcoef(once.ravel(), other.ravel())[0, 1]) < 0.02
    reseeded = Corruption(markers=0.1, seed=1).noise((200, 50, 2), "3/50")
    assert abs(np.corrcoef(once.ravel(), reseeded.ravel())[0, 1]) < 0.02


def test_neighbours_are_lost_together_and_others_in_the_next_second():
    places = np.stack(np.divmod(np.arange(100), 10), axis=1) * 20.0
    unseen = Corruption(lost=0.1).unseen(np.arange(270) / 90, places, "3/50")
    assert (unseen.sum(axis=1) == 10).all()
    for second in (0, 1, 2):
        spell = unseen[90 * second : 90 * (second + 1)]
        assert (spell == spell[0]).all()
        assert np.ptp(places[spell[0]], axis=0).max() <= 80
    assert len({frame.tobytes() for frame in unseen}) == 3


def test_sound_is_spoilt_by_a_share_of_its_own_level_and_so_many_frames_are_left():
    time_s = np.arange(44100) / 44100
    waves = np.stack([np.sin(2 * np.pi * 80 * time_s), 5 + np.sin(2 * np.pi * 90 * time_s)], 1)
    noise = Corruption.of("sound=-20dB", "").with_noise(waves, "3/50") - waves
    np.testing.assert_allclose(noise.std(axis=0), 0.1 * np.sqrt(0.5), rtol=0.02)
    left = Corruption(frames=0.3).left(5000, "3/50")
    assert len(left) == pytest.approx(3500, rel=0.05)
    assert (np.diff(left) > 0).all()
