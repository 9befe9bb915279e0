"""Recorder, neuroscience and exchange are wings: the rest works without any of them."""

import subprocess
import sys

import pytest

WITHOUT = """
import sys
from importlib.abc import MetaPathFinder

class Removed(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split('.')[:2] == ['afferents', {wing!r}]:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Removed())
import pkgutil
from importlib import import_module
import afferents
for part in pkgutil.walk_packages(afferents.__path__, 'afferents.'):
    if part.name.split('.')[1] not in ('__main__', 'recorder', 'neuro', 'exchange'):
        if not part.name.endswith('guard_process'):
            import_module(part.name)
from afferents import cli
cli.app(['inspect', '--help'], standalone_mode=False)
"""


@pytest.mark.parametrize("wing", ["recorder", "neuro", "exchange"])
def test_the_package_works_without_a_wing(wing):
    code = WITHOUT.format(wing=wing)
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert "inspect" in said.stdout
