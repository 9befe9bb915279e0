"""What is known of vibration before it is encoded, for encodings to choose their options by."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from afferents import dims
from afferents.choices import Cut
from afferents.encodings.augment import Stretch
from afferents.encodings.samples import Samples
from afferents.encodings.tactile_image import image_runs
from afferents.errors import InputError
from afferents.store.responses import Responses, steady_s
from afferents.store.trimming import cut_audio, cut_frames


class Known(NamedTuple):
    """A data set's vibration.

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

    def samples_within(self, seconds: float) -> float:
        """Return a time that is a whole number of samples, and no longer than any recording, s."""
        return int(min(seconds, self.shortest_s) * self.rate_hz + 1e-6) / self.rate_hz


# Samples made live: from images or vibration as they come.

Floats = NDArray[np.float32]


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


# What an encoding is: how a response becomes the samples that a classifier learns from.

Indices = NDArray[np.int64]


class Option(NamedTuple):
    """A field of an encoding that the command line offers; stands in the field's annotation.

    Commands that encode offer it without further code: `cli.options` reads it from the class.

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

    To add one, subclass `ImageEncoding` (of markers) or `VibrationEncoding`, say the dims of a
    sample, and write `samples`. Give it as ``encoding=`` to `afferents.Model`, or name its class
    in `encodings.settings.ENCODINGS`.

    >>> from afferents.encodings.samples import make_samples
    >>> from afferents.encodings.images import frame_extents
    >>> class Mean(ImageEncoding):
    ...     '''Every marker's mean over runs of frames.'''
    ...
    ...     name, sample_dims = "mean", (dims.MARKER,)
    ...     frames: int = 45
    ...
    ...     @property
    ...     def length(self):
    ...         return self.frames
    ...
    ...     def samples(self, response, kept, lookback):
    ...         start_s, stop_s = frame_extents(response.time.values, kept, lookback)
    ...         n = len(start_s) // self.frames
    ...         runs = response.values[kept][: n * self.frames].reshape(n, self.frames, -1)
    ...         starts = slice(None, n * self.frames, self.frames)
    ...         stops = slice(self.frames - 1, n * self.frames, self.frames)
    ...         values, attrs = runs.mean(1), response.attrs
    ...         return make_samples(
    ...             values, self.sample_dims, start_s[starts], stop_s[stops], attrs
    ...         )
    >>> labels = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0, "units": "px"}
    >>> time = {"time": np.arange(4) / 90}
    >>> response = xr.DataArray(
    ...     [[0.0, 1.0], [2.0, 1.0], [4.0, 4.0], [6.0, 8.0]], time, ("time", "marker"), attrs=labels
    ... )
    >>> Mean(frames=2).samples(response, slice(0, 4), lookback=0).values
    array([[1., 1.],
           [5., 6.]])

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
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: ClassVar[str]
    sample_dims: ClassVar[tuple[str, ...]]
    of_vibration: ClassVar[bool]
    scaled: ClassVar[bool] = False

    @abstractmethod
    def suits(self, responses: Responses) -> bool:
        """Tell whether a recording's responses have the form that it encodes."""

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

    def require_packages(self) -> None:
        """Refuse, before hours of work, if a package that it needs is missing."""

    def seen(self, values: Floats) -> Floats:
        """Return what a network sees of samples `(n, *sample_shape)`; all, if not written anew."""
        return values

    @property
    def n_copies(self) -> int:
        """How many copies of a sample `stretched` makes."""
        return 0

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return copies of samples (at `index`) as other speeds give them, as a network sees them.

        Beside them the place in `index` of the sample each is of; `stretch` is for spectra.

        Raises
        ------
        InputError
            If the encoding has no such copies.
        """
        raise InputError(
            f"augmentation: expected an encoding whose samples can be stretched, found {self.name}"
        )

    @property
    @abstractmethod
    def felt_live(self) -> bool:
        """Whether it has a `stream`, and so can be felt with."""

    @classmethod
    def suiting(cls, known: Known, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return options that suit a data set's vibration, where they are not the defaults.

        Parameters
        ----------
        known
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
        """Return the encoding with those of the values wanted that it has fields for.

        None stands for what is not wanted otherwise.

        Raises
        ------
        InputError
            If a value makes no sense.
        """
        fields = type(self).model_fields
        own = {name: v for name, v in wanted.items() if v is not None and name in fields}
        flags = {name: option.flag for name, option in self.options().items()}
        for name, value in own.items():
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(
                    f"{flags.get(name, name)}: expected a positive number, found {value}"
                )
        try:
            return type(self)(**{**dict(self), **own})
        except ValidationError as error:
            first = error.errors()[0]
            name = str(first["loc"][0]) if first["loc"] else self.name
            wrong = own.get(name, first["input"])
            raise InputError(
                f"{flags.get(name, name)}: expected a positive number, found {wrong}"
            ) from error


class ImageEncoding(Encoding):
    """An encoding of what markers do, frame by frame: SA-I, RA-I and what is made of them.

    Its `samples` is given a response `(time, marker)` or `(time, marker, space)`. `Encoding` shows
    a whole one.
    """

    of_vibration: ClassVar[bool] = False
    of_pixels: ClassVar[bool] = True
    """Whether it encodes tactile images; else what single markers show, (component, marker)."""

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return 1

    def suits(self, responses: Responses) -> bool:
        """Tell whether the markers have places in an image."""
        return dims.ROW in responses.coords

    def runs(self, response: xr.DataArray, kept: slice) -> Floats:
        """Return what samples are made of: runs of tactile images; see `image_runs`."""
        return image_runs(response, kept, self.length)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the samples that runs of tactile images become.

        Parameters
        ----------
        runs
            (n, `length`, component, row, column), as `runs` gives them.

        Raises
        ------
        InputError
            If the encoding does not say.
        """
        raise InputError(
            f"the encoding: expected one that says what it makes of images, found {self.name}"
        )

    def stream(self, lookback: int) -> ImageStream:
        """Return what encodes images as they come, one by one.

        Raises
        ------
        InputError
            If it can't be felt live.
        """
        raise InputError(f"the encoding: expected one that can be felt live, found {self.name}")

    @property
    def felt_live(self) -> bool:
        """Whether `stream` is written."""
        return type(self).stream is not ImageEncoding.stream

    def kept(self, responses: Responses, variable: str, lookback: int, cut: Cut) -> slice:
        """Return the frames that a cut keeps, of every `step`-th.

        They begin with the rest frame: before it there are no markers, and nothing to hold.
        """
        name = responses.attrs["name"]
        time_s = responses[variable][dims.TIME].values
        frames = cut_frames(time_s, cut, steady_s(responses), name)
        rest = int(responses.attrs.get("rest_frame", 0))
        start, rest, stop = (-(-n // self.step) for n in (frames.start, rest, frames.stop))
        kept = slice(max(start, rest + lookback), stop)
        require_run(kept.stop - kept.start, name, self.length)
        return kept


class VibrationEncoding(Encoding):
    """An encoding of windows of vibration, RA-II.

    Its `samples` is given a response `(audio_time, channel)`. `Encoding` says what one has to do,
    and `SpectralEncoding` is one.
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
        """Tell that any vibration will do."""
        return True

    def stream(self, rate_hz: float, n_channels: int) -> VibrationStream:
        """Return what encodes vibration as it comes, in pieces of any size.

        Raises
        ------
        InputError
            If it can't be felt live.
        """
        raise InputError(f"the encoding: expected one that can be felt live, found {self.name}")

    @property
    def felt_live(self) -> bool:
        """Whether `stream` is written."""
        return type(self).stream is not VibrationEncoding.stream

    def kept(self, responses: Responses, variable: str, lookback: int, cut: Cut) -> slice:
        """Return the samples of vibration that a cut keeps."""
        name, vibration = responses.attrs["name"], responses[variable]
        rate, n = float(vibration.attrs[dims.SAMPLE_RATE]), vibration.sizes[dims.AUDIO_TIME]
        kept = cut_audio(n, rate, cut, steady_s(responses), name)
        self.require(kept.stop - kept.start, rate, name)
        return kept


def require_run(n_frames: int, where: str, length: int) -> None:
    """Refuse a recording with fewer than `length` frames after the cut."""
    if n_frames < length:
        raise InputError(
            f"{where}: expected at least {length} frames after the cut, found {n_frames}"
        )
