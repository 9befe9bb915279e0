"""Recordings simulated, extracted and tracked on a real Dask cluster over TCP, byte for byte."""

import os
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest
from distributed import Client

from afferents.extraction import extract as extraction
from afferents.parallel import on_cluster

pytestmark = pytest.mark.system

SIMULATE = ("--textures", "g", "--speeds", "50,100", "--seconds", "1.6", "--quiet")


def bytes_of(folder):
    """Return the content of every file, but of what has its time or path written in."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def on(cluster):
    return ("--cluster", cluster.scheduler_address)


def test_extract_and_track_write_the_same_bytes(run, session, stores, tmp_path, cluster):
    tracked = tmp_path / "tracked.zarr"
    assert run("track", session, tracked, "--workers", 1, "--quiet")[0] == 0
    for command, here in (("extract", stores["video"]), ("track", tracked)):
        there = tmp_path / f"{command}-there.zarr"
        code, _, err = run(command, session, there, *on(cluster), "--quiet")
        assert code == 0, err
        assert bytes_of(there) == bytes_of(here)


def test_workers_that_do_not_see_the_store_are_refused(run, session, tmp_path, cluster):
    def see_nothing():
        from afferents import parallel

        parallel.lock_text, found = lambda folder: "", parallel.lock_text
        parallel._lock_text = found

    def see():
        from afferents import parallel

        parallel.lock_text = parallel._lock_text

    there = tmp_path / "there.zarr"
    with Client(cluster, set_as_default=False) as client:
        client.run(see_nothing)
        try:
            code, _, err = run("extract", session, there, *on(cluster), "--quiet")
        finally:
            client.run(see)
    assert code == 2
    assert f"expected to see {there} as it is where the command runs; let all workers see" in err
    assert not list(there.glob("*/*/zarr.json"))


def test_a_worker_killed_while_it_extracts_costs_time_alone(
    run, session, stores, tmp_path, cluster
):
    here, there = stores["video"], tmp_path / "there.zarr"
    shot = []

    def shoot():
        while not shot:
            for partial in there.glob("*/.partial-*"):
                pid = int(partial.name.rsplit("-", 2)[1])
                os.kill(pid, signal.SIGKILL)
                shot.append(pid)
                return
            time.sleep(0.001)

    hunter = threading.Thread(target=shoot, daemon=True)
    hunter.start()
    code, _, err = run("extract", session, there, *on(cluster), "--quiet")
    hunter.join(timeout=5)
    assert code == 0, err
    assert shot
    assert shot[0] != os.getpid()
    assert {k: v for k, v in bytes_of(there).items() if ".partial-" not in k} == bytes_of(here)
    assert run("extract", session, there, "--workers", 1, "--quiet")[0] == 0
    assert bytes_of(there) == bytes_of(here), "the next run clears up"


def test_simulate_writes_the_same_bytes(run, tmp_path, cluster):
    here, there = tmp_path / "here", tmp_path / "there"
    assert run("simulate", here, *SIMULATE, "--workers", 1)[0] == 0
    code, _, err = run("simulate", there, *SIMULATE, *on(cluster))
    assert code == 0, err
    assert bytes_of(there) == bytes_of(here)


def test_a_map_of_heights_is_read_by_workers(run, tmp_path, cluster):
    here, there = tmp_path / "here", tmp_path / "there"
    (tmp_path / "waves.pgm").write_bytes(b"P5 64 8 255 " + bytes(range(64)) * 8)
    waves = ("--height-map", f"waves={tmp_path}/waves.pgm,12,0.5")
    words = ("--textures", "g", "--speeds", "50", "--seconds", "1.6", "--quiet", *waves)
    assert run("simulate", here, *words, "--workers", 1)[0] == 0
    code, _, err = run("simulate", there, *words, *on(cluster))
    assert code == 0, err
    assert bytes_of(there) == bytes_of(here)


def test_a_worker_without_the_session_is_one_sentence(run, session, tmp_path, cluster, monkeypatch):
    mine = shutil.copytree(session, tmp_path / "mine")

    def gone(function, jobs, *more):
        jobs = list(jobs)
        (mine / "2" / "40" / "video.mp4").unlink()
        return on_cluster(function, jobs, *more)

    monkeypatch.setattr(extraction, "on_cluster", gone)
    command = ("extract", mine, tmp_path / "s.zarr", *on(cluster), "--quiet", "--keep-going")
    code, _, err = run(*command)
    assert code == 2
    assert "worker on" in err
    assert "2/40/video.mp4 as it is where the command runs" in err
    assert err.count("\n") == 1


def test_what_is_wrong_with_a_recording_comes_back(run, make_session, tmp_path, cluster):
    bad = make_session(tmp_path / "bad", textures=(1, 2), speeds=(20,))
    (bad / "1" / "20" / "audio.wav").write_bytes(b"no sound")
    command = ("extract", bad, tmp_path / "s.zarr", *on(cluster), "--quiet")
    code, _, err = run(*command)
    assert code == 2
    assert "expected a readable sound file" in err
    code, _, err = run(*command, "--keep-going")
    assert code == 3
    assert (tmp_path / "s.zarr/2/20/zarr.json").is_file()


def test_what_is_sent_of_a_recording_does_not_grow_with_the_session(
    run, make_session, tmp_path, monkeypatch
):
    """Jobs are weighed instead of done."""
    import cloudpickle

    weights = {}

    def weigh(function, jobs, *more):
        weights[len(weights)] = max(len(cloudpickle.dumps((function, *job))) for job in jobs)
        return iter(())

    monkeypatch.setattr(extraction, "on_cluster", weigh)
    for n, textures in enumerate((range(1, 3), range(1, 13))):
        root = make_session(tmp_path / f"s{n}", textures, (20,), seconds=0.3, video=False)
        run("extract", root, tmp_path / f"{n}.zarr", "--cluster", "tcp://x:1", "--quiet")
    assert weights[1] - weights[0] < 100
    assert weights[0] < 20_000


def test_a_video_alone_needs_no_cluster(run, session, tmp_path):
    code, _, err = run(
        "track", Path(session) / "1/20/video.mp4", tmp_path / "t.zarr", "--cluster", "tcp://x:1"
    )
    assert code == 2
    assert "--cluster: expected a session" in err
