"""Python processes in which modules, or names in them, are not there."""

import os
import subprocess
import sys

CUSTOMIZE = """
import sys
from importlib import import_module
from importlib.abc import MetaPathFinder


class Hidden(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {modules!r}:
            raise ModuleNotFoundError(f"No module named '{{name}}'", name=name)


sys.meta_path.insert(0, Hidden())
for name in {modules!r}:
    sys.modules.pop(name, None)
for name, attributes in {names!r}.items():
    for attribute in attributes:
        vars(import_module(name)).pop(attribute, None)
"""


def runner(folder, modules=(), names=None):
    """Return what runs a command, or Python's ``-c``, in `folder` without `modules` and `names`."""
    (folder / "hidden").mkdir()
    customize = CUSTOMIZE.format(modules=set(modules), names=dict(names or {}))
    (folder / "hidden/sitecustomize.py").write_text(customize)
    paths = [str(folder / "hidden"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}

    def run(*arguments):
        arguments = list(map(str, arguments))
        module = [] if arguments[0] == "-c" else ["-m", "afferents"]
        return subprocess.run(
            [sys.executable, *module, *arguments],
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )

    return run
