"""What options take, and what a file holds of them."""

import pytest

from afferents.errors import InputError
from afferents.evaluation.options import EvaluationOptions
from afferents.models.model import choose_models


def test_a_number_stands_for_a_list_of_one():
    options = EvaluationOptions(speeds=20, textures=3, held_out=20)
    assert (options.speeds, options.textures, options.held_out) == ((20.0,), ("3",), (20.0,))


def test_what_is_held_out_is_read_as_its_split_has_it():
    assert EvaluationOptions(held_out=(10, "12.5")).held_out == (10.0, 12.5)
    assert EvaluationOptions(split="trial", held_out=(2, "b", 2.5)).held_out == ("2", "b", "2.5")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"held_out": ["a"]}, "--held-out: expected speeds in mm/s, found "),
        ({"disturb": 0.1}, "--disturb: expected as in markers="),
        ({"seeds": 1.5}, "--seeds: expected a valid integer"),
        ({"seeds": (-1,)}, "--seeds: expected greater than or equal to 0, found -1"),
        ({"recipe": 3}, "3: expected hyperparameters of networks as TOML, found no such file"),
        ({"test_only": 5}, "the options: expected values of the kind that each takes"),
        ({"speeds": [None]}, "the options: expected values of the kind that each takes"),
    ],
)
def test_values_of_another_kind_are_one_sentence(given, sentence):
    with pytest.raises(InputError, match=sentence):
        EvaluationOptions(**given)
    with pytest.raises(InputError, match="--models: expected names, or an afferents"):
        choose_models(3)


def test_seeds_in_a_row_move_with_the_first_one():
    written = EvaluationOptions(seed=5, seeds=2).given()
    assert EvaluationOptions(**written | {"seed": 7}).seeds == (7, 8)
    assert EvaluationOptions(seeds=(3, 5, 5)).given() == {"seeds": [3, 5]}
