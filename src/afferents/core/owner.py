"""Who writes: a process on a host. A process number alone says nothing on another host."""

import os
import re
import socket
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple


class Owner(NamedTuple):
    """A process: its host, its number there, and when it started (0 where nothing says so).

    The start tells it from a later process of the same number.
    """

    host: str
    pid: int
    started: int

    @property
    def is_here(self) -> bool:
        """Whether it runs, or ran, where this process does, so that its end can be seen."""
        return self.host == host_here()

    @property
    def is_alive(self) -> bool:
        """Whether it runs still; to be asked of processes that are here."""
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        except PermissionError:  # another user's
            return True
        return self.started == _started(self.pid)

    def tag(self) -> str:
        """Return it as part of a file's name."""
        return f"{_short(self.host)}-{self.pid}.{self.started}"


_TAG = re.compile(r"(?P<host>[0-9a-f]{8})-(?P<pid>\d+)\.(?P<started>\d+)")


def this_process() -> Owner:
    """Return who asks."""
    return Owner(host_here(), os.getpid(), _started(os.getpid()))


def tagged(name: str) -> Owner | None:
    """Return whose tag a file's name has; None where it has none. Of other hosts the host is ''."""
    found = _TAG.search(name)
    if found is None:
        return None
    host = host_here() if found["host"] == _short(host_here()) else ""
    return Owner(host, int(found["pid"]), int(found["started"]))


@lru_cache(maxsize=1)
def host_here() -> str:
    """Return the host's name; containers of one name that don't see each other differ."""
    processes = ""
    with suppress(OSError):
        processes = os.readlink("/proc/self/ns/pid").strip("pid:[]")  # noqa: PTH115 (no real path)
    return f"{socket.gethostname()}{f' ({processes})' if processes else ''}"


def _short(host: str) -> str:
    return sha256(host.encode()).hexdigest()[:8]


def _started(pid: int) -> int:
    """Return when a process started, in ticks since the host did; 0 where /proc does not say."""
    try:
        # The second field, the program's name, may hold blanks and brackets itself.
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
    except (OSError, ValueError, IndexError):
        return 0
