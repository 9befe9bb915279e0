"""Films of images that tests draw."""

from fractions import Fraction

import av
import numpy as np


def write_film(
    path,
    images,
    codec="libx264",
    pixels="yuv420p",
    rate=90,
    at_ms=None,
    options=None,
    form="gray",
    container_options=None,
):
    """Encode images, one a frame, or at these times (ms); return the path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    images = [np.ascontiguousarray(image) for image in images]
    with av.open(str(path), "w", options=container_options or {}) as container:
        stream = container.add_stream(codec, rate=rate, options=options or {})
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = pixels
        if at_ms is not None:
            stream.time_base = stream.codec_context.time_base = Fraction(1, 1000)
        for number, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(image, format=form)
            if at_ms is not None:
                frame.pts, frame.time_base = int(at_ms[number]), Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def make_images(path):
    """Return the grey images of a film."""
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="gray") for frame in container.decode(video=0)]
