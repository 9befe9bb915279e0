"""Command of the simulated rig."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from afferents.commands.given import Place, sensor_in
from afferents.core.choices import Nodules, Remount, Size
from afferents.core.progress import Progress
from afferents.core.recording import Session

if TYPE_CHECKING:
    from afferents.markers import Sensor


def simulate(
    session: Place,
    preset: Size = "quick",
    textures: Iterable[str] = "abcdefghijklm",
    speeds_mm_s: Iterable[float] | None = None,
    seconds: float | None = None,
    seed: int = 0,
    height_maps: Sequence[str] = (),
    nuisances: str = "all",
    remount: Remount = "session",
    reprint: int | None = None,
    indentation_mm: float | None = None,
    nodules: Nodules = "on",
    sensor: "str | Path | Sensor" = "tip_b",
    workers: int | None = None,
    cluster: str | None = None,
    quiet: bool = False,
) -> Session:
    """Simulate the rig: fingertip, drums, camera and microphone, as raw mp4 and wav.

    Parameters
    ----------
    session
        Folder to write, in the published layout.
    preset
        ``quick``, 5 speeds of 7.5 s, or ``paper``, 10 speeds of 65 s.
    textures
        Letters a to m, bump spacings in mm, or names of height maps.
    speeds_mm_s, seconds
        Instead of the preset's.
    seed
        The same seed gives the same session.
    height_maps
        Surfaces of your own, each ``NAME=FILE,LENGTH_MM,HEIGHT_MM``.
    nuisances
        What is imperfect about the rig: ``all``, ``hard``, ``none``, or names separated by commas.
    remount
        When the fingertip is mounted: once a ``session``, as in the paper, or anew for each
        ``drum`` or ``run``.
    reprint
        Which set of printed drums is used; None for that of the seed's number.
    indentation_mm
        How deep the fingertip is pressed on, mm; None for the paper's 1 mm.
    nodules
        Whether the skin has its fingerprint's nodules (``on``) or is flat (``off``).
    sensor
        Whose pins and picture the rig has.
    workers, cluster
        Processes here (None for one a core), or the address of a Dask scheduler.
    quiet
        Whether no progress is shown.

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
    from afferents.pipeline.sensor_rig import rig_of
    from afferents.pipeline.simulate import simulate_session
    from afferents.recordings import read_session
    from afferents.rig.simulation import simulation_of

    speeds = None if speeds_mm_s is None else [float(speed) for speed in speeds_mm_s]
    given = sensor_in(sensor)
    with Progress(quiet) as progress:
        wanted = simulation_of(
            Path(session), preset, list(textures), speeds, seconds, height_maps, nuisances,
            remount, seed, rig_of(given), given.name, reprint, indentation_mm, nodules,
        )  # fmt: skip
        simulate_session(wanted, workers, progress, cluster)
    return read_session(Path(session))
