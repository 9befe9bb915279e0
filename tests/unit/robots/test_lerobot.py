"""Stores as LeRobot data sets: what the description of the format 3.0 asks for, and the content.

What is checked stands in https://huggingface.co/docs/lerobot/lerobot-dataset-v3: files, columns,
types, indices without gaps, statistics of every feature, times of frames in the videos.
"""

import json
import shutil

import av
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

import afferents
from afferents.channels import CHANNELS
from afferents.recordings.data_sets import read_session
from afferents.robots.lerobot import compute_stats, merge_stats
from afferents.store.zarr_store import open_responses

VIDEO = "observation.images.fingertip"
TOUCH = "observation.tactile.fingertip"
SCALARS = {"timestamp": "float", "frame_index": "int64", "episode_index": "int64"}
SCALARS |= {"index": "int64", "task_index": "int64"}


@pytest.fixture(scope="module")
def exported(stores, small_session, tmp_path_factory):
    """A data set of nine recordings, in several folders."""
    root = tmp_path_factory.mktemp("lerobot") / "touch"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("afferents.robots.lerobot.FILES_A_CHUNK", 2)
        assert afferents.export_lerobot(stores["video"], root, small_session, quiet=True) == 9
    return root


def read(root):
    info = json.loads((root / "meta" / "info.json").read_text())
    episodes = pd.concat(
        map(pd.read_parquet, sorted((root / "meta" / "episodes").rglob("*.parquet")))
    )
    return info, episodes, pd.read_parquet(root / "meta" / "tasks.parquet")


def test_it_is_what_the_format_asks_for(exported):
    info, episodes, tasks = read(exported)
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_tasks"]) == (9, 3) == (len(episodes), len(tasks))
    assert info["splits"] == {"train": "0:9"}
    assert tasks.index.name == "task"
    assert sorted(tasks.task_index) == [0, 1, 2]
    assert episodes.episode_index.tolist() == list(range(9))
    assert episodes.dataset_from_index.tolist() == [0, *episodes.dataset_to_index[:-1]]
    assert (episodes.dataset_to_index - episodes.dataset_from_index == episodes.length).all()
    assert episodes.length.sum() == info["total_frames"]
    features = info["features"]
    assert set(SCALARS) < set(features)
    stats = json.loads((exported / "meta" / "stats.json").read_text())
    for name, about in features.items():
        assert set(about) >= {"dtype", "shape", "names"}
        shape = (3, 1, 1) if about["dtype"] == "video" else tuple(about["shape"])
        for said in ("min", "max", "mean", "std", "q01", "q50", "q99"):
            assert np.shape(stats[name][said]) == shape, (name, said)
            assert f"stats/{name}/{said}" in episodes
        if about["names"]:
            assert len(about["names"]) == about["shape"][0] or about["dtype"] == "video"


def test_every_frame_is_in_the_tables_once_and_in_order(exported):
    info, episodes, tasks = read(exported)
    index, files = [], set()
    for episode in episodes.to_dict("records"):
        place = {
            "chunk_index": episode["data/chunk_index"],
            "file_index": episode["data/file_index"],
        }
        path = exported / info["data_path"].format(**place)
        files.add(path)
        table = pq.read_table(path, filters=[("episode_index", "=", episode["episode_index"])])
        assert table.num_rows == episode["length"]
        index += table["index"].to_pylist()
        assert table["frame_index"].to_pylist() == list(range(episode["length"]))
        times = np.arange(episode["length"]) / info["fps"]
        np.testing.assert_allclose(table["timestamp"].to_numpy(), times, atol=1e-5)
        task = tasks.index[tasks.task_index == table["task_index"][0].as_py()][0]
        assert list(episode["tasks"]) == [task]
        assert task == f"feel texture {episode['recording'].split('/')[0]}"
        for name, about in info["features"].items():
            if about["dtype"] == "video":
                continue
            kind = table.schema.field(name).type
            if about["shape"] == [1]:
                assert str(kind) == about["dtype"].replace("float32", "float")
            else:
                assert kind.list_size == about["shape"][0]
    assert index == list(range(info["total_frames"]))
    assert len(files) > 2
    assert {path.parent.name for path in files} >= {"chunk-000", "chunk-001"}


def test_frames_hold_what_the_store_holds(exported, stores):
    info, episodes, _ = read(exported)
    stored = {one.attrs["name"]: one for one in open_responses(stores["video"])}
    table = pd.concat(map(pd.read_parquet, sorted((exported / "data").rglob("*.parquet"))))
    for episode in episodes.to_dict("records"):
        responses = stored[episode["recording"]]
        rows = table[table.episode_index == episode["episode_index"]]
        moved = (responses["position"] - responses["rest_position"]).values
        found = np.stack(rows[f"{TOUCH}.displacement"]).reshape(moved.shape)
        seen = np.stack(rows[f"{TOUCH}.detected"])
        np.testing.assert_array_equal(found[seen], moved[seen])
        assert (found[~seen] == 0).all()
        np.testing.assert_array_equal(
            np.stack(rows[f"{TOUCH}.ra1"]), np.nan_to_num(responses["ra1"].values)
        )
        shear = CHANNELS["shear"].response(responses)
        np.testing.assert_array_equal(np.stack(rows[f"{TOUCH}.shear"]), np.nan_to_num(shear.values))
        assert info["features"][f"{TOUCH}.shear"]["names"] == shear["shear"].values.tolist()
        assert rows["observation.state"].tolist() == [responses.attrs["speed_mm_s"]] * len(rows)
        sound = np.stack(rows[f"{TOUCH}.ra2"])
        first = round(float(responses["time"][7]) * 8000)
        expected = responses["ra2"].values[first : first + sound.shape[1], 0]
        np.testing.assert_array_equal(sound[7, : len(expected)], expected)


def test_pictures_lie_at_the_times_that_the_episodes_say(exported, small_session):
    info, episodes, _ = read(exported)
    ours = {one.name: one.video for one in read_session(small_session).recordings}
    for episode in episodes.to_dict("records"):
        place = {key: episode[f"videos/{VIDEO}/{key}"] for key in ("chunk_index", "file_index")}
        path = exported / info["video_path"].format(video_key=VIDEO, **place)
        begin, end = (episode[f"videos/{VIDEO}/{edge}_timestamp"] for edge in ("from", "to"))
        assert end - begin == pytest.approx(episode["length"] / info["fps"])
        with av.open(str(path)) as container:
            shown = [
                frame.to_ndarray(format="gray")
                for frame in container.decode(video=0)
                if begin - 1e-4 <= frame.time < end - 1e-4
            ]
        expected = [frame.image for frame in ours[episode["recording"]].frames()]
        assert len(shown) == len(expected)
        for number in (0, 20, len(expected) - 1):
            assert np.abs(shown[number].astype(int) - expected[number]).mean() < 3


def test_statistics_of_parts_are_those_of_the_whole():
    rng = np.random.default_rng(0)
    parts = [rng.normal(n, 1 + n, (50 + 30 * n, 4)) for n in range(3)]
    found, whole = (
        merge_stats([compute_stats(part) for part in parts]),
        compute_stats(np.concatenate(parts)),
    )
    for name in ("min", "max", "mean", "std", "count"):
        np.testing.assert_allclose(found[name], whole[name])


def test_without_a_session_there_are_no_pictures(stores, tmp_path, does):
    out = does("export-lerobot", stores["video"], tmp_path / "touch", "--json")
    assert json.loads(out)["episodes"] == 9
    info, _, _ = read(tmp_path / "touch")
    assert info["video_path"] is None
    assert VIDEO not in info["features"]


def test_speeds_that_nobody_knows_are_left_out(stores, tmp_path, monkeypatch):
    first, *_ = open_responses(stores["video"])
    unknown = first.assign_attrs(speed_mm_s=np.nan)
    monkeypatch.setattr("afferents.robots.lerobot.open_whole", lambda _: [unknown])
    afferents.export_lerobot(stores["video"], tmp_path / "touch", quiet=True)
    assert "observation.state" not in read(tmp_path / "touch")[0]["features"]
    assert "NaN" not in (tmp_path / "touch" / "meta" / "stats.json").read_text()


def test_a_frame_without_markers_has_no_shear(stores, tmp_path, monkeypatch):
    first, *_ = open_responses(stores["video"])
    seen = first["time"] != first["time"][30]
    blind = first.assign(position=first["position"].where(seen))
    monkeypatch.setattr("afferents.robots.lerobot.open_whole", lambda _: [blind])
    afferents.export_lerobot(stores["video"], tmp_path / "touch", quiet=True)
    (path,) = (tmp_path / "touch" / "data").rglob("*.parquet")
    shear = np.stack(pd.read_parquet(path)[f"{TOUCH}.shear"])
    assert shear[29:32].any(axis=1).tolist() == [True, False, True]


def test_what_can_t_be_exported_is_refused_in_a_sentence(
    stores, small_session, fails, tmp_path, monkeypatch
):
    out, session = tmp_path / "touch", tmp_path / "S"
    assert "recordings with markers" in fails("export-lerobot", stores["audio"], out)
    shutil.copytree(small_session / "1", session / "1")
    shutil.copy(small_session / "session.json", session)
    command = ("export-lerobot", stores["video"], out)
    said = fails(*command, "--session", session)
    assert "the recording '2/20' of the store, found none" in said
    first, *others = open_responses(stores["video"])
    slow = first.assign_coords(time=first["time"] * 1.1)
    monkeypatch.setattr("afferents.robots.lerobot.open_whole", lambda _: [slow, *others])
    assert "one whole number of frames a second in all recordings" in fails(*command)
    unknown = first.assign_attrs(speed_mm_s=np.nan)
    monkeypatch.setattr("afferents.robots.lerobot.open_whole", lambda _: [unknown, *others])
    assert "and a speed or none, in all recordings, found" in fails(*command)
    assert not out.exists()
