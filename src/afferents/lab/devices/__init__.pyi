from .base import (
    Block as Block,
)
from .base import (
    ByHand as ByHand,
)
from .base import (
    Camera as Camera,
)
from .base import (
    CameraSettings as CameraSettings,
)
from .base import (
    DeviceError as DeviceError,
)
from .base import (
    Drive as Drive,
)
from .base import (
    DriveLimits as DriveLimits,
)
from .base import (
    DriveState as DriveState,
)
from .base import (
    Frame as Frame,
)
from .base import (
    Microphone as Microphone,
)
from .base import (
    MicrophoneSettings as MicrophoneSettings,
)
from .base import (
    Options as Options,
)
from .clock import (
    HostClock as HostClock,
)
from .clock import (
    SampleClock as SampleClock,
)
from .drives.dynamixel import (
    DynamixelDrive as DynamixelDrive,
)
from .drives.serial_drive import (
    SerialDrive as SerialDrive,
)
from .found import (
    Found as Found,
)
from .found import (
    find_devices as find_devices,
)
from .picture import (
    decode_picture as decode_picture,
)
from .picture import (
    is_torn as is_torn,
)
from .portable import (
    PortableCamera as PortableCamera,
)
from .portaudio import (
    PortAudioMicrophone as PortAudioMicrophone,
)
from .table import (
    CAMERAS as CAMERAS,
)
from .table import (
    DRIVES as DRIVES,
)
from .table import (
    MICROPHONES as MICROPHONES,
)
from .table import (
    make_device as make_device,
)
from .v4l2.camera import (
    V4l2Camera as V4l2Camera,
)
