"""A whole session of the simulated rig, in the published layout."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from afferents import __version__
from afferents.core.errors import InputError
from afferents.core.files import (
    checksum,
    read_json,
    remove_partials,
    require_same_config,
    write_json,
)
from afferents.core.lock import writing_alone
from afferents.core.outputs import require_new_folder
from afferents.core.progress import Progress
from afferents.core.recording import LETTERS, natural_order, require_distinct
from afferents.pipeline.drums import height_map, texture_name
from afferents.pipeline.parallel import side_by_side
from afferents.recordings.session import NOT_TEXTURES, SESSION_FILE
from afferents.rig import (
    AUDIO,
    HARD,
    NUISANCES,
    STEADY_S,
    TRUTH,
    VIDEO,
    Mounting,
    Rig,
    Surface,
    bumped_surface,
    draw,
    record,
)

SimulationPreset = Literal["quick", "paper"]

_SPEEDS: dict[SimulationPreset, tuple[float, ...]] = {
    # No two neighbours more than a factor 2 apart, which stretching spectra can bridge.
    "quick": (10, 20, 40, 70, 100),
    "paper": tuple(range(10, 101, 10)),
}
_SECONDS: dict[SimulationPreset, float] = {"quick": 7.5, "paper": 65.0}
_RUNS, _CHECKSUMS = "runs", "checksums"
"""What follows from the rest of a session's configuration."""


@dataclass(frozen=True)
class Simulation:
    """What is simulated.

    Attributes
    ----------
    textures
        Bump spacings by folder name, mm, and the names of height maps.
    height_maps
        Surfaces of their own, by name.
    """

    session: Path
    textures: Sequence[str]
    speeds_mm_s: Sequence[float]
    seconds: float
    seed: int
    rig: Rig = field(default_factory=Rig)
    height_maps: Mapping[str, Surface] = field(default_factory=dict)

    @property
    def names(self) -> list[tuple[str, float]]:
        """Return texture and speed of every recording, in the session's order."""
        ordered = sorted(self.textures, key=natural_order)
        return [(texture, speed) for texture in ordered for speed in sorted(self.speeds_mm_s)]

    def config(self) -> dict[str, Any]:
        """Return what session.json says: every constant, the seed, the draws, the versions."""
        runs = {
            _name(texture, speed): draw(self.rig, texture, speed, self.seed)._asdict()
            for texture, speed in self.names
        }
        return {
            "simulated": True,
            "sensor": "tip_b",
            "fps_hz": self.rig.camera.fps_hz,
            "frame_width": self.rig.camera.width,
            "frame_height": self.rig.camera.height,
            "direction": "+x",
            "steady_s": [STEADY_S, self.seconds],
            "textures": [texture for texture, _ in self.names[:: len(self.speeds_mm_s)]],
            "speeds_mm_s": sorted(self.speeds_mm_s),
            "seconds": self.seconds,
            "seed": self.seed,
            "rig": self.rig.model_dump(mode="json"),
            _RUNS: runs,
            "versions": {
                "afferents": __version__,
                **{name: version(name) for name in ("av", "numba", "numpy", "scipy")},
            },
        }


def simulation_of(
    session: Path,
    preset: SimulationPreset,
    textures: Sequence[str] = LETTERS,
    speeds_mm_s: Sequence[float] | None = None,
    seconds: float | None = None,
    height_maps: Sequence[str] = (),
    nuisances: str = "all",
    remount: Literal["run", "drum"] = "run",
    seed: int = 0,
) -> Simulation:
    """Return the simulation that a user's words describe.

    Parameters
    ----------
    textures
        Letters a to m, bump spacings in mm, and names of height maps.
    height_maps
        Each ``NAME=FILE,LENGTH_MM,HEIGHT_MM``.
    nuisances
        ``none``, or ``all``, ``hard`` (all, of the strengths in `HARD`) and names of `NUISANCES`
        separated by commas, each with or without a strength of its own, such as ``all,tilt=0.02``.
    remount
        Whether the fingertip is mounted anew for each run or once a drum.

    Raises
    ------
    InputError
        If one of these is not what it should be.
    """
    rig = Rig()
    if remount == "drum":
        rig = rig.model_copy(update={"mounting": Mounting(once_a_drum=True)})
    rig = rig.with_nuisances(nuisance_strengths(nuisances))
    maps = dict(height_map(text, rig.drum) for text in height_maps)
    folders = dict.fromkeys(texture_name(texture.strip(), maps) for texture in [*textures, *maps])
    return Simulation(
        session,
        tuple(folders),
        tuple(dict.fromkeys(speeds_mm_s or _SPEEDS[preset])),
        seconds if seconds is not None else _SECONDS[preset],
        seed,
        rig,
        maps,
    )


def nuisance_strengths(text: str) -> dict[str, float | None]:
    """Return the strength of each nuisance that is named, None where it is the rig's own.

    Raises
    ------
    InputError
        If a strength is no number.
    """
    strengths: dict[str, float | None] = {}
    for word in text.split(","):
        name, _, strength = word.strip().partition("=")
        try:
            named = dict.fromkeys(NUISANCES if name in ("all", "hard") else [name])
            strengths |= {n: float(strength) for n in named} if strength else named
            strengths |= HARD if name == "hard" else {}
        except ValueError:
            raise InputError("--nuisances", "NAME or NAME=STRENGTH", f"'{word}'") from None
    return {name: value for name, value in strengths.items() if name != "none"}


def simulate_session(simulation: Simulation, workers: int | None, progress: Progress) -> Path:
    """Record every run that the session does not hold yet.

    Recordings come out the same whatever the number of workers; each is written under a
    temporary name and renamed when whole.

    Parameters
    ----------
    workers
        Processes side by side; None for one a core.

    Raises
    ------
    InputError
        If the folder holds a session of another configuration, or a run can't be simulated;
        recordings finished before stay.
    """
    _check(simulation)
    _require_own_session(simulation)
    with writing_alone(simulation.session, "simulate"):
        _claim(simulation)
        remove_partials(simulation.session)
        _record_missing(simulation, workers, progress)
    return simulation.session


def _record_missing(simulation: Simulation, workers: int | None, progress: Progress) -> None:
    missing = [run for run in simulation.names if not _is_recorded(simulation, *run)]
    done = len(simulation.names) - len(missing)
    with progress.task("simulating", len(simulation.names)) as mark:
        mark(done)
        jobs = ((simulation, *run) for run in missing)
        for name in side_by_side(_record_one, jobs, workers, progress.note):
            done += 1
            mark(done, name)
    if missing or _CHECKSUMS not in read_json(simulation.session / SESSION_FILE, "a session file"):
        _seal(simulation)


def _is_recorded(simulation: Simulation, texture: str, speed_mm_s: float) -> bool:
    """Tell whether a run is there with all its files; one that lost some is recorded again."""
    folder = _folder(simulation, texture, speed_mm_s)
    files = (folder / name for name in (VIDEO, AUDIO, TRUTH))
    return all(path.is_file() and path.stat().st_size for path in files)


def _check(simulation: Simulation) -> None:
    for speed in simulation.speeds_mm_s:
        if not 0 < speed <= 500:
            raise InputError("--speeds", "speeds above 0 and up to 500 mm/s", f"{speed:g}")
    named = [(f"{speed!r}", speed) for speed in simulation.speeds_mm_s]
    require_distinct("--speeds", simulation.textures, named)
    for name in NOT_TEXTURES & set(simulation.textures):
        raise InputError(
            "--height-map", "a name that a session may have as a texture", f"'{name}'",
            "choose another: folders of that name are passed over when a session is read",
        )  # fmt: skip
    if simulation.seconds <= STEADY_S:
        raise InputError(
            "--seconds",
            f"more than {STEADY_S:g} (the drum runs up before that)",
            f"{simulation.seconds:g}",
        )


def _require_own_session(simulation: Simulation) -> None:
    """Refuse a folder that holds something else than a session begun here."""
    if not (simulation.session / SESSION_FILE).is_file():
        require_new_folder(simulation.session, "a new session")


def _claim(simulation: Simulation) -> None:
    """Write session.json, or see that the one there is the same."""
    path = simulation.session / SESSION_FILE
    if path.is_file():
        earlier, now = read_json(path, "a session file"), simulation.config()
        for config in (earlier, now):
            for name in (_RUNS, _CHECKSUMS):
                config.pop(name, None)
        require_same_config(simulation.session, "a session", earlier, now)
        return
    _require_own_session(simulation)
    write_json(path, simulation.config())


def _folder(simulation: Simulation, texture: str, speed_mm_s: float) -> Path:
    return simulation.session / _name(texture, speed_mm_s)


def _name(texture: str, speed_mm_s: float) -> str:
    return f"{texture}/{speed_mm_s:g}"


def _record_one(simulation: Simulation, texture: str, speed_mm_s: float) -> str:
    surface = simulation.height_maps.get(texture)
    if surface is None:
        surface = bumped_surface(float(texture), simulation.rig.drum)
    record(
        simulation.rig,
        _folder(simulation, texture, speed_mm_s),
        texture,
        surface,
        speed_mm_s,
        simulation.seconds,
        simulation.seed,
        reference=(texture, speed_mm_s) == simulation.names[0],
    )
    return _name(texture, speed_mm_s)


def _seal(simulation: Simulation) -> None:
    """Add the checksums of all recordings to session.json."""
    sums = {
        _name(texture, speed): {
            file: checksum(_folder(simulation, texture, speed) / file)
            for file in (VIDEO, AUDIO, TRUTH)
        }
        for texture, speed in simulation.names
    }
    write_json(simulation.session / SESSION_FILE, {**simulation.config(), _CHECKSUMS: sums})
