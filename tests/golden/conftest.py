"""Scripts outside the package, for the tests of what they print."""

import importlib.util

import pytest


@pytest.fixture(scope="session")
def load():
    """Return what imports a script by its path."""

    def imported(path):
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return imported
