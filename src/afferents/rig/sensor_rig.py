"""The rig with another fingertip: pins and camera as a sensor file describes them."""

import math

import numpy as np
from pydantic import ValidationError

from afferents.documents import reason_in
from afferents.errors import InputError, then
from afferents.markers.detect import spacing_px
from afferents.markers.sensor import BlobDetector, Sensor
from afferents.rig import camera, config, kernel
from afferents.rig.skin import Skin

_SQUARE_SHARE = 0.8
"""Of the picture's smaller side that a square layout takes up, whose file does not say where."""


def make_rig(sensor: Sensor) -> config.Rig:
    """Return a rig whose skin has the sensor's pins, and whose camera sees them as it does.

    Pins stand where the sensor file's markers are, in the same order, with their middle on the
    axis; the slide is along x. Drum, skin, drive and microphone stay the rig's own, and so do the
    camera's roll, lens and light.

    Raises
    ------
    InputError
        If the file does not say where the markers are or how far apart on the skin, if the sensor
        has a lens that bends the picture (as the rig's camera has), or if its pins don't fit on a
        drum.
    """
    size = sensor.width or camera.RigCamera().width, sensor.height or camera.RigCamera().height
    lattice = (kernel.N_SIDE, kernel.N_SIDE, Skin().pitch_mm)
    is_own = (sensor.rows, sensor.columns, sensor.pitch_mm or lattice[2]) == lattice
    seen = (*size, bool(sensor.looks.blob_colour), sensor.lens)
    if is_own and seen == (camera.RigCamera().width, camera.RigCamera().height, True, None):
        return config.Rig()
    where, hint = f"sensor '{sensor.name}'", "calibrate it, with --pitch-mm"
    if (pitch := sensor.pitch_mm) is None:
        raise InputError(
            f"{where}: expected pitch_mm, the distance of its pins on the skin, found "
            f"none{then(hint)}"
        )
    if sensor.layout != "square" and sensor.markers is None:
        raise InputError(f"{where}: expected where its markers are, found none{then(hint)}")
    if sensor.lens is not None or sensor.picture.turn:
        raise InputError(
            f"{where}: expected no lens and no turn, since the rig's camera has its own, found "
            "one; leave it out"
        )
    if sensor.layout == "square":
        assert sensor.rows is not None
        assert sensor.columns is not None
        y, x = np.indices((sensor.rows, sensor.columns))
        place_mm = np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float64) * pitch
        pins = place_mm - place_mm.mean(axis=0)
        px_per_mm = float(_SQUARE_SHARE * (size / np.ptp(pins, axis=0)).min())
    else:
        markers = np.array(sensor.markers)
        px_per_mm = spacing_px(markers) / pitch
        pins = (markers - markers.mean(axis=0)) / px_per_mm
    try:
        return config.Rig(
            skin=Skin(pins_mm=tuple((round(float(x), 4), round(float(y), 4)) for x, y in pins)),
            camera=_make_camera(sensor, px_per_mm, size),
        )
    except ValidationError as error:
        found = reason_in(error.errors()[0])
        raise InputError(f"{where}: expected pins that the rig can have, found {found}") from None


def _make_camera(sensor: Sensor, px_per_mm: float, size: tuple[int, int]) -> camera.RigCamera:
    """Return a camera to whose pictures the sensor file's detector applies."""
    detector, usual = sensor.looks, camera.RigCamera()
    if isinstance(detector, BlobDetector):
        area = (detector.min_area_px2 + detector.max_area_px2) / 2
        diameter_px = 2 * math.sqrt(area / math.pi)
    else:
        diameter_px = 2 * detector.radius_px
    greys = usual.marker_grey, usual.skin_grey
    marker, skin = greys if detector.blob_colour else greys[::-1]
    return camera.RigCamera(
        width=size[0],
        height=size[1],
        px_per_mm=px_per_mm,
        marker_diameter_mm=diameter_px / px_per_mm,
        marker_grey=marker,
        skin_grey=skin,
    )
