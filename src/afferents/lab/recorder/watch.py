"""What a recording is at, for who looks on, and what they ask of it.

Capture leaves references here and goes on: whoever draws them does so in a thread of its own, and
no frame waits for it.
"""

import signal
import time
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from afferents.errors import AfferentsError, Stopped
from afferents.files import free_bytes
from afferents.lab.devices.base import Block, CameraSettings, DriveState, Frame, MicrophoneSettings
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.plan import Entry, Plan

NEXT, REDO, STOP = REQUESTS = ("next", "redo", "stop")
"""What may be asked for: go on, make the run once more, and end as Ctrl-C does."""
_NOTES = 8
_BLOCKS = 300
_LOOK_S = 0.1


class OnceMoreError(AfferentsError):
    """Somebody who was asked for something wants the last accepted run once more first."""

    def __init__(self) -> None:
        """Say it."""
        super().__init__("the last run was asked for once more, and none is recorded yet")


class Watch:
    """The newest of a recording.

    Parameters
    ----------
    show
        Shows a sentence that a person is to act on, beside the page.

    Attributes
    ----------
    camera, microphone
        How they are set; None before they are open.
    sensor_channel
        The sensor's channel of the microphone.
    series
        Grows when pictures begin anew: a run, or a look while somebody changes the drum.
    first, newest
        The first frame of the series, and the last two in a row, as the camera gave them.
    blocks
        Of sound that nobody has taken yet.
    wants_redo
        Whether somebody wants the run that is being made once more.
    """

    def __init__(self, show: Callable[[str], object] = str) -> None:
        """Nothing goes on yet."""
        self._show = show
        self.camera: CameraSettings | None = None
        self.microphone: MicrophoneSettings | None = None
        self.sensor_channel = -1
        self.series = 0
        self.first: Frame | None = None
        self.newest: tuple[Frame, ...] = ()
        self.blocks: deque[Block] = deque(maxlen=_BLOCKS)
        self._plan: Plan | None = None
        self._session = Path()
        self._entry: Entry | None = None
        self._attempt, self._done, self._total = 0, 0, 0
        self._elapsed_s: float | None = None
        self._drive: tuple[float | None, float] | None = None
        self._say, self._ended = "looking at the devices", False
        self._notes: deque[str] = deque(maxlen=_NOTES)
        self._waiting, self._answer = False, ""
        self.wants_redo, self._stop, self._accepted = False, False, 0
        self._devices: Devices | None = None

    # What the recorder tells.

    def opened(self, devices: Devices, plan: Plan, session: Path, done: int, total: int) -> None:
        """Take devices that are open: they are looked at while a person is waited for."""
        self.camera = devices.camera.settings
        self.microphone = devices.sound
        self.sensor_channel = plan.channel
        self._plan, self._session, self._done, self._total = plan, session, done, total
        self._devices = devices

    def prepare(self, entry: Entry, attempt: int) -> None:
        """Say which run comes; attempt 0 is the preflight."""
        self._entry, self._attempt, self._elapsed_s = entry, attempt, None
        self._say = (
            f"{entry.name}: getting ready" if attempt else "preflight: do not touch anything"
        )

    def begin(self) -> None:
        """Begin a series of pictures."""
        self.first, self.newest = None, ()
        self.blocks.clear()
        self.wants_redo = False
        self.series += 1

    def frame(self, frame: Frame) -> None:
        """Take a frame that came."""
        if self.first is None:
            self.first = frame
        self.newest = (*self.newest[-1:], frame)

    def drive(self, state: DriveState, set_mm_s: float, elapsed_s: float) -> None:
        """Take what the drive said, so long after the start of the run."""
        self._drive, self._elapsed_s = (state.speed_mm_s, set_mm_s), elapsed_s

    def judge(self) -> None:
        """Say that the run is over and is being looked at."""
        self._elapsed_s, self._say = None, f"{self._name}: is it good enough?"

    def accepted(self) -> None:
        """Count a run."""
        self._done += 1
        self._accepted += 1

    def taken_back(self) -> None:
        """Count a run no more: it is made once more."""
        self._done -= 1

    def stays(self) -> None:
        """Count the earlier run: no attempt to make it once more was good enough."""
        self._done += 1

    def lost(self, why: str) -> None:
        """Say that the run broke off, and that devices are waited for."""
        self._elapsed_s, self._say = None, f"{self._name}: waiting for the devices: {why}"

    def note(self, text: str) -> None:
        """Keep a sentence for a while."""
        self._notes.append(text)

    def end(self, text: str) -> None:
        """Say what came of it all."""
        self._say, self._ended, self._elapsed_s = text, True, None

    def wait(self, sentence: str) -> None:
        """Say what to do, and wait until somebody says that it is done; the camera goes on.

        Raises
        ------
        OnceMoreError
            If somebody wants the last run once more first.
        """
        self._show(sentence)
        before, self._say, self._answer = self._say, sentence, ""
        self._waiting = True
        try:
            with self._look():
                while not self._answer:
                    time.sleep(_LOOK_S)
                    self.heed()
                if self._answer == REDO:
                    raise OnceMoreError
        finally:
            self._waiting, self._say = False, before

    def _look(self) -> AbstractContextManager[None]:
        """Let camera and microphone run for who looks on; the next run says what is wrong."""
        if self._devices is None:
            return nullcontext()
        self.begin()
        return self._devices.stream(
            self.frame, self.blocks.append, lambda error: self.note(f"while waiting: {error}")
        )

    def heed(self) -> None:
        """End, where somebody asked for that.

        Raises
        ------
        Stopped
            As Ctrl-C does.
        """
        if self._stop:
            raise Stopped(signal.SIGINT)

    # What they who look on ask, and see.

    def request(self, what: str, _: object = None) -> bool:
        """Do what somebody asks; tell whether it can be done now."""
        if what not in self._can:
            return False
        if what == STOP:
            self._stop = True
        elif what == REDO and self._elapsed_s is not None:
            self.wants_redo = True
        else:
            self._answer = what
        return True

    def state(self) -> dict[str, Any]:
        """Return where it is, ready for JSON."""
        return {
            "ended": self._ended,  # first: what is said is then the last
            "say": self._said(),
            "can": self._can,
            "run": self._name,
            "attempt": self._attempt,
            "done": self._done,
            "total": self._total,
            "elapsed_s": self._elapsed_s,
            "run_s": self._plan.total_s if self._plan else None,
            "drive": self._drive if self._elapsed_s is not None else None,
            "free_gb": round(free_bytes(self._session) / 1e9, 1),
            "notes": list(self._notes),
        }

    @property
    def _can(self) -> list[str]:
        """What may be asked for now: once more while a run is made, or waited for after one."""
        again = self._elapsed_s is not None or (self._waiting and self._accepted > 0)
        allowed = {NEXT: self._waiting, REDO: again, STOP: not self._ended}
        return [what for what in REQUESTS if allowed[what]]

    @property
    def _name(self) -> str:
        return self._entry.name if self._entry else ""

    def _said(self) -> str:
        """Return what is to be read in large type."""
        elapsed_s, plan = self._elapsed_s, self._plan
        if elapsed_s is None or plan is None:
            return self._say
        if elapsed_s < plan.rest_s:
            return f"{self._name}: the skin is at rest, do not touch it"
        if elapsed_s < plan.start_s:
            return "tap the fingertip three times, softly"
        if elapsed_s < plan.steady_s[0]:
            return f"{self._name}: the drum gets up to speed"
        return f"{self._name}: recording"
