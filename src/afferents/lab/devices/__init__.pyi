from .base import (
    Block as Block,
    ByHand as ByHand,
    Camera as Camera,
    CameraSettings as CameraSettings,
    DeviceError as DeviceError,
    Drive as Drive,
    DriveLimits as DriveLimits,
    DriveState as DriveState,
    Frame as Frame,
    Microphone as Microphone,
    MicrophoneSettings as MicrophoneSettings,
    Options as Options,
)
from .clock import HostClock as HostClock, SampleClock as SampleClock
from .drives.dynamixel import DynamixelDrive as DynamixelDrive
from .drives.serial_drive import SerialDrive as SerialDrive
from .picture import decode_picture as decode_picture, is_torn as is_torn
from .portable import PortableCamera as PortableCamera
from .portaudio import PortAudioMicrophone as PortAudioMicrophone
from .table import (
    CAMERAS as CAMERAS,
    DRIVES as DRIVES,
    MICROPHONES as MICROPHONES,
    Found as Found,
    find_devices as find_devices,
    make_device as make_device,
)
from .v4l2 import V4l2Camera as V4l2Camera
