"""Table 1, Figures 7 to 13 and one self-contained page, from results alone."""

from afferents.report.confusion import confusion_figure
from afferents.report.differences import differences, runs_side_by_side
from afferents.report.explanation import explanation_figure
from afferents.report.figure07 import FACTORS, StretchExample, figure07, stretch_example
from afferents.report.figure08 import figure08
from afferents.report.figure10 import figure10
from afferents.report.figure12 import figure12
from afferents.report.formats import to_markdown, to_rich
from afferents.report.html import headline, write_report
from afferents.report.inspection import markers_figure, responses_figure, vibration_figure
from afferents.report.overlay import draw_overlay, is_overlay, write_overlay
from afferents.report.pictures import FigureData, Picture, draw_pictures, save_pictures
from afferents.report.reliability import reliability_figure, reliability_table
from afferents.report.roughness import roughness_table
from afferents.report.speeds import speed_figure
from afferents.report.style import save_figure
from afferents.report.table import (
    Table,
    accuracy_by_speed,
    leak_sentences,
    leak_table,
    run_table,
    table1,
    touches_table,
)
from afferents.report.textures import write_texture_page
from afferents.report.unknown import texture_tables, unknown_by_texture, unknown_table

__all__ = [
    "FACTORS",
    "FigureData",
    "Picture",
    "StretchExample",
    "Table",
    "accuracy_by_speed",
    "confusion_figure",
    "differences",
    "draw_overlay",
    "draw_pictures",
    "explanation_figure",
    "figure07",
    "figure08",
    "figure10",
    "figure12",
    "headline",
    "is_overlay",
    "leak_sentences",
    "leak_table",
    "markers_figure",
    "reliability_figure",
    "reliability_table",
    "responses_figure",
    "roughness_table",
    "run_table",
    "runs_side_by_side",
    "save_figure",
    "save_pictures",
    "speed_figure",
    "stretch_example",
    "table1",
    "texture_tables",
    "to_markdown",
    "to_rich",
    "touches_table",
    "unknown_by_texture",
    "unknown_table",
    "vibration_figure",
    "write_overlay",
    "write_report",
    "write_texture_page",
]
