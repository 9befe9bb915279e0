from .events import (
    Begin as Begin,
)
from .events import (
    CameraFrame as CameraFrame,
)
from .events import (
    Event as Event,
)
from .events import (
    Sound as Sound,
)
from .events import (
    Source as Source,
)
from .events import (
    Trouble as Trouble,
)
from .events import (
    Wanted as Wanted,
)
from .follower import (
    Follower as Follower,
)
from .follower import (
    Touch as Touch,
)
from .network import (
    Network as Network,
)
from .pipeline import (
    LivePipeline as LivePipeline,
)
from .prediction import (
    Counters as Counters,
)
from .prediction import (
    Prediction as Prediction,
)
from .replay import (
    Pace as Pace,
)
from .replay import (
    ReplayedSound as ReplayedSound,
)
from .replay import (
    ReplayedVideo as ReplayedVideo,
)
from .replay import (
    RigShow as RigShow,
)
from .replay import (
    RigSound as RigSound,
)
from .replay import (
    RigVideo as RigVideo,
)
from .sensors import (
    Camera as Camera,
)
from .sensors import (
    Microphone as Microphone,
)
from .sources import (
    open_sources as open_sources,
)
from .sources import (
    sensor_of as sensor_of,
)
from .stream import (
    run as run,
)
from .stream import (
    stream as stream,
)
