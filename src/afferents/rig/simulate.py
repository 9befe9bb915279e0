"""A whole session of the simulated rig, in the published layout."""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from afferents import choices, documents, files, outputs, parallel
from afferents.errors import InputError
from afferents.markers.sensor import resolve_sensor
from afferents.progress import Progress
from afferents.recordings.session_file import SESSION_FILE
from afferents.rig import drive, surface
from afferents.rig.record import ARM_LOGS, AUDIO, REFERENCE, TRUTH, VIDEO, record
from afferents.rig.simulation import RUNS, Run, Simulation, make_simulation, run_name
from afferents.store import drum_path, recording

if TYPE_CHECKING:
    from afferents.markers.sensor import Sensor

_A_SESSION = "a session file"
_CHECKSUMS = "checksums"
"""Key of what is added to a session's configuration when it is whole."""


def simulate_session(
    simulation: Simulation, workers: int | None, progress: Progress, cluster: str | None = None
) -> Path:
    """Record every run that the session does not hold yet.

    Recordings come out the same whatever the number of workers; each is written under a
    temporary name and renamed when whole.

    Parameters
    ----------
    workers
        Processes side by side; None for one a core.
    cluster
        Address of a Dask scheduler whose workers simulate; None for this machine.

    Raises
    ------
    InputError
        If the folder holds a session of another configuration, or a run can't be simulated;
        recordings finished before stay.
    """
    for speed in simulation.speeds_mm_s:
        if not 0 < speed <= drive.FASTEST_MM_S:
            raise InputError(
                f"--speeds: expected speeds above 0 and up to {drive.FASTEST_MM_S:g} mm/s, found "
                f"{speed:g}"
            )
    named = [(f"{speed!r}", speed) for speed in simulation.speeds_mm_s]
    recording.require_distinct("--speeds", simulation.textures, named)
    if not drive.STEADY_S < simulation.seconds < math.inf:
        raise InputError(
            f"--seconds: expected more than {drive.STEADY_S:g} (the drum runs up before that), "
            f"found {simulation.seconds:g}"
        )
    simulation.config()  # refuses what can't be drawn, before anything is written
    with outputs.writing_alone(simulation.session, "simulate"):
        _claim(simulation)
        files.remove_partials(simulation.session)
        logs = (drum_path.DRIVE,) if simulation.sweep is None else ARM_LOGS
        needed = (VIDEO, AUDIO, TRUTH, *logs)
        missing = []  # runs that lack a file, or were never recorded
        for run in simulation.names:
            names = (*needed, REFERENCE) if run == simulation.names[0] else needed
            written = [simulation.session / run_name(run) / name for name in names]
            if not all(path.is_file() and path.stat().st_size for path in written):
                missing.append(run)
        if cluster is None:
            jobs = ((simulation, run) for run in missing)
            recorded: Iterator[str] = parallel.side_by_side(
                _record_one, jobs, workers, progress.note
            )
        else:
            session = simulation.session.resolve()
            sent = simulation.model_copy(update={"session": session}).model_dump_json()
            orders = ((sent, run) for run in missing)
            recorded = parallel.on_cluster(
                _record_far, orders, cluster, session, parallel.SAME + parallel.OF_RECORDINGS
            )
        n = len(simulation.names)
        with progress.task("simulating", n) as mark:
            mark(n - len(missing))
            for done, name in enumerate(recorded, start=n - len(missing) + 1):
                mark(done, name)
        session_file = simulation.session / SESSION_FILE
        if missing or _CHECKSUMS not in documents.read_json(session_file, _A_SESSION):
            folders = {name: simulation.session / name for name in map(run_name, simulation.names)}
            sums = {
                name: {file: files.checksum(folder / file) for file in (VIDEO, AUDIO, TRUTH)}
                for name, folder in folders.items()
            }
            files.write_json(session_file, {**simulation.config(), _CHECKSUMS: sums})
    return simulation.session


def _record_far(simulation_json: str, run: Run) -> str:
    """Record a run on a worker of a cluster, which reads the simulation once for all its runs."""
    return _record_one(_read_simulation(simulation_json), run)


_read_simulation = lru_cache(maxsize=1)(Simulation.model_validate_json)


def _claim(simulation: Simulation) -> None:
    """Write session.json, or see that the one there is the same."""
    path = simulation.session / SESSION_FILE
    if path.is_file():
        earlier, now = documents.read_json(path, _A_SESSION), simulation.config()
        for config in (earlier, now):
            for name in (RUNS, _CHECKSUMS):
                config.pop(name, None)
        files.require_same_config(simulation.session, "a session", earlier, now)
        return
    files.require_free(simulation.session, files.holds_only())
    files.write_json(path, simulation.config())


def _record_one(simulation: Simulation, run: Run) -> str:
    """Record a run of a simulation; return its name."""
    texture, speed_mm_s, repetition = run
    record(
        simulation.rig,
        simulation.session / run_name(run),
        texture,
        simulation.surfaces.get(texture) or _make_drum(float(texture), simulation.rig.drum),
        speed_mm_s,
        simulation.seconds,
        simulation.seed,
        reference=run == simulation.names[0],
        again=repetition,
        slide=simulation.slide(repetition),
    )
    return run_name(run)


_make_drum = lru_cache(maxsize=1)(surface.bumped_surface)
"""A drum's surface, made once for its runs in a row."""


def simulate(
    session: files.Place,
    preset: choices.Size = "quick",
    textures: str | Iterable[str] = "abcdefghijklm",
    speeds_mm_s: str | Iterable[float] | None = None,
    seconds: float | None = None,
    seed: int = 0,
    height_maps: Sequence[str] = (),
    nuisances: str = "all",
    remount: choices.Remount = "session",
    reprint: int | None = None,
    indentation_mm: float | None = None,
    nodules: choices.Nodules = "on",
    sensor: "str | Path | Sensor" = "tip_b",
    sweep: str | None = None,
    repetitions: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
) -> recording.RecordingSet:
    """Simulate a session: a fingertip slides over textured drums, filmed and recorded.

    Writes raw mp4 and wav files, as a real rig would.

    Parameters
    ----------
    session
        Session folder to write.
    preset
        Length of recordings: 'quick' has 8 s, 'paper' 65 s; both have 10 speeds.
    textures
        Letters a to m, or names separated by commas: letters, bump spacings in mm, height maps.
    speeds_mm_s
        Sliding speeds, mm/s, comma-separated (default: 10, 20, ... 100).
    seconds
        Length of each recording, s (default: the preset's).
    seed
        Random seed; the same seed gives the same session.
    height_maps
        A surface of your own: NAME=FILE,LENGTH_MM,HEIGHT_MM, where FILE is an image or .npy; may be
        repeated.
    nuisances
        Imperfections of the rig: 'all', 'hard', 'none', or names, with =STRENGTH to set the
        strength: all,tilt=0.02.
    remount
        When the fingertip is mounted: once a 'session', or anew for each 'drum' or each 'run'.
    reprint
        Set of printed drums, 0, 1, ...: each set has printing errors of its own, and is the
        condition print of the recordings (default: the seed's).
    indentation_mm
        How deep the fingertip is pressed on, mm, kept as the condition indentation_mm (default: 1,
        the paper's).
    nodules
        Whether the skin has its fingerprint's nodules or is flat.
    sensor
        Sensor file (TOML), or the name of a packaged one.
    sweep
        In place of constant speeds, slides as of an arm whose speed goes up and down between two,
        mm/s: 20:80, or 20:80:sine for a sinusoid. Each has pose and force with it.
    repetitions
        Slides of each texture in a sweep, of other depths (default: 4).
    workers
        Processes to run in parallel (default: one per core).
    cluster
        Run on a Dask cluster instead, such as tcp://scheduler:8786.
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    Session
        As `read_session` reads it.

    Raises
    ------
    InputError
        If one of these is not what it should be, or the folder holds something else.

    Examples
    --------
    >>> session = simulate("simulated", textures="a", speeds_mm_s=[50], seconds=2)
    >>> session.recordings[0].name
    '0/50'
    """
    from afferents.recordings.data_sets import read_session
    from afferents.rig.sensor_rig import make_rig

    choices.require_workers(workers)
    speeds = None if speeds_mm_s is None else choices.parse_numbers(speeds_mm_s, "--speeds")
    given = resolve_sensor(sensor)
    if isinstance(textures, str) and not set(textures) <= set(recording.LETTERS):
        textures = textures.split(",")
    with Progress(quiet) as progress:
        wanted = make_simulation(
            Path(session), preset, list(textures), speeds, seconds, height_maps, nuisances,
            remount, seed, make_rig(given), given.name, reprint, indentation_mm, nodules, sweep,
            repetitions,
        )  # fmt: skip
        simulate_session(wanted, workers, progress, cluster)
    return read_session(Path(session))
