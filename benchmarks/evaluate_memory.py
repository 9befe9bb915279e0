"""Peak memory of `evaluate` on a store of the paper's size, 130 recordings of 5000 frames.

Random marker data and sound are written to a store, then the real command runs on it in a
process of its own, for a few folds of each model: its memory peaks while the samples are joined
and in the first fold, and is the same in every other.

    python benchmarks/evaluate_memory.py FOLDER [--models sa-se,sa-ste] [--folds 2]
"""

import argparse
import os
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


def peak_gb(process: subprocess.Popen[bytes]) -> float:
    """Return the largest resident memory of a process so far (Linux), 0 once it has ended."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    _, found, rest = status.partition("VmHWM:")
    return int(rest.split()[0]) * 1024 / 1e9 if found else 0.0


def main() -> None:
    """Run the command until enough folds are finished; print its peak memory."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--models", default="sa-se,sa-ste")
    parser.add_argument("--folds", type=int, default=2, help="stop after so many folds a model")
    arguments = parser.parse_args()
    store = arguments.folder / "random.zarr"
    write_store(store)
    for model in arguments.models.split(","):
        results = arguments.folder / f"results-{model}-{os.getpid()}"
        command = ["evaluate", str(store), "--out", str(results), "--models", model, "--quiet"]
        start = "import sys; from afferents.cli import main; main()"
        with subprocess.Popen([sys.executable, "-c", start, *command]) as process:
            peak = 0.0
            while process.poll() is None:
                peak = max(peak, peak_gb(process))
                if len(list(results.glob("folds/*/*/*/*/fold.json"))) >= arguments.folds:
                    process.terminate()
                time.sleep(0.5)
        print(f"{model}: peak {peak:.2f} GB over {arguments.folds} folds", flush=True)


if __name__ == "__main__":
    main()
