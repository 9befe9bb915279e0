"""What is known of a sensor before its video is read: layout, detector, limits."""

import math
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, model_validator

from afferents import dims
from afferents.choices import Layout
from afferents.documents import as_form, read_toml
from afferents.errors import InputError

ImageSide = Annotated[int, Field(ge=2, le=200)]
# What is not given is left out of what is written down: stores and cards agree as before.
ShinePx = Annotated[int | None, Field(ge=3, le=99, exclude_if=lambda px: px is None)]
Circle = tuple[float, float, PositiveFloat]
"""Middle in x and y, and radius, px."""
FEWEST = 6
"""Fewer markers than this are no layout."""
FEWEST_CELLS, MOST_CELLS = 4, 200
"""Of a side of the grid that `markers.cells` lays over a picture."""
GENEROUS = 0.6
"""Share of a detector's limits that a marker must reach where a layout expects it."""
SMALL_PX, ENLARGED = 2.0, 4
"""Discs of a smaller radius are found and followed in the picture enlarged this many times: there
are too few px of them, and of the skin between them, for a centroid."""
_PACKAGED = Path(str(files("afferents.markers"))) / "sensors"


class BlobDetector(BaseModel):
    """Parameters of OpenCV's SimpleBlobDetector.

    The image is cut at grey levels from `min_threshold` to below `max_threshold` in steps; a
    blob is a marker if it passes every filter at `min_repeatability` of the levels or more.

    Attributes
    ----------
    blob_colour
        255 for bright markers on a dark skin, 0 for dark ones on a bright skin.
    min_threshold, max_threshold, threshold_step
        Grey levels, 0 to 255.
    min_distance_px
        Blobs nearer than this count as one, px.
    min_area_px2, max_area_px2
        Area of a marker, px^2.
    min_circularity, min_convexity, min_inertia_ratio
        Shape, each from 0 to 1 (1 is a disc).
    shine_px
        As of a `DiscDetector`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    blob_colour: Literal[0, 255] = 255
    min_threshold: float = Field(ge=0, le=255)
    max_threshold: float = Field(gt=0, le=256)
    threshold_step: float = Field(default=10.0, gt=0)
    min_repeatability: int = Field(default=2, ge=1)
    min_distance_px: float = Field(default=10.0, gt=0)
    min_area_px2: float = Field(gt=0)
    max_area_px2: float = Field(gt=0)
    min_circularity: float = Field(ge=0, le=1)
    min_convexity: float = Field(ge=0, le=1)
    min_inertia_ratio: float = Field(ge=0, le=1)
    shine_px: ShinePx = None

    @model_validator(mode="after")
    def _ranges_are_not_empty(self) -> Self:
        if self.min_area_px2 >= self.max_area_px2:
            raise ValueError("min_area_px2 must be less than max_area_px2")
        levels = (self.max_threshold - self.min_threshold) / self.threshold_step
        if levels < self.min_repeatability:
            raise ValueError("min_threshold to max_threshold must hold min_repeatability steps")
        return self

    def generous(self) -> Self:
        """Return itself: its limits are the user's."""
        return self


class DiscDetector(BaseModel):
    """How `afferents calibrate` describes markers: discs, whatever the light; see `find_discs`.

    Attributes
    ----------
    blob_colour
        255 for bright markers on a dark skin, 0 for dark ones on a bright skin.
    radius_px
        Of a marker, px.
    min_correlation
        With a drawn disc, from 0 to 1.
    min_contrast
        Of a marker, as a share of the typical one.
    shine_px
        Highlights in dark markers, or dark spots in bright ones, up to this width are taken out of
        the picture before markers are looked for, px; None where markers have none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    blob_colour: Literal[0, 255] = 255
    radius_px: float = Field(ge=1.0, le=100.0)
    min_correlation: float = Field(default=0.6, gt=0, lt=1)
    min_contrast: float = Field(default=0.3, ge=0, lt=1)
    shine_px: ShinePx = None

    def generous(self) -> Self:
        """Return one that takes fainter markers too, for where a layout expects them."""
        looser = {
            "min_correlation": GENEROUS * self.min_correlation,
            "min_contrast": GENEROUS * self.min_contrast,
        }
        return self.model_copy(update=looser)


def _name_kind(detector: object) -> str:
    is_disc = "radius_px" in detector if isinstance(detector, dict) else None
    return "disc" if is_disc or isinstance(detector, DiscDetector) else "blob"


Detector = Annotated[
    Annotated[BlobDetector, pydantic.Tag("blob")] | Annotated[DiscDetector, pydantic.Tag("disc")],
    pydantic.Discriminator(_name_kind),
]
"""The one with a `radius_px` is a `DiscDetector`."""


class Lens(BaseModel):
    """What bends the picture, as OpenCV's camera calibration gives it.

    Attributes
    ----------
    focal_px, centre_px
        Focal lengths and principal point in x and y, px.
    distortion
        Four fish-eye coefficients, or 4, 5 or 8 of the radial and tangential model.
    fish_eye
        Which of the two.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    focal_px: tuple[PositiveFloat, PositiveFloat]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...]
    fish_eye: bool = False

    @model_validator(mode="after")
    def _has_all_coefficients(self) -> Self:
        allowed = (4,) if self.fish_eye else (4, 5, 8)
        if len(self.distortion) not in allowed:
            numbers = " or ".join(str(n) for n in allowed)
            raise ValueError(f"distortion must have {numbers} coefficients")
        return self


class Picture(BaseModel):
    """Which part of the camera's picture shows the sensor, and which way up.

    Attributes
    ----------
    keep
        Markers are looked for in this circle only; None for the whole picture.
    hide
        In these circles none are looked for: lamps, screws, another skin.
    turn
        Degrees clockwise by which the picture must be turned to stand upright. Rows, columns and
        the directions of displacements are of the upright picture, px of the camera's.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    keep: Circle | None = None
    hide: tuple[Circle, ...] = ()
    turn: Literal[0, 90, 180, 270] = 0

    def shows(self, position: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Return which positions, (n, 2), px, lie where markers are looked for; shape (n,)."""
        shown = np.ones(len(position), dtype=bool)
        for key, (x, y, radius) in self.masks:
            inside = np.hypot(position[:, 0] - x, position[:, 1] - y) <= radius
            shown &= inside if key == "keep" else ~inside
        return shown

    def enlarged(self, times: int) -> Self:
        """Return the same for a picture this many times as large."""

        def larger(x: float, y: float, radius: float) -> Circle:
            return times * (x + 0.5) - 0.5, times * (y + 0.5) - 0.5, times * radius

        keep = larger(*self.keep) if self.keep else None
        hide = tuple(larger(*circle) for circle in self.hide)
        return self.model_copy(update={"keep": keep, "hide": hide})

    @property
    def masks(self) -> list[tuple[str, Circle]]:
        """Its circles, each with its key."""
        kept = [("keep", self.keep)] if self.keep else []
        return kept + [("hide", circle) for circle in self.hide]

    def misplaced(self, width: float, height: float) -> str:
        """Say which circle lies outside a picture of this size, and what was expected; or nothing.

        Either side may be infinite.
        """
        for name, (x, y, radius) in self.masks:
            if math.hypot(x - min(max(x, 0), width), y - min(max(y, 0), height)) >= radius:
                size, found = f"{width:g} x {height:g} px", f"[{x:g}, {y:g}, {radius:g}]"
                return f"{name}: expected a circle in the picture of {size}, found {found}"
        return ""


WHOLE = Picture()
"""All of a picture that stands upright."""


class Sensor(BaseModel):
    """A sensor as its file describes it.

    Attributes
    ----------
    layout
        ``square`` (`rows` x `columns` markers), or ``hexagonal``, ``radial`` or ``free``; or
        ``cells`` of a fingertip without markers: `rows` x `columns` parts of its picture.
    markers
        Where the markers of other layouts than square ones are at rest, px, in the order that
        they keep; None where these are not known (``free`` only). Camera and fingertip may be
        turned against it.
    image
        Rows and columns of the tactile images of such a layout; None for as many as suit its
        markers.
    pitch_mm
        Distance of neighbouring markers on the skin, mm; None where it is not known.
    n_markers
        How many markers there are; None where that is not known (``free`` only).
    width, height
        Size of the images for which the lengths in px hold; None for any.
    radius_px
        In the rest frame, markers farther than this from the centroid are left out; None for
        no limit.
    gate_px
        A marker moves at most this far from one frame to the next, px.
    rest_frame
        Index of the video frame that shows the skin at rest; earlier frames are not tracked.
    picture
        Which part of the picture shows the sensor, and which way up.
    lens
        Its distortion is taken out of SA-I and RA-I; None leaves them as the picture shows them.
    detector
        Says what markers look like; None of cells alone.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1)
    layout: Layout
    markers: tuple[tuple[float, float], ...] | None = None
    image: tuple[ImageSide, ImageSide] | None = Field(
        default=None, exclude_if=lambda image: image is None
    )
    pitch_mm: float | None = Field(default=None, gt=0)
    rows: int | None = Field(default=None, ge=2)
    columns: int | None = Field(default=None, ge=2)
    n_markers: int | None = Field(default=None, ge=1)
    width: int | None = Field(default=None, ge=1)
    height: int | None = Field(default=None, ge=1)
    radius_px: float | None = Field(default=300.0, gt=0)
    gate_px: float = Field(default=10.0, gt=0)
    rest_frame: int = Field(default=10, ge=0)
    lens: Lens | None = None
    picture: Picture = Field(default=WHOLE, exclude_if=lambda picture: picture == WHOLE)
    detector: Detector | None = Field(default=None, exclude_if=lambda detector: detector is None)

    @pydantic.field_validator("radius_px")
    @classmethod
    def _infinite_is_no_limit(cls, radius_px: float | None) -> float | None:
        """TOML says ``inf``, having no null; stores and cards are JSON, which has no ``inf``."""
        return None if radius_px == math.inf else radius_px

    @model_validator(mode="after")
    def _count_fits_layout(self) -> Self:
        if self.layout == dims.CELLS:
            return self._require_cells()
        if self.detector is None:
            raise ValueError(f"a {self.layout} layout needs a [detector], which calibrate makes")
        if self.layout != "square":
            if self.rows is not None or self.columns is not None:
                raise ValueError(f"a {self.layout} layout has no rows and columns")
            if self.markers is not None and self.n_markers not in (None, len(self.markers)):
                raise ValueError(f"n_markers must be the number of markers, {len(self.markers)}")
        elif self.image is not None:
            raise ValueError("a square layout needs no image; it has its rows and columns")
        elif self.markers is not None:
            raise ValueError("a square layout needs no markers; its rows and columns say it all")
        elif self.rows is None or self.columns is None:
            raise ValueError("a square layout needs rows and columns")
        elif self.n_markers != self.rows * self.columns:
            raise ValueError(f"n_markers must be rows x columns = {self.rows * self.columns}")
        return self

    def _require_cells(self) -> Self:
        for name in ("detector", "n_markers", "markers", "image", "lens"):
            if getattr(self, name) is not None:
                raise ValueError(f"cells have no {name}; leave it out")
        for name in ("rows", "columns"):
            if not FEWEST_CELLS <= (n := getattr(self, name) or 0) <= MOST_CELLS:
                wanted = f"{FEWEST_CELLS} to {MOST_CELLS}"
                raise ValueError(f"{name} of cells must be {wanted}, found {n or 'none'}")
        return self

    @property
    def looks(self) -> Detector:
        """What markers look like.

        Raises
        ------
        InputError
            If it has none.
        """
        if self.detector is None:
            found = f"sensor '{self.name}' of cells; leave it out, or give another sensor"
            raise InputError(f"the sensor: expected one with markers, found {found}")
        return self.detector

    @property
    def times(self) -> int:
        """How much the picture is enlarged to find and follow markers: small discs need it."""
        small = isinstance(self.detector, DiscDetector) and self.detector.radius_px < SMALL_PX
        return ENLARGED if small else 1

    def enlarged(self) -> Self:
        """Return the sensor in a picture `times` as large, to find markers in."""
        times, shine_px = self.times, self.looks.shine_px
        assert isinstance(self.detector, DiscDetector)
        larger = {
            "radius_px": times * self.detector.radius_px,
            "shine_px": times * shine_px + 1 if shine_px else None,
        }
        detector = self.detector.model_copy(update=larger)
        picture = self.picture.enlarged(times)
        return self.model_copy(update={"detector": detector, "picture": picture})

    @model_validator(mode="after")
    def _picture_shows_markers(self) -> Self:
        if fault := self.picture.misplaced(self.width or math.inf, self.height or math.inf):
            raise ValueError(fault)
        if self.picture.turn and None in (self.width, self.height):
            raise ValueError("a picture that is turned needs width and height")
        places = np.array(self.markers or ()).reshape(-1, 2)
        n_shown, least = int(self.picture.shows(places).sum()), min(FEWEST, len(places))
        if n_shown < least:
            raise ValueError(f"keep and hide must leave {least} markers or more, not {n_shown}")
        return self


def packaged_sensors() -> list[str]:
    """Return the names of the sensor files that come with the package."""
    return sorted(path.stem for path in _PACKAGED.glob("*.toml"))


def load_sensor(name_or_path: str | Path) -> Sensor:
    """Read a sensor file.

    Parameters
    ----------
    name_or_path
        A packaged sensor such as ``tip_b``, or the path of a TOML file of the same form.

    Raises
    ------
    InputError
        If there is no such sensor, if the file is not TOML, or if a key is unknown, missing or
        has a value that makes no sense.
    """
    path = _PACKAGED / f"{name_or_path}.toml"
    if str(name_or_path) not in packaged_sensors():
        path = Path(name_or_path)
    if not path.is_file():
        known = ", ".join(packaged_sensors())
        raise InputError(
            f"{name_or_path}: expected a sensor file, or a sensor of the package ({known}), found "
            "none"
        )
    what = "a sensor file in TOML"
    return as_form(read_toml(path, what), Sensor, path, what)


def resolve_sensor(wanted: str | Path | Sensor) -> Sensor:
    """Return the sensor, which may be given by its file or by the name of a packaged one.

    Raises
    ------
    InputError
        If there is none, or the file is damaged.
    """
    return wanted if isinstance(wanted, Sensor) else load_sensor(str(wanted))
