"""Textures slid at speeds that change within a slide: what being told the speed is worth.

    python studies/swept.py --out OUT [--seeds 5] [--first 31]

The simulated rig's thirteen drums, without pictures: constant speeds (20, 50, 80 mm/s, three times
each, 8 s) and sweeps (20 to 80 mm/s and back, three times, 24 s), whose poses and forces are kept
as an arm's would be. A repetition is held out, then bands of speed and of force. A seed prints
other drums. Writes `studies/data/swept.json`, from which the table in `studies/models.md` is
drawn.
"""

import argparse
import json
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import here
import make_results
import numpy as np
import results_pages as pages
import xarray as xr
from scipy.signal import resample_poly

import afferents
from afferents.errors import InputError
from afferents.evaluation.results import Results
from afferents.extraction.extract import marker_responses
from afferents.parallel import side_by_side_numbered
from afferents.progress import Progress
from afferents.recordings.tactile_bench import LOGS
from afferents.rig import STEADY_S, Rig, bumped_surface, project
from afferents.rig.run import Simulated, simulate_run
from afferents.rig.simulation import Simulation
from afferents.store.log import LoggedFile
from afferents.store.motion import add_motion
from afferents.store.recording import LETTERS, name_folder

SPEEDS_MM_S, SWEEP, TIMES = (20.0, 50.0, 80.0), (20.0, 80.0, False), 3
CONSTANT_S, SWEPT_S = 8.0 + STEADY_S, 24.0 + STEADY_S
DOWN = 20
"""Of 44.1 kHz one sample in so many is kept: 1100 Hz is half that rate."""
NOISE_PX = 0.05
TOLD, UNTOLD, SEEN = "order-te-speed-known", "order-te", "sa-wave-vector"
LONG = {"window_s": 2.0, "stride_s": 1.0}
SHORT = {"window_s": 0.5, "stride_s": 0.25}
REPETITION = {"split": "repetition", "models": [TOLD, UNTOLD], **LONG}
SPEED = {"split": "speed", "bands": [35, 65], **SHORT}
FORCE = {"split": "force", "bands": [0.03, 0.045], **SHORT}
"""N. Drums that are never pressed so hard, or so lightly, are left out: at one depth the force on
the smooth drum is several times that on bumps 3 mm apart."""
ROWS: dict[str, tuple[str, dict[str, Any]]] = {
    "constant speeds, a repetition held out": ("constant", REPETITION),
    "swept, a repetition held out": ("swept", REPETITION),
    "the same, not resampled": ("swept", {**REPETITION, "resample": "time"}),
    "swept, a band of speed held out": ("swept", {**SPEED, "models": [TOLD, UNTOLD, SEEN]}),
    "the same bands, not resampled": (
        "swept", {**SPEED, "models": [TOLD, UNTOLD], "resample": "time"},
    ),
    "swept, a band of force held out": ("swept", {**FORCE, "models": [TOLD, UNTOLD, SEEN]}),
}  # fmt: skip


def responses_of(rig: Rig, run: Simulated, attrs: dict[str, Any]) -> xr.Dataset:
    """Return what `extract` would make of a run, its pins seen with noise."""
    seen = project(run.position_mm, rig.camera)
    seen = seen + np.random.default_rng(attrs["number"]).normal(0, NOISE_PX, seen.shape)
    side = round(np.sqrt(seen.shape[1]))
    row, column = np.divmod(np.arange(seen.shape[1]), side)
    tracks = xr.Dataset(
        {
            "position": (("time", "marker", "space"), seen.astype(np.float32)),
            "rest_position": (("marker", "space"), seen[5:30].mean(axis=0).astype(np.float32)),
            "detected": (("time", "marker"), np.ones(seen.shape[:2], bool)),
            "ra2": (
                ("audio_time", "channel"),
                resample_poly(run.sensor, 1, DOWN)[:, None].astype(np.float32),
                {"sample_rate_hz": 44_100 / DOWN, "units": "full scale"},
            ),
        },
        {"time": run.time_s, "space": ["x", "y"], "row": ("marker", row),
         "column": ("marker", column)},
        attrs,
    )  # fmt: skip
    found = marker_responses(tracks)
    logs = []
    for log, rows in zip(LOGS, run.arm or (), strict=False):
        name, columns = log["name"], log["columns"]
        values = rows[:, 1 : 1 + len(columns)].astype(np.float32)
        coords = {f"{name}_time": rows[:, 0], f"{name}_axis": columns}
        found[name] = xr.DataArray(values, coords, dims=(f"{name}_time", f"{name}_axis"))
        logs.append(LoggedFile(name, Path(log["file"]), "timestamp", tuple(columns), log["units"]))
    return add_motion(found, logs)


def simulated(seed: int, texture: str) -> tuple[list[xr.Dataset], list[xr.Dataset]]:
    """Return a drum's slides at constant speeds, and its sweeps."""
    rig = Rig().printed(seed)
    surface = bumped_surface(float(texture), rig.drum)
    of = Simulation(
        session=Path(), textures=(texture,), speeds_mm_s=(50.0,), seconds=SWEPT_S, seed=seed,
        rig=rig, sweep=SWEEP, repetitions=TIMES,
    )  # fmt: skip
    found: tuple[list[xr.Dataset], list[xr.Dataset]] = ([], [])
    runs = [(speed, again) for speed in (None, *SPEEDS_MM_S) for again in range(TIMES)]
    for number, (speed, again) in enumerate(runs):
        seconds = SWEPT_S if speed is None else CONSTANT_S
        slide = of.slide(again + 1) if speed is None else None
        run = simulate_run(rig, texture, surface, speed or 50.0, seconds, seed, again + 1, slide)
        attrs = {
            "name": f"{texture}/{speed or 'sweep'}/{again + 1}", "texture": texture,
            "speed_mm_s": np.nan if speed is None else speed, "number": number,
            "steady_s": json.dumps([STEADY_S, seconds]),
            "conditions": json.dumps({"repetition": str(again + 1)}),
        }  # fmt: skip
        found[speed is None].append(responses_of(rig, run, attrs))
    return found


class Slides(afferents.DataSet):
    """Slides that were simulated already."""

    name, title = "slides", "slides on the rig"

    def __init__(self, path: str, responses: Sequence[xr.Dataset]) -> None:
        super().__init__(path)
        self.recordings = responses

    def scan(self) -> Any:
        """Refuse: there are no files."""
        raise NotImplementedError

    def responses(self) -> Sequence[xr.Dataset]:
        """Return them."""
        return self.recordings


def evaluated(slides: Slides, out: Path, options: dict[str, Any]) -> Results:
    """Return results of the drums that have samples in every group."""
    left = [name_folder(letter) for letter in LETTERS]
    while True:
        try:
            return afferents.evaluate(
                slides, out, workers=1, quiet=True, **options,
                textures=left if len(left) < len(LETTERS) else (),
            )  # fmt: skip
        except InputError as error:
            lone = re.search(r"found none of (\S+) in force", str(error))
            if lone is None:
                raise
            left.remove(lone[1])
            shutil.rmtree(out)


def measure(seed: int, out: Path) -> dict[str, dict[str, float]]:
    """Return the accuracy of each model in each row, percent."""
    jobs = [(seed, name_folder(letter)) for letter in LETTERS]
    found_of = dict(side_by_side_numbered(simulated, jobs, None, Progress(quiet=True).note))
    each = [found_of[number] for number in range(len(jobs))]
    by_kind = {
        kind: Slides(kind, [one for drum in each for one in drum[n]])
        for n, kind in enumerate(("constant", "swept"))
    }
    found = {}
    for number, (row, (kind, options)) in enumerate(ROWS.items()):
        results = evaluated(by_kind[kind], out / f"{seed}-{number}", options)
        of_models = results.summary["models"].items()
        found[row] = {name: 100 * one["nested"]["mean_accuracy"] for name, one in of_models}
        print(seed, row, len(results.textures), "drums", found[row], flush=True)
    return found


def table(each: Sequence[dict[str, dict[str, float]]]) -> Iterator[list[str]]:
    """Yield the rows of the table: mean and 95% interval over seeds."""
    yield ["", "told the speed", "not told", "`sa-wave-vector`"]
    for row in ROWS:
        cells = [row]
        for model in (TOLD, UNTOLD, SEEN):
            values = [one[row][model] for one in each if model in one[row]]
            cells.append(make_results.interval(values) if values else "–")
        yield cells


def main() -> None:
    """Simulate, evaluate, and write the table's data."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=31)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    each = []
    for seed in range(given.first, given.first + given.seeds):
        kept = given.out / f"{seed}.json"
        if not kept.is_file():
            kept.write_text(json.dumps(measure(seed, given.out)))
        each.append(json.loads(kept.read_text()))
    head, *rows = table(each)
    command = f"python studies/swept.py --out OUT --seeds {given.seeds}"
    source = pages.source([command])
    pages.write_json(
        here.DATA / "swept.json", {"title": "Slides whose speed changes", **source,
                                    "columns": head, "rows": rows},
    )  # fmt: skip
    print(pages.table(head, rows))


if __name__ == "__main__":
    main()
