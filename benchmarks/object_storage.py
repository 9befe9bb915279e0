"""Responses in object storage: objects and times with a group a recording, an array, a sharded one.

A server that speaks S3 runs on this machine (moto's, in memory), and zarr writes to it and reads
from it through fsspec. Its times say nothing of a real one's, but for how they compare: each
object costs a request. Packages that this project does not need: `pip install 'moto[server]' s3fs`.

    python benchmarks/object_storage.py STORE [--recordings 50]
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import s3fs
import xarray as xr
import zarr
from zarr.storage import FsspecStore

from afferents.store.zarr_store import open_responses

PORT, BUCKET = 15555, "afferents"
OPTIONS = {
    "key": "any",
    "secret": "any",
    "client_kwargs": {"endpoint_url": f"http://127.0.0.1:{PORT}"},
}


def place(name: str) -> FsspecStore:
    """Return a place in the bucket, to be written or read."""
    return FsspecStore.from_url(f"s3://{BUCKET}/{name}", storage_options=OPTIONS)


def seconds(work: Callable[[], object]) -> float:
    """Return how long something takes."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def write_groups(name: str, recordings: list[xr.Dataset]) -> None:
    """Write a group a recording, as `extract` does on a disk."""
    store = place(name)
    for recording in recordings:
        plain = recording[["sa1"]].drop_encoding()
        plain = plain.drop_vars(list(plain.coords))
        plain.to_zarr(store, group=recording.attrs["name"], zarr_format=3, consolidated=False)


def read_groups(name: str, recordings: list[xr.Dataset]) -> None:
    """Read SA-I of every recording."""
    for recording in recordings:
        group = recording.attrs["name"]
        xr.open_zarr(place(name), group=group, consolidated=False)["sa1"].load()


def write_array(name: str, values: np.ndarray, a_shard: int | None) -> None:
    """Write SA-I of all recordings as one array, a chunk a recording, many chunks a shard."""
    one = (1, *values.shape[1:])
    array: Any = zarr.create_array(
        place(name),
        shape=values.shape,
        dtype=values.dtype,
        chunks=one,
        shards=(a_shard, *one[1:]) if a_shard else None,
        dimension_names=("recording", "time", "marker"),
    )
    array[:] = values


def row(
    how: str,
    name: str,
    write: Callable[[], object],
    read: Callable[[], object],
    read_one: Callable[[], object],
) -> None:
    """Print what a layout costs."""
    times = [seconds(work) for work in (write, read, read_one)]
    files = s3fs.S3FileSystem(**OPTIONS, skip_instance_cache=True).find(f"{BUCKET}/{name}")
    said = " | ".join(f"{value:.2f}" for value in times)
    print(f"| {how} | {len(files)} | {said} |", flush=True)


def groups_row(name: str, recordings: list[xr.Dataset]) -> None:
    """Print what a group a recording costs."""
    row(
        "a group a recording",
        name,
        lambda: write_groups(name, recordings),
        lambda: read_groups(name, recordings),
        lambda: read_groups(name, recordings[-1:]),
    )


def array_row(how: str, name: str, values: np.ndarray, a_shard: int | None) -> None:
    """Print what one array of all recordings costs."""

    def read(which: slice) -> None:
        found = zarr.open_array(place(name), mode="r")[which]
        np.testing.assert_array_equal(found, values[which])

    row(
        how,
        name,
        lambda: write_array(name, values, a_shard),
        lambda: read(slice(None)),
        lambda: read(slice(-1, None)),
    )


def main() -> None:
    """Write and read the layouts; rows of a table in Markdown."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("store", type=Path)
    parser.add_argument("--recordings", type=int, default=50)
    arguments = parser.parse_args()
    recordings = [r.load() for r in open_responses(arguments.store)[: arguments.recordings]]
    frames = min(r.sizes["time"] for r in recordings)
    values = np.stack([r["sa1"].values[:frames] for r in recordings])
    server = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(PORT)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(server, **quiet) as running:
        try:
            wait_for_server()
            s3fs.S3FileSystem(**OPTIONS).mkdir(BUCKET)
            print(f"{len(recordings)} recordings, {values.nbytes / 1e6:.1f} MB of SA-I\n")
            print(
                "| layout | objects | write, s | read all, s | read one, s |\n|---|---|---|---|---|"
            )
            groups_row("groups", recordings)
            array_row("one array, a chunk a recording", "chunks", values, None)
            array_row("the same in shards of 25 chunks", "shards", values, 25)
        finally:
            running.terminate()


def wait_for_server() -> None:
    """Wait until the server answers, half a minute at most."""
    for _ in range(300):
        with suppress(OSError), closing(urlopen(f"http://127.0.0.1:{PORT}", timeout=5)):
            return
        time.sleep(0.1)
    raise SystemExit("no server")


if __name__ == "__main__":
    main()
