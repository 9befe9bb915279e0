"""Recording a plan: preflight, run after run, whether each is good, and what becomes of it."""

import math
import sys
import threading
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path

from afferents.errors import AfferentsError, InputError, then
from afferents.files import Place
from afferents.lab.recorder import gate, rehearsal, run
from afferents.lab.recorder.devices import Devices, make_devices, open_devices
from afferents.lab.recorder.plan import Entry, RecordingPlan, read_plan
from afferents.lab.recorder.preflight import preflight
from afferents.lab.recorder.session import AGAIN, RecordedSession
from afferents.lab.recorder.watch import NEXT, REDO, OnceMoreError, Watch
from afferents.markers.sensor import Sensor, load_sensor
from afferents.outputs import writing_alone
from afferents.progress import Progress
from afferents.rig.sensor_rig import make_rig
from afferents.store.drum_path import MARK

_ONCE_MORE = "r"

Ask = Callable[[str], None]
"""Shows a person a sentence, and returns when it is done."""


def record(
    plan: Place,
    session: Place,
    dry_run: bool = False,
    ask: Ask | None = None,
    quiet: bool = False,
    web: tuple[str, int, str | None] | None = None,
    again: Sequence[str] = (),
) -> "Recorded":
    """Record a session: camera, microphone and drum on one clock, run after run of a plan.

    Parameters
    ----------
    plan
        A ``PLAN.toml``; ``afferents record --example PLAN.toml`` writes one.
    session
        Folder to write, in the published layout; runs that are in it are kept.
    dry_run
        Record the simulated rig instead of the plan's devices, four times as fast as in truth.
    ask
        Shows a person a sentence, such as ``change the drum to 4``, and returns when it is done;
        None for a line in the terminal.
    quiet
        Whether no progress is shown.
    web
        Address, port and token of a page that shows the recording and asks instead of the
        terminal; None for no page. A dry run with a page is a rehearsal: it asks, too.
    again
        Names of runs, such as ``4/60``, to be recorded although they are in the session. Those in
        it are kept aside once the new ones are accepted.

    Returns
    -------
    Recorded
        Names of the runs that were recorded, and what was refused and why.

    Raises
    ------
    InputError
        If the plan or a device is not what it should be, the session is of another plan, or the
        disk is full. What is finished is kept.
    """
    if web is None:
        recorder = make_recorder(Path(plan), dry_run, ask or ask_in_terminal)
        with Progress(quiet) as progress:
            return recorder.record(Path(session), progress, again)
    from afferents.lab.live.web.server import serve_page
    from afferents.lab.recorder.page import RecordingPage

    watch = Watch(show_in_terminal)
    recorder = make_recorder(Path(plan), dry_run, watch.wait, watch=watch)

    def read_terminal() -> None:
        for line in sys.stdin:
            watch.request(REDO if line.strip() == _ONCE_MORE else NEXT)

    with serve_page(RecordingPage(watch, recorder.sensor), *web, watch.request):
        threading.Thread(target=read_terminal, name="afferents-enter", daemon=True).start()
        try:
            with Progress(quiet) as progress:
                done = recorder.record(Path(session), progress, again)
        except BaseException as error:
            stopped = not isinstance(error, Exception)
            watch.say("stopped: what is finished is kept" if stopped else str(error), ended=True)
            raise
        missing = f"; {len(done.remaining)} are missing" if done.remaining else ""
        watch.say(f"done: {len(done.recorded)} runs recorded{missing}", ended=True)
        return done


def show_in_terminal(sentence: str) -> None:
    """Show a person what to do."""
    print(f"\n>>> {sentence}", file=sys.stderr, flush=True)  # noqa: T201


def ask_in_terminal(sentence: str) -> None:
    """Show a sentence and wait for enter.

    Raises
    ------
    OnceMoreError
        If ``r`` is entered: make the last run once more first.
    InputError
        If standard input has ended.
    """
    with suppress(ImportError):  # Windows has none
        import termios

        if sys.stdin.isatty():  # what was typed before answers nothing
            termios.tcflush(sys.stdin, termios.TCIFLUSH)
    show_in_terminal(sentence)
    line = sys.stdin.readline()
    if line.strip() == _ONCE_MORE:
        raise OnceMoreError
    if not line:
        raise InputError(
            "stdin: expected a person who changes drums and presses enter, found its end"
        )


@dataclass
class Recorded:
    """What came of a plan.

    Attributes
    ----------
    session
        The folder.
    preflight
        Its checks.
    recorded
        Names of the runs that were recorded and accepted now.
    kept_aside
        Runs that were refused or broke off in every attempt, and why.
    attempts_aside
        Where each refused attempt lies, and each accepted run that was recorded again, and why.
    remaining
        Runs of the plan that are not in the session.
    """

    session: Path
    preflight: list[gate.Check] = field(default_factory=list)
    recorded: list[str] = field(default_factory=list)
    kept_aside: dict[str, str] = field(default_factory=dict)
    attempts_aside: list[tuple[str, str]] = field(default_factory=list)
    remaining: list[str] = field(default_factory=list)


def make_recorder(path: Path, dry_run: bool, ask: Ask, watch: Watch | None = None) -> "Recorder":
    """Read a plan and find what it needs; nothing is touched or moved.

    Parameters
    ----------
    ask
        Shows a person what to do and waits until it is done.
    watch
        Shows the recording on a page, if there is one; a dry run then asks a person to change
        drums, as a rehearsal.

    Raises
    ------
    InputError
        If the plan is not what it should be.
    """
    plan = read_plan(path)
    sensor, seen = load_sensor(plan.sensor), watch or Watch()
    if not dry_run:
        return Recorder(plan, path, sensor, make_devices(plan, path), ask, watch=seen)
    rig = make_rig(sensor).printed(plan.seed)
    plan = plan.model_copy(update={"drum_mm": rig.drum.diameter_mm, "drum_zero": MARK})
    bench = rehearsal.Bench(rig, plan)
    devices = rehearsal.simulate_devices(plan, path, bench)
    return Recorder(plan, path, sensor, devices, None if watch is None else ask, bench, seen)


@dataclass
class Recorder:
    """Records the runs of a plan.

    Attributes
    ----------
    plan, path
        What is recorded, and the file that says so.
    devices
        With what.
    ask
        Asks a person, who changes drums, and turns them where no motor does; None asks no one.
    bench
        In a dry run, the simulated fingertip on which drums are mounted; None for a real one.
    watch
        Shows the recording on a page.
    """

    plan: RecordingPlan
    path: Path
    sensor: Sensor
    devices: Devices
    ask: Ask | None = None
    bench: rehearsal.Bench | None = None
    watch: Watch = field(default_factory=Watch)
    _texture: str = ""

    def check(self, session: Path) -> list[gate.Check]:
        """Make the preflight alone."""
        with open_devices(self.devices, self.plan, self.path):
            entries = self.plan.entries()
            self.mount(entries[0], 0)
            return preflight(self.devices, self.plan, self.sensor, session, len(entries))

    def record(self, session: Path, progress: Progress, again: Collection[str] = ()) -> Recorded:
        """Record every run of the plan that the session does not hold yet.

        Parameters
        ----------
        again
            Names of runs that are recorded although the session holds them. What it holds stays
            until the new one is accepted, and is put aside then.

        Raises
        ------
        InputError
            If `again` names no run of the plan; if the folder is not this plan's; if the preflight
            says no; if the disk is full. Runs that are finished stay.
        """
        self._progress, self._outcome = progress, Recorded(session)
        self._kept = kept = RecordedSession(session, self.plan, self.bench is not None)
        entries = self.plan.entries()
        there = [entry.name for entry in entries]
        if unknown := [name for name in again if name not in there]:
            some = ", ".join(there[:5]) + (", ..." if len(there) > 5 else "")
            raise InputError(f"--again: expected runs of the plan ({some}), found '{unknown[0]}'")
        todo = [e for e in entries if e.name not in kept.finished or e.name in again]
        if not todo:
            return self._outcome
        with writing_alone(session, "record"), open_devices(self.devices, self.plan, self.path):
            n_done = len(kept.finished - {entry.name for entry in todo})
            self.watch.open(self.devices, self.plan, session, n_done, n_done + len(todo))
            while True:
                try:
                    self.mount(todo[0], 0)
                    break
                except OnceMoreError as error:  # there is no last run yet
                    self._note(str(error))
            checks = preflight(self.devices, self.plan, self.sensor, session, len(todo))
            self._outcome.preflight = checks
            for line in checks:
                self._note(line.describe())
            if failed := [line for line in checks if not line.passes]:
                found = "; ".join(f"{line.name}: {line.found}" for line in failed)
                do = "; ".join(line.do for line in failed if line.do)
                raise InputError(
                    f"{self.path}: expected devices that are ready, found {found}{then(do)}"
                )
            kept.begin(self.devices)
            self._record_all(todo)
        self._outcome.remaining = [e.name for e in todo if e.name not in kept.finished]
        return self._outcome

    def _note(self, line: str) -> None:
        self._progress.note(line)
        self.watch.notes.append(line)

    def mount(self, entry: Entry, attempt: int) -> None:
        """Put the drum of a run in its place; attempt 0 is the preflight. Devices are open."""
        plan, ask = self.plan, self.ask
        self.watch.prepare(entry, attempt)
        if self.bench is not None:
            self.bench.mount(entry, 0)
        if ask is not None and entry.texture != self._texture:
            self._texture = ""  # before the last run is made once more, its drum may be taken off
            ask(f"change the drum to {entry.texture}, then press enter")
            self._texture = entry.texture
        takes_any_speed = math.isinf(self.devices.drive.limits.highest_mm_s)  # it is no motor
        if ask is not None and attempt and takes_any_speed:
            speeds = sorted(plan.speeds_mm_s) if plan.sweep else [entry.speed_mm_s]
            tap = f", tap the fingertip for {plan.tap_s:g} s" if plan.tap_s else ""
            ask(
                f"press enter, let the drum stand for {plan.rest_s:g} s{tap}, then turn it at "
                f"{' to '.join(f'{v:g}' for v in speeds)} mm/s until {plan.total_s:g} s are over"
            )
        if self.bench is not None:  # the film begins anew
            self.bench.mount(entry, attempt)

    def _record_all(self, todo: Sequence[Entry]) -> None:
        """Record runs; where the last accepted one is requested once more, that one first."""
        last: Entry | None = None
        for entry in self._progress.track(todo, "recording", len(todo)):
            while not self._record_run(entry):
                if last is not None:
                    self.watch.done -= 1
                    self._kept.note_opening()  # its drum may have been taken off
                    while not self._record_run(last):
                        pass  # it is requested already
            last = entry if entry.name not in self._outcome.kept_aside else last

    def _record_run(self, entry: Entry) -> bool:
        """Record a run until it is accepted, or there are no attempts left.

        Returns
        -------
        bool
            False where the last run was requested once more instead.
        """
        why, attempt, outcome = "", 1, self._outcome
        while attempt <= self.plan.redo + 1:
            self.watch.stop_if_requested()
            try:
                self.mount(entry, attempt)
            except OnceMoreError:
                return False
            why = self._attempt(entry)
            if not why:
                if entry.name not in outcome.recorded:
                    outcome.recorded.append(entry.name)
                outcome.kept_aside.pop(entry.name, None)
                self.watch.done += 1
                self.watch.has_accepted = True
                return True
            attempt += not self.watch.wants_redo
            again = "recorded again" if attempt <= self.plan.redo + 1 else "kept aside"
            self._note(f"{entry.name}: {why}; {again}")
        if entry.name in self._kept.finished:
            why += "; the earlier one stays"
            self._note(f"{entry.name}: the earlier one stays")
            self.watch.done += 1
        outcome.kept_aside[entry.name] = why
        return True

    def _attempt(self, entry: Entry) -> str:
        """Make a run once; return why it is not kept, or nothing.

        Raises
        ------
        InputError
            If the disk is full, or a device that went away does not come back.
        """
        devices, plan, kept = self.devices, self.plan, self._kept
        folder = kept.running(entry)
        try:
            drum = plan.drum(kept.opened, entry.texture)
            log = run.Run(devices, plan, folder, entry.speed_mm_s, self.watch, drum).make()
            self.watch.say(f"{entry.name}: is it good enough?")
            if self.watch.wants_redo:  # requested after the drive was read last
                raise run.RedoRequestedError
        except AfferentsError as error:
            self._put_aside(folder, entry, str(error))
            if isinstance(error, run.DiskFullError):
                raise InputError(
                    f"{kept.root}: expected room for what is recorded, found {error!s}; the same "
                    "command then goes on; what is finished is kept"
                ) from error
            if not isinstance(error, run.RedoRequestedError):  # else the drum's positions count on
                self.watch.say(f"{entry.name}: waiting for the devices: {error}")
                before = devices.camera.settings.controls
                devices.reopen(self.watch.stop_if_requested, self._note)
                now = devices.camera.settings.controls
                if other := [f"{name} {v:g}" for name, v in now.items() if v != before.get(name)]:
                    self._note(
                        f"the camera came back with {', '.join(other)}; [camera] may set these"
                    )
                kept.note_opening()
                kept.begin(devices)
            return str(error)
        except BaseException:
            self._put_aside(folder, entry, "stopped while it was recorded")
            raise
        counts = gate.count_frames(log, devices.camera.settings.fps_hz, plan.total_s)
        checks = gate.check_run(log, counts, folder, plan, entry.speed_mm_s, devices, self.sensor)
        more = gate.describe_sound_times(log, devices.sound)
        more["camera"] = asdict(devices.camera.settings)
        if plan.tap_s:
            check, more["audio_offset"] = gate.measure_taps(folder, plan, self.sensor)
            checks.append(check)
        why = "; ".join(f"{line.name}: {line.found}" for line in checks if not line.passes)
        if why:
            self._put_aside(folder, entry, why, checks)
            return why
        earlier = kept.accept(folder, entry, checks, counts, more)
        if earlier is not None:
            self._outcome.attempts_aside.append((str(earlier), AGAIN))
        return ""

    def _put_aside(
        self, folder: Path, entry: Entry, why: str, checks: Sequence[gate.Check] = ()
    ) -> None:
        place = self._kept.put_aside(folder, entry.name, why, checks)
        self._outcome.attempts_aside.append((str(place), why))
