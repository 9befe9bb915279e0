"""A ROS 2 node that publishes what a fingertip senses, frame by frame.

    python touch_node.py camera:0 --sensor mine.toml
    python touch_node.py SESSION/3/50                # a recording, as fast as it was recorded

Topics, and a service:

    touch/markers   sensor_msgs/PointCloud2          x, y, dx, dy, sa1: px; ra1: px per frame
    touch/shift     geometry_msgs/Vector3Stamped     mean displacement of the markers, x, y, px
    /diagnostics    diagnostic_msgs/DiagnosticArray  once a second, and when something happens
    touch/set_rest  std_srvs/Trigger                 displacement counts from where markers are now

NaN stands for what is not known: of a marker that is lost, and ra1 after a gap. Stamps say when
frames were taken, in Unix time; those of a recording begin now.
"""

import argparse
import time
from array import array
from typing import Any

import numpy as np
import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Vector3, Vector3Stamped
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header
from std_srvs.srv import Trigger

import afferents

NAMES = ("x", "y", "dx", "dy", "sa1", "ra1")
COUNTED = ("dropped", "late", "torn", "troubles")


def cloud_of(touch: afferents.Touch, header: Header) -> PointCloud2:
    """Return a cloud with a point for each marker."""
    columns = (touch.position, touch.now.displacement, touch.sa1, touch.ra1)
    values = np.column_stack(columns).astype("<f4")
    size = values.itemsize
    return PointCloud2(
        header=header, height=1, width=len(values), is_dense=False, is_bigendian=False,
        fields=[
            PointField(name=name, offset=n * size, datatype=PointField.FLOAT32, count=1)
            for n, name in enumerate(NAMES)
        ],
        point_step=len(NAMES) * size, row_step=values.nbytes, data=array("B", values.tobytes()),
    )  # fmt: skip


def health_of(touch: afferents.Touch, header: Header, before: Any, sensor: str) -> DiagnosticArray:
    """Return what was counted, which is a warning where it rose, and what happened."""
    counted = {name: getattr(touch.quality, name) for name in COUNTED}
    is_well = all(counted[name] == getattr(before, name) for name in COUNTED)
    status = DiagnosticStatus(
        level=DiagnosticStatus.OK if is_well else DiagnosticStatus.WARN,
        name="fingertip", hardware_id=sensor, message="; ".join(touch.events),
        values=[
            KeyValue(key=key, value=f"{value:g}")
            for key, value in {"lost markers": touch.lost, **counted}.items()
        ],
    )  # fmt: skip
    return DiagnosticArray(header=header, status=[status])


def publish(fingertip: Any) -> None:
    """Publish what a fingertip senses until its source ends, or ROS is shut down."""

    def set_rest(_: Any, answer: Any) -> Any:
        fingertip.set_rest()
        answer.success, answer.message = True, "asked for: /diagnostics says whether it was set"
        return answer

    rclpy.init()
    node = rclpy.create_node("fingertip")
    clouds = node.create_publisher(PointCloud2, "touch/markers", 10)
    shifts = node.create_publisher(Vector3Stamped, "touch/shift", 10)
    health = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
    node.create_service(Trigger, "touch/set_rest", set_rest)
    ahead_s = counted = told_s = None
    try:
        for touch in fingertip:
            if not rclpy.ok():
                return
            rclpy.spin_once(node, timeout_sec=0)  # who calls the service is answered here
            if ahead_s is None:
                ahead_s = time.time() - (time.monotonic() if fingertip.is_live else touch.time_s)
                counted = touch.quality
            sec, nanosec = divmod(round((touch.time_s + ahead_s) * 1e9), 10**9)
            header = Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id="fingertip_camera")
            clouds.publish(cloud_of(touch, header))
            x, y = map(float, touch.shear[:2])
            shifts.publish(Vector3Stamped(header=header, vector=Vector3(x=x, y=y, z=0.0)))
            if told_s is None or touch.events or touch.time_s - told_s >= 1:
                health.publish(health_of(touch, header, counted, fingertip.sensor.name))
                told_s, counted = touch.time_s, touch.quality
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def main() -> None:
    """Open a fingertip, and publish what it senses."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("video", help="camera:0, a video file, a recording's folder, or rig")
    parser.add_argument("--sensor", help="sensor file or name; a camera needs one")
    options, _ = parser.parse_known_args()  # the rest is for ROS
    with afferents.stream(options.video, sensor=options.sensor, speed=1) as fingertip:
        publish(fingertip)


if __name__ == "__main__":
    main()
