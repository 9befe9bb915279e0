"""Writing so that a file or folder is either whole or absent, and checksums."""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

from afferents.core.documents import read_json as read_json
from afferents.core.errors import InputError

PARTIAL_PREFIX = ".partial-"
"""Names that start like this are unfinished work of a run that was stopped; never data."""


@contextmanager
def write_aside(target: Path) -> Iterator[Path]:
    """Yield a temporary path beside `target`; rename it to `target` if the block succeeds.

    Works for files and folders. If the block raises, the temporary path is removed and an
    earlier `target` is left untouched. A folder that already stands at `target` is replaced.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.parent / f"{PARTIAL_PREFIX}{target.name}-{uuid4().hex[:8]}"
    try:
        yield partial
        if target.is_dir():
            shutil.rmtree(target)
        partial.replace(target)
    except BaseException:
        if partial.is_dir():
            shutil.rmtree(partial, ignore_errors=True)
        else:
            partial.unlink(missing_ok=True)
        raise


def remove_partials(folder: Path) -> None:
    """Remove what a run that was killed left unfinished anywhere below `folder`."""
    for partial in sorted(folder.rglob(f"{PARTIAL_PREFIX}*")):
        if partial.is_dir():
            shutil.rmtree(partial, ignore_errors=True)
        else:
            partial.unlink(missing_ok=True)


def write_json(target: Path, content: Any) -> None:
    """Write `content` as indented JSON, whole or not at all."""
    with write_aside(target) as partial:
        partial.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_text(target: Path, text: str) -> None:
    """Write text, whole or not at all; names of files in it need not be text themselves."""
    with write_aside(target) as partial:
        partial.write_text(text, encoding="utf-8", errors="backslashreplace")


def checksum(*paths: Path) -> str:
    """Return the SHA-256 (hex) of the files' contents, in the order given."""
    digest = hashlib.sha256()
    for path in paths:
        with path.open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def require_same_config(
    where: Path, kind: str, earlier: Mapping[str, Any], wanted: Mapping[str, Any]
) -> None:
    """Refuse to mix two configurations in one place.

    Parameters
    ----------
    where
        What was begun with `earlier` and is now asked to go on with `wanted`.
    kind
        What it holds, such as ``results``.

    Raises
    ------
    InputError
        Naming the first entry that differs.
    """
    differs = _first_difference(earlier, json.loads(json.dumps(wanted)))
    if differs:
        name, before, now = differs
        raise InputError(
            where,
            f"{kind} of this configuration ({name} {now})",
            f"{kind} of another ({name} {before})",
            "choose another place",
        )


def _first_difference(
    before: Mapping[str, Any], now: Mapping[str, Any]
) -> tuple[str, Any, Any] | None:
    """Return the name of the first entry that differs, and what it is in each."""
    for name in sorted({*before, *now}):
        one, other = before.get(name), now.get(name)
        if isinstance(one, dict) and isinstance(other, dict):
            if within := _first_difference(one, other):
                inner, one, other = within
                return f"{name}.{inner}", one, other
        elif one != other:
            return name, one, other
    return None
