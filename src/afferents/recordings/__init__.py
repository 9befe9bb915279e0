"""Reading recordings: the published session layout and adapters for other data sets."""

from afferents.recordings.audio import WavFile
from afferents.recordings.fabricslide import TaxelFile, read_fabricslide
from afferents.recordings.facts import Facts, VibrationFacts, VideoFacts, facts, video_facts
from afferents.recordings.footage import Footage
from afferents.recordings.levels import clipped_share, doubt_loudness, require_finite
from afferents.recordings.session import (
    SessionFile,
    check_files,
    check_recording,
    read_session,
    require_own_files,
    session_file,
)
from afferents.recordings.video import VideoFile, VideoWithProgress, luma_of, open_video

__all__ = [
    "Facts",
    "Footage",
    "SessionFile",
    "TaxelFile",
    "VibrationFacts",
    "VideoFacts",
    "VideoFile",
    "VideoWithProgress",
    "WavFile",
    "check_files",
    "check_recording",
    "clipped_share",
    "doubt_loudness",
    "facts",
    "luma_of",
    "open_video",
    "read_fabricslide",
    "read_session",
    "require_finite",
    "require_own_files",
    "session_file",
    "video_facts",
]
