"""What is drawn in a terminal: a screen takes percepts and says how they look."""

import time
from collections.abc import Iterable
from typing import Protocol

from rich.console import Console, RenderableType
from rich.live import Live

from afferents.live.percept import Percept

EVERY_S = 0.1


class Screen(Protocol):
    """Draws the newest percepts."""

    def take(self, percept: Percept) -> None:
        """Keep a percept until the next of its name."""

    def drawn(self, console: Console) -> RenderableType:
        """Return the picture as it is now."""


def show(percepts: Iterable[Percept], screen: Screen) -> None:
    """Draw percepts as they come, until they end."""
    drawn_s = 0.0
    console = Console(highlight=False, markup=False)
    with Live(console=console, auto_refresh=False) as live:
        for percept in percepts:
            screen.take(percept)
            if time.monotonic() - drawn_s > EVERY_S:
                drawn_s = time.monotonic()
                live.update(screen.drawn(console), refresh=True)
        live.update(screen.drawn(console), refresh=True)  # the last, however quickly it came


def counted(percept: Percept) -> str:
    """Return latency, faults and troubles in a line."""
    parts = [] if percept.latency_ms is None else [f"latency {percept.latency_ms:.1f} ms"]
    parts += [
        f"{count} {name.replace('_', ' ')}"
        for name, count in vars(percept.counters).items()
        if count and name not in ("frames", "samples")
    ]
    return ", ".join([*parts, *percept.troubles])
