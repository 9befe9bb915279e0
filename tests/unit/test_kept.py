"""What tests keep is made anew when a module changes that it is made of, and for no other."""

import pytest

from ..kept import closure, key

FILES = {
    "__init__.py": "",
    "maker.py": "from pack import base\n\ndef make():\n    from pack.room.late import late",
    "base.py": 'TABLE = {"a": "pack.named:thing"}\nimport os, pack.stated',
    "stated.py": "from pack.lazy import Thing",
    "lazy/__init__.py": "",
    "lazy/__init__.pyi": "from .inner import Thing as Thing\nfrom .rest import Other as Other",
    "lazy/inner.py": "",
    "lazy/rest.py": "",
    "named.py": "",
    "room/__init__.py": "",
    "room/late.py": "from pack.maker import make",
    "room/sizes.toml": "",
    "room/shapes/round.json": "",
    "room/other.py": "from pack import base",
    "command.py": "from pack import maker",
    "elsewhere/__init__.py": "",
    "elsewhere/words.txt": "",
}
OUTSIDE = {"room/other.py", "command.py", "elsewhere/__init__.py", "elsewhere/words.txt"}
OUTSIDE |= {"lazy/__init__.pyi", "lazy/rest.py"}


@pytest.fixture
def package(tmp_path):
    for name, text in FILES.items():
        path = tmp_path / "pack" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "pack"


@pytest.mark.parametrize("changed", FILES)
def test_the_key_changes_with_what_is_imported_and_with_nothing_else(package, changed):
    before = key(["pack.maker"], package=package)
    with (package / changed).open("a") as file:
        file.write("\n# more\n")
    assert (key(["pack.maker"], package=package) == before) == (changed in OUTSIDE)


def test_fixtures_count_too(package, tmp_path):
    fixture = tmp_path / "conftest.py"
    fixture.write_text("one = 1")
    before = key(["pack.maker"], [fixture], package)
    fixture.write_text("one = 2")
    assert key(["pack.maker"], [fixture], package) != before


def test_a_store_does_not_hang_on_what_trains_draws_or_shows():
    rooms = {path.parts[-2] for path in closure(["afferents.extraction.extract"])}
    assert {"extraction", "markers", "store"} <= rooms
    assert not rooms & {"evaluation", "models", "reporting", "live", "cli"}
