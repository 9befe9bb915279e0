"""Which files hold a recording, folders of images among them."""

import os
from collections.abc import Collection, Iterable, Set
from pathlib import Path

from afferents.errors import InputError, reading, reason_of
from afferents.files import walk
from afferents.store.recording import natural_order

IMAGES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"})
"""Endings of images."""

VIDEOS = frozenset({".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg", ".wmv"})
SOUNDS = frozenset({".wav", ".flac", ".ogg", ".rf64"})
"""Endings of videos and of sound; a file that is named may end otherwise."""
OTHER_SOUNDS = frozenset(
    {".w64", ".aif", ".aiff", ".au", ".caf", ".mp3", ".opus", ".m4a", ".aac", ".amr", ".wma"}
)
"""Endings of sound that libsndfile can't read, or reads without a word where it was cut off."""

_NAMED = 3


def is_video(path: Path) -> bool:
    """Return whether a name ends as those of videos do."""
    return path.suffix.lower() in VIDEOS


def is_sound(path: Path) -> bool:
    """Return whether a name ends as those of sound files do."""
    return path.suffix.lower() in SOUNDS


def is_image_folder(path: Path) -> bool:
    """Return whether a folder holds numbered images alone: it is a clip itself."""
    return path.is_dir() and any(map(_is_numbered, path.iterdir())) and find_media(path) == [path]


def _is_numbered(path: Path) -> bool:
    return path.suffix.lower() in IMAGES and path.stem[-1:].isdigit()


def is_bag(path: Path) -> bool:
    """Return whether a path looks like a bag of ROS: a file, or a folder of rosbag2."""
    return path.suffix in (".mcap", ".bag", ".db3") or (path / "metadata.yaml").is_file()


def refuse_bag(path: Path) -> None:
    """Refuse a bag of ROS, or a folder of such, where recordings are expected."""
    if not path.exists():
        return
    with reading(path, "a readable folder", OSError):
        inside = sorted(path.iterdir()) if path.is_dir() else []
    if bag := next(filter(is_bag, (path, *inside)), None):
        raise InputError(
            f"{path}: expected recordings, found a bag of ROS ({bag.name}); 'afferents import "
            f"{bag} --session SESSION --texture TEXTURE --speed SPEED' makes it one of a session: "
            "give that"
        )


def find_media(root: Path, endings: Set[str] = VIDEOS | SOUNDS) -> list[Path]:
    """Return all files of these endings below a folder, in order.

    Where they are those of videos, folders of numbered images count as such.
    Hidden folders are not looked into, and no folder is entered from within itself.

    Raises
    ------
    OSError
        If a folder can't be read.
    """

    def order(path: Path) -> list[tuple[float, str]]:
        return [natural_order(part) for part in path.relative_to(root).parts]

    found: list[Path] = []
    for folder, files in walk(root):
        found += [path for path in files if path.suffix.lower() in endings]
        if endings & VIDEOS and sum(map(_is_numbered, files)) > 1:
            found.append(folder)
    return sorted(found, key=order)


def left_out(root: Path, taken: Iterable[Path], endings: Set[str], why: str) -> list[str]:
    """Return which files below a folder are not read, and why; see `find_media`."""
    known = {os.path.realpath(path) for path in taken}  # links to themselves, too
    try:
        paths = [path for path in find_media(root, endings) if os.path.realpath(path) not in known]
    except OSError as error:
        return [f"Files may be left out: {error.filename} can't be read ({reason_of(error)})."]
    files = "1 file is" if len(paths) == 1 else f"{len(paths)} files are"
    return [f"{files} left out: {named(root, paths)}; {why}."] if paths else []


def named(root: Path, paths: Collection[Path]) -> str:
    """Return some of the paths, as they lie below a folder, for a sentence."""
    shown = [str(path.relative_to(root)) for path in list(paths)[:_NAMED]]
    more = len(paths) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")
