"""The command line: one function a command, each a thin call of `commands` or the pipeline.

`app` lists the commands; a module a group says what they take and print; `shared` has the options
that several take, `encodings` those that encodings declare; `errors` turns what goes wrong into
sentences and exit codes. Whatever takes long to import is imported inside the functions.
"""

from afferents.cli.app import app, main

__all__ = ["app", "main"]
