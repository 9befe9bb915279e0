"""The folder of a reproduction: where it puts what, and what it began with."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field

from afferents.choices import Like
from afferents.documents import as_form, read_json
from afferents.evaluation.results import Schema
from afferents.files import require_same_config, write_json

STATE_FILE = "reproduction.json"
"""In its folder: what was chosen."""
_WHAT, _AGAIN = "what a reproduction began with", "choose another folder"
_FREE = frozenset({"protocol", "models"})
"""Choices that one folder may hold several of: trainings are added."""


class RunState(Schema):
    """`reproduction.json`: what a folder's reproduction began with."""

    like: Like
    choices: dict[str, str]
    otherwise: tuple[str, ...]
    differs: tuple[str, ...]
    recordings: int
    since: float = Field(default_factory=time.time)


@dataclass(frozen=True)
class RunFolder:
    """Where a reproduction puts what.

    Attributes
    ----------
    out
        Holds `session/` (where one is simulated), `session.zarr/` and `results/` afterwards.
    """

    out: Path

    @property
    def session(self) -> Path:
        """Where a session is simulated."""
        return self.out / "session"

    @property
    def store(self) -> Path:
        """Where the responses go."""
        return self.out / "session.zarr"

    @property
    def results(self) -> Path:
        """Where folds, table, figures and report go."""
        return self.out / "results"

    @property
    def state_file(self) -> Path:
        """What it began with."""
        return self.out / STATE_FILE

    def write_state(self, state: RunState) -> None:
        """Write down what it begins with, for `status` and for whoever reads it later."""
        write_json(self.state_file, state.model_dump())

    def read_state(self) -> RunState:
        """Return what it began with.

        Raises
        ------
        InputError
            If the file is damaged.
        """
        content = read_json(self.state_file, _WHAT, _AGAIN)
        return as_form(content, RunState, self.state_file, _WHAT, _AGAIN)

    def require_same(self, like: Like, choices: Mapping[str, str]) -> None:
        """Refuse to go on with a reproduction of other choices.

        Raises
        ------
        InputError
            Naming the first that differs.
        """
        if self.state_file.is_file():
            found = self.read_state()
            earlier, wanted = (
                {"like": of, **{n: v for n, v in its.items() if n not in _FREE}}
                for of, its in ((found.like, found.choices), (like, choices))
            )
            require_same_config(self.out, "a reproduction", earlier, wanted)
