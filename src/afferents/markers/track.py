"""Following every marker through a video: from its frames to tracks with names and units."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.choices import Method
from afferents.errors import AfferentsError, InputError
from afferents.markers import detect, rest
from afferents.markers.cells import Cells
from afferents.markers.detect import Positions
from afferents.markers.grid import Grid
from afferents.markers.sensor import Sensor
from afferents.markers.windowed import Audit, Renamed, Tracked, WindowedTracker, nearest_markers
from afferents.quality.frames import mean_motion, sample_pixels
from afferents.quality.image import measure_image_quality
from afferents.store.recording import Frame, GreyImage, Video, make_grey

KNOCK_PX = 5.0
"""A common step beyond this within a frame is noted: something was knocked, or let go."""


def label_tracks(
    time_s: list[float], tracked: Sequence[Tracked], rest_position: Positions, grid: Grid | None
) -> xr.Dataset:
    """Return the arrays with names and units, and with the untracked frames at the start.

    Parameters
    ----------
    time_s
        Of every frame of the video, s.
    tracked
        The markers in its last frames, from the rest frame on.
    rest_position
        Where displacement counts from, shape (n, 2), px.
    grid
        Places of the markers; None for layouts without.
    """
    shape = (len(time_s), len(rest_position))
    position, detected = np.full((*shape, 2), np.nan), np.zeros(shape, dtype=bool)
    for index, frame in enumerate(tracked, start=len(time_s) - len(tracked)):
        position[index], detected[index] = frame.position, frame.detected
    px = {dims.UNITS: dims.PIXELS}
    tracks = xr.Dataset(
        {
            dims.POSITION: ((dims.TIME, dims.MARKER, dims.SPACE), position, px),
            dims.DETECTED: ((dims.TIME, dims.MARKER), detected),
            dims.REST_POSITION: ((dims.MARKER, dims.SPACE), rest_position, px),
        },
        coords={
            dims.TIME: (dims.TIME, np.asarray(time_s), {dims.UNITS: dims.SECONDS}),
            dims.SPACE: (dims.SPACE, ["x", "y"]),
        },
    )
    if tracked[0].grey is not None:
        grey = np.full(shape, np.nan)
        grey[len(time_s) - len(tracked) :] = [frame.grey for frame in tracked]
        unit = {dims.UNITS: dims.GREY_LEVELS, "long_name": "SA-I, mean change of a cell from rest"}
        tracks[dims.SA1] = ((dims.TIME, dims.MARKER), grey, unit)
    if grid is None:
        return tracks
    places = {dims.ROW: (dims.MARKER, grid.row), dims.COLUMN: (dims.MARKER, grid.column)}
    roll = {"roll_deg": grid.roll_deg} if np.isfinite(grid.roll_deg) else {}
    return tracks.assign_coords(places).assign_attrs(roll)


class Tracker:
    """Follows the markers from frame to frame.

    Parameters
    ----------
    sensor
        Gives the detector and the gate.
    rest_position
        Markers of the rest frame in the order to keep, shape (n, 2), px; None to find them in
        the first frame that `step` gets, in the layout's order.
    rest_image
        The rest frame, which ``windowed`` measures the markers in; without it, the first frame
        that `step` gets must show them near their rest positions.
    levels
        Grey level of each value in the images; None where they are grey levels themselves.
        Spares ``windowed`` the conversion of frames as they are decoded.
    present
        Which markers the rest frame shows, shape (n,); None for all.
    method
        ``windowed``: centroids in windows round the expected places, see `WindowedTracker`.
        ``one-to-one``: all blobs of every frame; a blob belongs to one marker at most. With both
        a lost marker is NaN and not detected; it is looked for where its neighbours'
        displacement from rest says it is, so it comes back under its own name.
        ``published``: every marker takes the nearest blob; without one within the gate it
        keeps its old position, in the rest frame that of the reference, and `detected` (which the
        published code does not know) is False. Two markers may run together for good.

    Attributes
    ----------
    jump_px
        How far all markers jumped together in the last step, px; 0 but for ``windowed``.
    renamed
        Markers that the last step found slipped, and put right; None but for ``windowed``.
    audit
        How often identities were in danger; all zero but for ``windowed``.
    """

    def __init__(
        self,
        sensor: Sensor,
        rest_position: Positions | None = None,
        method: Method = "windowed",
        rest_image: GreyImage | None = None,
        levels: GreyImage | None = None,
        present: NDArray[np.bool_] | None = None,
    ) -> None:
        """Start from the rest positions; the first `step` is the frame after the rest frame."""
        self.sensor, self.method = sensor, method
        self._levels, self._present, self._times = levels, present, sensor.times
        self.grid: Grid | None = None
        self.jump_px, self.audit = 0.0, Audit()
        self.renamed: Renamed | None = None
        self._windowed: WindowedTracker | None = None
        self._expected: Positions | None = None
        if rest_position is not None:
            self._begin(rest_position, rest_image)

    def step(self, image: GreyImage) -> Tracked:
        """Find the markers in the next frame.

        Parameters
        ----------
        image
            Grey image (or what `levels` says), shape (height, width), uint8.

        Raises
        ------
        InputError
            If this is the first frame, no rest positions were given, and it does not show the
            markers that the sensor file declares; if the image is not grey.
        """
        if image.ndim != 2:
            found = f"one of shape {image.shape}"
            raise InputError(f"image: expected a grey one, (height, width), found {found}")
        if self._expected is None:
            return self._find(image)
        if self.method == "windowed":
            windowed = self._windowed or self._start(image)
            seen = windowed.step(image if self._times == 1 else detect.enlarged(image, self._times))
            self.jump_px, self.renamed = windowed.jump_px / self._times, windowed.renamed
            if self._times == 1:
                return seen
            return Tracked(detect.scaled(seen.position, 1 / self._times), seen.detected)
        blobs = detect.detect(make_grey(image, self._levels), self.sensor)
        link = detect.link_nearest if self.method == "published" else detect.link_one_to_one
        blob = link(self._expected, blobs, self.sensor.gate_px)
        detected = blob != detect.NO_BLOB
        position = np.full_like(self._expected, np.nan)
        position[detected] = blobs[blob[detected]]
        if self.method == "published":
            position = np.where(detected[:, None], position, self._expected)
            self._expected = position
        else:
            self._expected = self._expect(position, self._expected)
        return Tracked(position, detected)

    def _find(self, image: GreyImage) -> Tracked:
        """Find the markers of the first frame, which is assumed to show the skin at rest."""
        where, grey = "the first frame", make_grey(image, self._levels)
        first = self.sensor.model_copy(update={"rest_frame": 0})
        found = rest.find_rest_markers([grey], first, where, self.method)
        ordered = rest.order_markers(found, first, self.method, None, where)
        self._present, self.grid = ordered.present, ordered.grid
        self._begin(ordered.position, image)
        return self.at_rest(ordered.present)

    def at_rest(self, present: NDArray[np.bool_]) -> Tracked:
        """Return the rest frame's markers, of which those `present`, shape (n,), were found."""
        held = present if self.method != "published" else np.ones_like(present)
        return Tracked(np.where(held[:, None], self.rest_position, np.nan), present)

    def _begin(self, rest_position: Positions, rest_image: GreyImage | None) -> None:
        """Take the rest positions over."""
        self.rest_position = rest_position
        if rest_image is not None and self.method == "windowed":
            self._start(rest_image)
        self._expected = rest_position.copy()
        self._neighbours = nearest_markers(rest_position)[1]

    def _start(self, image: GreyImage) -> WindowedTracker:
        """Measure the markers in the rest frame, or in the first one for want of it."""
        sensor = self.sensor if self._times == 1 else self.sensor.enlarged()
        position = detect.scaled(self.rest_position, self._times)
        image = detect.enlarged(image, self._times)
        self._windowed = WindowedTracker(sensor, position, image, self._levels, self._present)
        self.rest_position = detect.scaled(self._windowed.rest_position, 1 / self._times)
        self.audit = self._windowed.audit
        return self._windowed

    def _expect(self, position: Positions, before: Positions) -> Positions:
        """Say where each marker is now: as seen, or as its neighbours' displacement says.

        Parameters
        ----------
        before
            Where they were expected in this frame.
        """
        expected = position.copy()
        for lost in np.flatnonzero(np.isnan(position[:, 0])):
            around = self._neighbours[lost]
            moved = (position - self.rest_position)[around[~np.isnan(position[around, 0])]]
            carried = self.rest_position[lost] + np.median(moved, axis=0) if len(moved) else None
            expected[lost] = before[lost] if carried is None else carried
        return expected


def rest_positions(video: Video, sensor: Sensor) -> Positions:
    """Return a reference video's rest markers in the published order, shape (n, 2), px.

    Raises
    ------
    InputError
        As `track` does.
    """
    rest.check_size(video.path, (video.width, video.height), sensor)
    images = rest.rest_images(video, sensor.rest_frame)
    return rest.find_rest_markers(images, sensor, video.path).position


def ordered_rest(video: Video, sensor: Sensor) -> Positions:
    """Return a clip's rest markers in the order and by the measure of ``windowed``, (n, 2), px.

    Raises
    ------
    InputError
        As `track` does.
    """
    rest.check_size(video.path, (video.width, video.height), sensor)
    frames = [Frame(0.0, image) for image in rest.rest_images(video, sensor.rest_frame)]
    n_stale = rest.count_stale([frame.image for frame in frames], sensor)
    return start_at_rest(frames[n_stale:], video.path, sensor).tracker.rest_position


def track_markers(
    video: Video,
    sensor: Sensor,
    method: Method = "windowed",
    reference: Positions | None = None,
    keep_partial: bool = False,
    count_from: Positions | None = None,
) -> xr.Dataset:
    """Follow the markers of a video.

    Parameters
    ----------
    video
        Decoded once, frame by frame.
    sensor
        Sensor file.
    method
        ``windowed``, ``one-to-one`` or ``published``; see `Tracker`.
    reference
        Rest markers of the reference video (`rest_positions`), shape (n, 2), px, which fix the
        order of the markers; see `order_markers`. Not needed for square layouts, whose grid
        fixes it, and used for them by ``published`` only, which then takes rest frames with some
        markers too many or too few.
    count_from
        Rest positions that displacement is to count from, of a clip of the same mounting
        (`ordered_rest`), shape (n, 2), px; None for the run's own rest frame.
    keep_partial
        Keep what was tracked when decoding stops before the end (a file cut off); the
        attribute `stopped` then says where and why, and is empty otherwise.

    Returns
    -------
    xr.Dataset
        `position` (time, marker, space) in px, `detected` (time, marker) and `rest_position`
        (marker, space) in px; `time` is the frames' own time in s. Layouts that the sensor file
        describes carry `row` and `column` on `marker`, their places in a tactile image; square
        ones also have their roll in the attribute `roll_deg`. Every frame of the
        video has its place: those before the rest frame are NaN and not detected.
        Of cells, `sa1` (time, marker) in grey levels besides; what holds here of markers holds
        of them. `frame_change` (time) and the attributes of `ImageQuality` and `Audit` serve
        `measure_quality`, those of `rest_seen` `rest_sentences`.

    Raises
    ------
    InputError
        If the video is of another size than the sensor file says, ends before the rest frame,
        does not show the markers that the sensor file declares, or its times go back.
    """
    rest.check_size(video.path, (video.width, video.height), sensor)
    if sensor.layout == dims.CELLS and (method != "windowed" or count_from is not None):
        option = "--rest reference" if count_from is not None else f"--tracker {method}"
        found = f"'{sensor.name}' of cells"
        raise InputError(f"{option}: expected a sensor with markers, found {found}; leave it out")
    passed = _Passed()
    coming = passed.frames_of(video)
    at_rest = list(islice(coming, sensor.rest_frame + rest.N_FIRST))[sensor.rest_frame :]
    if passed.stopped and not (at_rest and keep_partial):
        raise AfferentsError(passed.stopped)
    if not at_rest:
        raise rest.too_short(video, sensor.rest_frame, len(passed.time_s))
    images = [frame.image for frame in at_rest]
    n_stale = 0 if method == "published" else rest.count_stale(images, sensor)
    at_rest = at_rest[n_stale:]
    tracker, first, grid, seen = start_at_rest(at_rest, video.path, sensor, method, reference)
    own = tracker.rest_position
    if count_from is not None and count_from.shape != own.shape:
        expected = f"{len(count_from)} markers, as the reference clip shows"
        raise InputError(f"{video.path}: expected {expected}, found {len(own)}")
    tracked, jumps_s = _follow(tracker, first, chain(at_rest[1:], coming))
    if passed.stopped and not keep_partial:
        raise AfferentsError(passed.stopped)
    back = np.flatnonzero(~(np.diff(passed.time_s) > 0))  # as in some H.264 in avi
    if len(back):
        before, after = passed.time_s[back[0]], passed.time_s[back[0] + 1]
        raise InputError(
            f"{video.path}: expected frame times of which each is after the one before, found "
            f"{after:.3f} s after {before:.3f} s; give --fps with the true rate, or write its "
            "fps_hz into session.toml: times then count from it"
        )
    tracks = label_tracks(passed.time_s, tracked, own if count_from is None else count_from, grid)
    tracks[dims.FRAME_CHANGE] = (dims.TIME, np.array(passed.change))
    return tracks.assign_attrs(
        sensor=sensor.name,
        method=dims.CELLS if sensor.layout == dims.CELLS else method,
        rest_frame=sensor.rest_frame + n_stale,
        stopped=passed.stopped,
        jumps_s=jumps_s,
        **seen,
        **({rest.STALE: n_stale} if n_stale else {}),
        **({rest.BITS: bits} if (bits := at_rest[0].bits) > 8 else {}),
        **{f"audit_{name}": count for name, count in vars(tracker.audit).items()},
    )


@dataclass
class _Passed:
    """What is noted of frames as they pass: times, s, change since the one before, and the end.

    Attributes
    ----------
    stopped
        Why decoding stopped before the end; empty if it did not.
    """

    time_s: list[float] = field(default_factory=list)
    change: list[float] = field(default_factory=list)
    stopped: str = ""

    def frames_of(self, video: Video) -> Iterator[Frame]:
        """Yield the frames of a video; where decoding stops before the end, end as well."""
        sample: GreyImage | None = None
        try:
            for frame in video.frames():
                self.time_s.append(frame.time_s)
                before, sample = sample, sample_pixels(frame.luma)
                self.change.append(mean_motion(sample, before))
                yield frame
        except AfferentsError as error:
            self.stopped = str(error)


class Begun(NamedTuple):
    """What the frames at rest show.

    Attributes
    ----------
    tracker
        Begins in the first of them.
    first
        The markers in that.
    grid
        Their places in a tactile image; None for layouts without.
    seen
        What to report of light, focus and the rest frame, as attributes.
    """

    tracker: Tracker | Cells
    first: Tracked
    grid: Grid | None
    seen: dict[str, Any]


def start_at_rest(
    frames: Sequence[Frame],
    where: object,
    sensor: Sensor,
    method: Method = "windowed",
    reference: Positions | None = None,
) -> Begun:
    """Find the markers in the frames at rest, `N_FIRST` or fewer, or lay cells over them."""
    if sensor.layout == dims.CELLS:
        cells = Cells(frames, sensor, where)
        return Begun(cells, cells.first, cells.grid, {})
    images = [frame.image for frame in frames]
    found = rest.find_rest_markers(images, sensor, where, method, led=reference is not None)
    ordered = rest.order_markers(found, sensor, method, reference, where)
    still = rest.median_picture([frame.luma for frame in frames[: found.n_still]])
    tracker = Tracker(sensor, ordered.position, method, still, frames[0].levels, ordered.present)
    shown = ordered.position[ordered.present] if ordered.present.any() else found.position
    picture = measure_image_quality(
        detect.without_shine(images[0], sensor.looks), shown, detect.spacing_px(shown)
    )
    seen = rest.rest_seen(found, ordered) | vars(picture)
    return Begun(tracker, tracker.at_rest(ordered.present), ordered.grid, seen)


def _follow(
    tracker: Tracker | Cells, at_rest: Tracked, frames: Iterable[Frame]
) -> tuple[list[Tracked], list[float]]:
    """Return the markers in the rest frame and those after it, and when all of them jumped, s."""
    tracked, jumps_s = [at_rest], []
    for frame in frames:
        tracked.append(tracker.step(frame.luma))
        if (renamed := tracker.renamed) is not None:
            renamed.lose(tracked)
        if tracker.jump_px > KNOCK_PX:
            jumps_s.append(frame.time_s)
    return tracked, jumps_s
