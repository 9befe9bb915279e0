"""Structures and numbers of Linux's V4L2 interface, as linux/videodev2.h has them (64 bits)."""

import ctypes

VIDEO_CAPTURE = 1
"""V4L2_BUF_TYPE_VIDEO_CAPTURE."""
MMAP = 1
"""V4L2_MEMORY_MMAP."""
CAN_CAPTURE, CAN_STREAM, HAS_OWN_CAPS = 0x00000001, 0x04000000, 0x80000000
BUFFER_ERROR = 0x0040
CLOCK_MASK, CLOCK_MONOTONIC = 0xE000, 0x2000
DISABLED_CONTROL, READ_ONLY_CONTROL = 0x0001, 0x0004
DISCRETE = 1
"""Of frame sizes and intervals; others are ranges."""

_u8, _u32, _s32 = ctypes.c_uint8, ctypes.c_uint32, ctypes.c_int32


class Capability(ctypes.Structure):
    """struct v4l2_capability."""

    _fields_ = (
        ("driver", ctypes.c_char * 16), ("card", ctypes.c_char * 32),
        ("bus_info", ctypes.c_char * 32), ("version", _u32), ("capabilities", _u32),
        ("device_caps", _u32), ("reserved", _u32 * 3),
    )  # fmt: skip


class FormatDescription(ctypes.Structure):
    """struct v4l2_fmtdesc."""

    _fields_ = (
        ("index", _u32), ("type", _u32), ("flags", _u32), ("description", ctypes.c_char * 32),
        ("pixelformat", _u32), ("mbus_code", _u32), ("reserved", _u32 * 3),
    )  # fmt: skip


class Fraction(ctypes.Structure):
    """struct v4l2_fract."""

    _fields_ = (("numerator", _u32), ("denominator", _u32))


class FrameSize(ctypes.Structure):
    """struct v4l2_frmsizeenum; of a range, the smallest and largest size."""

    _fields_ = (
        ("index", _u32), ("pixel_format", _u32), ("type", _u32), ("size", _u32 * 6),
        ("reserved", _u32 * 2),
    )  # fmt: skip


class FrameInterval(ctypes.Structure):
    """struct v4l2_frmivalenum; of a range, the shortest, longest and step."""

    _fields_ = (
        ("index", _u32), ("pixel_format", _u32), ("width", _u32), ("height", _u32),
        ("type", _u32), ("interval", Fraction * 3), ("reserved", _u32 * 2),
    )  # fmt: skip


class _PixelFormat(ctypes.Structure):
    """struct v4l2_pix_format."""

    _fields_ = (
        ("width", _u32), ("height", _u32), ("pixelformat", _u32), ("field", _u32),
        ("bytesperline", _u32), ("sizeimage", _u32), ("colorspace", _u32), ("priv", _u32),
        ("flags", _u32), ("ycbcr_enc", _u32), ("quantization", _u32), ("xfer_func", _u32),
    )  # fmt: skip


class _FormatUnion(ctypes.Union):
    # The kernel's union holds a pointer, so it begins at a multiple of eight bytes.
    _fields_ = (("pix", _PixelFormat), ("raw", _u8 * 200), ("align", ctypes.c_void_p))


class Format(ctypes.Structure):
    """struct v4l2_format."""

    _fields_ = (("type", _u32), ("fmt", _FormatUnion))


class _Capture(ctypes.Structure):
    """struct v4l2_captureparm."""

    _fields_ = (
        ("capability", _u32), ("capturemode", _u32), ("timeperframe", Fraction),
        ("extendedmode", _u32), ("readbuffers", _u32), ("reserved", _u32 * 4),
    )  # fmt: skip


class _RateUnion(ctypes.Union):
    _fields_ = (("capture", _Capture), ("raw", _u8 * 200))


class StreamParameters(ctypes.Structure):
    """struct v4l2_streamparm."""

    _fields_ = (("type", _u32), ("parm", _RateUnion))


class BufferRequest(ctypes.Structure):
    """struct v4l2_requestbuffers."""

    _fields_ = (
        ("count", _u32), ("type", _u32), ("memory", _u32), ("capabilities", _u32),
        ("flags", _u8), ("reserved", _u8 * 3),
    )  # fmt: skip


class _Time(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_long), ("tv_usec", ctypes.c_long))


class _Place(ctypes.Union):
    _fields_ = (("offset", _u32), ("userptr", ctypes.c_ulong))


class Buffer(ctypes.Structure):
    """struct v4l2_buffer."""

    _fields_ = (
        ("index", _u32), ("type", _u32), ("bytesused", _u32), ("flags", _u32), ("field", _u32),
        ("timestamp", _Time), ("timecode", _u32 * 4), ("sequence", _u32), ("memory", _u32),
        ("m", _Place), ("length", _u32), ("reserved2", _u32), ("request_fd", _s32),
    )  # fmt: skip


class Control(ctypes.Structure):
    """struct v4l2_control."""

    _fields_ = (("id", _u32), ("value", _s32))


class ControlQuery(ctypes.Structure):
    """struct v4l2_queryctrl."""

    _fields_ = (
        ("id", _u32), ("type", _u32), ("name", ctypes.c_char * 32), ("minimum", _s32),
        ("maximum", _s32), ("step", _s32), ("default_value", _s32), ("flags", _u32),
        ("reserved", _u32 * 2),
    )  # fmt: skip


_WRITE, _READ = 1, 2


def _request(direction: int, number: int, content: type) -> int:
    """Return the number of an ioctl of type 'V' (asm-generic/ioctl.h)."""
    return (direction << 30) | (ctypes.sizeof(content) << 16) | (ord("V") << 8) | number


QUERYCAP = _request(_READ, 0, Capability)
ENUM_FMT = _request(_READ | _WRITE, 2, FormatDescription)
G_FMT = _request(_READ | _WRITE, 4, Format)
S_FMT = _request(_READ | _WRITE, 5, Format)
REQBUFS = _request(_READ | _WRITE, 8, BufferRequest)
QUERYBUF = _request(_READ | _WRITE, 9, Buffer)
QBUF = _request(_READ | _WRITE, 15, Buffer)
DQBUF = _request(_READ | _WRITE, 17, Buffer)
STREAMON = _request(_WRITE, 18, ctypes.c_int)
STREAMOFF = _request(_WRITE, 19, ctypes.c_int)
G_PARM = _request(_READ | _WRITE, 21, StreamParameters)
S_PARM = _request(_READ | _WRITE, 22, StreamParameters)
G_CTRL = _request(_READ | _WRITE, 27, Control)
S_CTRL = _request(_READ | _WRITE, 28, Control)
QUERYCTRL = _request(_READ | _WRITE, 36, ControlQuery)
ENUM_FRAMESIZES = _request(_READ | _WRITE, 74, FrameSize)
ENUM_FRAMEINTERVALS = _request(_READ | _WRITE, 75, FrameInterval)


def format_code(name: str) -> int:
    """Return the number of a pixel format of four characters."""
    return int.from_bytes(name.ljust(4).encode("ascii")[:4], "little")


def format_name(code: int) -> str:
    """Return the four characters of a pixel format."""
    return (code & 0x7FFFFFFF).to_bytes(4, "little").decode("ascii", "replace").rstrip()
