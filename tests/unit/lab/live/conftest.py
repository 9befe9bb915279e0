"""Small models, trained and exported once, and a browser."""

import math

import numpy as np
import pytest

from afferents.evaluation.data import open_data
from afferents.evaluation.options import TrainingOptions
from afferents.models.model import MODELS
from afferents.progress import Progress

from ....conftest import MAKES_STORES, few_epochs
from ....extras import open_browser
from ....kept import kept

QUIET = Progress(quiet=True)
MAKES_MODELS = ("afferents.evaluation.train", "afferents.models.export")
LIVE = ["afferents.cli", "afferents.lab.live.web.server", "afferents.lab.live.replay"]
"""What `live` imports, but for ONNX Runtime, whose threads no fork outlives."""


def trained(store, name, folder):
    from afferents.evaluation.train import train_model  # what needs no model needs none
    from afferents.models.export import export

    (data,) = open_data([str(store)])
    train_model(data, MODELS[name], folder / name, TrainingOptions(preset="quick"), QUIET)
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

    with kept("models", train_all, (*MAKES_STORES, *MAKES_MODELS)) as folder:
        yield {name: folder / f"{name}.onnx" for name in sources}


def pipeline_of(models, *names, speed=math.inf):
    """Return a pipeline of some models, for which nothing comes too late unless `speed` is 1."""
    from afferents.lab.live import LivePipeline, Network

    pipeline = LivePipeline.with_models([Network(models[name]) for name in names])
    for sense in (pipeline.video, pipeline.audio):
        if sense is not None:
            sense.speed = speed
    return pipeline


@pytest.fixture(scope="module")
def browser():
    with open_browser() as opened:
        yield opened


@pytest.fixture
def rng():
    return np.random.default_rng(0)
