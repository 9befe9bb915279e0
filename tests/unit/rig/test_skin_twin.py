"""The kernel against the skin's equations once more, in plain NumPy and double precision."""

import numpy as np
import pytest

from afferents.rig import Skin, Surface, bumped_surface, felt
from afferents.rig.skin import PHYSICS_RATE_HZ
from afferents.rig.skin_on_drum import Motion, SkinOnDrum

N = 19
MN_PER_MG = 1e6


def height(surface: Surface, along_mm: np.ndarray, across_mm: np.ndarray):
    """Return height and slopes by bilinear interpolation; along closes on itself."""
    map_, (da, db) = surface.height_mm.astype(float), surface.pitch_mm
    a, b = np.mod(along_mm, surface.length_mm) / da, across_mm / db
    i, j = np.floor(a).astype(int), np.floor(b).astype(int)
    fa, fb, n = a - i, b - j, len(map_)
    h00, h01 = map_[i % n, j], map_[i % n, j + 1]
    h10, h11 = map_[(i + 1) % n, j], map_[(i + 1) % n, j + 1]
    near, far = h00 + fb * (h01 - h00), h10 + fb * (h11 - h10)
    slope_across = (h01 - h00) + fa * ((h11 - h10) - (h01 - h00))
    return near + fa * (far - near), (far - near) / da, slope_across / db


def numpy_run(
    skin: Skin, surface: Surface, motion: Motion, tilt=(0.0, 0.0), lateral_mm=0.0, rate_hz=8820.0
):
    """Return displacement (step, node, 2), depth and pressure (step, node)."""
    dt, rest = 1 / rate_hz, skin.rest_mm()
    x, y = rest.T
    gap = x**2 / 2 * (1 / skin.radius_mm + 1 / skin.tip_radius_mm) + y**2 / (2 * skin.tip_radius_mm)
    gap = gap + tilt[0] * x + tilt[1] * y + np.where(skin.nodules(), 0, skin.recess_mm)
    u, v, z = np.zeros((3, N * N, 2))
    q = np.zeros(N * N)
    damping = 2 * skin.damping_ratio * np.sqrt(skin.shear_mn_mm * MN_PER_MG / skin.mass_mg)
    relax = 1 - np.exp(-dt / skin.relaxation_s)
    out_u, out_d, out_p = [], [], []
    for slide, speed, depth in zip(*motion, strict=True):
        h, slope_x, slope_y = height(
            surface, x + u[:, 0] - slide, y + u[:, 1] - lateral_mm + surface.width_mm / 2
        )
        d = np.maximum(depth - gap + h, 0)
        q = q + relax * (d - q)
        p = np.maximum(skin.normal_mn_mm * (d + skin.relaxing_share * (d - q)), 0)
        w = np.array([speed, 0.0]) - v
        size = np.sqrt((w**2).sum(1) + 1e-12)
        g = skin.kinetic_friction + (skin.static_friction - skin.kinetic_friction) / (
            1 + (size / skin.stribeck_mm_s) ** 2
        )
        loss = skin.bristle_per_mm * size / g
        z = (z + w * dt) / (1 + loss * dt)[:, None]
        rub = (
            skin.bristle_per_mm * z
            + skin.bristle_damping_s_mm * (w - loss[:, None] * z)
            + skin.viscous_s_mm * w
        )
        force = p[:, None] * (rub - np.stack([slope_x, slope_y], axis=1))
        grid = np.pad(u.reshape(N, N, 2), ((1, 1), (1, 1), (0, 0)), mode="edge")
        around = grid[:-2, 1:-1] + grid[2:, 1:-1] + grid[1:-1, :-2] + grid[1:-1, 2:]
        pressed = np.pad(p.reshape(N, N), 1, mode="edge")
        push = np.stack(
            [pressed[1:-1, :-2] - pressed[1:-1, 2:], pressed[:-2, 1:-1] - pressed[2:, 1:-1]], -1
        )
        push = push.reshape(-1, 2) * skin.spread_mm / (2 * skin.pitch_mm)
        elastic = skin.coupling_mn_mm * (around.reshape(-1, 2) - 4 * u) - skin.shear_mn_mm * u
        v = v + ((elastic + push + force) * MN_PER_MG / skin.mass_mg - damping * v) * dt
        u = u + v * dt
        out_u.append(u), out_d.append(d), out_p.append(p)
    return np.array(out_u), np.array(out_d), np.array(out_p)


@pytest.mark.parametrize("speed", [10.0, 100.0])
def test_kernel_does_what_its_numpy_twin_does(speed):
    skin, mounting = Skin(), {"tilt": (0.01, -0.02), "lateral_mm": 0.737}
    surface = felt(bumped_surface(3.0), skin.footprint_mm, skin.bridging_per_mm)
    n = round(0.05 * PHYSICS_RATE_HZ)
    time = (np.arange(n) + 1) / PHYSICS_RATE_HZ
    speeds = speed * np.clip(time / 0.02, 0, 1)
    way = Motion(0.041 + np.cumsum(speeds) / PHYSICS_RATE_HZ, speeds, np.full(n, 0.7))
    lattice = SkinOnDrum(skin, surface, weight=np.full(361, 1 / 361), **mounting)
    fast = lattice.run(way, np.arange(n, dtype=float))
    u, d, p = numpy_run(skin, surface, way, **mounting)
    # A frame at the start of a step shows pins where the step before left them, and the depth
    # and pressure of the step itself.
    for found, expected, scale in (
        (fast.displacement_mm[1:], u[:-1], 0.1),
        (fast.inward_mm, d, 0.7),
        (fast.pressure_mn, p, 1.0),
    ):
        assert np.abs(expected).max() > scale
        assert np.sqrt(((found - expected) ** 2).mean()) < 1e-3 * scale
        # A node that is about to slip does so a step sooner or later, by rounding.
        np.testing.assert_allclose(found, expected, atol=5e-2 * scale)
