"""Drums to print, read back by another library."""

import numpy as np
import pytest
import trimesh

from afferents.errors import InputError
from afferents.rig import Drum, bumped_surface, write_stl
from afferents.rig.drums import write_drum

NOMINAL = Drum(print_sd_mm=0, patch_sd_mm=0)


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    path = tmp_path_factory.mktemp("stl") / "g.stl"
    write_stl(path, bumped_surface(3.0, NOMINAL), NOMINAL, bore_mm=10.0, every=8)
    return trimesh.load_mesh(path)


def test_the_drum_is_watertight_and_turned_outwards(printed):
    assert printed.is_watertight
    assert printed.is_winding_consistent
    assert printed.volume > 0
    assert printed.euler_number == 0  # one hole: the bore


def test_the_drum_has_its_size(printed):
    assert np.ptp(printed.vertices[:, 2]) == pytest.approx(36)
    radius = np.hypot(*printed.vertices[:, :2].T)
    assert radius.max() == pytest.approx(40.5, abs=1e-3)
    assert radius.min() == pytest.approx(5, abs=1e-3)
    bumps = 0.5 * np.pi / 4 * NOMINAL.bump_ratio**2
    solid = np.pi * 36 * (40**2 - 5**2) + np.pi * 80 * 36 * bumps
    assert printed.volume == pytest.approx(solid, rel=0.002)


def test_the_bumps_stand_where_the_simulated_ones_stand(printed):
    radius = np.hypot(*printed.vertices[:, :2].T)
    angle = np.arctan2(printed.vertices[:, 1], printed.vertices[:, 0]) % (2 * np.pi)
    middle = np.abs(printed.vertices[:, 2] - 0.05 * (360 + 24 + 0.5)) < 0.01
    order = np.argsort(angle[middle])
    expected = bumped_surface(3.0, NOMINAL).height_mm[::8, 360 + 24]
    assert expected.max() > 0.2
    np.testing.assert_allclose(radius[middle][order] - 40, expected, atol=1e-3)


@pytest.mark.parametrize("texture", ["m", "a", "2.2"])
def test_a_named_drum_is_written(texture, tmp_path):
    path = write_drum(texture, tmp_path / "drum.stl", 8.0)
    content = path.read_bytes()
    assert len(content) == 84 + 50 * int.from_bytes(content[80:84], "little")
    assert not list(tmp_path.glob(".partial*"))


def test_a_height_map_is_written(tmp_path):
    np.save(tmp_path / "waves.npy", np.sin(np.linspace(0, 6, 50))[:, None] * np.ones((50, 50)))
    path = write_drum(f"waves={tmp_path}/waves.npy,12,1", tmp_path / "drum.stl", 8.0)
    assert path.stat().st_size > 1e6


@pytest.mark.parametrize("bore", [0.0, 79.0])
def test_a_bore_that_leaves_no_wall_is_refused(bore, tmp_path):
    with pytest.raises(InputError, match=r"--bore: .*up to 76 mm"):
        write_drum("g", tmp_path / "drum.stl", bore)
    assert not list(tmp_path.iterdir())
