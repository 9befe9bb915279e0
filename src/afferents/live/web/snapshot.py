"""What the page draws: the newest of everything, as JSON and as a picture."""

import json
import math
import time
from typing import Any

import cv2
import numpy as np

from afferents.dims import RA1, SA1
from afferents.live.events import CameraFrame
from afferents.live.images import FrameImages
from afferents.live.pipeline import LivePipeline
from afferents.live.prediction import Newest, Prediction
from afferents.live.quality import Quality
from afferents.markers.detect import Positions, spacing_px
from afferents.markers.places import covered

_QUALITY = 70
"""Of the JPEG, per cent."""
_DIGITS = 4
LOST = -1
"""Pixel of a tactile image, whose values are lengths, where the marker is lost."""
_RING_SHARE, _LEAST_RING_PX = 0.41, 3.0
"""Of the distance of neighbouring markers, and at least, px."""
FRESH_S = 0.025
"""What is drawn up serves all visitors for so long."""


class Snapshots:
    """The newest prediction of every model, and what the streams have in hand.

    Parameters
    ----------
    pipeline
        Written by the stream's thread; only read here.
    """

    def __init__(self, pipeline: LivePipeline) -> None:
        """Nothing has come yet."""
        self._pipeline = pipeline
        self._shown = Newest()
        self._encoded: tuple[CameraFrame | None, bytes] = None, b""
        self._newest: tuple[str, bytes | None] = "", None
        self._drawn_s = -math.inf
        self.ended: str | None = None
        self.repeats = False

    def take(self, prediction: Prediction) -> None:
        """Keep a prediction until the next of its model."""
        self._shown.take(prediction)

    def hello(self) -> dict[str, Any]:
        """Return what does not change: who says something, models, or none of them."""
        return {
            "type": "hello",
            "models": [
                {**reporter.introduce(), "channel": channel}
                for channel, reporter in self._pipeline.reporters
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
            "repeats": self.repeats,
            "percepts": [
                {**prediction.to_dict(), "age_s": round(now_s - taken_s, 3)}
                for prediction, taken_s in list(self._shown.predictions.values())
            ],
            "video": self._video(),
            "audio": self._audio(),
            "spikes": [trains.to_dict() for trains in self._pipeline.trains()],
        }

    def _video(self) -> dict[str, Any] | None:
        video = self._pipeline.video
        if video is None:
            return None
        newest, picture = video.newest, video.picture
        content: dict[str, Any] = {
            "rate_hz": round(video.quality.numbers.get("fps_hz", video.rate_hz), 1),
            "sensor": video.images.describe(),
            "quality": _in_words(video.quality),
        }
        if newest is not None and picture is not None:
            content |= {
                "size": picture.frame.luma.shape[::-1],
                "markers": numbers(np.where(newest.detected[:, None], newest.position, -1), 1),
                "ring_px": ring_px(newest.position[newest.detected]),
            }
            content |= {name: draw_image(newest, name) for name in (SA1, RA1)}
        return content

    def _audio(self) -> dict[str, Any] | None:
        audio = self._pipeline.audio
        if audio is None:
            return None
        content: dict[str, Any] = {
            "rate_hz": round(audio.rate_hz),
            "quality": _in_words(audio.quality),
        }
        if (spectrum := audio.spectrum()) is not None:
            amplitude, step_hz = spectrum
            content |= {"amplitude": [float(f"{a:.4g}") for a in amplitude], "step_hz": step_hz}
        return content

    def jpeg(self) -> bytes | None:
        """Return the newest camera picture; None before there is one."""
        video = self._pipeline.video
        if video is None or video.picture is None:
            return None
        picture = video.picture
        if picture is not self._encoded[0]:
            options = [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
            _, encoded = cv2.imencode(".jpg", picture.frame.image, options)
            self._encoded = picture, bytes(encoded)
        return self._encoded[1]


def numbers(values: "np.ndarray[Any, Any]", digits: int) -> list[Any]:
    """Return an array as JSON has it, rounded."""
    return list(np.round(values.astype(float), digits).tolist())


def draw_image(images: FrameImages, name: str) -> list[Any] | None:
    """Return the tactile image of a channel as JSON has it; None where there is none.

    A pixel is None where no marker stands, and `LOST` at the one nearest to a lost marker.
    """
    image = images.image(name)
    if image is None:
        return None
    row, column = images.grid.row, images.grid.column
    drawn = np.round(image.astype(float), _DIGITS).astype(object)
    lost = np.rint([row[~images.detected], column[~images.detected]]).astype(int)
    drawn[tuple(np.clip(lost.T, 0, np.array(image.shape) - 1).T)] = LOST
    drawn[~covered(row, column)] = None
    return list(drawn.tolist())


def ring_px(found: Positions) -> float:
    """Return the radius of the rings drawn round markers, px: they do not touch."""
    return round(max(_LEAST_RING_PX, _RING_SHARE * spacing_px(found)), 1) if len(found) > 1 else 9.0


def _in_words(quality: Quality) -> list[dict[str, str]]:
    return [figure._asdict() for figure in quality.figures()]
