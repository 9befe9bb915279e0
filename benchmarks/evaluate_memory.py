"""Time and peak memory of `evaluate` on a store of the paper's size, 130 recordings of 5000 frames.

Random marker data and sound are written to a store, then the real command runs on it with its
worker processes, two held-out speeds for each model: memory peaks while the samples are joined and
in the first folds, and is the same in all others, but for the table of all folds at the end, which
is smaller; so is the time of `fast`, which always goes as many epochs.

    python benchmarks/evaluate_memory.py FOLDER [--models sa-se,sa-ste] [--held-out 40,60]
"""

import argparse
import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil
import xarray as xr

from afferents.models.model import TABLE1
from afferents.store.recording import Recording
from afferents.store.responses import label
from afferents.store.zarr_store import create_store, is_whole, write_responses

TEXTURES, SPEEDS = [f"{x / 2:g}" for x in range(13)], range(10, 101, 10)
FRAMES, MARKERS, FPS_HZ, RATE_HZ = 5000, 361, 90.0, 44100
SECONDS = FRAMES / FPS_HZ


def random_responses(texture: str, speed: int, rng: np.random.Generator) -> xr.Dataset:
    """Return responses of one recording of the paper's size, all of it noise."""
    shape = (FRAMES, MARKERS)
    places = np.arange(MARKERS)
    responses = xr.Dataset(
        {
            "sa1": (("time", "marker"), rng.random(shape, dtype=np.float32)),
            "ra1": (("time", "marker"), rng.random(shape, dtype=np.float32)),
            "ra2": (
                ("audio_time", "channel"),
                rng.normal(size=(round(SECONDS * RATE_HZ), 1)).astype(np.float32),
                {"sample_rate_hz": float(RATE_HZ)},
            ),
        },
        coords={
            "time": np.arange(FRAMES) / FPS_HZ,
            "row": ("marker", places // 19),
            "column": ("marker", places % 19),
        },
    )
    name = f"{texture}/{speed}"
    recording = Recording(name, texture, float(speed), Path(name), steady_s=(0.0, SECONDS))
    return label(responses, recording).assign_attrs(checksum=f"random {name}")


def write_store(store: Path) -> None:
    """Write what is not there yet."""
    names = [f"{texture}/{speed}" for texture in TEXTURES for speed in SPEEDS]
    create_store(store, {"recordings": names, "simulated": True, "random": True})
    for i, texture in enumerate(TEXTURES):
        for speed in SPEEDS:
            name = f"{texture}/{speed}"
            if not is_whole(store, name):
                rng = np.random.default_rng([i, speed])
                write_responses(store, random_responses(texture, speed, rng))


def memory_gb(process: psutil.Process) -> float:
    """Return the memory of a process and all its children; what they share counts once (Linux)."""
    total = 0
    for each in [process, *process.children(recursive=True)]:
        with suppress(psutil.NoSuchProcess):
            total += each.memory_full_info().pss
    return total / 1e9


def main() -> None:
    """Run the command for each model, then print its time and its peak memory."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--models", default=",".join(TABLE1))
    parser.add_argument("--held-out", default="40,60")
    parser.add_argument("--preset", default="fast")
    arguments = parser.parse_args()
    store = arguments.folder / "random.zarr"
    write_store(store)
    print("| model | seconds | peak memory, GB |\n|---|---|---|")
    for model in arguments.models.split(","):
        results = arguments.folder / f"results-{model}-{os.getpid()}"
        command = ["evaluate", str(store), "--out", str(results), "--models", model, "--quiet"]
        command += ["--preset", arguments.preset, "--held-out", arguments.held_out]
        began, peak = time.perf_counter(), 0.0
        with subprocess.Popen([sys.executable, "-m", "afferents", *command]) as run:
            while run.poll() is None:
                with suppress(psutil.NoSuchProcess):
                    peak = max(peak, memory_gb(psutil.Process(run.pid)))
                time.sleep(0.5)
        if run.returncode:
            sys.exit(run.returncode)
        print(f"| {model} | {time.perf_counter() - began:.0f} | {peak:.2f} |", flush=True)


if __name__ == "__main__":
    main()
