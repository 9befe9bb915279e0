"""What every encoding is: a class whose fields are its options, from a response to samples."""

from abc import ABC, abstractmethod
from collections import deque
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
from afferents.encodings.samples import Samples, make_samples
from afferents.errors import InputError
from afferents.markers.places import images_of
from afferents.store.responses import Responses, steady_s
from afferents.store.trimming import cut_audio, cut_frames


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

    and say its `name` and the dims of a sample. One of vibration runs live if it has `stream` too.
    Give it as ``encoding=`` to `afferents.Model`, or name its class in
    `encodings.settings.ENCODINGS` and give a row of `models.model` to it.

    >>> class Mean(ImageEncoding):
    ...     '''Every marker's mean over runs of frames.'''
    ...
    ...     name, sample_dims, of_pixels = "mean", (dims.COMPONENT, dims.MARKER), False
    ...     frames: int = 45
    ...
    ...     @property
    ...     def length(self):
    ...         return self.frames
    ...
    ...     def of_runs(self, runs, lookback):
    ...         return runs.mean(axis=1)
    >>> labels = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0, "units": "px"}
    >>> time = {"time": np.arange(4) / 90}
    >>> response = xr.DataArray(
    ...     [[0.0, 1.0], [2.0, 1.0], [4.0, 4.0], [6.0, 8.0]], time, ("time", "marker"), attrs=labels
    ... )
    >>> Mean(frames=2).samples(response, slice(0, 4), lookback=0).values
    array([[[1., 1.]],
    <BLANKLINE>
           [[5., 6.]]], dtype=float32)

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

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

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

    @property
    def by_distance(self) -> bool:
        """Whether its windows are even in the way along the surface, where that is known."""
        return False

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

    def stream(self, *given: Any, **named: Any) -> Any:
        """Return what encodes what comes: an `ImageStream`, or a `VibrationStream`.

        Of images it is given the response's `lookback`; of vibration, which comes in pieces,
        `rate_hz` and `n_channels`.

        Raises
        ------
        InputError
            If it can't be felt live.
        """
        raise InputError(f"the encoding: expected one that can be felt live, found {self.name}")

    @property
    def runs_live(self) -> bool:
        """Whether `stream` is written, so that it can be felt with."""
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
        try:
            return type(self)(**{**dict(self), **own})
        except ValidationError as error:
            first = error.errors()[0]
            name = str(first["loc"][0]) if first["loc"] else self.name
            wrong = own.get(name, first["input"])
            positive = first["type"] in ("greater_than", "finite_number")
            wanted_is = "a positive number" if positive else reason_in(first)
            raise InputError(
                f"{flags.get(name, name)}: expected {wanted_is}, found {wrong}"
            ) from error


class ImageEncoding(Encoding):
    """An encoding of what markers do, frame by frame: SA-I, RA-I and what is made of them.

    A recording is cut into runs of `length` frames that follow each other, and each becomes a
    sample by `of_runs`; a last incomplete run is dropped. `Encoding` shows a whole one. An
    encoding that cuts recordings in another way writes `samples` anew.
    """

    of_vibration: ClassVar[bool] = False
    of_pixels: ClassVar[bool] = True
    """Whether it encodes tactile images; else what single markers show, (component, marker)."""
    keeps_unit: ClassVar[bool] = True
    """Whether samples are in the unit of the response."""

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return 1

    def suits(self, responses: Responses) -> bool:
        """Tell whether the markers have places in an image, where it needs them."""
        return dims.ROW in responses.coords if self.of_pixels else dims.REST_POSITION in responses

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the samples that runs of frames become, `(n, *sample_shape)`.

        Parameters
        ----------
        runs
            As `runs` gives them.
        lookback
            How many earlier frames the response depends on: 0 for SA-I, 1 for RA-I.

        Raises
        ------
        InputError
            If the encoding does not say.
        """
        raise InputError(
            f"the encoding: expected one that says what it makes of images, found {self.name}"
        )

    def of_frames(self, frames: Floats) -> NDArray[Any]:
        """Return what can be worked out of frames one by one; here they themselves.

        Live it is done once, though a frame is in as many runs as a run has frames.

        Parameters
        ----------
        frames
            (..., component, row, column), or (..., component, marker).
        """
        return frames

    def of_run(self, frames: NDArray[Any], lookback: int) -> Floats:
        """Return the sample that one run becomes, of what `of_frames` gives of its frames."""
        sample: Floats = self.of_runs(frames[np.newaxis], lookback)[0]
        return sample

    def coordinates(self, runs: Floats) -> dict[str, Any]:
        """Return the coordinates of a sample's dims, where it has any."""
        return {}

    def runs(self, response: xr.DataArray, kept: slice) -> Floats:
        """Return runs of frames, (run, frame, component, row, column) or (..., component, marker).

        Raises
        ------
        InputError
            If the markers have no places in an image, or if lost markers (NaN) were not filled.
        """
        series = response.isel({dims.TIME: kept})
        frames = component_images(series) if self.of_pixels else component_series(series)
        n = len(frames) // self.length
        return frames[: n * self.length].reshape(n, self.length, *frames.shape[1:])

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, *sample_dims)` of the runs of one recording.

        Parameters
        ----------
        response
            `(time, marker)` or `(time, marker, space)` without NaN (see `filling.fill`), with the
            recording's `name`, `texture` and `speed_mm_s` in the attributes.

        Raises
        ------
        InputError
            If there are fewer frames than a run has, or as `runs`.
        """
        start_s, stop_s = frame_extents(response[dims.TIME].values, kept, lookback)
        require_run(len(start_s), response.attrs.get("name", "a recording"), self.length)
        runs = self.runs(response, kept)
        n = len(runs) * self.length
        return make_samples(
            self.of_runs(runs, lookback),
            self.sample_dims,
            start_s[: n : self.length],
            stop_s[self.length - 1 : n : self.length],
            response.attrs if self.keeps_unit else without_unit(response.attrs),
            self.coordinates(runs),
        )

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


class RunsLive(ImageEncoding):
    """An encoding that live gives a sample at every image, of the run that it ends."""

    def stream(self, lookback: int) -> "LastRun":
        """Return what gives, at every image, the sample of the run that it ends."""
        return LastRun(self, lookback)


class LastRun:
    """At every image the sample of the run that it ends, where offline one run follows the other.

    Parameters
    ----------
    encoding
        What makes a sample of a run.
    lookback
        Of the response.
    """

    def __init__(self, encoding: ImageEncoding, lookback: int) -> None:
        """Wait for the first run to fill."""
        self._encoding, self._lookback = encoding, lookback
        self._frames: deque[NDArray[Any]] = deque(maxlen=encoding.length)

    def skip(self) -> None:
        """Begin anew: no run may hold both sides of a gap."""
        self._frames.clear()

    def feed(self, image: Floats) -> Floats | None:
        """Return the sample of the run that an image ends; None until one is full.

        Parameters
        ----------
        image
            (row, column), (component, row, column) of a vector, or (component, marker).
        """
        if self._encoding.of_pixels and image.ndim == 2:
            image = image[np.newaxis]
        self._frames.append(self._encoding.of_frames(image))
        if len(self._frames) < self._encoding.length:
            return None
        return self._encoding.of_run(np.stack(self._frames), self._lookback)


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


def without_unit(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes of a response for samples that are not in its unit."""
    return {name: value for name, value in attrs.items() if name != dims.UNITS}


def frame_extents(
    time_s: NDArray[np.float64], frames: slice, memory: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return when what a frame shows began and ended, s, for the frames of the slice.

    Parameters
    ----------
    time_s
        Presentation times of all frames of the recording, shape (n_frames,).
    memory
        How many earlier frames the response looks back at: 0 for SA-I, 1 for RA-I.
    """
    period = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    ends = np.append(time_s[1:], time_s[-1:] + period)
    indices = np.arange(len(time_s))[frames]
    return time_s[np.maximum(indices - memory, 0)], ends[indices]


# What is encoded of a frame: a tactile image, or what each marker shows.


def tactile_images(response: xr.DataArray) -> Floats:
    """Lay the markers of every frame out as an image.

    Parameters
    ----------
    response
        SA-I or RA-I `(time, marker)` with the coordinates `row` and `column` on `marker`.

    Returns
    -------
    Array of shape (time, row, column), float32, in the response's unit. On a square grid row is
    the rank of a marker in y, column its rank in x; the published arrays are the transpose. Of
    other layouts pixels are interpolated between markers; see `markers.places`.

    Raises
    ------
    InputError
        If the markers have no places in an image, or if lost markers (NaN) were not filled before.
    """
    if dims.ROW not in response.coords or dims.COLUMN not in response.coords:
        raise InputError(
            f"{_name_of(response)}: expected markers whose places are known (coordinates row and "
            "column), found a layout that no sensor file describes; calibrate the sensor and "
            "extract again, or use the vibrotactile models"
        )
    _require_filled(response)
    values = response.transpose(dims.TIME, dims.MARKER).values
    return images_of(values, response[dims.ROW].values, response[dims.COLUMN].values)


def component_images(response: xr.DataArray) -> Floats:
    """Return tactile images (time, component, row, column) of a length or of a vector."""
    if dims.SPACE not in response.dims:
        return tactile_images(response)[:, None]
    parts = (response.isel({dims.SPACE: i}, drop=True) for i in range(response.sizes[dims.SPACE]))
    return np.stack([tactile_images(part) for part in parts], axis=1)


def component_series(response: xr.DataArray) -> Floats:
    """Return what markers show, or what all feel together, (time, component, marker or part).

    Raises
    ------
    InputError
        If lost markers (NaN) were not filled before.
    """
    _require_filled(response)
    if dims.SPACE not in response.dims:
        response = response.expand_dims(dims.SPACE)
    return np.asarray(response.transpose(dims.TIME, dims.SPACE, ...).values, np.float32)


def _require_filled(response: xr.DataArray) -> None:
    if bool(response.isnull().any()):
        raise InputError(
            f"{_name_of(response)}: expected lost markers filled, found NaN; fill them with "
            "filling.fill"
        )


def _name_of(response: xr.DataArray) -> str:
    return f"{response.name} of {response.attrs.get('name', 'a recording')}"
