"""Patterns of file names, such as ``{texture}/{speed}_{trial}.avi``."""

import glob
import re
from collections.abc import Mapping
from pathlib import Path

from afferents.errors import InputError, then
from afferents.files import is_hidden

TEXTURE, SPEED = "texture", "speed"
_PART = re.compile(r"\{([^{}*]*)\}|(\{\*\}|\*)")
_NAME = re.compile(r"[A-Za-z_]\w*")
_FORMS = {SPEED: r"[-+]?\d+(?:[.,]\d+)?"}
"""What may stand for a name; any part of a path for the others."""
_HOW = "write it as {texture}/{speed}_{trial}.avi"


def parse_speed(text: str) -> float:
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
