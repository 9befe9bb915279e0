"""What `afferents live` runs: models that feel, or an onlooker where no model is given."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from afferents.core.errors import InputError
from afferents.core.model import BEST
from afferents.core.progress import Progress

if TYPE_CHECKING:
    from afferents.live import Source
    from afferents.live.senses import Senses

DEMO = "demo"
"""Stands for the models of the simulated rig, which are trained if need be."""
Prepared = tuple[Sequence["Source"], "Senses"]
"""Sources, opened, and the senses that take what they give."""


class Asked(NamedTuple):
    """What is asked of the sources, as options of the command line say it.

    Attributes
    ----------
    video, audio
        By name; None for none.
    speed
        Of replays; infinite for as fast as possible.
    fps_hz, exposure_ms
        Of the camera; None for its own.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.
    """

    video: str | None
    audio: str | None
    speed: float = 1.0
    fps_hz: float | None = None
    exposure_ms: float | None = None
    audio_offset_s: float = 0.0


def feeling(asked: Asked, models: Sequence[Path], quiet: bool) -> Prepared:
    """Open what models need.

    Raises
    ------
    InputError
        If models or sources are missing, or do not go together.
    """
    from afferents.live import Network, Perceiver, open_sources

    if asked.fps_hz is not None:
        raise InputError("--fps", "none beside --model, which has its own", f"{asked.fps_hz:g}")
    paths = _demo(asked, quiet) if models == [Path(DEMO)] else models
    senses = Perceiver([Network(path) for path in paths], asked.audio_offset_s)
    given = asked.speed, asked.exposure_ms
    return open_sources(asked.video, asked.audio, senses.wanted, *given), senses


def looking(asked: Asked, sensor: str | None) -> Prepared:
    """Open what is to be looked at, by a sensor's file or name; None to find its markers.

    Raises
    ------
    InputError
        If there is no source, or the sensor does not go with it.
    """
    from afferents.live import Looker, Wanted, images_of, open_sources
    from afferents.markers import load_sensor

    if asked.fps_hz is not None and not 0 < asked.fps_hz < float("inf"):
        raise InputError("--fps", "a number of frames a second above 0", f"{asked.fps_hz:g}")
    images = images_of(asked.video, load_sensor(sensor) if sensor else None)
    wanted = Wanted(sensor=images.sensor, fps_hz=asked.fps_hz)
    given = asked.speed, asked.exposure_ms
    sources = open_sources(asked.video, asked.audio, wanted, *given)
    return sources, Looker(sources, images, asked.audio_offset_s)


def _demo(asked: Asked, quiet: bool) -> list[Path]:
    """Return exported models for sources of the simulated rig; they are trained if need be."""
    from afferents.pipeline.reproduce import demo_models

    named = [source for source in (asked.video, asked.audio) if source is not None]
    if not named or any(not source.startswith("rig") for source in named):
        raise InputError(
            f"--model {DEMO}", "sources of the simulated rig, such as --video rig",
            ", ".join(named) or "none", "run 'afferents train' and 'afferents export' for others",
        )  # fmt: skip
    with Progress(quiet) as progress:
        both = demo_models(Path("out/live"), progress)
    kinds = dict(zip(BEST, (asked.video, asked.audio), strict=True))
    return [path for path in both if kinds[path.stem] is not None]
