"""The page of the rig and the script say what its constants are."""

from pathlib import Path

from afferents.rig import NUISANCES, Rig, bumped_surface
from afferents.store.recording import LETTERS, folder_of

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "rig.md").read_text(encoding="utf-8")


def test_every_constant_has_a_source(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    from rig_constants import SOURCES, constants_table

    assert all(
        source.startswith(("paper", "published", "chosen", "the drum's"))
        for source in SOURCES.values()
    )
    assert constants_table().count("\n") == len(SOURCES) + 1  # refuses what has no source


def test_every_nuisance_stands_there_and_how_all_drums_with_bumps_rub():
    assert [name for name in NUISANCES if f"`{name}`" not in PAGE] == []
    surfaces = [bumped_surface(float(folder_of(letter)), Rig().drum) for letter in LETTERS]
    rub = [f"{surface.friction_factor:.2f}" for surface in surfaces]
    assert rub == ["1.00", *["0.47"] * 12]
    assert "0.47 of that on the smooth one" in PAGE
