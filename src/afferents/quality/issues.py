"""What is wrong with a recording that decodes well: refused, or kept and named."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from afferents.errors import InputError, then

Kind = Literal["length", "dark", "frozen", "repeated", "loud"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""What is refused, unless `--accept` names it."""
Noted = Literal[
    "knocked", "gaps", "uneven", "stalled", "doubled", "damaged", "faint", "overexposed", "blurred",
    "silent", "clipped", "turned",
]  # fmt: skip
"""What is named, and kept: learning from it is a choice."""
MOST_NAMED = 3
"""Recordings that a sentence names."""


@dataclass(frozen=True)
class QualityIssue:
    """One thing that is wrong.

    Attributes
    ----------
    kind
        By which it can be accepted, or recordings be left out.
    where, expected, found
        As of an `InputError`.
    cause
        What may be the reason, and then to be done, in a clause; empty where nothing suggests one.
    """

    kind: Kind | Noted
    where: object
    expected: str
    found: str
    cause: str = ""

    @property
    def error(self) -> InputError:
        """The refusal, which says how to accept it."""
        do = f"record it again, or keep it as it is with --accept {self.kind}"
        if self.cause:
            do = f"{self.cause}; else {do}"
        return InputError(f"{self.where}: expected {self.expected}, found {self.found}{then(do)}")

    @property
    def is_refused(self) -> bool:
        """Whether a recording with it is not used unless the user accepts it."""
        return self.kind in KINDS

    @property
    def what(self) -> str:
        """What is wrong, without where; with what follows, where it is only named."""
        follows = "" if self.is_refused else then(self.cause)
        return f"expected {self.expected}, found {self.found}{follows}"

    @property
    def sentence(self) -> str:
        """The kind and what is wrong, as a sentence."""
        return f"{self.kind.title()}: {self.what}."

    def __str__(self) -> str:
        """Name the kind and what is wrong."""
        return f"{self.kind}: {self.what}"


def parse_kinds(names: Collection[str]) -> frozenset[Kind]:
    """Return what `--accept` names.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    for name in names:
        if name not in KINDS:
            raise InputError(f"--accept: expected one of {', '.join(KINDS)}, found '{name}'")
    return frozenset(kind for kind in KINDS if kind in names)


def require_accepted(
    issues: Iterable[QualityIssue], accept: Collection[Kind]
) -> list[QualityIssue]:
    """Return the issues, if all are accepted or only named.

    Raises
    ------
    InputError
        The first that is refused.
    """
    kept = list(issues)
    for issue in kept:
        if issue.is_refused and issue.kind not in accept:
            raise issue.error
    return kept


def describe_issues(issues: Mapping[str, Sequence[str]]) -> list[str]:
    """Describe what is wrong with recordings, a sentence a kind.

    Parameters
    ----------
    issues
        Of each recording by its name, each as `str` of a `QualityIssue`.
    """
    by_kind: dict[str, dict[str, str]] = {}
    for name, found in issues.items():
        for issue in found:
            kind, _, what = issue.partition(": ")
            by_kind.setdefault(kind, {})[name] = what
    sentences = []
    for kind, whats in by_kind.items():
        first, *others = whats
        names = ", ".join(others[: MOST_NAMED - 1])
        more = f" and {len(whats) - MOST_NAMED} more" if len(whats) > MOST_NAMED else ""
        also = f"; so are {names}{more}" if others else ""
        sentences.append(f"{kind.title()}: {first}: {whats[first]}{also}.")
    return sentences
