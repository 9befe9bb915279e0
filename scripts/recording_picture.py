"""Draw docs/images/recording-setup.png: what is wired to what.

python scripts/recording_picture.py docs/images/recording-setup.png
"""

import math
import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyBboxPatch, Rectangle, Wedge

INK, WIRE, RED = "#333333", "#2a6fb0", "#c0392b"


def box(axes: Axes, x: float, y: float, width: float, height: float, text: str, fill: str) -> None:
    """Draw a named thing."""
    style = "round,pad=0.06"
    axes.add_patch(FancyBboxPatch((x, y), width, height, boxstyle=style, fc=fill, ec=INK))
    axes.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=9)


def wire(axes: Axes, x: list[float], y: list[float]) -> None:
    """Draw a cable."""
    axes.plot(x, y, color=WIRE, lw=1.6)


def sensor(axes: Axes) -> None:
    """Draw fingertip and drum."""
    axes.add_patch(Circle((3.2, 1.75), 1.45, fc="#e3ddd2", ec=INK))
    axes.add_patch(Circle((3.2, 1.75), 0.12, fc=INK))
    for k in range(24):
        at = 2 * math.pi * k / 24
        bump = (3.2 + 1.45 * math.cos(at), 1.75 + 1.45 * math.sin(at))
        axes.add_patch(Circle(bump, 0.07, fc="#e3ddd2", ec=INK, lw=0.7))
    axes.text(3.2, 1.1, "drum", ha="center", fontsize=9)
    axes.add_patch(Rectangle((2.1, 4.2), 2.2, 2.6, fc="#f7f7f7", ec=INK))
    axes.add_patch(Wedge((3.2, 4.2), 1.1, 180, 360, fc="#444444", ec=INK))
    for k in range(-3, 4):
        away = 0.27 * k
        pin = (3.2 + away, 4.2 - math.sqrt(max(0.0, 0.86**2 - away**2)))
        axes.add_patch(Circle(pin, 0.06, fc="white", ec="white"))
    axes.text(3.2, 4.42, "gel, markers", ha="center", fontsize=8)
    box(axes, 2.55, 5.7, 1.3, 0.6, "camera", "#dbe8f5")
    for x in (2.3, 4.1):
        axes.add_patch(Circle((x, 5.35), 0.1, fc="#f2c14e", ec=INK))
    axes.text(1.95, 5.35, "LEDs", ha="right", va="center", fontsize=8.5)
    axes.add_patch(Circle((4.0, 4.1), 0.13, fc="#c0504d", ec=INK))
    axes.text(0.2, 7.2, "fingertip, held still and pressed on the drum", fontsize=9)


def main() -> None:
    """Draw it."""
    figure, axes = pyplot.subplots(figsize=(8.6, 3.9))
    axes.set(xlim=(0, 17.2), ylim=(0, 7.8), aspect="equal")
    axes.axis("off")
    sensor(axes)
    plain = "#eef2f7"
    box(axes, 7.4, 5.55, 3.4, 0.9, "USB port of its own", plain)
    box(axes, 7.4, 3.65, 3.4, 0.9, "sound input", plain)
    box(axes, 7.4, 1.3, 3.4, 0.9, "motor driver\n(board or servo)", plain)
    box(axes, 12.8, 2.9, 4.0, 2.3, "computer\nafferents record\none clock", "#e7f0e4")
    wire(axes, [3.91, 7.34], [6.0, 6.0])
    wire(axes, [4.13, 7.34], [4.1, 4.1])
    wire(axes, [4.65, 7.34], [1.75, 1.75])
    wire(axes, [10.86, 11.6, 11.6, 12.74], [6.0, 6.0, 4.7, 4.7])
    wire(axes, [10.86, 12.74], [4.1, 4.1])
    wire(axes, [10.86, 11.6, 11.6, 12.74], [1.75, 1.75, 3.4, 3.4])
    for x, y, text in (
        (5.8, 6.08, "frames"),
        (5.8, 4.18, "microphone"),
        (6.0, 1.83, "motor, encoder"),
        (12.6, 1.6, "USB or serial"),
    ):
        axes.text(x, y, text, fontsize=8.5, color=WIRE, ha="center", va="bottom")
    axes.add_patch(Circle((9.1, 0.45), 0.28, fc=RED, ec=INK))
    axes.plot([9.1, 9.1], [0.73, 1.24], color=RED, lw=1.6)
    axes.text(9.55, 0.45, "emergency stop, in the motor's power", va="center", fontsize=8.5)
    figure.savefig(sys.argv[1], dpi=130, bbox_inches="tight", metadata={"Software": "afferents"})


if __name__ == "__main__":
    main()
