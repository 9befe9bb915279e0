"""Public data sets that `afferents fetch` knows: a row each."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

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
        As far as it is known here; where it is empty, the landing page is asked.
    url
        What is asked: a DOI's address or a landing page, or, with a `manifest`, what the paths in
        that count from.
    key
        Its name on the server; see `landing.files_on`.
    manifest
        The list of its files in this package; None where the landing page lists them.
    extent
        What is known of its size.
    next_step
        What to do with it, with ``{folder}`` for where it is.
    tried
        Whether anybody has fetched it from the real server with this program.
    """

    name: str
    title: str
    page: str
    url: str
    next_step: str
    licence: str = ""
    key: str = ""
    manifest: Path | None = None
    extent: str = ""
    tried: bool = False


_ROWS = (
    Archive(
        "pestell2022",
        "Pestell & Lepora (2022), the recordings of the paper: 13 textures at 10 speeds",
        page="https://doi.org/10.5523/bris.3ex175ojw0ckt25icp6g6p9j12",
        url="https://doi.org/10.5523/bris.3ex175ojw0ckt25icp6g6p9j12",
        key="3ex175ojw0ckt25icp6g6p9j12",
        next_step="afferents inspect {folder}",
    ),
    Archive(
        "fabricslide",
        "FabricSlide, Wang et al. (2022): a capacitive finger slid over fabrics",
        page="https://github.com/wngfra/FabricSlide",
        url=f"https://raw.githubusercontent.com/wngfra/FabricSlide/{FABRICSLIDE_COMMIT}/",
        licence="MIT",
        manifest=Path(__file__).parent / "fabricslide.txt",
        extent=f"its CSV files at commit {FABRICSLIDE_COMMIT[:10]}, nothing else of the repository",
        next_step="afferents inspect fabricslide:{folder}",
    ),
)
ARCHIVES: Mapping[str, Archive] = MappingProxyType({one.name: one for one in _ROWS})
