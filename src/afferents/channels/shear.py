"""Global shear: how the skin as a whole is dragged, stretched and turned by what it touches.

A plane is fitted to the displacement of the markers over their places at rest, by least squares:
u(r) = t + G (r - c), with c the middle of all markers. The paper takes this shear for a cue of
friction, and for what carries texture in its images (Pestell & Lepora 2022, Discussion).
"""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel, Skin
from afferents.channels.checks import named, require_dims
from afferents.channels.sa1_vector import displacement, sa1_vector
from afferents.core import dims

Floats = NDArray[np.float64]

PARTS = ("shift_x", "shift_y", "divergence", "curl", "stretch", "shear")
"""The mean displacement, and what the four gradients of the plane say: growth, turning, stretch
along x, and stretch along the diagonal."""
_LEAST_SPREAD = 1e-3
"""Of the places of markers that are seen, squared and relative to all: fewer lie on a line."""


class Plane(NamedTuple):
    """A plane fitted to the displacement of every frame.

    Attributes
    ----------
    shift
        Displacement in the middle of all markers, (frame, space), px.
    gradient
        Of the component in each direction, (frame, direction, component), px per px.
    radius_px
        Root mean square distance of the markers from their middle.
    field
        The plane at each marker, (frame, marker, space), px.
    """

    shift: Floats
    gradient: Floats
    radius_px: float
    field: Floats


class Shear(Channel):
    """The global shear: six numbers a frame, px; see `global_shear`."""

    name, title, made_of = dims.SHEAR, "global shear", dims.POSITION
    parts = PARTS

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the global shear `(time, shear)`, px."""
        return global_shear(recording[dims.POSITION], recording[dims.REST_POSITION])

    def step(self, now: Skin, before: Skin | None) -> NDArray[np.floating]:
        """Return the global shear of one frame, (6,), px."""
        return np.asarray(shear_of(fitted_plane(displacement(now)[np.newaxis], now.rest))[0])


def global_shear(position: xr.DataArray, rest_position: xr.DataArray) -> xr.DataArray:
    """Return the global shear of every frame.

    Its parts are `shift_x` and `shift_y`, the displacement in the middle of the markers (the mean
    displacement where none is lost); then, of the gradients of u = (u, v) along x and y,
    `divergence` du/dx + dv/dy, `curl` dv/dx - du/dy, `stretch` du/dx - dv/dy and `shear`
    du/dy + dv/dx. x points right and y down in the image, so a positive curl turns clockwise.

    Parameters
    ----------
    position, rest_position
        `(time, marker, space)` and `(marker, space)`, px; NaN where a marker was lost.

    Returns
    -------
    xarray.DataArray
        `shear` `(time, shear)`, px. The four gradients are given as the root mean square
        displacement that they cause, so that all six have one unit: the strain times `radius_px`
        / 2, which stands in the attributes. NaN where fewer than three markers were seen, or only
        some on one line.

    Raises
    ------
    InputError
        If a dim is missing.
    """
    moved, rest = _displacement(position, rest_position)
    plane = fitted_plane(moved.values, rest)
    times = {dims.TIME: moved[dims.TIME]} if dims.TIME in moved.coords else {}
    found = xr.DataArray(
        shear_of(plane).astype(moved.dtype),
        {**times, dims.SHEAR: list(PARTS)},
        (dims.TIME, dims.SHEAR),
        attrs={"radius_px": plane.radius_px},
    )
    return named(found, dims.SHEAR, dims.PIXELS)


def affine_field(position: xr.DataArray, rest_position: xr.DataArray) -> xr.DataArray:
    """Return the displacement that the global shear alone makes, `(time, marker, space)`, px.

    Parameters and what is raised as of `global_shear`.
    """
    moved, rest = _displacement(position, rest_position)
    field = fitted_plane(moved.values, rest).field.astype(moved.dtype)
    return named(moved.copy(data=field), "affine_field", dims.PIXELS)


def fitted_plane(moved: NDArray[np.floating], rest: NDArray[np.floating]) -> Plane:
    """Fit a plane to the displacement of the markers that are seen, frame by frame.

    Parameters
    ----------
    moved, rest
        (frame, marker, space) and (marker, space), px.
    """
    middle = np.nanmean(rest, axis=0)
    radius_px = float(np.sqrt(np.nanmean(((rest - middle) ** 2).sum(axis=1))))
    basis = np.column_stack([np.ones(len(rest)), (rest - middle) / radius_px])
    seen = np.isfinite(moved).all(axis=2) & np.isfinite(basis).all(axis=1)
    known = np.where(seen[..., np.newaxis], moved, 0).astype(np.float64)
    basis = np.nan_to_num(basis)
    products = (basis[:, :, np.newaxis] * basis[:, np.newaxis]).reshape(len(rest), -1)
    normal = (seen.astype(np.float64) @ products).reshape(-1, 3, 3)
    right = np.einsum("mb,tms->tbs", basis, known)
    fit = np.linalg.eigvalsh(normal)[:, 0] > _LEAST_SPREAD * len(rest)
    solved = np.full(right.shape, np.nan)
    solved[fit] = np.linalg.solve(normal[fit], right[fit])
    return Plane(solved[:, 0], solved[:, 1:] / radius_px, radius_px, basis @ solved)


def shear_of(plane: Plane) -> Floats:
    """Return the six parts of a fitted plane, (frame, 6), px; see `global_shear`."""
    (du_dx, dv_dx), (du_dy, dv_dy) = np.moveaxis(plane.gradient, 0, 2)
    strain = [du_dx + dv_dy, dv_dx - du_dy, du_dx - dv_dy, du_dy + dv_dx]
    return np.column_stack([plane.shift, plane.radius_px / 2 * np.stack(strain, axis=1)])


def _displacement(
    position: xr.DataArray, rest_position: xr.DataArray
) -> tuple[xr.DataArray, Floats]:
    """Return the displacement `(time, marker, space)`, and the places at rest (marker, space)."""
    moved = sa1_vector(position, rest_position)
    moved = require_dims(moved, (dims.TIME, dims.MARKER, dims.SPACE), dims.POSITION)
    rest = require_dims(rest_position, (dims.MARKER, dims.SPACE), dims.REST_POSITION)
    return moved, rest.values.astype(np.float64)
