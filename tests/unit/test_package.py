"""What is installed is this package."""

from importlib.metadata import version

import afferents


def test_the_version_is_the_one_that_is_installed(run):
    assert afferents.__version__ == version("afferents")
    assert run("--version") == (0, f"{afferents.__version__}\n", "")
