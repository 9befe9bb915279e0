"""A card says what it should, or one sentence says why not."""

import json

import pytest

from afferents.errors import InputError
from afferents.models.card import Card, read_card

CONTENT = {
    "model": "ra-wave-vector",
    "title": "RA-I vector waves",
    "classifier": "ridge",
    "channel": "ra1_vector",
    "encoding": {"name": "wavenumbers", "frames": 10, "every": 1},
    "sample_dims": ["component", "row_wavenumber", "column_wavenumber"],
    "textures": ["0", "3"],
    "shape": [2, 19, 19],
    "scale": 1.0,
    "sensor": {"name": "tip_b"},
    "fps_hz": 90,
    "preset": "fast",
    "seed": 0,
    "learnt_from_mm_s": [40, 60],
    "validated_on_mm_s": 50.0,
    "named_by_spacing": False,
    "most_sure": 0.9,
    "validation_accuracy": 0.75,
    "validation_ci95": [0.6, 0.9],
    "data": [
        {
            "source": "Z\udcff",
            "kind": "store",
            "fingerprint": "f",
            "n_recordings": 6,
            "simulated": True,
        }
    ],
    "versions": {"afferents": "0.1.0"},
}
WIDE = {"shape": [2, 1000, 1000]}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"scale": float("nan")}, "(NaN, no finite number)"),
        ({"textures": ["0", "0"]}, "textures must each have a name of its own"),
        (WIDE, "shape must make at most 1000000 values a sample"),
        ({"sensor": None}, "sensor must be given for ra-wave-vector, or sample_rate_hz"),
        ({"shape": [2, 19]}, "shape must have a size for each of sample_dims"),
        ({"model": "resnet"}, "model must be one of sa-se"),
        ({"model": "ra-se"}, "channel, encoding and classifier must be those of ra-se"),
        ({"schema_version": 99}, "schema_version must be 3"),
        ({"evil": 1}, "the unknown key 'evil'"),
    ],
)
def test_a_card_that_makes_no_sense_is_named(tmp_path, changed, said):
    path = tmp_path / "model.json"
    path.write_text(json.dumps({**CONTENT, **changed}))
    with pytest.raises(InputError) as caught:
        read_card(path)
    assert str(caught.value).startswith(f"{path}: expected ")
    assert said in str(caught.value)
    assert str(caught.value).endswith("train or export it again with this version")


SCORE = {
    "protocol": "nested", "preset": "fast", "seeds": [0], "mean_accuracy": 0.9,
    "worst_accuracy": 0.8, "worst_mm_s": 40, "same_data": True,
}  # fmt: skip


@pytest.mark.parametrize(
    ("validation", "score", "said"),
    [
        ((0.34, 1.0), None, "guessing (50.0%): the 95% interval is [34.0, 100.0]."),
        ((0.6, 0.9), None, ""),
        ((0.34, 1.0), (0.7, 1.0), ""),  # an evaluation says more than one speed
        ((0.6, 0.9), (0.0, 1.0), "guessing (50.0%): the 95% interval is [0.0, 100.0]."),
    ],
)
def test_a_card_says_that_nothing_was_learnt_if_an_interval_holds_chance(validation, score, said):
    scores = [{**SCORE, "ci95": score}] if score else []
    text = " ".join(Card(**CONTENT | {"validation_ci95": validation, "scores": scores}).describe())
    assert ("Nothing was learnt that can be told from guessing" in text) == bool(said)
    assert said in text


def test_only_textures_named_by_their_spacing_have_bumps():
    content = CONTENT | {"sensor": {"pitch_mm": 2.0}}
    assert "bumps of 3" in " ".join(Card(**content | {"named_by_spacing": True}).describe())
    assert "bumps" not in " ".join(Card(**content).describe())
