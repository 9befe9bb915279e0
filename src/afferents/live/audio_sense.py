"""From vibration to percepts, by RA-II."""

from afferents.core.errors import InputError
from afferents.encodings import Ready, VibrationEncoding
from afferents.live.events import Begin, Sound
from afferents.live.network import Network
from afferents.live.percept import Percept
from afferents.live.sense import Sense, require_alike

JUMP_S = 0.002
"""Sound whose time is off by more than this from the samples' count has lost some."""


class AudioSense(Sense):
    """Models that feel by one microphone, or other vibration channels.

    Parameters
    ----------
    networks
        One or more.
    offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Raises
    ------
    InputError
        If they learnt from different rates or spectra.
    """

    def __init__(self, networks: list[Network], offset_s: float = 0.0) -> None:
        """Wait for the first window to fill."""
        card = networks[0].card
        super().__init__("audio", networks, card.sample_rate_hz)
        require_alike(networks, ("sample_rate_hz", "encoding", "shape"), "sample rate and spectra")
        encoding = networks[0].encoding
        if not isinstance(encoding, VibrationEncoding):
            raise InputError(networks[0].path, "an encoding of vibration", encoding.name)
        self.encoding = encoding
        self.every_s = float(getattr(encoding, "stride_s", 1.0))
        self.offset_s = offset_s
        self.newest: Ready | None = None
        self._stream = encoding.stream(self.rate_hz, card.shape[0])
        self._next_s: float | None = None

    def begin(self, event: Begin) -> None:
        """Wait for the first window of another recording."""
        self._stream.skip()
        self._next_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: samples are missing before the next one."""
        self._stream.skip()
        super().skip()

    def hear(self, sound: Sound) -> list[Percept]:
        """Take in some samples."""
        time_s = sound.time_s - self.offset_s
        self.counters.samples += len(sound.samples)
        if self._next_s is not None and abs(gap_s := time_s - self._next_s) > JUMP_S:
            self.counters.lost_samples += max(0, round(gap_s * self.rate_hz))
            self.skip()
        self.now_s = self._next_s = time_s + len(sound.samples) / self.rate_hz
        late = self.is_late(self.now_s, sound.arrived_s)
        ready = self._stream.feed(time_s, sound.samples)
        if ready:
            self.newest = ready[-1]
        if ready and late:
            return self.without("stalled")
        percepts = [
            session.feel(sample.values, sample.end_s, self.every_s, sound.arrived_s)
            for sample in ready
            for session in self.sessions
        ]
        return [percept for percept in percepts if percept]
