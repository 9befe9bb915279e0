"""What the page draws: the newest of everything, as JSON and as a picture."""

import json
import math
import time
from typing import Any

import cv2
import numpy as np

from afferents.core.dims import RA1, SA1
from afferents.encodings import SpectralEncoding
from afferents.live.events import Picture
from afferents.live.perceiver import Feeler
from afferents.live.percept import Percept

_QUALITY = 70
"""Of the JPEG, per cent."""
_DIGITS = 4
FRESH_S = 0.025
"""What is drawn up serves all visitors for so long."""


class Rate:
    """How often something happens, Hz, over the last second or so."""

    def __init__(self) -> None:
        """Start counting."""
        self._since_s, self._n, self._before, self.hz = time.monotonic(), 0, 0, 0.0

    def seen(self, total: int) -> float:
        """Return the rate, given how often it has happened in all."""
        elapsed_s = time.monotonic() - self._since_s
        if elapsed_s >= 1:
            self.hz = (total - self._before) / elapsed_s
            self._since_s, self._before = time.monotonic(), total
        return self.hz


class Snapshots:
    """The newest percept of every model, and what the senses have in hand.

    Parameters
    ----------
    feeler
        Written by the stream's thread; only read here.
    """

    def __init__(self, feeler: Feeler) -> None:
        """Nothing is felt yet."""
        self._feeler = feeler
        self._percepts: dict[str, tuple[Percept, float]] = {}
        self._frames, self._samples = Rate(), Rate()
        self._encoded: tuple[Picture | None, bytes] = None, b""
        self._newest: tuple[str, bytes | None] = "", None
        self._drawn_s = -math.inf
        self.ended: str | None = None

    def take(self, percept: Percept) -> None:
        """Keep a percept until the next of its model."""
        self._percepts[percept.model] = percept, time.monotonic()

    def hello(self) -> dict[str, Any]:
        """Return what does not change: the models."""
        return {
            "type": "hello",
            "models": [
                {
                    "model": judge.card.family,
                    "title": judge.card.title,
                    "textures": judge.card.textures,
                    "said": judge.card.said(),
                    "channel": channel,
                }
                for channel, sense in self._feeler.senses.items()
                for judge in sense.judges
            ],
        }

    def newest(self) -> tuple[str, bytes | None]:
        """Return the state as JSON, and the picture; drawn up once for many visitors."""
        now_s = time.monotonic()
        if now_s - self._drawn_s > FRESH_S:
            self._newest = json.dumps(self.state()), self.jpeg()
            self._drawn_s = now_s
        return self._newest

    def state(self) -> dict[str, Any]:
        """Return the newest of everything but the picture."""
        now_s = time.monotonic()
        return {
            "type": "state",
            "ended": self.ended,
            "percepts": [
                {**percept.to_dict(), "age_s": round(now_s - taken_s, 3)}
                for percept, taken_s in list(self._percepts.values())
            ],
            "sight": self._sight(),
            "hearing": self._hearing(),
        }

    def _sight(self) -> dict[str, Any] | None:
        sight = self._feeler.sight
        if sight is None:
            return None
        felt, picture = sight.felt, sight.picture
        content: dict[str, Any] = {"rate_hz": round(self._frames.seen(sight.counters.frames), 1)}
        if felt is not None and picture is not None:
            content |= {
                "size": picture.frame.luma.shape[::-1],
                "markers": _numbers(np.where(felt.detected[:, None], felt.position, -1), 1),
                "sa1": _numbers(felt.images[SA1], _DIGITS),
                "ra1": _numbers(felt.images[RA1], _DIGITS) if RA1 in felt.images else None,
            }
        return content

    def _hearing(self) -> dict[str, Any] | None:
        hearing = self._feeler.hearing
        if hearing is None:
            return None
        content: dict[str, Any] = {"rate_hz": round(self._samples.seen(hearing.counters.samples))}
        encoding = hearing.encoding
        if hearing.newest is not None and isinstance(encoding, SpectralEncoding):
            points = encoding.fft_points or encoding.window_s * hearing.rate_hz
            content |= {
                "amplitude": [float(f"{a:.4g}") for a in hearing.newest.values.mean(axis=0)],
                "step_hz": hearing.rate_hz / points,
            }
        return content

    def jpeg(self) -> bytes | None:
        """Return the newest camera picture; None before there is one."""
        sight = self._feeler.sight
        if sight is None or sight.picture is None:
            return None
        picture = sight.picture
        if picture is not self._encoded[0]:
            options = [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
            _, encoded = cv2.imencode(".jpg", picture.frame.image, options)
            self._encoded = picture, bytes(encoded)
        return self._encoded[1]


def _numbers(values: "np.ndarray[Any, Any]", digits: int) -> list[Any]:
    return list(np.round(values.astype(float), digits).tolist())
