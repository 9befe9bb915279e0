"""A folder of the authors' arrays and networks, as scripts/convert_authors_arrays.py writes it.

=================================  ================================================================
``responses/TEXTURE/SPEED.npz``    `rest_position` (marker, 2), `sa1` and `ra1` (frame, marker)
``samples/MODEL/SPEED.npz``        a test set: `samples` (n, ...), `labels` (n,); `outputs` (n,
                                   texture) where Keras was asked
``networks/MODEL/SPEED.hdf5``      a trained network
=================================  ================================================================

Models have the names of Table 1 here (``sa-se``), and textures and speeds those of their folders.
Pickles are never opened: whoever opens one runs whatever is in it.
"""

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError

Floats = NDArray[np.float32]

CONVERT = "scripts/convert_authors_arrays.py"
_PARTS = ("responses", "samples", "networks")
_RESPONSES = {"rest_position": 2, "sa1": 2, "ra1": 2}
_SAMPLES = {"samples": 0, "labels": 1}
_AGAIN = f"convert the arrays again with {CONVERT}"


@dataclass(frozen=True)
class AuthorsFolder:
    """What is in such a folder; anything may be missing.

    Raises
    ------
    InputError
        If nothing that can be compared is in it.
    """

    path: Path

    def __post_init__(self) -> None:
        """Refuse a folder with nothing to compare."""
        if any((self.path / part).is_dir() for part in _PARTS):
            return
        pickled = next(self.path.rglob("*.pkl"), None) if self.path.is_dir() else None
        found = f"the pickle {pickled.name}, which is not opened here" if pickled else "none"
        do = f"convert the authors' files with {CONVERT}, in an environment of their own"
        raise InputError(self.path, f"some of the folders {', '.join(_PARTS)}", found, do)

    def responses(self, name: str) -> dict[str, Floats] | None:
        """Return rest positions, SA-I and RA-I of a recording; None where they are not there."""
        return _read(self.path / "responses" / f"{name}.npz", _RESPONSES)

    def samples(self, model: str, speed_mm_s: float) -> dict[str, Floats] | None:
        """Return the test set of a model at a held-out speed; None where it is not there."""
        return _read(self.path / "samples" / model / f"{speed_mm_s:g}.npz", _SAMPLES, "outputs")

    def network(self, model: str, speed_mm_s: float) -> Path | None:
        """Return the file of a trained network; None where it is not there."""
        path = self.path / "networks" / model / f"{speed_mm_s:g}.hdf5"
        return path if path.is_file() else None


def _read(path: Path, wanted: Mapping[str, int], *beside: str) -> dict[str, Floats] | None:
    """Return the arrays of a file by name, with as many dims as wanted; 0 for any."""
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as arrays:
            names = [*wanted, *(name for name in beside if name in arrays)]
            found = {name: np.asarray(arrays[name], dtype=np.float32) for name in names}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        expected = f"the arrays {', '.join(wanted)} as numbers"
        raise InputError(path, expected, str(error), _AGAIN) from error
    for name, n_dims in wanted.items():
        if n_dims and found[name].ndim != n_dims:
            expected = f"{name} of {n_dims} dims"
            raise InputError(path, expected, f"{found[name].ndim}", _AGAIN)
    return found
