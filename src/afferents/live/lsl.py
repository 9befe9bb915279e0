"""Percepts as Lab Streaming Layer outlets, for recording beside everything else in a lab."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

from afferents.core.errors import InputError
from afferents.live.percept import Percept

PROBABILITIES, MESSAGES = "afferents probabilities", "afferents percepts"


def published(
    percepts: Iterable[Percept], textures: Mapping[str, Sequence[str]]
) -> Iterator[Percept]:
    """Pass percepts on, and give them out by LSL.

    Two outlets a model: its probabilities, one channel a texture (NaN where nothing fresh is
    known), and every percept as JSON. Where one looks without a model, there is only the latter.

    Parameters
    ----------
    percepts
        Passed on.
    textures
        That each model tells apart, by the name in its percepts; none where one only looks.

    Raises
    ------
    InputError
        If pylsl or the LSL library is missing.
    """
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as error:
        raise InputError(
            "--lsl", "pylsl and the LSL library", str(error).splitlines()[0],
            "pip install 'afferents[lsl]'",
        ) from error  # fmt: skip
    words = {name: pylsl.StreamOutlet(_words(pylsl, name)) for name in textures}
    numbers = {
        name: pylsl.StreamOutlet(_numbers(pylsl, name, several))
        for name, several in textures.items()
        if several
    }
    nothing = float("nan")
    for percept in percepts:
        if outlet := numbers.get(percept.model):
            known = percept.probabilities
            outlet.push_sample([known.get(texture, nothing) for texture in percept.evidence])
        words[percept.model].push_sample([json.dumps(percept.to_dict())])
        yield percept


def _numbers(pylsl: ModuleType, name: str, textures: Sequence[str]) -> Any:
    """Describe a stream of probabilities."""
    stream = pylsl.StreamInfo(
        f"{PROBABILITIES} {name}", "Touch", len(textures), 0, "float32", f"afferents-{name}"
    )
    channels = stream.desc().append_child("channels")
    for texture in textures:
        channels.append_child("channel").append_child_value("label", texture)
    return stream


def _words(pylsl: ModuleType, name: str) -> Any:
    """Describe a stream of percepts."""
    source = f"afferents-{name}-json"
    return pylsl.StreamInfo(f"{MESSAGES} {name}", "Markers", 1, 0, "string", source)
