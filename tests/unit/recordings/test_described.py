"""Data sets that a `dataset.toml` describes: every format, and what is wrong with files."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import soundfile

import afferents
from afferents.errors import InputError
from afferents.recordings.data_sets import data_set_of
from afferents.recordings.described import Described

RATE_HZ = 100
VALUES = np.random.default_rng(0).integers(-50, 50, (300, 2)).astype(np.float64)
FRAME = pd.DataFrame({"t": np.arange(300) / RATE_HZ, "left": VALUES[:, 0], "right": VALUES[:, 1]})
FILES = '[files]\npattern = "{texture}_{speed}.SUFFIX"\n[signal]\n'
RESAMPLED = 'time = "t"\nresample_hz = 300\n'
TIMED = 'time = "t"\nchannels = ["left", "right"]\n'


def described(folder, text, suffix="csv"):
    (folder / "dataset.toml").write_text(text.replace("SUFFIX", suffix))
    return Described(folder / "dataset.toml")


def read(folder, text, suffix="csv"):
    """Read the one recording that is described."""
    (one,) = described(folder, text, suffix).scan().recordings
    return one.audio.read()


def csv(folder, name="silk_20.csv", frame=FRAME):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    frame.to_csv(path, index=False)
    return path


def hdf5(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["run/time"] = FRAME.t
        file["run/taxels"] = VALUES
        file["about"] = "a note"


@pytest.mark.parametrize(
    ("suffix", "write", "signal"),
    [
        ("csv", lambda p: FRAME.to_csv(p, index=False), TIMED),
        ("csv", lambda p: FRAME.to_csv(p, index=False), 'time = "t"\n'),
        ("csv", lambda p: FRAME.to_csv(p, index=False), 'time = "t"\nchannels = ["*t"]\n'),
        ("csv", lambda p: FRAME.to_csv(p, index=False), "time = 0\nchannels = [1, 2]\n"),
        ("csv", lambda p: FRAME.to_csv(p, index=False, sep=";"), 'separator = ";"\n' + TIMED),
        (
            "csv",
            lambda p: FRAME.to_csv(p, index=False, header=False),
            "header = false\ntime = 0\nchannels = [1, 2]\n",
        ),
        ("parquet", lambda p: FRAME.to_parquet(p), TIMED),
        ("npy", lambda p: np.save(p, VALUES), "sample_rate_hz = 100\n"),
        ("npy", lambda p: np.save(p, VALUES), "period_ms = 10\nchannels = [0, 1]\n"),
        (
            "npz",
            lambda p: np.savez(p, t=1000 * FRAME.t, x=VALUES, note="cold"),
            'arrays = ["t", "x"]\ntime = "t"\ntime_unit = "ms"\n',
        ),
        ("h5", hdf5, 'arrays = ["run/time", "run/taxels"]\ntime = "run/time"\n'),
        ("wav", lambda p: soundfile.write(p, VALUES / 64, RATE_HZ, subtype="FLOAT"), ""),
    ],
)
def test_every_format_gives_the_same_channels(tmp_path, suffix, write, signal):
    write(tmp_path / f"silk_20.{suffix}")
    one = described(tmp_path, FILES + signal, suffix)
    if '"*t"' in signal:  # the time is no channel, even if a pattern of channels has it
        one = described(tmp_path, FILES + signal.replace("*t", "[lr]*"), suffix)
    (recording,) = one.scan().recordings
    assert (recording.name, recording.texture, recording.speed_mm_s) == ("silk_20", "silk", 20)
    heard = recording.audio.read()
    assert heard.attrs["sample_rate_hz"] == RATE_HZ
    assert (recording.audio.n_samples, recording.audio.n_channels) == (300, 2)
    np.testing.assert_array_equal(heard.values * (64 if suffix == "wav" else 1), VALUES)


class Harm:
    """What writes a file when it is read from a pickle."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.write_text, (self.path, "done")


@pytest.mark.parametrize(("suffix", "save"), [("npy", np.save), ("npz", np.savez)])
def test_pickles_are_not_opened(tmp_path, suffix, save):
    save(tmp_path / f"silk_20.{suffix}", np.array([Harm(tmp_path / "harm")], dtype=object))
    with pytest.raises(InputError, match=f"silk_20.{suffix}: expected .*Object arrays cannot be"):
        read(tmp_path, FILES + "sample_rate_hz = 100\n", suffix)
    assert not (tmp_path / "harm").exists()


@pytest.mark.parametrize(
    ("name", "files", "expected"),
    [
        (
            "day 1/silk/2.5cm_3_down.csv",
            'pattern = "{day}/{texture}/{speed}cm_{trial}_{way}.csv"\nspeed_unit = "cm/s"\n'
            '[files.words.way]\ndown = "-"\n',
            ("silk", 25.0, {"day": "day 1", "trial": 3, "way": "-"}),
        ),
        (
            "run7-v10.csv",
            "regex = 'run(?P<trial>\\d+)-v(?P<speed>\\d+)\\.csv'\ntexture = \"silk\"\n",
            ("silk", 10.0, {"trial": 7}),
        ),
        (
            "silk_12,5mms_1.csv",
            'pattern = "{texture}_{speed}mms_{trial}.csv"\n',
            ("silk", 12.5, {"trial": 1}),
        ),
        ("silk_1.csv", 'pattern = "{texture}_{trial}.csv"\n', ("silk", None, {"trial": 1})),
        (
            "day [1]/x/a/silk (7)[150].csv",
            'folders = ["day [1]/*"]\npattern = "{*}/{texture} ({*})[{speed}].csv"\n'
            'speed_scale = 0.2\nspeed_unit = "cm/s"\n',
            ("silk", 300.0, {}),
        ),
    ],
)
def test_names_say_texture_speed_and_conditions(tmp_path, name, files, expected):
    csv(tmp_path, name)
    csv(tmp_path, "notes.csv")
    text = f"[files]\n{files}[signal]\nsteady_s = [0.5, 2.5]\n{TIMED}"
    (one,) = described(tmp_path, text).scan().recordings
    assert (one.texture, one.speed_mm_s, dict(one.conditions)) == expected
    assert one.steady_s == (0.5, 2.5)


@pytest.mark.parametrize(
    ("steady", "expected"),
    [("", None), ('steady_s = "all"', (0, 3)), ("steady_s = [0.5, -0.25]", (0.5, 2.75))],
)
def test_the_part_of_constant_speed_may_count_from_the_end(tmp_path, steady, expected):
    csv(tmp_path)
    csv(tmp_path, "silk_40.csv", FRAME.drop(columns="left"))
    text = f"{FILES}{steady}\n{TIMED}"
    whole, broken = described(tmp_path, text).scan().recordings
    assert (whole.steady_s, broken.steady_s) == (expected, None)


def test_a_table_of_which_nothing_would_be_used_is_a_problem(tmp_path):
    csv(tmp_path)
    described(tmp_path, FILES + TIMED)
    (problem,) = afferents.inspect(tmp_path, tmp_path / "pictures", quiet=True).problems
    assert "silk_20: expected more than 5 s" in problem


def test_a_folder_is_known_by_its_dataset_toml(tmp_path):
    csv(tmp_path)
    described(tmp_path, FILES + TIMED)
    for wanted in (tmp_path, tmp_path / "dataset.toml", f"dataset:{tmp_path}"):
        assert data_set_of(wanted).scan().textures == ("silk",)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"colour = 1\n": ""}, "found the unknown key 'colour'"),
        ({"[signal]\n": "[signal]\nrate = 5\n"}, "unknown key 'signal.rate'"),
        (
            {"{texture}_{speed}": "{texture}_{texture}_{speed}"},
            "a pattern with each name once",
        ),
        (
            {"pattern =": 'folders = ["/data"]\npattern ='},
            "folders from that of the description on",
        ),
        ({"{texture}_": ""}, "texture must be in the pattern or in labels, or texture"),
        (
            {"[signal]\n": "speed_mm_s = 20\n[signal]\n"},
            "speed must be in the pattern or in labels, or sp",
        ),
        ({'pattern = "{texture}_{speed}.csv"': ""}, "either a pattern or a regex"),
        ({'pattern = "{texture}_{speed}.csv"': "regex = '(?P<texture>'"}, "no pattern: missing"),
        ({TIMED: "sample_rate_hz = 5\nperiod_ms = 3\n"}, "sample_rate_hz or period_ms, not both"),
        ({TIMED: "steady_s = [3.0, 2.0]\n"}, "steady_s must start before it stops"),
        ({TIMED: "steady_s = [0.0, 0.0]\n"}, "steady_s must start before it stops"),
        ({TIMED: "sample_rate_hz = -5\n"}, "sample_rate_hz"),
        ({TIMED: 'duplicates = "once"\n'}, "duplicates = 'once' needs the time column"),
        ({TIMED: "resample_hz = 300\n"}, "resample_hz needs the time column"),
        ({TIMED: 'time = "t"\nlongest_gap_ms = 3\n'}, "longest_gap_ms goes with resample_hz"),
        ({TIMED: f"{RESAMPLED}period_ms = 3\n"}, "resample_hz or period_ms, not both"),
        ({TIMED: f"{RESAMPLED}jitter_ms = 3\n"}, "resample_hz or jitter_ms, not both"),
        ({TIMED: f"{RESAMPLED}out_of_order = 2\n"}, "out_of_order"),
        ({TIMED: 'decimal = ","\n'}, "decimal and separator must differ"),
        ({TIMED: "sample_rate_hz = 0.5\n"}, "signal.sample_rate_hz"),
    ],
)
def test_a_wrong_description_is_refused(tmp_path, change, sentence):
    text = (FILES + TIMED).replace("SUFFIX", "csv")
    for old, new in change.items():
        text = text.replace(old, new) if old in text else old + text
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        described(tmp_path, text)
    assert "dataset.toml: expected" in str(caught.value)


def test_a_hidden_file_is_none(tmp_path):
    csv(tmp_path, "grit_120_20.csv")
    csv(tmp_path, "._grit_120_20.csv")
    (one,) = described(tmp_path, FILES + TIMED).scan().recordings
    assert (one.texture, one.speed_mm_s) == ("grit_120", 20)


PATTERN = '{texture}_{speed}.SUFFIX"\n'
FOLDERS = f'{PATTERN}folders = ["*"]\n'
OF_WORDS = "regex = '(?P<texture>[a-z]+)_(?P<speed>[a-z]+)\\.csv'\n"


@pytest.mark.parametrize(
    ("names", "rule", "sentence"),
    [
        (
            "silk-20",
            PATTERN,
            r"match \{texture\}_\{speed\}\.csv, found none of them \(silk-20\.csv",
        ),
        ("a/silk_20 b/silk_20", FOLDERS, r"silk_20\.csv and silk_20\.csv, both silk at 20 mm/s"),
        ("a/silk_20 b/silk_20", FOLDERS.replace("speed", "*"), r"and silk_20\.csv, both silk;"),
        (
            "grit_120_20 grit_120_20_1",
            PATTERN.replace("d}", "d}_{trial}"),
            r"dataset\.toml: .* texture may be 'grit' or 'grit_120'",
        ),
        ("silk_0", PATTERN, "faster than 0 mm/s"),
        ("silk_fast", OF_WORDS, "a speed in its name, found 'fast'"),
    ],
)
def test_names_that_say_nothing_or_two_things_are_refused(tmp_path, names, rule, sentence):
    for name in names.split():
        csv(tmp_path, f"{name}.csv")
    rule = rule if rule == OF_WORDS else f'pattern = "{rule}'
    with pytest.raises(InputError, match=sentence):
        described(tmp_path, f"[files]\n{rule}[signal]\n{TIMED}").scan()


ROWS = [f"{0.01 * n:.2f},{left:g},{right:g}" for n, (left, right) in enumerate(VALUES)]
NAMES = "t,left,right"


@pytest.mark.parametrize(
    ("lines", "signal"),
    [
        (["# sensor 7", "#", NAMES, *ROWS], ""),
        (["# t,left,right", *ROWS], ""),  # as NumPy writes names
        ([NAMES, "s,N,m/s^2", *ROWS], ""),
        ([NAMES + ",", *(row + "," for row in ROWS)], ""),
        ([NAMES, *(row + ",," for row in ROWS)], ""),
        ([NAMES + ",,", *ROWS], ""),
        ([NAMES, *('"' + row.replace(",", '","') + '"' for row in ROWS)], ""),
        ([NAMES, *(row.replace(",", "  ") for row in ROWS)], 'separator = " "\n'),
        (
            [NAMES, *(row.replace(",", ";").replace(".", ",") for row in ROWS)],
            'separator = ";"\ndecimal = ","\n',
        ),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_tables_as_programs_write_them(tmp_path, lines, signal, encoding):
    if signal:
        lines = [lines[0].replace(",", signal[13]), *lines[1:]]
    (tmp_path / "silk_20.csv").write_text("\n".join(lines) + "\n\n", encoding=encoding)
    found = read(tmp_path, FILES + signal + 'time = "t"\n')
    assert found.channel.values.tolist() == ["left", "right"]
    np.testing.assert_array_equal(found.values, VALUES)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_only_the_columns_that_are_named_are_read(tmp_path, suffix):
    """A frame's name, a sensor that fails, and a counter that is read by nobody."""
    frame = FRAME.assign(frame_id="base_link", temperature=np.nan, seq=np.arange(300))
    path = tmp_path / f"silk_20.{suffix}"
    frame.to_csv(path, index=False) if suffix == "csv" else frame.to_parquet(path)
    for named in (TIMED, "time = 0\nchannels = [1, 2]\n"):
        found = read(tmp_path, FILES + named, suffix)
        assert found.channel.values.tolist() == ["left", "right"]
        np.testing.assert_array_equal(found.values, VALUES)
    with pytest.raises(InputError, match=r"name the columns to read in \[signal\] channels"):
        read(tmp_path, FILES + 'time = "t"\n', suffix)


@pytest.mark.parametrize(("row", "n"), [("3.0,1,2,base_link,4\n", 5), ("\n3.0,1,2,base_link\n", 1)])
def test_a_row_of_other_fields_is_named_though_texts_come_before(tmp_path, row, n):
    path = csv(tmp_path, frame=FRAME.assign(frame_id="base_link"))
    path.write_text(path.read_text() + row)
    with pytest.raises(InputError, match=f"line 302: expected 4 fields, found {n}"):
        read(tmp_path, FILES + TIMED)


def test_columns_that_are_no_signals_are_named_where_no_description_names_any(tmp_path):
    for n, name in enumerate(("silk_20.csv", "silk_40.csv", "felt_20.csv")):
        counted = FRAME.assign(seq=np.arange(300) % 200, clock=1e6 - FRAME.t, label=n, dead=7)
        csv(tmp_path, name, counted)
    data_set = described(tmp_path, FILES + 'time = "t"\n')
    (sentence,) = data_set.describe(data_set.scan())
    assert "are: left, right, seq, clock, label, dead. " in sentence
    for name in ("seq", "clock"):
        assert f"{name} (it rises or falls from row to row" in sentence
    assert "label (it has one value in each file" in sentence
    assert "dead (it never changes, in any file)" in sentence
    assert "left (" not in sentence
    data_set = described(tmp_path, FILES + TIMED)
    assert data_set.describe(data_set.scan()) == []


def changed(**columns):
    frame = FRAME.copy()
    for name, (row, value) in columns.items():
        frame[name] = frame[name].astype(object)
        frame.loc[row, name] = value
    return frame


@pytest.mark.parametrize(
    ("frame", "signal", "sentence"),
    [
        (FRAME.drop(columns="right"), TIMED, "line 1: expected the column 'right', found t, left"),
        (FRAME.drop(columns="t"), TIMED, "line 1: expected the column 't', found left, right"),
        (FRAME, 'columns = ["t", "left"]\n', "line 1: expected the columns t, left"),
        (FRAME, 'time = "t"\nchannels = ["left", "l*"]\n', "each channel once, found 'left' twice"),
        (changed(t=(10, 0.05)), TIMED, "line 12: expected times that go on, found 90 ms, then 50"),
        (changed(t=(10, 0.05)), TIMED + "jitter_ms = 80\n", "expected times that go on"),
        (changed(t=(10, 0.102)), TIMED + "jitter_ms = 1\n", "(within 1), found 12 ms"),
        (changed(t=(10, 0.118)), TIMED, "line 12: expected a timestamp 10 ms after"),
        (FRAME.drop(index=50), TIMED, "line 52: expected a timestamp 10 ms after the one before"),
        (FRAME, TIMED + "sample_rate_hz = 50\n", "sample rate of the data set, 50 Hz, found 100"),
        (FRAME, 'channels = ["left"]\n', "a sample rate, found none; say sample_rate_hz or"),
        (changed(left=(3, "wet")), TIMED, "line 5: expected numbers, found 'wet'"),
        (changed(left=(3, "1_0")), TIMED, "line 5: expected numbers, found '1_0'"),
        (changed(left=(3, np.nan)), TIMED, "line 5: expected numbers, found ''"),
        (changed(left=(3, "inf")), TIMED, "line 5: expected numbers, found 'inf'"),
        (FRAME[:0], TIMED, "rows of data below the header, found none"),
        (FRAME, TIMED + "steady_s = [0.5, 9]\n", "at least 9 s, to the end of steady_s, found 3"),
        (FRAME[:20], TIMED + "least_s = 1.0\n", "at least 1"),
        (pd.concat([FRAME[:9], FRAME[8:]]), TIMED, "found 0 ms"),
    ],
)
def test_what_is_wrong_in_a_file_is_named(tmp_path, frame, signal, sentence):
    path = csv(tmp_path, frame=frame)
    with pytest.raises(InputError, match=re.escape(sentence)) as caught:
        read(tmp_path, FILES + signal)
    assert str(path) in str(caught.value)


def test_jitter_and_rows_written_twice_are_allowed_where_it_is_said(tmp_path):
    csv(tmp_path, frame=changed(t=(10, 0.102)))
    assert len(read(tmp_path, FILES + TIMED + "jitter_ms = 2\n")) == 300
    csv(tmp_path, frame=pd.concat([FRAME[:9], FRAME[8:]]))
    found = read(tmp_path, FILES + TIMED + 'duplicates = "once"\n')
    np.testing.assert_array_equal(found.values, VALUES)


def test_files_of_another_rate_contradict_the_first_or_the_description(tmp_path):
    csv(tmp_path)
    csv(tmp_path, "silk_40.csv", FRAME.assign(t=FRAME.t / 2))
    first, other = described(tmp_path, FILES + TIMED).scan().recordings
    assert first.audio.read().attrs["sample_rate_hz"] == 100
    with pytest.raises(InputError, match=r"silk_40\.csv: .* 100 Hz, found 200 Hz"):
        other.audio.read()
    soundfile.write(tmp_path / "silk_20.wav", VALUES[:, 0] / 64, 8000)
    with pytest.raises(InputError, match="44100 Hz, found 8000 Hz"):
        read(tmp_path, FILES + "sample_rate_hz = 44100\n", "wav")


@pytest.mark.parametrize(
    ("suffix", "content", "sentence"),
    [
        ("npy", b"time,left\n0,1\n", "a readable NPY file"),
        ("parquet", b"time,left\n0,1\n", "a readable PARQUET file"),
        ("wav", b"time,left\n0,1\n", "a readable WAV file"),
        ("xlsx", b"PK", "a file of csv, parquet, .*, found '.xlsx'"),
        ("csv", bytes(range(128, 256)) * 9, "rows of data|the column|line 1"),
    ],
)
def test_a_file_of_another_format(tmp_path, suffix, content, sentence):
    (tmp_path / f"silk_20.{suffix}").write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        read(tmp_path, FILES + "sample_rate_hz = 100\n", suffix)


def test_hdf5_without_its_package_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    (tmp_path / "silk_20.h5").touch()
    with pytest.raises(InputError, match=r"pip install 'afferents\[hdf5\]'"):
        read(tmp_path, FILES + "sample_rate_hz = 9\n", "h5")


def test_what_the_page_shows_is_what_is_read():
    page = (Path(__file__).resolve().parents[3] / "docs/your-data.md").read_text()
    script = Path(__file__).resolve().parents[3] / "scripts/simulated_taxels.py"
    blocks = re.findall(r"```toml\n(.*?)```", page, flags=re.DOTALL)
    shown = next(block for block in blocks if "[signal]" in block)
    shown = re.sub(r" +#.*", "", shown)
    assert shown in script.read_text()
