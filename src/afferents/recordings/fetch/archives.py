"""Public data sets that `afferents fetch` knows, and lists of their files with checksums."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from urllib.parse import quote, urljoin

from afferents.errors import InputError, reading

# A list of files with their checksums: text, a file a line.
#
# A line is ``PATH SHA-256 BYTES``, where a ``-`` stands for what is not known, or as the program
# ``sha256sum`` writes it, ``SHA-256  PATH``. Lines that begin with ``#`` are left out.

UNKNOWN = "-"
_SHA256 = r"(?P<sha256>[0-9a-fA-F]{64}"
_OURS = re.compile(rf"(?P<path>.+?)\s+{_SHA256}|-)\s+(?P<bytes>\d+|-)")
_THEIRS = re.compile(rf"{_SHA256})\s+\*?(?P<path>.+)")


@dataclass(frozen=True)
class RemoteFile:
    """A file on a server.

    Attributes
    ----------
    path
        Where it goes, from the folder that all go into.
    url
        Where it is.
    sha256
        Hex; None where it is not known.
    n_bytes
        None where it is not known.
    """

    path: str
    url: str
    sha256: str | None = None
    n_bytes: int | None = None


def read_manifest(path: Path, url: str) -> list[RemoteFile]:
    """Read a list of files.

    Parameters
    ----------
    url
        What their paths count from on the server.

    Raises
    ------
    InputError
        If it can't be read, names none, or has a line that is none of a list; naming the line.
    """
    with reading(path, "a list of files", OSError, UnicodeDecodeError):
        lines = path.read_text(encoding="utf-8").splitlines()
    base = url if url.endswith("/") else f"{url}/"
    found: dict[str, RemoteFile] = {}
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.startswith("#"):
            one = _read_line(line.strip(), base, f"line {number} of {path}")
            found[one.path] = one
    if not found:
        raise InputError(f"{path}: expected a list of files, found none in it")
    return list(found.values())


def _read_line(line: str, base: str, where: str) -> RemoteFile:
    found = _THEIRS.fullmatch(line) or _OURS.fullmatch(line)
    if found is None:
        raise InputError(
            f"{where}: expected PATH SHA-256 BYTES, or '-' for what is not known, found '{line}'"
        )
    parts = found.groupdict(UNKNOWN)
    path, sha256, n_bytes = parts["path"], parts["sha256"], parts.get("bytes", UNKNOWN)
    return RemoteFile(
        path_within(path, where),
        urljoin(base, quote(path)),
        None if sha256 == UNKNOWN else sha256.lower(),
        None if n_bytes == UNKNOWN else int(n_bytes),
    )


def path_within(path: str, where: object) -> str:
    """Return a path that a server or a list names, if it stays in the folder.

    Raises
    ------
    InputError
        If it leads elsewhere, or has a name that begins with a dot.
    """
    parts = PurePosixPath(path).parts
    bad = not parts or path.startswith("/") or any(letter in path for letter in "\\:\0")
    if bad or any(part.startswith(".") for part in parts):
        raise InputError(f"{where}: expected paths of files within the data set, found '{path}'")
    return "/".join(parts)


def format_manifest(files: Iterable[RemoteFile]) -> str:
    """Return a list as `read_manifest` reads it."""
    return "".join(
        f"{one.path} {one.sha256 or UNKNOWN} {UNKNOWN if one.n_bytes is None else one.n_bytes}\n"
        for one in files
    )


# Public data sets that `afferents fetch` knows: a row each.

_CLUSTER = "https://huggingface.co/api/datasets/tamago117/cluster-haptic-texture-dataset/tree/main"
FABRICSLIDE_COMMIT = "eceb7716027cd1bcb5e614927f4cc2d0904adb25"


@dataclass(frozen=True)
class Archive:
    """A public data set and where it is.

    Attributes
    ----------
    name
        In commands.
    title
        In sentences: what it is, and of whom.
    page
        What a person reads of it.
    licence
        As far as it is known here.
    url
        What is asked for its files, see `listing.list_files`, or, with a `manifest`, what the paths
        in that count from.
    manifest
        The list of its files in this package; None where the server lists them.
    next_step
        What to do with it, with ``{folder}`` for where it is.
    """

    name: str
    title: str
    page: str
    url: str
    next_step: str
    licence: str = ""
    manifest: Path | None = None


_ROWS = (
    Archive(
        "pestell2022",
        "Pestell & Lepora (2022), the recordings of the paper: 13 textures at 10 speeds",
        page="https://doi.org/10.5523/bris.3ex175ojw0ckt25icp6g6p9j12",
        url="https://data.bris.ac.uk/datasets/3ex175ojw0ckt25icp6g6p9j12/",
        next_step="afferents inspect {folder}",
    ),
    Archive(
        "fabricslide",
        "FabricSlide, Wang et al. (2022): a capacitive finger slid over fabrics; its CSV files at "
        f"commit {FABRICSLIDE_COMMIT[:10]}",
        page="https://github.com/wngfra/FabricSlide",
        url=f"https://raw.githubusercontent.com/wngfra/FabricSlide/{FABRICSLIDE_COMMIT}/",
        licence="MIT",
        manifest=Path(__file__).parent / "fabricslide.txt",
        next_step="afferents inspect fabricslide:{folder}",
    ),
    *(
        Archive(
            f"cluster-haptic-{kind}",
            f"Cluster Haptic Texture Dataset, Eguchi et al. (2026): 118 surfaces, the {what}",
            page="https://doi.org/10.6084/m9.figshare.29438288",
            url=f"{_CLUSTER}/sensor_data/{kind}",
            licence="CC BY 4.0",
            next_step=f"afferents inspect cluster-haptic-{kind}:{{folder}}",
        )
        for kind, what in (("accel", "acceleration"), ("audio", "sound"))
    ),
)
ARCHIVES: Mapping[str, Archive] = MappingProxyType({one.name: one for one in _ROWS})


def archive_named(name: str) -> Archive:
    """Return a data set by its name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in ARCHIVES:
        raise InputError(f"fetch: expected one of {', '.join(ARCHIVES)}, found '{name}'")
    return ARCHIVES[name]
