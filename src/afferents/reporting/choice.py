"""Which textures and speeds a figure shows where it cannot show all of them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from afferents import dims
from afferents.encodings.samples import Samples, textures_of
from afferents.reporting.labels import speed_key, texture_letter, texture_names
from afferents.store.recording import LETTERS, natural_order

EXAMPLE_LETTERS = ("a", "e", "i", "m")
"""Four of the paper's textures, evenly spread: 0, 2, 4 and 6 mm. Its own figures show others, which
`report --figures paper` draws."""

Item = TypeVar("Item")


def speeds_of(samples: Samples) -> list[float]:
    """Return the speeds of the samples, mm/s, ascending."""
    return sorted(map(float, np.unique(samples[dims.SPEED])))


def example_textures(samples: Samples) -> list[str]:
    """Return a, e, i, m of the paper where they are there, else four spread over the rest."""
    textures = textures_of(samples)
    by_spacing = bool(samples.attrs.get(dims.NAMED_BY_SPACING))
    known = [one for one in textures if texture_letter(one, by_spacing) in EXAMPLE_LETTERS]
    return known if len(known) == len(EXAMPLE_LETTERS) else spread(textures, 4)


def in_condition(samples: Samples, texture: str, speed_mm_s: float) -> Samples:
    """Return the samples of one texture at one speed, maybe none."""
    chosen = (samples[dims.TEXTURE].values == texture) & (samples[dims.SPEED].values == speed_mm_s)
    return samples.isel({dims.SAMPLE: np.flatnonzero(chosen)})


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most `most` of the items, evenly spread, both ends included."""
    if len(items) <= most:
        return list(items)
    return [items[round(place)] for place in np.linspace(0, len(items) - 1, most)]


# Which recordings stand for those of the paper's figures where a session lacks them.

PANELS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "A": (("a", 50.0), ("g", 50.0), ("m", 50.0)),
    "B": (("g", 10.0), ("g", 50.0), ("g", 100.0)),
}
"""Of Figures 8 and 10: texture and speed (mm/s) of each row, textures in A and speeds in B."""


class Shown(NamedTuple):
    """A recording that is shown, and what the paper shows there.

    Attributes
    ----------
    texture, speed_mm_s
        Of the recording.
    name
        What the report calls its texture.
    letter, paper_mm_s
        What the paper shows: a letter, and a speed in mm/s.
    is_letter
        Whether the texture is the one that the paper shows.
    """

    texture: str
    speed_mm_s: float
    name: str
    letter: str
    paper_mm_s: float
    is_letter: bool

    @property
    def label(self) -> str:
        """Return texture and speed as they stand beside a row, and below what they are for."""
        lines = [self.name, f"{speed_key(self.speed_mm_s)} mm/s"]
        return "\n".join([*lines, *([f"(for {self.wanted})"] if self.wanted else [])])

    @property
    def wanted(self) -> str:
        """Return what of the paper's is not shown, in few words; nothing where all of it is."""
        letter = [] if self.is_letter else [self.letter]
        speed = [] if self.speed_mm_s == self.paper_mm_s else [speed_key(self.paper_mm_s)]
        return ", ".join(letter + speed)

    @property
    def instead(self) -> str:
        """Return what it stands for, in words; nothing where it is the paper's own."""
        if not self.wanted:
            return ""
        here = f"{self.name} at {speed_key(self.speed_mm_s)} mm/s"
        letter = "" if self.is_letter else f"{self.letter} at "
        return f"{here} for {letter}{speed_key(self.paper_mm_s)} mm/s"


def shown_for(
    wanted: Iterable[tuple[str, float]], recorded: Iterable[tuple[str, float]], by_spacing: bool
) -> list[Shown]:
    """Choose a recording for each that the paper shows.

    Parameters
    ----------
    wanted
        Letter and speed (mm/s) of each.
    recorded
        Texture and speed (mm/s) of every recording there is; at least one.
    by_spacing
        Whether textures are named by their spacing; see `texture_names`.

    Returns
    -------
    The texture itself where it is there; else the first, the middle or the last of the session's
    for a, g and m. Of it the recording whose speed is nearest.
    """
    speeds: dict[str, list[float]] = {}
    for texture, speed in sorted(recorded, key=lambda one: (natural_order(one[0]), one[1])):
        speeds.setdefault(texture, []).append(speed)
    textures = list(speeds)
    names = texture_names(textures, by_spacing)
    found = []
    for letter, paper_mm_s in wanted:
        of_letter = {texture_letter(one, by_spacing): one for one in reversed(textures)}
        texture = of_letter.get(letter) or _in_place_of(letter, textures)
        speed = min(speeds[texture], key=lambda one: (abs(one - paper_mm_s), one))
        its_own = letter in of_letter
        found.append(Shown(texture, speed, names[texture], letter, paper_mm_s, its_own))
    return found


def _in_place_of(letter: str, textures: Sequence[str]) -> str:
    along = LETTERS.index(letter) / (len(LETTERS) - 1)
    return textures[round(along * (len(textures) - 1))]


def instead_of(shown: Iterable[Shown]) -> str:
    """Return a sentence on what is shown in place of the paper's; nothing where all is there."""
    said = list(dict.fromkeys(one.instead for one in shown if one.instead))
    return f"Shown in place of what the session lacks: {', '.join(said)}. " if said else ""
