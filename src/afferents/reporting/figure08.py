"""Figure 8: SA-I tactile images, four textures at every speed and ten consecutive frames."""

from matplotlib.figure import Figure

from afferents.core.dims import PIXELS
from afferents.core.samples import Samples
from afferents.reporting.images import tactile_image_figure


def figure08(sa1_images: Samples, source: str, sliding: str = "+x") -> Figure:
    """Draw the displacement of every marker from rest, px; see `tactile_image_figure`."""
    title = "Figure 8. SA-I tactile images: displacement from rest"
    return tactile_image_figure(sa1_images, title, f"SA-I ({PIXELS})", source, sliding)
