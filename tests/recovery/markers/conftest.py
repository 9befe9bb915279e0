"""A drawn fingertip of 19 x 19 markers whose every position is known."""

from functools import partial

import numpy as np
import pytest

from ...unit.markers.conftest import MemoryVideo, draw_discs

draw_markers = partial(draw_discs, shape=(480, 640), radius=6.3, skin=25, marker=220)
"""Discs of 125 px^2, in the middle of what the published detector takes."""


@pytest.fixture
def draw():
    return draw_markers


@pytest.fixture
def video():
    """Return what makes a video of positions (time, marker, space), px."""
    return lambda truth: MemoryVideo([draw_markers(position) for position in truth])


@pytest.fixture
def rest() -> np.ndarray:
    """Return rest positions in row-major order, rolled by 6.2 degrees, each a fraction off."""
    x, y = np.meshgrid(22.0 * np.arange(-9, 10), 22.0 * np.arange(-9, 10))
    angle = np.radians(6.2)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    fraction = np.random.default_rng(3).uniform(-0.5, 0.5, (361, 2))
    return np.stack([x.ravel(), y.ravel()], axis=1) @ turn + [320, 238] + fraction
