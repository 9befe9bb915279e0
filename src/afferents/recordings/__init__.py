"""Reading recordings: the published session layout and other data sets."""

from afferents.recordings.audio import WavFile
from afferents.recordings.check import check_files, check_recording, require_own_files
from afferents.recordings.data_set import DataSet
from afferents.recordings.data_set_file import DataSetFile, read_data_set_file
from afferents.recordings.described import PACKAGED, Described, is_described
from afferents.recordings.facts import Facts, VibrationFacts, VideoFacts, facts, video_facts
from afferents.recordings.footage import Footage
from afferents.recordings.levels import clipped_share, doubt_loudness, require_finite
from afferents.recordings.series import SeriesFile
from afferents.recordings.session import PublishedSession, read_session
from afferents.recordings.session_file import SessionFile, session_file
from afferents.recordings.stored import Stored
from afferents.recordings.table import DATA_SETS, data_set_of, source_of
from afferents.recordings.video import VideoFile, VideoWithProgress, luma_of, open_video

__all__ = [
    "DATA_SETS",
    "PACKAGED",
    "DataSet",
    "DataSetFile",
    "Described",
    "Facts",
    "Footage",
    "PublishedSession",
    "SeriesFile",
    "SessionFile",
    "Stored",
    "VibrationFacts",
    "VideoFacts",
    "VideoFile",
    "VideoWithProgress",
    "WavFile",
    "check_files",
    "check_recording",
    "clipped_share",
    "data_set_of",
    "doubt_loudness",
    "facts",
    "is_described",
    "luma_of",
    "open_video",
    "read_data_set_file",
    "read_session",
    "require_finite",
    "require_own_files",
    "session_file",
    "source_of",
    "video_facts",
]
