"""The drums: what passes under the fingertip, as a map of heights, and what a nodule feels of it.

A drum of the paper carries raised discs in two interleaved square lattices, so that the pattern
repeats after sqrt(2) x along the slide, where x is the distance of neighbouring bumps along the
lattice's diagonal. A whole number of periods closes round the drum.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.ndimage import gaussian_filter, map_coordinates

from afferents.errors import InputError, reason_of

Heights = NDArray[np.float32]
"""Shape (n_along, n_across), mm above the drum's base."""

WIDTH_MM = 36.0
"""Width of the drums, mm: the skin (21.6 mm between its outer pins) never reaches the edge."""
_ALONG = 5088
"""Samples round the drum: 0.05 mm, a fifth of the finest bump."""
_ACROSS = 720
_LARGEST_MAP = 32766
"""Rows or columns of a height map, which OpenCV counts in 16 bits."""
_TOUCHED_MM = 10.0
_PATCHED, _PATCHED_ACROSS = 252, 36
"""Samples of what a print's bumps share: 1 mm apart, round the drum and across."""
_WARP, _GRIP = 2, 3
_COARSER = 2
"""Nodules feel 1.5 mm; what they feel is kept at 0.1 mm."""


class Drum(BaseModel):
    """How the drums are made.

    Attributes
    ----------
    diameter_mm
        Of the base (paper, section 2.2). Speeds hold there.
    bump_height_mm
        Height of the bumps (paper, section 2.2).
    bump_ratio
        Bump diameter d / x, the same for all drums: the paper gives all its drums the same area of
        bumps. The value is a guess: Figure 3 of the paper prints x and d, and was not seen.
    print_sd_mm
        How unequal printed bumps are in height, standard deviation, mm. Chosen to fit the
        skirts round the lines of the published spectra.
    prints
        Which set of drums it is of: each set is printed anew, with errors of its own.
    patch_sd_mm, patch_mm
        Bumps that lie near each other on the print err together, as it warps: standard deviation,
        mm, and reach of that, mm. Chosen.
    grip_sd, grip_mm
        The tops of bumps are finished unevenly, in patches: standard deviation of the log of
        friction on them, and its reach, mm; none on the smooth drum. Chosen to fit how the
        published SA-I of textured drums changes from image to image, which nothing else shows.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    diameter_mm: float = Field(80.0, gt=0)
    bump_height_mm: float = Field(0.5, gt=0)
    bump_ratio: float = Field(0.36, gt=0, le=0.9)
    print_sd_mm: float = Field(0.018, ge=0)
    prints: int = Field(0, ge=0)
    patch_sd_mm: float = Field(0.042, ge=0)
    patch_mm: float = Field(6.3, gt=0)
    grip_sd: float = Field(0.57, ge=0)
    grip_mm: float = Field(5.4, gt=0)

    @property
    def top_diameter_mm(self) -> float:
        """Diameter over the bumps, on which the pattern is laid out, mm."""
        return self.diameter_mm + 2 * self.bump_height_mm

    def periods(self, spacing_mm: float) -> int:
        """Return how often the pattern of bump spacing x (mm) repeats round the drum.

        The nearest integer to pi 81 mm / (sqrt(2) x) = 180 / x, which gives the fundamental of
        the published spectra, 0.716 v / x.
        """
        return max(1, round(math.pi * self.top_diameter_mm / (math.sqrt(2) * spacing_mm)))

    def rate_hz(self, spacing_mm: float, speed_mm_s: float) -> float:
        """Return how often the pattern passes, Hz: 7.16 for bumps 4 mm apart at 40 mm/s.

        Spectra have lines at its multiples. The smooth drum has no pattern.
        """
        return self.periods(spacing_mm) * speed_mm_s / (math.pi * self.diameter_mm)


@dataclass(frozen=True)
class Surface:
    """A drum's surface unrolled.

    Attributes
    ----------
    height_mm
        Shape (n_along, n_across), mm; along the slide it closes on itself, across it does not.
    length_mm, width_mm
        What the map covers, mm; the length is the circumference over the bumps.
    contact_share
        Share of the surface that the skin rests on: all of a smooth drum, the tops of bumps.
    grip
        Friction over its median, of each sample of the map or of all.
    """

    height_mm: Heights
    length_mm: float
    width_mm: float = WIDTH_MM
    contact_share: float = 1.0
    grip: Heights | float = 1.0

    @property
    def friction_factor(self) -> float:
        """Friction over that of a smooth surface under the same load.

        Rubber's friction is that of its true contact area. Under the load N a single smooth cap's
        grows as N^(2/3), that of asperities on asperities as N^(8/9) (Archard, Proc. R. Soc. A
        243:190, 1957); where an area A carries the load, as A^(1/9) N^(8/9). So what rests on bumps
        that cover a share of the surface drags with the ninth root of the share.
        """
        return float(self.contact_share ** (1 / 9))

    @property
    def pitch_mm(self) -> tuple[float, float]:
        """Distance of samples along and across, mm."""
        n_along, n_across = self.height_mm.shape
        return self.length_mm / n_along, self.width_mm / n_across

    @cached_property
    def top_mm(self) -> float:
        """Height at which a fingertip that comes down touches first, mm: the mean round the drum.

        That of the highest point within 10 x 10 mm under the middle of the tip.
        """
        n_across = self.height_mm.shape[1]
        touched = round(_TOUCHED_MM / self.pitch_mm[1] / 2)
        middle = self.height_mm[:, n_across // 2 - touched : n_across // 2 + touched]
        parts = np.array_split(middle, max(1, round(self.length_mm / _TOUCHED_MM)))
        return float(np.mean([part.max() for part in parts]))


def bumped_surface(spacing_mm: float, drum: Drum | None = None) -> Surface:
    """Return the surface of a drum with bumps x = `spacing_mm` apart (0 for the smooth one).

    Raises
    ------
    InputError
        If the spacing is negative, finer than the map can show, or wider than the drum.
    """
    drum = drum or Drum()
    length = math.pi * drum.top_diameter_mm
    if spacing_mm == 0:
        flat = np.zeros((_ALONG, _ACROSS), np.float32)
        return Surface(flat, math.pi * drum.diameter_mm)
    if not 0.3 <= spacing_mm <= 20:
        raise InputError(
            f"a drum: expected a bump spacing of 0 or of 0.3 to 20 mm, found {spacing_mm:g}"
        )
    period_along = length / drum.periods(spacing_mm)
    period_across = math.sqrt(2) * spacing_mm
    along = (np.arange(_ALONG) + 0.5) * length / _ALONG / period_along
    across = (np.arange(_ACROSS) + 0.5) * WIDTH_MM / _ACROSS / period_across
    radius = drum.bump_ratio * spacing_mm / 2
    height = np.zeros((_ALONG, _ACROSS), np.float32)
    for lattice, shift in enumerate((0.0, 0.5)):
        u, v = along + shift, across + shift
        off_u = (u - np.floor(u) - 0.5) * period_along
        off_v = (v - np.floor(v) - 0.5) * period_across
        distance = np.hypot(off_u[:, None], off_v[None, :])
        # The edge is as wide as a sample, so that the area comes out right at any spacing.
        cover = np.clip((radius - distance) / (length / _ALONG) + 0.5, 0, 1)
        tops = _draw_tops(drum, spacing_mm, lattice, int(v.max()) + 1)
        n = drum.periods(spacing_mm)
        height += (cover * tops[np.floor(u).astype(int) % n][:, np.floor(v).astype(int)]).astype(
            np.float32
        )
    share = math.pi / 4 * drum.bump_ratio**2
    return Surface(height, length, contact_share=share, grip=_draw_grip(drum, spacing_mm))


def _draw_tops(drum: Drum, spacing_mm: float, lattice: int, n_across: int) -> Heights:
    """Draw the height of each bump of a lattice; drums of one set are always alike."""
    shape = drum.periods(spacing_mm), n_across
    rng = np.random.default_rng([round(1000 * spacing_mm), lattice, drum.prints])
    error = np.clip(rng.normal(0, drum.print_sd_mm, shape), -0.2, 0.2)
    middle = (1 - lattice) / 2  # of a bump, in periods from where its count begins
    along = (np.arange(shape[0]) + middle) / shape[0] * _PATCHED
    across = (np.arange(n_across) + middle) * math.sqrt(2) * spacing_mm
    warp = drum.patch_sd_mm * _draw_patches(drum, spacing_mm, _WARP, drum.patch_mm)
    rows, columns = np.meshgrid(along, across / WIDTH_MM * _PATCHED_ACROSS, indexing="ij")
    tops = drum.bump_height_mm + error + map_coordinates(warp, [rows, columns], mode="grid-wrap")
    return np.asarray(np.maximum(tops, 0.1), np.float32)


def _draw_grip(drum: Drum, spacing_mm: float) -> Heights:
    """Draw the friction of a print's bumps over its median, for each sample of the map."""
    patches = drum.grip_sd * _draw_patches(drum, spacing_mm, _GRIP, drum.grip_mm)
    rows = (np.arange(_ALONG) + 0.5) * _PATCHED / _ALONG + 0.5  # in the middle of a padded row
    columns = (np.arange(_ACROSS) + 0.5) * _PATCHED_ACROSS / _ACROSS - 0.5
    x, y = np.meshgrid(columns.astype(np.float32), rows.astype(np.float32))
    padded = np.pad(patches, ((1, 1), (0, 0)), mode="wrap").astype(np.float32)
    finished = cv2.remap(padded, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(np.exp(finished), np.float32)


def _draw_patches(drum: Drum, spacing_mm: float, use: int, reach_mm: float) -> NDArray[np.float64]:
    """Draw what bumps near each other share, variance 1, round the drum and across."""
    rng = np.random.default_rng([round(1000 * spacing_mm), use, drum.prints])
    white = rng.standard_normal((_PATCHED, _PATCHED_ACROSS))
    pitch = math.pi * drum.diameter_mm / _PATCHED, WIDTH_MM / _PATCHED_ACROSS
    patches = gaussian_filter(white, [reach_mm / p for p in pitch], mode="wrap")
    return np.asarray(patches / patches.std())


def mapped_surface(
    height_mm: NDArray[np.floating], length_mm: float, drum: Drum | None = None
) -> Surface:
    """Wrap any map of heights round a drum.

    Parameters
    ----------
    height_mm
        Shape (along, across), mm, square samples.
    length_mm
        Length of the map along the slide, mm. It is stretched a little so that a whole number
        of repeats closes round the drum, and repeated or cut across.

    Raises
    ------
    InputError
        If the map is not two-dimensional, holds values that are no numbers, or is longer than
        the drum is round.
    """
    drum = drum or Drum()
    if (kind := np.asarray(height_mm).dtype).kind not in "biuf":
        raise InputError(f"a height map: expected numbers, found {kind}")
    height = np.asarray(height_mm, np.float32)
    if height.ndim != 2 or min(height.shape) < 2 or not np.isfinite(height).all():
        raise InputError(
            f"a height map: expected finite heights of shape (along, across), found {height.shape}"
        )
    height = height - height.min()
    length = math.pi * (drum.diameter_mm + 2 * float(height.max()))
    if not 0 < length_mm <= length:
        raise InputError(
            f"a height map: expected a length of 0 to {length:.0f} mm, found {length_mm:g} mm"
        )
    if max(height.shape) > _LARGEST_MAP:
        raise InputError(
            f"a height map: expected {_LARGEST_MAP} rows and columns at most, found {height.shape}"
        )
    repeats, pitch = round(length / length_mm), length_mm / len(height)
    along = np.arange(_ALONG) * len(height) * repeats / _ALONG
    across = np.arange(_ACROSS) * WIDTH_MM / _ACROSS / pitch
    tile = np.pad(height, ((0, 1), (0, 1)), mode="wrap")
    grid = np.meshgrid(across % height.shape[1], along % height.shape[0])
    wrapped = cv2.remap(
        tile, grid[0].astype(np.float32), grid[1].astype(np.float32), cv2.INTER_LINEAR
    )
    share = float((wrapped >= wrapped.max() / 2).mean())  # a map may be cut across
    return Surface(wrapped.astype(np.float32), length, contact_share=share)


def read_height_map(
    path: Path, length_mm: float, height_mm: float, drum: Drum | None = None
) -> Surface:
    """Wrap an image (bright is high) or an .npy array (mm) round a drum.

    Parameters
    ----------
    length_mm
        Length of the picture's vertical axis, which lies along the slide, mm.
    height_mm
        Height of white over black, mm; not used for .npy.

    Raises
    ------
    InputError
        If the file is neither, or as `mapped_surface`.
    """
    if path.suffix == ".npy":
        try:
            return mapped_surface(np.load(path, allow_pickle=False), length_mm, drum)
        except (OSError, ValueError, EOFError) as error:
            raise InputError(
                f"{path}: expected an array of heights, found {reason_of(error)}"
            ) from error
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise InputError(f"{path}: expected an image or an .npy array of heights, found neither")
    return mapped_surface(image / np.float32(255) * height_mm, length_mm, drum)


def soft_maximum(surface: Surface, footprint_mm: float, stiffness_per_mm: float) -> Surface:
    """Return what a nodule feels: the soft maximum of the heights under its footprint.

    Skin bridges what is narrower than itself. The soft maximum, log(mean(exp(b h))) / b with
    weights that fall off towards the footprint's edge, lies between the mean (b to 0) and the
    highest point (b to infinity).

    Parameters
    ----------
    footprint_mm
        Diameter of the nodule, mm.
    stiffness_per_mm
        b: the stiffer the skin, the more the highest points carry, 1/mm.
    """
    raised = np.exp(np.float32(stiffness_per_mm) * surface.height_mm)
    bells = []  # raised cosines of that full width, sum 1: of two axes they make a round bump
    for step_mm in surface.pitch_mm:
        reach = max(1, round(footprint_mm / 2 / step_mm))
        weight = 1 + np.cos(np.pi * np.arange(-reach, reach + 1) / (reach + 1))
        bells.append(weight / weight.sum())
    along, across = bells
    reach = len(along) // 2
    # Along, the surface closes on itself, which OpenCV's filters don't know.
    raised = np.pad(raised, ((reach, reach), (0, 0)), mode="wrap")
    mean = cv2.sepFilter2D(raised, -1, across, along, borderType=cv2.BORDER_REFLECT_101)
    sampled = mean[reach:-reach:_COARSER, ::_COARSER]
    envelope = (np.log(sampled) / stiffness_per_mm).astype(np.float32)
    grip = np.broadcast_to(surface.grip, surface.height_mm.shape)[::_COARSER, ::_COARSER]
    return replace(surface, height_mm=envelope, grip=grip)
