"""Public data sets on servers: which files they have, and how these come here."""

from afferents.recordings.remote.archives import ARCHIVES, Archive
from afferents.recordings.remote.landing import Listing, files_on, sizes_of
from afferents.recordings.remote.manifest import RemoteFile, read_manifest, written
from afferents.recordings.remote.packed import Unpacked, is_packed, members_of, unpack
from afferents.recordings.remote.resuming import download, n_bytes_here
from afferents.recordings.remote.web import web

__all__ = [
    "ARCHIVES",
    "Archive",
    "Listing",
    "RemoteFile",
    "Unpacked",
    "download",
    "files_on",
    "is_packed",
    "members_of",
    "n_bytes_here",
    "read_manifest",
    "sizes_of",
    "unpack",
    "web",
    "written",
]
