"""The command line: one function a command, each a thin call of the package's function."""

from afferents.cli.program import app, main

__all__ = ["app", "main"]
