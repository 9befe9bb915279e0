"""The commands as functions, and models as they are asked for."""

import pytest

import afferents
from afferents.errors import InputError
from afferents.models.model import MODELS, TABLE1, choose_models, list_names

NAMES = ["calibrate", "track", "simulate", "extract", "evaluate", "report", "reproduce", "train"]
NAMES += ["export", "export_lerobot", "export_mcap", "export_nwb", "explain"]
NAMES += ["inspect", "samples", "view"]


def test_their_names_are_found_and_their_help_is_whole():
    assert set(NAMES) <= set(dir(afferents))
    for name in NAMES:
        help_text = getattr(afferents, name).__doc__
        assert "Returns\n" in help_text, name
        assert "Parameters\n" in help_text, name


def test_what_is_wrong_is_said_in_python_s_words(tmp_path, stores):
    with pytest.raises(InputError, match="--frames: expected models that it is for"):
        afferents.evaluate(stores["video"], tmp_path / "r", "sa-se", frames=5, quiet=True)
    with pytest.raises(InputError, match="frame: expected an option, or a field of an enc"):
        afferents.samples(stores["video"], "sa1", "spatiotemporal", frame=5, quiet=True)
    taken = afferents.Model("ra-se", channel="sa1", encoding="spatial", classifier="ridge")
    with pytest.raises(InputError, match="a name that no model of this package has, found 'ra-se'"):
        afferents.evaluate(stores["video"], tmp_path / "r", taken, quiet=True)
    with pytest.raises(InputError, match="encoding: expected an Encoding, or one of spatial"):
        afferents.samples(stores["video"], "sa1", "tea", quiet=True)
    assert not (tmp_path / "r").exists()


def test_all_and_best_may_stand_among_other_names():
    assert choose_models("all") == list(TABLE1.values())
    assert choose_models("best") == []
    assert choose_models("all,best") == list(TABLE1.values())
    assert list_names("all, best") == ["all", "best"]
    wave = MODELS["ra-wave"]
    assert choose_models("ra-wave,all") == [*TABLE1.values(), wave]
    assert choose_models(["best", "sa-se", wave]) == [TABLE1["sa-se"], wave]
    assert list_names(wave) == []


def test_an_unknown_name_beside_them_is_refused():
    with pytest.raises(InputError, match="found 'tea'"):
        choose_models("all,tea")
