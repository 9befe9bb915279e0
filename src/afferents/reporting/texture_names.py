"""One name for each texture in all tables and figures of a report.

Textures of the paper's series get its letters, a to m, where the session names textures by their
bump spacing (the published layout does, and so the rig) and all of an evaluation's are of the
series; what the letters stand for is said once on the page and once in a figure. Other textures
keep the names of their session: somebody's own plate 3 is no drum with bumps 3 mm apart.

`about` is what says how textures are named: a summary, or the attributes of samples or responses.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from afferents.core.dims import NAMED_BY_SPACING
from afferents.core.recording import LETTERS, spacing_mm
from afferents.reporting.published import published_textures

About = Mapping[Any, Any]


def texture_letter(texture: str, about: About) -> str | None:
    """Return the paper's letter (a to m) of a texture folder, None if it is none of the 13."""
    names = published_textures()
    known = about.get(NAMED_BY_SPACING) and texture in names
    return LETTERS[names.index(texture)] if known else None


def are_published(about: About) -> bool:
    """Return whether a summary's textures are the paper's, all 13: its accuracies are of these."""
    return bool(about.get(NAMED_BY_SPACING)) and tuple(about["textures"]) == published_textures()


def texture_names(textures: Sequence[str], about: About) -> dict[str, str]:
    """Return by what name each texture is shown: its letter if all have one, else its own."""
    letters = {texture: texture_letter(texture, about) for texture in textures}
    if None in letters.values():
        return {texture: texture for texture in textures}
    return {texture: str(letter) for texture, letter in letters.items()}


def texture_labels(textures: Sequence[str], about: About) -> dict[str, str]:
    """Return the same with the spacing beside each letter, `i (4 mm)`, where it is said there."""
    named = texture_names(textures, about)
    return {t: name if name == t else f"{name} ({t} mm)" for t, name in named.items()}


def spacing_note(summary: About) -> str:
    """Return what the letters stand for: `a to m: bumps 0 to 6 mm apart`; nothing of others."""
    textures = summary["textures"]
    names = list(texture_names(textures, summary).values())
    if names == list(textures) or not names:
        return ""
    first, last = LETTERS.index(names[0]), LETTERS.index(names[-1])
    if len(names) > 3 and names == list(LETTERS[first : last + 1]):
        return f"{names[0]} to {names[-1]}: bumps {textures[0]} to {textures[-1]} mm apart"
    return f"{', '.join(names)}: bumps {', '.join(textures)} mm apart"


def texture_axis(textures: Sequence[str], about: About) -> str:
    """Return `texture`, and what its names mean where they are bump spacings in mm."""
    if texture_names(textures, about) != {texture: texture for texture in textures}:
        return "texture"
    numbered = all(spacing_mm(name) is not None for name in textures)
    named = numbered and about.get(NAMED_BY_SPACING)
    return "texture (bump spacing, mm)" if named else "texture"
