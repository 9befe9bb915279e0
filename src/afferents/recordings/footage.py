"""A video that is measured as it is decoded."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from afferents.quality.frames import FrameFigures, Stalls
from afferents.quality.issues import QualityIssue
from afferents.store.recording import Frame, Video


@dataclass
class Footage:
    """A video that is measured as it is decoded: wraps another, and may be tracked in its place.

    Implements `afferents.store.recording.Video`.

    Attributes
    ----------
    figures
        Of the frames decoded since the last start.
    """

    video: Video
    figures: FrameFigures = field(default_factory=FrameFigures)

    @property
    def path(self) -> Path:
        """The file."""
        return self.video.path

    @property
    def fps_hz(self) -> float:
        """Nominal frame rate, Hz."""
        return self.video.fps_hz

    @property
    def width(self) -> int:
        """Width, px."""
        return self.video.width

    @property
    def height(self) -> int:
        """Height, px."""
        return self.video.height

    @property
    def stalls(self) -> Stalls:
        """When the camera gave its picture again."""
        return self.figures.stalls

    def frames(self) -> Iterator[Frame]:
        """Decode from the start, and measure anew."""
        self.figures = FrameFigures()
        for frame in self.video.frames():
            self.figures.add(frame.time_s, frame.luma, frame.levels)
            yield frame

    def find_issues(self, steady_s: tuple[float, float] | None = None) -> list[QualityIssue]:
        """Find what is wrong with the pictures decoded, while the drum slides (s)."""
        return self.figures.find_issues(self.path, steady_s)
