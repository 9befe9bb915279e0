"""The channels by name."""

from afferents.channels.base import Channel
from afferents.channels.ra1 import Ra1
from afferents.channels.ra1_circumferential import Ra1Circumferential
from afferents.channels.ra1_signed import Ra1Signed
from afferents.channels.ra1_vector import Ra1Vector
from afferents.channels.ra2 import Ra2
from afferents.channels.sa1 import Sa1
from afferents.channels.sa1_vector import Sa1Vector
from afferents.core.errors import InputError

CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Sa1(), Ra1(), Ra2(), Sa1Vector(), Ra1Signed(), Ra1Vector(), Ra1Circumferential(),
    )
}  # fmt: skip
"""The paper's three, then ours."""


def channel_of(wanted: str | Channel) -> Channel:
    """Return the channel of that name, or the channel itself.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if isinstance(wanted, Channel):
        return wanted
    if wanted not in CHANNELS:
        raise InputError("channel", f"a Channel, or one of {', '.join(CHANNELS)}", f"{wanted!r}")
    return CHANNELS[wanted]
