"""Figure 10: RA-I tactile images, four textures at every speed and ten consecutive frames."""

from matplotlib.figure import Figure

from afferents.core.dims import PIXELS_PER_FRAME
from afferents.core.samples import Samples
from afferents.reporting.images import tactile_image_figure


def figure10(ra1_images: Samples, source: str, sliding: str = "+x") -> Figure:
    """Draw the change of SA-I of every marker, px a frame; see `tactile_image_figure`."""
    title = "Figure 10. RA-I tactile images: change of SA-I from frame to frame"
    return tactile_image_figure(ra1_images, title, f"RA-I ({PIXELS_PER_FRAME})", source, sliding)
