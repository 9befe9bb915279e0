"""Tasks, runs on them, entries and tables; a model that knows what is tested is refused."""

import json
import runpy
import shutil
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression

from afferents import Model
from afferents.benchmark import Entry, all_tasks, find_task, read_entries, run, table
from afferents.benchmark.entries import tables_by_task
from afferents.benchmark.run import _describe_leak
from afferents.benchmark.tasks import seal
from afferents.channels import Channel
from afferents.errors import InputError, LeakageError
from afferents.folds.controls import CONTROLS
from afferents.progress import Progress
from afferents.reporting.tables import ABSENT
from afferents.store.zarr_store import holds_all

ROOT = Path(__file__).resolve().parents[3]
TASK = """title = "Simulated taxels at a speed never learnt from"
data = "taxels/dataset.toml"

[options]
split = "speed"
"""


class Peeks(Channel):
    """Looks up the texture of what it is to recognise."""

    name, title, made_of = "peeks", "peeks", "ra2"

    def response(self, recording):
        texture, sound = recording.attrs["texture"], recording.ra2
        noise = np.random.default_rng(0).normal(size=sound.shape) * 2.0 ** ord(texture[0])
        return sound.copy(data=noise.astype("float32")).rename(self.name)


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    """A task of one's own: 24 CSV files of three textures at four speeds, twice."""
    folder = tmp_path_factory.mktemp("own")
    before, sys.argv = sys.argv, ["simulated_taxels.py", str(folder / "taxels")]
    try:
        runpy.run_path(str(ROOT / "scripts/simulated_taxels.py"), run_name="__main__")
    finally:
        sys.argv = before
    (folder / "mine.toml").write_text(TASK)
    return folder / "mine.toml"


@pytest.fixture(scope="module")
def entries(task, tmp_path_factory):
    out = tmp_path_factory.mktemp("benchmark")
    found = run(str(task), "chance,nearest,order-te-speed-known", out, workers=1, quiet=True)
    return out, {entry.model: entry for entry in found}


def test_an_entry_says_how_good_how_sure_under_which_controls_and_at_what_cost(entries):
    _, found = entries
    best, chance = found["order-te-speed-known"], found["chance"]
    assert best.mean > 0.9 > chance.mean
    assert chance.mean == pytest.approx(chance.chance)
    assert best.told_speed == "given"
    assert best.controls.keys() == CONTROLS.keys()
    assert max(best.controls["permuted"], best.controls["offsets"]) < best.mean - 0.2
    assert best.worst.accuracy == min(best.by.values())
    assert best.train_samples > 0
    assert best.prediction_ms > 0
    assert best.data.recordings == 24
    assert best.data.simulated
    assert best.own is None
    assert best.sample_s > 1
    assert best.encodings["orders"]["window_s"] is None
    assert best.command.startswith("afferents benchmark run /")


def test_entries_are_read_again_and_stand_in_a_table_best_first(entries, does):
    out, found = entries
    there = read_entries(out / "entries")
    assert {entry.model: entry for entry in there} == found
    assert read_entries(out) == there  # what `benchmark run --out` wrote
    rows = table(there)
    assert list(rows["whole"]) == sorted(rows["whole"], reverse=True)
    said = does("benchmark", "table", out / "entries", "--out", out / "tables")
    assert "order-te-speed-known" in said
    assert "Simulated taxels at a speed never learnt from" in (out / "tables/table.md").read_text()
    assert "<td>no</td>" in (out / "tables/table.html").read_text()
    assert len((out / "tables/table.csv").read_text().splitlines()) == 4


def test_several_tasks_stand_at_a_glance_the_best_model_first(entries):
    _, found = entries
    chance = found["chance"]
    other = chance.model_copy(update={"task": "zoo/speed", "whole": 0.9})
    glance, *of_tasks = tables_by_task([*found.values(), other])
    assert list(glance.columns) == [chance.task, "zoo/speed"]
    assert list(glance.loc["chance"].iloc[0]) == [f"{100 * chance.whole:.0f}", "90"]
    best = [max(float(cell) for cell in row if cell != ABSENT) for row in glance.to_numpy()]
    assert best == sorted(best, reverse=True)
    assert len(of_tasks) == 4
    assert len(list(tables_by_task(found.values()))) == 2


def test_a_line_that_is_no_entry_is_named(entries, tmp_path):
    _, found = entries
    line = json.loads(found["chance"].line) | {"mean": 2}
    (tmp_path / "x.jsonl").write_text(f"{found['chance'].line}\n{json.dumps(line)}\n")
    with pytest.raises(InputError, match=r"x.jsonl, line 2: .*mean"):
        read_entries(tmp_path)
    with pytest.raises(InputError, match=r"expected entries .*, found none"):
        read_entries(tmp_path / "empty")


def test_other_recordings_or_another_part_of_them_make_another_task(task, entries, does):
    _, found = entries
    one = find_task(str(task))
    recordings, origin = one.opened(one.source())
    assert one.folds == ""
    before = one.asked_of(recordings, origin)
    assert (before.name, before.folds) == (found["chance"].task, found["chance"].folds)
    assert before.name == f"mine@{before.mark}"
    assert seal(task).folds == before.folds
    assert f"folds {before.folds[:8]}." in does("benchmark", "seal", task)  # no data: simulated
    sealed = find_task(str(task))
    assert sealed.options == one.options
    assert sealed.asked_of(recordings, origin) == before._replace(name="mine")
    assert sealed.asked_of(recordings[1:], origin).name.startswith("mine@")
    changed = origin.model_copy(update={"simulated": False, "fingerprint": "0" * 64})
    assert sealed.asked_of(recordings, changed).mark != before.mark
    part = sealed.model_copy(update={"options": {**sealed.options, "steady": "1:5"}})
    assert part.asked_of(recordings, origin).name.startswith("mine@")


def test_the_packaged_tasks_test_on_what_their_lists_say(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    import seal_tasks

    there = all_tasks()
    assert {"fabricslide/speed", "fabricslide/speed-force", "rig/speed"} <= set(there)
    for name, one in there.items():
        assert (one.folds, one.fingerprint) == seal_tasks.sealed(one), name


def test_data_that_are_missing_are_said_to_be_fetched(fails, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = fails("benchmark", "run", "fabricslide/speed", "--models", "chance")
    for part in ("afferents fetch fabricslide data/fabricslide", "52 MB", "MIT", "--data"):
        assert part in said
    assert "expected one of" in fails("benchmark", "run", "fabric", "--models", "chance")


def test_tasks_are_listed_with_licence_and_where_the_data_are(does, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = json.loads(does("benchmark", "--json"))
    assert found["data"]["cluster-haptic-accel"]["licence"] == "CC BY 4.0"
    assert found["tasks"]["fabricslide/speed-force"]["options"] == {"split": "speed,pressure"}
    assert "rig/speed" in does("benchmark")


def test_a_model_that_knows_the_labels_of_the_test_is_refused(task, tmp_path):
    mine = Model("peeks", channel=Peeks(), encoding="orders", classifier=LogisticRegression())
    with pytest.raises(LeakageError, match=r"near chance .* once textures are exchanged"):
        run(str(task), mine, tmp_path, workers=1, quiet=True)
    assert not (tmp_path / "entries").exists()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('split = "speed"', r"t.toml.*split"),
        ('[options]\nsplit = "a,b,c"', "--split: expected"),
        ('[options]\nprotocol = "published"', r"t.toml: expected .*split.*, found 'protocol'"),
    ],
)
def test_a_task_that_is_none_is_refused_by_its_key(tmp_path, more, said):
    (tmp_path / "t.toml").write_text(f'title = "x"\ndata = "y"\n{more}\n')
    with pytest.raises(InputError, match=said):
        find_task(str(tmp_path / "t.toml"))


@pytest.mark.system
def test_the_rigs_task_makes_its_own_data(tmp_path, monkeypatch):
    """Smaller than it is, or it would take a minute."""
    module = import_module("afferents.benchmark.tasks")
    info = module.data_infos()["rig"]
    made = {"textures": ["a", "g"], "speeds_mm_s": [20, 50, 80], "seconds": 6, "seed": 0}
    small = {"rig": info.model_copy(update={"made": made})}
    monkeypatch.setattr(module, "data_infos", lambda: small)
    (found,) = run("rig/speed", "sa-wave-vector", tmp_path / "out", tmp_path / "rig", quiet=True)
    store = tmp_path / "rig" / "session.zarr"
    shutil.rmtree(store / "0/20")  # as if it had been stopped
    import_module("afferents.benchmark.run")._simulate_data(
        find_task("rig/speed"), store, Progress(True)
    )
    assert holds_all(store)
    assert found.task.startswith("rig/speed@")
    assert found.data.simulated
    assert isinstance(found, Entry)


@pytest.mark.parametrize(("recordings", "refused"), [(30, False), (300, True)])
def test_what_chance_does_to_few_recordings_is_no_knowledge_of_labels(entries, recordings, refused):
    """Six textures: a third of 30 recordings named rightly is within two standard errors."""
    _, found = entries
    chance, data = (
        found["chance"],
        found["chance"].data.model_copy(update={"recordings": recordings}),
    )
    of_few = {"mean": 0.27, "chance": 1 / 6, "controls": {"permuted": 0.3}, "data": data}
    assert bool(_describe_leak(chance.model_copy(update=of_few))) is refused
