"""What `reproduce` chooses: as the paper's code did it, or as we recommend. One table for both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from afferents.choices import MODELS_ASKED, PRESET_ASKED, Like


@dataclass(frozen=True)
class Choice:
    """One option that differs, or could differ, between what was published and what we recommend.

    Attributes
    ----------
    name, flag
        Of the option, in Python and in the shell.
    recommended, published
        Its value; None where recordings say it themselves.
    meaning
        What the published value stands for, in words.
    """

    name: str
    flag: str
    recommended: str | float | None
    published: str | float
    meaning: str

    def of(self, like: Like) -> str | float | None:
        """Return its value for one of the two."""
        return self.published if like == "published" else self.recommended


CHOICES = (
    Choice(
        "method", "--tracker", "windowed", "published",
        "the nearest blob within 10 px, else the old position; two markers may share a blob",
    ),
    Choice("rest", "--rest", "own", "own", "SA-I counts from frame 10 of each recording"),
    Choice(
        "fps_hz", "--fps", None, 90.0,
        "frames count a ninetieth of a second each, whatever the videos' containers say",
    ),
    Choice("cut", "--cut", "all", "published", "video frames 510 to 5509, the last 60 s of sound"),
    Choice(
        "protocol", "--protocol", "nested", "published",
        "half of the held-out speed picks the model, the other half is tested",
    ),
    Choice("models", "--models", MODELS_ASKED, "all", "the six of Table 1"),
    Choice(
        "preset", "--preset", PRESET_ASKED, "paper",
        "Adam at 0.001 (SE) and 0.0001 (STE, TE), batches of 64, patience 20, 20 and 10, at most "
        "150 epochs",
    ),
    Choice(
        "statistics", "--statistics", "warmed-up", "keras",
        "running statistics of batch normalisation from 0 and 1, momentum 0.99",
    ),
    Choice("precision", "--precision", "auto", "float32", "no bfloat16"),
)  # fmt: skip

NEUTRAL = frozenset({"workers", "cluster", "device", "keep_going", "accept", "seed", "seeds"})
"""Options that leave the experiment as it is: where it is computed, and from which seeds."""


def choose(like: Like, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return every choice: what is given by name, else what `like` says."""
    return {choice.name: given.get(choice.name) or choice.of(like) for choice in CHOICES}


def choices_in_words(like: Like, given: Mapping[str, Any]) -> list[str]:
    """Return a line for each choice; published ones say what they stand for."""
    values = choose(like, given)
    return [
        f"{one.flag} {format_choice(values[one.name])}"
        + (f": {one.meaning}" if values[one.name] == one.published else "")
        for one in CHOICES
        if values[one.name] is not None
    ]


def format_choice(value: Any) -> str:
    """Return what a choice is as a shell has it: several models separated by commas."""
    if value is None:
        return "as recordings say"
    several = value if isinstance(value, list | tuple) else [value]
    return ",".join(
        f"{one:g}" if isinstance(one, float) else str(getattr(one, "name", one)) for one in several
    )


def list_changes(like: Like, given: Mapping[str, Any], others: Sequence[str] = ()) -> list[str]:
    """Return what is asked for otherwise than `like` says, a sentence each.

    Parameters
    ----------
    given
        Options by name in Python, those that were given alone.
    others
        What else is asked for that changes what is computed.
    """
    changed = [
        f"{one.flag} {format_choice(given[one.name])} ({like}: {format_choice(one.of(like))})"
        for one in CHOICES
        if one.name in given and given[one.name] != one.of(like)
    ]
    return [*changed, *others]
