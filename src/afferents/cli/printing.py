"""What commands print on stdout: JSON for scripts, or lines and tables for people."""

import json
import sys
from collections.abc import Iterable
from typing import Any

from rich.console import Console

from afferents.cli.errors import no_room
from afferents.core.errors import AfferentsError


def say(as_json: bool, content: Any, *lines: Any) -> None:
    """Print the outcome of a command.

    Parameters
    ----------
    as_json
        Whether `content` is printed as JSON, and not the lines.
    lines
        Sentences, which are not wrapped, and tables of rich.

    Raises
    ------
    AfferentsError
        If stdout is full.
    """
    try:
        _print(as_json, content, lines)
        sys.stdout.flush()
    except BrokenPipeError:
        raise  # who reads has heard enough
    except OSError as error:
        raise AfferentsError(no_room(error)) from error


def _print(as_json: bool, content: Any, lines: Iterable[Any]) -> None:
    if as_json:
        print(json.dumps(content, indent=2, default=str))  # noqa: T201
        return
    console = Console(highlight=False, markup=False)
    for line in lines:
        console.print(line, soft_wrap=isinstance(line, str))
