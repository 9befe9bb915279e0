"""What an interval is drawn over: sessions, or in a single one textures.

Recordings of several sessions are told apart by the number of theirs, which stands before the name.
"""

TEXTURE, SESSION = "texture", "session"
"""What may be the replicate, as summaries name it."""


def replicate_of(n_sources: int) -> str:
    """Return what is the replicate of an evaluation of so many sessions."""
    return SESSION if n_sources > 1 else TEXTURE


def numbered(name: str, number: int) -> str:
    """Return a recording's name where there are several sources: ``2:3/50`` of the second."""
    return f"{number}:{name}"


def source_number(name: str) -> str:
    """Return the number of the source in a name that `numbered` has made."""
    return name.partition(":")[0]
