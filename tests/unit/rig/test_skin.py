"""The skin against half its step, any layout of pins, and physics."""

from dataclasses import replace

import numpy as np
import pytest

from afferents.rig import Skin, bumped_surface, soft_maximum
from afferents.rig.kernel import SPAN
from afferents.rig.mesh import build_mesh
from afferents.rig.skin import PHYSICS_RATE_HZ, Motion, SkinOnDrum

SKIN = Skin()
WEIGHT = np.full(361, 1 / 361)


@pytest.fixture(scope="module")
def g():
    return soft_maximum(bumped_surface(3.0), SKIN.footprint_mm, SKIN.bridging_per_mm)


@pytest.fixture(scope="module")
def smooth():
    return soft_maximum(bumped_surface(0.0), SKIN.footprint_mm, SKIN.bridging_per_mm)


def motion(seconds, speed, depth=0.7, rate=PHYSICS_RATE_HZ, still_s=0.0):
    time = (np.arange(round(seconds * rate)) + 1) / rate
    speeds = np.where(time > still_s, speed, 0.0) * np.clip((time - still_s) / 0.02, 0, 1)
    return Motion(np.cumsum(speeds) / rate, speeds, np.full(len(time), depth))


def slid(surface, way, skin=SKIN, rate=PHYSICS_RATE_HZ, every=1, **mounting):
    mounted = {"tilt": (0.0, 0.0), "lateral_mm": 0.0, **mounting}
    lattice = SkinOnDrum(skin, surface, weight=WEIGHT, rate_hz=rate, **mounted)
    return lattice.run(way, np.arange(0, len(way.slide_mm), every, dtype=float))


def test_half_the_step_changes_nothing_that_matters(g):
    """Displacements of some 0.05 mm agree to 2 um: a thirtieth of a pixel."""
    whole = slid(g, motion(0.4, 50), every=98)
    half = slid(g, motion(0.4, 50, rate=2 * PHYSICS_RATE_HZ), rate=2 * PHYSICS_RATE_HZ, every=196)
    difference = whole.displacement_mm - half.displacement_mm
    assert np.sqrt((difference**2).mean()) < 0.002
    assert np.sqrt((whole.displacement_mm**2).mean()) > 0.03


def test_a_run_in_pieces_is_the_run_in_one(g):
    way = motion(0.2, 50)
    lattice = SkinOnDrum(SKIN, g, (0.0, 0.0), 0.0, WEIGHT)
    pieces = [
        lattice.run(Motion(*(part[i : i + 441] for part in way)), np.arange(0.0, 441.0, 98))
        for i in range(0, len(way.slide_mm), 441)
    ]
    whole = slid(g, way)
    # The skin's states go on as they were. The first rate of a piece is a step between two sums
    # over the nodes that the compiler may have put in different orders.
    rounding = 2 * SPAN * np.finfo(float).eps * whole.pressure_mn.max() * PHYSICS_RATE_HZ
    found = np.concatenate([piece.pressure_rate for piece in pieces])
    np.testing.assert_allclose(found, whole.pressure_rate, rtol=0, atol=rounding)


def test_skin_let_go_returns_to_rest(smooth):
    way = motion(0.6, 50)
    pulled = len(way.slide_mm) // 2
    lifted = Motion(way.slide_mm, way.speed_mm_s, way.depth_mm.copy())
    lifted.depth_mm[pulled:] = -1.0
    moved = np.abs(slid(smooth, lifted, every=98).displacement_mm).max(axis=(1, 2))
    assert moved[pulled // 98] > 0.05
    assert moved[-1] < 1e-3 * moved.max()


def dragged(surface):
    """Steady sliding: springs hold what friction drags. Return that over the load."""
    out = slid(surface, motion(1.0, 50), every=98)
    held = SKIN.shear_mn_mm * float(out.displacement_mm[-1, :, 0].sum())
    return held / float(out.pressure_mn[-1].sum())


@pytest.mark.parametrize("grip", [1.0, 2.0])
def test_friction_drags_by_its_law_times_the_grip_of_the_surface(smooth, grip):
    assert dragged(replace(smooth, grip=grip)) == pytest.approx(grip * SKIN.friction, rel=0.01)


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
    mesh, n = build_mesh(tuple(map(tuple, pins)), 1.2), len(pins)
    force = np.zeros((n, n))
    np.add.at(force, (np.arange(n)[:, None], mesh.neighbour), mesh.coupling * mesh.share[:, None])
    np.testing.assert_allclose(force, force.T, rtol=1e-5)
    assert (force > 0).sum() > 4 * n


def inner_step(pins):
    """A mesh, a field that grows evenly, and how it differs from each inner pin's neighbours."""
    mesh, field = build_mesh(tuple(map(tuple, pins)), 1.2), pins @ [0.3, -0.2]
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


def test_pins_where_the_lattice_has_them_move_as_the_lattice_does(g):
    """But for the order of sums; displacements of some 0.1 mm agree to 1 um."""
    places = tuple((float(x), float(y)) for x, y in LATTICE.rest_mm())
    skins = LATTICE, LATTICE.model_copy(update={"pins_mm": places})
    found = [slid(g, motion(0.1, 50), skin, every=98, tilt=(0.01, 0.0)) for skin in skins]
    np.testing.assert_allclose(*(one.displacement_mm for one in found), atol=1e-3)
    np.testing.assert_allclose(*(one.pressure_mn for one in found), atol=1e-3)
    assert np.sqrt((found[0].displacement_mm[-1] ** 2).mean()) > 0.05
