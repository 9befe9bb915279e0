"""A card says what it should, or one sentence says why not."""

import json

import pytest

from afferents.errors import InputError
from afferents.models.card import Card, parse_card, read_card

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
    "validation_accuracy": 0.75,
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
        ({"scale": 0}, "scale: greater than 0, found 0"),
        ({"scale": float("nan")}, "found scale = nan"),
        ({"temperature": -1}, "temperature: greater than 0"),
        ({"textures": ["0"]}, "textures: "),
        ({"textures": ["0", "0"]}, "textures must each have a name of its own"),
        ({"shape": []}, "shape: "),
        ({"shape": [2, 19, -19]}, "shape.2: greater than or equal to 1"),
        ({"shape": [2, 10**6, 10**6]}, "shape.1: less than or equal to 10000"),
        (WIDE, "shape must make at most 1000000 values a sample"),
        ({"seed": True}, "seed: a valid integer, found True"),
        ({"encoding": {"frames": 10}}, "encoding must have a name"),
        ({"encoding": None}, "encoding: "),
        ({"sensor": None}, "sensor must be given for ra-wave-vector, or sample_rate_hz"),
        ({"shape": [2, 19]}, "shape must have a size for each of sample_dims"),
        ({"validation_accuracy": 7}, "validation_accuracy: less than or equal to 1"),
        ({"fps_hz": "90"}, "fps_hz: a valid number, found '90'"),
        ({"data": [{"source": 1}]}, "data.0.source: a valid string"),
        ({"model": 3}, "model: a valid string, found 3"),
        ({"model": "resnet"}, "model must be one of sa-se"),
        ({"model": "ra-se"}, "channel, encoding and classifier must be those of ra-se"),
        ({"waves": {"frames": 10}}, "waves: "),
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


REQUIRED = [name for name, field in Card.model_fields.items() if field.is_required()]


@pytest.mark.parametrize("name", REQUIRED)
def test_a_card_that_lacks_something_is_named(name):
    content = {key: value for key, value in CONTENT.items() if key != name}
    with pytest.raises(InputError, match=rf"m.onnx: .* the key '{name}', found none"):
        parse_card(json.dumps(content), "m.onnx")


def test_a_card_of_data_whose_name_is_no_text_is_written_and_read():
    card = Card(**CONTENT)
    assert parse_card(card.to_json(), "m.onnx").data[0].source == "Z?"


SCORE = {
    "protocol": "nested", "preset": "fast", "seeds": [0], "mean_accuracy": 0.9,
    "worst_accuracy": 0.8, "worst_mm_s": 40, "same_data": True,
}  # fmt: skip


@pytest.mark.parametrize(
    ("validation", "score", "said"),
    [
        ((0.34, 1.0), None, "guessing (50.0%): the 95% interval is [34.0, 100.0]."),
        ((0.6, 0.9), None, ""),
        (None, None, ""),  # an earlier card, 75% right
        ((0.34, 1.0), (0.7, 1.0), ""),  # an evaluation says more than one speed
        ((0.6, 0.9), (0.0, 1.0), "guessing (50.0%): the 95% interval is [0.0, 100.0]."),
    ],
)
def test_a_card_says_that_nothing_was_learnt_if_an_interval_holds_chance(validation, score, said):
    scores = [{**SCORE, "ci95": score}] if score else []
    text = " ".join(Card(**CONTENT, validation_ci95=validation, scores=scores).describe())
    assert ("Nothing was learnt that can be told from guessing" in text) == bool(said)
    assert said in text


def test_only_textures_named_by_their_spacing_have_bumps():
    content = CONTENT | {"sensor": {"pitch_mm": 2.0}}
    assert "bumps of 3" in " ".join(Card(**content, named_by_spacing=True).describe())
    assert "bumps" not in " ".join(Card(**content).describe())
