"""All constants of the rig in one frozen model, and the switches of its nuisances."""

from collections.abc import Mapping
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from afferents import choices, documents
from afferents.errors import InputError
from afferents.rig.camera import RigCamera
from afferents.rig.drive import RigDrive
from afferents.rig.microphone import RigMicrophone
from afferents.rig.skin import Skin
from afferents.rig.surface import Drum

DEEPEST_MM = 2.0
"""No fingertip is pressed deeper."""


class Mounting(BaseModel):
    """How the fingertip is held against a drum, and what differs from run to run.

    What is drawn when decides what tells one drum from another, so each quantity is drawn at one
    level (`run.draw`): once a session, a drum, or a run.

    Attributes
    ----------
    indentation_mm
        How deep the middle of the tip is pressed in after its first touch, mm (1 mm: paper,
        section 2.2).
    indentation_sd_mm, tilt_rad, lateral_mm
        Standard deviations of the errors of mounting the fingertip by hand (depth, both slopes,
        place along the drum's axis), mm and rad.
    remount
        When the fingertip is mounted: once a session, or anew for each drum, or for each run. The
        paper says only that the depth stays constant when drums are changed (section 2.2).
    friction_sd, friction_change_sd
        Standard deviations of log friction: of the material, drawn once a session, and of its
        change from run to run.
    any_angle
        Whether the drum starts at any angle, another for each run (1), or always the same (0).
    contact_at_rest
        Whether the skin is pressed on the still drum already when the rest frames are taken.
    camera_mm
        Distance of the camera from the skin, mm.
    jitter_s, clock_sd_s
        Standard deviations of the frames' times and of the offset between both clocks, s.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    indentation_mm: float = Field(1.0, gt=0, le=DEEPEST_MM)
    indentation_sd_mm: float = Field(0.1, ge=0)
    tilt_rad: float = Field(0.01, ge=0)
    lateral_mm: float = Field(1.0, ge=0)
    remount: choices.Remount = "session"
    friction_sd: float = Field(0.05, ge=0)
    friction_change_sd: float = Field(0.02, ge=0)
    any_angle: float = Field(1.0, ge=0, le=1)
    contact_at_rest: bool = True
    camera_mm: float = Field(47.0, gt=5)
    jitter_s: float = Field(0.0003, ge=0)
    clock_sd_s: float = Field(0.02, ge=0)


_NUISANCES: Mapping[str, tuple[str, str, float | None]] = {
    "indentation": ("mounting", "indentation_sd_mm", 0.25),
    "tilt": ("mounting", "tilt_rad", 0.03),
    "lateral": ("mounting", "lateral_mm", 2.0),
    "friction": ("mounting", "friction_sd", 0.3),
    "friction-change": ("mounting", "friction_change_sd", 0.1),
    "start-angle": ("mounting", "any_angle", None),
    "frame-jitter": ("mounting", "jitter_s", 0.001),
    "clock-offset": ("mounting", "clock_sd_s", 0.05),
    "eccentricity": ("drive", "eccentricity_mm", 0.4),
    "drift": ("drive", "drift_mm", 0.1),
    "speed-ripple": ("drive", "ripple", 0.03),
    "motor-ripple": ("drive", "motor_ripple", 0.015),
    "going-back": ("drive", "back_spread", None),
    "printing": ("drum", "print_sd_mm", 0.1),
    "warp": ("drum", "patch_sd_mm", 0.2),
    "grip": ("drum", "grip_sd", None),
    "motor": ("microphone", "motor", 0.015),
    "mains": ("microphone", "mains", 0.005),
    "microphone-noise": ("microphone", "noise", 0.03),
    "room-noise": ("microphone", "room_noise", 0.012),
    "camera-noise": ("camera", "noise_grey", 6.0),
    "marker-noise": ("camera", "marker_noise_px", 0.1),
    "blur": ("camera", "blur_px", 1.0),
    "falloff": ("camera", "falloff", 0.4),
    "barrel": ("camera", "barrel", 0.03),
    "roll": ("camera", "roll_deg", None),
}
NUISANCES = {name: (section, field) for name, (section, field, _) in _NUISANCES.items()}
"""Each nuisance's strength: section and field of `Rig`; 0 is off."""
HARD = {name: hard for name, (_, _, hard) in _NUISANCES.items() if hard is not None}
"""Strengths of a rig mounted in a hurry: the paper's is too easy for models beyond its own.

Frozen before any model had learnt from it, and not to be tuned. The others are the rig's own.
"""


class Rig(BaseModel):
    """Drum, fingertip, camera and microphone."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    drum: Drum = Drum()
    skin: Skin = Skin()
    mounting: Mounting = Mounting()
    drive: RigDrive = RigDrive()
    microphone: RigMicrophone = RigMicrophone()
    camera: RigCamera = RigCamera()

    def printed(self, prints: int) -> Self:
        """Return the rig with another set of drums; a session has that of its seed's number."""
        return self.model_copy(update={"drum": self.drum.model_copy(update={"prints": prints})})

    def with_nuisances(self, strengths: Mapping[str, float | None]) -> Self:
        """Return the rig with no other nuisances than those named.

        Parameters
        ----------
        strengths
            By name; None for the rig's own.

        Raises
        ------
        InputError
            If there is none of that name, or it can't be that strong.
        """
        if unknown := sorted(set(strengths) - set(NUISANCES)):
            raise InputError(f"nuisances: expected of {', '.join(NUISANCES)}, found '{unknown[0]}'")
        constants = self.model_dump()
        for name, (section, field) in NUISANCES.items():
            strength = strengths.get(name, 0.0)
            if strength is not None:
                constants[section][field] = strength
        try:
            return type(self).model_validate(constants)
        except ValidationError as error:
            first = error.errors()[0]
            raise InputError(
                f"nuisances: {first['loc'][-1]}: expected {documents.reason_in(first)}, found "
                f"{first['input']}"
            ) from None
