"""Small models, trained and exported once, and the recordings that they learnt from."""

import numpy as np
import pytest

from afferents.core.model import MODELS
from afferents.core.progress import Progress
from afferents.markers import load_sensor
from afferents.pipeline.data import open_data
from afferents.pipeline.export import export_model
from afferents.pipeline.extract import Extraction, extract
from afferents.pipeline.train import Training, train

QUIET = Progress(quiet=True)


def extracted(session, out):
    extract(Extraction(session, out, load_sensor("tip_b"), "windowed", workers=1), QUIET)
    return out


def trained(store, name, folder):
    data = open_data([str(store)])
    training = Training(data, MODELS[name], "quick", "all", data[0].encodings)
    train(training, folder / name, QUIET)
    export_model(folder / name, folder / f"{name}.onnx")
    return folder / f"{name}.onnx"


@pytest.fixture(scope="session")
def stores(session, sounds, tmp_path_factory):
    """Extracted responses: of videos, and of sound alone."""
    root = tmp_path_factory.mktemp("stores")
    return {
        "video": extracted(session, root / "video.zarr"),
        "audio": extracted(sounds, root / "audio.zarr"),
    }


@pytest.fixture(scope="session")
def models(stores, tmp_path_factory):
    """Exported models by family; the folders they come from lie beside them."""
    folder = tmp_path_factory.mktemp("models")
    sources = {
        "sa-se": "video",
        "ra-ste": "video",
        "sa-wave": "video",
        "ra-wave-vector": "video",
        "vib-te-aug": "audio",
    }
    return {name: trained(stores[kind], name, folder) for name, kind in sources.items()}


@pytest.fixture
def rng():
    return np.random.default_rng(0)
