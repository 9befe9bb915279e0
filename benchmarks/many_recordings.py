"""Many recordings: each stage's time and memory in one process and on a Dask cluster, as they grow.

Sessions of the simulated rig, each recording of its own draws, with one second of steady slide
(and the 1.5 s before it, in which the drum is brought on and runs up). The largest session is
simulated; the smaller ones are parts of it. The real commands take each through `extract`,
`evaluate` (a solved model, three speeds held out) and `report`, once in one process and once on a
cluster: a `dask scheduler` and a `dask worker` a core, over TCP. Both must come to the same store,
byte for byte, and to the same predictions. Linux, with iproute2's `ss`.

    python benchmarks/many_recordings.py FOLDER [--recordings 100,400,2000] [--ways cluster,one]
"""

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import psutil

from afferents.recordings.session_file import SESSION_FILE

MOST, SPEEDS = 2000, 50
"""Recordings of the largest session, and the speeds of each of its textures."""
SECONDS = "2.5"
PORT = int(os.environ.get("PORT", "18786"))
_PYTHON = [sys.executable, "-m"]


class Cost(NamedTuple):
    """What a command took: s of a clock, s of processors, MB at most, MB through the scheduler."""

    wall_s: float
    caller_cpu_s: float
    caller_mb: float
    scheduler_cpu_s: float
    scheduler_mb: float
    workers_cpu_s: float
    worker_mb: float
    sent_mb: float


class Cluster(NamedTuple):
    """Processes of a cluster, by their numbers."""

    scheduler: int
    workers: list[int]


@contextmanager
def running_cluster(workers: int) -> Iterator[Cluster]:
    """Run a scheduler and workers of one thread each on this machine."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    address, no_page = f"tcp://127.0.0.1:{PORT}", "--no-dashboard"
    places = ["--host", "127.0.0.1", "--port", str(PORT), no_page]
    commands = [["scheduler", *places]]
    # Without a nanny, so that a worker is one process; a real one keeps it, and is begun anew.
    commands += [["worker", address, "--nthreads", "1", "--no-nanny", no_page]] * workers
    begun = [subprocess.Popen([*_PYTHON, "dask", *command], **quiet) for command in commands]
    try:
        time.sleep(15)
        yield Cluster(begun[0].pid, [worker.pid for worker in begun[1:]])
    finally:
        for process in reversed(begun):
            process.terminate()
            process.wait()


def measured(arguments: list[str], cluster: Cluster | None) -> Cost:
    """Run a command to its end and watch what it takes."""
    others = [cluster.scheduler, *cluster.workers] if cluster else []
    for pid in others:
        Path(f"/proc/{pid}/clear_refs").write_text("5")  # forgets the peak so far
    before = [cpu_s(pid) for pid in others]
    sent_before = sent_by_connection() if cluster else {}
    peak_mb, sent = 0.0, dict(sent_before)
    began = time.perf_counter()
    with subprocess.Popen(
        [*_PYTHON, "afferents", *arguments, "--quiet"], stdout=subprocess.DEVNULL
    ) as run:
        while os.waitid(os.P_PID, run.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
            peak_mb = max(peak_mb, most_mb(run.pid))
            if cluster:
                sent |= sent_by_connection()
            time.sleep(0.1)
        wall_s, caller_cpu_s = time.perf_counter() - began, cpu_s(run.pid)
    if run.returncode:
        raise SystemExit(f"{' '.join(arguments)} ended with {run.returncode}")
    took = [cpu_s(pid) - earlier for pid, earlier in zip(others, before, strict=True)] or [0.0]
    most = [most_mb(pid) for pid in others] or [0.0]
    return Cost(
        wall_s,
        caller_cpu_s,
        peak_mb,
        took[0],
        most[0],
        sum(took[1:]),
        max(most[1:], default=0.0),
        (sum(sent.values()) - sum(sent_before.values())) / 1e6,
    )


def cpu_s(pid: int) -> float:
    """Return the processor's time of a process, also of one that has ended and is not reaped."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def most_mb(pid: int) -> float:
    """Return the peak of a process's resident memory; 0 of one that has ended."""
    with suppress(OSError, psutil.NoSuchProcess):
        found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
        return int(found[1]) * 1024 / 1e6 if found else 0.0
    return 0.0


def sent_by_connection() -> dict[str, int]:
    """Return the bytes that the scheduler has received and sent, by connection (iproute2's ss)."""
    said = subprocess.run(
        ["ss", "-tinH", "state", "established", f"( sport = :{PORT} )"],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    lines = said.splitlines()
    return {
        peer.split()[-1]: sum(map(int, re.findall(r"bytes_(?:sent|received):(\d+)", counts)))
        for peer, counts in zip(lines[::2], lines[1::2], strict=False)
    }


def grid(recordings: int) -> tuple[list[str], list[str]]:
    """Return bump spacings, mm, and speeds, mm/s; smaller sessions have fewer textures."""
    textures = [f"{1 + i / 10:g}" for i in range(recordings // SPEEDS)]
    return textures, [f"{10 + i * 1.8:g}" for i in range(SPEEDS)]


def link_part(whole: Path, part: Path, recordings: int) -> None:
    """Make a session of some of another's recordings, which take no room of their own."""
    content = json.loads((whole / SESSION_FILE).read_text())
    textures, speeds = grid(recordings)
    names = [f"{texture}/{speed}" for texture in textures for speed in speeds]
    for name in names:
        (part / name).mkdir(parents=True)
        for file in (whole / name).iterdir():
            (part / name / file.name).hardlink_to(file)
    for entry in {"runs", "checksums"} & set(content):
        content[entry] = {name: content[entry][name] for name in names}
    (part / SESSION_FILE).write_text(json.dumps({**content, "textures": textures}))


def digest_of(folder: Path) -> str:
    """Return what tells all files of a folder from others'."""
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        digest.update(f"{path.relative_to(folder)}\n".encode() + path.read_bytes())
    return digest.hexdigest()


def size_mb(folder: Path) -> float:
    """Return what the files of a folder hold."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


def told(recordings: int, stage: str, way: str, cost: Cost) -> None:
    """Print a row of the table."""
    load = os.getloadavg()[0]
    numbers = " | ".join(f"{value:.1f}" for value in cost)
    print(f"| {recordings} | {stage} | {way} | {numbers} | {load:.1f} |", flush=True)


def go_through(folder: Path, recordings: int, way: str, models: str, workers: int) -> None:
    """Take so many recordings through all stages."""
    session = folder / f"session-{recordings}"
    _, speeds = grid(recordings)
    held_out = ",".join(speeds[round(len(speeds) * share)] for share in (0.25, 0.5, 0.75))
    store, results = (folder / f"{way}-{recordings}{end}" for end in (".zarr", "-results"))
    with running_cluster(workers) if way == "cluster" else nullcontext() as cluster:
        where = ["--cluster", f"tcp://127.0.0.1:{PORT}"] if cluster else ["--workers", "1"]
        cost = measured(["extract", str(session), str(store), *where], cluster)
        told(recordings, "extract", way, cost)
        command = ["evaluate", str(store), "--out", str(results), "--models", models]
        cost = measured([*command, "--held-out", held_out, *where], cluster)
        told(recordings, "evaluate", way, cost)
    told(recordings, "report", way, measured(["report", str(results)], None))


def simulate(session: Path, workers: int) -> None:
    """Simulate the largest session on a cluster, or go on with it."""
    textures, speeds = grid(MOST)
    words = ["--textures", ",".join(textures), "--speeds", ",".join(speeds), "--seconds", SECONDS]
    where = ["--cluster", f"tcp://127.0.0.1:{PORT}"]
    with running_cluster(workers) as cluster:
        cost = measured(["simulate", str(session), *words, *where], cluster)
    told(MOST, "simulate", "cluster", cost)


def compare(folder: Path, recordings: int) -> None:
    """Say whether both ways came to the same, and how large it is."""
    stores = {digest_of(folder / f"{way}-{recordings}.zarr") for way in ("one", "cluster")}
    one, other = (
        pd.read_parquet(folder / f"{way}-{recordings}-results" / "predictions.parquet")
        for way in ("one", "cluster")
    )
    pd.testing.assert_frame_equal(one, other, rtol=1e-5)
    names = (f"session-{recordings}", f"one-{recordings}.zarr", f"one-{recordings}-results")
    sizes = [size_mb(folder / name) for name in names]
    print(
        f"{recordings}: stores {'of the same bytes' if len(stores) == 1 else 'THAT DIFFER'}, "
        f"{len(one)} predictions alike; session, store, results: "
        + ", ".join(f"{size:.1f} MB" for size in sizes),
        flush=True,
    )


def main() -> None:
    """Measure each number of recordings; rows of a table in Markdown."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--recordings", default="100,400,2000")
    parser.add_argument("--ways", default="cluster,one")
    parser.add_argument("--no-simulate", action="store_true", help="take what is there")
    parser.add_argument("--models", default="ra-wave-vector")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    fields = " | ".join(field.replace("_", " ") for field in Cost._fields)
    print(f"| recordings | stage | way | {fields} | load |\n{'|---' * (len(Cost._fields) + 4)}|")
    whole = arguments.folder / f"session-{MOST}"
    if not arguments.no_simulate:
        simulate(whole, arguments.workers)
    for recordings in (int(number) for number in arguments.recordings.split(",") if number):
        part = arguments.folder / f"session-{recordings}"
        if not part.exists():
            link_part(whole, part, recordings)
        ways = arguments.ways.split(",")
        for way in ways:
            go_through(arguments.folder, recordings, way, arguments.models, arguments.workers)
        if len(ways) == 2:
            compare(arguments.folder, recordings)


if __name__ == "__main__":
    main()
