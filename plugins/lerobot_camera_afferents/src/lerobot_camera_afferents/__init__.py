"""A tactile fingertip as a camera of LeRobot: its picture, its markers, SA-I, RA-I or vectors.

LeRobot imports this when any of its commands starts; the camera is imported when one is made.
"""

import lazy_loader

from lerobot_camera_afferents.config_camera import AfferentsCameraConfig as AfferentsCameraConfig

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__, submod_attrs={"camera": ["AfferentsCamera"], "signed": ["draw_signed", "read_signed"]}
)
__all__ += ["AfferentsCameraConfig"]
