"""The state of a recording, for a page that shows it, and what its visitors request.

Capture leaves references here and goes on: they are drawn in another thread, and no frame waits
for it.
"""

import signal
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from afferents.errors import AfferentsError, Stopped
from afferents.files import free_bytes
from afferents.lab.devices.base import Block, CameraSettings, DriveState, Frame, MicrophoneSettings
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.plan import Entry, RecordingPlan

NEXT, REDO, STOP = REQUESTS = ("next", "redo", "stop")
"""What a visitor may request: go on, make the run once more, and end as Ctrl-C does."""
_NOTES = 8
_BLOCKS = 300
_LOOK_S = 0.1


class OnceMoreError(AfferentsError):
    """A person who was to do something wants the last accepted run once more first."""

    def __init__(self) -> None:
        """Say it."""
        super().__init__("the last run was requested once more, and none is recorded yet")


class Watch:
    """The newest of a recording.

    Parameters
    ----------
    show
        Shows a sentence that a person is to act on, in addition to the page.

    Attributes
    ----------
    camera, microphone
        How they are set; None before they are open.
    sensor_channel
        The sensor's channel of the microphone.
    series
        Grows when pictures begin anew: with a run, or while a person changes the drum.
    first, newest
        The first frame of the series, and the last two in a row, as the camera gave them.
    blocks
        Of sound that no page has taken yet.
    notes
        The newest sentences on what happened.
    done
        How many runs are recorded.
    has_accepted
        Whether a run was accepted now, so that it can be requested once more.
    wants_redo
        Whether the run that is being made was requested once more.
    """

    def __init__(self, show: Callable[[str], object] = str) -> None:
        """Begin before any device is open."""
        self._show = show
        self.camera: CameraSettings | None = None
        self.microphone: MicrophoneSettings | None = None
        self.sensor_channel = -1
        self.series = 0
        self.first: Frame | None = None
        self.newest: tuple[Frame, ...] = ()
        self.blocks: deque[Block] = deque(maxlen=_BLOCKS)
        self.notes: deque[str] = deque(maxlen=_NOTES)
        self.done, self._total = 0, 0
        self.has_accepted = self.wants_redo = False
        self._plan: RecordingPlan | None = None
        self._session = Path()
        self._run, self._attempt = "", 0
        self._elapsed_s: float | None = None
        self._drive: tuple[float | None, float] | None = None
        self._sentence, self._ended = "looking at the devices", False
        self._waiting, self._answer, self._stop = False, "", False
        self._devices: Devices | None = None

    def open(
        self, devices: Devices, plan: RecordingPlan, session: Path, done: int, total: int
    ) -> None:
        """Take devices that are open: they are shown while a person is waited for."""
        self.camera, self.microphone = devices.camera.settings, devices.sound
        self.sensor_channel = plan.channel
        self._plan, self._session, self.done, self._total = plan, session, done, total
        self._devices = devices

    def prepare(self, entry: Entry, attempt: int) -> None:
        """Take which run comes; attempt 0 is the preflight."""
        self._run, self._attempt = entry.name, attempt
        ready = f"{entry.name}: getting ready"
        self.say(ready if attempt else "preflight: do not touch anything")

    def begin(self) -> None:
        """Begin a series of pictures."""
        self.first, self.newest = None, ()
        self.blocks.clear()
        self.wants_redo = False
        self.series += 1

    def take_frame(self, frame: Frame) -> None:
        """Take a frame that came."""
        if self.first is None:
            self.first = frame
        self.newest = (*self.newest[-1:], frame)

    def take_drive(self, state: DriveState, set_mm_s: float, elapsed_s: float) -> None:
        """Take what the drive answered, and the time since the start of the run."""
        self._drive, self._elapsed_s = (state.speed_mm_s, set_mm_s), elapsed_s

    def say(self, sentence: str, ended: bool = False) -> None:
        """Show a sentence in large type: no run is being made, or the recording has ended."""
        self._sentence, self._ended, self._elapsed_s = sentence, ended, None

    def wait(self, sentence: str) -> None:
        """Show what to do, and wait until a person confirms it; the camera goes on.

        Raises
        ------
        OnceMoreError
            If the last run is requested once more first.
        """
        self._show(sentence)
        before, self._sentence, self._answer = self._sentence, sentence, ""
        self._waiting = True
        try:
            with ExitStack() as seen:
                if self._devices is not None:
                    self.begin()

                    def note(error: Exception) -> None:  # the next run reports what is wrong
                        self.notes.append(f"while waiting: {error}")

                    streams = self.take_frame, self.blocks.append, note
                    seen.enter_context(self._devices.stream(*streams))
                while not self._answer:
                    time.sleep(_LOOK_S)
                    self.stop_if_requested()
                if self._answer == REDO:
                    raise OnceMoreError
        finally:
            self._waiting, self._sentence = False, before

    def stop_if_requested(self) -> None:
        """End as Ctrl-C does, where that was requested.

        Raises
        ------
        Stopped
            If it was.
        """
        if self._stop:
            raise Stopped(signal.SIGINT)

    def request(self, what: str, _: object = None) -> bool:
        """Do what a visitor requests; return whether it can be done now."""
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
            "ended": self._ended,  # first: the sentence is then the last
            "say": self._headline(),
            "can": self._can,
            "run": self._run,
            "attempt": self._attempt,
            "done": self.done,
            "total": self._total,
            "elapsed_s": self._elapsed_s,
            "run_s": self._plan.total_s if self._plan else None,
            "drive": self._drive if self._elapsed_s is not None else None,
            "free_gb": round(free_bytes(self._session) / 1e9, 1),
            "notes": list(self.notes),
        }

    @property
    def _can(self) -> list[str]:
        """What may be requested now: once more while a run is made, or waited for after one."""
        again = self._elapsed_s is not None or (self._waiting and self.has_accepted)
        allowed = {NEXT: self._waiting, REDO: again, STOP: not self._ended}
        return [what for what in REQUESTS if allowed[what]]

    def _headline(self) -> str:
        """Return what is shown in large type."""
        elapsed_s, plan = self._elapsed_s, self._plan
        if elapsed_s is None or plan is None:
            return self._sentence
        if elapsed_s < plan.rest_s:
            return f"{self._run}: the skin is at rest, do not touch it"
        if elapsed_s < plan.start_s:
            return "tap the fingertip three times, softly"
        if elapsed_s < plan.steady_s[0]:
            return f"{self._run}: the drum gets up to speed"
        return f"{self._run}: recording"
