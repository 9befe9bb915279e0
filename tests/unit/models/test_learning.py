import numpy as np
import pytest
import xarray as xr

from afferents.encodings.spectra import SpectralEncoding
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneSpeedOut
from afferents.models.config import TrainingConfig
from afferents.models.learning_set import choose_scale, learning_set, thin

NESTED, PUBLISHED = PROTOCOLS["nested"], PROTOCOLS["published"]
PLAIN, AUGMENTED = False, True
SPECTRA = SpectralEncoding(model_bins=10)


@pytest.fixture
def spectra():
    """Two textures, four speeds, three windows each; 40 bins; the loudest is at 40 mm/s."""
    rows = [(t, v, f"{t}/{v}", float(n)) for t in "ab" for v in (10, 20, 30, 40) for n in range(3)]
    texture, speed, recording, start = (np.array(column) for column in zip(*rows, strict=True))
    values = np.random.default_rng(0).random((len(rows), 1, 40)).astype(np.float32)
    values[speed == 40] *= 7
    coords = {
        "texture": texture,
        "speed_mm_s": speed.astype(float),
        "recording": recording,
        "start_s": start,
        "stop_s": start + 1,
    }
    return xr.DataArray(
        values,
        dims=("sample", "channel", "frequency"),
        coords={name: ("sample", column) for name, column in coords.items()},
    )


def learn(spectra, augmented, protocol, held_out=40.0, kept=None):
    folds = LeaveOneSpeedOut(protocol, random_halves=True).folds(spectra)
    fold = next(f for f in folds if f.held_out == held_out)
    rng = np.random.default_rng(0)
    config = TrainingConfig(learning_rate=1e-3, patience=3, training_samples=kept)
    return fold, learning_set(spectra, SPECTRA, augmented, protocol, fold, config, rng)


def test_nested_scale_never_saw_the_held_out_speed_and_published_saw_everything(spectra):
    fold, learnt = learn(spectra, PLAIN, NESTED)
    assert learnt.scale == pytest.approx(float(spectra.values[fold.train].max()))
    assert learnt.scale <= 1
    assert set(spectra["speed_mm_s"].values[learnt.scaled_on]).isdisjoint({40.0})
    _, learnt = learn(spectra, PLAIN, PUBLISHED)
    assert learnt.scale == pytest.approx(float(spectra.values.max()))
    spectra.values[0, 0, 35] = 99  # in a bin that is kept, and that the model does not see
    assert choose_scale(spectra, SPECTRA, PUBLISHED, np.arange(3))[0] == 99


@pytest.mark.parametrize(("protocol", "originals"), [(NESTED, True), (PUBLISHED, False)])
def test_copies_are_of_training_samples_only(spectra, protocol, originals):
    fold, learnt = learn(spectra, AUGMENTED, protocol)
    n = len(fold.train)
    assert len(learnt.values) == 24 + 6 * n
    assert set(fold.train).issubset(learnt.train) == originals
    assert len(learnt.train) == (7 if originals else 6) * n
    np.testing.assert_array_equal(learnt.labels[24 : 24 + n], learnt.labels[fold.train])
    assert learnt.train.max() == len(learnt.values) - 1
    # What is validated and tested stays as it was recorded.
    np.testing.assert_array_equal(learnt.values[:24], spectra.values[..., :10])
    _, fewer = learn(spectra, AUGMENTED, protocol, kept=30)  # a limit counts copies too
    assert len(fewer.train) == 30 // (6 + originals) * (6 + originals)


def test_thinning_spreads_over_recordings(spectra):
    _, learnt = learn(spectra, PLAIN, NESTED, kept=4)
    recordings = spectra["recording"].values
    assert len(set(recordings[learnt.train])) == len(learnt.train) == 4
    np.testing.assert_array_equal(thin(np.arange(10), 5), [1, 3, 5, 7, 9])
    np.testing.assert_array_equal(thin(np.arange(3), None), [0, 1, 2])
