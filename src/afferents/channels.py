"""SA-I, RA-I and RA-II as in the paper (Equations 1 and 2), and other channels."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import DTypeLike, NDArray

from afferents import dims, plugins
from afferents.errors import InputError

Floats = NDArray[np.float64]

PARTS = ("shift_x", "shift_y", "divergence", "curl", "stretch", "shear")
"""The mean displacement, and what the four gradients of the plane say: growth, turning, stretch
along x, and stretch along the diagonal."""
_LEAST_SPREAD = 1e-3
"""Of the places of markers that are seen, squared and relative to all: fewer lie on a line."""


def change(response: xr.DataArray) -> xr.DataArray:
    """Return how much a response `(time, ...)` changes from frame to frame, NaN in the first."""
    return response - response.shift({dims.TIME: 1})


NO_DISPLACEMENT = (
    "the channel: expected markers, which have a displacement, found cells, which have none; take "
    "sa1 or ra1"
)


@dataclass(frozen=True, eq=False)
class Skin:
    """Where the markers are, in one frame or in many, and where they are at rest; px.

    Attributes
    ----------
    position
        Shape (..., marker, space); a marker that is lost is NaN.
    rest
        Shape (marker, space).
    kept
        Numbers that displacements are of; of float32, as a store keeps them.
    grey
        Of cells, which never move, in place of distances: shape (..., marker), grey levels.
    """

    position: NDArray[np.floating]
    rest: NDArray[np.floating]
    kept: DTypeLike = np.float32
    grey: NDArray[np.floating] | None = None

    @cached_property
    def distance(self) -> NDArray[np.floating]:
        """How far each marker stands from rest, (..., marker), px; of cells grey levels."""
        if self.grey is not None:
            return self.grey
        squared = (self.position - self.rest) ** 2
        return np.asarray(np.sqrt(squared[..., 0] + squared[..., 1]))

    @property
    def unit(self) -> str:
        """Of SA-I."""
        return dims.PIXELS if self.grey is None else dims.GREY_LEVELS

    @cached_property
    def displacement(self) -> NDArray[np.floating]:
        """The displacement of each marker from rest, (..., marker, space), px.

        Raises
        ------
        InputError
            If these are cells, which have none.
        """
        if self.grey is not None:
            raise InputError(NO_DISPLACEMENT)
        position, rest = (one.astype(self.kept, copy=False) for one in (self.position, self.rest))
        return np.asarray(position - rest)


class Channel(ABC):
    """A response of the fingertip, named after a class of afferent nerve fibres.

    To add one, say what it is made of, and write `response`; write `step` too if it is to run
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
    >>> Height().runs_live
    True

    Attributes
    ----------
    name
        In commands, files and code.
    title
        In figures and sentences.
    made_of
        Variable of a recording's responses that it is worked out of; see `store.responses`.
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
            `position`, `rest_position`, `sa1`, `ra2` as in `store.responses`; at least what the
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
            If the channel can't be worked out frame by frame.
        """
        raise InputError(
            f"the channel: expected one that is worked out frame by frame, found {self.name}"
        )

    @property
    def runs_live(self) -> bool:
        """Whether `step` is written, or the response is vibration as it comes."""
        return type(self).step is not Channel.step or self.made_of == dims.RA2

    def __eq__(self, other: object) -> bool:
        """Channels of one class that were made alike are the same, in another process as well."""
        return type(self) is type(other) and _held(self) == _held(other)

    def __hash__(self) -> int:
        return hash(type(self))

    def __repr__(self) -> str:
        held = ", ".join(f"{name}={value!r}" for name, value in _held(self).items())
        return f"{type(self).__name__}({held})"


def _held(channel: object) -> dict[str, Any]:
    """Return what a channel was made with, by name; arrays as lists, which compare."""
    return {n: v.tolist() if isinstance(v, np.ndarray) else v for n, v in vars(channel).items()}


class MotionChannel(Channel):
    """A channel worked out of where the markers are: `step` says how, in one frame or in many.

    Attributes
    ----------
    unit
        Of the response.
    """

    made_of = dims.POSITION
    unit: ClassVar[str] = dims.PIXELS

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return what `step` says of all frames at once, NaN where one has too few before it.

        Raises
        ------
        InputError
            If a dim is missing, or the recording is of cells.
        """
        if dims.of_cells(recording):
            raise InputError(NO_DISPLACEMENT)
        of_frames, of_rest = (dims.TIME, dims.MARKER, dims.SPACE), (dims.MARKER, dims.SPACE)
        position = dims.require(recording[dims.POSITION], of_frames, dims.POSITION)
        rest = dims.require(recording[dims.REST_POSITION], of_rest, dims.REST_POSITION)
        n, still = len(position), rest.values.astype(np.float64)
        now, before = (
            Skin(position.values[part], still, position.dtype)
            for part in (slice(self.lookback, None), slice(0, max(0, n - self.lookback)))
        )
        stepped = np.asarray(self.step(now, before))
        values = np.full((n, *stepped.shape[1:]), np.nan, position.dtype)
        values[self.lookback :] = stepped
        like = position
        if self.parts:
            like = position.isel({dims.MARKER: 0, dims.SPACE: 0}, drop=True)
            like = like.expand_dims({self.name: list(self.parts)}, axis=1)
        elif values.ndim == 2:
            like = position.isel({dims.SPACE: 0}, drop=True)
        return xr.DataArray(values, like.coords, like.dims, self.name, {dims.UNITS: self.unit})


class Sa1(Channel):
    """SA-I: how far each marker stands from its place at rest, px; of cells grey levels."""

    name, title, made_of = dims.SA1, "SA-I", dims.SA1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return SA-I `(time, marker)` as it was extracted, px."""
        return recording[dims.SA1]

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return SA-I of one frame, (marker,), px."""
        return now.distance


def sa1(position: xr.DataArray, rest_position: xr.DataArray) -> xr.DataArray:
    """Return the artificial SA-I response, Eq. 1: `SA[n,t] = |p[n,t] - p[n,rest]|`.

    Parameters
    ----------
    position
        `(time, marker, space)`, px; NaN where a marker was lost.
    rest_position
        `(marker, space)`, px; the same markers in the same order.

    Returns
    -------
    xarray.DataArray
        `sa1` `(time, marker)`, px, never negative; NaN where the marker was lost.

    Raises
    ------
    InputError
        If a dim is missing, or the two do not hold the same markers.
    """
    position = dims.require(position, (dims.TIME, dims.MARKER, dims.SPACE), dims.POSITION)
    rest = dims.require(rest_position, (dims.MARKER, dims.SPACE), dims.REST_POSITION)
    n, n_rest = position.sizes[dims.MARKER], rest.sizes[dims.MARKER]
    if n != n_rest:
        raise InputError(
            f"{dims.REST_POSITION}: expected {n} markers as in {dims.POSITION}, found {n_rest}"
        )
    for dim in (dims.MARKER, dims.SPACE):
        here, there = position.indexes.get(dim), rest.indexes.get(dim)
        if here is not None and there is not None and not here.equals(there):
            raise InputError(
                f"{dims.REST_POSITION}: expected the {dim} labels of {dims.POSITION}, found others"
            )
    squared = (position - rest) ** 2
    distance: xr.DataArray = squared.sum(dims.SPACE, skipna=False) ** 0.5
    return distance.rename(dims.SA1).assign_attrs(
        {dims.UNITS: dims.PIXELS, "long_name": "SA-I, displacement of the marker from rest"}
    )


def compute_sa1(tracks: xr.Dataset) -> xr.DataArray:
    """Return SA-I `(time, marker)` of tracks, px; of cells, which don't move, in grey levels."""
    if dims.of_cells(tracks):
        return tracks[dims.SA1]
    return sa1(tracks[dims.POSITION], tracks[dims.REST_POSITION])


class Sa1Vector(MotionChannel):
    """The displacement of each marker from rest, px, whose length the paper takes.

    Natural afferents of this kind prefer directions (Birznieks et al., J. Neurosci. 2001, 21:8222).
    """

    name, title = dims.SA1_VECTOR, "SA-I vector"

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return the displacement, (..., marker, space), px."""
        return now.displacement


class Plane(NamedTuple):
    """A plane fitted to the displacement of every frame.

    Attributes
    ----------
    shift
        Displacement in the middle of all markers, (frame, space), px.
    gradient
        Of the component in each direction, (frame, direction, component), px per px.
    radius_px
        Root mean square distance of the markers from their middle.
    field
        The plane at each marker, (frame, marker, space), px.
    """

    shift: Floats
    gradient: Floats
    radius_px: float
    field: Floats


class Shear(MotionChannel):
    """The global shear: how the skin as a whole is dragged, stretched and turned; six numbers, px.

    A plane is fitted to the displacement of the markers over their places at rest, by least
    squares: u(r) = t + G (r - c), with c the middle of all markers. The paper sees in this shear a
    cue of friction, and what carries texture in its images (Pestell & Lepora 2022, Discussion).

    Its parts are `shift_x` and `shift_y`, the displacement in the middle of the markers (the mean
    displacement where none is lost); then, of the gradients of u = (u, v) along x and y,
    `divergence` du/dx + dv/dy, `curl` dv/dx - du/dy, `stretch` du/dx - dv/dy and `shear`
    du/dy + dv/dx. x points right and y down in the image, so a positive curl turns clockwise.

    The four gradients are given as the root mean square displacement that they cause, so that all
    six have one unit: the strain times `radius_px` / 2, which stands in the attributes. NaN where
    fewer than three markers were seen, or only some on one line.
    """

    name, title = dims.SHEAR, "global shear"
    parts = PARTS

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the global shear `(time, shear)`, px."""
        radius_px = _centre(recording[dims.REST_POSITION].values.astype(np.float64))[1]
        return super().response(recording).assign_attrs(radius_px=radius_px)

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return the global shear, (..., 6), px."""
        plane = fit_plane(now.displacement, now.rest)
        (du_dx, dv_dx), (du_dy, dv_dy) = np.moveaxis(plane.gradient, 0, 2)
        strain = [du_dx + dv_dy, dv_dx - du_dy, du_dx - dv_dy, du_dy + dv_dx]
        found = np.column_stack([plane.shift, plane.radius_px / 2 * np.stack(strain, axis=1)])
        return found.reshape(*now.position.shape[:-2], len(PARTS))


def _centre(rest: NDArray[np.floating]) -> tuple[NDArray[np.floating], float]:
    """Return where markers (marker, space) lie about their middle, px, and how far, in the RMS."""
    about = rest - np.nanmean(rest, axis=0)
    return about, float(np.sqrt(np.nanmean((about**2).sum(axis=1))))


def fit_plane(moved: NDArray[np.floating], rest: NDArray[np.floating]) -> Plane:
    """Fit a plane to the displacement of the markers that are seen, frame by frame.

    Parameters
    ----------
    moved, rest
        (frame, marker, space), or (marker, space) of a single frame, and (marker, space), px.
    """
    moved = moved.reshape(-1, *rest.shape)
    about, radius_px = _centre(rest)
    basis = np.column_stack([np.ones(len(rest)), about / radius_px])
    seen = np.isfinite(moved).all(axis=2) & np.isfinite(basis).all(axis=1)
    known = np.where(seen[..., np.newaxis], moved, 0).astype(np.float64)
    basis = np.nan_to_num(basis)
    products = (basis[:, :, np.newaxis] * basis[:, np.newaxis]).reshape(len(rest), -1)
    normal = (seen.astype(np.float64) @ products).reshape(-1, 3, 3)
    right = np.einsum("mb,tms->tbs", basis, known)
    fit = np.linalg.eigvalsh(normal)[:, 0] > _LEAST_SPREAD * len(rest)
    solved = np.full(right.shape, np.nan)
    solved[fit] = np.linalg.solve(normal[fit], right[fit])
    return Plane(solved[:, 0], solved[:, 1:] / radius_px, radius_px, basis @ solved)


class Sa1Local(MotionChannel):
    """The displacement of each marker from rest less the global shear, px."""

    name, title = dims.SA1_LOCAL, "SA-I vector without shear"

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return what is left of the displacement, (..., marker, space), px."""
        moved = now.displacement
        plane = fit_plane(moved, now.rest).field.reshape(moved.shape)
        return np.asarray(moved - plane.astype(moved.dtype))


class Ra1(Channel):
    """RA-I: how much SA-I changes from frame to frame, px/frame (Eq. 2).

    As the paper defines it, it is blind to a marker that circles its place at rest, and counts px a
    frame, not a second. The speed of the marker itself is `marker_speed`.
    """

    name, title, made_of, lookback = dims.RA1, "RA-I", dims.SA1, 1

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return RA-I `(time, marker)`, px/frame."""
        return ra1(recording[dims.SA1])

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return RA-I of one frame, (marker,), px/frame."""
        return None if before is None else np.abs(now.distance - before.distance)


def ra1(sa1: xr.DataArray) -> xr.DataArray:
    """Return the artificial RA-I response, Eq. 2: `RA[n,t] = |SA[n,t] - SA[n,t-1]|`.

    Parameters
    ----------
    sa1
        `(time, marker)`, px (of cells grey levels), one row a frame of the video; NaN where a
        marker was lost.

    Returns
    -------
    xarray.DataArray
        `ra1` `(time, marker)`, in that unit a frame, never negative. The first frame is NaN, for
        nothing comes before it (the published code takes SA itself there); so is a frame in which,
        or before which, the marker was lost.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    response = dims.require(sa1, (dims.TIME, dims.MARKER), dims.SA1)
    unit = response.attrs.get(dims.UNITS, dims.PIXELS)
    changed: xr.DataArray = abs(change(response))
    return changed.rename(dims.RA1).assign_attrs(
        {dims.UNITS: f"{unit}/frame", "long_name": "RA-I, change of SA-I in one frame"}
    )


def marker_speed(position: xr.DataArray) -> xr.DataArray:
    """Return how fast each marker moves, from the true frame times.

    Parameters
    ----------
    position
        `(time, marker, space)`, px, with the coordinate `time` in s; NaN where lost.

    Returns
    -------
    xarray.DataArray
        `marker_speed` `(time, marker)`, px/s, the mean speed since the frame before. The first
        frame is NaN; so is a frame in which, or before which, the marker was lost.

    Raises
    ------
    InputError
        If a dim or the coordinate `time` is missing, or if times do not rise.
    """
    position = dims.require(position, (dims.TIME, dims.MARKER, dims.SPACE), dims.POSITION)
    if dims.TIME not in position.coords:
        raise InputError(f"{dims.POSITION}: expected the coordinate '{dims.TIME}' in s, found none")
    time_s = position[dims.TIME].values
    step_s = np.diff(time_s)
    if (stuck := np.flatnonzero(step_s <= 0)).size:
        frame = int(stuck[0]) + 1
        raise InputError(
            f"{dims.POSITION}: expected times that rise, found {time_s[frame]} s at frame {frame} "
            f"after {time_s[frame - 1]} s"
        )
    steps = np.concatenate([[np.nan], step_s])[: len(time_s)].astype(position.dtype)
    squared = change(position) ** 2
    speed: xr.DataArray = squared.sum(dims.SPACE, skipna=False) ** 0.5
    speed = speed / xr.DataArray(steps, dims=dims.TIME)
    return speed.rename("marker_speed").assign_attrs(
        {dims.UNITS: dims.PIXELS_PER_SECOND, "long_name": "speed of the marker in the image"}
    )


class Ra1Vector(MotionChannel):
    """The step of each marker since the frame before, px/frame."""

    name, title, lookback, unit = dims.RA1_VECTOR, "RA-I vector", 1, dims.PIXELS_PER_FRAME

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating] | None:
        """Return the steps, (..., marker, space), px/frame."""
        return None if before is None else now.displacement - before.displacement


class Ra2(Channel):
    """RA-II: the vibration of microphone or taxels."""

    name, title, made_of = dims.RA2, "RA-II", dims.RA2

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the vibration `(audio_time, channel)` as it was extracted."""
        return recording[dims.RA2]


def ra2(audio: xr.DataArray) -> xr.DataArray:
    """Return the artificial RA-II response: the vibration, unfiltered and unscaled.

    What makes it a response (windows, spectra) belongs to the encoding.

    Parameters
    ----------
    audio
        `(audio_time, channel)` with `sample_rate_hz` in its attributes; unit as it comes.

    Returns
    -------
    xarray.DataArray
        `ra2` `(audio_time, channel)` float32, attributes kept; NaN stays NaN.

    Raises
    ------
    InputError
        If a dim or the sample rate is missing.
    """
    vibration = dims.require(audio, (dims.AUDIO_TIME, dims.CHANNEL), "audio")
    if dims.SAMPLE_RATE not in vibration.attrs:
        raise InputError(f"audio: expected the attribute '{dims.SAMPLE_RATE}', found none")
    return vibration.astype(np.float32, copy=False).rename(dims.RA2)


CHANNELS: dict[str, Channel] = {
    channel.name: channel
    for channel in (
        Sa1(), Ra1(), Ra2(), Sa1Vector(), Ra1Vector(), Shear(), Sa1Local(),
    )
}  # fmt: skip
"""The paper's three, then ours."""


def find_channel(wanted: str | Channel | type[Channel]) -> Channel:
    """Return the channel of that name (or ``module:NAME`` of your own), or the channel itself.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if isinstance(wanted, str) and ":" in wanted:
        wanted = plugins.imported(wanted)
    if isinstance(wanted, type) and issubclass(wanted, Channel):
        return wanted()
    if isinstance(wanted, Channel):
        return wanted
    if wanted not in CHANNELS:
        raise InputError(
            f"channel: expected a Channel, or one of {', '.join(CHANNELS)}, found {wanted!r}"
        )
    return CHANNELS[wanted]


def name_of_channel(channel: Channel) -> str:
    """Return the name by which `find_channel` finds a channel: its own, or ``module:NAME``.

    Raises
    ------
    InputError
        If it is not the package's and can't be imported, or needs to be told something.
    """
    if CHANNELS.get(channel.name) == channel:
        return channel.name
    try:
        is_made_so = type(channel)() == channel
    except TypeError:
        is_made_so = False
    if not is_made_so:
        expected = "one that can be made again without arguments"
        raise InputError(
            f"channel: expected {expected}, found {channel!r}; write a class that holds them"
        )
    return plugins.reference_of(type(channel), "channel")
