"""A video that is measured as it is decoded."""

from collections.abc import Iterator

from afferents.quality.frames import FrameFigures
from afferents.quality.issues import QualityIssue
from afferents.store.recording import Frame, Video


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
        return self.figures.find_issues(self.path, steady_s)
