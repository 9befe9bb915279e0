"""Percepts as Lab Streaming Layer outlets, for recording beside everything else in a lab."""

import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

from afferents.errors import InputError
from afferents.live.events import Source, let_go
from afferents.live.percept import Percept, show
from afferents.live.senses import Senses
from afferents.live.stream import check_sources, run

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
            f"--lsl: expected pylsl and the LSL library, found {str(error).splitlines()[0]}; pip "
            "install 'afferents[lsl]'"
        ) from error
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


# Where percepts go: a page, the terminal, JSON lines, LSL.

Address = tuple[str, int, str | None]
"""Host, port and token of the page."""


def give_out(
    sources: Sequence[Source],
    senses: Senses,
    web: Address | None = None,
    lsl: bool = False,
    as_json: bool = False,
) -> None:
    """Feel or look, and give out what is felt or seen, until the sources end.

    Parameters
    ----------
    sources, senses
        As for `stream.run`.
    web
        Where a page is served; None for the terminal.
    lsl
        Whether LSL outlets are opened as well.
    as_json
        Whether percepts are printed as JSON lines.

    Raises
    ------
    InputError
        As `stream.run`; if packages are missing, or the page can't be served there.
    """
    with let_go(sources):
        check_sources(sources, senses)  # before anything is opened for the percepts
        _give_out(run(sources, senses), senses, web, lsl, as_json)


def _give_out(
    percepts: Iterator[Percept], senses: Senses, web: Address | None, lsl: bool, as_json: bool
) -> None:
    if lsl:
        textures = {session.name: session.textures for _, session in senses.sessions}
        percepts = published(percepts, textures)
    if as_json:
        percepts = _printed(percepts)
    if web is not None:
        from afferents.live.web.server import serve

        senses.show_spikes()
        serve(percepts, senses, *web)
    elif as_json:
        for _ in percepts:
            pass
    else:
        show(percepts, senses.screen())


def _printed(percepts: Iterator[Percept]) -> Iterator[Percept]:
    """Print percepts as they pass, one JSON object a line."""
    for percept in percepts:
        sys.stdout.write(json.dumps(percept.to_dict()) + "\n")
        sys.stdout.flush()
        yield percept
