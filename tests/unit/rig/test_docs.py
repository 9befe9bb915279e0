"""The page of the rig says what its constants are."""

from pathlib import Path

from afferents.rig import NUISANCES, Drum, Rig, bumped_surface
from afferents.rig.drums import write_drum
from afferents.store.recording import LETTERS, name_folder

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "rig.md").read_text(encoding="utf-8")


def test_where_a_drum_is_offered_its_bumps_diameter_is_called_a_guess():
    for text in (PAGE, write_drum.__doc__, Drum.__doc__):
        assert "guess" in text
        assert "Figure 3 of the paper" in " ".join(text.split())
    assert f"d = {Drum().bump_ratio:g} x" in PAGE
    assert "12 mm from the axis. The paper's is farther out, in the rim of a pad 40 mm" in PAGE
    assert "nodules of 1.5 mm (in the paper 2 mm)" in PAGE


def test_every_nuisance_stands_there_and_how_all_drums_with_bumps_rub():
    assert [name for name in NUISANCES if f"`{name}`" not in PAGE] == []
    surfaces = [bumped_surface(float(name_folder(letter)), Rig().drum) for letter in LETTERS]
    rub = [f"{surface.friction_factor:.2f}" for surface in surfaces]
    assert rub == ["1.00", *["0.78"] * 12]
    assert "0.78 of that on the smooth one" in PAGE
