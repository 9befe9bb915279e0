from .camera import (
    RigCamera as RigCamera,
    project as project,
)
from .config import (
    HARD as HARD,
    NUISANCES as NUISANCES,
    Mounting as Mounting,
    Rig as Rig,
)
from .drive import (
    STEADY_S as STEADY_S,
    RigDrive as RigDrive,
)
from .drums import (
    is_drum as is_drum,
    write_stl as write_stl,
)
from .microphone import (
    RigMicrophone as RigMicrophone,
)
from .record import (
    AUDIO as AUDIO,
    RECORDED as RECORDED,
    REFERENCE as REFERENCE,
    TRUTH as TRUTH,
    VIDEO as VIDEO,
    record as record,
)
from .run import (
    Drawn as Drawn,
    Simulated as Simulated,
    draw as draw,
    tap as tap,
)
from .skin import (
    Skin as Skin,
)
from .surface import (
    Drum as Drum,
    Surface as Surface,
    bumped_surface as bumped_surface,
    mapped_surface as mapped_surface,
    read_height_map as read_height_map,
    soft_maximum as soft_maximum,
)
