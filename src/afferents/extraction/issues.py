"""What is wrong with a recording's pictures, markers and sound, found while it is extracted."""

from dataclasses import replace

import xarray as xr

from afferents import dims
from afferents.markers.quality import find_track_issues
from afferents.quality import issues, repeats, sound
from afferents.recordings.audio import WavFile
from afferents.recordings.video import Footage
from afferents.store.recording import Recording
from afferents.store.responses import Responses


def watched(recording: Recording) -> Recording:
    """Return the recording with its video measured as it is decoded, for `find_issues`."""
    video = recording.video
    return recording if video is None else replace(recording, video=Footage(video))


def find_issues(recording: Recording, responses: Responses | None) -> list[issues.QualityIssue]:
    """Find what is wrong with a recording's pictures, markers and sound.

    Parameters
    ----------
    recording
        As `watched` returned it, its video decoded since then.
    responses
        What was extracted of it; None where no markers are followed.
    """
    video, audio, steady_s = recording.video, recording.audio, recording.steady_s
    found: list[issues.QualityIssue] = []
    if isinstance(video, Footage):
        is_tracked = responses is not None and dims.DETECTED in responses
        found += find_video_issues(video, responses if is_tracked else None, steady_s)
    if isinstance(audio, WavFile) and (responses is None or dims.RA2 in responses):
        samples = audio.read().values if responses is None else responses[dims.RA2].values
        found += sound.find_sound_issues(samples, audio.path, audio.sample_rate_hz, steady_s)
    return found


def find_video_issues(
    footage: Footage, tracks: xr.Dataset | None, steady_s: tuple[float, float] | None = None
) -> list[issues.QualityIssue]:
    """Find what is wrong with pictures that were decoded, and with the markers in them, if any.

    Parameters
    ----------
    tracks
        What `track` returns, of the same pictures; None where no markers are followed.
    steady_s
        Start and end of constant speed, s; None where nothing says so.
    """
    found, where = footage.find_issues(steady_s), footage.path
    if tracks is None:
        return found + repeats.find_time_issues(footage.figures.time_s, where)
    seen = {issue.kind for issue in found}  # in the dark the markers are hidden as well
    if seen & {"frozen", "repeated", "stalled"}:
        seen.add("doubled")
    of_tracks = find_track_issues(tracks, where, steady_s)
    return found + [issue for issue in of_tracks if issue.kind not in seen]
