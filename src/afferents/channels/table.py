"""The channels by name."""

from afferents.channels.base import Channel
from afferents.channels.ra1 import Ra1
from afferents.channels.ra1_circumferential import Ra1Circumferential
from afferents.channels.ra1_signed import Ra1Signed
from afferents.channels.ra1_vector import Ra1Vector
from afferents.channels.ra2 import Ra2
from afferents.channels.sa1 import Sa1
from afferents.channels.sa1_local import Sa1Local
from afferents.channels.sa1_vector import Sa1Vector
from afferents.channels.shear import Shear
from afferents.channels.spikes import Ra1Spikes, Ra2Spikes, Sa1Spikes
from afferents.core.errors import InputError
from afferents.core.own import imported, reference_of

CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Sa1(), Ra1(), Ra2(), Sa1Vector(), Ra1Signed(), Ra1Vector(), Ra1Circumferential(),
        Shear(), Sa1Local(), Sa1Spikes(), Ra1Spikes(), Ra2Spikes(),
    )
}  # fmt: skip
"""The paper's three, then ours."""


def channel_of(wanted: str | Channel | type[Channel]) -> Channel:
    """Return the channel of that name (or ``module:NAME`` of one's own), or the channel itself.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if isinstance(wanted, str) and ":" in wanted:
        wanted = imported(wanted)
    if isinstance(wanted, type) and issubclass(wanted, Channel):
        return wanted()
    if isinstance(wanted, Channel):
        return wanted
    if wanted not in CHANNELS:
        raise InputError("channel", f"a Channel, or one of {', '.join(CHANNELS)}", f"{wanted!r}")
    return CHANNELS[wanted]


def name_of_channel(channel: Channel) -> str:
    """Return the name by which `channel_of` finds a channel: its own, or ``module:NAME``.

    Raises
    ------
    InputError
        If it is somebody's own and can't be imported.
    """
    if CHANNELS.get(channel.name) == channel:
        return channel.name
    return reference_of(type(channel))
