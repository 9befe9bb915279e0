"""A whole plan: preflight, every run, its gate, and what became of it."""

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from afferents.devices.base import Drive
from afferents.errors import AfferentsError, InputError, then
from afferents.markers.sensor import Sensor, load_sensor
from afferents.outputs import writing_alone
from afferents.progress import Progress
from afferents.recorder.devices import devices_of, opened, simulated_devices
from afferents.recorder.gate import Check, count, gate
from afferents.recorder.plan import Entry, Plan, read_plan
from afferents.recorder.preflight import preflight
from afferents.recorder.rehearsal import Bench
from afferents.recorder.run import Devices, Run, RunFailedError
from afferents.recorder.session import AGAIN, RecordedSession
from afferents.recorder.taps import tapped, times_of_sound
from afferents.recorder.watch import OnceMoreError, Watch
from afferents.rig.sensor_rig import rig_of
from afferents.store.drum_path import MARK


class Crew(Protocol):
    """Who puts the drum of a run in its place."""

    def __call__(self, entry: Entry, attempt: int) -> None:
        """Return when it is there; attempt 0 is the preflight."""
        ...


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
    preflight: list[Check] = field(default_factory=list)
    recorded: list[str] = field(default_factory=list)
    kept_aside: dict[str, str] = field(default_factory=dict)
    attempts_aside: list[tuple[str, str]] = field(default_factory=list)
    remaining: list[str] = field(default_factory=list)


class Person:
    """Asks a person to change the drum, and to turn it where no motor does.

    Parameters
    ----------
    ask
        Shows a sentence and waits until it is done.
    """

    def __init__(self, ask: Callable[[str], None], plan: Plan, drive: Drive) -> None:
        """Nothing is mounted yet."""
        self._ask, self._plan, self._drive, self._texture = ask, plan, drive, ""

    def __call__(self, entry: Entry, attempt: int) -> None:
        """Ask, if there is something to do; the drive is open."""
        if entry.texture != self._texture:
            self._ask(f"change the drum to {entry.texture}, then press enter")
            self._texture = entry.texture
        if attempt and math.isinf(self._drive.limits.highest_mm_s):  # it takes any speed: no motor
            plan = self._plan
            tap = f", tap the fingertip for {plan.tap_s:g} s" if plan.tap_s else ""
            self._ask(
                f"press enter, let the drum stand for {plan.rest_s:g} s{tap}, then turn it at "
                f"{entry.speed_mm_s:g} mm/s until {plan.total_s:g} s are over"
            )


class Rehearsal:
    """A person who is asked as in truth, at a simulated fingertip."""

    def __init__(self, person: Person, bench: Bench) -> None:
        """Nothing is mounted yet."""
        self._person, self._bench = person, bench

    def __call__(self, entry: Entry, attempt: int) -> None:
        """Mount the drum, ask, and begin its film anew."""
        self._bench.mount(entry, 0)
        self._person(entry, attempt)
        self._bench.mount(entry, attempt)


@dataclass(frozen=True)
class Recording:
    """A plan, the devices it is recorded with, and who changes drums."""

    plan: Plan
    path: Path
    sensor: Sensor
    devices: Devices
    crew: Crew
    simulated: bool
    watch: Watch = field(default_factory=Watch)


def recording_of(
    path: Path,
    dry_run: bool,
    ask: Callable[[str], None],
    speed: float = 4.0,
    watch: Watch | None = None,
) -> Recording:
    """Read a plan and find what it needs; nothing is touched or moved.

    Parameters
    ----------
    ask
        Shows a person what to do and waits until it is done.
    speed
        How much faster than in truth a dry run goes.
    watch
        Where who looks on finds the newest, if somebody does; a dry run then asks a person to
        change drums, as a rehearsal.

    Raises
    ------
    InputError
        If the plan is not what it should be.
    """
    plan = read_plan(path)
    sensor, seen = load_sensor(plan.sensor), watch or Watch()
    if not dry_run:
        devices = devices_of(plan, path)
        person = Person(ask, plan, devices.drive)
        return Recording(plan, path, sensor, devices, person, False, seen)
    rig = rig_of(sensor)
    plan = plan.model_copy(update={"drum_mm": rig.drum.diameter_mm, "drum_zero": MARK})
    bench = Bench(rig, plan, speed)
    devices = simulated_devices(plan, path, bench)
    crew: Crew = bench.mount
    if watch is not None:
        crew = Rehearsal(Person(ask, plan, devices.drive), bench)
    return Recording(plan, path, sensor, devices, crew, True, seen)


def check(recording: Recording, session: Path) -> list[Check]:
    """Make the preflight alone."""
    with opened(recording.devices, recording.plan, recording.path) as devices:
        recording.crew(recording.plan.entries()[0], 0)
        return preflight(devices, recording.plan, recording.sensor, session)


def record(
    recording: Recording, session: Path, progress: Progress, again: Collection[str] = ()
) -> Recorded:
    """Record every run of the plan that the session does not hold yet.

    Parameters
    ----------
    again
        Names of runs that are recorded although the session holds them. What it holds stays until
        the new one is accepted, and is put aside then.

    Raises
    ------
    InputError
        If `again` names no run of the plan; if the folder is not this plan's; if the preflight
        says no; if the disk is full. Runs that are finished stay.
    """
    kept = RecordedSession(session, recording.plan, recording.simulated)
    entries = recording.plan.entries()
    _require_runs(again, [entry.name for entry in entries])
    todo = [e for e in entries if e.name not in kept.finished or e.name in again]
    outcome = Recorded(session)
    if not todo:
        return outcome
    with (
        writing_alone(session, "record"),
        opened(recording.devices, recording.plan, recording.path) as devices,
    ):
        n_done = len(kept.finished - {entry.name for entry in todo})
        recording.watch.opened(devices, recording.plan, session, n_done, n_done + len(todo))
        recording.watch.prepare(todo[0], 0)
        recording.crew(todo[0], 0)
        outcome.preflight = preflight(devices, recording.plan, recording.sensor, session)
        _require(outcome.preflight, recording, progress)
        kept.begin(devices)
        last: Entry | None = None
        for entry in progress.track(todo, "recording", len(todo)):
            while not _recorded(recording, kept, entry, outcome, progress):
                if last is not None:
                    recording.watch.taken_back()
                    _recorded(recording, kept, last, outcome, progress)
            last = entry if entry.name not in outcome.kept_aside else last
    outcome.remaining = [entry.name for entry in todo if entry.name not in kept.finished]
    return outcome


def _require_runs(wanted: Iterable[str], there: Sequence[str]) -> None:
    """Refuse names of no run."""
    for name in wanted:
        if name not in there:
            some = ", ".join(there[:5]) + (", ..." if len(there) > 5 else "")
            raise InputError(f"--again: expected runs of the plan ({some}), found '{name}'")


def _require(checks: Sequence[Check], recording: Recording, progress: Progress) -> None:
    """Refuse to begin where the preflight says no."""
    for line in checks:
        progress.note(line.describe())
        recording.watch.note(line.describe())
    failed = [line for line in checks if not line.passes]
    if failed:
        found = "; ".join(f"{line.name}: {line.found}" for line in failed)
        do = "; ".join(line.do for line in failed if line.do)
        raise InputError(
            f"{recording.path}: expected devices that are ready, found {found}{then(do)}"
        )


def _recorded(
    recording: Recording,
    kept: RecordedSession,
    entry: Entry,
    outcome: Recorded,
    progress: Progress,
) -> bool:
    """Record a run; tell whether it was, and the last one was not asked for instead."""
    try:
        _record_one(recording, kept, entry, outcome, progress)
    except OnceMoreError:
        return False
    return True


def _record_one(
    recording: Recording,
    kept: RecordedSession,
    entry: Entry,
    outcome: Recorded,
    progress: Progress,
) -> None:
    """Record a run until the gate accepts it, or there are no attempts left."""
    why, attempt = "", 1
    while attempt <= recording.plan.redo + 1:
        recording.watch.heed()
        recording.watch.prepare(entry, attempt)
        recording.crew(entry, attempt)
        recording.watch.prepare(entry, attempt)
        why = _attempt(recording, kept, entry, outcome)
        if not why:
            if entry.name not in outcome.recorded:
                outcome.recorded.append(entry.name)
            outcome.kept_aside.pop(entry.name, None)
            recording.watch.accepted()
            return
        attempt += not recording.watch.wants_redo
        again = "recorded again" if attempt <= recording.plan.redo + 1 else "kept aside"
        progress.note(f"{entry.name}: {why}; {again}")
        recording.watch.note(f"{entry.name}: {why}; {again}")
    outcome.kept_aside[entry.name] = why


def _attempt(recording: Recording, kept: RecordedSession, entry: Entry, outcome: Recorded) -> str:
    """Make a run once; return why it is not kept, or nothing.

    Raises
    ------
    InputError
        If the disk is full, or a device that went away does not come back.
    """
    devices, plan = recording.devices, recording.plan
    folder = kept.running(entry)
    try:
        drum = plan.drum(kept.opened, entry.texture)
        log = Run(devices, plan, folder, entry.speed_mm_s, recording.watch, drum).make()
        recording.watch.judge()
    except AfferentsError as error:
        _put_aside(kept, folder, entry, str(error), [], outcome)
        if isinstance(error, RunFailedError) and error.ends_plan:
            raise InputError(
                f"{kept.root}: expected room for what is recorded, found {error!s}; the same "
                "command then goes on; what is finished is kept"
            ) from error
        _open_again(devices)
        kept.open()
        return str(error)
    except BaseException:
        _put_aside(kept, folder, entry, "stopped while it was recorded", [], outcome)
        raise
    camera = devices.camera.settings
    sound = devices.microphone.settings if devices.microphone else None
    checks = gate(log, folder, plan, entry.speed_mm_s, camera, sound, recording.sensor)
    heard = tapped(folder, plan, recording.sensor) if plan.tap_s else None
    checks += [heard.check] if heard else []
    why = "; ".join(f"{line.name}: {line.found}" for line in checks if not line.passes)
    if why:
        _put_aside(kept, folder, entry, why, checks, outcome)
    else:
        more = times_of_sound(log, sound, heard)
        earlier = kept.accept(folder, entry, checks, count(log, camera, plan.total_s), more)
        if earlier is not None:
            outcome.attempts_aside.append((str(earlier), AGAIN))
    return why


def _put_aside(
    kept: RecordedSession,
    folder: Path,
    entry: Entry,
    why: str,
    checks: list[Check],
    outcome: Recorded,
) -> None:
    outcome.attempts_aside.append((str(kept.refuse(folder, entry, why, checks)), why))


def _open_again(devices: Devices) -> None:
    """Let go of the devices and open them again: one may have been unplugged."""
    for device in (devices.camera, devices.microphone, devices.drive):
        if device is not None:
            device.close()
            device.open()
