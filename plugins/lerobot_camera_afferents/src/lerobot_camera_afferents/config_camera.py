"""What a camera of LeRobot is asked for."""

from dataclasses import dataclass

from lerobot.cameras import CameraConfig

from afferents.errors import InputError

SHOWS = {"picture": None, "markers": None, "sa1": 5.0, "ra1": 1.0, "signed": 5.0}
"""What images show, and the response at the end of the scale, px, of those that show one."""


@CameraConfig.register_subclass("afferents")
@dataclass(kw_only=True)
class AfferentsCameraConfig(CameraConfig):
    """A tactile fingertip as a camera.

    Attributes
    ----------
    source
        ``camera:0``, a clip, or ``rig`` (``rig:TEXTURE/SPEED`` for one drum), as for
        ``afferents live --video``.
    shows
        ``picture``, ``markers`` (rings round those found in the picture), ``sa1`` or ``ra1`` (a
        tactile image in colours), or ``signed`` (vectors of the markers; see `draw_signed`).
    sensor
        A sensor file or a packaged name; None to find markers in the first nine frames, at rest.
    most_px
        SA-I (px) or RA-I (px/frame) of the brightest colour, or what 255 stands for in signed
        images (px, px/frame); None for 5, 1 and 5.
    fps
        Frames a second that a camera is asked for, or that a clip or the rig has; None for its own.
    width, height
        Of the images, px: pictures are scaled to it; None for the size of the source's pictures.

    Raises
    ------
    InputError
        If there is nothing of that name to show, or a number is not above 0.
    """

    source: str
    shows: str = "sa1"
    sensor: str | None = None
    most_px: float | None = None

    def __post_init__(self) -> None:
        """Refuse what no source could give."""
        if self.shows not in SHOWS:
            raise InputError(f"shows: expected {', '.join(SHOWS)}, found '{self.shows}'")
        for name in ("fps", "width", "height", "most_px"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise InputError(f"{name}: expected a number above 0, found {value}")
