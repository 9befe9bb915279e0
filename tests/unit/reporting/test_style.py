"""Figures look the same whatever a user has set."""

import matplotlib as mpl

from afferents.reporting.style import new_figure, png_bytes, styled


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
