"""Table 1, Figures 7 to 13 and one self-contained page, from results alone."""

from afferents.reporting.beside_paper import beside_paper
from afferents.reporting.by_texture import by_texture_figure, by_texture_table
from afferents.reporting.by_touch import by_touch_table
from afferents.reporting.confusion import confusion_figure
from afferents.reporting.differences import differences, runs_side_by_side
from afferents.reporting.explanation import explanation_figure
from afferents.reporting.figure07 import FACTORS, StretchExample, figure07, stretch_example
from afferents.reporting.figure12 import figure12
from afferents.reporting.formats import to_markdown
from afferents.reporting.html import write_report
from afferents.reporting.images import figure08, figure10
from afferents.reporting.in_short import headline, what_was_lost
from afferents.reporting.inspection import markers_figure, responses_figure, vibration_figure
from afferents.reporting.lengths import lengths_table
from afferents.reporting.overlay import draw_overlay, is_overlay, write_overlay
from afferents.reporting.pictures import FigureData, ReportFigure, draw_pictures, save_pictures
from afferents.reporting.reliability import reliability_figure, reliability_table
from afferents.reporting.roughness import roughness_table
from afferents.reporting.shear import ShearFigure, shear_figure, shear_tables
from afferents.reporting.speeds import speed_figure
from afferents.reporting.steadiness import steadiness_figure, steadiness_sentence
from afferents.reporting.style import save_figure
from afferents.reporting.table import (
    Table,
    accuracy_by_speed,
    leak_sentences,
    leak_table,
    run_table,
    table1,
)
from afferents.reporting.texture_names import are_published
from afferents.reporting.textures import write_texture_page
from afferents.reporting.touches import touches_table
from afferents.reporting.unknown import texture_tables, unknown_by_texture, unknown_table

__all__ = [
    "FACTORS",
    "FigureData",
    "ReportFigure",
    "ShearFigure",
    "StretchExample",
    "Table",
    "accuracy_by_speed",
    "are_published",
    "beside_paper",
    "by_texture_figure",
    "by_texture_table",
    "by_touch_table",
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
    "lengths_table",
    "markers_figure",
    "reliability_figure",
    "reliability_table",
    "responses_figure",
    "roughness_table",
    "run_table",
    "runs_side_by_side",
    "save_figure",
    "save_pictures",
    "shear_figure",
    "shear_tables",
    "speed_figure",
    "steadiness_figure",
    "steadiness_sentence",
    "stretch_example",
    "table1",
    "texture_tables",
    "to_markdown",
    "touches_table",
    "unknown_by_texture",
    "unknown_table",
    "vibration_figure",
    "what_was_lost",
    "write_overlay",
    "write_report",
    "write_texture_page",
]
