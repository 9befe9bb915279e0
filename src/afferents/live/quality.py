"""How good what a sense takes in is, over its last second: by what `inspect` asks of recordings."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

EVERY_S = 0.5
"""Figures are worked out anew this often, s of the source's time."""
SPAN_S = 1.0
"""They are of so many seconds."""


class Figure(NamedTuple):
    """One of them in words; `doubt` says what is wrong, in a sentence, where something is."""

    name: str
    value: str
    doubt: str = ""


class Quality(ABC):
    """Figures of one sense.

    Attributes
    ----------
    numbers
        By name, for programs; none before the first.
    """

    def __init__(self) -> None:
        """Nothing has come yet."""
        self.numbers: Mapping[str, float] = {}
        self._due_s: float | None = None

    @abstractmethod
    def begin(self) -> None:
        """Forget all: another recording begins."""

    @abstractmethod
    def figures(self) -> list[Figure]:
        """Return them in words, for people."""

    def _is_due(self, time_s: float) -> bool:
        """Tell whether figures are to be worked out; not at once, where there is no second yet."""
        if self._due_s is None or abs(time_s - self._due_s) > 2 * EVERY_S:  # it begins, or jumped
            self._due_s = time_s + EVERY_S
        if time_s < self._due_s:
            return False
        self._due_s += EVERY_S
        return True
