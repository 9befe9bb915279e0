"""Labels in a file of their own, samples packed in rows, a file an axis, and MATLAB files."""

import json

import numpy as np
import pandas as pd
import pytest
import scipy.io

from afferents.errors import InputError

from .test_described import FRAME, RATE_HZ, VALUES, csv, described, read

LABELS = '[files]\npattern = "{*}.csv"\n[files.labels]\nfile = "labels.FORMAT"\nname = "which"\n'
LABELS += 'texture = "material"\nspeed = "v"\nconditions = ["day"]\n[signal]\ntime = "t"\n'
ROWS = [
    {"which": "b", "material": "wool", "v": 40, "day": 2, "note": ""},
    {"which": "runs/a.csv", "material": "silk", "v": 20, "day": 1, "note": "cold"},
    {"which": "gone.csv", "material": "silk", "v": 40, "day": 1, "note": ""},
]
BY_FILE = {row["which"]: row for row in ROWS}
WRITTEN = {
    "csv": pd.DataFrame(ROWS).to_csv(index=False),
    "json": json.dumps(ROWS),
    "by file": json.dumps(BY_FILE),
}


def labelled(folder, text, form="csv"):
    csv(folder, "runs/a.csv"), csv(folder, "runs/b.csv"), csv(folder, "runs/c.csv")
    (folder / f"labels.{form}").write_text(text)
    return described(folder, LABELS.replace("{*}", "runs/{*}").replace("FORMAT", form))


@pytest.mark.parametrize("written", WRITTEN)
def test_labels_come_from_a_file_of_their_own(tmp_path, written):
    one = labelled(tmp_path, WRITTEN[written], "csv" if written == "csv" else "json")
    session = one.scan()
    found = [
        (r.source.name, r.texture, r.speed_mm_s, dict(r.conditions)) for r in session.recordings
    ]
    assert found == [("a.csv", "silk", 20.0, {"day": 1}), ("b.csv", "wool", 40.0, {"day": 2})]
    (left,) = one.left_out(session)
    assert left.startswith("1 file is left out: runs/c.csv; not of ")
    assert "or without a row in labels." in left


def test_json_may_name_textures_alone(tmp_path):
    csv(tmp_path, "a.csv"), csv(tmp_path, "b.csv")
    (tmp_path / "labels.json").write_text('{"a.csv": "silk", "b.csv": 3}')
    text = '[files]\npattern = "{*}.csv"\nlabels = {file = "labels.json"}\n[signal]\ntime = "t"\n'
    assert [one.texture for one in described(tmp_path, text).scan().recordings] == ["silk", "3"]


@pytest.mark.parametrize(
    ("form", "text", "expected"),
    [
        ("csv", "which,v,day\na,1,1\n", "line 2: expected 'material', found which, v, day"),
        ("csv", "which,material,v,day\na,,1,1\n", "line 2: expected 'material'"),
        ("csv", "which,material,v,day\na,silk,1\n", "line 2: expected 4 fields, found 3"),
        ("csv", "which,material,v,day\n", "expected a row for each file of data, found none"),
        ("csv", "which,material,v,day\nx,silk,1,1\n", r"such as a.csv, found others, such as x"),
        ("csv", "which,material,v,day\na,x,1,1\na,y,1,1\n", "line 3: expected a row a file"),
        ("csv", "which,material,v,day\na,x,fast,1\n", "expected a speed"),
        ("json", "[1, 2]", "expected a list of objects"),
        ("json", "{", "expected a JSON file of labels"),
    ],
)
def test_labels_that_are_wrong_are_named(tmp_path, form, text, expected):
    with pytest.raises(InputError, match=expected):
        labelled(tmp_path, text, form).scan()


def test_a_row_is_of_one_file(tmp_path):
    csv(tmp_path, "one/a.csv"), csv(tmp_path, "two/a.csv")
    (tmp_path / "labels.csv").write_text("which,material,v,day\na,silk,20,1\n")
    one = described(tmp_path, LABELS.replace("{*}", "{*}/{*}").replace("FORMAT", "csv"))
    with pytest.raises(InputError, match=r"found 'a', which .*one.* and .*two.* are called"):
        one.scan()


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (
            'pattern = "{texture}.csv"\nlabels = {file = "l.csv"}',
            "texture must be in the pattern or",
        ),
        ('pattern = "{texture}_{a}.csv"\njoined = "axis"', "joined names 'axis', which is not in"),
        ('pattern = "{*}.csv"', "texture must be in the pattern or in labels, or texture be given"),
        (
            'pattern = "{texture}.csv"\n[signal]\nchannels = ["a"]\npacked = ["b*"]',
            "channels or packed, not both",
        ),
    ],
)
def test_keys_that_contradict_each_other_are_refused(tmp_path, wrong, expected):
    with pytest.raises(InputError, match=expected):
        described(tmp_path, f"[files]\n{wrong}\n")


PACKED = '[files]\npattern = "{texture}_{speed}.csv"\n[signal]\npacked = ["p*", "q*"]\n'


@pytest.mark.parametrize("clock", ["sample_rate_hz = 400\n", 'time = "t"\n'])
def test_samples_packed_in_rows_come_one_after_the_other(tmp_path, clock):
    samples = np.random.default_rng(1).normal(size=(1200, 2))
    packed = samples.reshape(300, 4, 2)
    columns = {f"{name}{n}": packed[:, n, i] for i, name in enumerate("pq") for n in range(4)}
    csv(tmp_path, frame=pd.DataFrame({"t": FRAME.t, "temperature": 1, **columns}))
    found = read(tmp_path, PACKED + clock)
    assert found.attrs["sample_rate_hz"] == 4 * RATE_HZ
    assert list(found.channel.values) == ["p", "q"]
    np.testing.assert_allclose(found, samples, rtol=1e-6)


def test_as_many_samples_of_each_channel(tmp_path):
    csv(tmp_path, frame=pd.DataFrame({"p1": VALUES[:, 0], "p2": 1.0, "q1": VALUES[:, 1]}))
    with pytest.raises(InputError, match=r"as many columns in each of .* packed, found 2 and 1"):
        read(tmp_path, PACKED + "sample_rate_hz = 100\n")


JOINED = (
    '[files]\npattern = "{texture}_{speed}_{axis}.csv"\njoined = "axis"\n[signal]\ntime = "t"\n'
)


def test_files_of_one_recording_are_read_side_by_side(tmp_path):
    for axis, column in (("y", "right"), ("x", "left")):
        csv(tmp_path, f"silk_20_{axis}.csv", FRAME[["t", column]][: 299 if axis == "x" else 300])
    one = described(tmp_path, JOINED)
    session = one.scan()
    (recording,) = session.recordings
    assert (recording.texture, recording.speed_mm_s, len(recording.files)) == ("silk", 20.0, 2)
    assert "axis" not in recording.conditions
    assert not one.left_out(session)
    found = recording.audio.read()
    assert list(found.channel.values) == ["x", "y"]
    np.testing.assert_allclose(found, VALUES[:299])


def test_files_of_one_recording_must_fit(tmp_path):
    for axis, n in (("x", 300), ("y", 200)):
        csv(tmp_path, f"silk_20_{axis}.csv", FRAME[["t", "left"]][:n])
    with pytest.raises(InputError, match=r"to have as many rows, found 300 in .* and 200 in"):
        described(tmp_path, JOINED).scan().recordings[0].audio.read()
    csv(tmp_path, "wool_20_x.csv")
    with pytest.raises(
        InputError, match=r"expected a file of each axis \(x, y\), found none of 'y'"
    ):
        described(tmp_path, JOINED).scan()


def old_matlab(path):
    trial = {"t": FRAME.t.to_numpy()[:, None], "pac": VALUES, "label": "silk", "velocity": -500.0}
    scipy.io.savemat(path, {"trial": trial})


def new_matlab(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file["trial/t"], file["trial/pac"] = FRAME.t.to_numpy()[None], VALUES.T
        file["trial/label"] = np.array([[115, 105]], np.uint16)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("write", [old_matlab, new_matlab])
def test_matlab_files_of_both_kinds(tmp_path, write):
    write(tmp_path / "silk_20.mat")
    text = '[files]\npattern = "{texture}_{speed}.mat"\n[signal]\ntime = "trial/t"\n'
    found = read(tmp_path, text + 'arrays = ["trial/t", "trial/pac"]\n')
    assert list(found.channel.values) == ["trial/pac0", "trial/pac1"]
    np.testing.assert_allclose(found, VALUES)
    with pytest.raises(InputError, match=r"expected the array 'trial/x', found .*trial/pac"):
        read(tmp_path, text + 'arrays = ["trial/x"]\n')


@pytest.mark.parametrize("content", [b"", b"no matlab", b"MATLAB 5.0 MAT-file".ljust(128) + b"x"])
def test_a_file_that_is_no_matlab_file_is_named(tmp_path, content):
    (tmp_path / "silk_20.mat").write_bytes(content)
    text = '[files]\npattern = "{texture}_{speed}.mat"\n[signal]\nsample_rate_hz = 100\n'
    with pytest.raises(InputError, match=r"silk_20.mat: expected a readable MAT file, found "):
        read(tmp_path, text)


def test_of_a_matlab_file_columns_alone_are_read_where_none_is_named(tmp_path):
    old_matlab(tmp_path / "silk_20.mat")
    text = '[files]\npattern = "{texture}_{speed}.mat"\n[signal]\ntime = "trial/t"\n'
    assert list(read(tmp_path, text).channel.values) == ["trial/pac0", "trial/pac1"]
