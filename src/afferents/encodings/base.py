"""What every encoding is: a class whose fields are its options, from a response to samples."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from afferents import dims
from afferents.choices import Cut
from afferents.documents import reason_in
from afferents.encodings.augment import Stretch
from afferents.encodings.samples import Samples
from afferents.errors import InputError
from afferents.store.responses import Responses, steady_s
from afferents.store.trimming import cut_audio

Floats = NDArray[np.float32]
Indices = NDArray[np.int64]


class SignalInfo(NamedTuple):
    """What is known of a data set's vibration.

    Attributes
    ----------
    rate_hz
        Sample rate, Hz.
    shortest_s, longest_s
        Lengths of what the cut leaves of recordings, s.
    slowest_mm_s, fastest_mm_s
        Sliding speeds, mm/s.
    least_mm
        Way that was slid in the recording that slides the least, mm.
    n_channels
        Vibration channels.
    is_sound
        Whether samples are those of a sound file, without an offset.
    """

    rate_hz: float
    shortest_s: float
    longest_s: float
    slowest_mm_s: float
    fastest_mm_s: float
    least_mm: float
    n_channels: int
    is_sound: bool


class ImageStream(Protocol):
    """An encoding of images that come one after the other."""

    def skip(self) -> None:
        """Begin anew: images are missing before the next, and no sample may hold both sides."""

    def feed(self, image: Floats) -> Floats | None:
        """Return the sample that an image ends, if it ends one."""


class Ready(NamedTuple):
    """A sample of vibration that is complete.

    Attributes
    ----------
    values
        As the model takes it.
    end_s
        When its last value was taken, plus one period, s.
    """

    values: Floats
    end_s: float


class VibrationStream(Protocol):
    """An encoding of vibration that comes in pieces."""

    def skip(self) -> None:
        """Begin anew: values are missing before the next, and no sample may hold both sides."""

    def feed(self, time_s: float, samples: Floats) -> list[Ready]:
        """Take in values (n, channel), the first taken at `time_s`; return what is ready."""


class Option(NamedTuple):
    """A field of an encoding that the command line offers; stands in the field's annotation.

    Commands that encode offer it without further code: `cli.command` reads it from the class.

    Attributes
    ----------
    flag
        As typed, such as ``--window-s``.
    help
        One line for ``--help``, with the unit.
    kind
        What the command line reads: `float`, `int`, or `str` for a field that takes text.
    """

    flag: str
    help: str
    kind: type[float | int | str] = float


class Encoding(BaseModel, ABC):
    """From the response of a channel to samples; its fields are its options.

    To add one, subclass

    - `ImageEncoding`, of markers, and write `of_runs`;
    - `WindowEncoding` (`encodings.windows`), of windows of vibration, and write `features`;
    - or `VibrationEncoding`, of any other vibration, and write `require` and `samples`;

    and give its `name` and the dims of a sample. To run live, one of vibration needs `stream`, too.
    Give it as ``encoding=`` to `afferents.Model`, or name its class in
    `encodings.settings.ENCODINGS` and give a row of `models.model` to it.

    Attributes
    ----------
    name
        In commands, files and code.
    sample_dims
        Names of the dims of a sample.
    of_vibration
        Whether it encodes vibration, and not what markers do.
    scaled
        Whether samples are divided by the largest value learnt from before a network sees them.
    n_copies
        How many copies of a sample `stretched` makes.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: ClassVar[str]
    sample_dims: ClassVar[tuple[str, ...]]
    of_vibration: ClassVar[bool]
    scaled: ClassVar[bool] = False
    n_copies: ClassVar[int] = 0

    @abstractmethod
    def suits(self, responses: Responses) -> bool:
        """Return whether a recording's responses have the form that it encodes."""

    @abstractmethod
    def kept(self, responses: Responses, variable: str, lookback: int, cut: Cut) -> slice:
        """Return what a cut keeps of a recording, by frames or by samples of vibration.

        Parameters
        ----------
        variable
            Name of the response, or of its source: only length, times and rate matter.
        lookback
            How many earlier frames the response depends on.

        Raises
        ------
        InputError
            If what is left is too short for a sample.
        """

    @abstractmethod
    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return the samples of one recording, as `encodings.samples.make_samples` labels them.

        Parameters
        ----------
        response
            `(time, marker)`, `(time, marker, space)` or `(audio_time, channel)`, without NaN, with
            the recording's labels in its attributes.
        kept, lookback
            As `kept` gave and took them.
        """

    @property
    def step(self) -> int:
        """Of how many frames one is used."""
        return 1

    @property
    def needs_speed(self) -> bool:
        """Whether it can't encode recordings whose speed is not known."""
        return False

    @property
    def by_distance(self) -> bool:
        """Whether its windows are even in the way along the surface, where that is known."""
        return False

    def seen(self, values: Floats) -> Floats:
        """Return what a network sees of samples `(n, *sample_shape)`; all, if not written anew."""
        return values

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return copies of samples (at `index`) as other speeds give them, as a network sees them.

        With them the place in `index` of the sample each is of; `stretch` is for spectra.

        Raises
        ------
        InputError
            If the encoding has no such copies.
        """
        raise InputError(
            f"augmentation: expected an encoding whose samples can be stretched, found {self.name}"
        )

    def stream(self, *given: Any, **named: Any) -> Any:
        """Return what encodes what comes: an `ImageStream`, or a `VibrationStream`.

        Of images it is given the response's `lookback`; of vibration, which comes in pieces,
        `rate_hz` and `n_channels`.

        Raises
        ------
        InputError
            If it can't run live.
        """
        raise InputError(f"the encoding: expected one that can run live, found {self.name}")

    @property
    def runs_live(self) -> bool:
        """Whether `stream` is written, so that it can run live."""
        return type(self).stream is not Encoding.stream

    @classmethod
    def suiting(cls, signal: SignalInfo, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return options that suit a data set's vibration, where they are not the defaults.

        Parameters
        ----------
        signal
            What is known of it.
        given
            Options that are decided already; the others are chosen to go with them.
        """
        return {}

    @classmethod
    def options(cls) -> dict[str, Option]:
        """Return the fields that the command line offers."""
        return {
            name: option
            for name, field in cls.model_fields.items()
            for option in field.metadata
            if isinstance(option, Option)
        }

    def describe(self) -> dict[str, Any]:
        """Return its name and its fields, ready for JSON."""
        return {"name": self.name, **self.model_dump(mode="json")}

    def changed(self, **wanted: Any) -> Self:
        """Return the encoding with those of the given values that it has fields for.

        None stands for a value that is not to be changed.

        Raises
        ------
        InputError
            If a value makes no sense.
        """
        fields = type(self).model_fields
        own = {name: v for name, v in wanted.items() if v is not None and name in fields}
        flags = {name: option.flag for name, option in self.options().items()}
        try:
            return type(self)(**{**dict(self), **own})
        except ValidationError as error:
            first = error.errors()[0]
            name = str(first["loc"][0]) if first["loc"] else self.name
            wrong = own.get(name, first["input"])
            positive = first["type"] in ("greater_than", "finite_number")
            expected = "a positive number" if positive else reason_in(first)
            found = f"{flags.get(name, name)}: expected {expected}, found {wrong}"
            raise InputError(found) from error


class VibrationEncoding(Encoding):
    """An encoding of windows of vibration, RA-II.

    Its `samples` is given a response `(audio_time, channel)`. `Encoding` describes what is to be
    written, and `SpectralEncoding` is one.
    """

    of_vibration: ClassVar[bool] = True

    @abstractmethod
    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse n samples of vibration, of a rate in Hz, that are too short to encode.

        Raises
        ------
        InputError
            If they are; `where` names the recording.
        """

    def suits(self, responses: Responses) -> bool:
        """Return whether the responses can be encoded; here any can."""
        return True

    def kept(self, responses: Responses, variable: str, lookback: int, cut: Cut) -> slice:
        """Return the samples of vibration that a cut keeps."""
        name, vibration = responses.attrs["name"], responses[variable]
        rate, n = float(vibration.attrs[dims.SAMPLE_RATE]), vibration.sizes[dims.AUDIO_TIME]
        kept = cut_audio(n, rate, cut, steady_s(responses), name)
        self.require(kept.stop - kept.start, rate, name)
        return kept
