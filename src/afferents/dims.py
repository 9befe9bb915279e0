"""Names of dims, variables and units, spelled once.

Every array in the package is an xarray object whose dims, coordinates and units come from
here. Positions are in px of the camera image: x right, y down, pixel centres at integers.
"""

from typing import TYPE_CHECKING, Final

from afferents.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

# dims of a recording's responses
TIME: Final = "time"
"""Clock of the video, s (presentation times of the frames in the container)."""
AUDIO_TIME: Final = "audio_time"
"""Clock of the audio or of the vibration channels, s; regular, given by `sample_rate_hz`."""
DRIVE_TIME: Final = "drive_time"
"""When the drum's drive was read, s on the clock of the recording."""
SPEED_TIME: Final = "speed_time"
MARKER: Final = "marker"
SPACE: Final = "space"
CHANNEL: Final = "channel"


# dims of encoded samples
SAMPLE: Final = "sample"
FRAME: Final = "frame"
ROW: Final = "row"
"""Rank of a marker in y (image down), 0 at the top; on layouts that are not square, its place among
the rows of the tactile image."""
COLUMN: Final = "column"
"""Rank of a marker in x (image right), 0 at the left; or its place in the columns."""
FREQUENCY: Final = "frequency"
FEATURE: Final = "feature"
"""What is known of each frequency, such as the power of a channel; or of a window as a whole."""
COMPONENT: Final = "component"
MOMENT: Final = "moment"
"""Mean or spread of what a run of frames shows."""
SHEAR: Final = "shear"
"""The six parts of the global shear; see `channels.Shear`."""
ROW_WAVENUMBER: Final = "row_wavenumber"
"""Of waves down the image, cycles from marker to marker."""
COLUMN_WAVENUMBER: Final = "column_wavenumber"


# variables of a recording's responses
POSITION: Final = "position"
DETECTED: Final = "detected"
REST_POSITION: Final = "rest_position"
FRAME_CHANGE: Final = "frame_change"
"""Mean change of the picture since the frame before, both in the same light."""
DRUM_POSITION: Final = "drum_position"
"""Distance that the drum's surface has moved under the fingertip, mm; see `store.drum_path`."""

SPEED_SERIES: Final = "speed"
"""Along the surface, mm/s, where it changes within a recording; see `store.motion`."""

SA1: Final = "sa1"
RA1: Final = "ra1"
RA2: Final = "ra2"


# responses that are worked out of these when asked for
SA1_VECTOR: Final = "sa1_vector"
RA1_VECTOR: Final = "ra1_vector"
SA1_LOCAL: Final = "sa1_local"
"""`SHEAR`, above, names a response as well as a dim."""


# what each sample of an encoding carries, as coordinates on `sample`
TEXTURE: Final = "texture"
SPEED: Final = "speed_mm_s"
RECORDING: Final = "recording"
MEAN_SPEED: Final = "mean_speed_mm_s"
"""Of a sample, where recordings keep their speed as a series."""
SPEED_CHANGE: Final = "speed_change"
"""Of a sample: what its fastest and slowest moments differ by, as a share of its mean speed."""
DISTANCE: Final = "distance_mm"
"""Coordinate of vibration, on `audio_time`: distance along the surface, where it is resampled."""

NAMED_BY_SPACING: Final = "named_by_spacing"
"""Attribute of recordings and samples, and key of summaries: textures are named by the spacing of
their bumps, mm, as the paper's drums are in the published layout. Elsewhere a number is a name."""
GROUP: Final = "group"
"""By which samples are held out, where that is not the speed."""
START: Final = "start_s"
STOP: Final = "stop_s"
VARIANT: Final = "variant"
"""Coordinate of samples: 0 where they are learnt from, else the number of a test."""
SAMPLE_COORDS: Final = (TEXTURE, SPEED, RECORDING, START, STOP)


# attributes
UNITS: Final = "units"
SAMPLE_RATE: Final = "sample_rate_hz"
PIXELS: Final = "px"
PIXELS_PER_FRAME: Final = "px/frame"
CELLS: Final = "cells"
"""Layout of fingertips without markers; and attribute of samples, which are of cells where it is
True."""
GREY_LEVELS: Final = "grey levels"
"""Of SA-I of fingertips without markers, 0 to 255; see `markers.cells`."""
PIXELS_PER_SECOND: Final = "px/s"
SECONDS: Final = "s"
HERTZ: Final = "Hz"


def of_cells(responses: "xr.Dataset") -> bool:
    """Tell whether responses are of cells, in grey levels, and not of markers, in px."""
    return SA1 in responses and responses[SA1].attrs.get(UNITS) == GREY_LEVELS


def require(array: "xr.DataArray", needed: tuple[str, ...], name: str) -> "xr.DataArray":
    """Return `array` with its dims in the order `needed`.

    Raises
    ------
    InputError
        Naming the dims that are missing or too many.
    """
    if set(array.dims) == set(needed):
        return array.transpose(*needed)
    missing = [dim for dim in needed if dim not in array.dims]
    fault = f"{', '.join(missing)} missing" if missing else "too many"
    raise InputError(f"{name}: expected the dims {needed}, found {array.dims} ({fault})")
