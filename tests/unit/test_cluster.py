"""A real Dask cluster over TCP: the same numbers as here, a killed worker, and what is refused."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import dask.base
import pandas as pd
import pytest
from distributed import Client, LocalCluster

from afferents.errors import AfferentsError, InputError
from afferents.files import write_aside
from afferents.parallel import on_cluster as submit

pytestmark = pytest.mark.system


def on_cluster(function, jobs, address, output=Path("/nowhere")):
    return submit(function, jobs, address, output)


@pytest.fixture
def store(stores, tmp_path):
    return shutil.copytree(stores["audio"], tmp_path / "s.zarr")


HELD = ("--held-out", "20,40")


def evaluate(run, store, out, *more):
    options = (
        "--models",
        "vib-te,vib-te-aug",
        "--protocol",
        "both",
        "--quiet",
        "--json",
        *HELD,
        *more,
    )
    code, said, err = run("evaluate", store, "--out", out, *options)
    assert code == 0, err
    return json.loads(said)


def test_a_cluster_gives_the_numbers_that_this_machine_gives(run, store, tmp_path, cluster):
    here = evaluate(run, store, tmp_path / "here", "--workers", 1)
    there = evaluate(run, store, tmp_path / "there", "--cluster", cluster.scheduler_address)
    pd.testing.assert_frame_equal(
        pd.read_parquet(tmp_path / "here" / "predictions.parquet"),
        pd.read_parquet(tmp_path / "there" / "predictions.parquet"),
        rtol=1e-5,
    )
    assert (
        here["models"]["vib-te"]["nested"]["by_speed"]
        == (there["models"]["vib-te"]["nested"]["by_speed"])
    )
    kept = tmp_path / "there" / "folds/vib-te/nested/seed-0/20/weights.safetensors"
    same = tmp_path / "here" / "folds/vib-te/nested/seed-0/20/weights.safetensors"
    assert kept.read_bytes() == same.read_bytes()
    evaluate(run, store, tmp_path / "there", "--cluster", "tcp://127.0.0.1:1")  # nothing to do


OWN = Path(__file__).parents[1] / "own" / "own_parts.py"


def test_models_of_one_s_own_are_sent_whole(run, stores, tmp_path, cluster):
    """Workers have neither the file nor its folder in their path."""
    names = ("logistic", "mine", "second")
    options = ("--held-out", "40", "--models", ",".join(f"{OWN}:{name}" for name in names))
    tables = []
    for where in (("--workers", 1), ("--cluster", cluster.scheduler_address)):
        out = tmp_path / str(where[0])
        asked = ("evaluate", stores["video"], "--out", out, *options, *where, "--quiet")
        code, _, err = run(*asked)
        assert code == 0, err
        tables.append(pd.read_parquet(out / "predictions.parquet"))
    assert set(tables[0]["model"]) == {"logistic", "all-mine", "second-net"}
    pd.testing.assert_frame_equal(*tables, rtol=1e-4, atol=1e-6)


def test_data_of_one_s_own_are_read_by_workers(run, sounds, tmp_path, cluster):
    """Workers have neither the file of the data set nor its folder in their path."""
    gloves = tmp_path / "gloves"
    gloves.mkdir()
    for path in sounds.rglob("audio.wav"):
        shutil.copy(path, gloves / f"{path.parts[-3]}_{path.parts[-2]}.wav")
    source = f"{OWN.with_name('own_data.py')}:Gloves:{gloves}"
    asked = ("evaluate", source, "--held-out", "40", "--models", "order-te", "--quiet")
    tables = []
    for where in (("--workers", 1), ("--cluster", cluster.scheduler_address)):
        out = tmp_path / str(where[0])
        code, _, err = run(*asked, "--out", out, *where)
        assert code == 0, err
        tables.append(pd.read_parquet(out / "predictions.parquet"))
    pd.testing.assert_frame_equal(*tables, rtol=1e-4, atol=1e-6)


def test_a_killed_worker_costs_its_job_alone(cluster, tmp_path):
    """Ten jobs; a worker that has done some is shot at another, when all else has come back."""
    found = {}
    for n, squared in on_cluster(
        square, [(n, str(tmp_path)) for n in range(10)], cluster.scheduler_address
    ):
        found[n] = squared
        if len(found) == 9:
            os.kill(int((tmp_path / "pid").read_text()), signal.SIGKILL)
    assert found == {n: n * n for n in range(10)}
    begun = (tmp_path / "begun").read_text().split()
    assert len(begun) == 11, begun


def square(n, folder):
    """Return n and its square; who is the first to begin a second one waits to be shot."""
    mine = Path(folder) / f"{os.getpid()}"
    with (Path(folder) / "begun").open("a") as begun:
        begun.write(f"{n}\n")
    if mine.exists() and is_first(folder):
        with write_aside(Path(folder) / "pid") as whole:
            whole.write_text(str(os.getpid()))
        time.sleep(60)
    mine.touch()
    return n, n * n


def is_first(folder):
    """Only one of two workers can make a folder: looking and then writing lets both through."""
    try:
        (Path(folder) / "claimed").mkdir()
    except FileExistsError:
        return False
    return True


def test_what_else_computes_with_dask_is_left_alone(cluster):
    before = dask.base.get_scheduler()
    with pytest.raises(InputError):
        next(on_cluster(complain, [("",)], cluster.scheduler_address))
    running = on_cluster(abs, [(-1,), (-2,)], cluster.scheduler_address)
    assert next(running) in (1, 2)
    assert dask.base.get_scheduler() is before
    running.close()
    assert dask.base.get_scheduler() is before


def test_errors_of_a_job_come_back_as_they_are(cluster):
    with pytest.raises(InputError, match="a sample: expected sense, found none"):
        list(on_cluster(complain, [("a sample",)], cluster.scheduler_address))


def complain(where):
    raise InputError(f"{where}: expected sense, found none")


def test_other_versions_are_refused(cluster, monkeypatch):
    monkeypatch.setattr("afferents.parallel.version", lambda package: "0.0.1")
    with pytest.raises(InputError, match=r"worker tcp://.*: expected afferents 0.0.1, as where"):
        list(on_cluster(complain, [("",)], cluster.scheduler_address))


ALONE = ("--no-nanny", "--no-dashboard")


def slowly(n):
    time.sleep(0.2)
    return n


def test_a_worker_that_joins_late_is_checked_too(forked_workers):
    with LocalCluster(
        n_workers=1, threads_per_worker=1, protocol="tcp", dashboard_address=":0"
    ) as running:
        address = running.scheduler_address
        results = on_cluster(slowly, [(n,) for n in range(1000)], address)
        next(results)
        late = subprocess.Popen(
            [sys.executable, "-m", "dask", "worker", address, "--nthreads", "2", *ALONE],
            stderr=subprocess.DEVNULL,
        )
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


def test_no_scheduler_and_no_workers_are_named(forked_workers, monkeypatch):
    # Short only where nobody comes: on a busy machine an answer takes longer.
    with monkeypatch.context() as short:
        short.setattr("afferents.parallel.ANSWER_S", 0.5)
        with pytest.raises(InputError, match=r"--cluster: expected a Dask scheduler at tcp://"):
            list(on_cluster(complain, [("",)], "tcp://127.0.0.1:1"))
        short.setattr("afferents.parallel.ANSWER_S", 10)
        short.setattr("afferents.parallel.WORKERS_S", 0.5)
        with (
            LocalCluster(n_workers=0, protocol="tcp", dashboard_address=":0") as empty,
            pytest.raises(InputError, match="at least one worker"),
        ):
            list(on_cluster(complain, [("",)], empty.scheduler_address))
    with (
        LocalCluster(
            n_workers=1, threads_per_worker=2, protocol="tcp", dashboard_address=":0"
        ) as threaded,
        pytest.raises(InputError, match=r"worker tcp://.*: expected one thread, found 2; .*nthr"),
    ):
        list(on_cluster(complain, [("",)], threaded.scheduler_address))
    assert dask.base.get_scheduler() is None


def test_a_store_that_changed_under_the_run_is_refused(run, store, tmp_path, cluster, monkeypatch):
    from afferents.evaluation import run as module

    def changed(function, jobs, address, output):
        settings = store / "zarr.json"
        content = settings.read_text()
        assert '"windowed"' in content
        settings.write_text(content.replace('"windowed"', '"one-to-one"'))
        return submit(function, jobs, address, output)

    monkeypatch.setattr(module, "on_cluster", changed)
    code, _, err = run("evaluate", store, "--out", tmp_path / "r", "--models", "vib-te", "--quiet",
                       "--cluster", cluster.scheduler_address)  # fmt: skip
    assert code == 2
    assert "the data that the evaluation began with" in err


def die():
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_job_that_kills_its_workers_is_named(cluster):
    with pytest.raises(AfferentsError, match="killed its worker several times"):
        list(on_cluster(die, [()], cluster.scheduler_address))
    # A cluster that is closed while its workers are started again fails at closing.
    with Client(cluster) as client:
        client.wait_for_workers(2, timeout=60)
