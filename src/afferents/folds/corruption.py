"""Recordings corrupted on purpose, at test and in training: noise, lost frames and markers.

Amounts are drawn from a seed and the recording's name, so any process draws the same. The draw
does not depend on the amount: twice the noise is the same noise twice as large.
"""

import re
import zlib
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import ConfigDict, model_serializer
from pydantic.dataclasses import dataclass

from afferents import channels, dims
from afferents.errors import InputError
from afferents.store.responses import Responses, read_whole

Floats = NDArray[np.floating[Any]]

_SPELL_S = 1.0
"""For this time the same markers are lost."""
_FORM = "as in markers=0.1,sound=-20dB,frames=0.05,lost=0.1,seed=1"
_DRAWS = ("markers", "sound", "frames", "lost")
_MOST = {"markers": np.inf, "sound": np.inf, "frames": 0.9, "lost": 0.9, "seed": np.inf}


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class Corruption:
    """What is done to recordings; nothing by default. Files hold the amounts that are not 0.

    Attributes
    ----------
    markers
        Standard deviation, px, of white noise that is added to the position of every marker, in
        each axis and frame. The rest position has the noise of the rest frame.
    sound
        Effective value (rms) of white noise that is added to each channel of vibration, as a
        share of the channel's own in that recording. It is white up to half the sample rate, so
        that few of it lies below 200 Hz.
    frames
        Share of the frames that are dropped, each by chance; RA-I over a gap is the change since
        the last frame that is left.
    lost
        Share of the markers that are lost, those nearest to a place that moves every second: what
        a shadow or a reflection does to a detector of blobs. How light shifts the markers that are
        still found is not in a store; that takes corrupted videos.
    seed
        Of all draws.
    """

    markers: float = 0.0
    sound: float = 0.0
    frames: float = 0.0
    lost: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse amounts that make no sense."""
        for name, most in _MOST.items():
            value, share = getattr(self, name), most < np.inf
            if not (0 <= value <= most and value < np.inf):
                expected = f"{name}= {'a share from 0 to 0.9' if share else '0 or more'}"
                raise InputError(f"--disturb: expected {expected}, found {value:g}")

    @classmethod
    def of(cls, given: "str | float | Mapping[str, Any] | Corruption | None", option: str) -> Self:
        """Return a corruption as a user gives it: as text, by name, as it is, or none.

        Parameters
        ----------
        given
            Such as ``markers=0.1,sound=-20dB``; of sound a share, or dB.
        option
            Name of the option, for the error.

        Raises
        ------
        InputError
            If it is neither.
        """
        if isinstance(given, Corruption):
            return cls(**asdict(given))
        if isinstance(given, str | float):
            parts = [part.partition("=") for part in str(given).split(",")]
            if wrong := [name for name, equals, _ in parts if not equals]:
                raise InputError(f"{option}: expected {_FORM}, found '{wrong[0]}'")
            given = {name.strip(): value.strip() for name, _, value in parts}
        values: dict[str, Any] = {}
        for name, value in (given or {}).items():
            if name not in _MOST:
                raise InputError(
                    f"{option}: expected some of {', '.join(_MOST)}, {_FORM}, found '{name}'"
                )
            kind = int if name == "seed" else float
            decibel = re.fullmatch(r"(.+?)\s*dB", str(value)) if name == "sound" else None
            try:
                values[name] = 10 ** (float(decibel[1]) / 20) if decibel else kind(value)
            except (TypeError, ValueError) as error:
                raise InputError(f"{option}: expected {_FORM}, found '{name}={value}'") from error
        return cls(**values)

    @property
    def of_markers(self) -> bool:
        """Whether it changes what markers do."""
        return any((self.markers, self.frames, self.lost))

    def __bool__(self) -> bool:
        """Whether it changes anything."""
        return any((self.markers, self.sound, self.frames, self.lost))

    def __str__(self) -> str:
        """Return it as it is typed."""
        return ",".join(f"{name}={value:g}" for name, value in self.describe().items())

    @model_serializer
    def describe(self) -> dict[str, float]:
        """Return it ready for JSON: what is not 0; empty where it changes nothing."""
        return {name: value for name, value in asdict(self).items() if value} if self else {}

    def noise(self, shape: tuple[int, ...], recording: str) -> Floats:
        """Return what is added to positions of that shape (time, marker, space), px."""
        return self._rng(recording, "markers").standard_normal(shape) * self.markers

    def with_noise(self, vibration: Floats, recording: str) -> Floats:
        """Return vibration (audio_time, channel) with its noise."""
        drawn = self._rng(recording, "sound").standard_normal(vibration.shape)
        level = np.std(vibration, axis=0, dtype=np.float64)
        return np.asarray(vibration + drawn * self.sound * level, vibration.dtype)

    def left(self, n_frames: int, recording: str) -> NDArray[np.int64]:
        """Return which of the frames are left."""
        return np.flatnonzero(self._rng(recording, "frames").uniform(size=n_frames) >= self.frames)

    def unseen(self, time_s: Floats, places: Floats, recording: str) -> NDArray[np.bool_]:
        """Return which markers are lost in which frames, (time, marker).

        Parameters
        ----------
        time_s
            Of frames, (time,).
        places
            Of markers at rest, (marker, space).
        """
        spell = ((time_s - time_s[:1]) / _SPELL_S).astype(int)
        n = len(places)
        middle = self._rng(recording, "lost").integers(0, n, spell[-1] + 1)
        away = np.square(places[middle][:, None] - places).sum(axis=2)
        rank = np.argsort(np.argsort(away, axis=1), axis=1)
        return np.asarray((rank < round(self.lost * n))[spell])

    def _rng(self, recording: str, what: str) -> np.random.Generator:
        return np.random.default_rng(
            [self.seed, zlib.crc32(recording.encode()), _DRAWS.index(what)]
        )


def corrupted(responses: Responses, of_vibration: bool, corruption: Corruption) -> Responses:
    """Return the responses to a recording, corrupted: its vibration, or what its markers do.

    Noise is added to the positions of markers. SA-I and RA-I are worked out from these anew, as
    all other channels are, so that RA-I has the difference of two noises.

    Raises
    ------
    InputError
        If the recording has no positions that could be corrupted.
    """
    if not (corruption.sound if of_vibration else corruption.of_markers):
        return responses
    name = str(responses.attrs["name"])
    if of_vibration:
        whole = read_whole(responses, dims.RA2)
        noisy = corruption.with_noise(whole.values, name)
        return responses.assign({dims.RA2: drop_digest(whole.copy(data=noisy))})
    if dims.POSITION not in responses or dims.of_cells(responses):
        expected = "recordings with the positions of markers"
        raise InputError(
            f"--disturb: expected {expected}, found none in {name}; disturb the sound alone"
        )
    position = read_whole(responses, dims.POSITION)
    rest = read_whole(responses, dims.REST_POSITION)
    at_rest = int(responses.attrs.get("rest_frame", 0))
    noise = corruption.noise(position.shape, name)
    seen = position.values + noise
    still = (rest + noise[at_rest]).astype(rest.dtype)
    unseen = corruption.unseen(position[dims.TIME].values, rest.values, name)
    unseen[: at_rest + 1] = False
    seen[unseen] = np.nan
    left = corruption.left(len(seen), name)
    used = {dims.TIME: np.concatenate([np.arange(at_rest + 1), left[left > at_rest]])}
    moved = drop_digest(position.copy(data=seen.astype(position.dtype)))
    return replace_markers(responses.isel(used), moved.isel(used), still)


def replace_markers(responses: Responses, position: xr.DataArray, rest: xr.DataArray) -> Responses:
    """Return responses with other positions of the markers, (time, marker, space) and at rest, px.

    SA-I and RA-I are worked out anew.
    """
    slow = channels.sa1(position, drop_digest(rest))
    found = responses.assign({
        dims.POSITION: position,
        dims.DETECTED: position.notnull().all(dims.SPACE),
        dims.REST_POSITION: drop_digest(rest),
        dims.SA1: drop_digest(slow),
        dims.RA1: drop_digest(channels.ra1(slow)),
    })  # fmt: skip
    return found.assign_attrs(responses.attrs)


def drop_digest(response: xr.DataArray) -> xr.DataArray:
    """Return a response without the digest of its values, which it no longer has."""
    kept = {k: v for k, v in response.attrs.items() if k in (dims.UNITS, dims.SAMPLE_RATE)}
    return response.drop_attrs(deep=False).assign_attrs(kept)
