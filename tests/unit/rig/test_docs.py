"""The page of the rig says what the constants are."""

import re
from pathlib import Path

from afferents.rig import NUISANCES, Rig, bumped_surface
from afferents.store.recording import LETTERS, folder_of

PAGE = (Path(__file__).parents[3] / "docs" / "rig.md").read_text(encoding="utf-8")


def test_every_constant_stands_there_with_its_value_and_source():
    constants = {
        f"{section}.{name}": str(value)
        for section, fields in Rig().model_dump().items()
        for name, value in fields.items()
    }
    rows = re.findall(r"^\| `(\w+\.\w+)` \| (\S+) \| (.+) \|$", PAGE, re.MULTILINE)
    assert {name: value for name, value, _ in rows} == constants
    assert all(
        source.startswith(("paper", "published", "chosen", "the drum's")) for *_, source in rows
    )


def test_every_nuisance_stands_there():
    assert set(NUISANCES) <= set(re.findall(r"`([\w-]+)`", PAGE))


def test_the_friction_of_all_thirteen_drums_stands_there():
    table = PAGE.partition("<!-- friction -->\n")[2].partition("<!-- /friction -->")[0]
    drums, _, factors = ([c.strip() for c in row.split("|")[1:-1]] for row in table.splitlines())
    assert drums == list(LETTERS)
    surfaces = [bumped_surface(float(folder_of(letter)), Rig().drum) for letter in drums]
    assert factors == [f"{surface.friction_factor:.2f}" for surface in surfaces]
