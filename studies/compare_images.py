"""Which operator makes tactile images of any layout best: a table against the rig's truth.

    python studies/compare_images.py

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.

The truth is the skin itself: a sheet of nodes 0.6 mm apart, simulated once a drum. What markers of
each layout show of it is read off where they stand, with the noise of tracking; what an image ought
to show is read off where its pixels lie. An operator makes the image of the markers. Its error is
the root mean square over pixels inside the markers' hull, over frames and drums, in percent of the
root mean square of what ought to be there (SA-I less each pixel's mean over time, which is the
part that tells textures apart; RA-I as it is).
"""

import argparse
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CloughTocher2DInterpolator, RBFInterpolator, RectBivariateSpline
from scipy.spatial import Delaunay, cKDTree

from afferents.markers.places import image_places, image_shape
from afferents.markers.sensor import load_sensor
from afferents.rig import Rig, Skin, bumped_surface
from afferents.rig.run import simulate_run
from afferents.rig.sensor_rig import rig_of

Floats = NDArray[np.float64]
Operator = Callable[[Floats, Floats], Floats]
"""From places of markers (n, 2) and of pixels (m, 2) to a matrix (m, n)."""

SIDE, PITCH_MM = 39, 0.6
NOISE_PX = 0.08
"""Of a marker as it is tracked in the rig's videos, in x and in y."""
SECONDS, FIRST = 2.6, 150
LAYOUTS = ("hex127", "radial127", "hex331")


def nearest(markers: Floats, pixels: Floats) -> Floats:
    """Return what takes the nearest marker's value."""
    return np.eye(len(markers))[cKDTree(markers).query(pixels)[1]]


def linear(markers: Floats, pixels: Floats) -> Floats:
    """Return barycentric weights in the Delaunay triangle; the nearest marker outside."""
    mesh = Delaunay(markers)
    at = mesh.find_simplex(pixels)
    way = mesh.transform[at, :2] @ (pixels - mesh.transform[at, 2])[..., None]
    weight = np.concatenate([way[..., 0], 1 - way[..., 0].sum(axis=1, keepdims=True)], axis=1)
    matrix = np.zeros((len(pixels), len(markers)))
    np.put_along_axis(matrix, mesh.simplices[at], weight, axis=1)
    return np.where((at >= 0)[:, None], matrix, nearest(markers, pixels))


def natural(markers: Floats, pixels: Floats) -> Floats:
    """Return Sibson's weights: what each pixel would take of the markers' cells, by counting."""
    tree = cKDTree(markers)
    step = np.median(tree.query(markers, k=2)[0][:, 1]) / 24
    x, y = (np.arange(markers[:, i].min(), markers[:, i].max(), step) for i in (0, 1))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    far, owner = tree.query(points)
    matrix = np.zeros((len(pixels), len(markers)))
    for row, pixel in zip(matrix, pixels, strict=True):
        taken = np.hypot(*(points - pixel).T) < far
        np.add.at(row, owner[taken], 1.0)
    total = matrix.sum(axis=1, keepdims=True)
    return np.where(total > 0, matrix / np.maximum(total, 1), nearest(markers, pixels))


def clough_tocher(markers: Floats, pixels: Floats) -> Floats:
    """Return a smooth cubic in each triangle; the nearest marker outside."""
    matrix = CloughTocher2DInterpolator(markers, np.eye(len(markers)))(pixels)
    return np.where(np.isnan(matrix), nearest(markers, pixels), matrix)


def spline(neighbours: int | None, smoothing: float = 0.0) -> Operator:
    """Return thin-plate splines through so many neighbours of each pixel, or through all."""

    def operator(markers: Floats, pixels: Floats) -> Floats:
        basis = np.eye(len(markers))
        found = RBFInterpolator(markers, basis, neighbors=neighbours, smoothing=smoothing)
        return np.asarray(found(pixels))

    return operator


OPERATORS: dict[str, Operator] = {
    "nearest": nearest,
    "linear (Delaunay)": linear,
    "natural neighbour": natural,
    "Clough-Tocher": clough_tocher,
    "thin plate, 6 neighbours": spline(6),
    "thin plate, 12 neighbours": spline(12),
    "thin plate, 20 neighbours": spline(20),
    "thin plate, all": spline(None),
    "thin plate, all, smoothed": spline(None, 0.3),
}


def sheet() -> tuple[Rig, Floats]:
    """Return a rig with a skin finer than any layout, and where nodes stand along one axis."""
    axis = (np.arange(SIDE) - (SIDE - 1) / 2) * PITCH_MM
    y, x = np.meshgrid(axis, axis, indexing="ij")
    pins = tuple(map(tuple, np.stack([x.ravel(), y.ravel()], axis=1).round(3).tolist()))
    return Rig(skin=Skin(pins_mm=pins)), axis


def displacement_px(texture: float, speed: float, px_per_mm: float) -> NDArray[np.float64]:
    """Return how far each node of the sheet is from rest, (frame, y, x, 2), px."""
    rig, _ = sheet()
    run = simulate_run(rig, f"{texture:g}", bumped_surface(texture), speed, SECONDS, seed=1)
    moved = (run.position_mm - rig.skin.rest_mm()) * px_per_mm
    return moved[FIRST:].reshape(-1, SIDE, SIDE, 2)


def shown_at(field: NDArray[np.float64], places_mm: Floats) -> NDArray[np.float64]:
    """Return the displacement (frame, place, 2) at places (n, 2) that lie on the sheet."""
    _, axis = sheet()
    x, y = np.clip(places_mm, axis[0], axis[-1]).T
    values = [
        [RectBivariateSpline(axis, axis, frame[..., i]).ev(y, x) for i in (0, 1)] for frame in field
    ]
    return np.moveaxis(np.array(values), 1, 2)


def sa1_and_ra1(moved: NDArray[np.float64]) -> tuple[Floats, Floats]:
    """Return SA-I (frame, place), its mean over time taken away, and RA-I, px."""
    sa1 = np.hypot(moved[..., 0], moved[..., 1])
    return sa1 - sa1.mean(axis=0), np.abs(np.diff(sa1, axis=0))


def pixels_of(pins: Floats) -> tuple[Floats, tuple[int, int]]:
    """Return where the pixels of a layout's image lie, (pixel, 2), and rows and columns of it."""
    row, column = image_places(pins)
    shape = image_shape(row, column)
    rows, columns = np.indices(shape)
    size = np.ptp(pins, axis=0) / (np.ptp(column), np.ptp(row))
    middle = (pins.min(axis=0) + pins.max(axis=0)) / 2 / size
    place = np.stack([columns - (shape[1] - 1) / 2, rows - (shape[0] - 1) / 2], axis=-1)
    return (place.reshape(-1, 2) + middle) * size, shape


def off(found: Floats, true: Floats) -> float:
    """Return the error in percent of what ought to be there."""
    return float(100 * np.sqrt(((found - true) ** 2).mean() / (true**2).mean()))


def table(drums: list[NDArray[np.float64]]) -> str:
    """Return the errors of every operator as a table in Markdown."""
    rng = np.random.default_rng(0)
    head = [f"{layout}, {what}" for layout in LAYOUTS for what in ("SA-I", "RA-I", "RA-I noisy")]
    rows = {name: [] for name in OPERATORS}
    for layout in LAYOUTS:
        sensor = load_sensor(layout)
        rig = rig_of(sensor)
        pins = rig.skin.rest_mm()
        pixels, shape = pixels_of(pins)
        inside = Delaunay(pins).find_simplex(pixels) >= 0
        markers = [shown_at(field, pins) for field in drums]
        noisy = [moved + rng.normal(0, NOISE_PX, moved.shape) for moved in markers]
        true = [sa1_and_ra1(shown_at(field, pixels[inside])) for field in drums]
        for name, operator in OPERATORS.items():
            matrix = operator(pins, pixels[inside])
            for which, of in ((0, markers), (1, markers), (1, noisy)):
                found = [sa1_and_ra1(moved)[which] @ matrix.T for moved in of]
                ought = [pair[which] for pair in true]
                rows[name].append(off(np.concatenate(found), np.concatenate(ought)))
        print(layout, shape, f"{inside.mean():.2f} of the pixels inside")
    lines = [f"| operator | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]
    lines += [f"| {n} | {' | '.join(f'{v:.1f}' for v in row)} |" for n, row in rows.items()]
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spacings", type=float, nargs="+", default=[0.0, 1.0, 2.0, 3.0, 4.5, 6.0])
    parser.add_argument("--speed", type=float, default=40.0)
    asked = parser.parse_args()
    scale = Rig().camera.px_per_mm
    print(table([displacement_px(spacing, asked.speed, scale) for spacing in asked.spacings]))
