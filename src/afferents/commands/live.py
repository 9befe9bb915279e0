"""Models to feel the simulated rig with, where no others are given."""

from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.model import BEST
from afferents.core.progress import Progress


def models_for(video: str | None, audio: str | None, quiet: bool = False) -> list[Path]:
    """Return exported models for sources of the simulated rig; they are trained if need be.

    Parameters
    ----------
    video, audio
        Sources, as of ``afferents live``; None for none.
    quiet
        Whether no progress is shown.

    Raises
    ------
    InputError
        If there is another source: its models have to be given.
    """
    from afferents.pipeline.reproduce import demo_models

    asked = [source for source in (video, audio) if source is not None]
    if not asked or any(not source.startswith("rig") for source in asked):
        raise InputError(
            "--model", "an exported model (only the rig's own can be had without)", "none",
            "run 'afferents train' and 'afferents export' first",
        )  # fmt: skip
    with Progress(quiet) as progress:
        both = demo_models(Path("out/live"), progress)
    kinds = dict(zip(BEST, (video, audio), strict=True))
    return [path for path in both if kinds[path.stem] is not None]
