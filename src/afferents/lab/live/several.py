"""Several fingertips at once: a process each, and what each gives out carries its name."""

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from afferents.errors import InputError
from afferents.lab.live.control import LINE, set_rest_on_request

SHARED = frozenset({"-", "lsl"})
"""Places that several fingertips may have together."""
EVERY_S = 0.05
ENDING_S = 5.0
"""A process that is told to stop has this time to end its files."""


def make_commands(
    video: Sequence[str],
    audio: Sequence[str],
    sensor: Sequence[str],
    to: Sequence[str],
    port: int,
    options: Sequence[str],
) -> dict[str, list[str]]:
    """Return the command of each fingertip, by its name: that of its sensor file.

    Files get the name, as in ``touch-left.jsonl``; pages get ports in a row.

    Parameters
    ----------
    video, audio, sensor
        Of each fingertip, in the same order; `audio` may be empty.
    to
        Where signals go, as for one fingertip.
    port
        Of the first page.
    options
        What is the same for all.

    Raises
    ------
    InputError
        If there are not as many of each, or two sensor files have one name.
    """
    for flag, given, files in (("--sensor", sensor, "a sensor file"), ("--audio", audio, "sound")):
        if len(given) != len(video) and (given or flag == "--sensor"):
            raise InputError(
                f"{flag}: expected {files} for each of the {len(video)} videos, in their order, "
                f"found {len(given)}"
            )
    names = [Path(file).stem for file in sensor]
    if len({*names}) < len(names):
        raise InputError(
            f"--sensor: expected files of different names, since fingertips are called by them, "
            f"found {', '.join(names)}; copy one under another name"
        )
    pages = [f"{name}={port + n}" for n, name in enumerate(names)]
    return {
        name: [
            *("live", "--video", video[n], "--sensor", sensor[n], "--name", name),
            *(("--audio", audio[n]) if audio else ()),
            *(word for place in to for word in ("--to", add_name(place, name))),
            *("--port", f"{port + n}", *(word for page in pages for word in ("--beside", page))),
            *options,
        ]
        for n, name in enumerate(names)
    }


def add_name(place: str, name: str) -> str:
    """Return a place with a fingertip's name in its file's."""
    kind, colon, file = place.rpartition(":")
    if not Path(file).suffix:
        return place  # no file
    path = Path(file)
    return f"{kind}{colon}{path.with_stem(f'{path.stem}-{name}')}"


def run_each(commands: Mapping[str, Sequence[str]], lines: bool) -> None:
    """Run commands together until all have ended, or one fails; JSON lines get the name.

    Parameters
    ----------
    commands
        By name of the fingertip: words after ``afferents``.
    lines
        As for `set_rest_on_request`; rest is set of all fingertips.

    Raises
    ------
    SystemExit
        With the highest exit code of those that failed; each has printed why.
    """
    running: dict[str, subprocess.Popen[bytes]] = {}
    readers: list[threading.Thread] = []
    lock = threading.Lock()

    def set_rest() -> None:
        for one in running.values():
            assert one.stdin is not None
            with suppress(OSError):
                one.stdin.write(f"{LINE}\n".encode())
                one.stdin.flush()

    def pass_on(given: IO[bytes], name: str) -> None:
        """Print the lines of JSON that a fingertip gives out, with its name."""
        head = b'{"fingertip":"' + name.encode() + b'",'
        for line in given:
            with lock:
                sys.stdout.write((head + line.removeprefix(b"{")).decode())
                sys.stdout.flush()

    try:
        for name, words in commands.items():
            running[name] = subprocess.Popen(
                [sys.executable, "-m", "afferents", *words, "--control"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
            )
            passing = (running[name].stdout, name)
            readers.append(threading.Thread(target=pass_on, args=passing, daemon=True))
            readers[-1].start()
        with set_rest_on_request(set_rest, lines):
            while any(one.poll() is None for one in running.values()):
                if any(one.returncode for one in running.values()):
                    break
                time.sleep(EVERY_S)
    finally:
        for one in running.values():  # let them end what they write; kill those that don't
            if one.poll() is None:
                one.send_signal(signal.SIGINT)
        for one in running.values():
            try:
                one.wait(ENDING_S)
            except subprocess.TimeoutExpired:
                one.kill()
                one.wait()
        for reader in readers:
            reader.join(ENDING_S)
    failed = [one.returncode for one in running.values() if one.returncode]
    if failed:
        raise SystemExit(max(failed))
