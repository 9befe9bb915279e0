"""Clocks of tables: rates against the whole time of files, and rows that come unevenly."""

import re

import numpy as np
import pandas as pd
import pytest

import afferents
from afferents.errors import InputError
from afferents.recordings.described import Described

PATTERN = (
    "data/processed/Texture{*}/"
    "Data[Texture({texture})][Speed({speed})][Force({force})][Trial({trial})].csv"
)
FILES = f"""
[files]
pattern = "{PATTERN}"
speed_unit = "mm/min"
"""
CHANNELS = "[signal]\nheader = false\nchannels = [0, 1, 2, 3, 4, 5, 6, 7, 8]\n"


def uneven_s(seconds, rng, gap_ms=None):
    """Times of rows as a microcontroller writes them: 4.0 ms apart (median), 3.12 (mean)."""
    n, gap = round(1000 * seconds / 3.12), [gap_ms] if gap_ms else []
    slow = rng.normal(4.015, 0.02, round(0.65 * n))
    fast = rng.uniform(0.5, 1.5, n - len(slow) - len(gap))
    fast *= (1000 * seconds - slow.sum() - sum(gap)) / fast.sum()
    step = np.insert(rng.permutation(np.r_[slow, fast]), n // 2, gap)
    return np.cumsum(np.r_[0.0, step]) / 1000


def write(folder, texture, speed, force, table, trial=1):
    name = f"Data[Texture({texture:03d})][Speed({speed})][Force({force})][Trial({trial})].csv"
    path = folder / f"data/processed/Texture{texture:03d}/{name}"
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(table).to_csv(path, index=False, header=False, float_format="%.6g")
    return path


def described(folder, signal):
    (folder / "dataset.toml").write_text(FILES + CHANNELS + signal)
    return Described(folder / "dataset.toml").scan().recordings


@pytest.fixture
def one(tmp_path):
    """Write one file of these times (s) and one taxel's values; return how to describe it."""

    def make(time_s, values):
        table = np.zeros((len(time_s), 12))
        table[:, 0], table[:, 10] = values, time_s
        write(tmp_path, 1, 2400, 0.5, table)
        return lambda signal: described(tmp_path, "time = 10\n" + signal)[0]

    return make


OVER_ALL = r"2(50|49)(\.\d+)? Hz, found 3[12]\d(\.\d+)? Hz over its whole"


@pytest.mark.parametrize(
    ("signal", "sentence"),
    [
        ("", r"say resample_hz in \[signal\] if the sensor writes rows unevenly"),
        ("jitter_ms = 80\n", OVER_ALL),
        ("jitter_ms = 80\nsample_rate_hz = 250\n", OVER_ALL),
    ],
)
def test_uneven_rows_are_no_clock(one, signal, sentence):
    """No row goes back, and each step is within the jitter: only the whole time tells."""
    time = uneven_s(0.6, np.random.default_rng(0))
    with pytest.raises(InputError, match=sentence):
        one(time, time)(signal).audio.read()


def test_a_rate_may_be_off_by_a_hundredth(one):
    signal, rows = "sample_rate_hz = 100\njitter_ms = 30\n", np.arange(100)
    assert one(rows / 100.5, rows)(signal).audio.read().sizes["audio_time"] == 100
    with pytest.raises(InputError, match="100 Hz, found 102 Hz over its whole time"):
        one(rows / 102, rows)(signal).audio.read()


@pytest.mark.parametrize(
    ("unit", "step_s", "declared", "sentence"),
    [
        (1e3, 0.002, "s", "found 2000 rows 2e+03 ms apart, in ms 2 ms; correct [signal] time_unit"),
        (1e9, 0.002, "us", "in ns 2 ms"),
        (1, 0.002, "ms", "in s 2 ms"),
        (1, 20.0, "s", "rows 2e+04 ms apart, in ms 20 ms"),
    ],
)
def test_a_unit_of_times_that_cannot_be_is_refused(one, unit, step_s, declared, sentence):
    time = unit * step_s * np.arange(2000)
    signal = f'time_unit = "{declared}"\n'
    with pytest.raises(InputError, match=re.escape(sentence)):
        one(time, np.sin(time))(signal).audio.read()


def test_a_slow_clock_is_taken_where_its_rate_is_declared(one):
    time = np.arange(2000.0)
    assert one(time, np.sin(time))("sample_rate_hz = 1\n").audio.read().sizes["audio_time"] == 2000


def test_a_rate_that_nothing_confirms_is_said(one, tmp_path):
    time = np.arange(1, 201) / 320
    signal = 'sample_rate_hz = 320\nsteady_s = "all"\n'

    def said():
        found = afferents.inspect(tmp_path / "dataset.toml", tmp_path / "look", quiet=True)
        return " ".join(found.sentences)

    one(time, np.sin(9 * time))(signal)
    assert "Nothing confirms" not in said()
    described(tmp_path, signal)
    assert "Nothing confirms the 320 Hz declared: no time column is named." in said()
    assert "Column 10 rises from row to row: if it holds times, name it as time." in said()


def tone_in(signal, rate_hz):
    """Return the frequency (Hz) and amplitude of the sinusoid that fits best."""
    time = np.arange(len(signal)) / rate_hz

    def fitted(hz):
        waves = np.c_[np.cos(2 * np.pi * hz * time), np.sin(2 * np.pi * hz * time), time**0]
        found, *_ = np.linalg.lstsq(waves, signal, rcond=None)
        return np.hypot(*found[:2]), np.square(signal - waves @ found).sum()

    spectrum = np.abs(np.fft.rfft(signal - signal.mean()))
    middle, bin_hz = np.argmax(spectrum) * rate_hz / len(signal), rate_hz / len(signal)
    tried = np.linspace(middle - bin_hz, middle + bin_hz, 401)
    best = min(tried, key=lambda hz: fitted(hz)[1])
    return best, fitted(best)[0]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("tone_hz", [12.5, 31.25, 62.5])
def test_a_tone_in_uneven_rows_comes_back(one, tone_hz, seed):
    """Straight lines between rows T apart lower a tone by sinc^2(f T) in the mean over phases.

    With T the median step, the longest that is usual, that is a lower bound of the amplitude; and
    nothing makes it larger. A cubic loses less.
    """
    time = uneven_s(2.6, np.random.default_rng(seed))
    tone = one(time, 500 + 100 * np.sin(2 * np.pi * tone_hz * time + 1))
    kept = {}
    for how in ("linear", "cubic"):
        recording = tone(f'resample_hz = 300\ninterpolation = "{how}"\n')
        heard = recording.audio.read()
        assert heard.attrs["sample_rate_hz"] == 300
        hz, kept[how] = tone_in(heard.values[:, 0].astype(float), 300)
        assert hz == pytest.approx(tone_hz, rel=0.005)
        step_s = recording.audio.rows.step_ms / 1000
        assert 100 * np.sinc(tone_hz * step_s) ** 2 - 1 < kept[how] < 101
    assert tone_hz < 60 or kept["linear"] + 5 < kept["cubic"]


def test_no_tone_above_the_new_rate_appears_below_it(one):
    """70 Hz in rows at 1 kHz would be 30 Hz at 100 Hz."""
    time = np.cumsum(np.random.default_rng(0).uniform(0.8, 1.2, 4000)) / 1000
    recording = one(time, np.sin(2 * np.pi * 70 * time))("resample_hz = 100\n")
    heard = recording.audio.read()[20:-20]
    assert float(np.abs(heard).max()) < 0.02
    assert recording.audio.rows.limit_hz == pytest.approx(42)


def test_a_gap_is_bridged_as_far_as_it_is_said(one):
    time = uneven_s(1.0, np.random.default_rng(0), gap_ms=30)
    gap = one(time, time)
    for signal, allowed in (("", r"\d+(\.\d+)?"), ("longest_gap_ms = 25\n", "25")):
        sentence = rf"line 16\d: expected rows at most {allowed} ms apart .*found 30 ms"
        with pytest.raises(InputError, match=sentence):
            gap("resample_hz = 300\n" + signal).audio.read()
    bridged = gap("resample_hz = 300\nlongest_gap_ms = 30\n").audio.read()
    assert bridged.sizes["audio_time"] == pytest.approx(300, abs=2)


def test_rows_out_of_order_are_dropped_up_to_a_share(one):
    time = np.arange(200) / 100
    values = np.sin(time)
    late = [50, 120, 170]
    disordered, spoilt = time.copy(), values.copy()
    disordered[late] -= 0.015
    spoilt[late] = 99.0  # which must not be seen
    rows = one(disordered, spoilt)
    sentence = r"line 51: expected at most 0.01 of the rows out of order .*found 0.015"
    with pytest.raises(InputError, match=sentence):
        rows("resample_hz = 100\n").audio.read()
    recording = rows("resample_hz = 100\nout_of_order = 0.02\n")
    np.testing.assert_allclose(recording.audio.read().values[:, 0], values, atol=1e-3)
    assert recording.audio.rows.n_dropped == 3
