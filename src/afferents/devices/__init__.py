"""Cameras, microphones and drives: what a recording is made with.

A kind is a class of its own, with a form of its options, and a row in `table`. Base classes say
what each must do; all times are seconds of the monotonic clock.
"""

from afferents.devices.base import (
    Block,
    Camera,
    CameraSettings,
    DeviceError,
    Drive,
    DriveLimits,
    DriveState,
    Frame,
    Microphone,
    MicrophoneSettings,
)
from afferents.devices.clock import HostClock, SampleClock
from afferents.devices.drives.by_hand import ByHand
from afferents.devices.drives.dynamixel import DynamixelDrive
from afferents.devices.drives.serial_drive import SerialDrive
from afferents.devices.found import Found, find_devices
from afferents.devices.options import Options
from afferents.devices.picture import is_torn, picture_of
from afferents.devices.portable import PortableCamera
from afferents.devices.portaudio import PortAudioMicrophone
from afferents.devices.simulated_drum import SimulatedDrum
from afferents.devices.table import CAMERAS, DRIVES, MICROPHONES, device_of
from afferents.devices.tally import Tally
from afferents.devices.v4l2.camera import V4l2Camera

__all__ = [
    "CAMERAS",
    "DRIVES",
    "MICROPHONES",
    "Block",
    "ByHand",
    "Camera",
    "CameraSettings",
    "DeviceError",
    "Drive",
    "DriveLimits",
    "DriveState",
    "DynamixelDrive",
    "Found",
    "Frame",
    "HostClock",
    "Microphone",
    "MicrophoneSettings",
    "Options",
    "PortAudioMicrophone",
    "PortableCamera",
    "SampleClock",
    "SerialDrive",
    "SimulatedDrum",
    "Tally",
    "V4l2Camera",
    "device_of",
    "find_devices",
    "is_torn",
    "picture_of",
]
