"""One recording of the simulated rig, whose video is JPEGs, and its store."""

import pytest

from afferents import cli


@pytest.fixture(scope="session")
def simulated(tmp_path_factory):
    root = tmp_path_factory.mktemp("robots")
    session, store = root / "S", root / "S.zarr"
    for command in (
        ["simulate", session, "--textures", "4", "--speeds", "60", "--seconds", "2"],
        ["extract", session, store],
    ):
        cli.run([*map(str, command), "--workers", "1", "--quiet"])
    return session, store
