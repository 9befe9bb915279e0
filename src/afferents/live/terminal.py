"""Percepts in the terminal: for every model what it feels, as bars."""

from collections.abc import Mapping

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from afferents.live.percept import Percept
from afferents.live.screen import counted

_BAR = 24
_AT_ONCE_S = 0.05
"""What would be printed as 0.0 s."""
_MOST = 13
"""Textures shown, the likeliest."""


class Bars:
    """Draws the evidence of every model as bars.

    Parameters
    ----------
    most_sure
        Of models by name: no texture is shown with a higher probability; see `Card`.
    """

    def __init__(self, most_sure: Mapping[str, float]) -> None:
        """Nothing is felt yet."""
        self._most_sure = most_sure
        self._latest: dict[str, Percept] = {}

    def take(self, percept: Percept) -> None:
        """Keep a percept until the next of its model."""
        self._latest[percept.model] = percept

    def drawn(self, console: Console) -> RenderableType:
        """Return the picture as it is now."""
        return Group(*(_drawn(one, self._most_sure[name]) for name, one in self._latest.items()))


def _drawn(percept: Percept, most_sure: float) -> RenderableType:
    table = Table(box=None, show_header=False, title=Text(_title(percept)), title_justify="left")
    likeliest = sorted(percept.evidence, key=percept.evidence.__getitem__, reverse=True)[:_MOST]
    for texture in percept.evidence:
        if texture not in likeliest:
            continue
        now, all_in_all = percept.probabilities.get(texture), percept.evidence[texture]
        said = "" if now is None else f"{100 * min(now, most_sure):3.0f}% now"
        bar = "█" * round(_BAR * all_in_all)
        table.add_row(texture, f"{bar:<{_BAR}}", f"{100 * all_in_all:3.0f}%", said)
    return Group(table, Text(counted(percept), style="dim"))


def _sure(after_s: float | None) -> str:
    if after_s is None:
        return ""
    return ", sure at once" if after_s < _AT_ONCE_S else f", sure after {after_s:.1f} s"


def _title(percept: Percept) -> str:
    felt = percept.texture if percept.fresh and percept.texture else percept.state
    sure = _sure(percept.sure_after_s)
    truth = f" (it is {percept.truth})" if percept.truth else ""
    return f"{percept.model}: {felt}{sure}{truth}"
