"""The ROS 2 messages of a bag: types, and how each is made.

Foxglove and rerun show pictures, sound and marks on pictures if the messages have types that they
know. Those of ROS itself (`sensor_msgs`, `std_msgs`) come with rosbags; those of Foxglove and of
`audio_common` are written here as their documentation gives their fields
(https://docs.foxglove.dev/docs/sdk/schemas, https://github.com/ros-drivers/audio_common).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.plugins import import_extra

NS = 1_000_000_000
PICTURE = "sensor_msgs/msg/CompressedImage"
RAW_PICTURE = "sensor_msgs/msg/Image"
MARKS = "foxglove_msgs/msg/ImageAnnotations"
SOUND = "foxglove_msgs/msg/RawAudio"
ROS_SOUND = "audio_common_msgs/msg/AudioData"
ROS_SOUND_STAMPED = "audio_common_msgs/msg/AudioDataStamped"
ROS_SOUND_INFO = "audio_common_msgs/msg/AudioInfo"
NUMBER, NUMBERS, TEXT = (
    "std_msgs/msg/Float64",
    "std_msgs/msg/Float32MultiArray",
    "std_msgs/msg/String",
)
PCM = "pcm-s16"
_POINTS = 1
"""Of PointsAnnotation: single points, not a line."""
_SIZE_PX = 5.0

_TYPES = {
    "foxglove_msgs/msg/Point2": "float64 x\nfloat64 y",
    "foxglove_msgs/msg/Color": "float64 r\nfloat64 g\nfloat64 b\nfloat64 a",
    "foxglove_msgs/msg/CircleAnnotation": (
        "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nfloat64 diameter\n"
        "float64 thickness\nfoxglove_msgs/Color fill_color\nfoxglove_msgs/Color outline_color"
    ),
    "foxglove_msgs/msg/PointsAnnotation": (
        "builtin_interfaces/Time timestamp\nuint8 type\nfoxglove_msgs/Point2[] points\n"
        "foxglove_msgs/Color outline_color\nfoxglove_msgs/Color[] outline_colors\n"
        "foxglove_msgs/Color fill_color\nfloat64 thickness"
    ),
    "foxglove_msgs/msg/TextAnnotation": (
        "builtin_interfaces/Time timestamp\nfoxglove_msgs/Point2 position\nstring text\n"
        "float64 font_size\nfoxglove_msgs/Color text_color\nfoxglove_msgs/Color background_color"
    ),
    MARKS: (
        "foxglove_msgs/CircleAnnotation[] circles\nfoxglove_msgs/PointsAnnotation[] points\n"
        "foxglove_msgs/TextAnnotation[] texts"
    ),
    SOUND: (
        "builtin_interfaces/Time timestamp\nuint8[] data\nstring format\nuint32 sample_rate\n"
        "uint32 number_of_channels"
    ),
    ROS_SOUND: "uint8[] data",
    ROS_SOUND_STAMPED: "std_msgs/Header header\naudio_common_msgs/AudioData audio",
    ROS_SOUND_INFO: (
        "uint8 channels\nuint32 sample_rate\nstring sample_format\nuint32 bitrate\n"
        "string coding_format"
    ),
}


def typestore() -> Any:
    """Return a typestore of rosbags that knows all messages of this module.

    Raises
    ------
    InputError
        If the packages of the extra ``mcap`` are missing.
    """
    import_extra("mcap", "bags of ROS 2", "rosbags")
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(
        {
            name: parsed
            for asked, text in _TYPES.items()
            for name, parsed in get_types_from_msg(text, asked).items()
        }
    )
    return store


class Messages:
    """Makes messages, each as bytes (CDR).

    Parameters
    ----------
    store
        As `typestore` returns it.
    frame
        Name of the camera's frame, in the headers.
    """

    def __init__(self, store: Any, frame: str = "fingertip_camera") -> None:
        """Make nothing yet."""
        self._store, self._types, self._frame = store, store.types, frame

    def picture(self, at_ns: int, data: bytes) -> bytes:
        """Return a JPEG."""
        return self._bytes(
            PICTURE, header=self._header(at_ns), format="jpeg", data=np.frombuffer(data, np.uint8)
        )

    def marks(self, at_ns: int, position: NDArray[np.floating]) -> bytes:
        """Return markers, (n, 2), px, as points on the picture; those lost (NaN) are left out.

        Foxglove counts from the corner of the first pixel, we from its middle.
        """
        point, colour = (
            self._type("foxglove_msgs/msg/Point2"),
            self._type("foxglove_msgs/msg/Color"),
        )
        seen = position[np.isfinite(position).all(axis=1)].astype(np.float64) + 0.5
        red = colour(r=1.0, g=0.2, b=0.2, a=1.0)
        points = self._type("foxglove_msgs/msg/PointsAnnotation")(
            timestamp=self._time(at_ns),
            type=_POINTS,
            points=[point(x=x, y=y) for x, y in seen.tolist()],
            outline_color=red,
            outline_colors=[],
            fill_color=red,
            thickness=_SIZE_PX,
        )
        return self._bytes(MARKS, circles=[], points=[points], texts=[])

    def sound(self, at_ns: int, samples: NDArray[np.int16], rate_hz: int) -> bytes:
        """Return samples, (n, channel)."""
        content = np.ascontiguousarray(samples, "<i2").view(np.uint8).ravel()
        return self._bytes(
            SOUND, timestamp=self._time(at_ns), data=content, format=PCM, sample_rate=rate_hz,
            number_of_channels=samples.shape[1],
        )  # fmt: skip

    def number(self, value: float) -> bytes:
        """Return a number."""
        return self._bytes(NUMBER, data=float(value))

    def numbers(self, values: NDArray[np.floating], labels: tuple[str, ...]) -> bytes:
        """Return an array, whose dims are named."""
        dimension = self._type("std_msgs/msg/MultiArrayDimension")
        sizes = values.shape
        strides = [int(np.prod(sizes[n:])) for n in range(len(sizes))]
        layout = self._type("std_msgs/msg/MultiArrayLayout")(
            dim=[
                dimension(label=label, size=size, stride=stride)
                for label, size, stride in zip(labels, sizes, strides, strict=True)
            ],
            data_offset=0,
        )
        content = np.ascontiguousarray(values, np.float32).ravel()
        return self._bytes(NUMBERS, layout=layout, data=content)

    def text(self, said: str) -> bytes:
        """Return a text."""
        return self._bytes(TEXT, data=said)

    def _header(self, at_ns: int) -> Any:
        return self._type("std_msgs/msg/Header")(stamp=self._time(at_ns), frame_id=self._frame)

    def _time(self, at_ns: int) -> Any:
        sec, nanosec = divmod(at_ns, NS)
        return self._type("builtin_interfaces/msg/Time")(sec=sec, nanosec=nanosec)

    def _type(self, name: str) -> Any:
        return self._types[name]

    def _bytes(self, name: str, **fields: Any) -> bytes:
        return bytes(self._store.serialize_cdr(self._type(name)(**fields), name))
