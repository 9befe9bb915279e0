"""Weights on disk."""

import pytest

from afferents.errors import InputError
from afferents.models.classifiers import build
from afferents.models.folder import dump_weights, load_weights


def test_weights_of_another_network_are_refused(tmp_path):
    path = tmp_path / "weights.safetensors"
    path.write_bytes(dump_weights(build("vibration-net", 3, (1, 140))))
    with pytest.raises(InputError, match="expected weights of SpatialNet"):
        load_weights(build("spatial-net", 3, (8, 8)), path)
    with pytest.raises(InputError, match="expected weights of VibrationNet, found size mismatch"):
        load_weights(build("vibration-net", 4, (1, 140)), path)
