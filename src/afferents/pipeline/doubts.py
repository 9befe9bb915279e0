"""What is wrong with a recording whose files decode well: found as it is extracted or inspected."""

from dataclasses import replace

from afferents.core import dims
from afferents.core.doubt import Doubt
from afferents.core.recording import Recording
from afferents.core.responses import Responses
from afferents.markers import doubt_markers
from afferents.recordings import Footage, WavFile, doubt_loudness


def watched(recording: Recording) -> Recording:
    """Return the recording with its video measured as it is decoded, for `doubts_of`."""
    video = recording.video
    return recording if video is None else replace(recording, video=Footage(video))


def doubts_of(recording: Recording, responses: Responses) -> list[Doubt]:
    """Return what is wrong with a recording's pictures, markers and sound.

    Parameters
    ----------
    recording
        As `watched` returned it, its video decoded since then.
    responses
        What was extracted of it.
    """
    video, audio, steady_s = recording.video, recording.audio, recording.steady_s
    found: list[Doubt] = []
    if isinstance(video, Footage):
        found += video.doubts(steady_s)
        if dims.DETECTED in responses and not any(doubt.kind == "dark" for doubt in found):
            found += doubt_markers(responses, video.path, steady_s)
    if isinstance(audio, WavFile) and dims.RA2 in responses:
        found += doubt_loudness(responses[dims.RA2].values, audio.path, audio.sample_rate_hz)
    return found


def doubts_without_tracking(recording: Recording) -> list[Doubt]:
    """Decode a recording, and return what is wrong with its pictures and sound.

    Raises
    ------
    InputError
        If a file is not what it should be.
    """
    audio, found = recording.audio, []
    if recording.video is not None:
        footage = Footage(recording.video)
        for _ in footage.frames():
            pass
        found += footage.doubts(recording.steady_s)
    if audio is not None:
        sound = audio.read().values
        if isinstance(audio, WavFile):
            found += doubt_loudness(sound, audio.path, audio.sample_rate_hz)
    return found
