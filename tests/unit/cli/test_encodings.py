"""Options of encodings are what the encodings say, on every command that encodes."""

import json
from pathlib import Path

import pytest

from afferents.encodings.settings import options

OWN = f"{Path(__file__).parents[1] / 'own' / 'own_parts.py'}:powers"


@pytest.mark.parametrize("command", ["evaluate", "train"])
def test_all_of_them_are_offered_with_their_help(does, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "200")
    out = does(command, "--help-all")
    for option in options().values():
        assert option.flag in out
        assert option.help in out


def test_one_of_an_encoding_from_outside_goes_all_the_way(does, stores, tmp_path):
    command = ("evaluate", stores["video"], "--out", tmp_path / "r", "--models", OWN, "--json")
    out = does(*command, "--power", 2, "--workers", 1)
    assert json.loads(out)["options"] == {"power": 2}


@pytest.mark.parametrize(
    ("option", "value", "sentence"),
    [
        ("--frames", 0, "--frames: expected a positive number, found 0"),
        ("--window-s", "nan", "--window-s: expected a positive number, found nan"),
        ("--mask", "50", "--mask: expected lines as in 50Hz,0.0573/mm, found '50'"),
    ],
)
def test_a_value_that_makes_no_sense(fails, stores, tmp_path, option, value, sentence):
    command = ("evaluate", stores["video"], "--out", tmp_path / "r", "--models", "sa-wave")
    assert sentence in fails(*command, option, value)
    assert not (tmp_path / "r").exists()
