"""The command line: every command is a function of the package."""

from afferents.cli.program import main, run

__all__ = ["main", "run"]
