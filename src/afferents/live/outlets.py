"""Where percepts go: a page, the terminal, JSON lines, LSL."""

import json
import sys
from collections.abc import Iterator, Sequence

from afferents.live.events import Source, let_go
from afferents.live.lsl import published
from afferents.live.percept import Percept
from afferents.live.screen import show
from afferents.live.senses import Senses
from afferents.live.stream import check_sources, run

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
