"""Feeling texture as it slides: from running sources to percepts, by exported models.

What runs here is what was evaluated: frames and sound in pieces of any size give the same inputs
to the same networks as recordings do offline.
"""

from afferents.live.camera import Camera
from afferents.live.events import Begin, CameraFrame, Event, Sound, Source, Trouble
from afferents.live.microphone import Microphone
from afferents.live.network import Network
from afferents.live.perceiver import Perceiver
from afferents.live.percept import Counters, Percept
from afferents.live.replay import Pace, ReplayedSound, ReplayedVideo
from afferents.live.rig import RigShow, RigSound, RigVideo
from afferents.live.sources import open_sources
from afferents.live.stream import run, stream

__all__ = [
    "Begin",
    "Camera",
    "CameraFrame",
    "Counters",
    "Event",
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
    "open_sources",
    "run",
    "stream",
]
