"""Sound against picture from taps, against what the simulated microphone was given.

    python benchmarks/taps.py [RUNS]

Runs are recorded on simulated devices, in their own time, each with taps of other depths and
widths. The offset of the microphone is another in each quarter of them.
"""

import argparse
import json
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from afferents.lab.devices import Block
from afferents.lab.recorder.plan import read_plan
from afferents.lab.recorder.record import Recorder
from afferents.lab.recorder.rehearsal import Bench, SimulatedMicrophone, simulate_devices
from afferents.markers.sensor import load_sensor
from afferents.progress import Progress
from afferents.rig import Rig
from afferents.rig.microphone import RigMicrophone

OFFSETS_MS = (-60.0, -15.0, 20.0, 45.0)
GAIN = 0.05
"""Full scale a mN/s: turned down, so that the hardest taps are not clipped."""
PLAN = """
textures = ["4"]
speeds_mm_s = {speeds}
seconds = 0.2
tap_s = 2.0
redo = 0
seed = {seed}
[tolerance]
speed = 1.0
lost = 0.2
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""


def main() -> None:
    """Record, and print how far the offsets were off."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs="?", type=int, default=32)
    n = parser.parse_args().runs
    off: list[float] = []
    said: list[float] = []
    for seed, offset_ms in enumerate(OFFSETS_MS):
        speeds = [60 + k for k in range(seed, n, len(OFFSETS_MS))]
        for found in offsets(PLAN.format(speeds=speeds, seed=seed), offset_ms):
            off.append(1000 * found["seconds"] - offset_ms)
            said.append(1000 * found["error_s"])
            print(f"given {offset_ms:+.1f} ms, off by {off[-1]:+.2f} ms", flush=True)
    print(
        f"{len(off)} of {n} runs accepted; off by {np.mean(off):+.2f} ms in the mean, spread "
        f"{np.std(off):.2f} ms, rms {np.sqrt(np.mean(np.square(off))):.2f} ms, at most "
        f"{np.abs(off).max():.2f} ms; uncertainty written {np.mean(said):.1f} ms"
    )


class Ahead(SimulatedMicrophone):
    """A microphone whose clock is ahead of the camera's."""

    def __init__(self, bench: Bench, offset_ms: float) -> None:
        """Stand on the bench."""
        super().__init__(bench)
        self._offset_s = offset_ms / 1000

    def blocks(self) -> Iterator[Block]:
        """Yield the sound of the drum that is mounted."""
        for block in super().blocks():
            yield block._replace(time_s=block.time_s + self._offset_s)


def offsets(text: str, offset_ms: float) -> list[dict[str, float]]:
    """Record a plan and return the offset of each run that was accepted."""
    with tempfile.TemporaryDirectory() as place, Progress(quiet=True) as progress:
        path = Path(place, "PLAN.toml")
        path.write_text(text)
        plan = read_plan(path)
        bench = Bench(Rig(microphone=RigMicrophone(gain_per_mn_s=GAIN)), plan, speed=1)
        devices = simulate_devices(plan, path, bench)
        devices = replace(devices, microphone=Ahead(bench, offset_ms))
        recorder = Recorder(plan, path, load_sensor("tip_b"), devices, bench=bench)
        outcome = recorder.record(Path(place, "S"), progress)
        for run, why in outcome.kept_aside.items():
            print(f"{run}: {why}")
        runs = json.loads(Path(place, "S", "session.json").read_text())["runs"]
        return [run["audio_offset"] for run in runs.values()]


if __name__ == "__main__":
    main()
