"""Commands that record: a session from a plan, and files recorded elsewhere."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from afferents.commands.given import Place
from afferents.core.errors import InputError
from afferents.core.progress import Progress

if TYPE_CHECKING:
    from afferents.pipeline.record.record import Recorded


def record(
    plan: Place,
    session: Place,
    dry_run: bool = False,
    ask: Callable[[str], None] | None = None,
    quiet: bool = False,
) -> "Recorded":
    """Record a session: camera, microphone and drum on one clock, run after run of a plan.

    Parameters
    ----------
    plan
        A ``PLAN.toml``; ``afferents record --example PLAN.toml`` writes one.
    session
        Folder to write, in the published layout; runs that are in it are kept.
    dry_run
        Record the simulated rig instead of the plan's devices, four times as fast as in truth.
    ask
        Shows a person a sentence, such as ``change the drum to 4``, and returns when it is done;
        None for a line in the terminal.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Recorded
        Names of the runs that were recorded, and what was refused and why.

    Raises
    ------
    InputError
        If the plan or a device is not what it should be, the session is of another plan, or the
        disk is full. What is finished is kept.
    """
    from afferents.pipeline.record.record import record as run
    from afferents.pipeline.record.record import recording_of

    wanted = recording_of(Path(plan), dry_run, ask or ask_in_terminal)
    with Progress(quiet) as progress:
        return run(wanted, Path(session), progress)


def ask_in_terminal(sentence: str) -> None:
    """Show a sentence and wait for enter.

    Raises
    ------
    InputError
        If nobody is there to press it.
    """
    print(f"\n>>> {sentence}", file=sys.stderr, flush=True)  # noqa: T201
    if not sys.stdin.readline():
        raise InputError("stdin", "somebody who changes drums and presses enter", "nobody")
