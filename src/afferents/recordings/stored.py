"""What `extract` leaves, as a data set: a store of responses."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from afferents.core.errors import InputError
from afferents.core.groups import is_group
from afferents.core.recording import Session
from afferents.core.responses import Responses
from afferents.core.store import open_responses, store_config
from afferents.recordings.data_set import DataSet


class Stored(DataSet):
    """Responses that were extracted; what they were extracted from is not asked for again."""

    name, title = "store", "A store"

    @classmethod
    def is_at(cls, path: Path) -> bool:
        """Tell whether there is a Zarr store."""
        return is_group(path)

    def recordings(self) -> Session:
        """Refuse: a store holds none."""
        raise InputError(self.path, "recordings", "a store of their responses")

    def responses(self) -> list[Responses]:
        """Open all recordings of the store, lazily, in order of texture and speed."""
        return open_responses(self.path)

    def config(self) -> Mapping[str, Any]:
        """Return the configuration that the store was extracted with."""
        return store_config(self.path)
