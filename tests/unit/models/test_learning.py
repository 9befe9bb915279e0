import numpy as np
import pytest
import xarray as xr

from afferents.encodings.images import SpatialEncoding
from afferents.encodings.spectra import SpectralEncoding
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneSpeedOut
from afferents.models.config import TrainingConfig
from afferents.models.learning_set import learning_set, scale_of, thinned

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


def test_nested_scale_never_saw_the_held_out_speed(spectra):
    fold, learnt = learn(spectra, PLAIN, NESTED)
    assert learnt.scale == pytest.approx(float(spectra.values[fold.train].max()))
    assert learnt.scale <= 1
    assert set(spectra["speed_mm_s"].values[learnt.scaled_on]).isdisjoint({40.0})


def test_published_scale_saw_everything(spectra):
    _, learnt = learn(spectra, PLAIN, PUBLISHED)
    assert learnt.scale == pytest.approx(float(spectra.values.max()))
    assert learnt.scale > 2


def test_the_scale_is_of_all_bins_kept_not_only_those_the_model_sees(spectra):
    spectra.values[0, 0, 35] = 99
    assert scale_of(spectra, SPECTRA, PUBLISHED, np.arange(3))[0] == 99


def test_images_keep_their_pixels(spectra):
    assert scale_of(spectra, SpatialEncoding(), NESTED, np.arange(3))[0] == 1.0


def test_plain_spectra_are_a_view_cut_to_the_models_bins(spectra):
    fold, learnt = learn(spectra, PLAIN, NESTED)
    assert learnt.values.shape == (24, 1, 10)
    np.testing.assert_array_equal(learnt.train, fold.train)
    np.testing.assert_array_equal(learnt.labels[:12], 0)


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


def test_thinning_spreads_over_recordings(spectra):
    _, learnt = learn(spectra, PLAIN, NESTED, kept=4)
    recordings = spectra["recording"].values
    assert len(set(recordings[learnt.train])) == len(learnt.train) == 4
    np.testing.assert_array_equal(thinned(np.arange(10), 5), [1, 3, 5, 7, 9])
    np.testing.assert_array_equal(thinned(np.arange(3), None), [0, 1, 2])


@pytest.mark.parametrize(("protocol", "of_each"), [(NESTED, 7), (PUBLISHED, 6)])
def test_a_limit_counts_stretched_copies_too(spectra, protocol, of_each):
    _, learnt = learn(spectra, AUGMENTED, protocol, kept=30)
    assert len(learnt.train) == 30 // of_each * of_each
