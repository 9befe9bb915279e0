"""From a recording's responses to spikes: what drives what, and what stays silent."""

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.spikes.artificial import artificial_spikes

from .conftest import recording_of

FPS, RATE_HZ, SECONDS = 90, 8000, 2.0


def recording(sa1=0.0, ra1=0.0, tone_hz=150.0, loudness=0.0, markers=4, rate_hz=RATE_HZ):
    time = np.arange(round(SECONDS * FPS)) / FPS
    held = np.ones((len(time), markers))
    t = np.arange(round(SECONDS * rate_hz)) / rate_hz
    tone = loudness * np.sin(2 * np.pi * tone_hz * t)
    return recording_of(time, sa1 * held, ra1 * held, tone, rate_hz)


def rates(*recordings, **options):
    spikes = artificial_spikes(recordings, **options)
    return {
        name: spikes.rates()[:, (spikes.units["class"] == name).to_numpy()]
        for name in ("SA", "RA", "PC")
    }


@pytest.mark.parametrize("model", ["izhikevich", "lif"])
def test_a_held_press_drives_sa_alone(model):
    found = rates(recording(sa1=2.0), model=model)
    assert (found["SA"] > 5).all()
    assert not found["RA"].any()
    assert not found["PC"].any()


@pytest.mark.parametrize("model", ["izhikevich", "lif"])
def test_a_tone_drives_the_units_whose_band_it_is_in_one_spike_a_cycle(model):
    spikes = artificial_spikes([recording(loudness=0.006)], model=model, classes=["PC"])
    found = spikes.rates()[0]
    # of the bands, 150 Hz is inside (90, 180), (130, 260) and (40, 400); far outside (40, 80)
    assert found[0] < 0.1 * found[7]
    np.testing.assert_allclose(found[[2, 3, 7]], 150, rtol=0.35)
    phases = np.exp(2j * np.pi * 150 * spikes.train(0, 3)[10:])
    assert np.abs(phases.mean()) > 0.8


def test_recordings_of_one_texture_and_speed_are_its_repetitions():
    again = recording()
    other = recording().assign_attrs(texture="other")
    trials = artificial_spikes([recording(), other, again]).trials
    assert trials["repetition"].tolist() == [0, 0, 1]


def test_lost_markers_and_quiet_sounds_are_silent():
    lost = recording(sa1=2.0)
    lost.sa1[:, 1] = np.nan
    found = rates(lost, recording(sa1=2.0, loudness=1e-4))
    assert found["SA"][0, 1] == 0
    assert (found["SA"][0, [0, 2, 3]] > 0).all()
    assert not found["PC"].any()


def test_the_seed_says_which_units_and_nothing_else_does():
    one = artificial_spikes([recording(sa1=2.0), recording(sa1=1.0)])
    again = artificial_spikes([recording(sa1=2.0)])
    np.testing.assert_array_equal(again.times, one.select(trials=[0]).times)
    other = artificial_spikes([recording(sa1=2.0)], seed=1)
    assert not np.array_equal(other.times, again.times)
    assert len({len(one.train(0, unit)) for unit in range(4)}) > 1, "units differ"


def test_a_stretch_begins_with_units_that_have_settled():
    pressed = recording(sa1=2.0, markers=40)
    whole = artificial_spikes([pressed], classes=["SA"], start_s=0)
    cut = artificial_spikes([pressed], classes=["SA"], start_s=0.5)
    for unit in range(40):  # as if it had been recorded on and on
        train = whole.train(0, unit)
        np.testing.assert_allclose(cut.train(0, unit), train[train > 0.5] - 0.5, atol=1e-6)
    first, later = cut.window(0, 0.05).rates().mean(), cut.rates().mean()
    assert first < 1.5 * later
    assert whole.window(0, 0.05).rates().mean() > 1.5 * later  # the volley of a sudden press


def test_what_a_unit_listens_to_and_how_finely_is_said():
    spikes = artificial_spikes([recording()], start_s=0.5, stop_s=1.5)
    table = spikes.units
    assert table.loc["SA-2", "receptive_field"] == (2,)
    assert table.loc["SA-2", "resolution_s"] == pytest.approx(1 / FPS)
    assert table.loc["PC-7", "resolution_s"] == pytest.approx(0.5e-3)
    assert spikes.trials["duration_s"].tolist() == [1.0]
    assert spikes.trials["recording"].tolist() == ["g/50"]


def test_a_recording_has_the_classes_that_it_has_responses_for():
    units = artificial_spikes([recording().drop_vars("ra2")]).units
    assert set(units["class"]) == {"SA", "RA"}
    heard = recording(loudness=0.05, rate_hz=600).drop_vars(["sa1", "ra1", "time"])
    spikes = artificial_spikes([heard])  # 600 samples/s hold no band that ends at 400 Hz
    assert spikes.rates()[0, [2, 5]].all()
    assert not spikes.rates()[0, [4, 6, 7]].any()
    slow = recording(rate_hz=100).drop_vars(["sa1", "ra1", "time"])
    with pytest.raises(InputError, match="vibration of more than 168 samples/s, found 100"):
        artificial_spikes([slow])


def test_a_recording_that_lacks_what_others_have_is_named():
    mute = recording().drop_vars("ra2").assign_attrs(name="g/60")
    said = r"g/60: expected ra2, which drives PC .* found none; choose --classes SA,RA$"
    with pytest.raises(InputError, match=said):
        artificial_spikes([recording(), mute])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"model": "hodgkin"}, "one of izhikevich, lif, found 'hodgkin'"),
        ({"classes": ["SAII"]}, "some of SA, RA, PC, found 'SAII'"),
        ({"start_s": 1.95}, "a stretch of 0.1 s or more"),
    ],
)
def test_what_cannot_be_is_refused(options, said):
    with pytest.raises(InputError, match=said):
        artificial_spikes([recording()], **options)
