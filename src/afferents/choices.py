"""What may be chosen by name or number, spelled once for commands in the shell and in Python."""

import math
from collections.abc import Iterable
from typing import Final, Literal

from afferents.errors import InputError

Device = Literal["auto", "cpu", "cuda"]
"""Where networks learn; ``auto`` takes a GPU if there is one."""
Precision = Literal["auto", "float32", "bfloat16"]
"""Numbers that networks learn in."""
Preset = Literal["quick", "fast", "paper"]
"""Training recipes of networks."""
MODELS_ASKED: Final = "best,all"
PRESET_ASKED: Final = "fast"
"""What is evaluated where nobody says otherwise, in the shell and in Python: what we recommend for
the data and the paper's six, trained so that their numbers can be quoted."""
Method = Literal["windowed", "one-to-one", "published"]
"""How markers are matched from frame to frame."""
Rest = Literal["own", "reference"]
"""Where SA-I counts from: each recording's own rest frame, or the reference clip's."""
Statistics = Literal["warmed-up", "keras"]
"""Running statistics of batch normalisation: plain averages first, or from 0 and 1 as in Keras."""
Layout = Literal["square", "hexagonal", "radial", "free", "cells"]
"""How markers are arranged, or that there are none and cells of the picture stand for them."""
Size = Literal["quick", "paper"]
"""Of a simulated session."""
Remount = Literal["session", "drum", "run"]
"""How often the simulated fingertip is mounted anew."""
Nodules = Literal["on", "off"]
"""Whether the simulated skin has its fingerprint."""
Like = Literal["recommended", "published"]
"""Whose choices `reproduce` goes by: ours, or those of the paper's code."""
Penalty = Literal["fixed", "searched"]
"""Strength of a ridge's penalty: the usual one, or chosen inside each fold."""
Control = Literal["none", "permuted", "shuffled", "offsets", "amplitudes"]
"""What is taken from the recordings before anything learns from them; see `folds.controls`."""
Figures = Literal["report", "paper"]
"""How a report draws the paper's figures: as suits what was evaluated, or as they are printed."""
Cut = Literal["published", "all"]
"""Which part of a recording is used; see `store.trimming`."""


LARGEST_SEED: Final = 2**32 - 1
"""As PyTorch and NumPy take it."""


def flag_of(name: str) -> str:
    """Return an option, by its name in Python, as the command line has it."""
    return f"--{name.replace('_', '-')}"


def require_number(option: str, value: float, least: float, most: float = math.inf) -> None:
    """Refuse a number that is out of bounds.

    Raises
    ------
    InputError
        Naming the option.
    """
    if not least <= value <= most:
        wanted = f"{least:g} or more" if math.isinf(most) else f"{least:g} to {most:.0f}"
        raise InputError(f"{option}: expected {wanted}, found {value}")


def require_workers(workers: int | None) -> None:
    """Refuse a number of processes that is none; None is one for each core."""
    require_number("--workers", 1 if workers is None else workers, 1)


def parse_conditions(pairs: Iterable[str], option: str) -> dict[str, str]:
    """Return conditions of recordings, each given as ``NAME=VALUE``.

    Raises
    ------
    InputError
        Naming the option, if one is not.
    """
    found = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals:
            raise InputError(
                f"{option}: expected NAME=VALUE, such as pressure=F250, found '{pair}'"
            )
        found[name] = value
    return found


def words_in(given: str | Iterable[str]) -> list[str]:
    """Return names, which may be given in a text, separated by commas or blanks."""
    return given.replace(",", " ").split() if isinstance(given, str) else list(given)


def parse_numbers(given: str | Iterable[float], option: str) -> list[float]:
    """Return numbers, which may be given in a text, separated by commas.

    Raises
    ------
    InputError
        Naming the option, if one is none.
    """
    try:
        return [float(one) for one in (given.split(",") if isinstance(given, str) else given)]
    except ValueError:
        raise InputError(
            f"{option}: expected numbers separated by commas, found '{given}'"
        ) from None


def speed_factor(text: str) -> float:
    """Return how much faster than recorded a replay runs; infinite for ``max``.

    Raises
    ------
    InputError
        If it is no number.
    """
    try:
        return float("inf") if text == "max" else float(text)
    except ValueError:
        raise InputError(f"--speed: expected a factor above 0, or 'max', found '{text}'") from None
