"""A drum that is none, behind a pseudo-terminal: for tests and dry runs.

It speaks as the Arduino sketch of docs/arduino does, takes its time to reach a speed, turns not
quite evenly, loses bytes, stalls and fails as it is told to.
"""

import math
import os
import pty
import select
import threading
import time
import tty
from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from types import TracebackType
from typing import Self

from afferents.devices.drives.line import framed, unframed

STEP_S = 0.002


@dataclass
class Drum:
    """The physics of a drum and its motor.

    Attributes
    ----------
    inertia_s
        It comes to a new speed as 1 - exp(-t / inertia_s).
    ripple
        Share by which its speed swings,
    ripples_a_turn
        so often a turn.
    circumference_mm
        Of the drum.
    fastest_mm_s
        At full duty; what a motor does is not what was computed.
    watchdog_s
        It stops when it has heard nothing for so long.
    clock
        Gives the time, s.

    Examples
    --------
    >>> now = [0.0]
    >>> drum = Drum(inertia_s=0.1, ripple=0.0, clock=lambda: now[0])
    >>> drum.aim_mm_s, now[0] = 50.0, 0.4
    >>> drum.advance()
    >>> round(drum.speed_mm_s, 1)
    49.1
    """

    inertia_s: float = 0.1
    ripple: float = 0.01
    ripples_a_turn: float = 7.0
    circumference_mm: float = 300.0
    fastest_mm_s: float = 230.0
    watchdog_s: float = 0.5
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self) -> None:
        """Stand still."""
        self.position_mm = self.speed_mm_s = self.aim_mm_s = 0.0
        self.stalled = False
        self.fault: str | None = None
        self._now_s = self.heard_s = self.clock()
        self._mean_mm_s = 0.0

    def heard(self) -> None:
        """Note that a line came, which keeps the watchdog quiet."""
        self.advance()
        self.heard_s = self.clock()

    def advance(self) -> None:
        """Turn until now."""
        end_s = self.clock()
        while end_s - self._now_s > 0:
            step_s = min(STEP_S, end_s - self._now_s)
            self._now_s += step_s
            if self.aim_mm_s != 0 and self._now_s - self.heard_s > self.watchdog_s:
                self.aim_mm_s, self.fault = 0.0, "watchdog"
            if end_s - self._now_s > 5 and self.aim_mm_s == 0 == self._mean_mm_s:
                self._now_s = end_s  # it stands: nothing to reckon
            aim = 0.0 if self.stalled or self.fault else self.aim_mm_s
            self._mean_mm_s += (aim - self._mean_mm_s) * -math.expm1(-step_s / self.inertia_s)
            if abs(self._mean_mm_s) < 1e-6:
                self._mean_mm_s = 0.0
            turn = math.tau * self.ripples_a_turn * self.position_mm / self.circumference_mm
            self.speed_mm_s = self._mean_mm_s * (1 + self.ripple * math.sin(turn))
            self.position_mm += self.speed_mm_s * step_s


class SimulatedDrum:
    """A drum behind a pseudo-terminal.

    Parameters
    ----------
    drum
        Its physics.
    lost
        Share of the bytes that are lost on the line, in either direction.
    seed
        Of what is lost.

    Attributes
    ----------
    port
        Path for a `SerialDrive`; there once it is entered.
    lines
        Every line that came whole.
    """

    checksum = "crc16"

    def __init__(self, drum: Drum | None = None, lost: float = 0.0, seed: int = 0) -> None:
        """Wait to be entered."""
        self.drum = drum or Drum()
        self.lost = lost
        self.silent = False
        self.lines: list[str] = []
        self._random = Random(seed)
        self._waiting = b""
        self._ended = threading.Event()
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        """Open the pseudo-terminal, and answer in a thread."""
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._ended.clear()
        self._thread = threading.Thread(target=self._serve, name="simulated drum", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close it."""
        self.unplug()

    def unplug(self) -> None:
        """Pull the cable: the port is gone."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join(5)
            os.close(self._master)
            os.close(self._slave)

    def stall(self, stalled: bool = True) -> None:
        """Hold the drum, or let it go."""
        with self._lock:
            self.drum.advance()
            self.drum.stalled = stalled

    def fail(self, fault: str) -> None:
        """Let the drive stop with a fault, until it is cleared."""
        with self._lock:
            self.drum.advance()
            self.drum.fault, self.drum.aim_mm_s = fault, 0.0

    def now(self) -> tuple[float, float]:
        """Return where it truly is, mm, and how fast it truly turns, mm/s."""
        with self._lock:
            self.drum.advance()
            return self.drum.position_mm, self.drum.speed_mm_s

    def answer(self, text: str) -> str | None:
        """Return the answer to a line; None for none."""
        verb, _, rest = text.partition(" ")
        drum = self.drum
        if verb in ("speed", "duty"):
            try:
                value = float(rest)
            except ValueError:
                return "what"
            if drum.fault is None:
                drum.aim_mm_s = value * (drum.fastest_mm_s if verb == "duty" else 1.0)
            return f"{verb} {value:.5f}"
        if verb == "stop":
            drum.aim_mm_s = 0.0
        elif verb == "clear":
            drum.fault = None
        elif verb == "state":
            return f"state {drum.position_mm:.4f} {drum.speed_mm_s:.3f} {drum.fault or 'ok'}"
        return verb if verb in ("hello", "clear", "stop") else "what"

    def _serve(self) -> None:
        while not self._ended.is_set():
            there, _, _ = select.select([self._master], [], [], 0.05)
            if not there:
                continue
            try:
                data = self._worn(os.read(self._master, 4096))
            except OSError:  # nobody has it open
                self._ended.wait(0.01)
                continue
            self.take(data)

    def take(self, data: bytes) -> None:
        """Take what came on the line; answer each line that is whole."""
        *lines, self._waiting = (self._waiting + data).split(b"\n")
        for line in lines:
            text = unframed(line, self.checksum)
            if text is not None:
                self._heard(text)

    def _heard(self, text: str) -> None:
        with self._lock:
            self.lines.append(text)
            self.drum.heard()
            answer = self.answer(text)
        if answer is not None and not self.silent:
            self._write(self._worn(framed(answer, self.checksum)))

    def _worn(self, data: bytes) -> bytes:
        """Return what is left of bytes on a bad line."""
        if self.lost == 0:
            return data
        return bytes(byte for byte in data if self._random.random() >= self.lost)

    def _write(self, data: bytes) -> None:
        try:
            os.write(self._master, data)
        except OSError:
            return
