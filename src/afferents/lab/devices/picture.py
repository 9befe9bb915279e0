"""Pictures from what a camera gives, for a preview and for live."""

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.lab.devices.base import CameraSettings

Luma = NDArray[np.uint8]
Picture = tuple[Luma, Luma | None]

LIMITED = np.clip((np.arange(256) - 16) * 255 / 219, 0, 255).round().astype(np.uint8)
"""Grey level of each luma value from 16 to 235, as cameras give YUYV."""


def decode_picture(data: bytes, settings: CameraSettings) -> Picture | None:
    """Decode what a camera gave.

    Parameters
    ----------
    data
        A JPEG or raw pixels.
    settings
        Of the camera: its format says which.

    Returns
    -------
    tuple
        Luma, (height, width), and the grey level of each luma value (None where they are the
        same), as `afferents.store.recording.Frame` has them. None where the data are no picture
        of that size.
    """
    shape = (settings.height, settings.width)
    raw = np.frombuffer(data, np.uint8)
    if settings.format == "MJPG":
        picture = cv2.imdecode(raw, cv2.IMREAD_GRAYSCALE) if len(raw) else None
        if picture is None or picture.shape != shape:
            return None
        return np.asarray(picture, np.uint8), None
    n = shape[0] * shape[1]
    if settings.format == "GREY":
        return (raw[:n].reshape(shape), None) if len(raw) >= n else None
    if settings.format == "YUYV":
        return (raw[: 2 * n : 2].reshape(shape), LIMITED) if len(raw) >= 2 * n else None
    return None


def is_torn(data: bytes, settings: CameraSettings) -> bool:
    """Return whether data are cut short: a JPEG without its beginning or end, too few pixels."""
    if settings.format == "MJPG":
        # Cameras fill up with zeros after the end.
        return not (data.startswith(b"\xff\xd8") and data.rstrip(b"\0").endswith(b"\xff\xd9"))
    pixels = settings.width * settings.height
    return len(data) < pixels * (2 if settings.format == "YUYV" else 1)
