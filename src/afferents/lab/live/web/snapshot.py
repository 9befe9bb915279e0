"""What the page draws: the newest of everything, as JSON and as a picture."""

import json
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import cv2
import numpy as np

from afferents.dims import RA1, SA1
from afferents.lab.live import events, streams, touch
from afferents.lab.live.pipeline import LivePipeline
from afferents.lab.live.prediction import Newest
from afferents.markers.detect import Positions, spacing_px
from afferents.markers.places import covered

_QUALITY = 70
"""Of the JPEG, per cent."""
_DIGITS = 4
LOST = -1
"""Pixel of a tactile image, whose values are lengths, where the marker is lost."""
_RING_SHARE, _LEAST_RING_PX = 0.41, 3.0
"""Of the distance of neighbouring markers, and at least, px."""


class Shown(ABC):
    """What visitors are sent; drawn up only while there are any.

    Attributes
    ----------
    fresh_s
        What is drawn up serves all visitors for this time.
    """

    fresh_s: float
    _newest: tuple[str, bytes | None] = "", None
    _drawn_s = -math.inf

    @abstractmethod
    def hello(self) -> dict[str, Any]:
        """Return what does not change."""

    @abstractmethod
    def draw(self) -> tuple[str, bytes | None]:
        """Draw up the state as JSON, and the picture."""

    def newest(self) -> tuple[str, bytes | None]:
        """Return the state as JSON, and the picture; drawn up once for many visitors."""
        if time.monotonic() - self._drawn_s > self.fresh_s:
            self._newest = self.draw()
            self._drawn_s = time.monotonic()
        return self._newest


class Snapshots(Shown, Newest):
    """The newest prediction of every model, and what the streams have in hand.

    Parameters
    ----------
    pipeline
        Written by the stream's thread; only read here.
    greeting
        What else does not change; see `outlets.give_out`.
    """

    fresh_s = 0.025

    def __init__(
        self, pipeline: LivePipeline, greeting: Mapping[str, Any] = MappingProxyType({})
    ) -> None:
        """Nothing has come yet."""
        super().__init__()
        self._pipeline, self._greeting = pipeline, greeting
        self._encoded: tuple[events.CameraFrame | None, bytes] = None, b""
        self.ended: str | None = None
        self.repeats = False

    def hello(self) -> dict[str, Any]:
        """Return what does not change: the models, or none."""
        return {
            "type": "hello",
            "has_rest": self._pipeline.video is not None,
            "models": [
                {**reporter.introduce(), "channel": channel}
                for channel, reporter in self._pipeline.reporters
            ],
            **self._greeting,
        }

    def draw(self) -> tuple[str, bytes | None]:
        """Draw up the state as JSON, and the picture."""
        return json.dumps(self.state()), self.jpeg()

    def state(self) -> dict[str, Any]:
        """Return the newest of everything but the picture."""
        now_s, pipeline = time.monotonic(), self._pipeline
        video, audio, lessons = pipeline.video, pipeline.audio, pipeline.lessons
        content: dict[str, Any] = {
            "type": "state",
            "ended": self.ended,
            "repeats": self.repeats,
            "predictions": [
                {**prediction.to_dict(), "age_s": round(now_s - taken_s, 3)}
                for prediction, taken_s in list(self.predictions.values())
            ],
            "video": None,
            "audio": None,
            "lessons": lessons and lessons.state(),
            "spikes": [trains.to_dict() for trains in pipeline.trains()],
        }
        if video is not None:
            newest, picture, sensor = video.newest, video.picture, video.follower.sensor
            content["video"] = {
                "rate_hz": round(video.quality.numbers.get("fps_hz", video.rate_hz), 1),
                "sensor": video.follower.describe(),
                "quality": [figure._asdict() for figure in video.quality.figures()],
                "masks": [] if sensor is None else sensor.picture.masks,
            }
            if newest is not None and picture is not None:
                size = picture.frame.luma.shape[::-1]
                content["video"] |= {"size": size, **draw_markers(newest)}
        if audio is not None:
            content["audio"] = {
                "rate_hz": round(audio.rate_hz),
                "quality": [figure._asdict() for figure in audio.quality.figures()],
                **draw_spectrum(audio),
            }
        return content

    def jpeg(self) -> bytes | None:
        """Return the newest camera picture; None before there is one."""
        picture = None if self._pipeline.video is None else self._pipeline.video.picture
        if picture is None:
            return None
        if picture is not self._encoded[0]:
            options = [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
            _, encoded = cv2.imencode(".jpg", picture.frame.image, options)
            self._encoded = picture, bytes(encoded)
        return self._encoded[1]


def draw_markers(filled: touch.Filled) -> dict[str, Any]:
    """Return where the markers of a frame are, px, and their tactile images, as JSON has them."""
    seen, found = filled.touch.seen, filled.touch.detected
    return {
        "markers": np.where(found[:, None], seen, -1).round(1).tolist(),
        "ring_px": ring_px(seen[found]),
        "unit": filled.touch.now.unit,
        **{name: draw_image(filled, name) for name in (SA1, RA1)},
    }


def draw_spectrum(audio: streams.AudioStream) -> dict[str, Any]:
    """Return the newest spectrum as JSON has it; nothing before there is one."""
    if (spectrum := audio.spectrum()) is None:
        return {}
    amplitude, step_hz = spectrum
    return {"amplitude": [float(f"{a:.4g}") for a in amplitude], "step_hz": step_hz}


def draw_image(filled: touch.Filled, name: str) -> list[Any] | None:
    """Return the tactile image of a channel as JSON has it; None where there is none.

    A pixel is None where no marker stands, and `LOST` at the one nearest to a lost marker.
    """
    image, grid = filled.image(name), filled.touch.grid
    if image is None or grid is None:
        return None
    row, column = grid.row, grid.column
    drawn = np.round(image.astype(float), _DIGITS).astype(object)
    gone = ~filled.touch.detected
    lost = np.rint([row[gone], column[gone]]).astype(int)
    drawn[tuple(np.clip(lost.T, 0, np.array(image.shape) - 1).T)] = LOST
    drawn[~covered(row, column)] = None
    return list(drawn.tolist())


def ring_px(found: Positions) -> float:
    """Return the radius of the rings drawn round markers, px: they do not touch."""
    return round(max(_LEAST_RING_PX, _RING_SHARE * spacing_px(found)), 1) if len(found) > 1 else 9.0
