"""Looking before anything is learnt: senses made for what the sources give."""

from collections.abc import Sequence

from afferents.core.errors import InputError
from afferents.encodings import SpectralEncoding
from afferents.live.audio_sense import AudioSense
from afferents.live.events import Channel, Source
from afferents.live.found_images import FoundImages
from afferents.live.images import FrameByFrame
from afferents.live.screen import Screen
from afferents.live.senses import Senses, check_offset
from afferents.live.terminal_pictures import Pictures
from afferents.live.video_sense import VideoSense


class Looker(Senses):
    """Shows markers, SA-I, RA-I, the spectrum and how good they are, without a model.

    Parameters
    ----------
    sources
        Which are looked at, one of each channel at most.
    images
        Which follow the markers that the camera sees: `Images` of a sensor, or `FoundImages`
        (the default), which finds markers at rest as `calibrate` does.
    audio_offset_s
        The microphone's clock is ahead of the camera's by this much, s.

    Raises
    ------
    InputError
        If there is no source.
    """

    def __init__(
        self,
        sources: Sequence[Source],
        images: FrameByFrame | None = None,
        audio_offset_s: float = 0.0,
    ) -> None:
        """Prepare for the first frame and the first sample."""
        check_offset(audio_offset_s)
        rates: dict[Channel, float] = {source.channel: source.rate_hz for source in sources}
        if not rates:
            raise InputError(
                "--video", "a source to look at, such as camera:0, a video file or rig", "none",
                "give --video, --audio or both",
            )  # fmt: skip
        video = audio = None
        if "video" in rates:
            video = VideoSense(images or FoundImages(), rates["video"])
        if "audio" in rates:
            audio = AudioSense(SpectralEncoding(), rates["audio"], offset_s=audio_offset_s)
        super().__init__(video, audio)

    def screen(self) -> Screen:
        """Return what draws percepts in a terminal: pictures of what comes in."""
        return Pictures(self.video, self.audio)
