"""Video files, decoded frame by frame, with the frame times that the container holds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Final, NamedTuple

import av
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.reformatter import ColorRange

from afferents.errors import InputError, reading
from afferents.progress import Progress
from afferents.quality.frames import FrameFigures
from afferents.quality.issues import QualityIssue
from afferents.recordings import media, pictures
from afferents.recordings.pictures import ImageFolder
from afferents.store.recording import Frame, Video

_BLACK, _WHITE = 16, 235
_EXPANDED: Final = np.clip(
    np.round((np.arange(256) - _BLACK) * 255 / (_WHITE - _BLACK)), 0, 255
).astype(np.uint8)
"""Grey level of each luma value of limited range (ITU-R BT.601: 16 black, 235 white)."""

_END_TOLERANCE_S = 0.5
"""How far a video may fall short where the container declares a duration, but no count."""

_AHEAD = 4
"""Frames decoded in a row: decoder and caller each find their code and data in the processor's
cache then, which is a tenth of the time of both."""
_END = "the end"
_COLOURS = 3


_BROADCAST = ("mpeg", "mpegts")
"""MPEG's program and transport streams, as FFmpeg calls them."""


class _Header(NamedTuple):
    """What the container declares; None where it declares no number of frames.

    `origin_s` is when its clock begins to count for us, s: streams for broadcast begin at any time.
    `duration_s` is number of frames / average rate where there is a count: of an avi that was cut
    off, FFmpeg shortens the duration to fit, but leaves the count. It is 0 where neither is known.
    """

    fps_hz: float
    width: int
    height: int
    n_frames: int | None
    start_s: float
    origin_s: float
    duration_s: float


@dataclass(frozen=True)
class VideoFile:
    """A video on disk; its header is read when first needed, its frames never kept.

    Implements `afferents.store.recording.Video`. Anything that FFmpeg reads will do: mp4 with
    H.264, avi with MJPEG or MPEG-4, colour or grey, 8 bit or more.

    Parameters
    ----------
    path
        The file.
    rate_hz
        True frame rate, where the container's is wrong: times then count from it, 0 at the first
        frame. None to take the container's own times.
    """

    path: Path
    rate_hz: float | None = None

    @cached_property
    def header(self) -> _Header:
        """What the container declares.

        Raises
        ------
        InputError
            If the file is missing or not a readable video.
        """
        with _opened(self.path) as container:
            stream = container.streams.video[0]
            rate = stream.average_rate or stream.guessed_rate
            if not rate or not stream.width or not stream.height:
                raise InputError(
                    f"{self.path}: expected a video with a frame rate and a size, found neither "
                    "in it"
                )
            start_s = float((stream.start_time or 0) * (stream.time_base or 0))
            origin_s = start_s if container.format.name in _BROADCAST else 0.0
            n, fps_hz = stream.frames or None, float(rate)
            duration_s = n / fps_hz if n else (container.duration or 0) / av.time_base
        return _Header(fps_hz, stream.width, stream.height, n, start_s, origin_s, duration_s)

    @cached_property
    def fps_hz(self) -> float:
        """Nominal (average) frame rate, Hz; the true times come with the frames."""
        return self.rate_hz or self.header.fps_hz

    @cached_property
    def usual_hz(self) -> float:
        """Rate at which most frames follow one another, Hz: above `fps_hz` where some were lost.

        Reads the whole file, and decodes nothing.
        """
        with _opened(self.path) as container:
            stream = container.streams.video[0]
            ticks = sorted(p.pts for p in container.demux(stream) if p.pts is not None)
            step = np.median(np.diff(ticks)) if len(ticks) > 1 else 0
            return float(1 / (step * (stream.time_base or 0))) if step else self.fps_hz

    @cached_property
    def width(self) -> int:
        """Width, px."""
        return self.header.width

    @cached_property
    def height(self) -> int:
        """Height, px."""
        return self.header.height

    @cached_property
    def n_frames(self) -> int:
        """Frames as declared; duration times rate where the container declares no count."""
        return self.header.n_frames or round(self.header.duration_s * self.header.fps_hz)

    @cached_property
    def duration_s(self) -> float:
        """Duration as declared, s; 0 where the container declares none."""
        return self.n_frames / self.rate_hz if self.rate_hz else self.header.duration_s

    def frames(self) -> Iterator[Frame]:
        """Decode from the start, in order of presentation, one frame at a time.

        A damaged JPEG (cut short on the cable, say) is left out, which the times show as a gap:
        each JPEG stands alone. In other codecs, what follows a damaged picture is built on it.

        Yields
        ------
        Frame
            The presentation time in the container (s, not number / rate; of a stream for
            broadcast, from its first frame on) and the grey image, `(height, width)` uint8, black
            0 and white 255.

        Raises
        ------
        InputError
            If the file is no video, cannot be decoded to its end, ends before the end that its
            container declares, does not begin with a key frame, or its pictures change size.
        """
        n, n_damaged, end_s, fault = 0, 0, 0.0, ""
        with _opened(self.path) as container:
            decoded = _decode(container)
            while not fault:
                ahead, fault = next(decoded)
                for frame in ahead:
                    if frame is None:
                        n_damaged += 1
                        continue
                    time_s, duration_s = self._times_s(frame, n)
                    if n == 0:
                        self._require_key_frame(frame, time_s, n_damaged)
                    if (frame.width, frame.height) != (self.width, self.height):
                        raise InputError(  # the camera came back set otherwise
                            f"{self.path}: expected pictures of {self.width}x{self.height} px to "
                            f"the end, found {frame.width}x{frame.height} px at {time_s:.2f} s; "
                            "cut the clip there, or record it again"
                        )
                    own_s = time_s - self.header.origin_s
                    shown_s = (n + n_damaged) / self.rate_hz if self.rate_hz else own_s
                    n, end_s = n + 1, time_s + duration_s
                    yield _make_frame(frame, shown_s)
        if fault != _END:
            raise self._stopped(n, end_s, f"decoding stops ({fault})")
        if self._ends_early(n, end_s):
            raise self._stopped(n, end_s, "the video ends")

    def _require_key_frame(self, frame: VideoFrame, time_s: float, n_damaged: int) -> None:
        """Refuse a clip that was cut where no picture stands alone: its rest frames are gone."""
        late_s = time_s - self.header.start_s
        if frame.key_frame and (n_damaged or late_s < 1.5 / self.header.fps_hz):
            return
        raise InputError(
            f"{self.path}: expected a first picture that can be decoded alone (a key frame), found "
            f"none before {max(late_s, 0):.2f} s; cut the clip at a key frame, or export it again"
        )

    def _times_s(self, frame: VideoFrame, n: int) -> tuple[float, float]:
        """Return the presentation time of frame n and how long it is shown, s."""
        ticks, base = frame.pts if frame.pts is not None else frame.dts, frame.time_base
        if ticks is None or base is None:
            raise InputError(
                f"{self.path}: expected a presentation time for every frame, found none for {n}"
            )
        # Each is rounded once; a product of fractions takes ten times as long.
        duration_s = 1 / self.header.fps_hz
        if frame.duration:
            duration_s = frame.duration * base.numerator / base.denominator
        return ticks * base.numerator / base.denominator, duration_s

    def _ends_early(self, n: int, end_s: float) -> bool:
        """Return whether frames are missing at the end.

        A count below the declared one is not enough: avi writes empty packets for dropped
        frames, and mp4 edit lists hide some. The time must fall short too.
        """
        if n == 0:
            return True
        if self.header.n_frames is None:
            return end_s < self.header.duration_s - _END_TOLERANCE_S
        declared_end_s = self.header.start_s + self.header.duration_s
        return n < self.header.n_frames and end_s < declared_end_s - 0.5 / self.header.fps_hz

    def _stopped(self, n: int, end_s: float, how: str) -> InputError:
        return InputError(
            f"{self.path}: expected {self.n_frames} frames ({self.header.duration_s:.2f} s) as the "
            f"container declares, found {how} at {end_s:.2f} s after {n} frames; copy or record "
            "the file again"
        )


def open_video(path: str | Path, fps_hz: float | None = None) -> VideoFile:
    """Open a video and read its header.

    Parameters
    ----------
    path
        Any file that FFmpeg reads.
    fps_hz
        True frame rate, where the container's is wrong; None for the container's.

    Returns
    -------
    VideoFile
        `frames()` decodes one after the other as they are read: `image` (height, width), grey
        levels 0 to 255, and `time_s`, s. `fps_hz`, `width` and `height` (px) are the header's.

    Raises
    ------
    InputError
        If the file is missing or not a readable video.
    """
    video = VideoFile(Path(path), fps_hz)
    _ = video.header
    return video


def open_clip(path: Path, fps_hz: float | None = None) -> VideoFile | ImageFolder:
    """Open a video, or numbered images (a folder or zip) as one, and read its header.

    Parameters
    ----------
    fps_hz
        True frame rate, which of images without a CSV of times nothing else says; None for what
        the container or the CSV says.

    Raises
    ------
    InputError
        If it is neither, or of images without a rate.
    """
    if not (path.is_dir() or path.suffix.lower() == pictures.ZIP):
        media.refuse_bag(path)
        return open_video(path, fps_hz)
    images = ImageFolder(path, fps_hz)
    _ = images.clock_s
    return images


def _decode(container: InputContainer) -> Iterator[tuple[list[VideoFrame | None], str]]:
    """Yield a few frames at a time, and why there are no more after them, or nothing.

    None stands for a JPEG that is damaged. FFmpeg marks none as corrupt; told to explode, it
    refuses all that are cut short, and some of those in which bits are wrong.
    """
    stream = container.streams.video[0]
    stream.thread_type = "NONE"  # threads cost half as much again; videos go side by side
    stands_alone = stream.codec_context.name == "mjpeg"
    if stands_alone:
        stream.codec_context.options = {"err_detect": "explode"}
    ahead: list[VideoFrame | None] = []
    try:
        for packet in container.demux(stream):
            try:
                decoded: Sequence[VideoFrame | None] = packet.decode()
            except av.InvalidDataError:
                if not stands_alone:
                    raise
                decoded = [None]
            for frame in decoded:
                if frame is not None and frame.is_corrupt:
                    yield ahead, "a damaged frame"
                    return
                ahead.append(frame)
                if len(ahead) == _AHEAD:
                    yield ahead, ""
                    ahead = []
    except av.FFmpegError as error:
        yield ahead, str(error.strerror)
        return
    yield ahead, _END


def _make_frame(frame: VideoFrame, time_s: float) -> Frame:
    """Return a decoded frame with its luma, grey levels, and what makes it in colour.

    Where the pixels hold 8-bit luma in a plane of its own that plane is taken as it is, with the
    grey levels of limited range where it is; they differ from OpenCV's BGR-to-grey by rounding,
    and by more only where a colour leaves the RGB cube. Everything else goes through FFmpeg.
    """
    layout, levels = frame.format, None
    if layout.is_rgb or not layout.is_planar or layout.components[0].bits != 8:
        luma = np.asarray(frame.reformat(format="gray").to_ndarray(), dtype=np.uint8)
    else:
        if frame.color_range != ColorRange.JPEG and not layout.name.startswith(("yuvj", "gray")):
            levels = _EXPANDED
        plane = frame.planes[0]  # the array keeps it alive; without a copy if it is not padded
        padded = np.frombuffer(plane, np.uint8)  # type: ignore[call-overload]  # a buffer in truth
        image = padded.reshape(plane.height, plane.line_size)[:, : plane.width]
        luma = np.ascontiguousarray(image)
    if len(layout.components) < _COLOURS:
        return Frame(time_s, luma, levels)
    return Frame(
        time_s, luma, levels, lambda: np.asarray(frame.to_ndarray(format="bgr24"), np.uint8)
    )


def _opened(path: Path) -> InputContainer:
    with reading(path, "a readable video", av.FFmpegError):
        # without "file:" FFmpeg takes what stands before a colon for a protocol
        container = av.open(f"file:{path}")
    if not container.streams.video:
        container.close()
        raise InputError(f"{path}: expected a file with a video stream, found none in it")
    if getattr(container.streams.video[0], "codec_context", None) is None:
        container.close()
        raise InputError(
            f"{path}: expected a video that FFmpeg has a decoder for, found none for it"
        )
    return container


class VideoWithProgress:
    """A video that moves a progress bar as it is decoded, and keeps its last frame.

    `most` frames of it are decoded, or all.
    """

    def __init__(
        self, video: VideoFile | ImageFolder, progress: Progress, most: int | None = None
    ) -> None:
        self._video, self._progress, self._most = video, progress, most
        self.path, self.fps_hz = video.path, video.fps_hz
        self.width, self.height = video.width, video.height
        self.last: Frame | None = None

    def frames(self) -> Iterator[Frame]:
        """Decode from the start."""
        frames = islice(self._video.frames(), self._most)
        n = self._video.n_frames if self._most is None else min(self._video.n_frames, self._most)
        for frame in self._progress.track(frames, "tracking", n):
            self.last = frame
            yield frame


class Footage:
    """A video that is measured as it is decoded: wraps another, and may be tracked in its place.

    Implements `afferents.store.recording.Video`.

    Attributes
    ----------
    figures
        Of the frames decoded since the last start.
    """

    def __init__(self, video: Video) -> None:
        """Decode nothing yet."""
        self.video, self.figures = video, FrameFigures()
        self.path, self.fps_hz = video.path, video.fps_hz
        self.width, self.height = video.width, video.height

    def frames(self) -> Iterator[Frame]:
        """Decode from the start, and measure anew."""
        self.figures = FrameFigures()
        for frame in self.video.frames():
            self.figures.add(frame.time_s, frame.luma, frame.levels)
            yield frame

    def find_issues(self, steady_s: tuple[float, float] | None = None) -> list[QualityIssue]:
        """Find what is wrong with the pictures decoded, while the drum slides (s)."""
        return [*self.figures.find_issues(self.path, steady_s), *_find_turn(self.path)]


def _find_turn(path: Path) -> list[QualityIssue]:
    """Find a container's wish that its pictures be shown turned, which is not followed."""
    if path.is_dir() or path.suffix.lower() in {pictures.ZIP, *media.IMAGES} or not path.exists():
        return []
    with _opened(path) as container:
        turn_deg = next((frame.rotation for frame in container.decode(video=0)), 0)
    if turn_deg == 0:
        return []
    found = f"a flag to show them turned by {turn_deg} degrees, which is not followed"
    cause = "x and y are those of the pictures as they are stored"
    return [QualityIssue("turned", path, "pictures without a flag", found, cause)]
