"""A model as exported: one ONNX file, with a card of what it needs; it classifies samples."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents import channels, plugins
from afferents.encodings import base, settings
from afferents.encodings.images import ImageEncoding
from afferents.errors import InputError, reading, then
from afferents.models.card import METADATA, Card, parse_card, tensor_names


class Outcome(NamedTuple):
    """What a network makes of a sample.

    Attributes
    ----------
    probabilities
        Of each texture, (n_textures,).
    novelty
        Above 1 nothing that was learnt fits.
    """

    probabilities: NDArray[np.float32]
    novelty: float


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

    Attributes
    ----------
    card
        What it learnt from, and what it needs.
    channel
        The response that it takes.
    encoding
        How that is divided into samples.
    of_pixels
        Whether it takes tactile images; else what single markers show.
    """

    def __init__(self, path: Path) -> None:
        """Read the file and its card."""
        self.path = path
        onnxruntime: Any = plugins.import_extra("lab", str(path), "onnxruntime")
        if not path.is_file():
            there = "a folder" if path.is_dir() else "no such file"
            hint = "run 'afferents export' on it first" if path.is_dir() else ""
            raise InputError(f"{path}: expected a model's ONNX file, found {there}{then(hint)}")
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        with reading(path, "a model's ONNX file"):
            self._session = onnxruntime.InferenceSession(
                path.read_bytes(), options, ["CPUExecutionProvider"]
            )
        text = self._session.get_modelmeta().custom_metadata_map.get(METADATA)
        if text is None:
            raise InputError(
                f"{path}: expected an ONNX file of 'afferents export', with the metadata "
                f"'{METADATA}', found one without; export the model again"
            )
        self.card: Card = parse_card(text, path)
        self._match_card()
        self.channel = channels.find_channel(self.card.channel)
        self.encoding = settings.read_encoding(self.card.encoding, path)
        self._stream: base.ImageStream | None = None
        if isinstance(self.encoding, ImageEncoding) and not self._stepping:  # else the file does
            self._stream = self.encoding.stream(self.channel.lookback)
        self.of_pixels = isinstance(self.encoding, ImageEncoding) and self.encoding.of_pixels
        self.skip()

    def _match_card(self) -> None:
        """Refuse inputs and outputs that the card does not go with."""
        shapes = {i.name: tuple(i.shape) for i in self._session.get_inputs()}
        found = {o.name: tuple(o.shape) for o in self._session.get_outputs()}
        self._stepping = "past" in shapes
        inputs, outputs = tensor_names(self._stepping)
        self._input = inputs[0]
        shape = (1, *(self.card.shape[1:] if self._stepping else self.card.shape))
        given = (1, len(self.card.textures))
        alike = set(shapes) == set(inputs) and set(found) == set(outputs)
        if not alike or (shapes[self._input], found[outputs[0]]) != (shape, given):
            raise InputError(
                f"{self.path}: expected the input {self._input} {shape} and the outputs "
                f"{', '.join(sorted(outputs))}, {outputs[0]} {given}, as its card says, found "
                f"{shapes} and {found}; export the model again"
            )
        self._past = np.zeros(shapes["past"], np.float32) if self._stepping else None

    def skip(self) -> None:
        """Begin a new run of images: what comes next does not follow what came before."""
        self._n = 0
        if self._stream is not None:
            self._stream.skip()

    def predict(self, sample: NDArray[np.float32]) -> Outcome | None:
        """Return what a sample is; None until a run of images is full.

        Parameters
        ----------
        sample
            An image (row, column) or (component, row, column), what markers show (component,
            marker), or a sample of vibration.
        """
        if self._stream is not None:
            complete = self._stream.feed(sample)
            if complete is None:
                return None
            sample = complete
        given = {self._input: sample[np.newaxis]}
        if self._past is not None:
            given["past"] = self._past
        outputs = self._session.run(None, given)
        if self._past is not None:
            self._past = outputs[2]
        self._n += 1
        if self._stepping and self._n < self.card.shape[0]:
            return None
        return Outcome(outputs[0][0], float(outputs[1][0]))
