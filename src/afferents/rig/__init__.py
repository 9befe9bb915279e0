"""The simulated rig: drums, skin, camera and microphone, for everyone without a sensor.

Physics with a few constants; nothing in it knows a texture but through the drum's surface.
"""

from afferents.rig.camera import Camera, project
from afferents.rig.config import HARD, NUISANCES, Mounting, Rig
from afferents.rig.drive import STEADY_S, Drive
from afferents.rig.microphone import Microphone
from afferents.rig.record import AUDIO, RECORDED, REFERENCE, TRUTH, VIDEO, record
from afferents.rig.run import Drawn, Simulated, draw, simulate
from afferents.rig.skin import Skin
from afferents.rig.stl import is_drum, write_stl
from afferents.rig.surface import (
    Drum,
    Surface,
    bumped_surface,
    felt,
    mapped_surface,
    read_height_map,
)
from afferents.rig.tap import tap

__all__ = [
    "AUDIO",
    "HARD",
    "NUISANCES",
    "RECORDED",
    "REFERENCE",
    "STEADY_S",
    "TRUTH",
    "VIDEO",
    "Camera",
    "Drawn",
    "Drive",
    "Drum",
    "Microphone",
    "Mounting",
    "Rig",
    "Simulated",
    "Skin",
    "Surface",
    "bumped_surface",
    "draw",
    "felt",
    "is_drum",
    "mapped_surface",
    "project",
    "read_height_map",
    "record",
    "simulate",
    "tap",
    "write_stl",
]
