"""The three tactile channels: SA-I, RA-I and RA-II, one file each.

A lost marker is NaN in every channel until `hold` fills it.
"""

from afferents.channels.lost import hold
from afferents.channels.offset import Offset, measure_offset
from afferents.channels.ra1 import marker_speed, ra1
from afferents.channels.ra2 import ra2
from afferents.channels.sa1 import sa1
from afferents.channels.vector import ra1_circumferential, ra1_signed, ra1_vector, sa1_vector

__all__ = [
    "Offset",
    "hold",
    "marker_speed",
    "measure_offset",
    "ra1",
    "ra1_circumferential",
    "ra1_signed",
    "ra1_vector",
    "ra2",
    "sa1",
    "sa1_vector",
]
