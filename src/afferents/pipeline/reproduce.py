"""The paper's whole way in one go: a session, its responses, the models, the report.

The models are the six of Table 1, and the one that we recommend for such data.

What comes out of a simulated session, or of another sensor's, stands beside the paper's table and
reproduces nothing; the report says so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from afferents.core.card import Card
from afferents.core.choices import Preset, Size
from afferents.core.cut import Cut
from afferents.core.model import BEST, MODELS, TABLE1, Model
from afferents.core.progress import Progress
from afferents.core.protocol import PROTOCOLS, Protocol
from afferents.core.store import open_responses
from afferents.markers import Sensor, load_sensor
from afferents.pipeline.data import OpenedData, open_data, origins_of, recordings_in
from afferents.pipeline.encode import best_of
from afferents.pipeline.evaluate import Evaluation, evaluate
from afferents.pipeline.export import export_model
from afferents.pipeline.extract import extract
from afferents.pipeline.extraction import Extraction
from afferents.pipeline.job import Recipe
from afferents.pipeline.report import write_report
from afferents.pipeline.sensor_rig import rig_of
from afferents.pipeline.simulate import simulate_session
from afferents.pipeline.train import Training, train
from afferents.rig.simulation import simulation_of

DEMO_STORE = Path("out/demo/session.zarr")
"""Where `afferents reproduce` leaves the demo's responses."""


@dataclass(frozen=True)
class Reproduction:
    """What is gone through.

    Attributes
    ----------
    out
        Holds `session/` (where one is simulated), `session.zarr/` and `results/` afterwards.
    session
        Recordings in the published layout; None for simulated ones.
    preset
        Of the training.
    size
        Of the simulated session: `quick` or `paper`.
    protocols
        Under which the models are evaluated.
    seed
        Of the simulation and of the training.
    """

    out: Path
    session: Path | None
    sensor: Sensor
    preset: Preset
    size: Size = "quick"
    protocols: tuple[Protocol, ...] = (PROTOCOLS["nested"],)
    cut: Cut = "all"
    seed: int = 0
    workers: int | None = None

    @property
    def store(self) -> Path:
        """Where the responses go."""
        return self.out / "session.zarr"

    @property
    def results(self) -> Path:
        """Where folds, table, figures and report go."""
        return self.out / "results"


def reproduce(reproduction: Reproduction, progress: Progress) -> Path:
    """Go the whole way, keeping what is finished already, and return the report's page.

    Raises
    ------
    AfferentsError
        As `simulate_session`, `extract`, `evaluate` and `write_report`.
    """
    extract(
        Extraction(
            reproduction.session or _simulated(reproduction, progress),
            reproduction.store,
            reproduction.sensor,
            "windowed",
            workers=reproduction.workers,
        ),
        progress,
    )
    data = open_data([str(reproduction.store)], {}, keep_going=False, progress=progress)
    recipe = Recipe(
        out=reproduction.results,
        data=origins_of(data),
        models=[*TABLE1.values(), *recommended_beside(TABLE1, data)],
        preset=reproduction.preset,
        cut=reproduction.cut,
        encodings=data[0].encodings,
    )
    evaluate(
        Evaluation(
            recipe,
            data,
            protocols=reproduction.protocols,
            seeds=[reproduction.seed],
            may_leave_out=True,
            workers=reproduction.workers,
        ),
        progress,
    )
    return write_report(reproduction.results, progress)


def recommended_beside(models: Mapping[str, Model], data: Sequence[OpenedData]) -> list[Model]:
    """Return the model that is recommended for such data, if it is not among those named."""
    best = best_of(recordings_in(data))
    return [] if best.name in models else [best]


def _simulated(reproduction: Reproduction, progress: Progress) -> Path:
    session = reproduction.out / "session"
    rig, sensor = rig_of(reproduction.sensor), reproduction.sensor.name
    simulation = simulation_of(
        session, reproduction.size, seed=reproduction.seed, rig=rig, sensor=sensor
    )
    return simulate_session(simulation, reproduction.workers, progress)


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
    simulation = simulation_of(folder / "session", "quick")
    simulate_session(simulation, None, progress)
    store = folder / "session.zarr"
    extract(Extraction(folder / "session", store, load_sensor("tip_b"), "windowed"), progress)
    return store
