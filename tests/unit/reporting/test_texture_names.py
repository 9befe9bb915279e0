"""One name a texture: the paper's letters where all are of its series, else the session's own."""

import pytest
from matplotlib.figure import Figure

from afferents.reporting.confusion import label_edges
from afferents.reporting.html import textures_line
from afferents.reporting.labels import (
    are_published,
    source_line,
    spacing_note,
    texture_axis,
    texture_labels,
    texture_names,
)
from afferents.reporting.published import published_textures
from afferents.reporting.textures import unknown_by_texture

ALL = list(published_textures())
NAMED = {"named_by_spacing": True}


def summary_of(textures):
    return {"textures": list(textures), **NAMED}


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
    assert list(texture_names(textures, NAMED).values()) == names
    assert spacing_note(summary_of(textures)) == note


@pytest.mark.parametrize("textures", [ALL, ["0", "1", "2", "3", "4", "5"]])
def test_where_nothing_says_that_they_are_spacings_numbers_are_names(textures):
    """Somebody's own plates, 0 to 5, are no drums of the paper."""
    own = {"textures": textures}
    assert list(texture_names(textures, own).values()) == textures
    assert list(texture_labels(textures, own).values()) == textures
    assert spacing_note(own) == ""
    assert texture_axis(textures, own) == "texture"
    assert not are_published(own)
    assert textures_line(own) == f"{len(textures)}: {', '.join(textures)}"


def test_only_all_thirteen_are_the_papers():
    assert are_published(summary_of(ALL))
    assert not are_published(summary_of(ALL[1:]))


def test_an_axis_says_what_numbers_mean_and_no_more():
    assert texture_axis(ALL, NAMED) == texture_axis(["Linen"], NAMED) == "texture"
    assert texture_axis(["0.7", "3"], NAMED) == "texture (bump spacing, mm)"
    assert texture_labels(["4"], NAMED) == {"4": "i (4 mm)"}
    assert texture_labels(["4", "Linen"], NAMED) == {"4": "4", "Linen": "Linen"}


def test_tables_figures_and_page_have_the_same_names(results):
    results.summary["textures"] = ALL
    assert "a to m: bumps 0 to 6 mm apart" in source_line(results.summary)
    assert textures_line(summary_of(ALL)).startswith("13: a, b, c, d")
    assert textures_line(summary_of(ALL)).count("mm") == 1
    assert textures_line(summary_of(["Linen", "Silk"])) == "2: Linen, Silk"
    table = unknown_by_texture(results.summary | {"models": {}})
    assert table.columns[2:] == tuple("abcdefghijklm")
    assert table.caption.endswith("A to m: bumps 0 to 6 mm apart")


def test_ticks_of_a_confusion_matrix_are_these_names():
    for textures, names in ((["0", "0.5", "6"], ["a", "b", "m"]), (["0", "Linen"], ["0", "Linen"])):
        grid = Figure().subplots(1, 1, squeeze=False)
        label_edges(grid, textures, NAMED)
        for labels in (grid[0, 0].get_xticklabels(), grid[0, 0].get_yticklabels()):
            assert [label.get_text() for label in labels] == names
