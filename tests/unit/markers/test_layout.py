"""Layouts are recognised, and their markers named, however the picture is turned."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial import cKDTree

from afferents.errors import InputError
from afferents.markers.detect import spacing_px
from afferents.markers.layout import find_layout, match_layout
from afferents.markers.sensor import load_sensor

from .conftest import lay_grid

MIDDLE = (320.0, 240.0)


def turned(position, degrees, middle=MIDDLE):
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return (position - middle) @ turn + middle


def square(rows=9, columns=11, pitch=22.0):
    grid = lay_grid(rows, columns, pitch, 0)
    return grid - grid.mean(axis=0) + MIDDLE


def hexagonal():
    x, y = np.meshgrid(np.arange(12.0), np.arange(10.0))
    lattice = np.stack([(x + 0.5 * (y % 2)).ravel(), np.sqrt(0.75) * y.ravel()], axis=1) * 20
    return lattice - lattice.mean(axis=0) + MIDDLE


def rings():
    parts = [np.zeros((1, 2))]
    for k in range(1, 7):
        angle = np.arange(6 * k) * 2 * np.pi / (6 * k) + 0.2 * k
        parts.append(22 * k * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    return np.concatenate(parts) + MIDDLE


def scattered():
    rng = np.random.default_rng(3)
    return square(8, 8, 30.0) + rng.uniform(-11, 11, (64, 2))


@pytest.mark.parametrize(
    ("layout", "position"),
    [("square", square()), ("hexagonal", hexagonal()), ("radial", rings()), ("free", scattered())],
)
@pytest.mark.parametrize("degrees", [0, 6.2, -20])
def test_layouts_are_recognised_at_any_roll(layout, position, degrees):
    jitter = np.random.default_rng(0).normal(0, 0.4, position.shape)
    order = np.random.default_rng(1).permutation(len(position))
    found = find_layout((turned(position, degrees) + jitter)[order])
    assert found.layout == layout
    if layout == "square":
        assert found.roll_deg == pytest.approx(degrees, abs=0.5)
        assert (found.grid.row.max() + 1, found.grid.column.max() + 1) == (9, 11)


def test_rays_behind_a_fish_eye_are_radial_still():
    radius, angle = np.meshgrid(np.arange(1, 8) * 18.0 + 10, np.arange(18) * np.pi / 9)
    radius *= 1 - 0.3 * (radius / radius.max()) ** 2
    rays = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).reshape(-1, 2)
    assert find_layout(MIDDLE + rays).layout == "radial"


@pytest.mark.parametrize(("template", "n_missing"), [(rings(), 0), (scattered(), 8)])
def test_missing_pins_and_false_blobs_on_one_side_cost_no_names(template, n_missing):
    """Reflections shift the middle of what was found."""
    seen, rng = turned(template, 4), np.random.default_rng(1)
    kept = np.sort(rng.permutation(len(template))[n_missing:])
    false = np.array(MIDDLE) + np.array([170, 0]) + rng.uniform(-40, 40, (15 - n_missing, 2))
    position, present = match_layout(np.concatenate([seen[kept], false]), template, "a video")
    assert np.flatnonzero(present).tolist() == kept.tolist()
    assert np.hypot(*(position - seen).T).max() < 1


@given(
    degrees=st.floats(-175, 175),
    shift=st.tuples(st.floats(-30, 30), st.floats(-30, 30)),
    scale=st.floats(0.97, 1.03),
    seed=st.integers(0, 100),
)
@settings(max_examples=30, deadline=None)
def test_a_scattered_layout_keeps_its_names_however_it_is_turned(degrees, shift, scale, seed):
    template, rng = scattered(), np.random.default_rng(seed)
    seen = turned(MIDDLE + scale * (template - MIDDLE), degrees) + shift
    blobs = (seen + rng.normal(0, 0.5, seen.shape))[rng.permutation(len(seen))]
    position, present = match_layout(blobs, template, "a video")
    assert present.all()
    assert np.hypot(*(position - seen).T).max() < 3


@pytest.mark.parametrize("layout", [rings(), hexagonal()])
def test_symmetric_layouts_keep_their_names_at_small_turns(layout):
    seen = turned(layout, 8)
    position, present = match_layout(seen[::-1], layout, "a video")
    assert present.all()
    np.testing.assert_allclose(position, seen)


def sheared(layout, rng):
    """A layout whose places a smooth field moves, most along x, by a sixth of their spacing.

    Neighbours move alike by 0.7 to 0.9, and some come to touch: about what stays on the simulated
    rig at worst.
    """
    spacing = spacing_px(layout)
    moved = layout.copy()
    for _ in range(6):
        wave, phase = rng.normal(size=2) / (2.5 * spacing), rng.uniform(0, 6)
        size = spacing * np.array([0.09, 0.03]) * rng.normal(size=2)
        moved += size * np.sin(layout @ wave + phase)[:, None]
    return moved


@pytest.mark.parametrize("name", ["hex127", "hex331", "radial127"])
def test_markers_of_skin_drawn_out_of_shape_keep_their_names_or_are_refused(name):
    layout, refused = np.array(load_sensor(name).markers), 0
    for seed in range(4):
        seen = turned(sheared(layout, np.random.default_rng(seed)), 4) + np.array([12, -7])
        apart = cKDTree(seen).query(seen, k=2)[0][:, 1] > 0.62 * spacing_px(layout)
        try:
            position, _ = match_layout(seen[apart], layout, "a video")
        except InputError:
            refused += 1
            continue
        np.testing.assert_allclose(position[apart], seen[apart])
    assert refused <= 1


@pytest.mark.parametrize(
    ("name", "other"),
    [
        *(("hex127", other) for other in ("square", "radial127")),
        *(("radial127", other) for other in ("hex127", "hex331")),
        ("hex331", "square"),
    ],
)
def test_a_layout_that_has_a_marker_near_most_places_is_refused_too(name, other):
    seen = square(19, 19) if other == "square" else np.array(load_sensor(other).markers)
    with pytest.raises(InputError, match=r"a video: expected (markers where|the \d+ markers)"):
        match_layout(seen, np.array(load_sensor(name).markers), "a video")
