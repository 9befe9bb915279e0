"""One name for each texture in all tables and figures of a report.

Textures of the paper's series get its letters, a to m, where all of an evaluation's textures are of
it; what the letters stand for is said once on the page and once in a figure. Other textures keep
the names of their session.
"""

from collections.abc import Sequence

from afferents.core.recording import LETTERS, spacing_mm
from afferents.reporting.published import published_textures


def texture_letter(texture: str) -> str | None:
    """Return the paper's letter (a to m) of a texture folder, None if it is none of the 13."""
    names = published_textures()
    return LETTERS[names.index(texture)] if texture in names else None


def are_published(textures: Sequence[str]) -> bool:
    """Return whether textures are the paper's, all 13 of them: its accuracies are of these."""
    return tuple(textures) == published_textures()


def texture_names(textures: Sequence[str]) -> dict[str, str]:
    """Return by what name each texture is shown: its letter if all have one, else its own."""
    letters = {texture: texture_letter(texture) for texture in textures}
    if None in letters.values():
        return {texture: texture for texture in textures}
    return {texture: str(letter) for texture, letter in letters.items()}


def texture_labels(textures: Sequence[str]) -> dict[str, str]:
    """Return the same with the spacing beside each letter, `i (4 mm)`, where it is said there."""
    named = texture_names(textures)
    return {t: name if name == t else f"{name} ({t} mm)" for t, name in named.items()}


def texture_label(texture: str) -> str:
    """Return `i (4 mm)` for a single texture of the paper's series, else the name itself."""
    return texture_labels([texture])[texture]


def spacing_note(textures: Sequence[str]) -> str:
    """Return what the letters stand for: `a to m: bumps 0 to 6 mm apart`; nothing of others."""
    names = list(texture_names(textures).values())
    if names == list(textures) or not names:
        return ""
    first, last = LETTERS.index(names[0]), LETTERS.index(names[-1])
    if len(names) > 3 and names == list(LETTERS[first : last + 1]):
        return f"{names[0]} to {names[-1]}: bumps {textures[0]} to {textures[-1]} mm apart"
    return f"{', '.join(names)}: bumps {', '.join(textures)} mm apart"


def texture_axis(textures: Sequence[str]) -> str:
    """Return `texture`, and what its names mean where they are bump spacings in mm."""
    if texture_names(textures) != {texture: texture for texture in textures}:
        return "texture"
    numbered = all(spacing_mm(name) is not None for name in textures)
    return "texture (bump spacing, mm)" if numbered else "texture"
