"""Feeling texture as it slides: from running sources to percepts, by exported models.

Or looking before anything is learnt: at camera, markers, SA-I, RA-I and spectrum (`Looker`).

What runs here is what was evaluated: frames and sound in pieces of any size give the same inputs
to the same networks as recordings do offline.
"""

from afferents.live.camera import Camera
from afferents.live.events import Begin, CameraFrame, Event, Sound, Source, Trouble
from afferents.live.found_images import FoundImages
from afferents.live.images import Images
from afferents.live.looker import Looker
from afferents.live.microphone import Microphone
from afferents.live.network import Network
from afferents.live.perceiver import Perceiver
from afferents.live.percept import Counters, Percept
from afferents.live.replay import Pace, ReplayedSound, ReplayedVideo
from afferents.live.rig import RigShow, RigSound, RigVideo
from afferents.live.sources import images_of, open_sources
from afferents.live.stream import run, stream
from afferents.live.wanted import Wanted

__all__ = [
    "Begin",
    "Camera",
    "CameraFrame",
    "Counters",
    "Event",
    "FoundImages",
    "Images",
    "Looker",
    "Microphone",
    "Network",
    "Pace",
    "Perceiver",
    "Percept",
    "ReplayedSound",
    "ReplayedVideo",
    "RigShow",
    "RigSound",
    "RigVideo",
    "Sound",
    "Source",
    "Trouble",
    "Wanted",
    "images_of",
    "open_sources",
    "run",
    "stream",
]
