"""What a task is: a data set, a part of it, what is held out, and a seed, in a TOML file."""

import hashlib
import json
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

from pydantic import BaseModel, ConfigDict, Field

from afferents.documents import as_form, read_toml
from afferents.errors import InputError
from afferents.evaluation.data import Origin, join_recordings, open_data
from afferents.evaluation.options import EvaluationOptions
from afferents.files import write_text
from afferents.folds.held_out import key_of
from afferents.store.responses import Responses

HERE = Path(__file__).parent
TASKS = HERE / "tasks"
OPTIONS = ("textures", "speeds", "without", "split", "test_only", "cut", "steady")
"""Options of `afferents.evaluate` that a task may fix: which part of the data, what is held out."""
FOLDER = Path("data")
"""Where data sets are looked for, each in a folder of its name, unless somebody says elsewhere."""


class DataInfo(BaseModel):
    """A data set of the tasks.

    Attributes
    ----------
    licence, size
        In words.
    reads
        What `afferents evaluate` takes, with ``{folder}`` for where it is.
    get
        The command that brings it, or what to do by hand; empty where it is made.
    made
        Of the simulated rig: what `simulate` is asked for.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    licence: str
    size: str
    reads: str
    get: str = ""
    made: dict[str, Any] = Field(default_factory=dict)


class Task(BaseModel):
    """One question to models.

    Attributes
    ----------
    name
        As commands take it; of one's own the file's name.
    data
        A data set in `data_infos`; else what `afferents evaluate` takes, a path from the file.
    options
        Some of `OPTIONS`.
    folds, fingerprint
        Checksum over what is tested when, see `checksum_of`, and that of the data themselves; empty
        of a task that is not sealed, and where the data are not known or differ from machine to
        machine.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = ""
    title: str = Field(min_length=1)
    data: str = Field(min_length=1)
    options: dict[str, Any] = Field(default_factory=dict)
    folds: str = Field("", pattern="^([0-9a-f]{64})?$")
    fingerprint: str = Field("", pattern="^([0-9a-f]{64})?$")

    @classmethod
    def read(cls, path: Path, name: str) -> Self:
        """Read a task's file.

        Raises
        ------
        InputError
            If it is none, naming the key, or an option that makes no sense.
        """
        task = as_form({"name": name, **read_toml(path, "a task")}, cls, path, "a task")
        if task.data not in data_infos() and ":" not in task.data:
            task = task.model_copy(update={"data": str(path.parent / task.data)})
        if other := sorted(set(task.options) - set(OPTIONS)):
            expected = f"some of {', '.join(OPTIONS)} under [options]"
            raise InputError(f"{path}: expected {expected}, found '{other[0]}'; remove it")
        task.chosen.by  # noqa: B018  refuses what makes no sense
        return task

    @property
    def chosen(self) -> EvaluationOptions:
        """What is chosen of an evaluation."""
        return EvaluationOptions(**self.options)

    @property
    def info(self) -> DataInfo | None:
        """What is known of its data set; None of one's own."""
        return data_infos().get(self.data)

    def source(self, folder: Path | None = None) -> str:
        """Return what `afferents.evaluate` takes of its data.

        Parameters
        ----------
        folder
            Where the data set is; None for where it is looked for.

        Raises
        ------
        InputError
            If nothing is there; it says what to fetch, how large it is and under which licence.
        """
        if self.info is None:
            return str(folder or self.data)
        there = folder or FOLDER / self.data
        reads = self.info.reads.format(folder=there)
        if not self.info.made and not Path(reads.rpartition(":")[2]).is_dir():
            get = self.info.get.format(folder=there)
            raise InputError(
                f"{there}: expected {self.info.title} ({self.info.size}; licence: "
                f"{self.info.licence}), found nothing of it; type '{get}', or say where it is with "
                "--data"
            )
        return reads

    def opened(self, source: str) -> tuple[list[Responses], Origin]:
        """Return the recordings of its data that it is about, and where they come from.

        Raises
        ------
        InputError
            If they can't be read.
        """
        data = open_data([source], self.chosen.without)
        return self.chosen.ablation.recordings(join_recordings(data)), data[0].origin

    def checksum_of(self, recordings: Sequence[Responses]) -> str:
        """Return a checksum over what is tested when: of the options, and a line a recording.

        A line is the group that the recording is tested in (a speed, mm/s, or a value of what is
        held out), a tab, and its name. Where some are tested and never learnt from, these alone.
        """
        tested = self.chosen.ablation.tested(recordings)
        lines = sorted(
            f"{key_of(group)}\t{name}\n"
            for name, group in self.chosen.by.by_recording(recordings).items()
            if not tested or name in tested
        )
        options = json.dumps(self.options, sort_keys=True)
        return hashlib.sha256("".join([options, "\n", *lines]).encode()).hexdigest()

    def asked_of(self, recordings: Sequence[Responses], origin: Origin) -> "Asked":
        """Return what is asked of some recordings: the task's own question, or one beside it."""
        folds = self.checksum_of(recordings)
        data = "" if origin.simulated else origin.fingerprint
        same_data = not self.fingerprint or self.fingerprint == data
        mark = hashlib.sha256(f"{folds}{data}".encode()).hexdigest()[:8]
        sealed = folds == self.folds and same_data
        return Asked(self.name if sealed else f"{self.name}@{mark}", folds, data, mark)


class Asked(NamedTuple):
    """What is asked of some recordings.

    Attributes
    ----------
    name
        Under which entries are compared: the task's where folds and data are those that it is
        sealed with, else the task's and `mark`, such as ``fabricslide/speed@1a2b3c4d``.
    folds, fingerprint
        As of a `Task`.
    mark
        What tells them, in eight digits.
    """

    name: str
    folds: str
    fingerprint: str
    mark: str


def data_infos() -> dict[str, DataInfo]:
    """Return the data sets of the tasks by name."""
    found = tomllib.loads((HERE / "data.toml").read_text(encoding="utf-8"))
    return {name: DataInfo(**info) for name, info in found.items()}


def all_tasks() -> dict[str, Task]:
    """Return the package's tasks by name, such as ``fabricslide/speed``."""
    paths = {
        path.relative_to(TASKS).with_suffix("").as_posix(): path for path in TASKS.rglob("*.toml")
    }
    return {name: Task.read(paths[name], name) for name in sorted(paths)}


def find_task(wanted: str) -> Task:
    """Return a task by its name, or of a TOML file of one's own.

    Raises
    ------
    InputError
        If there is none.
    """
    if wanted.endswith(".toml"):
        return Task.read(Path(wanted), Path(wanted).stem)
    there = all_tasks()
    if wanted not in there:
        raise InputError(
            f"the task: expected one of {', '.join(there)}, or a TOML file, found '{wanted}'"
        )
    return there[wanted]


def seal(task: Path, data: Path | None = None) -> Asked:
    """Write into a task's file which recordings it tests when, so that others test on the same.

    Parameters
    ----------
    task
        TOML file of a task of your own.
    data
        Folder of the task's data set (default: data/NAME in the current folder).

    Raises
    ------
    InputError
        If the file is no task, or its data can't be read.
    """
    read = Task.read(task, task.stem)
    found = read.asked_of(*read.opened(read.source(data)))
    text = seal_text(task.read_text(encoding="utf-8"), found.folds, found.fingerprint)
    write_text(task, text)
    return found


def seal_text(text: str, folds: str, fingerprint: str) -> str:
    """Return a task's file with the checksums before its first table, in place of earlier ones."""
    text = re.sub(r"^(folds|fingerprint)\s*=.*\n", "", text, flags=re.MULTILINE)
    first = re.search(r"^\n*\[", text, flags=re.MULTILINE)
    at = first.start() if first else len(text)
    seals = {"folds": folds, "fingerprint": fingerprint}
    lines = [f'{key} = "{value}"\n' for key, value in seals.items() if value]
    return f"{text[:at].rstrip()}\n{''.join(lines)}\n{text[at:].lstrip()}"
