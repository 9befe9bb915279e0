from .camera import (
    RigCamera as RigCamera,
)
from .camera import (
    project as project,
)
from .config import (
    HARD as HARD,
)
from .config import (
    NUISANCES as NUISANCES,
)
from .config import (
    Mounting as Mounting,
)
from .config import (
    Rig as Rig,
)
from .drive import (
    STEADY_S as STEADY_S,
)
from .drive import (
    RigDrive as RigDrive,
)
from .drums import (
    is_drum as is_drum,
)
from .drums import (
    write_stl as write_stl,
)
from .microphone import (
    RigMicrophone as RigMicrophone,
)
from .record import (
    AUDIO as AUDIO,
)
from .record import (
    RECORDED as RECORDED,
)
from .record import (
    REFERENCE as REFERENCE,
)
from .record import (
    TRUTH as TRUTH,
)
from .record import (
    VIDEO as VIDEO,
)
from .record import (
    record as record,
)
from .run import (
    Drawn as Drawn,
)
from .run import (
    Simulated as Simulated,
)
from .run import (
    draw as draw,
)
from .run import (
    tap as tap,
)
from .skin import (
    Skin as Skin,
)
from .surface import (
    Drum as Drum,
)
from .surface import (
    Surface as Surface,
)
from .surface import (
    bumped_surface as bumped_surface,
)
from .surface import (
    mapped_surface as mapped_surface,
)
from .surface import (
    read_height_map as read_height_map,
)
from .surface import (
    soft_maximum as soft_maximum,
)
