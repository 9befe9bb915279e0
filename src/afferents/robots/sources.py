"""What is exported and shown: recordings of a session or of a store, their frames as JPEGs."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import av
import cv2

from afferents.errors import InputError
from afferents.files import Place
from afferents.recordings.data_sets import read_session
from afferents.recordings.session import match_recordings
from afferents.recordings.video import VideoFile
from afferents.store import integrity, zarr_store
from afferents.store.drum_path import DrumPath, logged_path, read_path
from afferents.store.recording import Recording, Video
from afferents.store.responses import Responses

QUALITY = 95
"""Of JPEGs, where the camera gave none."""


class Chosen(NamedTuple):
    """A recording as it was made, and what was extracted of it; None for what is not given."""

    recording: Recording | None
    responses: Responses | None

    def drum_path(self) -> DrumPath | None:
        """Return the drum's way, as the recording's drive logged it or as the store holds it."""
        if self.recording is not None:
            return logged_path(self.recording.source)
        return None if self.responses is None else read_path(self.responses)


def find_recordings(
    source: Place, store: Place | None, wanted: Sequence[str] = (), most: int | None = None
) -> dict[str, Chosen]:
    """Return recordings by name.

    Parameters
    ----------
    source
        A session or a store.
    store
        Of a session: the store that was extracted from it.
    wanted
        Names; none for the first `most`, or all.

    Raises
    ------
    InputError
        If there is no such session, store or recording, the store is another session's, or it is
        half of one and all of it is wanted.
    """
    session = None if integrity.is_group(Path(source)) else read_session(source)
    if session is None and store is not None:
        raise InputError(f"--store: expected a session with it, found the store {source}")
    recordings = {} if session is None else {one.name: one for one in session.recordings}
    extracted = source if session is None else store
    all_of_store = session is None and not wanted and most is None
    opened = zarr_store.open_whole if all_of_store else zarr_store.open_responses
    stored = () if extracted is None else opened(extracted)
    responses = {str(one.attrs["name"]): one for one in stored}
    names = list(recordings or responses)
    if unknown := [name for name in wanted if name not in names]:
        some = ", ".join(names[:5])
        raise InputError(f"recording: expected one of {source} ({some}, ...), found '{unknown[0]}'")
    chosen = [name for name in names if name in (wanted or names)][:most]
    if store is not None and (lacking := [name for name in chosen if name not in responses]):
        raise InputError(
            f"{store}: expected the recording '{lacking[0]}', found none; give the store that was "
            "extracted from the session"
        )
    if session is not None:
        match_recordings(session, (responses[name] for name in chosen if name in responses))
    return {name: Chosen(recordings.get(name), responses.get(name)) for name in chosen}


def jpegs(video: Video, quality: int) -> Iterator[tuple[float, bytes]]:
    """Yield a video's frames and when each was taken, s.

    JPEGs are those of the file, byte for byte; other frames are encoded, at `quality`.
    """
    if isinstance(video, VideoFile):
        with av.open(f"file:{video.path}") as container:
            stream = container.streams.video[0]
            if stream.codec_context.name == "mjpeg":
                n = 0
                for packet in container.demux(stream):
                    if packet.size and packet.pts is not None and packet.time_base is not None:
                        shown_s = float(packet.pts * packet.time_base)
                        yield n / video.rate_hz if video.rate_hz else shown_s, bytes(packet)
                        n += 1
                return
    for frame in video.frames():
        picture = frame.in_colour() if frame.in_colour else frame.image
        _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
        yield frame.time_s, data.tobytes()
