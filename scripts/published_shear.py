"""How much of the published tactile images could be global shear: `published_shear.py IMAGES`.

IMAGES is the file of digitised images (`tactile_images.npz`): of textures a (smooth) and g (bumps
3 mm apart), ten images 20 frames apart for each panel of Figures 8 and 10, lengths without
directions, in shares of a figure's range of colours. A global shear, u(r) = t + G r, makes a length
that is smooth over the skin, |u|: its square is a polynomial of second order in the place. So what
of the squared images such a polynomial leaves unexplained is no global shear; what it explains may
be. Noise of each marker adds to what is unexplained.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
SIZE = 19


def polynomials(order: int) -> Floats:
    """Return an orthonormal basis (pixel, term) of polynomials up to an order."""
    y, x = (axis.ravel() / (SIZE - 1) * 2 - 1 for axis in np.indices((SIZE, SIZE)))
    terms = [x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)]
    return np.asarray(np.linalg.qr(np.stack(terms, axis=1))[0])


def explained(images: Floats, order: int) -> float:
    """Return the share of the variance within images that polynomials explain, 0 to 1.

    What is left holds so many degrees of freedom fewer, which is allowed for.
    """
    flat = images.reshape(len(images), -1)
    flat = flat - flat.mean(axis=1, keepdims=True)
    basis = polynomials(order)
    left = np.square(flat - flat @ basis @ basis.T).sum() / (SIZE**2 - basis.shape[1])
    return float(1 - left / (np.square(flat).sum() / (SIZE**2 - 1)))


def over_time(images: Floats) -> tuple[float, float]:
    """Return the deviation over time, and the share of its variance in the images' mean level."""
    varying = images - images.mean(axis=0)
    total = np.square(varying).sum() / (len(images) - 1) / SIZE**2
    level = np.square(varying.mean(axis=(1, 2))).sum() / (len(images) - 1)
    return float(total**0.5), float(level / total)


def main() -> None:
    """Print a row for each panel of the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("images", type=Path)
    published = np.load(parser.parse_args().images)
    intensity = published["intensity_recovered"].astype(float)
    panel = [published[name] for name in ("figure", "afferent", "texture", "speed_mm_s")]
    print(
        "figure      mm/s  mean  explained: 1st  2nd order (squared)  over time: sd  in the level"
    )
    for key in dict.fromkeys(zip(*(name.tolist() for name in panel), strict=True)):
        figure, afferent, texture, speed = key
        of_panel = np.all([name == one for name, one in zip(panel, key, strict=True)], axis=0)
        images = intensity[of_panel]
        deviation, level = over_time(images)
        print(
            f"{figure:3s} {afferent} {texture} {speed:6d}  {images.mean():.2f}  "
            f"{100 * explained(images, 1):13.0f}%  {100 * explained(images**2, 2):19.0f}%  "
            f"{deviation:13.2f}  {100 * level:11.0f}%"
        )
    for title in ("8A", "10A"):
        smooth, bumpy = (
            intensity[(published["figure"] == title) & (published["texture"] == texture)]
            for texture in ("a", "g")
        )
        change = bumpy.mean(axis=0) - smooth.mean(axis=0)
        share = change.mean() ** 2 / np.square(change).mean()
        print(
            f"{title}, g less a at 50 mm/s: level {change.mean():+.2f}, which is "
            f"{100 * share:.0f}% of the mean square of the difference"
        )


if __name__ == "__main__":
    main()
