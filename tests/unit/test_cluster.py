"""A real Dask cluster over TCP: the same bytes as here, a killed worker, and what is refused."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import dask.base
import pandas as pd
import pytest
from distributed import Client, LocalCluster

from afferents.errors import AfferentsError, InputError
from afferents.extraction import extract as extraction
from afferents.parallel import on_cluster as submit

from ..kept import contents

pytestmark = pytest.mark.system

OWN = Path(__file__).parent / "own" / "own_parts.py"


def on_cluster(function, jobs, address, output=Path("/nowhere")):
    return submit(function, jobs, address, output)


@pytest.fixture
def there(run, cluster):
    """Run a command with the cluster's workers; return what it said on stderr."""

    def command(*words, code=0):
        found, _, err = run(*words, "--cluster", cluster.scheduler_address, "--quiet")
        assert found == code, err
        return err

    return command


def local_cluster(n_workers=1, threads=1):
    return LocalCluster(
        n_workers=n_workers, threads_per_worker=threads, protocol="tcp", dashboard_address=":0"
    )


@pytest.fixture
def gloves(sounds, tmp_path):
    """Data of a data set of one's own."""
    folder = tmp_path / "gloves"
    folder.mkdir()
    for path in sounds.rglob("audio.wav"):
        shutil.copy(path, folder / f"{path.parts[-3]}_{path.parts[-2]}.wav")
    return f"{OWN.with_name('own_data.py')}:Gloves:{folder}"


@pytest.mark.parametrize("case", ["ours", "models of one's own", "data of one's own"])
def test_a_cluster_gives_the_numbers_that_this_machine_gives(
    does, there, stores, gloves, tmp_path, case
):
    """Workers have neither the file of one's own nor its folder in their path."""
    own = ",".join(f"{OWN}:{name}" for name in ("logistic", "mine", "second"))
    source, models, options = {
        "ours": (stores["audio"], "vib-te,vib-te-aug", ("--protocol", "both")),
        "models of one's own": (stores["video"], own, ()),
        "data of one's own": (gloves, "order-te", ()),
    }[case]
    asked = ("evaluate", source, "--models", models, "--held-out", "40", *options)
    does(*asked, "--out", tmp_path / "here", "--workers", 1, "--quiet")
    there(*asked, "--out", tmp_path / "there")
    tables = [pd.read_parquet(tmp_path / at / "predictions.parquet") for at in ("here", "there")]
    pd.testing.assert_frame_equal(*tables, rtol=1e-4, atol=1e-6)
    if case == "ours":
        kept = "folds/vib-te/nested/seed-0/40/weights.safetensors"
        assert (tmp_path / "there" / kept).read_bytes() == (tmp_path / "here" / kept).read_bytes()
        nowhere = ("--out", tmp_path / "there", "--cluster", "tcp://127.0.0.1:1", "--quiet")
        does(*asked, *nowhere)  # nothing to do


def test_extract_and_track_write_the_same_bytes(does, there, session, stores, tmp_path):
    tracked = tmp_path / "tracked.zarr"
    does("track", session, tracked, "--workers", 1, "--quiet")
    for command, here in (("extract", stores["video"]), ("track", tracked)):
        there(command, session, tmp_path / f"{command}.zarr")
        assert contents(tmp_path / f"{command}.zarr") == contents(here)


def test_simulate_writes_the_same_bytes(does, there, tmp_path):
    """A map of heights is read by workers."""
    (tmp_path / "waves.pgm").write_bytes(b"P5 64 8 255 " + bytes(range(64)) * 8)
    waves = ("--height-map", f"waves={tmp_path}/waves.pgm,12,0.5")
    options = ("--textures", "g", "--seconds", "1.6", "--speeds", "50", *waves)
    does("simulate", tmp_path / "here", *options, "--workers", 1, "--quiet")
    there("simulate", tmp_path / "there", *options)
    assert contents(tmp_path / "there") == contents(tmp_path / "here")


def test_a_worker_killed_while_it_extracts_costs_time_alone(does, there, session, stores, tmp_path):
    here, store = stores["video"], tmp_path / "there.zarr"
    shot = []

    def shoot():
        while not shot:
            for partial in store.glob("*/.partial-[0-9]*"):  # speeds: groups are written here
                pid = int(partial.name.rsplit("-", 2)[1])
                os.kill(pid, signal.SIGKILL)
                shot.append(pid)
                return
            time.sleep(0.001)

    hunter = threading.Thread(target=shoot, daemon=True)
    hunter.start()
    there("extract", session, store)
    hunter.join(timeout=5)
    assert shot
    assert shot[0] != os.getpid()
    assert {k: v for k, v in contents(store).items() if ".partial-" not in k} == contents(here)
    does("extract", session, store, "--workers", 1, "--quiet")
    assert contents(store) == contents(here), "the next run clears up"


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_job_that_kills_its_workers_is_named(cluster):
    with pytest.raises(AfferentsError, match="killed its worker several times"):
        list(on_cluster(die, [()], cluster.scheduler_address))
    # A cluster that is closed while its workers are started again fails at closing.
    with Client(cluster) as client:
        client.wait_for_workers(2, timeout=60)


def complain(where):
    raise InputError(f"{where}: expected sense, found none")


def test_errors_come_back_and_what_else_computes_with_dask_is_left_alone(cluster):
    before = dask.base.get_scheduler()
    with pytest.raises(InputError, match="a sample: expected sense, found none"):
        next(on_cluster(complain, [("a sample",)], cluster.scheduler_address))
    running = on_cluster(abs, [(-1,), (-2,)], cluster.scheduler_address)
    assert next(running) in (1, 2)
    assert dask.base.get_scheduler() is before
    running.close()
    assert dask.base.get_scheduler() is before


def test_workers_that_do_not_see_the_store_are_refused(there, session, tmp_path, cluster):
    def see_nothing():
        from afferents import outputs

        outputs.lock_text, found = lambda folder: "", outputs.lock_text
        outputs._lock_text = found

    def see():
        from afferents import outputs

        outputs.lock_text = outputs._lock_text

    store = tmp_path / "there.zarr"
    with Client(cluster, set_as_default=False) as client:
        client.run(see_nothing)
        try:
            err = there("extract", session, store, code=2)
        finally:
            client.run(see)
    assert f"expected to see {store} as it is where the command runs; let all workers see" in err
    assert not list(store.glob("*/*/zarr.json"))


def test_a_worker_without_the_session_is_one_sentence(there, session, tmp_path, monkeypatch):
    mine = shutil.copytree(session, tmp_path / "mine")

    def gone(function, jobs, *more):
        jobs = list(jobs)
        (mine / "2" / "40" / "video.mp4").unlink()
        return submit(function, jobs, *more)

    monkeypatch.setattr(extraction.parallel, "on_cluster", gone)
    err = there("extract", mine, tmp_path / "s.zarr", "--keep-going", code=2)
    assert "worker on" in err
    assert "2/40/video.mp4 as it is where the command runs" in err
    assert err.count("\n") == 2  # the first says which sensor is taken


def slowly(n):
    time.sleep(0.2)
    return n


def test_a_worker_that_joins_late_is_checked_too(forked_workers):
    with local_cluster() as running:
        address = running.scheduler_address
        results = on_cluster(slowly, [(n,) for n in range(1000)], address)
        next(results)
        late = subprocess.Popen(
            [sys.executable, "-m", "dask", "worker", address, "--nthreads", "2", "--no-nanny",
             "--no-dashboard"],
            stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            with pytest.raises(InputError, match=r"worker tcp://.*: expected one thread, found 2"):
                list(results)
        finally:
            late.kill()
            late.wait()


@pytest.mark.parametrize("address", ["", "scheduler", "tcp://scheduler", "http://scheduler:8786"])
def test_what_is_no_address_is_said_at_once(address):
    with pytest.raises(InputError, match=r"--cluster: expected an address like tcp://"):
        list(on_cluster(complain, [("",)], address))


def test_no_scheduler_no_workers_and_other_versions_are_named(cluster, monkeypatch):
    def refused(sentence, address, **limits):
        with monkeypatch.context() as patch:
            for name, value in limits.items():
                patch.setattr(f"afferents.parallel.{name}", value)
            with pytest.raises(InputError, match=sentence):
                list(on_cluster(complain, [("",)], address))

    # Short only where nobody comes: on a busy machine an answer takes longer.
    refused(r"--cluster: expected a Dask scheduler at tcp", "tcp://127.0.0.1:1", ANSWER_S=0.5)
    with local_cluster(0) as empty:
        refused("at least one worker", empty.scheduler_address, WORKERS_S=0.5)
    sentence = r"worker tcp://.*: expected afferents 0.0.1, as where"
    refused(sentence, cluster.scheduler_address, version=lambda package: "0.0.1")
    assert dask.base.get_scheduler() is None
