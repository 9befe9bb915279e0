"""How long spikes of a long recording take: 361 SA and 361 RA units and 8 PC units, 65 s.

    python benchmarks/spikes.py

Prints seconds of one core for each model of a unit, median of five, and how much faster than the
recording that is. The responses are made: displacement and its change at random about the simulated
rig's means, a tone with noise.
"""

import statistics
import time

import numpy as np
import xarray as xr

from afferents.spikes.artificial import artificial_spikes
from afferents.spikes.units import UNIT_MODELS

SECONDS, FPS, RATE_HZ, MARKERS = 65, 90, 44_100, 361


def made() -> xr.Dataset:
    """Return responses of the published form and length."""
    rng = np.random.default_rng(0)
    time_s = np.arange(SECONDS * FPS) / FPS
    t = np.arange(SECONDS * RATE_HZ) / RATE_HZ
    sound = 0.02 * np.sin(2 * np.pi * 70 * t) + 0.001 * rng.standard_normal(len(t))
    shape = (len(time_s), MARKERS)
    variables = {
        "sa1": (("time", "marker"), rng.gamma(4, 0.4, shape).astype(np.float32)),
        "ra1": (("time", "marker"), rng.gamma(2, 0.07, shape).astype(np.float32)),
        "ra2": (
            ("audio_time", "channel"),
            sound.astype(np.float32)[:, None],
            {"sample_rate_hz": float(RATE_HZ)},
        ),
    }
    attrs = {"name": "made", "texture": "0", "speed_mm_s": 50.0, "steady_s": "null"}
    return xr.Dataset(variables, {"time": time_s}, attrs=attrs)


def main() -> None:
    """Print the table."""
    recording = made()
    for model in UNIT_MODELS:
        artificial_spikes([recording], model, stop_s=1.0)  # compiled here, not below
        taken = []
        for _ in range(5):
            before = time.process_time()
            spikes = artificial_spikes([recording], model)
            taken.append(time.process_time() - before)
        seconds = statistics.median(taken)
        rate = len(spikes.times) / SECONDS / spikes.n_units
        faster = f"{SECONDS / seconds:.0f} times real time"
        print(f"{model}: {seconds:.2f} s, {faster} ({rate:.0f} spikes/s a unit)")


if __name__ == "__main__":
    main()
