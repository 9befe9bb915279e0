"""The tactile channels: SA-I, RA-I and RA-II as in the paper, and with their directions.

A file each. A lost marker is NaN in every channel until `fill` fills it from its neighbours.
"""

from afferents.channels.base import Channel, Skin
from afferents.channels.lost import fill, hold
from afferents.channels.ra1 import marker_speed, ra1
from afferents.channels.ra1_circumferential import ra1_circumferential
from afferents.channels.ra1_signed import ra1_signed
from afferents.channels.ra1_vector import ra1_vector
from afferents.channels.ra2 import ra2
from afferents.channels.sa1 import sa1
from afferents.channels.sa1_local import sa1_local
from afferents.channels.sa1_vector import sa1_vector
from afferents.channels.shear import PARTS, affine_field, global_shear
from afferents.channels.table import CHANNELS, channel_of, name_of_channel

__all__ = [
    "CHANNELS",
    "PARTS",
    "Channel",
    "Skin",
    "affine_field",
    "channel_of",
    "fill",
    "global_shear",
    "hold",
    "marker_speed",
    "name_of_channel",
    "ra1",
    "ra1_circumferential",
    "ra1_signed",
    "ra1_vector",
    "ra2",
    "sa1",
    "sa1_local",
    "sa1_vector",
]
