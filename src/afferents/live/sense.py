"""What both senses, video and audio, share: who listens, faults, and how late they are."""

import math
import time
from collections.abc import Sequence

from afferents.core.errors import InputError
from afferents.live.events import Begin, Channel, Trouble
from afferents.live.look_session import LookSession
from afferents.live.model_session import ModelSession
from afferents.live.network import Network
from afferents.live.percept import Counters, Percept, State
from afferents.live.quality import Quality
from afferents.live.raster import Raster
from afferents.live.session import Session

LATE_S = 0.1
"""What lags more than this behind the quickest arrival tells of the past."""
_FORGET = 0.001
"""The quickest arrival is forgotten by this share of the time gone by: clocks drift."""


class Sense:
    """The models that feel by one channel; without any, it is looked at.

    Parameters
    ----------
    channel
        Which.
    rate_hz
        Frames or samples a second that models learnt from, or that the source gives.
    networks
        The models, if any.
    quality
        Figures of what comes in.

    Attributes
    ----------
    raster
        Which units fired in the last second; None where nobody asked, see `Senses.show_spikes`.
    """

    raster: Raster | None = None

    def __init__(
        self, channel: Channel, rate_hz: float, networks: Sequence[Network], quality: Quality
    ) -> None:
        """Begin with nothing."""
        self.channel = channel
        self.rate_hz = rate_hz
        self.every_s = 1 / rate_hz
        self.counters = Counters()
        self.quality = quality
        feeling = [ModelSession(network, self.counters, quality) for network in networks]
        self.sessions: Sequence[Session] = feeling or [LookSession(channel, self.counters, quality)]
        self.now_s = 0.0
        self.speed = 1.0
        self._quickest: tuple[float, float] | None = None

    def begin(self, event: Begin) -> None:
        """Forget all but the counters: another recording begins."""
        self.now_s, self._quickest = event.time_s, None
        self.quality.begin()
        if self.raster is not None:
            self.raster.begin()
        for session in self.sessions:
            session.begin()
            session.truth = event.truth

    def skip(self) -> None:
        """Begin anew: what comes next does not follow what came before."""
        for session in self.sessions:
            session.skip()

    def interrupt(self, trouble: Trouble, state: State = "stalled") -> list[Percept]:
        """Say what went wrong, and that nothing fresh is known."""
        self.counters.troubles += 1
        self.skip()
        if self.raster is not None:
            self.raster.begin()
        for session in self.sessions:
            session.interrupt(trouble.what)
        return self.without(state)

    def without(self, state: State) -> list[Percept]:
        """Let all models say that nothing fresh is known."""
        return [session.without(state, self.now_s) for session in self.sessions]

    def is_late(self, time_s: float, arrived_s: float) -> bool:
        """Tell whether what was taken at `time_s` came too late to tell of now; count it."""
        if math.isinf(self.speed):
            return False
        if time.monotonic() - arrived_s > LATE_S:  # it has waited here
            self.counters.late += 1
            return True
        due_s = time_s / self.speed
        lead = arrived_s - due_s
        if self._quickest is not None:
            quickest, since_s = self._quickest
            lead = min(lead, quickest + _FORGET * (arrived_s - since_s))
        self._quickest = lead, arrived_s
        late = arrived_s - due_s - lead > LATE_S
        self.counters.late += late
        return late


def require_alike(networks: Sequence[Network], fields: Sequence[str], what: str) -> None:
    """Refuse models whose cards differ in some fields.

    Raises
    ------
    InputError
        Naming the first that differs from the first of all.
    """
    first, *others = networks
    for other in others:
        if any(getattr(other.card, name) != getattr(first.card, name) for name in fields):
            raise InputError(other.path, f"the {what} of {first.path}", "others")
