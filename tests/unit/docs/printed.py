"""The commands that the README and the pages print, and where."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

from afferents.cli.program import COMMANDS, find_name, read_given

ROOT = Path(__file__).resolve().parents[3]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
WITH_COMMANDS = [ROOT / "README.md", *PAGES]


class Printed(NamedTuple):
    """A command of a page, in one line, with what may be left out, and without its comment."""

    line: int
    text: str


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)


def printed_on(page):
    """Yield the commands in the code blocks of a page."""
    inside, begun = False, ""
    for number, line in enumerate(page.read_text().splitlines(), start=1):
        if line.lstrip().startswith("```"):
            inside = not inside
        elif inside and line.endswith("\\"):
            begun += line[:-1]
        elif inside:
            whole, begun = begun + line, ""
            if whole.lstrip().startswith("afferents "):
                yield Printed(number, typed(whole))


def typed(line):
    """Return what is typed: brackets are round what may be left out, ... stands for more of it."""
    alone = line.partition(" | ")[0]  # what it is piped into is no command of ours
    bare = alone.translate({ord("["): "", ord("]"): ""}).replace(" ... ", " ")
    return shlex.join(shlex.split(bare, comments=True))


def commands(page):
    return [one.text for one in printed_on(page)]


def understood(text):
    """Return what a command is given by name, as it is parsed."""
    return read_given(shlex.split(text)[1:])


def flags_of(text):
    """Return the options that a command has."""
    command = COMMANDS[find_name(shlex.split(text)[1:])]
    return {command.flag(one) for one in command.arguments}
