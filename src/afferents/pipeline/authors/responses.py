"""Rest positions, SA-I and RA-I of recordings, ours and the authors'."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.responses import Responses
from afferents.pipeline.authors.difference import Difference
from afferents.pipeline.authors.folder import AuthorsFolder, Floats


class ResponseDifferences:
    """Differences over recordings.

    Attributes
    ----------
    tracks, sa1, ra1
        Of rest positions, SA-I and RA-I. (The authors' files hold no other positions: SA-I is how
        far each track has come from its beginning.)
    otherwise
        Sentences on recordings whose markers stand in another order, or that are of another length.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.tracks = Difference("tracks: rest positions", dims.PIXELS)
        self.sa1 = Difference("SA-I", dims.PIXELS)
        self.ra1 = Difference("RA-I", "px/frame")
        self.otherwise: list[str] = []

    def add(self, recording: Responses, folder: AuthorsFolder) -> None:
        """Compare a recording, if the authors' responses to it are there.

        Raises
        ------
        InputError
            If it has another number of markers.
        """
        name = str(recording.attrs["name"])
        theirs = folder.responses(name) if dims.POSITION in recording else None
        if theirs is None:
            return
        rest = recording[dims.REST_POSITION].values
        if len(rest) != len(theirs["rest_position"]):
            found = f"{len(theirs['rest_position'])} of the authors"
            raise InputError(name, f"{len(rest)} markers, as here", found)
        order = same_markers(rest, theirs["rest_position"])
        self.tracks.add(rest[order], theirs["rest_position"], name)
        first = int(recording.attrs.get("rest_frame", 0))
        sa1, ra1 = (recording[c].values[first:][:, order] for c in (dims.SA1, dims.RA1))
        n = min(len(sa1), len(theirs["sa1"]))
        self.sa1.add(sa1[:n], theirs["sa1"][:n], name)
        self.ra1.add(ra1[1:n], theirs["ra1"][1:n], name)  # theirs begins with SA-I itself
        self._note(name, order, len(sa1), len(theirs["sa1"]))

    def _note(self, name: str, order: NDArray[np.intp], ours: int, theirs: int) -> None:
        if moved := int((order != np.arange(len(order))).sum()):
            self.otherwise.append(f"{name}: {moved} markers stand in another order.")
        if ours != theirs:
            self.otherwise.append(
                f"{name}: {ours} frames from the rest frame on, the authors have {theirs}."
            )


def same_markers(ours: Floats, theirs: Floats) -> NDArray[np.intp]:
    """Return which of our markers each of theirs is, by the places at rest, (marker,)."""
    _, order = linear_sum_assignment(cdist(theirs, ours))
    return np.asarray(order)
