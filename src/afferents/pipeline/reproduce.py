"""What `reproduce` simulates where it is given no session, and the demo's models.

What comes out of a simulated session, or of another sensor's, stands beside the paper's table and
reproduces nothing; the report says so.
"""

from pathlib import Path

from afferents.core.card import Card
from afferents.core.choices import Size
from afferents.core.model import BEST, MODELS
from afferents.core.progress import Progress
from afferents.core.store import open_responses
from afferents.markers import Sensor, load_sensor
from afferents.pipeline.begun import Places
from afferents.pipeline.data import open_data
from afferents.pipeline.export import export_model
from afferents.pipeline.extract import extract
from afferents.pipeline.extraction import Extraction
from afferents.pipeline.sensor_rig import rig_of
from afferents.pipeline.simulate import simulate_session
from afferents.pipeline.train import Training, train
from afferents.rig.simulation import simulation_of

DEMO_STORE = Path("out/demo/session.zarr")
"""Where `afferents reproduce` leaves the demo's responses."""


def simulated(
    places: Places,
    size: Size,
    sensor: Sensor,
    seed: int,
    workers: int | None,
    progress: Progress,
) -> Path:
    """Simulate the session of a reproduction that is given none; keep what is there of it."""
    session = places.out / "session"
    simulation = simulation_of(session, size, seed=seed, rig=rig_of(sensor), sensor=sensor.name)
    return simulate_session(simulation, workers, progress)


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
    store = demo if demo.is_dir() and open_responses(demo) else _simulated_store(folder, progress)
    data = open_data([str(store)], progress=progress)
    for name, path in zip(BEST, exported, strict=True):
        progress.note(f"training {MODELS[name].title} on {store}")
        training = Training(data, MODELS[name], "fast", "all", data[0].encodings)
        card: Card = train(training, folder / name, progress, force=True)
        export_model(folder / name, path, force=True)
        for sentence in card.describe():
            progress.note(sentence)
    return exported


def _simulated_store(folder: Path, progress: Progress) -> Path:
    progress.note(f"simulating a small session to learn from, some minutes, once: {folder}")
    simulation = simulation_of(folder / "session", "quick")
    simulate_session(simulation, None, progress)
    progress.note("following the markers in its videos")
    store = folder / "session.zarr"
    extract(Extraction(folder / "session", store, load_sensor("tip_b"), "windowed"), progress)
    return store
