"""The commands as functions: the way of the README, without a shell."""

import pytest

import afferents
from afferents.errors import InputError

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
