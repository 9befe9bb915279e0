"""What is simulated in a session: drums, speeds, length, and the rig, as a user's options say."""

import hashlib
import math
import re
from collections.abc import Sequence
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from afferents.choices import LARGEST_SEED, Nodules, Remount, Size, require_number
from afferents.errors import InputError
from afferents.recordings.tactile_bench import LOGS
from afferents.rig import drive, drums
from afferents.rig.config import DEEPEST_MM, HARD, NUISANCES, Rig
from afferents.rig.record import AUDIO, TIME, VIDEO
from afferents.rig.run import SWEEP, draw, make_generator
from afferents.rig.surface import Surface
from afferents.store.recording import LETTERS, natural_order
from afferents.version import __version__

_SPEEDS = tuple(map(float, range(10, 101, 10)))
_SECONDS: dict[Size, float] = {"quick": 8.0, "paper": 65.0}
_REPETITIONS = 4
RIGS_OWN = "tip_b"
"""Sensor whose pins the rig has if no other is given."""
RUNS = "runs"
"""Key of what was drawn for each run; it follows from the rest of the configuration."""

Run = tuple[str, float, int]
"""Texture, speed (mm/s; of a sweep its mean), and repetition of a sweep, else 0."""


class Simulation(BaseModel):
    """What is simulated.

    Attributes
    ----------
    textures
        Bump spacings by folder name, mm, and the names of height maps.
    sensor
        Name of the sensor whose pins the rig has.
    height_maps
        Surfaces of their own, by name, each as ``NAME=FILE,LENGTH_MM,HEIGHT_MM``.
    conditions
        What distinguishes the session from others that are evaluated with it, by name.
    sweep, repetitions
        Slowest and fastest speed between which a recording goes up and down, and whether as a
        sinusoid; and how many there are of each texture. `speeds_mm_s` is then their mean.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    session: Path
    textures: tuple[str, ...]
    speeds_mm_s: tuple[float, ...]
    seconds: float
    seed: int
    rig: Rig = Rig()
    sensor: str = RIGS_OWN
    height_maps: dict[str, str] = {}
    conditions: dict[str, int | float] = {}
    sweep: tuple[float, float, bool] | None = None
    repetitions: int = 1

    @property
    def names(self) -> list[Run]:
        """Return every recording, in the session's order."""
        ordered = sorted(self.textures, key=natural_order)
        times = range(1, self.repetitions + 1) if self.sweep else (0,)
        return [(t, speed, n) for t in ordered for speed in sorted(self.speeds_mm_s) for n in times]

    def slide(self, repetition: int) -> drive.Slide | None:
        """Return speeds and depths of a repetition; None for a constant speed."""
        if self.sweep is None:
            return None
        rng = make_generator(self.seed, None, None, SWEEP)  # alike for all textures
        drawn = drive.draw_slides(self.repetitions, self.rig.mounting.indentation_mm, rng)
        return drive.Slide(*self.sweep, *drawn[repetition - 1].tolist())

    def config(self) -> dict[str, Any]:
        """Return what session.json says: every constant, the seed, the draws, the versions."""
        digests = {  # of the heights as they lie round the drum
            name: hashlib.sha256(surface.height_mm.tobytes()).hexdigest()
            for name, surface in sorted(self.surfaces.items())
        }
        drawn = {}
        for run in self.names:
            slide, of_run = self.slide(run[2]), draw(self.rig, *run[:2], self.seed, run[2])
            drawn[run_name(run)] = {**of_run._asdict(), **(slide._asdict() if slide else {})}
        return {
            "simulated": True,
            "sensor": self.sensor,
            "fps_hz": self.rig.camera.fps_hz,
            "frame_width": self.rig.camera.width,
            "frame_height": self.rig.camera.height,
            "direction": "+x",
            "steady_s": [drive.STEADY_S, self.seconds],
            "textures": sorted(self.textures, key=natural_order),
            **({"speeds_mm_s": sorted(self.speeds_mm_s)} if self.sweep is None else self._swept()),
            "seconds": self.seconds,
            "seed": self.seed,
            "rig": self.rig.model_dump(mode="json"),
            **({"conditions": dict(self.conditions)} if self.conditions else {}),
            **({"height_maps": digests} if digests else {}),
            RUNS: drawn,
            "versions": {
                "afferents": __version__,
                **{name: version(name) for name in ("av", "numba", "numpy", "scipy")},
            },
        }

    def _swept(self) -> dict[str, Any]:
        """Return what session.json says of a sweep: which files are recordings, and their logs."""
        listed = [
            {
                "video": f"{run_name(run)}/{VIDEO}",
                "audio": f"{run_name(run)}/{AUDIO}",
                "texture": run[0],
                "repetition": str(run[2]),
                "id": run_name(run),
                "steady_s": [drive.STEADY_S, self.seconds],
                "beside": [
                    {**log, "file": f"{run_name(run)}/{log['file']}", "time": TIME} for log in LOGS
                ],
            }
            for run in self.names
        ]
        sweep = {"sweep": list(self.sweep or ()), "repetitions": self.repetitions}
        return {**sweep, "recordings": listed}

    @cached_property
    def surfaces(self) -> dict[str, Surface]:
        """Return the surface of each height map by name, read once."""
        return dict(drums.height_map(text, self.rig.drum) for text in self.height_maps.values())


def make_simulation(
    session: Path,
    preset: Size,
    textures: Sequence[str] = LETTERS,
    speeds_mm_s: Sequence[float] | None = None,
    seconds: float | None = None,
    height_maps: Sequence[str] = (),
    nuisances: str = "all",
    remount: Remount = "session",
    seed: int = 0,
    rig: Rig | None = None,
    sensor: str = RIGS_OWN,
    reprint: int | None = None,
    indentation_mm: float | None = None,
    nodules: Nodules = "on",
    sweep: str | None = None,
    repetitions: int | None = None,
) -> Simulation:
    """Return the simulation that a user's options describe.

    Parameters
    ----------
    textures
        Letters a to m, bump spacings in mm, and names of height maps.
    height_maps
        Each ``NAME=FILE,LENGTH_MM,HEIGHT_MM``.
    nuisances
        ``none``, or ``all``, ``hard`` (all, of the strengths in `HARD`) and names of `NUISANCES`
        separated by commas, all but ``hard`` with or without a strength of their own, such as
        ``hard,tilt=0.02``.
    remount
        When the fingertip is mounted: once a session, or anew for each drum or run.
    rig, sensor
        With other pins than its own, and the name of the sensor that has these.
    reprint
        Which set of printed drums is used; None for that of the seed's number.
    indentation_mm
        How deep the fingertip is pressed, mm; None for the paper's 1 mm. This and `reprint` are
        conditions of the session's recordings, where they are given.
    nodules
        Whether the skin has nodules or is flat.
    sweep, repetitions
        ``SLOW:FAST`` or ``SLOW:FAST:sine``, mm/s, and how many recordings of each texture (4).

    Raises
    ------
    InputError
        If one of these is not what it should be.
    """
    require_number("--seed", seed, 0, LARGEST_SEED)
    prints = seed if reprint is None else reprint
    require_number("--reprint", prints, 0, LARGEST_SEED)
    mounting: dict[str, Any] = {"remount": remount}
    if indentation_mm is not None:
        if not 0 < indentation_mm <= DEEPEST_MM:
            raise InputError(
                f"--indentation: expected more than 0 and at most {DEEPEST_MM:g} mm, found "
                f"{indentation_mm:g}"
            )
        mounting["indentation_mm"] = indentation_mm
    rig = (rig or Rig()).printed(prints)
    rig = rig.model_copy(
        update={
            "mounting": rig.mounting.model_copy(update=mounting),
            "skin": rig.skin.model_copy(update={"nodular": nodules == "on"}),
        }
    ).with_nuisances(nuisance_strengths(nuisances))
    maps = {text.partition("=")[0]: text for text in height_maps}
    folders = dict.fromkeys(
        drums.texture_name(str(texture).strip(), maps) for texture in [*textures, *maps]
    )
    if repetitions is not None and sweep is None:
        raise InputError("--repetitions: expected --sweep with it, found none; leave it out")
    again = _REPETITIONS if repetitions is None else repetitions
    require_number("--repetitions", again, 1)
    swept = None if sweep is None else _parse_sweep(sweep, rig.mounting.indentation_mm)
    if swept is not None:
        if speeds_mm_s is not None:
            raise InputError("--speeds: expected none with --sweep, found some; leave one out")
        speeds_mm_s = [sum(swept[:2]) / 2]
    speeds = _SPEEDS if speeds_mm_s is None else tuple(dict.fromkeys(speeds_mm_s))
    for option, wanted in (("--textures", folders), ("--speeds", speeds)):
        if not wanted:
            raise InputError(f"{option}: expected one or more, found none")
    conditions = {"indentation_mm": indentation_mm, "print": reprint}
    made = Simulation(
        session=session,
        textures=tuple(folders),
        speeds_mm_s=tuple(speeds),
        seconds=seconds if seconds is not None else _SECONDS[preset],
        seed=seed,
        rig=rig,
        sensor=sensor,
        height_maps=maps,
        conditions={name: value for name, value in conditions.items() if value is not None},
        sweep=swept,
        repetitions=again if swept else 1,
    )
    _ = made.surfaces  # refuses what is none
    return made


def nuisance_strengths(text: str) -> dict[str, float | None]:
    """Return the strength of each nuisance that is named, None where it is the rig's own.

    Raises
    ------
    InputError
        If a strength is no number, or ``hard`` has one.
    """
    groups: dict[str, float | None] = {}
    single: dict[str, float | None] = {}  # what is given for one counts, wherever it stands
    for word in text.split(","):
        name, _, strength = word.strip().partition("=")
        if name == "hard" and strength:
            raise InputError(f"--nuisances: expected 'hard' without a strength, found '{word}'")
        try:
            value = float(strength) if strength else None
        except ValueError:
            value = math.nan
        if value is not None and not math.isfinite(value):
            raise InputError(f"--nuisances: expected NAME or NAME=STRENGTH, found '{word}'")
        if name in ("all", "hard"):
            groups |= dict.fromkeys(NUISANCES, value) | (HARD if name == "hard" else {})
        elif name != "none":
            single[name] = value
    return groups | single


def _parse_sweep(text: str, usual_mm: float) -> tuple[float, float, bool]:
    """Return slowest and fastest speed, mm/s, and whether the speed is a sinusoid."""
    found = re.fullmatch(r"(\d+\.?\d*):(\d+\.?\d*)(:sine)?", text)
    low, high = (float(found[1]), float(found[2])) if found else (0.0, 0.0)
    if found is None or not 0 < low < high <= drive.FASTEST_MM_S:
        raise InputError(
            "--sweep: expected SLOW:FAST or SLOW:FAST:sine, speeds above 0 and up to "
            f"{drive.FASTEST_MM_S:g} mm/s, the slower first, found '{text}'; give such as 20:80"
        )
    if (deepest := 1 + drive.DEEPER + drive.CHANGE) * usual_mm > DEEPEST_MM:
        raise InputError(
            f"--indentation: expected at most {DEEPEST_MM / deepest:.2f} mm with --sweep, which "
            f"presses up to {deepest:g} times as deep, found {usual_mm:g}; press less deep"
        )
    return low, high, found[3] is not None


def run_name(run: Run) -> str:
    """Return the name of a run, which is its folder in the session."""
    texture, speed_mm_s, repetition = run
    return f"{texture}/sweep/{repetition}" if repetition else f"{texture}/{speed_mm_s:g}"
