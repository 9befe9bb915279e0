"""What the paper's experiment costs at its full size, estimated from rates measured here.

130 recordings of 65 s are followed by the published tracker, and the six models of Table 1 train
with `paper`, `published`, in float32: the machinery of `afferents reproduce --estimate`, told for
several machines. A short recording of the simulated rig stands in for the real ones; nothing is
trained to its end. Prints a table in Markdown; takes a minute of processor time.

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
from afferents.reproduction.estimate import Amount, Estimate, authors_gpu_s, duration
from afferents.reproduction.measure import Trainings, measure_recording

RECORDINGS, FRAMES, AUDIO_S, SPEEDS = 130, 5850, 65, 10
GROUPS = tuple(float(10 * (i + 1)) for i in range(SPEEDS))


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        session = afferents.simulate(
            Path(folder) / "s", textures="g", speeds_mm_s=[50], seconds=8, workers=1, quiet=True
        )
        measured = measure_recording(session.recordings, sensors_of(session, None), "published")
    measured = measured._replace(responses=at_full_length(measured.responses))
    options = EvaluationOptions(
        preset="paper", cut="published", statistics="keras", device="cpu", precision="float32"
    )
    recipe = Recipe(Path("none"), (), list(TABLE1.values()), Encodings(), options)
    trainings = Trainings(recipe, measured, Amount(RECORDINGS, GROUPS, SPEEDS))
    works = trainings.works(recipe.models, [PROTOCOLS["published"]], lambda *_: SPEEDS)
    whole = Estimate(RECORDINGS * FRAMES, measured.frame_s, RECORDINGS, works)
    tracking = replace(whole, works=())
    training = replace(whole, recordings=0)
    print(f"{machine()}\n")
    print("| | one fold | rate | epochs | two cores | 16 cores | cluster of 20 | authors' GPU |")
    print("|---|---|---|---|---|---|---|---|")
    row("tracking", tracking, "", f"{1 / measured.frame_s:.0f} frames/s", "")
    for work in works:
        alone = replace(training, works=(work,))
        rate, epochs = f"{work.learn_hz:,.0f} samples/s", f"{work.epochs:.0f}"
        row(work.model.title, alone, duration(work.fold_s), rate, epochs)
    row("all six", training, "", "", "")
    row("with tracking", whole, "", "", "")


def at_full_length(responses: xr.Dataset) -> xr.Dataset:
    """Return responses repeated to the length of the paper's recordings."""
    times = np.arange(FRAMES) % responses.sizes[dims.TIME]
    rate = responses[dims.RA2].attrs[dims.SAMPLE_RATE]
    sound = np.arange(round(AUDIO_S * rate)) % responses.sizes[dims.AUDIO_TIME]
    longer = responses.isel({dims.TIME: times, dims.AUDIO_TIME: sound})
    return longer.assign_coords({dims.TIME: np.arange(FRAMES) / 90})


def row(title: str, estimate: Estimate, fold: str, rate: str, epochs: str) -> None:
    """Print what something takes on several machines."""
    gpu = authors_gpu_s(estimate) if not estimate.recordings else None
    times = [estimate.here_s(2), estimate.here_s(16), estimate.cluster_s(20)]
    told = " | ".join(duration(seconds) for seconds in times)
    print(f"| {title} | {fold} | {rate} | {epochs} | {told} | {duration(gpu) if gpu else ''} |")


if __name__ == "__main__":
    main()
