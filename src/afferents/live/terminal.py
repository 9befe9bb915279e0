"""Percepts in the terminal: for every model what it feels, as bars."""

import time
from collections.abc import Iterable

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from afferents.live.percept import Percept

EVERY_S = 0.1
_BAR = 24
_MOST = 13
"""Textures shown, the likeliest."""


def show(percepts: Iterable[Percept]) -> None:
    """Draw percepts as they come, until they end."""
    latest: dict[str, Percept] = {}
    drawn_s = 0.0
    with Live(console=Console(highlight=False, markup=False), auto_refresh=False) as screen:
        for percept in percepts:
            latest[percept.model] = percept
            if time.monotonic() - drawn_s > EVERY_S:
                drawn_s = time.monotonic()
                screen.update(Group(*map(_drawn, latest.values())), refresh=True)


def _drawn(percept: Percept) -> RenderableType:
    table = Table(box=None, show_header=False, title=Text(_title(percept)), title_justify="left")
    likeliest = sorted(percept.evidence, key=percept.evidence.__getitem__, reverse=True)[:_MOST]
    for texture in percept.evidence:
        if texture not in likeliest:
            continue
        now, all_in_all = percept.probabilities.get(texture), percept.evidence[texture]
        said = "" if now is None else f"{100 * now:3.0f}% now"
        bar = "█" * round(_BAR * all_in_all)
        table.add_row(texture, f"{bar:<{_BAR}}", f"{100 * all_in_all:3.0f}%", said)
    return Group(table, Text(_counted(percept), style="dim"))


def _title(percept: Percept) -> str:
    felt = percept.texture if percept.fresh and percept.texture else percept.state
    sure = "" if percept.sure_after_s is None else f", sure after {percept.sure_after_s:.1f} s"
    truth = f" (it is {percept.truth})" if percept.truth else ""
    return f"{percept.model}: {felt}{sure}{truth}"


def _counted(percept: Percept) -> str:
    counters = percept.counters
    parts = [] if percept.latency_ms is None else [f"{percept.latency_ms:.1f} ms"]
    parts += [
        f"{count} {name.replace('_', ' ')}"
        for name, count in vars(counters).items()
        if count and name not in ("frames", "samples")
    ]
    return ", ".join([*parts, *percept.troubles])
