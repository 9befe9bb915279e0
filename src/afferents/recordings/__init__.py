"""Reading recordings: the published session layout and other data sets."""

from afferents.recordings.audio import WavFile
from afferents.recordings.check import (
    RATE_TOLERANCE,
    check_files,
    check_recording,
    require_own_files,
)
from afferents.recordings.data_set import DataSet
from afferents.recordings.data_set_file import DataSetFile, read_data_set_file
from afferents.recordings.described import DATA_SET_FILE, PACKAGED, Described, is_described
from afferents.recordings.facts import Facts, VibrationFacts, VideoFacts, facts, video_facts
from afferents.recordings.footage import Footage
from afferents.recordings.grid import require_rates_that_agree
from afferents.recordings.guess import Guess, guess_pattern, guess_recordings
from afferents.recordings.guess_tables import guess_data_set, tables_in
from afferents.recordings.images import ImageFolder
from afferents.recordings.levels import clipped_share, doubt_loudness, require_finite
from afferents.recordings.listed import sensor_named
from afferents.recordings.media import is_sound, media_in, named
from afferents.recordings.published import NOT_TEXTURES, published
from afferents.recordings.series import SeriesFile
from afferents.recordings.session import PublishedSession, Session, read_session
from afferents.recordings.session_file import (
    SESSION_FILE,
    SESSION_TOML,
    SessionFile,
    rate_in,
    session_file,
)
from afferents.recordings.stored import Stored
from afferents.recordings.table import DATA_SETS, data_set_of, source_of
from afferents.recordings.video import VideoFile, VideoWithProgress, luma_of, open_video

__all__ = [
    "DATA_SETS",
    "DATA_SET_FILE",
    "NOT_TEXTURES",
    "PACKAGED",
    "RATE_TOLERANCE",
    "SESSION_FILE",
    "SESSION_TOML",
    "DataSet",
    "DataSetFile",
    "Described",
    "Facts",
    "Footage",
    "Guess",
    "ImageFolder",
    "PublishedSession",
    "SeriesFile",
    "Session",
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
    "guess_data_set",
    "guess_pattern",
    "guess_recordings",
    "is_described",
    "is_sound",
    "luma_of",
    "media_in",
    "named",
    "open_video",
    "published",
    "rate_in",
    "read_data_set_file",
    "read_session",
    "require_finite",
    "require_own_files",
    "require_rates_that_agree",
    "sensor_named",
    "session_file",
    "source_of",
    "tables_in",
    "video_facts",
]
