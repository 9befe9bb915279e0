"""The session that is recorded: runs under temporary names until whole, and `session.json`."""

import os
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

from afferents import files
from afferents.documents import read_json
from afferents.errors import InputError
from afferents.files import Place, naming, write_json
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.gate import Check, Counts
from afferents.lab.recorder.plan import Entry, RecordingPlan
from afferents.lab.writers import repair
from afferents.markers.sensor import packaged_sensors
from afferents.recordings.layouts import AUDIO, VIDEO
from afferents.recordings.session_file import SESSION_FILE
from afferents.version import __version__

RUNNING, ASIDE, WHY, RUN = ".running", ".aside", "why.json", "run.json"
"""Runs that are being made; those that were refused or broke off, and why; what is known of a run
that is whole: where it is, the run is finished."""
AGAIN = "accepted, and another was recorded in its place"
"""Why an accepted run lies aside."""
SENSOR = "sensor.toml"
"""The plan's sensor file, kept with the recordings."""
_PLAN, _RUNS, _SUMS = "plan", "runs", "checksums"
_MAY_CHANGE = ("redo", "tolerance", "notes", "camera", "microphone", "drive")
"""Keys of a plan that may change while the session stays the same."""
_DECLARED = ("fps_hz", "frame_width", "frame_height", "sample_rate_hz", "audio_channels")


class RecordedSession:
    """A session folder that is being recorded.

    Parameters
    ----------
    root
        Its folder.
    plan
        What is recorded.
    simulated
        Whether it is a dry run.

    Attributes
    ----------
    opened
        When the devices were opened last.

    Raises
    ------
    InputError
        If the folder holds something else, or a session of another plan.
    """

    def __init__(self, root: Path, plan: RecordingPlan, simulated: bool) -> None:
        """Look whether the folder may be written."""
        self.root, self.plan, self._simulated = root, plan, simulated
        self._file = root / SESSION_FILE
        self._content: dict[str, Any] = {}
        self.note_opening()
        if not self._file.is_file():
            files.require_free(root, files.holds_only())
            return
        self._content = read_json(self._file, "a session file")
        kinds = "a session of real devices", "a rehearsal"  # which has the rig's drum in its plan
        was = bool(self._content.get("simulated"))
        if was != simulated:
            expected, found = kinds[simulated], kinds[was]
            raise InputError(f"{root}: expected {expected}, found {found}; name another folder")
        plans = []
        for one in (self._content.get(_PLAN), plan.model_dump(mode="json")):
            if isinstance(one, dict):
                one = {key: value for key, value in one.items() if key not in _MAY_CHANGE}
            plans.append({_PLAN: one})
        files.require_same_config(root, "a session", *plans)

    def note_opening(self) -> None:
        """Note that devices are opened, from which on a drive's positions may count anew."""
        self.opened = datetime.now(UTC).isoformat(timespec="milliseconds")

    @property
    def finished(self) -> set[str]:
        """Names of the runs that are whole and accepted."""
        names = (entry.name for entry in self.plan.entries())
        return {name for name in names if (self.root / name / RUN).is_file()}

    def begin(self, devices: Devices) -> None:
        """Write what the session is; put aside what an earlier program left unfinished.

        Raises
        ------
        InputError
            If devices give other rates, sizes or channels than those of the runs that are there,
            or sound to runs without it.
        """
        camera, limits = devices.camera.settings, asdict(devices.drive.limits)
        sound = devices.sound
        channels, sensor = sound.channels if sound else 2, self.plan.sensor
        with naming(self.root):
            self.root.mkdir(parents=True, exist_ok=True)
            if sensor not in packaged_sensors():  # a file is copied, so that it goes along
                shutil.copyfile(sensor, self.root / SENSOR)
                sensor = SENSOR
        earlier, self._content = self._content, {
            "simulated": self._simulated,
            "sample_rate_hz": round(sound.rate_hz) if sound else 44100,  # as wav files have it
            "audio_channels": channels,
            "sensor_channel": self.plan.channel % channels,
            "fps_hz": camera.fps_hz,
            "frame_width": camera.width,
            "frame_height": camera.height,
            "steady_s": list(self.plan.steady_s),
            "direction": self.plan.direction,
            "sensor": sensor,
            "conditions": dict(self.plan.conditions),
            _PLAN: self.plan.model_dump(mode="json"),
            "camera": asdict(camera),
            "microphone": asdict(sound) if sound else None,
            "drive": {name: v if isfinite(v) else None for name, v in limits.items()},
            "versions": {
                "afferents": __version__, **{name: version(name) for name in ("av", "numpy")}
            },
            "holes": self._content.get("holes", ()),
            _SUMS: self._content.get(_SUMS, {}),
        }  # fmt: skip
        if self.finished:
            require_same_rates("the devices", self._file, earlier, self._content)
            if (earlier.get("microphone") is None) != (sound is None):
                expected, found = ("no sound", "some") if sound else ("sound", "no [microphone]")
                raise InputError(
                    f"the plan: expected {expected}, as in {self._file}, found {found}; name "
                    "another folder"
                )
        self._save()
        for left in sorted(self.root.glob(f"{RUNNING}-*")):
            name = left.name.removeprefix(f"{RUNNING}-").replace("~", "/")
            self.put_aside(left, name, "the program ended while it was recorded")

    def running(self, entry: Entry) -> Path:
        """Return a new folder for a run that is being made."""
        folder = self.root / f"{RUNNING}-{entry.name.replace('/', '~')}"
        with naming(folder):
            files.remove(folder)
            folder.mkdir()
        return folder

    def accept(
        self,
        folder: Path,
        entry: Entry,
        checks: list[Check],
        counts: Counts,
        more: Mapping[str, Any],
    ) -> Path | None:
        """Give a run its name: it is whole. Return where an earlier one lies that had it.

        Parameters
        ----------
        more
            What else is known of it, ready for JSON.
        """
        recorded = [path for name in (VIDEO, AUDIO) if (path := folder / name).is_file()]
        about: dict[str, Any] = {
            _SUMS: {path.name: files.checksum(path) for path in recorded},
            "checks": [check.as_json() for check in checks],
            "frames": counts._asdict(),
            **more,
        }
        write_json(folder / RUN, about)
        for path in filter(Path.is_file, folder.rglob("*")):  # so that it outlives a power cut
            with path.open("rb+") as file:
                os.fsync(file.fileno())
        target = self.root / entry.name
        with naming(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            earlier = self.put_aside(target, entry.name, AGAIN) if target.exists() else None
            folder.replace(target)
        self._save()
        _sync_names(target.parent)
        return earlier

    def put_aside(self, folder: Path, name: str, why: str, checks: Sequence[Check] = ()) -> Path:
        """Put a run aside, by its name: nothing is thrown away. Return where it lies."""
        repair(folder / AUDIO)
        place = self.root / ASIDE / name.replace("/", "~")
        place.mkdir(parents=True, exist_ok=True)
        numbers = [int(path.name) for path in place.iterdir() if path.name.isdigit()]
        target = place / f"{max(numbers, default=0) + 1}"
        folder.replace(target)
        with suppress(InputError):  # of a full disk: what was recorded is kept without it
            write_json(target / WHY, {"why": why, "checks": [check.as_json() for check in checks]})
        return target

    def _save(self) -> None:
        """Write `session.json`; what is not finished is a hole, so that it can be read any time.

        Runs that were imported, and holes that they made, stay.
        """
        finished, entries = self.finished, self.plan.entries()
        planned = {(entry.texture, entry.speed_mm_s) for entry in entries}
        missing = {(e.texture, e.speed_mm_s) for e in entries if e.name not in finished}
        missing |= {(str(t), float(v)) for t, v in self._content["holes"]} - planned
        about = {name: read_json(self.root / name / RUN, "a run") for name in sorted(finished)}
        names = {entry.name for entry in entries}
        sums = {name: its for name, its in self._content[_SUMS].items() if name not in names}
        sums |= {name: run.pop(_SUMS) for name, run in about.items()}
        self._content |= {"holes": sorted(map(list, missing)), _SUMS: sums, _RUNS: about}
        if self.plan.sweep:  # its recordings are listed, without a speed
            media = {"video": VIDEO} | ({"audio": AUDIO} if self.plan.microphone else {})
            self._content |= {"holes": [], "recordings": [
                {"texture": entry.texture, "repetition": f"{entry.repetition}", "id": entry.name}
                | {kind: f"{entry.name}/{name}" for kind, name in media.items()}
                for entry in entries if entry.name in finished
            ]}  # fmt: skip
        write_json(self._file, self._content)
        _sync_names(self.root)


def _sync_names(folder: Path) -> None:
    """Have a folder's names written to the disk, where folders can be opened: not on Windows."""
    with suppress(OSError):
        opened = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


def require_same_rates(
    where: Place, file: Path, before: Mapping[str, Any], now: Mapping[str, Any]
) -> None:
    """Refuse what has other rates or sizes than a session's file: it holds them for all runs.

    Raises
    ------
    InputError
        Naming the first that differs; frame rates may by a tenth, others in what is rounded.
    """
    for key in _DECLARED:
        one, other = before.get(key), now.get(key)
        most = 0.1 * (one or 0) if key == "fps_hz" else 0.5
        if one is not None and other is not None and abs(one - other) > most:
            raise InputError(f"{where}: expected {key} {one:g}, as in {file}, found {other:g}")
