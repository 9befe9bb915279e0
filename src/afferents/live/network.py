"""A model as exported: one ONNX file that says what it needs and feels one sample at a time."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.core.card import METADATA, Card, read_card
from afferents.core.errors import InputError


class Outcome(NamedTuple):
    """What a network says of a sample.

    Attributes
    ----------
    probabilities
        Of each texture, (n_textures,).
    strangeness
        Above 1 nothing that was learnt fits.
    """

    probabilities: NDArray[np.float32]
    strangeness: float


class Network:
    """A model read from ONNX, run by onnxruntime on one thread.

    Parameters
    ----------
    path
        As `afferents export` writes it.

    Raises
    ------
    InputError
        If there is no such file, it is no ONNX file, has no card of ours, or inputs and outputs
        that the card does not go with.
    """

    def __init__(self, path: Path) -> None:
        """Read the file and its card."""
        self.path = path
        self._session = _session(path)
        text = self._session.get_modelmeta().custom_metadata_map.get(METADATA)
        if text is None:
            raise InputError(
                path,
                f"an ONNX file of 'afferents export', with the metadata '{METADATA}'",
                "one without",
                "export the model again",
            )
        self.card: Card = read_card(text, path)
        self._check()
        self.skip()

    def _check(self) -> None:
        shapes = {i.name: tuple(i.shape) for i in self._session.get_inputs()}
        name = "spectrum" if self.card.is_vibration else "image"
        outputs = {o.name for o in self._session.get_outputs()}
        steps = self.card.frames > 1
        names = {name, "past"} if steps else {name}
        wanted = {"probabilities", "strangeness", *({"next_past"} if steps else ())}
        if set(shapes) != names or shapes[name] != (1, *self.card.shape) or outputs != wanted:
            raise InputError(
                self.path,
                f"the input {name} (1, {', '.join(map(str, self.card.shape))}) and the outputs "
                f"{', '.join(sorted(wanted))}, as its card says",
                f"{shapes} and {', '.join(sorted(outputs))}",
                "export the model again",
            )
        self._input = name
        self._past = np.zeros(shapes["past"], np.float32) if steps else None

    def skip(self) -> None:
        """Begin a new run of images: what comes next does not follow what came before."""
        self._n = 0

    def feel(self, sample: NDArray[np.float32]) -> Outcome | None:
        """Say what a sample is; None until a run of images is full.

        Parameters
        ----------
        sample
            An image (row, column) or a spectrum (channel, frequency), as the encodings make it.
        """
        given = {self._input: sample[np.newaxis]}
        if self._past is not None:
            given["past"] = self._past
        outputs = self._session.run(None, given)
        if self._past is not None:
            self._past = outputs[2]
        self._n += 1
        if self._n < self.card.frames:
            return None
        return Outcome(outputs[0][0], float(outputs[1][0]))


def _session(path: Path) -> Any:
    try:
        import onnxruntime
    except ImportError as error:
        raise InputError(
            "live", "the packages of the extra 'live'", str(error), "pip install 'afferents[live]'"
        ) from error
    if not path.is_file():
        there = "a folder" if path.is_dir() else "no such file"
        hint = "run 'afferents export' on it first" if path.is_dir() else ""
        raise InputError(path, "a model's ONNX file", there, hint)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(str(path), options, ["CPUExecutionProvider"])
    except Exception as error:
        said = str(error).splitlines()[0][:200]
        raise InputError(
            path, "a model's ONNX file", f"one that can't be loaded ({said})"
        ) from error
