"""The test sets of the paper's models, ours and the authors', in one order and one form."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy.spatial.distance import cdist

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.model import Model
from afferents.core.recording import natural_order
from afferents.core.responses import Responses, speed_of
from afferents.encodings import Encodings
from afferents.pipeline.authors.folder import AuthorsFolder, Floats
from afferents.pipeline.encode import encode, has, sources_of

_SHAPES = {"spatial": (19, 19), "spatiotemporal": (10, 19, 19), "spectral": (1, 200)}
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

    def __init__(self, recordings: Sequence[Responses], folder: AuthorsFolder) -> None:
        """Make them when they are asked for."""
        self._recordings, self._folder = recordings, folder
        self.textures = sorted({str(r.attrs[dims.TEXTURE]) for r in recordings}, key=natural_order)

    @property
    def speeds(self) -> list[float]:
        """Speeds of the recordings, mm/s."""
        return sorted({v for r in self._recordings if (v := speed_of(r)) is not None})

    def theirs(self, model: Model, speed_mm_s: float) -> Floats | None:
        """Return their samples as ours are, (time, texture, *sample_shape); None without any.

        Raises
        ------
        InputError
            If the samples of the textures are not in turn, or of another shape.
        """
        found = self._folder.samples(model.name, speed_mm_s)
        if found is None:
            return None
        where, n = f"samples/{model.name}/{speed_mm_s:g}.npz", len(self.textures)
        samples, labels = found["samples"], found["labels"]
        if len(labels) % n or not np.array_equal(labels, np.arange(len(labels)) % n):
            expected = f"samples of the {n} textures of the store in turn"
            raise InputError(where, expected, f"{len(labels)} of {int(labels.max()) + 1} textures")
        shape = self.shape(model)
        if samples[0].size != int(np.prod(shape)):
            expected = f"samples of {' x '.join(map(str, shape))}"
            raise InputError(where, expected, " x ".join(map(str, samples.shape[1:])))
        in_turn = samples.reshape(-1, n, *shape)
        (source,) = sources_of(model, Encodings())
        return in_turn if source.encoding.of_vibration else in_turn.swapaxes(-1, -2)

    def outputs(self, model: Model, speed_mm_s: float) -> Floats | None:
        """Return what Keras' network said of their samples, (n, texture), if it was asked."""
        found = self._folder.samples(model.name, speed_mm_s)
        return None if found is None else found.get("outputs")

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
                raise InputError(f"{speed_mm_s:g} mm/s", expected, f"{len(theirs)}")
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

    @staticmethod
    def shape(model: Model) -> tuple[int, ...]:
        """Return the shape of a sample that the paper's network of that model takes."""
        return _SHAPES[model.encoding]


def nearest(ours: Floats, theirs: Floats) -> Floats:
    """Return which of our windows, all textures together, each of theirs is most like."""
    flat = (x.reshape(len(x), -1) for x in (theirs, ours))
    apart = cdist(*flat, "cityblock")  # one line that differs does not decide
    return np.asarray(apart.argmin(axis=1))
