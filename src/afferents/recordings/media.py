"""Files that hold a recording: videos of any container, folders of images, sound."""

from collections.abc import Collection, Iterator
from pathlib import Path

from afferents.core.recording import natural_order
from afferents.recordings.images import IMAGES

VIDEOS = frozenset({".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg", ".wmv"})
SOUNDS = frozenset({".wav", ".flac", ".ogg", ".aiff", ".aif", ".w64", ".rf64"})
"""Endings that are taken for videos and for sound; a file that is named may end otherwise."""

_NAMED = 3


def is_video(path: Path) -> bool:
    """Tell whether a name ends as those of videos do."""
    return path.suffix.lower() in VIDEOS


def is_sound(path: Path) -> bool:
    """Tell whether a name ends as those of sound files do."""
    return path.suffix.lower() in SOUNDS


def media_in(root: Path, passed: Collection[str] = ()) -> list[Path]:
    """Return all videos and sound files below a folder, and folders of numbered images, in order.

    Parameters
    ----------
    passed
        Folders right below `root` that are not looked into; hidden ones never are.

    Raises
    ------
    OSError
        If a folder can't be read.
    """
    return sorted(_media_in(root, passed), key=lambda path: _order(path.relative_to(root)))


def _media_in(folder: Path, passed: Collection[str]) -> Iterator[Path]:
    images = 0
    for path in folder.iterdir():
        if path.name.startswith(".") or path.name in passed:
            continue
        if path.is_dir():
            yield from _media_in(path, ())
        elif is_video(path) or is_sound(path):
            yield path
        images += path.suffix.lower() in IMAGES and path.stem[-1:].isdigit()
    if images > 1:
        yield folder


def _order(path: Path) -> list[tuple[float, str]]:
    return [natural_order(part) for part in path.parts]


def named(root: Path, paths: Collection[Path]) -> str:
    """Return some of the paths, as they lie below a folder, for a sentence."""
    shown = [str(path.relative_to(root)) for path in list(paths)[:_NAMED]]
    more = len(paths) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")
