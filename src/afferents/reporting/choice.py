"""Which textures and speeds a figure shows where it cannot show all of them."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from afferents import dims
from afferents.choices import Figures
from afferents.encodings.samples import Samples
from afferents.folds.held_out import key_of
from afferents.reporting.labels import texture_letter, texture_names
from afferents.store.recording import LETTERS, natural_order

EXAMPLE_LETTERS = ("a", "e", "i", "m")
"""Four of the paper's textures, evenly spread: 0, 2, 4 and 6 mm. Its own figures show others, which
`report --figures paper` draws."""
PANELS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "A": (("a", 50.0), ("g", 50.0), ("m", 50.0)),
    "B": (("g", 10.0), ("g", 50.0), ("g", 100.0)),
}
"""Of Figures 8 and 10: texture and speed (mm/s) of each row, textures in A and speeds in B."""
SPEED, N_SPEEDS = 50.0, 3
"""In the report's own: near which speed textures stand, and at how many speeds one of them."""

Item = TypeVar("Item")
Recorded = Collection[tuple[str, float]]
"""Texture and speed (mm/s) of every recording there is; at least one."""


def recorded_in(samples: Samples) -> set[tuple[str, float]]:
    """Return texture and speed (mm/s) of every recording of the samples."""
    textures, speeds = samples[dims.TEXTURE].values.tolist(), samples[dims.SPEED].values.tolist()
    return set(zip(textures, speeds, strict=True))


def speeds_of_textures(recorded: Recorded) -> dict[str, list[float]]:
    """Return the speeds of each texture, mm/s, ascending; textures in natural order."""
    speeds: dict[str, list[float]] = {}
    for texture, speed in sorted(recorded, key=lambda one: (natural_order(one[0]), one[1])):
        speeds.setdefault(texture, []).append(speed)
    return speeds


def example_textures(textures: Sequence[str], by_spacing: bool) -> list[str]:
    """Return a, e, i, m of the paper where they are there, else four spread over the rest."""
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


class Shown(NamedTuple):
    """A recording that is shown, and what the paper shows there.

    Attributes
    ----------
    texture, speed_mm_s
        Of the recording.
    name
        What the report calls its texture.
    wanted
        What of the paper's is not shown, in few words; nothing where all of it is.
    instead
        What it stands for, in words; nothing where it is the paper's own.
    """

    texture: str
    speed_mm_s: float
    name: str
    wanted: str = ""
    instead: str = ""

    @property
    def label(self) -> str:
        """Return texture and speed as they stand beside a row, and below what they are for."""
        lines = [self.name, f"{key_of(self.speed_mm_s)} mm/s"]
        return "\n".join([*lines, *([f"(for {self.wanted})"] if self.wanted else [])])


def shown_for(wanted: Recorded, recorded: Recorded, by_spacing: bool) -> list[Shown]:
    """Choose a recording for each that the paper shows.

    Parameters
    ----------
    wanted
        Letter and speed (mm/s) of each.
    by_spacing
        Whether textures are named by their spacing; see `texture_names`.

    Returns
    -------
    The texture itself where it is there; else the first, the middle or the last of the session's
    for a, g and m. Of it the recording whose speed is nearest.
    """
    speeds = speeds_of_textures(recorded)
    textures = list(speeds)
    names = texture_names(textures, by_spacing)
    of_letter = {texture_letter(one, by_spacing): one for one in reversed(textures)}
    found = []
    for letter, paper_mm_s in wanted:
        along = LETTERS.index(letter) / (len(LETTERS) - 1)
        texture = of_letter.get(letter) or textures[round(along * (len(textures) - 1))]
        speed = _nearest(speeds[texture], paper_mm_s)
        other = "" if letter in of_letter else letter
        off = [other] * bool(other) + [key_of(paper_mm_s)] * (speed != paper_mm_s)
        instead = (
            f"{names[texture]} at {key_of(speed)} mm/s for "
            f"{f'{other} at ' * bool(other)}{key_of(paper_mm_s)} mm/s"
        )
        found.append(Shown(texture, speed, names[texture], ", ".join(off), instead * bool(off)))
    return found


def panels_of(recorded: Recorded, by_spacing: bool, style: Figures) -> list[tuple[str, Shown]]:
    """Choose the rows of Figures 8 and 10: textures at one speed (A), one at several speeds (B).

    The paper's own, or what stands in for them; for the report, textures spread over those that
    were recorded, and the middle one, or g, at speeds spread over its own.
    """
    speeds = speeds_of_textures(recorded)
    textures = list(speeds)
    if style == "paper":
        chosen = {panel: shown_for(rows, recorded, by_spacing) for panel, rows in PANELS.items()}
    else:
        names = texture_names(textures, by_spacing)
        middle = "3" if by_spacing and "3" in textures else textures[len(textures) // 2]
        chosen = {
            "A": [
                Shown(one, _nearest(speeds[one], SPEED), names[one])
                for one in example_textures(textures, by_spacing)
            ],
            "B": [Shown(middle, v, names[middle]) for v in spread(speeds[middle], N_SPEEDS)],
        }
    return [(panel, one) for panel, shown in chosen.items() for one in shown]


def _nearest(speeds: Iterable[float], wanted: float) -> float:
    return min(speeds, key=lambda one: (abs(one - wanted), one))


def instead_of(shown: Iterable[Shown]) -> str:
    """Return a sentence on what is shown in place of the paper's; nothing where all is there."""
    said = list(dict.fromkeys(one.instead for one in shown if one.instead))
    return f"Shown in place of what the session lacks: {', '.join(said)}. " if said else ""
