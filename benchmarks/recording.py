"""What recording costs: processor share at 90 frames/s, and the delay of a frame to the file.

    python benchmarks/recording.py [SECONDS]

Camera, microphone and drive are simulated, in their own time; their film is drawn before.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from afferents.pipeline.record.bench import Bench
from afferents.pipeline.record.devices import opened, simulated_devices
from afferents.pipeline.record.plan import read_plan
from afferents.pipeline.record.run import Run
from afferents.rig import Rig

PLAN = """
textures = ["4"]
speeds_mm_s = [60]
seconds = {seconds}
[camera]
kind = "simulated"
[microphone]
kind = "simulated"
[drive]
kind = "simulated"
"""


def main() -> None:
    """Record one run and print what it cost."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "PLAN.toml")
        path.write_text(PLAN.format(seconds=float(sys.argv[1]) if len(sys.argv) > 1 else 20.0))
        plan = read_plan(path)
        bench = Bench(Rig(), plan, speed=1)
        bench.mount(plan.entries()[0], 1)
        folder = Path(place, "run")
        folder.mkdir()
        with opened(simulated_devices(plan, path, bench), plan, path) as devices:
            before, begun, begun_s = _kib(), time.process_time(), time.monotonic()
            log = Run(devices, plan, folder, 60.0).make()
            share = (time.process_time() - begun) / (time.monotonic() - begun_s)
        delay = np.array([row.written_s - row.time_s for row in log.frames]) * 1000
        jpeg = np.mean([len(data) for data in bench.film.jpegs]) / 1024
        print(f"{len(log.frames)} frames of {jpeg:.0f} KiB, processor share {share:.1%} of a core")
        print(
            f"delay of a frame to the file: median {np.median(delay):.2f} ms, "
            f"99% {np.quantile(delay, 0.99):.2f} ms, largest {delay.max():.2f} ms"
        )
        print(f"memory grew by {(_kib() - before) / 1024:.1f} MiB")


def _kib() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 1024


if __name__ == "__main__":
    main()
