"""Which files hold a recording, folders of images among them, and patterns of their names."""

import glob
import os
import re
from collections.abc import Collection, Iterable, Mapping, Set
from pathlib import Path

from afferents.errors import InputError, reading, reason_of, then
from afferents.files import is_hidden, walk
from afferents.store.recording import natural_order

IMAGES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"})
"""Endings of what is taken for an image."""

VIDEOS = frozenset({".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg", ".wmv"})
SOUNDS = frozenset({".wav", ".flac", ".ogg", ".rf64"})
"""Endings that are taken for videos and for sound; a file that is named may end otherwise."""
OTHER_SOUNDS = frozenset(
    {".w64", ".aif", ".aiff", ".au", ".caf", ".mp3", ".opus", ".m4a", ".aac", ".amr", ".wma"}
)
"""Endings of sound that libsndfile can't read, or reads without a word where it was cut off."""

_NAMED = 3


def is_video(path: Path) -> bool:
    """Tell whether a name ends as those of videos do."""
    return path.suffix.lower() in VIDEOS


def is_sound(path: Path) -> bool:
    """Tell whether a name ends as those of sound files do."""
    return path.suffix.lower() in SOUNDS


def is_image_folder(path: Path) -> bool:
    """Tell whether a folder holds numbered images and no other recordings: it is a clip itself."""
    return path.is_dir() and any(map(_is_numbered, path.iterdir())) and media_in(path) == [path]


def _is_numbered(path: Path) -> bool:
    return path.suffix.lower() in IMAGES and path.stem[-1:].isdigit()


def is_bag(path: Path) -> bool:
    """Say whether a path looks like a bag of ROS: a file, or a folder of rosbag2."""
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


def media_in(root: Path, endings: Set[str] = VIDEOS | SOUNDS) -> list[Path]:
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
    """Say which files below a folder are not among those that are read, and why; see `media_in`."""
    known = {os.path.realpath(path) for path in taken}  # links to themselves, too
    try:
        paths = [path for path in media_in(root, endings) if os.path.realpath(path) not in known]
    except OSError as error:
        return [f"Files may be left out: {error.filename} can't be read ({reason_of(error)})."]
    files = "1 file is" if len(paths) == 1 else f"{len(paths)} files are"
    return [f"{files} left out: {named(root, paths)}; {why}."] if paths else []


def named(root: Path, paths: Collection[Path]) -> str:
    """Return some of the paths, as they lie below a folder, for a sentence."""
    shown = [str(path.relative_to(root)) for path in list(paths)[:_NAMED]]
    more = len(paths) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


# Patterns of file names, such as ``{texture}/{speed}_{trial}.avi``.

TEXTURE, SPEED = "texture", "speed"
_PART = re.compile(r"\{([^{}*]*)\}|(\{\*\}|\*)")
_NAME = re.compile(r"[A-Za-z_]\w*")
_FORMS = {SPEED: r"[-+]?\d+(?:[.,]\d+)?"}
"""What may stand for a name; any part of a path for the others."""
_HOW = "write it as {texture}/{speed}_{trial}.avi"


def as_speed(text: str) -> float:
    """Return the speed that a name holds: 12.5 or, with a decimal comma, 12,5; no sign.

    Raises
    ------
    ValueError
        If it is no number.
    """
    return abs(float(text.replace(",", ".")))


class Pattern:
    """A pattern of paths in a folder, in which names in braces stand for parts of a path.

    ``*`` or ``{*}`` is any text, and a speed may have a sign, which says a direction.

    >>> found = Pattern("{texture}_{speed}.avi").values("soft_felt_20.avi")
    >>> found["texture"], found["speed"]
    ('soft_felt', '20')

    Raises
    ------
    InputError
        If a brace is open, a name is missing or stands twice, or the path leads elsewhere.
    """

    def __init__(self, text: str, where: Path | str = "pattern") -> None:
        self.text, self.where, self._suffix = text, where, ""
        self.names = [name for name, star in _PART.findall(text) if not star]
        parts, names = Path(text).parts, self.names
        open_brace = re.search(r"[{}]", _PART.sub("", text))
        for wrong, expected, do in (
            (open_brace or not all(map(_NAME.fullmatch, names)), "with names in braces", _HOW),
            ("speed_mm_s" in names, "with {speed}", "the speed is in mm/s"),
            (len(set(names)) < len(names), "with each name once", _HOW),
            (
                not parts or Path(text).is_absolute() or ".." in parts,
                "of paths in its folder",
                _HOW,
            ),
        ):
            if wrong:
                raise InputError(f"{where}: expected a pattern {expected}, found '{text}'; {do}")
        # Whatever the case of its ending: recorders write .WAV as well as .wav.
        self._stem, suffix = text.rstrip("/"), Path(text).suffix
        if not re.search(r"[{}*]", suffix):
            self._stem, self._suffix = self._stem.removesuffix(suffix), suffix
        self._short, self._long = (re.compile(self._regex(lazy)) for lazy in ("?", ""))

    def _regex(self, lazy: str) -> str:
        """Return the regular expression; names take as little as can be if `lazy`, else as much."""
        made, end = "", 0
        for part in _PART.finditer(self._stem):
            made += re.escape(self._stem[end : part.start()])
            form = _FORMS.get(part[1], rf"[^/]+{lazy}")
            made += rf"[^/]*{lazy}" if part[2] else f"(?P<{part[1]}>{form})"
            end = part.end()
        return made + re.escape(self._stem[end:]) + f"(?i:{re.escape(self._suffix)})"

    def values(self, path: str) -> Mapping[str, str] | None:
        """Return what the names stand for in a path; None if it is none of the pattern.

        Raises
        ------
        InputError
            If it can be read in two ways.
        """
        short, long = self._short.fullmatch(path), self._long.fullmatch(path)
        if short is None or long is None:
            return None
        for name, value in short.groupdict().items():
            if long[name] != value:
                found = f"{path}, where {name} may be '{value}' or '{long[name]}'"
                do = "choose a pattern with more of the names' letters in it, or list the files"
                raise InputError(
                    f"{self.where}: expected paths that '{self.text}' reads in one way, found "
                    f"{found}{then(do)}"
                )
        return short.groupdict()

    def paths_in(self, root: Path) -> list[tuple[Path, Mapping[str, str]]]:
        """Return the paths in a folder that it fits, with what its names stand for."""
        is_folder = self.text.endswith("/")
        literal = [glob.escape(text) for text in _PART.sub("\n", self._stem).split("\n")]
        literal += [""] if self._suffix else []
        found = []
        for path in sorted(root.glob(re.sub(r"\*+", "*", "*".join(literal)))):
            inner = path.relative_to(root)
            if path.is_dir() != is_folder or is_hidden(inner):
                continue
            values = self.values(inner.as_posix())
            if values is not None:
                found.append((path, values))
        return found

    def filled(self, values: Mapping[str, str]) -> str:
        """Return the path that names of these values give.

        Raises
        ------
        InputError
            If it has names that have none.
        """
        strange = [name for name in self.names if name not in values]
        if strange or "*" in self.text:
            expected = "the names of 'pattern' and no '*'"
            raise InputError(
                f"{self.where}: expected {expected}, found '{self.text}'; use the same names in "
                "both"
            )
        return _PART.sub(lambda part: values[part[1]], self.text)
