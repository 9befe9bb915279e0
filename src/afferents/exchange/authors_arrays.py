"""The authors' own arrays: where they lie, and ours in the same order and form.

A folder of theirs, as scripts/convert_authors_arrays.py writes it, has

===============================  ==============================================================
``responses/TEXTURE/SPEED.npz``  `rest_position` (marker, 2), `sa1` and `ra1` (frame, marker)
``samples/MODEL/SPEED.npz``      a test set: `samples` (n, ...), `labels` (n,); `outputs`
                                 (n, texture) where Keras was asked
``networks/MODEL/SPEED.hdf5``    a trained network
===============================  ==============================================================

Models have the names of Table 1 here (``sa-se``), and textures and speeds those of their folders.
Anything may be missing. Pickles are never opened: whoever opens one runs whatever is in it.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from afferents import dims
from afferents.encodings.settings import Encodings
from afferents.errors import InputError, reading
from afferents.evaluation.encode import encode, has, sources_of
from afferents.models.model import Model
from afferents.store.responses import Responses, speed_of, speeds_of, textures_of

Floats = NDArray[np.float32]

CONVERT = "scripts/convert_authors_arrays.py"
_PARTS = ("responses", "samples", "networks")
_RESPONSES = {"rest_position": 2, "sa1": 2, "ra1": 2}
_SAMPLES = {"samples": 0, "labels": 1}
_AGAIN = f"convert the arrays again with {CONVERT}"


def require_arrays(folder: Path) -> Path:
    """Return a folder of the authors' arrays.

    Raises
    ------
    InputError
        If nothing that can be compared is in it.
    """
    if any((folder / part).is_dir() for part in _PARTS):
        return folder
    pickled = next(folder.rglob("*.pkl"), None) if folder.is_dir() else None
    found = f"the pickle {pickled.name}, which is not opened here" if pickled else "none"
    raise InputError(
        f"{folder}: expected some of the folders {', '.join(_PARTS)}, found {found}; convert the "
        f"authors' files with {CONVERT}, in an environment of their own"
    )


def network_file(folder: Path, model: str, speed_mm_s: float) -> Path | None:
    """Return the file of a trained network; None where it is not there."""
    path = folder / "networks" / model / f"{speed_mm_s:g}.hdf5"
    return path if path.is_file() else None


def _read(path: Path, wanted: Mapping[str, int], *beside: str) -> dict[str, Floats] | None:
    """Return the arrays of a file by name, with as many dims as wanted; 0 for any."""
    if not path.is_file():
        return None
    with (
        reading(path, f"the arrays {', '.join(wanted)} as numbers", do=_AGAIN),
        np.load(path, allow_pickle=False) as arrays,
    ):
        names = [*wanted, *(name for name in beside if name in arrays)]
        found = {name: np.asarray(arrays[name], dtype=np.float32) for name in names}
    for name, n_dims in wanted.items():
        if n_dims and found[name].ndim != n_dims:
            expected = f"{name} of {n_dims} dims"
            raise InputError(f"{path}: expected {expected}, found {found[name].ndim}; {_AGAIN}")
    return found


def compare_responses(
    recording: Responses, folder: Path, notes: list[str]
) -> Iterator[tuple[str, Floats, Floats]]:
    """Yield rest positions, SA-I and RA-I of a recording, ours and theirs, and their stage.

    Nothing if theirs are not there. (The authors' files hold no other positions: SA-I is how far
    each track has come from its beginning.)

    Parameters
    ----------
    notes
        A sentence is added where markers stand in another order, or the length is another.

    Raises
    ------
    InputError
        If there is another number of markers.
    """
    name = str(recording.attrs["name"])
    theirs = _read(folder / "responses" / f"{name}.npz", _RESPONSES)
    if theirs is None or dims.POSITION not in recording:
        return
    rest = recording[dims.REST_POSITION].values
    if len(rest) != len(theirs["rest_position"]):
        found = f"{len(theirs['rest_position'])} of the authors"
        raise InputError(f"{name}: expected {len(rest)} markers, as here, found {found}")
    order = same_markers(rest, theirs["rest_position"])
    first = int(recording.attrs.get("rest_frame", 0))
    sa1, ra1 = (recording[c].values[first:][:, order] for c in (dims.SA1, dims.RA1))
    n = min(len(sa1), len(theirs["sa1"]))
    yield "tracks: rest positions", rest[order], theirs["rest_position"]
    yield "SA-I", sa1[:n], theirs["sa1"][:n]
    yield "RA-I", ra1[1:n], theirs["ra1"][1:n]  # theirs begins with SA-I itself
    if moved := int((order != np.arange(len(order))).sum()):
        notes.append(f"{name}: {moved} markers stand in another order.")
    if len(sa1) != len(theirs["sa1"]):
        notes.append(
            f"{name}: {len(sa1)} frames from the rest frame on, the authors have "
            f"{len(theirs['sa1'])}."
        )


def same_markers(ours: Floats, theirs: Floats) -> NDArray[np.intp]:
    """Return which of our markers each of theirs is, by the places at rest, (marker,)."""
    _, order = linear_sum_assignment(cdist(theirs, ours))
    return np.asarray(order)


# The test sets of the paper's models, ours and the authors', in one order and one form.

SHAPES = {"spatial": (19, 19), "spatiotemporal": (10, 19, 19), "spectral": (1, 200)}
"""Of the samples of the paper's networks, by encoding."""


class TestSets:
    """Test sets by model and held-out speed.

    Theirs hold, of every texture, the odd images or runs of ten, or 60 windows of vibration drawn
    at random, the same of all textures; samples follow one another in time, textures in turn.

    Parameters
    ----------
    recordings
        Of a session in the published layout.
    folder
        Of the authors.
    """

    def __init__(self, recordings: Sequence[Responses], folder: Path) -> None:
        """Make them when they are asked for."""
        self._recordings, self.folder = recordings, folder
        self.textures, self.speeds = textures_of(recordings), speeds_of(recordings)

    def theirs(self, model: Model, speed_mm_s: float) -> Floats | None:
        """Return their samples as ours are, (time, texture, *sample_shape); None without any.

        Raises
        ------
        InputError
            If the samples of the textures are not in turn, or of another shape.
        """
        found = self._read(model, speed_mm_s)
        if found is None:
            return None
        where, n = f"samples/{model.name}/{speed_mm_s:g}.npz", len(self.textures)
        samples, labels = found["samples"], found["labels"]
        if len(labels) % n or not np.array_equal(labels, np.arange(len(labels)) % n):
            expected = f"samples of the {n} textures of the store in turn"
            raise InputError(
                f"{where}: expected {expected}, found {len(labels)} of {int(labels.max()) + 1} "
                "textures"
            )
        shape = SHAPES[model.encoding]
        if samples[0].size != int(np.prod(shape)):
            expected = f"samples of {' x '.join(map(str, shape))}"
            raise InputError(
                f"{where}: expected {expected}, found {' x '.join(map(str, samples.shape[1:]))}"
            )
        in_turn = samples.reshape(-1, n, *shape)
        (source,) = sources_of(model, Encodings())
        return in_turn if source.encoding.of_vibration else in_turn.swapaxes(-1, -2)

    def outputs(self, model: Model, speed_mm_s: float) -> Floats | None:
        """Return what Keras' network said of their samples, (time, texture, texture), if asked."""
        found = self._read(model, speed_mm_s)
        if found is None or "outputs" not in found:
            return None
        outputs, n = found["outputs"], len(self.textures)
        return outputs.reshape(-1, n, outputs.shape[-1])

    def ours(self, model: Model, speed_mm_s: float, theirs: Floats | None) -> Floats | None:
        """Return our samples, (time, texture, *sample_shape); None if a recording is missing.

        Of windows of vibration those that theirs are most like, all if there are none of theirs.

        Raises
        ------
        InputError
            If a recording is too short for the published cut.
        """
        (source,) = sources_of(model, Encodings())
        at = [r for r in self._recordings if speed_of(r) == speed_mm_s and has(r, source)]
        at.sort(key=lambda r: self.textures.index(str(r.attrs[dims.TEXTURE])))
        if [str(r.attrs[dims.TEXTURE]) for r in at] != self.textures:
            return None
        encoded = np.stack([encode(r, source, "published").values for r in at], axis=1)
        if not source.encoding.of_vibration:
            if theirs is not None and len(theirs) != len(encoded[1::2]):
                expected = f"{len(encoded[1::2])} samples of each texture of {model.name}, as here"
                raise InputError(f"{speed_mm_s:g} mm/s: expected {expected}, found {len(theirs)}")
            return encoded[1::2]
        spectra = source.encoding.seen(encoded) / self.largest_amplitude
        return spectra if theirs is None else spectra[nearest(spectra, theirs)]

    @cached_property
    def largest_amplitude(self) -> float:
        """Of all recordings: what the authors divide spectra by."""
        model = Model("spectra", channel=dims.RA2, encoding="spectral", classifier=None)
        (source,) = sources_of(model, Encodings())
        heard = [r for r in self._recordings if has(r, source)]
        return max(float(encode(r, source, "published").values.max()) for r in heard)

    def _read(self, model: Model, speed_mm_s: float) -> dict[str, Floats] | None:
        path = self.folder / "samples" / model.name / f"{speed_mm_s:g}.npz"
        return _read(path, _SAMPLES, "outputs")


def nearest(ours: Floats, theirs: Floats) -> Floats:
    """Return which of our windows, all textures together, each of theirs is most like."""
    flat = (x.reshape(len(x), -1) for x in (theirs, ours))
    apart = cdist(*flat, "cityblock")  # one line that differs does not decide
    return np.asarray(apart.argmin(axis=1))
