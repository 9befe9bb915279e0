"""Figures drawn as in the paper: `report --figures paper`.

Each says where it departs from the printed one: other textures or speeds because the session lacks
the paper's, a scale or an axis that is wrong in print.
"""

from afferents.reporting.paper.drums import DrumView, figure03
from afferents.reporting.paper.frames import FrameRow, frames_figure
from afferents.reporting.paper.matrices import matrices_figure
from afferents.reporting.paper.networks import DrawnLayer, DrawnNetwork, networks_figure
from afferents.reporting.paper.pictures import PaperData, draw_paper_pictures
from afferents.reporting.paper.spectra import spectra_figure
from afferents.reporting.paper.stand_ins import PANELS, Shown, shown_for

__all__ = [
    "PANELS",
    "DrawnLayer",
    "DrawnNetwork",
    "DrumView",
    "FrameRow",
    "PaperData",
    "Shown",
    "draw_paper_pictures",
    "figure03",
    "frames_figure",
    "matrices_figure",
    "networks_figure",
    "shown_for",
    "spectra_figure",
]
