"""Several lengths of window in one evaluation: a model of each, and accuracy against length."""

import pytest

import afferents
from afferents.encodings.settings import Encodings
from afferents.errors import InputError
from afferents.evaluation.plan import read_lengths, vary_length
from afferents.models.model import MODELS


@pytest.mark.parametrize(
    ("given", "lengths"),
    [(None, ()), (20, ()), ("20", ()), ("1,2, 50", (1, 2, 50)), ([5, 5, 10], (5, 10))],
)
def test_several_lengths_are_told_from_one(given, lengths):
    assert read_lengths(given) == lengths
    for wrong in ("1,0", "2,x", "5,2.5", [10, -1]):
        with pytest.raises(InputError, match="--frames: expected whole numbers of frames"):
            read_lengths(wrong)


def test_models_of_single_frames_stay_as_they_are():
    models = [MODELS["sa-se"], MODELS["ra-ste"], MODELS["sa-wave"]]
    names = [model.name for model in vary_length(models, (1, 20), Encodings())]
    assert names == ["sa-se", "ra-ste-1", "ra-ste-20", "sa-wave-1", "sa-wave-20"]
    with pytest.raises(InputError, match=r"--frames: expected models .*sa-ste.*, found sa-se"):
        vary_length(models[:1], (1, 20), Encodings())


def test_a_study_goes_to_its_report(stores, tmp_path, does):
    out = tmp_path / "r"
    asked = ("evaluate", stores["video"], "--models", "sa-wave", "--workers", 1, "--quiet")
    does(*asked, "--frames", "2,1", "--held-out", 40, "--out", out)
    # Another length later joins those that are there.
    said = does(*asked, "--frames", "5,2", "--held-out", 40, "--out", out)
    assert "Accuracy by length of window" in said
    results = afferents.load_results(out)
    assert results.summary["lengths"]["sa-wave"] == {
        "1": "sa-wave-1", "2": "sa-wave-2", "5": "sa-wave-5",
    }  # fmt: skip
    counts = results.predictions.groupby("model").size()
    assert counts["sa-wave-1"] > 1.9 * counts["sa-wave-2"] > 3.7 * counts["sa-wave-5"]
    page = afferents.report(out, quiet=True).read_text()
    assert "Accuracy by length of window" in page
    assert "--models sa-wave --frames 1,2,5" in page
    assert "--frames 1,2,5" in page
    assert (out / "figures/accuracy-by-length.png").is_file()
