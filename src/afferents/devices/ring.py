"""Blocks of sound between the thread of the sound card and whoever writes them down."""

import threading

import numpy as np
from numpy.typing import NDArray

from afferents.devices.base import Block


class Ring:
    """Room for some blocks, taken once and for all; a block that finds none is lost and counted.

    Parameters
    ----------
    blocks
        How many fit.
    samples, channels
        Largest size of one.

    Attributes
    ----------
    overflows
        How often samples were lost: by the sound card, or for want of room here.
    """

    def __init__(self, blocks: int, samples: int, channels: int) -> None:
        """Take the room."""
        self._room = np.zeros((blocks, samples, channels), np.int16)
        self._about: list[tuple[float, int, bool]] = [(0.0, 0, False)] * blocks
        self._given = self._taken = 0
        self._there = threading.Semaphore(0)
        self._lost = False
        self.overflows = 0

    def put(self, samples: NDArray[np.int16], time_s: float, overflowed: bool) -> None:
        """Copy a block, in the thread of the sound card; never waits."""
        self.overflows += overflowed
        self._lost |= overflowed
        if self._given - self._taken == len(self._room):
            self.overflows += 1
            self._lost = True
            return
        place = self._given % len(self._room)
        self._room[place, : len(samples)] = samples
        self._about[place] = (time_s, len(samples), self._lost)
        self._lost = False
        self._given += 1
        self._there.release()

    def get(self, timeout_s: float) -> Block | None:
        """Return the oldest block; None if none comes within the time."""
        if not self._there.acquire(timeout=timeout_s):
            return None
        place = self._taken % len(self._room)
        time_s, n, lost = self._about[place]
        block = Block(time_s, self._room[place, :n].copy(), lost)
        self._taken += 1
        return block

    def clear(self) -> None:
        """Forget what is there."""
        while self.get(0) is not None:
            pass
