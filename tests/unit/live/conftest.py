"""Small models, trained and exported once."""

import numpy as np
import pytest

from afferents.evaluation.data import open_data
from afferents.evaluation.options import TrainingOptions
from afferents.evaluation.train import Training, train_model
from afferents.models.export import export
from afferents.models.model import MODELS
from afferents.progress import Progress

from ...conftest import few_epochs
from ...kept import kept

QUIET = Progress(quiet=True)
LIVE = ["afferents.cli", "afferents.live.web.server", "afferents.live.replay"]
"""What `live` imports, but for ONNX Runtime, whose threads no fork outlives."""


def trained(store, name, folder):
    data = open_data([str(store)])
    training = Training(data, MODELS[name], data[0].encodings, TrainingOptions(preset="quick"))
    train_model(training, folder / name, QUIET)
    export(folder / name, folder / f"{name}.onnx")
    return folder / f"{name}.onnx"


@pytest.fixture(scope="session")
def models(stores):
    """Exported models by name; the folders they come from lie beside them."""
    sources = {
        "sa-se": "video",
        "ra-ste": "video",
        "sa-wave": "video",
        "ra-wave-vector": "video",
        "vib-te-aug": "audio",
    }

    def train_all(folder):
        with few_epochs():
            for name, kind in sources.items():
                trained(stores[kind], name, folder)

    with kept("models", train_all) as folder:
        yield {name: folder / f"{name}.onnx" for name in sources}


@pytest.fixture
def rng():
    return np.random.default_rng(0)
