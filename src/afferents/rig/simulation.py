"""What is simulated in a session: drums, speeds, length, and the rig, as a user's words say."""

import hashlib
import math
from collections.abc import Sequence
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from afferents.choices import LARGEST_SEED, Nodules, Remount, Size, require_number
from afferents.errors import InputError
from afferents.rig.config import DEEPEST_MM, HARD, NUISANCES, Rig
from afferents.rig.drive import STEADY_S
from afferents.rig.drums import height_map, texture_name
from afferents.rig.run import draw
from afferents.rig.surface import Surface
from afferents.store.recording import LETTERS, natural_order
from afferents.version import __version__

_SPEEDS = tuple(map(float, range(10, 101, 10)))
_SECONDS: dict[Size, float] = {"quick": 8.0, "paper": 65.0}
RIGS_OWN = "tip_b"
"""Sensor whose pins the rig has if no other is asked for."""
RUNS = "runs"
"""Key of what was drawn for each run; it follows from the rest of the configuration."""


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

    @property
    def names(self) -> list[tuple[str, float]]:
        """Return texture and speed of every recording, in the session's order."""
        ordered = sorted(self.textures, key=natural_order)
        return [(texture, speed) for texture in ordered for speed in sorted(self.speeds_mm_s)]

    def config(self) -> dict[str, Any]:
        """Return what session.json says: every constant, the seed, the draws, the versions."""
        runs = {run_name(*run): draw(self.rig, *run, self.seed)._asdict() for run in self.names}
        return {
            "simulated": True,
            "sensor": self.sensor,
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
            **({"conditions": dict(self.conditions)} if self.conditions else {}),
            **({"height_maps": self._maps()} if self.height_maps else {}),
            RUNS: runs,
            "versions": {
                "afferents": __version__,
                **{name: version(name) for name in ("av", "numba", "numpy", "scipy")},
            },
        }

    @cached_property
    def surfaces(self) -> dict[str, Surface]:
        """Return the surface of each height map by name, read once."""
        return dict(height_map(text, self.rig.drum) for text in self.height_maps.values())

    def _maps(self) -> dict[str, str]:
        """Return the SHA-256 of each height map's heights, as they lie round the drum."""
        return {
            name: hashlib.sha256(surface.height_mm.tobytes()).hexdigest()
            for name, surface in sorted(self.surfaces.items())
        }


def simulation_of(
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
        texture_name(str(texture).strip(), maps) for texture in [*textures, *maps]
    )
    speeds = _SPEEDS if speeds_mm_s is None else tuple(dict.fromkeys(speeds_mm_s))
    for option, wanted in (("--textures", folders), ("--speeds", speeds)):
        if not wanted:
            raise InputError(f"{option}: expected one or more, found none")
    asked = {"indentation_mm": indentation_mm, "print": reprint}
    made = Simulation(
        session=session,
        textures=tuple(folders),
        speeds_mm_s=tuple(speeds),
        seconds=seconds if seconds is not None else _SECONDS[preset],
        seed=seed,
        rig=rig,
        sensor=sensor,
        height_maps=maps,
        conditions={name: value for name, value in asked.items() if value is not None},
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
    single: dict[str, float | None] = {}  # what is said of one counts, wherever it stands
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


def run_name(texture: str, speed_mm_s: float) -> str:
    """Return the name of a run, which is its folder in the session."""
    return f"{texture}/{speed_mm_s:g}"
