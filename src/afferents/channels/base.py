"""What a channel is: an afferent response worked out of a recording, or of frames as they come."""

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError


class Skin(NamedTuple):
    """Where the markers of one frame are, and where they are at rest; px, (marker, space).

    A marker that is lost is NaN.
    """

    position: NDArray[np.float64]
    rest: NDArray[np.float64]


class Channel(ABC):
    """A response of the fingertip, named after a class of afferent nerve fibres.

    To add one, say what it is made of, and write `response`; write `step` too if it is to be felt
    live. Give it as ``channel=`` to `afferents.Model`, or name it in `channels.CHANNELS`.

    >>> import xarray as xr
    >>> class Height(Channel):
    ...     '''How far each marker stands above its place at rest, px.'''
    ...
    ...     name, title, made_of, lookback = "height", "height", dims.POSITION, 0
    ...
    ...     def response(self, recording):
    ...         up = recording.rest_position - recording.position
    ...         return up.isel(space=1, drop=True).rename(self.name).assign_attrs(units="px")
    ...
    ...     def step(self, now, before):
    ...         return (now.rest - now.position)[:, 1]
    >>> seen = xr.DataArray([[[5.0, 7.0]]], dims=("time", "marker", "space"))
    >>> rest = xr.DataArray([[5.0, 9.0]], dims=("marker", "space"))
    >>> Height().response(xr.Dataset({"position": seen, "rest_position": rest})).values
    array([[2.]])
    >>> Height().felt_live
    True

    Attributes
    ----------
    name
        In commands, files and code.
    title
        In figures and sentences.
    made_of
        Variable of a recording's responses that it is worked out of; see `core.responses`.
    lookback
        How many earlier frames a frame's response depends on.
    parts
        Names of what it says of the skin as a whole; none where it says something of each marker,
        and so can be laid out as an image.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    made_of: ClassVar[str]
    lookback: ClassVar[int] = 0
    parts: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the response to a recording.

        Parameters
        ----------
        recording
            `position`, `rest_position`, `sa1`, `ra2` as in `core.responses`; at least what the
            channel is made of, read into memory.

        Returns
        -------
        xarray.DataArray
            `(time, marker)` or `(time, marker, space)`, `(time, ...)` of the skin as a whole, or
            `(audio_time, channel)` of vibration, with `units` in its attributes; NaN where a marker
            was lost and in the first frames, which have too few before them.
        """

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return the response to one frame, as `response` would; None if it needs the one before.

        Parameters
        ----------
        now, before
            This frame's markers and those of the frame just before, if there was one.

        Returns
        -------
        NDArray
            Shape (marker,) or (marker, component).

        Raises
        ------
        InputError
            If the channel can't be felt frame by frame.
        """
        raise InputError("the channel", "one that is felt frame by frame", self.name)

    @property
    def felt_live(self) -> bool:
        """Whether `step` is written, or the response is vibration as it comes."""
        return type(self).step is not Channel.step or self.made_of == dims.RA2

    def __eq__(self, other: object) -> bool:
        """Channels of one class are the same, also after they went to another process."""
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))

    def __repr__(self) -> str:
        return f"{type(self).__name__}()"
