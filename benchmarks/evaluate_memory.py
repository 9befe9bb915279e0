"""Peak memory of `evaluate` on a store of the paper's size, 130 recordings of 5000 frames.

Random marker data and sound are written to a store, then the real command runs on it in a
process of its own, whose peak resident memory the operating system tells at its end.

    python benchmarks/evaluate_memory.py FOLDER [MODELS]
"""

import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import xarray as xr

from afferents.core.recording import Recording
from afferents.core.responses import label
from afferents.core.store import create_store, has_responses, write_responses

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
    return label(responses, recording).assign_attrs(checksum="random")


def write_store(store: Path) -> None:
    """Write what is not there yet."""
    create_store(store, {"simulated": True, "random": True})
    for i, texture in enumerate(TEXTURES):
        for speed in SPEEDS:
            if not has_responses(store, f"{texture}/{speed}", "random"):
                rng = np.random.default_rng([i, speed])
                write_responses(store, random_responses(texture, speed, rng))


def main(folder: Path, models: str) -> None:
    """Print the command, its time and its peak memory."""
    store = folder / "random.zarr"
    write_store(store)
    results = folder / f"results-{models}-{os.getpid()}"
    command = ["afferents", "evaluate", str(store), "--out", str(results), "--models", models]
    start = time.perf_counter()
    subprocess.run([sys.executable, "-c", "from afferents.cli import main; main()", *command[1:]],
                   check=True)  # fmt: skip
    peak_gb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024 / 1e9
    print(f"{models}: peak {peak_gb:.2f} GB, {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "all")
