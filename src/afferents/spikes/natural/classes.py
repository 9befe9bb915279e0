"""What afferents are called in files, as the package's three classes."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from afferents.core.errors import InputError

_KNOWN = {
    "SA": ("sa", "sa1", "sai", "slowlyadapting"),
    "RA": ("ra", "ra1", "rai", "fa1", "fai", "qa", "rapidlyadapting"),
    "PC": ("pc", "ra2", "raii", "fa2", "faii", "pacinian"),
}


def classes_of(words: Iterable[object], own: Mapping[str, str], where: Path | str) -> list[str]:
    """Return `SA`, `RA` or `PC` for each word.

    Parameters
    ----------
    own
        The user's words, which go first.

    Raises
    ------
    InputError
        Naming the first that is not known.
    """
    known = {word: name for name, all_words in _KNOWN.items() for word in all_words}
    found = []
    for word in words:
        text = as_text(word)
        name = own.get(text) or known.get(re.sub(r"[\W_]", "", text).lower())
        if name is None:
            raise InputError(
                where,
                "classes SA, RA or PC of fibres",
                f"'{text}'",
                f"say in words which of them '{text}' is",
            )
        found.append(name)
    return found


def as_text(value: object) -> str:
    """Return a label as text: a whole number without a decimal point."""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    return value.decode() if isinstance(value, bytes) else str(value)
