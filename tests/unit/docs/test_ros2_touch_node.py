"""The ROS 2 node of a fingertip, on a stand-in for rclpy: messages are ROS's own, as bytes, too."""

import importlib.util
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from afferents import load_sensor, stream, track

pytest.importorskip("rosbags")

from rosbags.typesys import Stores, get_typestore

NODE = Path(__file__).parents[3] / "docs" / "ros2" / "touch_node.py"
STORE = get_typestore(Stores.ROS2_HUMBLE)
FIRST = load_sensor("tip_b").rest_frame
ASKED = 5
"""The service is called before this touch."""


def as_ros_has_it(name):
    """Return a message's class, which takes some of its fields and refuses all others."""

    class Message(STORE.types[name]):
        def __init__(self, **given):
            assert set(given) <= {field for field, _ in STORE.fielddefs[name][1]}
            super().__init__(**given)

    return Message


class Node:
    """Keeps what is published, each message turned to bytes and back, and answers a service."""

    def __init__(self):
        self.topics, self.kinds, self.destroyed, self.spun = defaultdict(list), {}, False, 0

    def create_publisher(self, kind, topic, depth):
        name = next(name for name, type_ in STORE.types.items() if issubclass(kind, type_))
        self.kinds[topic] = name

        def publish(message):
            if hasattr(message, "data"):
                message.data = np.array(message.data, np.uint8)
            data = STORE.serialize_cdr(message, name)
            self.topics[topic].append(STORE.deserialize_cdr(data, name))

        return SimpleNamespace(publish=publish)

    def create_service(self, kind, name, answer):
        self.service, self.answer = name, answer

    def spin_once(self, node, timeout_sec):
        self.spun += 1
        if self.spun == ASKED:
            self.answered = self.answer(None, SimpleNamespace(success=False, message=""))

    def destroy_node(self):
        self.destroyed = True


@pytest.fixture
def ros(monkeypatch):
    """The node that is made, and its module."""
    node = Node()

    def add(name, **content):
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)

    for name in STORE.types:
        package, _, kind = name.split("/")
        if f"{package}.msg" not in sys.modules:
            add(package)
            add(f"{package}.msg")
        setattr(sys.modules[f"{package}.msg"], kind, as_ros_has_it(name))
    add("std_srvs")
    add("std_srvs.srv", Trigger=object())
    add(
        "rclpy", init=lambda: None, ok=lambda: True, create_node=lambda name: node,
        spin_once=node.spin_once, try_shutdown=lambda: None,
    )  # fmt: skip
    spec = importlib.util.spec_from_file_location("touch_node", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return node, module


@pytest.fixture
def clip(make_video, tmp_path):
    """Discs that stand, then slide; one is hidden at the end."""
    shift = 3 * np.sin(np.arange(60) / 4) * (np.arange(60) > 40)
    covered = [[40] if i > 50 else [] for i in range(60)]
    return make_video(tmp_path / "clip.mp4", shift, covered)


def test_the_node_publishes_what_track_says(ros, clip):
    node, module = ros
    with stream(clip, sensor="tip_b") as tip:
        module.publish(tip)
    assert node.kinds == {
        "touch/markers": "sensor_msgs/msg/PointCloud2",
        "touch/shift": "geometry_msgs/msg/Vector3Stamped",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    clouds, stored = node.topics["touch/markers"], track(clip)
    kind = np.dtype([(field.name, "<f4") for field in clouds[0].fields])
    assert [field.offset for field in clouds[0].fields] == [kind.fields[n][1] for n in kind.names]
    points = np.stack([cloud.data.view(kind) for cloud in clouds])
    position = np.stack([points["x"], points["y"]], axis=-1)
    np.testing.assert_array_equal(position, stored["position"].values[FIRST:])
    felt = ASKED + 6  # until rest is set anew, ten frames after it was asked for
    for name in ("sa1", "ra1"):
        np.testing.assert_array_equal(
            points[name][:felt], stored[name].values[FIRST : FIRST + felt]
        )
    np.testing.assert_allclose(np.hypot(points["dx"], points["dy"]), points["sa1"], atol=1e-4)
    assert np.isnan(points[-1][40].tolist()).all()
    assert all(one.point_step * one.width == one.row_step == one.data.size for one in clouds)
    shift = [one.vector.x for one in node.topics["touch/shift"]]
    np.testing.assert_allclose(shift, np.nanmean(points["dx"], axis=1), atol=0.02)
    assert node.destroyed


def test_messages_of_a_frame_have_its_time(ros, clip):
    node, module = ros
    with stream(clip, sensor="tip_b") as tip:
        module.publish(tip)
    times = [
        [one.header.stamp.sec + one.header.stamp.nanosec / 1e9 for one in node.topics[topic]]
        for topic in ("touch/markers", "touch/shift")
    ]
    assert times[0] == times[1]
    np.testing.assert_allclose(np.diff(times[0]), 1 / 90, atol=1e-4)


def test_rest_is_set_and_health_says_so(ros, clip):
    node, module = ros
    with stream(clip, sensor="tip_b") as tip:
        module.publish(tip)
    assert node.service == "touch/set_rest"
    assert node.answered.success
    first, told = (one.status[0] for one in node.topics["/diagnostics"])
    assert (first.level, first.message, first.hardware_id) == (0, "", "tip_b")
    assert {one.key: one.value for one in first.values} == {
        "lost markers": "0", "dropped": "0", "late": "0", "torn": "0", "troubles": "0"
    }  # fmt: skip
    assert told.message == "rest was set: displacement counts from here"
    assert told.level == 0


def test_what_was_missed_is_a_warning(ros, clip):
    _, module = ros
    with stream(clip, sensor="tip_b") as tip:
        touch = next(iter(tip))
    missed = replace(touch, quality=replace(touch.quality, dropped=2), events=("camera: gone",))
    for before, level in ((touch.quality, 1), (missed.quality, 0)):
        (status,) = module.health_of(missed, None, before, "tip_b").status
        assert (status.level, status.message) == (level, "camera: gone")
