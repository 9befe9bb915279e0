from .events import (
    Begin as Begin,
    CameraFrame as CameraFrame,
    Event as Event,
    Sound as Sound,
    Source as Source,
    Trouble as Trouble,
    Wanted as Wanted,
)
from .follower import Follower as Follower
from .network import Network as Network
from .pipeline import LivePipeline as LivePipeline, run as run, stream as stream
from .prediction import Counters as Counters, Prediction as Prediction
from .replay import Pace as Pace, ReplayedSound as ReplayedSound, ReplayedVideo as ReplayedVideo
from .rig_show import RigShow as RigShow, RigSound as RigSound, RigVideo as RigVideo
from .sensors import Camera as Camera, Microphone as Microphone
from .sources import find_sensor as find_sensor, open_sources as open_sources
from .touch import Touch as Touch
