"""The package's version, as it was installed: from the git tag, when the package was built.

Help does not import this: to read it takes longer than all else that help needs.
"""

from importlib.metadata import PackageNotFoundError, version


def _installed() -> str:
    try:
        return version("afferents")
    except PackageNotFoundError:  # a folder on the path, never installed
        return "0+unknown"


__version__ = _installed()
