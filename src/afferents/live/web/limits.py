"""What one visitor of the page, and all of them together, may take of this machine."""

import os
from dataclasses import dataclass, field

CEILING = 64
"""More visitors at a time than that are not let in, however many files may be open."""
RESERVE = 24
"""Files left for cameras, sound cards, libraries and the server's own loop."""
_OF_A_VISITOR = 2
"""Its connection, and the file of the page that is being sent to it."""


def affordable() -> int:
    """Return how many connections at a time this process has files for, of those not open yet.

    At least one: a machine so short of files is better told by whatever fails first.
    """
    try:
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        opened = len(os.listdir("/dev/fd"))  # noqa: PTH208  names, of what may be gone again
    except (ImportError, OSError):
        return CEILING  # a system without such a limit, or that does not tell
    if most == resource.RLIM_INFINITY:
        return CEILING
    return max(1, min(CEILING, (most - opened - RESERVE) // _OF_A_VISITOR))


@dataclass(frozen=True)
class Limits:
    """What visitors may take, asked before any token.

    Parameters
    ----------
    places
        Connections at a time, in all.
    request_s
        From the beginning of a connection to the end of the answer, s; a connection has one
        request.
    taking_s
        For what is sent to a web socket to be on its way, s.
    saying
        What a web socket may say at once, bytes.
    saying_hz
        And on and on, bytes per second.
    """

    places: int = field(default_factory=affordable)
    request_s: float = 10.0
    taking_s: float = 10.0
    saying: int = 1 << 16
    saying_hz: float = 1024.0
