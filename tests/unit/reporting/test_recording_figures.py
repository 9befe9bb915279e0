"""Pictures of recordings: rings, amplitudes and lost markers as given, in one style."""

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr

from afferents.reporting.overlay import draw_overlay
from afferents.reporting.recording_figures import markers_figure, vibration_figure
from afferents.reporting.style import new_figure, png_bytes, save_figure, styled


@pytest.mark.parametrize("apart_px", [15, 120])
def test_rings_round_markers_stand_apart_and_round_them_in_any_picture(apart_px, tmp_path):
    x, y = np.meshgrid(np.arange(6), np.arange(6))
    position = 300 + apart_px * np.stack([x.ravel(), y.ravel()], axis=1).astype(float)
    seen = np.ones(36, dtype=bool)
    figure = markers_figure(np.zeros((1080, 1920), np.uint8), position, seen, "a.avi")
    save_figure(figure, tmp_path / "markers.png")
    (rings,) = figure.axes[0].collections
    apart_dots = np.diff(figure.axes[0].transData.transform(position[:2])[:, 0])[0]
    ring_dots = rings.get_sizes()[0] ** 0.5 * figure.dpi / 72
    assert 0.6 * apart_dots < ring_dots < 0.8 * apart_dots
    assert ring_dots > 4 * rings.get_linewidths()[0] * figure.dpi / 72


@pytest.mark.parametrize("n_channels", [1, 3])
def test_vibration_spectrum_has_the_amplitude_of_the_tone_at_its_frequency(n_channels):
    tone = 0.3 * np.sin(2 * np.pi * 50 * np.arange(1000) / 1000)
    segment = xr.DataArray(
        np.tile(tone[:, None], (1, n_channels)).astype(np.float32),
        dims=("audio_time", "channel"),
        attrs={"sample_rate_hz": 1000.0, "units": "full scale"},
    )
    figure = vibration_figure(segment, "audio.wav")
    frequency, amplitude = figure.axes[1].lines[-1].get_xydata().T
    assert frequency[amplitude.argmax()] == pytest.approx(50)
    assert amplitude.max() == pytest.approx(0.3, rel=1e-5)
    assert "full scale" in figure.axes[1].get_ylabel()
    figure.draw_without_rendering()
    labels = [label.get_text() for label in figure.axes[1].get_xticklabels()]
    assert "10" in labels
    assert not any("$" in label for label in labels)  # a formula, which the style does not set


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


def test_figures_begin_from_defaults_whatever_a_user_has_set():
    @styled
    def drawn():
        figure = new_figure(3, 2, "a title", "a source")
        figure.subplots().plot([0, 1], label="$_a")
        return figure

    usual = png_bytes(drawn())
    own = {"text.usetex": True, "savefig.bbox": "tight", "lines.linestyle": ":", "font.size": 30}
    with mpl.rc_context(own):
        assert png_bytes(drawn()) == usual
        assert mpl.rcParams["font.size"] == 30
