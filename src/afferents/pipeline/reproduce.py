"""The paper's whole way in one go: a session, its responses, all six models, the report.

What comes out of a simulated session, or of another sensor's, stands beside the paper's table and
reproduces nothing; the report says so.
"""

from dataclasses import dataclass
from pathlib import Path

from afferents.core.cut import Cut
from afferents.core.model import TABLE1
from afferents.core.progress import Progress
from afferents.core.protocol import PROTOCOLS
from afferents.markers import Sensor
from afferents.pipeline.data import open_data
from afferents.pipeline.evaluate import Evaluation, evaluate
from afferents.pipeline.extract import Extraction, extract
from afferents.pipeline.simulate import SimulationPreset, simulate_session, simulation_of
from afferents.pipeline.write_report import write_report
from afferents.training import Preset


@dataclass(frozen=True)
class Reproduction:
    """What is gone through.

    Attributes
    ----------
    out
        Holds `session/` (where one is simulated), `session.zarr/` and `results/` afterwards.
    session
        Recordings in the published layout; None for simulated ones.
    seed
        Of the simulation and of the training.
    """

    out: Path
    session: Path | None
    sensor: Sensor
    preset: Preset
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
    evaluate(
        Evaluation(
            data=data,
            out=reproduction.results,
            families=list(TABLE1.values()),
            protocols=list(PROTOCOLS.values()),
            preset=reproduction.preset,
            cut=reproduction.cut,
            encodings=data[0].encodings,
            seeds=[reproduction.seed],
            may_leave_out=True,
            workers=reproduction.workers,
        ),
        progress,
    )
    return write_report(reproduction.results, progress)


def _simulated(reproduction: Reproduction, progress: Progress) -> Path:
    session = reproduction.out / "session"
    size: SimulationPreset = "quick" if reproduction.preset == "quick" else "paper"
    simulation = simulation_of(session, size, seed=reproduction.seed)
    return simulate_session(simulation, reproduction.workers, progress)
