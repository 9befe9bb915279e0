"""Small models of the simulated rig, for a first look at feeling live."""

from pathlib import Path

from afferents.core.card import Card
from afferents.core.model import BEST, MODELS
from afferents.core.progress import Progress
from afferents.core.store import open_responses
from afferents.markers import load_sensor
from afferents.pipeline.data import open_data
from afferents.pipeline.export import export_model
from afferents.pipeline.extract import Extraction, extract
from afferents.pipeline.simulate import simulate_session, simulation_of
from afferents.pipeline.train import Training, train

DEMO_STORE = Path("out/demo/session.zarr")
"""Where `afferents reproduce` leaves the demo's responses."""


def demo_models(folder: Path, progress: Progress, demo: Path = DEMO_STORE) -> list[Path]:
    """Return exported models of the simulated rig; kept where both are there.

    Parameters
    ----------
    folder
        Where they are, or are to be.
    demo
        A store to learn from, if it is there; else a small session is simulated.
    """
    exported = [folder / f"{name}.onnx" for name in BEST]
    if all(path.is_file() for path in exported):
        return exported
    store = demo if demo.is_dir() and open_responses(demo) else _simulated(folder, progress)
    data = open_data([str(store)], progress=progress)
    for name, path in zip(BEST, exported, strict=True):
        progress.note(f"training {MODELS[name].title} on {store}")
        training = Training(data, MODELS[name], "fast", "all", data[0].encodings)
        card: Card = train(training, folder / name, progress, force=True)
        export_model(folder / name, path, force=True)
        for sentence in card.said():
            progress.note(sentence)
    return exported


def _simulated(folder: Path, progress: Progress) -> Path:
    simulation = simulation_of(folder / "session", "quick")
    simulate_session(simulation, None, progress)
    store = folder / "session.zarr"
    extract(Extraction(folder / "session", store, load_sensor("tip_b"), "windowed"), progress)
    return store
