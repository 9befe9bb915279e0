"""The package's version, as it was installed: from the git tag, when the package was built.

Help does not import this: to read it takes longer than all else that help needs.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("afferents")
except PackageNotFoundError:  # a folder on the path, never installed
    __version__ = "0+unknown"
