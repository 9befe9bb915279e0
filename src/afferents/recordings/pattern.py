"""Patterns of file names, such as ``{texture}/{speed}_{trial}.avi``."""

import glob
import re
from collections.abc import Mapping
from pathlib import Path

from afferents.core.errors import InputError

TEXTURE, SPEED = "texture", "speed"
_PART = re.compile(r"\{([^{}]*)\}|(\*)")
_NAME = re.compile(r"[A-Za-z_]\w*")
_FORMS = {SPEED: r"\d+(?:\.\d+)?"}
"""What may stand for a name; any part of a path for the others."""
_HOW = "write it as {texture}/{speed}_{trial}.avi"


class Pattern:
    """A pattern of paths in a folder, in which names in braces stand for parts of a path.

    >>> found = Pattern("{texture}_{speed}.avi").values("soft_felt_20.avi")
    >>> found["texture"], found["speed"]
    ('soft_felt', '20')

    Raises
    ------
    InputError
        If a brace is open, a name is missing or stands twice, or the path leads elsewhere.
    """

    def __init__(self, text: str, where: Path | str = "pattern") -> None:
        self.text, self.where = text, where
        self.names = [name for name, star in _PART.findall(text) if not star]
        wrong = [name for name in self.names if not _NAME.fullmatch(name)]
        parts = Path(text).parts
        if wrong or re.search(r"[{}]", _PART.sub("", text)):
            raise InputError(where, "a pattern with names in braces", f"'{text}'", _HOW)
        if len(set(self.names)) < len(self.names):
            raise InputError(where, "a pattern with each name once", f"'{text}'", _HOW)
        if not parts or Path(text).is_absolute() or ".." in parts:
            raise InputError(where, "a pattern of paths in the session's folder", f"'{text}'", _HOW)
        self._short, self._long = (re.compile(self._regex(lazy)) for lazy in ("?", ""))

    def _regex(self, lazy: str) -> str:
        """Return the regular expression; names take as little as can be if `lazy`, else as much."""
        made, end = "", 0
        for part in _PART.finditer(self.text.rstrip("/")):
            made += re.escape(self.text[end : part.start()])
            form = _FORMS.get(part[1], rf"[^/]+{lazy}")
            made += rf"[^/]*{lazy}" if part[2] else f"(?P<{part[1]}>{form})"
            end = part.end()
        return made + re.escape(self.text.rstrip("/")[end:])

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
                    self.where, f"paths that '{self.text}' reads in one way", found, do
                )
        return short.groupdict()

    def paths_in(self, root: Path) -> list[tuple[Path, Mapping[str, str]]]:
        """Return the paths in a folder that it fits, with what its names stand for."""
        is_folder = self.text.endswith("/")
        literal = [glob.escape(text) for text in _PART.sub("\n", self.text.rstrip("/")).split("\n")]
        found = []
        for path in sorted(root.glob(re.sub(r"\*+", "*", "*".join(literal)))):
            inner = path.relative_to(root)
            if path.is_dir() != is_folder or any(part.startswith(".") for part in inner.parts):
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
            raise InputError(self.where, expected, f"'{self.text}'", "use the same names in both")
        return _PART.sub(lambda part: values[part[1]], self.text)
