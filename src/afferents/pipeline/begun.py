"""A reproduction on disk: where it puts what, and what it began with."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from afferents.core.choices import Like
from afferents.core.documents import read_checked
from afferents.core.files import require_same_config, write_json
from afferents.core.forms import Form
from afferents.core.like import written

REPORT = "report.html"
"""In the results."""
BEGUN = "reproduction.json"
"""In its folder: what was chosen, and how long it was taken to need."""
_WHAT, _AGAIN = "what a reproduction began with", "choose another folder"
_FREE = frozenset({"protocol", "models"})
"""Choices that one folder may hold several of: trainings are added."""


class Begun(Form):
    """`reproduction.json`: what a folder's reproduction began with."""

    like: Like
    choices: dict[str, str]
    otherwise: tuple[str, ...]
    differs: tuple[str, ...]
    recordings: int
    estimated_s: float | None
    since: float


@dataclass(frozen=True)
class Places:
    """Where a reproduction puts what.

    Attributes
    ----------
    out
        Holds `session/` (where one is simulated), `session.zarr/` and `results/` afterwards.
    """

    out: Path

    @property
    def store(self) -> Path:
        """Where the responses go."""
        return self.out / "session.zarr"

    @property
    def results(self) -> Path:
        """Where folds, table, figures and report go."""
        return self.out / "results"

    @property
    def begun(self) -> Path:
        """What it began with."""
        return self.out / BEGUN


def require_same(places: Places, like: Like, choices: Mapping[str, Any]) -> None:
    """Refuse to go on with a reproduction of other choices.

    Raises
    ------
    InputError
        Naming the first that differs.
    """
    if places.begun.is_file():
        found = read_begun(places)
        earlier, wanted = (
            {"like": of, **{n: written(v) for n, v in its.items() if n not in _FREE}}
            for of, its in ((found.like, found.choices), (like, choices))
        )
        require_same_config(places.out, "a reproduction", earlier, wanted)


def write_begun(
    places: Places,
    like: Like,
    choices: Mapping[str, Any],
    otherwise: Sequence[str],
    differs: Sequence[str],
    n_recordings: int,
    estimated_s: float | None,
) -> None:
    """Write down what a reproduction begins with, for `status` and for whoever reads it later."""
    content = {
        "like": like,
        "choices": {name: written(value) for name, value in choices.items()},
        "otherwise": list(otherwise),
        "differs": list(differs),
        "recordings": n_recordings,
        "estimated_s": estimated_s,
        "since": time.time(),
    }
    write_json(places.begun, content)


def read_begun(places: Places) -> Begun:
    """Return what a reproduction began with.

    Raises
    ------
    InputError
        If the file is damaged.
    """
    return Begun.model_validate(read_checked(places.begun, Begun, _WHAT, _AGAIN))
