"""The lattice against half its step, and against what physics demands."""

import numpy as np
import pytest

from afferents.rig import Skin, bumped_surface, felt
from afferents.rig.kernel import SPAN
from afferents.rig.skin import PHYSICS_RATE_HZ
from afferents.rig.skin_on_drum import Motion, SkinOnDrum, SkinResponse

SKIN = Skin()
WEIGHT = np.full(361, 1 / 361)


@pytest.fixture(scope="module")
def g():
    return felt(bumped_surface(3.0), SKIN.footprint_mm, SKIN.bridging_per_mm)


@pytest.fixture(scope="module")
def smooth():
    return felt(bumped_surface(0.0), SKIN.footprint_mm, SKIN.bridging_per_mm)


def motion(seconds, speed, depth=0.7, rate=PHYSICS_RATE_HZ, still_s=0.0) -> Motion:
    time = (np.arange(round(seconds * rate)) + 1) / rate
    speeds = np.where(time > still_s, speed, 0.0) * np.clip((time - still_s) / 0.02, 0, 1)
    return Motion(np.cumsum(speeds) / rate, speeds, np.full(len(time), depth))


def run(surface, way: Motion, skin=SKIN, rate=PHYSICS_RATE_HZ, every=1, **mounting) -> SkinResponse:
    mounted = {"tilt": (0.0, 0.0), "lateral_mm": 0.0, **mounting}
    lattice = SkinOnDrum(skin, surface, weight=WEIGHT, rate_hz=rate, **mounted)
    return lattice.run(way, np.arange(0, len(way.slide_mm), every, dtype=float))


def test_half_the_step_changes_nothing_that_matters(g):
    """Displacements of some 0.05 mm agree to 2 um: a thirtieth of a pixel."""
    whole = run(g, motion(0.4, 50), every=98)
    half = run(g, motion(0.4, 50, rate=2 * PHYSICS_RATE_HZ), rate=2 * PHYSICS_RATE_HZ, every=196)
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
    whole = run(g, way)
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
    moved = np.abs(run(smooth, lifted, every=98).displacement_mm).max(axis=(1, 2))
    assert moved[pulled // 98] > 0.05
    assert moved[-1] < 1e-3 * moved.max()


def test_friction_stays_within_its_law(smooth):
    """Steady sliding on a smooth drum: springs hold what friction drags, m_k to m_s times load."""
    out = run(smooth, motion(1.0, 50), every=98)
    load = float(out.pressure_mn[-1].sum())
    held = SKIN.shear_mn_mm * float(out.displacement_mm[-1, :, 0].sum())
    share = held / load
    viscous = SKIN.viscous_s_mm * 50
    assert SKIN.kinetic_friction < share < SKIN.static_friction + viscous
