"""One name a texture: the paper's letters where all are of its series, else the session's own."""

import pytest
from matplotlib.figure import Figure

from afferents.reporting.confusion import label_edges
from afferents.reporting.html import textures_line
from afferents.reporting.labels import source_line
from afferents.reporting.published import published_textures
from afferents.reporting.texture_names import (
    are_published,
    spacing_note,
    texture_axis,
    texture_label,
    texture_names,
)
from afferents.reporting.unknown import unknown_by_texture

ALL = list(published_textures())


@pytest.mark.parametrize(
    ("textures", "names", "note"),
    [
        (ALL, list("abcdefghijklm"), "a to m: bumps 0 to 6 mm apart"),
        (["0", "3", "6"], ["a", "g", "m"], "a, g, m: bumps 0, 3, 6 mm apart"),
        (["1", "1.5", "2", "2.5"], list("cdef"), "c to f: bumps 1 to 2.5 mm apart"),
        (["0", "3", "Linen"], ["0", "3", "Linen"], ""),
        (["0.7", "3"], ["0.7", "3"], ""),
    ],
)
def test_letters_only_where_all_textures_have_one(textures, names, note):
    assert list(texture_names(textures).values()) == names
    assert spacing_note(textures) == note


def test_only_all_thirteen_are_the_papers():
    assert are_published(ALL)
    assert not are_published(ALL[1:])


def test_an_axis_says_what_numbers_mean_and_no_more():
    assert texture_axis(ALL) == texture_axis(["Linen"]) == "texture"
    assert texture_axis(["0.7", "3"]) == "texture (bump spacing, mm)"
    assert (texture_label("4"), texture_label("Linen")) == ("i (4 mm)", "Linen")


def test_tables_figures_and_page_have_the_same_names(results):
    results.summary["textures"] = ALL
    assert "a to m: bumps 0 to 6 mm apart" in source_line(results.summary)
    assert textures_line(ALL).startswith("13: a, b, c, d")
    assert textures_line(ALL).count("mm") == 1
    assert textures_line(["Linen", "Silk"]) == "2: Linen, Silk"
    table = unknown_by_texture(results.summary | {"models": {}})
    assert table.columns[2:] == tuple("abcdefghijklm")
    assert table.caption.endswith("A to m: bumps 0 to 6 mm apart")


def test_ticks_of_a_confusion_matrix_are_these_names():
    for textures, names in ((["0", "0.5", "6"], ["a", "b", "m"]), (["0", "Linen"], ["0", "Linen"])):
        grid = Figure().subplots(1, 1, squeeze=False)
        label_edges(grid, textures)
        for labels in (grid[0, 0].get_xticklabels(), grid[0, 0].get_yticklabels()):
            assert [label.get_text() for label in labels] == names
