"""What a task is: a data set, a part of it, what is held out, and a seed, in a TOML file."""

import hashlib
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, Field

from afferents.documents import as_form, read_toml
from afferents.errors import InputError
from afferents.evaluation.data import OpenedData, open_data, recordings_in
from afferents.evaluation.options import EvaluationOptions
from afferents.files import write_text
from afferents.folds.held_out import key_of
from afferents.store.responses import Responses

HERE = Path(__file__).parent
TASKS = HERE / "tasks"
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
        Of `afferents.evaluate`: what part of the data is used, and what is held out.
    folds
        Checksum over what is tested when, see `checksum_of`; empty where any data will do.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = ""
    title: str = Field(min_length=1)
    data: str = Field(min_length=1)
    options: dict[str, Any] = Field(default_factory=dict)
    folds: str = Field("", pattern="^([0-9a-f]{64})?$")

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

    def recordings(self, source: str) -> list[Responses]:
        """Return the recordings of its data that it is about.

        Raises
        ------
        InputError
            If they can't be read.
        """
        return self._part(open_data([source], self.chosen.without))

    def _part(self, data: Sequence[OpenedData]) -> list[Responses]:
        return self.chosen.ablation.recordings(recordings_in(data))

    def checksum_of(self, recordings: Sequence[Responses]) -> str:
        """Return a checksum over what is tested when: SHA-256 of a line a recording.

        A line is the group that the recording is tested in (a speed, mm/s, or a value of what is
        held out), a tab, and its name. Where some are tested and never learnt from, these alone.
        """
        tested = self.chosen.ablation.tested(recordings)
        groups = self.chosen.by.by_recording(recordings)
        return folds_checksum({
            name: key_of(group) for name, group in groups.items() if not tested or name in tested
        })  # fmt: skip

    def named(self, recordings: Sequence[Responses]) -> tuple[str, str]:
        """Return the name under which entries of these recordings are compared, and its checksum.

        Other recordings than the task's own make another task: ``fabricslide/speed@1a2b3c4d``.
        """
        found = self.checksum_of(recordings)
        return (self.name if found == self.folds else f"{self.name}@{found[:8]}"), found


def folds_checksum(tested: Mapping[str, str]) -> str:
    """Return the checksum over recordings by name and the groups that they are tested in."""
    lines = sorted(f"{group}\t{name}\n" for name, group in tested.items())
    return hashlib.sha256("".join(lines).encode()).hexdigest()


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


def seal(path: Path, data: Path | None = None) -> str:
    """Write the checksum of a task's folds into its file, and return it.

    Raises
    ------
    InputError
        If the file is no task, or its data can't be read.
    """
    task = Task.read(path, path.stem)
    found = task.checksum_of(task.recordings(task.source(data)))
    text = re.sub(r"^folds = .*\n", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    # Before the first table: what stands below one is of that table.
    first = re.search(r"^\[", text, flags=re.MULTILINE)
    at = first.start() if first else len(text)
    write_text(path, f'{text[:at]}folds = "{found}"\n\n{text[at:]}')
    return found
