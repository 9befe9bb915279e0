"""Any layout of pins: the square lattice comes out of it, and forces between pins are mutual."""

import numpy as np
import pytest

from afferents.rig import Skin, bumped_surface, felt
from afferents.rig.skin import PHYSICS_RATE_HZ, mesh_of
from afferents.rig.skin_on_drum import Motion, SkinOnDrum

LATTICE = Skin(recess_mm=0)


def hexagon(rings=4, pitch=1.5):
    pins = [
        ((i - (2 * rings - abs(row)) / 2) * pitch, row * pitch * 3**0.5 / 2)
        for row in range(-rings, rings + 1)
        for i in range(2 * rings + 1 - abs(row))
    ]
    return np.array(pins)


def scattered():
    return hexagon() + np.random.default_rng(0).normal(0, 0.2, (61, 2))


@pytest.mark.parametrize("pins", [hexagon(), scattered()], ids=["hexagon", "scattered"])
def test_what_a_pin_does_to_another_comes_back(pins):
    """Times the mass that goes with its share, each coupling is the other's too."""
    mesh, n = mesh_of(pins, 1.2), len(pins)
    force = np.zeros((n, n))
    np.add.at(force, (np.arange(n)[:, None], mesh.neighbour), mesh.coupling * mesh.share[:, None])
    np.testing.assert_allclose(force, force.T, rtol=1e-5)
    assert (force > 0).sum() > 4 * n


def inner_step(pins):
    """A mesh, a field that grows evenly, and how it differs from each inner pin's neighbours."""
    mesh, field = mesh_of(pins, 1.2), pins @ [0.3, -0.2]
    inner = np.hypot(*pins.T) < 3
    return mesh, inner, field[mesh.neighbour] - field[:, None]


def test_a_field_that_grows_evenly_pulls_at_no_inner_pin_wherever_they_are():
    mesh, inner, step = inner_step(scattered())
    np.testing.assert_allclose((mesh.coupling * step).sum(axis=1)[inner], 0, atol=1e-5)


def test_a_pressure_that_falls_evenly_pushes_by_its_slope():
    """Over two pitches, as the lattice's difference of two neighbours."""
    mesh, inner, step = inner_step(hexagon())
    push = (mesh.push * step[..., None]).sum(axis=1)[inner]
    np.testing.assert_allclose(push, np.tile([-0.3, 0.2], (len(push), 1)) * 2 * 1.2, atol=1e-5)


def test_pins_where_the_lattice_has_them_move_as_the_lattice_does():
    """But for the order of sums; displacements of some 0.1 mm agree to 1 um."""
    surface = felt(bumped_surface(3.0), LATTICE.footprint_mm, LATTICE.bridging_per_mm)
    places = tuple((float(x), float(y)) for x, y in LATTICE.rest_mm())
    n = round(0.1 * PHYSICS_RATE_HZ)
    motion = Motion(np.arange(n) * 50 / PHYSICS_RATE_HZ, np.full(n, 50.0), np.full(n, 0.7))
    found = [
        SkinOnDrum(skin, surface, (0.01, 0.0), 0.3, np.full(361, 1 / 361)).run(
            motion, np.arange(0.0, n, 98)
        )
        for skin in (LATTICE, LATTICE.model_copy(update={"pins_mm": places}))
    ]
    np.testing.assert_allclose(*(one.displacement_mm for one in found), atol=1e-3)
    np.testing.assert_allclose(*(one.pressure_mn for one in found), atol=1e-3)
    assert np.sqrt((found[0].displacement_mm[-1] ** 2).mean()) > 0.05
