"""Models to try live without recordings: trained once, on the demo's session or a smaller one."""

from pathlib import Path

from afferents.evaluation.data import open_data
from afferents.evaluation.options import TrainingOptions
from afferents.evaluation.train import train_model
from afferents.extraction.extract import extract_session
from afferents.extraction.options import Extraction
from afferents.markers.sensor import load_sensor
from afferents.models import export, model
from afferents.progress import Progress
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import make_simulation
from afferents.store.zarr_store import holds_all

DEMO_STORE = Path("out/demo/session.zarr")
"""Where `afferents reproduce` leaves the demo's responses."""
_FEW_SPEEDS = (10, 20, 40, 70, 100)
"""For a model to try live, which is not to be waited for; mm/s."""


def demo_models(folder: Path, progress: Progress) -> list[Path]:
    """Return exported models of the simulated rig, in a folder; kept where both are there.

    They learn from `DEMO_STORE`, if it is there; else a small session is simulated.
    """
    exported = [folder / f"{name}.onnx" for name in model.BEST]
    if all(path.is_file() for path in exported):
        return exported
    store, session = DEMO_STORE, folder / "session"
    if not holds_all(store):  # a demo that was stopped leaves a part
        progress.note(f"simulating a small session to learn from, some minutes, once: {folder}")
        simulation = make_simulation(session, "quick", speeds_mm_s=_FEW_SPEEDS)
        simulate_session(simulation, None, progress)
        progress.note("following the markers in its videos")
        store = folder / "session.zarr"
        wanted = Extraction(session=session, out=store, sensor=load_sensor("tip_b"))
        extract_session(wanted, progress)
    (data,) = open_data([str(store)], progress=progress)
    for name, path in zip(model.BEST, exported, strict=True):
        progress.note(f"training {model.MODELS[name].title} on {store}")
        options = TrainingOptions()
        card = train_model(data, model.MODELS[name], folder / name, options, progress, force=True)
        export.export(folder / name, path, force=True)
        for sentence in card.describe():
            progress.note(sentence)
    return exported
