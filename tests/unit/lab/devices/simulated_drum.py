"""A drum that is none, behind a pseudo-terminal.

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

from afferents.lab.devices.drives.serial_drive import frame_line, unframe_line

STEP_S = 0.002
GONE_S = 60.0
"""Nothing should take a tenth of it; nothing here measures time."""


def until(true):
    """Wait for something to be true, and tell whether it was."""
    end_s = time.monotonic() + GONE_S
    while not true() and time.monotonic() < end_s:
        time.sleep(0.01)
    return true()


@dataclass
class Drum:
    """The physics of a drum and its motor.

    It comes to a new speed as 1 - exp(-t / inertia_s), which swings by the share `ripple` so often
    a turn; and it stops when it has heard nothing for `watchdog_s`.
    """

    inertia_s: float = 0.1
    ripple: float = 0.01
    ripples_a_turn: float = 7.0
    circumference_mm: float = 300.0
    watchdog_s: float = 0.5
    clock: Callable[[], float] = time.monotonic

    def __post_init__(self):
        """Stand still."""
        self.position_mm = self.speed_mm_s = self.aim_mm_s = 0.0
        self.stalled = False
        self.fault: str | None = None
        self._now_s = self.heard_s = self.clock()
        self._mean_mm_s = 0.0

    def heard(self):
        """Note that a line came, which keeps the watchdog quiet."""
        self.advance()
        self.heard_s = self.clock()

    def advance(self):
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
    """A drum behind a pseudo-terminal, `port`; a share `lost` of the bytes is lost either way.

    `lines` are those that came whole.
    """

    checksum = "crc16"

    def __init__(self, drum=None, lost=0.0, seed=0):
        self.drum = drum or Drum()
        self.lost = lost
        self.silent = False
        self.lines = []
        self._random = Random(seed)
        self._waiting = b""
        self._ended = threading.Event()
        self._lock = threading.Lock()

    def __enter__(self):
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self._ended.clear()
        self._thread = threading.Thread(target=self._serve, name="simulated drum", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *error):
        self.unplug()

    def unplug(self):
        """Pull the cable: the port is gone."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join(5)
            os.close(self._master)
            os.close(self._slave)

    def stall(self, stalled=True):
        """Hold the drum, or let it go."""
        with self._lock:
            self.drum.advance()
            self.drum.stalled = stalled

    def fail(self, fault):
        """Let the drive stop with a fault, until it is cleared."""
        with self._lock:
            self.drum.advance()
            self.drum.fault, self.drum.aim_mm_s = fault, 0.0

    def now(self):
        """Return where it truly is, mm, and how fast it truly turns, mm/s."""
        with self._lock:
            self.drum.advance()
            return self.drum.position_mm, self.drum.speed_mm_s

    def answer(self, text):
        """Return the answer to a line; None for none."""
        verb, _, rest = text.partition(" ")
        drum = self.drum
        if verb == "speed":
            try:
                value = float(rest)
            except ValueError:
                return "what"
            if drum.fault is None:
                drum.aim_mm_s = value
            return f"speed {value:.5f}"
        if verb == "stop":
            drum.aim_mm_s = 0.0
        elif verb == "clear":
            drum.fault = None
        elif verb == "state":
            return f"state {drum.position_mm:.4f} {drum.speed_mm_s:.3f} {drum.fault or 'ok'}"
        return verb if verb in ("hello", "clear", "stop") else "what"

    def _serve(self):
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

    def take(self, data):
        """Take what came on the line; answer each line that is whole."""
        *lines, self._waiting = (self._waiting + data).split(b"\n")
        for line in lines:
            text = unframe_line(line, self.checksum)
            if text is not None:
                self._heard(text)

    def _heard(self, text):
        with self._lock:
            self.lines.append(text)
            self.drum.heard()
            answer = self.answer(text)
        if answer is not None and not self.silent:
            self._write(self._worn(frame_line(answer, self.checksum)))

    def _worn(self, data):
        """Return what is left of bytes on a bad line."""
        if self.lost == 0:
            return data
        return bytes(byte for byte in data if self._random.random() >= self.lost)

    def _write(self, data):
        try:
            os.write(self._master, data)
        except OSError:
            return
