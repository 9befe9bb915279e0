"""A video with its markers drawn in."""

import numpy as np

from afferents.reporting.overlay import draw_overlay


def is_red(picture):
    blue, green, red = np.moveaxis(picture.astype(int), -1, 0)
    return (red > 150) & (green < 90) & (blue < 90)


def test_a_lost_marker_is_red_where_it_was_last_seen():
    """Two markers slide right for 30 frames; the second is lost from frame 20 on."""
    last = np.array([[30.0, 40.0], [30.0, 90.0]])[None] + np.arange(30)[:, None, None] * (1.0, 0.0)
    detected = np.ones((30, 2), bool)
    detected[20:, 1] = False
    last[20:, 1] = last[19, 1]
    image = np.full((120, 160), 60, np.uint8)
    before, after = (draw_overlay(image, last, detected, i) for i in (19, 25))
    assert not is_red(before).any()
    red = np.argwhere(is_red(after))
    x, y = 2 * last[19, 1] + 0.5
    assert np.abs(red.mean(axis=0) - (y, x)).max() < 8
