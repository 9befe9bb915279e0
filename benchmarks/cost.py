"""What the paper's experiment costs at its full size, estimated from rates measured here.

130 recordings of 65 s are followed by the published tracker, and the six models of Table 1 train
with `paper`, `published`, in float32: the machinery of `afferents reproduce --estimate`, told for
several machines. A short recording of the simulated rig stands in for the real ones; nothing is
trained to its end. Prints a table in Markdown; takes minutes of processor time.

    python benchmarks/cost.py
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from training_speed import machine

import afferents
from afferents import dims
from afferents.encodings.settings import Encodings
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import Recipe
from afferents.folds.protocol import PROTOCOLS
from afferents.markers.sensor import sensors_of
from afferents.models.model import TABLE1
from afferents.recordings.session import read_session
from afferents.reporting.published import published_costs
from afferents.reproduction.estimate import Estimate, time_fold, track_first_frames
from afferents.reproduction.run_folder import duration

RECORDINGS, FRAMES, AUDIO_S, SPEEDS = 130, 5850, 65, 10
PROCESSES = (2, 16, 20)


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "s"
        afferents.simulate(root, textures="g", speeds_mm_s=[50], seconds=8, workers=1, quiet=True)
        session = read_session(root)
        first, sensors = session.recordings[0], sensors_of(session, None)
        responses, frame_s = track_first_frames(first, sensors, "published")
    responses = at_full_length(responses)
    options = EvaluationOptions(
        preset="paper", cut="published", statistics="keras", device="cpu", precision="float32"
    )
    recipe = Recipe(Path("none"), (), list(TABLE1.values()), Encodings(), options)
    shares, protocol = (RECORDINGS, SPEEDS), PROTOCOLS["published"]
    works = tuple(
        time_fold(model, protocol, responses, recipe, shares, SPEEDS) for model in recipe.models
    )
    whole = Estimate(RECORDINGS, RECORDINGS * FRAMES, frame_s, works)
    print(f"{machine()}\n")
    print("| | one fold | epochs | two cores | 16 cores | 20 cores | authors' GPU |")
    print("|---|---|---|---|---|---|---|")
    row("tracking", replace(whole, trainings=()))
    gpu_s = {name: cost.seconds for name, cost in published_costs().items()}
    for work in works:
        alone = replace(whole, frames=0, trainings=(work,))
        row(TABLE1[work.model].title, alone, work.fold_s, work.epochs, gpu_s[work.model])
    row("all six", replace(whole, frames=0), gpu_s=sum(gpu_s.values()))
    row("with tracking", whole)


def at_full_length(responses: xr.Dataset) -> xr.Dataset:
    """Return responses repeated to the length of the paper's recordings."""
    times = np.arange(FRAMES) % responses.sizes[dims.TIME]
    rate = responses[dims.RA2].attrs[dims.SAMPLE_RATE]
    sound = np.arange(round(AUDIO_S * rate)) % responses.sizes[dims.AUDIO_TIME]
    longer = responses.isel({dims.TIME: times, dims.AUDIO_TIME: sound})
    return longer.assign_coords({dims.TIME: np.arange(FRAMES) / 90})


def row(
    title: str,
    estimate: Estimate,
    fold_s: float | None = None,
    epochs: float | None = None,
    gpu_s: float | None = None,
) -> None:
    """Print what something takes on several machines."""
    times = [replace(estimate, processes=n).total_s for n in PROCESSES]
    told = [duration(s) if s else "" for s in (fold_s, *times, gpu_s)]
    told.insert(1, f"{epochs:.0f}" if epochs else "")
    print(f"| {title} | {' | '.join(told)} |")


if __name__ == "__main__":
    main()
