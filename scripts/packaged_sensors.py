"""Write the packaged sensor files of layouts that are not square.

    python scripts/packaged_sensors.py src/afferents/markers/sensors

Rows of a hexagonal layout, or rings of a radial one, as a camera on the axis sees them that is not
turned. The pins stand in their files because that is what a sensor file says: where markers are.
"""

import math
import sys
from pathlib import Path

import numpy as np

PX_PER_MM = 18.3
MIDDLE_PX = (319.5, 239.5)
ABOUT = """\
# A TacTip-like fingertip with a {layout} layout, as the simulated rig has it; none was
# measured.
# {n} pins are known from the TacTip family (Ward-Cherrier et al., Soft Robotics 2018; Lepora, IEEE
# Sensors Journal 2021). Assumed: that they lie on a flat disc, {shape}, {pitch:g} mm
# apart, so that they cover about as much of a drum as those of tip_b; and the camera, detector and
# size of the markers of tip_b ({scale:g} px/mm).
# Lengths are in px of the camera image, so they hold for this image size alone.
"""
REST = """
[detector]              # of OpenCV's SimpleBlobDetector, as tip_b's
blob_colour = 255
min_threshold = 50.0
max_threshold = 150.0
threshold_step = 10.0
min_repeatability = 2
min_distance_px = 10.0
min_area_px2 = 95.0
max_area_px2 = 180.0
min_circularity = 0.25
min_convexity = 0.58
min_inertia_ratio = 0.16
"""


def hexagonal(rings: int) -> np.ndarray:
    """Return pins (n, 2) of a hexagon with so many rings round the middle, row by row."""
    pins = []
    for row in range(-rings, rings + 1):
        n = 2 * rings + 1 - abs(row)
        pins += [(i - (n - 1) / 2, row * math.sqrt(3) / 2) for i in range(n)]
    return np.array(pins)


def radial(rings: int) -> np.ndarray:
    """Return pins (n, 2) on rings of 6, 12, 18, ... round the middle, from the inside out."""
    pins = [(0.0, 0.0)]
    for ring in range(1, rings + 1):
        angles = 2 * math.pi * np.arange(6 * ring) / (6 * ring)
        pins += [(ring * math.cos(a), ring * math.sin(a)) for a in angles]
    return np.array(pins)


SENSORS = {
    "hex127": ("hexagonal", "in a hexagon", hexagonal(6), 1.8),
    "hex331": ("hexagonal", "in a hexagon", hexagonal(10), 1.1),
    "radial127": ("radial", "on six rings", radial(6), 1.8),
}


def sensor_file(name: str) -> str:
    """Return a sensor file."""
    layout, shape, pins, pitch = SENSORS[name]
    n, px = len(pins), np.asarray(MIDDLE_PX) + pins * pitch * PX_PER_MM
    lines = [
        ABOUT.format(layout=layout, n=n, shape=shape, pitch=pitch, scale=PX_PER_MM),
        f'name = "{name}"',
        f'layout = "{layout}"',
        f"n_markers = {n}",
        f"pitch_mm = {pitch}",
        "width = 640",
        "height = 480",
        "radius_px = 300.0       # markers farther than this from the centroid are left out",
        "gate_px = 10.0          # a marker moves at most this far from one frame to the next",
        "rest_frame = 10         # index of the frame that shows the skin at rest",
        "# Where the markers are at rest, in the order that they keep.",
        "markers = [",
        *(f"  [{x + 0.0:.1f}, {y + 0.0:.1f}]," for x, y in px),
        "]",
    ]
    return "\n".join(lines) + "\n" + REST


if __name__ == "__main__":
    for sensor in SENSORS:
        (Path(sys.argv[1]) / f"{sensor}.toml").write_text(sensor_file(sensor))
