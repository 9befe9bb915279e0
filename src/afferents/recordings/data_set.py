"""What a data set is: how files become recordings, or responses that are extracted already."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Self, Union

from afferents.errors import InputError
from afferents.quality.issues import QualityIssue
from afferents.store.recording import Recording, RecordingSet
from afferents.store.responses import Responses


class DataSet(ABC):
    """A reader of recordings as some lab keeps them; it knows all that is peculiar to their files.

    To add one, subclass it and write `scan`; `recognises` tells whether a path is of it, and `read`
    returns one recording. What is learnt from is their sound (`Vibration`), or with
    `extracted_first` what `extract` makes of the videos of a `Session` (`Session.from_table`). Give
    it to `afferents.evaluate` and the other commands in place of a path. On a command line it is
    ``my_data.py:mine``, for one that is made there, or ``my_data.py:Gloves:PATH``. A package offers
    its own to all who install it by an entry point:
    ``[project.entry-points."afferents.recordings"]``, ``gloves = "my_package:Gloves"``.

    >>> class Gloves(DataSet):
    ...     '''Runs of a microphone in a glove, ``{cloth}_{mm/s}.wav``, a second a decision.'''
    ...
    ...     name, title = "gloves", "gloves"
    ...     encodings = {"spectral": {"window_s": 1.0}}
    ...
    ...     def scan(self):
    ...         return Session(self.path, tuple(map(self.run, sorted(self.path.glob("*.wav")))))
    ...
    ...     def run(self, path):
    ...         cloth, speed = path.stem.split("_")
    ...         sound = WavFile(path, channel=0)
    ...         return Recording(path.stem, cloth, float(speed), path, audio=sound)
    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np, soundfile
    >>> from afferents import Recording, Session, WavFile
    >>> with TemporaryDirectory() as folder:
    ...     for run in ("silk_20", "silk_40", "wool_20"):
    ...         soundfile.write(f"{folder}/{run}.wav", np.zeros(8000), 8000)
    ...     found = Gloves(folder).scan()
    ...     print(found.textures, found.speeds_mm_s, dict(found.recordings[2].audio.read().sizes))
    ('silk', 'wool') (20.0, 40.0) {'audio_time': 8000, 'channel': 1}

    Attributes
    ----------
    name
        In commands and files: ``NAME:PATH`` is a path of this data set.
    title
        In sentences.
    encodings
        Options of encodings that suit it, by name of the encoding; those not named are as ever.
    chooses_encodings
        Whether options that `encodings` does not name are chosen to suit rate, lengths and speeds.
    drafted
        Whether `init` drafts the file that describes it.
    extracted_first
        Whether its recordings are extracted into a store before anything learns from them.
    path
        The folder or file that holds it.
    """

    name: str
    title: str
    encodings: Mapping[str, Mapping[str, Any]] = MappingProxyType({})
    chooses_encodings: ClassVar[bool] = False
    drafted: ClassVar[bool] = True
    extracted_first: ClassVar[bool] = False

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def __str__(self) -> str:
        """Return its name and where it is."""
        return f"{self.name}:{self.path}"

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether a path that comes without a name is of this data set, by a look at it."""
        return False

    @abstractmethod
    def scan(self) -> RecordingSet:
        """Return its recordings, each with an id, label, conditions and clock; decode nothing.

        Raises
        ------
        InputError
            If there are none, or they are not what they should be.
        """

    def read(self, name: str) -> Recording:
        """Return the recording of an id; its frames and samples are decoded when read.

        Raises
        ------
        InputError
            If there is none of this id; as `scan`.
        """
        found = {one.name: one for one in self.scan().recordings}
        if name not in found:
            some = ", ".join(list(found)[:5])
            raise InputError(f"{self}: expected an id of its recordings ({some}), found '{name}'")
        return found[name]

    def responses(self) -> Sequence[Responses] | None:
        """Return responses as in `store.responses`, where files hold such; None where they don't.

        Raises
        ------
        InputError
            As `scan`.
        """
        return None

    def config(self) -> Mapping[str, Any]:
        """Return what is known of all its responses, read anew; empty where nothing is.

        Its `recordings` names all that there should be; `sensor` is what the markers were
        followed with (`Sensor.model_dump`); `declared` may say that they are ``simulated``.
        """
        return {}

    def check(self, recording: Recording) -> list[QualityIssue]:
        """Return what `inspect` finds wrong with a recording's headers, before it reads the rest.

        Raises
        ------
        InputError
            If they can't be read.
        """
        return []

    def describe(self, session: RecordingSet) -> list[str]:
        """Return sentences of its own that `inspect` prints of its recordings."""
        return []

    def at_rate(self, fps_hz: float) -> Self:
        """Return it with the true frame rate of its videos, Hz, whatever their containers say.

        Raises
        ------
        InputError
            If it has none.
        """
        raise InputError(
            f"--fps: expected a video, or a session of videos, found '{self}'; leave it out"
        )

    def located(self) -> Self:
        """Return it with its path as any process finds it, wherever it was started."""
        found = copy(self)
        found.path = self.path.resolve()
        return found


Data = Union[str, Path, "DataSet"]
"""A path, ``NAME:PATH``, of your own data set, or the data set itself."""


def list_data_sets(data: Data | Sequence[Data]) -> list[Data]:
    """Return the sources of data, of which there may be one or several."""
    return list(data) if isinstance(data, Sequence) and not isinstance(data, str) else [data]
