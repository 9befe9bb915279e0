"""What is drawn in a terminal: every model's evidence as bars, or what comes in."""

import time
from collections.abc import Iterable
from functools import lru_cache

import cv2
import numpy as np
from rich.color import Color
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.style import Style
from rich.table import Table
from rich.text import Text

from afferents.dims import RA1, SA1
from afferents.lab.live import reporters, streams
from afferents.lab.live.pipeline import LivePipeline
from afferents.lab.live.prediction import Newest, Prediction
from afferents.lab.live.touch import Pixels, colour_image

EVERY_S = 0.1
"""Time between two pictures."""
_BAR = 24
_AT_ONCE_S = 0.05
"""What would be printed as 0.0 s."""
_MOST = 13
"""Textures shown, the likeliest."""
_MOST_COLUMNS, _FEWEST_COLUMNS = 64, 16
"""Widths that a picture of the camera may have, in characters."""
_HEIGHT_SHARE = 0.55
_WORDS = 13
"""Of the terminal's lines that pictures take at most, and how many they leave to words."""
_BARS = " ▁▂▃▄▅▆▇█"
_AMBER = (255, 176, 0)
_EDGE_PX = 32
"""The camera's picture is cut off round the markers, at multiples of this, px."""
_LEAST_PX = 0.5
"""Tactile images are drawn from 0 to their 99th percentile, but to this at least: one marker that
is found in the wrong place does not dim all others."""


def show(predictions: Iterable[Prediction], pipeline: LivePipeline) -> None:
    """Draw predictions as they come, until they end."""
    screen = Screen(pipeline)
    drawn_s = 0.0
    console = Console(highlight=False, markup=False)
    with Live(console=console, auto_refresh=False) as live:
        for prediction in predictions:
            screen.take(prediction)
            if time.monotonic() - drawn_s > EVERY_S:
                drawn_s = time.monotonic()
                live.update(screen.draw(console), refresh=True)
        live.update(screen.draw(console), refresh=True)  # the last, however quickly it came


class Screen(Newest):
    """Draws the evidence of every model as bars; without models, pictures of what comes in.

    Parameters
    ----------
    pipeline
        That makes the predictions.
    """

    def __init__(self, pipeline: LivePipeline) -> None:
        """Nothing has come yet."""
        super().__init__()
        self._pipeline = pipeline

    def draw(self, console: Console) -> RenderableType:
        """Return the picture as it is now; without colours, in words alone."""
        latest = [prediction for prediction, _ in self.predictions.values()]
        most_sure = {
            reporter.name: reporter.card.most_sure
            for _, reporter in self._pipeline.reporters
            if isinstance(reporter, reporters.ModelReporter) and reporter.textures
        }
        if most_sure:
            known = [p for p in latest if p.model in most_sure]
            return Group(*(_draw_bars(p, most_sure[p.model]) for p in known))
        parts: list[RenderableType] = []
        video, audio = self._pipeline.video, self._pipeline.audio
        if video is not None:
            if console.color_system is not None:
                parts.append(_draw_views(video, console))
            parts.append(Text(video.follower.describe()))
        if audio is not None:
            parts.append(_draw_spectrum(audio, console.width))
        figures = [f for one in (video, audio) if one is not None for f in one.quality.figures()]
        values = (Text(f"{f.name} {f.value}", "bold" if f.issue else "") for f in figures)
        parts.append(Text(" · ").join(values))
        parts += [Text(f.issue, style="yellow") for f in figures if f.issue]
        for prediction in latest:
            line = f"{prediction.model}: {prediction.state}"
            line += f" (it is {prediction.truth})" if prediction.truth else ""
            faults = describe_faults(prediction)
            parts.append(Text(f"{line}, {faults}" if faults else line, style="dim"))
        return Group(*parts)


def describe_faults(prediction: Prediction) -> str:
    """Return latency, faults and troubles in a line."""
    latency_ms = prediction.latency_ms
    parts = [] if latency_ms is None else [f"latency {latency_ms:.1f} ms"]
    parts += [
        f"{count} {name.replace('_', ' ').removesuffix('s' if count == 1 else '')}"
        for name, count in vars(prediction.counters).items()
        if count and name not in ("frames", "samples")
    ]
    return ", ".join([*parts, *prediction.troubles])


def _draw_bars(prediction: Prediction, most_sure: float) -> RenderableType:
    """Return a model's evidence as bars."""
    after_s, evidence = prediction.sure_after_s, prediction.evidence
    sure = "" if after_s is None else f", sure after {after_s:.1f} s"
    if after_s is not None and after_s < _AT_ONCE_S:
        sure = ", sure at once"
    state = (prediction.fresh and prediction.texture) or prediction.state
    truth = f" (it is {prediction.truth})" if prediction.truth else ""
    title = Text(f"{prediction.model}: {state}{sure}{truth}")
    table = Table(box=None, show_header=False, title=title, title_justify="left")
    likeliest = sorted(evidence, key=evidence.__getitem__, reverse=True)[:_MOST]
    for texture in evidence:
        if texture not in likeliest:
            continue
        now, all_in_all = prediction.probabilities.get(texture), evidence[texture]
        share = "" if now is None else f"{100 * min(now, most_sure):3.0f}% now"
        bar = "█" * round(_BAR * all_in_all)
        table.add_row(texture, f"{bar:<{_BAR}}", f"{100 * all_in_all:3.0f}%", share)
    return Group(table, Text(describe_faults(prediction), style="dim"))


def _draw_views(video: streams.VideoStream, console: Console) -> RenderableType:
    """Return camera, SA-I and RA-I side by side, as large as fits."""
    views = Table(box=None, show_header=True, header_style="dim", padding=(0, 2, 0, 0))
    cells: list[RenderableType] = []
    lines = max(6, min(int(_HEIGHT_SHARE * console.height), console.height - _WORDS))
    left, newest = console.width - 2, video.newest
    for title, name in (("SA-I", SA1), ("RA-I", RA1)):
        image = None if newest is None else newest.image(name)
        if image is not None:
            assert newest is not None
            most = max(float(np.percentile(image, 99)), _LEAST_PX)
            step = -(-image.shape[0] // (2 * lines))  # rows left out where there are too many
            scaled = colour_image(image[::step, ::step], most)
            views.add_column(f"{title}, 0-{most:.1f} {newest.touch.now.unit}")
            cells.append(_draw_blocks(scaled))
            left -= max(scaled.shape[1], 14) + 2
    if video.picture is not None and left >= _FEWEST_COLUMNS:
        picture = _shrink_picture(video, min(left, _MOST_COLUMNS), 2 * lines)
        views.add_column("camera")
        cells.append(_draw_blocks(picture))
    views.add_row(*cells)
    return views


def _shrink_picture(video: streams.VideoStream, columns: int, lines: int) -> Pixels:
    """Return where the camera sees markers, small, with those found on it: (line, column, 3)."""
    assert video.picture is not None
    grey = video.picture.frame.image
    touch = None if video.newest is None else video.newest.touch
    found = np.empty((0, 2)) if touch is None else touch.seen[touch.detected]
    if len(found):
        corner = np.maximum(found.min(axis=0).astype(int) // _EDGE_PX - 1, 0) * _EDGE_PX
        far = (found.max(axis=0).astype(int) // _EDGE_PX + 2) * _EDGE_PX
        grey, found = grey[corner[1] : far[1], corner[0] : far[0]], found - corner
    scale = min(columns / grey.shape[1], lines / grey.shape[0])
    size = max(1, round(scale * grey.shape[1])), max(2, round(scale * grey.shape[0]))
    small = np.repeat(cv2.resize(grey, size, interpolation=cv2.INTER_AREA)[..., None], 3, axis=2)
    at = np.rint((found + 0.5) * scale - 0.5).astype(int)
    x, y = np.clip(at, 0, np.array(size) - 1).T
    small[y, x] = 0.4 * small[y, x] + 0.6 * np.array(_AMBER)
    return np.asarray(small, np.uint8)


def _draw_blocks(pixels: Pixels) -> Text:
    """Return pixels as half blocks, two of them a character."""
    if len(pixels) % 2:
        pixels = np.concatenate([pixels, np.zeros_like(pixels[:1])])
    text = Text(no_wrap=True)
    coarse = pixels & 0xF8  # fewer colours, so that styles are found again
    for upper, lower in zip(coarse[::2].tolist(), coarse[1::2].tolist(), strict=True):
        for above, below in zip(upper, lower, strict=True):
            text.append("▀", _make_style(tuple(above), tuple(below)))
        text.append("\n")
    text.rstrip()
    return text


@lru_cache(maxsize=1 << 14)
def _make_style(above: tuple[int, int, int], below: tuple[int, int, int]) -> Style:
    return Style(color=Color.from_rgb(*above), bgcolor=Color.from_rgb(*below))


def _draw_spectrum(audio: streams.AudioStream, width: int) -> RenderableType:
    """Return the newest spectrum as a row of bars."""
    spectrum = audio.spectrum()
    if spectrum is None:
        return Text("spectrum: a window is not full yet", style="dim")
    amplitude, step_hz = spectrum
    columns = max(8, min(width - 2, 78, len(amplitude)))
    heights = [float(part.max()) for part in np.array_split(amplitude[1:], columns)]
    most = max(max(heights), 1e-12)
    bars = "".join(_BARS[round((len(_BARS) - 1) * height / most)] for height in heights)
    end = f"{(len(amplitude) - 1) * step_hz:.0f} Hz"
    return Group(
        Text("spectrum of the last window", style="dim"),
        Text(bars, no_wrap=True),
        Text(f"0{end:>{columns - 1}}", style="dim", no_wrap=True),
    )
