"""The ROS 2 messages of a bag: types, how each is made, and how they are written.

Foxglove and rerun show pictures, sound and marks on pictures if the messages have types that they
know. Those of ROS itself (`sensor_msgs`, `std_msgs`) come with rosbags; those of Foxglove and of
`audio_common` are written here as their documentation gives their fields
(https://docs.foxglove.dev/docs/sdk/schemas, https://github.com/ros-drivers/audio_common).
"""

import json
from collections.abc import Mapping
from pathlib import Path
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
NUMBER, NUMBERS = "std_msgs/msg/Float64", "std_msgs/msg/Float32MultiArray"
TEXT = "std_msgs/msg/String"
POSITIONS = "/touch/positions"
"""Topic of the markers' places, (marker, space), px."""
PCM = "pcm-s16"
_POINTS = 1
"""Of PointsAnnotation: single points, not a line."""
_SIZE_PX = 5.0
_FRAME = "fingertip_camera"
"""Name of the camera's frame, in the headers."""

Message = tuple[str, bytes]
"""Its type, and its content."""

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
            for message, text in _TYPES.items()
            for name, parsed in get_types_from_msg(text, message).items()
        }
    )
    return store


class Messages:
    """Makes messages, each its type and its bytes (CDR).

    Parameters
    ----------
    store
        As `typestore` returns it.
    """

    def __init__(self, store: Any) -> None:
        """Make nothing yet."""
        self._store, self._types = store, store.types

    def picture(self, at_ns: int, data: bytes) -> Message:
        """Return a JPEG."""
        header = self._types["std_msgs/msg/Header"](stamp=self._time(at_ns), frame_id=_FRAME)
        return self.make(PICTURE, header=header, format="jpeg", data=np.frombuffer(data, np.uint8))

    def marks(self, at_ns: int, position: NDArray[np.floating]) -> Message:
        """Return markers, (n, 2), px, as points on the picture; those lost (NaN) are left out.

        Foxglove counts from the corner of the first pixel, we from its middle.
        """
        point = self._types["foxglove_msgs/msg/Point2"]
        seen = position[np.isfinite(position).all(axis=1)].astype(np.float64) + 0.5
        red = self._types["foxglove_msgs/msg/Color"](r=1.0, g=0.2, b=0.2, a=1.0)
        points = self._types["foxglove_msgs/msg/PointsAnnotation"](
            timestamp=self._time(at_ns),
            type=_POINTS,
            points=[point(x=x, y=y) for x, y in seen.tolist()],
            outline_color=red,
            outline_colors=[],
            fill_color=red,
            thickness=_SIZE_PX,
        )
        return self.make(MARKS, circles=[], points=[points], texts=[])

    def sound(self, at_ns: int, samples: NDArray[np.int16], rate_hz: int) -> Message:
        """Return samples, (n, channel)."""
        content = np.ascontiguousarray(samples, "<i2").view(np.uint8).ravel()
        return self.make(
            SOUND, timestamp=self._time(at_ns), data=content, format=PCM, sample_rate=rate_hz,
            number_of_channels=samples.shape[1],
        )  # fmt: skip

    def numbers(self, values: NDArray[np.floating], labels: tuple[str, ...]) -> Message:
        """Return an array, whose dims are named."""
        dimension = self._types["std_msgs/msg/MultiArrayDimension"]
        sizes = values.shape
        dims = [
            dimension(label=label, size=size, stride=int(np.prod(sizes[n:])))
            for n, (label, size) in enumerate(zip(labels, sizes, strict=True))
        ]
        layout = self._types["std_msgs/msg/MultiArrayLayout"](dim=dims, data_offset=0)
        content = np.ascontiguousarray(values, np.float32).ravel()
        return self.make(NUMBERS, layout=layout, data=content)

    def make(self, name: str, **fields: Any) -> Message:
        """Return a message of a type that has these fields."""
        return name, bytes(self._store.serialize_cdr(self._types[name](**fields), name))

    def _time(self, at_ns: int) -> Any:
        sec, nanosec = divmod(at_ns, NS)
        return self._types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)


class Bag:
    """Writes a bag of ROS 2 by a `writer` of rosbags, which is to be opened and closed.

    Parameters
    ----------
    path
        Folder, which is made; in it an MCAP file of its name.
    store
        As `typestore` returns it.
    about
        What is noted of the bag.
    """

    def __init__(self, path: Path, store: Any, about: Mapping[str, str]) -> None:
        """Write nothing yet."""
        from rosbags.rosbag2 import StoragePlugin, Writer

        self.writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
        self.writer.set_custom_data("afferents", json.dumps(about))
        self._store = store
        self._topics: dict[str, Any] = {}

    def put(self, at_ns: int, topic: str, kind: str, data: bytes) -> None:
        """Write a message; none from before the zero of its clock, where a bag knows no time."""
        if at_ns < 0:
            return
        if topic not in self._topics:
            self._topics[topic] = self.writer.add_connection(topic, kind, typestore=self._store)
        self.writer.write(self._topics[topic], at_ns, data)
